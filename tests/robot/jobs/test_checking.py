"""All of a job is looked at before anything moves: limits, the table, what was learned, times."""

import jobs
import pytest
from drawn_jobs import move
from rig import Shell

from robot.jobs.checking import check_strokes
from shared.arm_description import find_arm, read_arm
from shared.job import BadJob, Job, header_of, write_job

PLANAR, SPATIAL = (read_arm(find_arm(name)) for name in ("planar", "spatial"))


def written(folder, strokes, arm=PLANAR):
    path = str(folder / "a.job")
    write_job(path, header_of(arm, "a", 12.0, strokes, 0.0, 20.0), strokes)
    return path


def refusal(path, arm=PLANAR):
    with pytest.raises(BadJob) as error:
        list(check_strokes(Job(path, arm), arm))
    return str(error.value)


GOOD = move((0, 100), (20, 100)), move((40, 100), (20, 100))


def test_strokes_that_the_arm_can_draw_are_counted(tmp_path):
    path = written(tmp_path, GOOD)
    assert list(check_strokes(Job(path, PLANAR), PLANAR)) == [1, 2]


def test_the_last_stroke_is_looked_at_before_the_first_is_drawn(tmp_path, monkeypatch, capsys):
    shell = Shell(tmp_path, monkeypatch, capsys)
    path = written(tmp_path, [*GOOD, move((-85, 100), (-120, 100))])
    shown = shell.run("job", path)
    assert shown.status == 1
    assert "stroke 3 needs the shoulder at -120.0 deg, beyond its limits" in shown.err
    assert len(shown.err.splitlines()) == 1
    assert not shell.ink()
    assert shown.out == ""


def test_what_was_learned_of_a_later_stroke_is_looked_at_too(tmp_path):
    (stations, angles), stroke = ([0.0, 1.0], [[0.0, 0.5], [0.0, 0.0]]), GOOD[1]
    path = written(tmp_path, [GOOD[0], stroke._replace(offsets=[(stations, angles)])])
    assert "what was learned of stroke 2 does not fit" in refusal(path)


def test_an_upright_arm_is_kept_off_the_table(tmp_path):
    above, below = (0, 30, -60), (0, -20, -75)
    assert list(check_strokes(Job(written(tmp_path, [move(above, above[:2] + (-61,))], SPATIAL),
                                  SPATIAL), SPATIAL)) == [1]  # fmt: skip
    path = written(tmp_path, [move(above, above[:2] + (-61,)), move(above, below)], SPATIAL)
    assert "stroke 2 goes " in refusal(path, SPATIAL)
    assert "cm into the table" in refusal(path, SPATIAL)


def test_no_part_goes_deeper_into_the_table_than_half_a_centimetre(tmp_path):
    above, deepest, deeper = (0, 0, -20), (0, -20, -45), (0, -20, -46)  # 0.48 cm and 0.54 cm
    path = written(tmp_path, [move(above, deepest)], SPATIAL)
    assert list(check_strokes(Job(path, SPATIAL), SPATIAL)) == [1]
    path = written(tmp_path, [move(above, deeper)], SPATIAL)
    assert "stroke 1 goes 0.5 cm into the table" in refusal(path, SPATIAL)


def test_jobs_as_they_are_planned_pass(tmp_path):
    path = jobs.write(tmp_path)
    assert list(check_strokes(Job(path, PLANAR), PLANAR)) == [1, 2, 3]
    path = jobs.write(tmp_path, [((14.0, -2.0, 0.0), (14.0, 4.0, 0.0))], arm="spatial")
    assert list(check_strokes(Job(path, SPATIAL), SPATIAL)) == [1]
