"""The arms of a report."""

from laptop.record.figures.arm_numbers import numbers_of
from laptop.record.report.report_run import ReportRun
from laptop.record.report.set_up import BUILT, COMES_ALONG, RECORD, describe_arms
from laptop.record.run import Ending, Run
from shared.arm_description import find_arm, read_arm

PLANAR, SPATIAL = (numbers_of(read_arm(find_arm(name))) for name in ("planar", "spatial"))


def a_run(name, arm, built=None):
    return ReportRun(name, Run(kind="drawing", what="", ending=Ending(0, ""), arm=arm, built=built))


def test_an_arm_of_several_runs_stands_once_with_the_numbers_that_they_kept():
    changed = {**PLANAR, "speed_cm_s": 5.0}
    runs = [a_run("a", PLANAR), a_run("b", PLANAR), a_run("c", changed, PLANAR)]
    for number, run in enumerate(runs, 1):
        run.number = number
    arms = describe_arms(runs)
    assert [[run.name for run in arm.runs] for arm in arms] == [["a", "b", "c"], ["c"]]
    assert arms[0].source == f"R1, R2: {RECORD}; R3: {BUILT}"
    assert arms[1].source == RECORD
    assert arms[0].table.caption.startswith("The arm planar: draws at 12 cm/s")
    assert arms[1].table.caption.startswith("The arm planar: draws at 5 cm/s")
    shoulder = ["shoulder", "11.3", "large", "A", "1", "\u221290", "170", "2", "180", "\u2013"]
    assert arms[0].table.rows[0] == shoulder


def test_of_an_older_run_the_file_that_comes_along_tells():
    run = a_run("a", {"name": "spatial"})
    (arm,) = describe_arms([run])
    assert (arm.source, arm.chain) == (COMES_ALONG, "spatial")
    assert [row[0] for row in arm.table.rows] == ["base", "shoulder", "elbow"]
    assert arm.table.rows[1][-1] == "106"


def test_an_arm_that_nobody_describes_is_a_gap():
    for name in ("mine", "../arms/planar", "README"):
        run = a_run("a", {"name": name})
        assert describe_arms([run]) == []
        assert run.gaps == [f"its files do not hold the numbers of its arm {name.split('/')[-1]}"]


def test_numbers_that_are_not_as_they_are_written_are_a_gap():
    for numbers in (
        {"joints": [1]},
        {"joints": [{"link_cm": "long"}]},
        {"joints": [{}], "name": 7},
        {"joints": [None] * 9},
    ):
        run = a_run("a", numbers)
        assert describe_arms([run]) == []
        assert run.gaps[0].startswith("left out: run.json")


def test_no_folder_of_a_computer_stands_in_an_arms_table():
    path = "/home/anna/x.py"
    joint = {**PLANAR["joints"][0], "name": path, "motor": path, "port": path}
    numbers = {**PLANAR, "name": path, "joints": [joint], "pen": {"motor": path, "port": path}}
    run = a_run("a", numbers)
    (arm,) = describe_arms([run])
    assert arm.table.caption == "The arm x.py: draws at 12 cm/s, pen by a x.py motor at port x.py"
    assert arm.table.rows[0][:4] == ["x.py", "11.3", "x.py", "x.py"]
    run = a_run("a", {**numbers, "joints": []})
    assert describe_arms([run]) == []
    assert run.gaps == ["left out: run.json holds no joint of the arm x.py"]
