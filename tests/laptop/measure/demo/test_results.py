"""What a demo found: judged by the truth, said in a sentence and a table."""

import re

import pytest
from rich.console import Console
from servo_runs import told, truth

from laptop.measure.demo import results
from laptop.measure.demo.results import DemoResult
from laptop.record.run import table


def lines(*offs):
    return table("paths", "", ["greatest mm"], [[off] for off in offs])


def demo(tmp_path, offs=(2.0, 1.0, 3.0), cameras="A", drawn=(1.2, 0.8, 1.0), baseline=4.0, **words):
    runs = []
    for number, off in enumerate(offs, 1):
        run = told(tmp_path, off, cameras=cameras, true=truth(off, cameras), **words)
        run.name = f"goal {number}"
        runs.append(run)
    slow = told(tmp_path, baseline, method="report", true=truth(baseline), verdict="budget spent")
    return DemoResult(runs, slow, lines=lines(*drawn))


def test_a_demo_worked_if_all_lines_are_drawn_and_all_goals_reached(tmp_path):
    found = demo(tmp_path, baseline=99.0)  # which does not count
    assert found.worked
    assert results.headline(found) == (
        "3 lines drawn, at most 1.2 mm off; all three goals truly reached, to 3.0 px or better."
    )


def test_of_an_arm_in_space_it_is_said_how_near_it_came_there(tmp_path):
    found = demo(tmp_path, cameras="AB")
    assert results.headline(found).endswith(
        "to 2.7 mm in space (3.0 px in the pictures) or better."
    )


def test_one_goal_missed_is_named(tmp_path):
    found = demo(tmp_path, offs=(2.0, 30.0, 1.0))
    assert not found.worked
    assert "goal 2 was not reached, though the brick says so" in results.headline(found)
    assert "goal 1" not in results.headline(found)


def test_one_line_missed_is_named(tmp_path):
    found = demo(tmp_path, drawn=(1.2, 0.8, None))
    assert not found.worked
    assert "2 of 3 drawn" in results.headline(found)
    assert not demo(tmp_path, drawn=()).worked
    assert not DemoResult().worked


def test_a_terminal_of_80_columns_shows_the_whole_table(tmp_path):
    console = Console(width=80, file=open("/dev/null", "w"), record=True)  # noqa: SIM115
    with console.file:
        console.print(results.table(demo(tmp_path, baseline=229.2)))
    text = console.export_text()
    assert "…" not in text
    assert re.search(r"goal 1 +report +budget spent +229\.2 +229\.2 +206\.3 +4 +4\.5 +no", text)


def test_its_record_has_lines_goals_and_all_that_the_programs_left(tmp_path, monkeypatch):
    monkeypatch.setattr("laptop.record.servo.servo_files.draw", lambda *words: [])
    found = demo(tmp_path)
    found.trouble, found.baseline = "report's method hangs", None
    found.set_up, found.timing = {"cpu": 1.0}, {"in all s": 61.0}
    for name in ("drawing/picture.png", "drawing/trace.csv", "track.csv", "tracker.txt"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text("")
    told_run, files = results.record_of(found, tmp_path)
    assert [one.name for one in told_run.tables] == [
        *("paths", "goals", "steps", "steps", "steps", "values")
    ]
    assert [*files] == [f"goal-{k}-true-path.csv" for k in (1, 2, 3)]
    words = {file.name: file.holds for file in told_run.files}
    assert words["drawing/picture.png"].startswith("The lines, drawn before")
    assert words["drawing/trace.csv"] == "the true motion of the arm: drawing"
    assert words["tracker.txt"] == ""
    assert told_run.ending.seconds == 61.0
    assert "What the brick claims decides nothing here" in told_run.notes[0]
    assert told_run.notes[1].endswith("method: report's method hangs")


@pytest.mark.parametrize(("cameras", "words"), [("A", "in the plane"), ("AB", "in space")])
def test_it_is_said_what_counts_as_reached(tmp_path, cameras, words):
    assert words in results._note(demo(tmp_path, cameras=cameras))
