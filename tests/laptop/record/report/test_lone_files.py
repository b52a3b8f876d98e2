"""Files that are a run alone."""

import pytest
from servo_log import log_text

from laptop.record.report.lone_files import is_track, read_lone_log, read_track
from laptop.record.run import SERVO, TRACKING, DamagedRun


def test_a_log_tells_goal_way_and_steps(tmp_path):
    file = tmp_path / "servo.jsonl"
    file.write_text(log_text(off=2.0, method="broyden"))
    run = read_lone_log("servo.jsonl", file)
    (goal,) = run.run.rows("goals")
    assert {key: goal[key] for key in ("goal", "method", "ended", "moves", "time s")} == {
        **{"goal": "marker", "method": "broyden", "ended": "converged", "moves": 4, "time s": 4.5}
    }
    assert goal["truly off px"] is None
    assert (run.run.kind, run.run.methods, run.arm) == (SERVO, ["broyden"], "planar")
    assert (run.outcome, run.run.ending.seconds) == ("converged", 4.5)
    assert len(run.figures) == 3
    assert [len(table.rows) for table in run.tables] == [5]


@pytest.mark.parametrize(
    "spoil",
    [
        lambda text: '{"kind": "run", "t": 0}\n',
        lambda text: text.replace('"t": 4.5', '"t": "soon"'),
        lambda text: text.replace('"s": [', '"s": [["x"], '),
    ],
)
def test_a_log_that_is_not_as_it_is_written_is_damaged(tmp_path, spoil):
    file = tmp_path / "servo.jsonl"
    file.write_text(spoil(log_text()))
    with pytest.raises(DamagedRun, match=r"^the log is not as visual_servoing.py writes it$"):
        read_lone_log("servo.jsonl", file)


def test_a_log_in_which_nothing_was_seen_says_so(tmp_path):
    text = log_text().splitlines(keepends=True)
    (tmp_path / "a.jsonl").write_text(text[0] + text[-1])
    run = read_lone_log("a.jsonl", tmp_path / "a.jsonl")
    assert run.gaps == ["its log holds no place at which the marker was seen"]
    assert (run.figures, run.tables) == ([], [])


def test_a_csv_of_markers_tells_how_often_each_was_seen(tmp_path):
    file = tmp_path / "mine.csv"
    file.write_text(
        "frame,t,camera,marker,u,v,confidence\n"
        "1,5.0,A,goal,10,20,1\n1,5.0,B,goal,,,\n2,5.5,A,goal,,,\n2,5.5,B,goal,,,\n"
    )
    assert is_track(file)
    run = read_track("mine.csv", file)
    assert run.run.kind == TRACKING
    assert run.tables[0].rows == [["A", "goal", "2", "50", "0.5"], ["B", "goal", "2", "0", "0.5"]]
    assert len(run.figures) == 1
    file.write_text("frame,t,marker,u,v,confidence\n1,5.0,goal,,,\n")
    assert read_track("mine.csv", file).gaps == ["mine.csv: no marker was seen"]
    file.write_text("frame,t,marker,u,v,confidence\n1,5.0,goal,x,,\n")
    with pytest.raises(DamagedRun, match="a row of goal holds no numbers"):
        read_track("mine.csv", file)
    file.write_text("a,b\n")
    assert not is_track(file)
