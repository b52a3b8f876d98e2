"""The log of a job is read as it was written, and what is none is refused in one line."""

import pytest

from shared.job_log import BadLog, LogRow, heading, line_of, read_log

ROWS = [LogRow(1, 0.05, 103.2134, False, (0.5, -0.25)), LogRow(2, 7.0, 110.0, True, (1.0, 2.0))]


def written(tmp_path, text):
    path = tmp_path / "log.csv"
    path.write_text(text)
    return str(path)


def test_a_log_is_read_as_it_was_written(tmp_path):
    text = heading(2) + "".join(map(line_of, ROWS))
    assert text.startswith("stroke,plan,t,rest,q1,q2\n1,0.0500,103.2134,0,0.500000,-0.250000\n")
    assert read_log(written(tmp_path, text)) == ROWS


def test_a_line_that_a_crash_has_cut_off_is_left_out(tmp_path):
    text = heading(2) + line_of(ROWS[0]) + line_of(ROWS[1])[:-9]
    assert read_log(written(tmp_path, text)) == ROWS[:1]


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("", "does not begin as a log does"),
        ("stroke,plan,t,rest\n", "does not begin as a log does"),
        (heading(2) + "1,0,0,0,1\n", "holds the line '1,0,0,0,1'"),
        (heading(2) + "0,0,0,0,1,1\n", "holds the line"),
        (heading(2) + "1,0,0,2,1,1\n", "holds the line"),
        (heading(2) + "1,0,x,0,1,1\n", "holds the line"),
        (heading(2) + "1,0,0,0,nan,1\n", "holds a number that is none"),
    ],
)
def test_what_is_no_log_is_refused(tmp_path, text, why):
    with pytest.raises(BadLog, match=why):
        read_log(written(tmp_path, text))


def test_a_log_that_is_not_there_is_told(tmp_path):
    with pytest.raises(BadLog, match="No such file.*; give a job's log"):
        read_log(str(tmp_path / "none.csv"))
