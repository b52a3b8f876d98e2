"""What run.json holds, and what becomes of one that holds anything else."""

import json

import pytest
from lab_runs import left

from laptop.record.names import RUN
from laptop.record.run import (
    MAX_NUMBER,
    Column,
    DamagedRun,
    Ending,
    Run,
    RunFile,
    RunTable,
    as_json,
    read_run,
    seeds_of,
    settings,
    table,
)
from shared.version import VERSION


def test_a_run_is_read_as_it_was_written(tmp_path):
    rows = [[1, 0.5, None, "a", True], [2, float("nan"), 3, "b", False]]
    measured = table("m", "Measured", ["path", "greatest mm", "n", "speed", "is there"], rows)
    run = left(tmp_path, tables=[measured], seeds={"plant": 4}, built={"name": "x"})
    found = read_run(tmp_path)
    assert found == run
    assert found.version == VERSION
    assert [(column.name, column.unit) for column in found.tables[0].columns] == [
        *(("path", ""), ("greatest", "mm"), ("n", ""), ("speed", ""), ("is there", ""))
    ]
    assert found.rows("m")[1] == {
        **{"path": 2, "greatest mm": None, "n": 3, "speed": "b", "is there": False}
    }
    assert found.rows("another") == []


def test_everything_stands_in_the_file_what_is_usual_too(tmp_path):
    run = Run(kind="script", what="x", ending=Ending(0, "ended"))
    told = json.loads(as_json(run))
    assert told["version"] == VERSION
    assert (told["arm"], told["tables"], told["ending"]["seconds"]) == (None, [], None)


def test_single_values_are_a_table_with_units():
    told = settings({"pace": 1.0, "in all s": 3})
    assert told.rows == [["pace", 1.0], ["in all s", 3]]


def test_seeds_are_told_by_what_they_are_of():
    found = seeds_of(plant="backlash=3,seed=4", scene="A.seed=7, B.seed=8,seed=x", other=None)
    assert found == {"plant": 4, "scene A": 7, "scene B": 8}


def test_of_an_emulated_brick_plant_and_seeds_are_told():
    told = Run(kind="script", what="a run", ending=Ending(0, "ended"), set_up={"mode": "look"})
    told.on_emulated_brick("backlash=3,seed=4", "seed=5", cpu=2)
    assert list(told.set_up.items()) == [
        ("mode", "look"),
        ("brick", "emulated"),
        ("cpu", 2),
        ("plant", "backlash=3,seed=4"),
    ]
    assert told.seeds == {"plant": 4, "scene": 5}
    plain = Run(kind="script", what="a run", ending=Ending(0, "ended"))
    plain.on_emulated_brick()
    assert (plain.set_up, plain.seeds) == ({"brick": "emulated"}, {})


@pytest.mark.parametrize(
    ("content", "why"),
    [
        (b"{", "run.json is no JSON"),
        (b"\xff\xfe", "run.json is not a text file"),
        (b'{"kind": ' + b"[" * 100_000, "run.json is no"),
        (b"[1]", "not as it is written (Expected 'object', got 'array')"),
        (b"{}", "missing required field 'kind'"),
        (b'{"kind": 7}', "Expected 'str', got 'int' - at '$.kind'"),
        (b'{"kind": "a", "what": "b", "ending": {"status": "0"}}', "at '$.ending.status'"),
        (b"\n" * 9_000_000, "run.json "),
    ],
)
def test_what_is_no_run_is_told_in_a_line(tmp_path, content, why):
    (tmp_path / RUN).write_bytes(content)
    with pytest.raises(DamagedRun) as failed:
        read_run(tmp_path)
    assert why in str(failed.value)
    assert "\n" not in str(failed.value)


def test_a_link_and_a_file_that_is_not_there_are_no_run(tmp_path):
    with pytest.raises(DamagedRun, match=r"^run.json cannot be read: No such file"):
        read_run(tmp_path)
    left(tmp_path / "true")
    (tmp_path / RUN).symlink_to(tmp_path / "true" / RUN)
    with pytest.raises(DamagedRun, match="run.json is a link"):
        read_run(tmp_path)


@pytest.mark.parametrize("name", ["/etc/x", "../x", "a/../../x", "", ".", "a\\b"])
def test_a_file_of_a_run_lies_in_its_folder(tmp_path, name):
    left(tmp_path, files=[RunFile(name, "x")])
    with pytest.raises(DamagedRun, match="is outside of the run's folder"):
        read_run(tmp_path)


@pytest.mark.parametrize("value", [2 * MAX_NUMBER, -2 * MAX_NUMBER, 10**15])
def test_a_number_beyond_all_that_a_run_measures_is_damage(tmp_path, value):
    with_rows = RunTable("m", "", [Column("x")], [[value]])
    left(tmp_path, tables=[with_rows])
    with pytest.raises(DamagedRun, match="the table 'm' holds .* beyond any run's"):
        read_run(tmp_path)
    assert table("m", "", ["x"], [[value]]).rows == [[None]]  # and a command writes none
    left(tmp_path, ending=Ending(0, "", value))
    with pytest.raises(DamagedRun, match="it took .* beyond any run's"):
        read_run(tmp_path)


def test_words_that_are_no_text_are_written_all_the_same(tmp_path):
    left(tmp_path, what="caf\udce9.py", typed=["simulate", "caf\udce9.py"])
    assert read_run(tmp_path).typed == ["simulate", "caf?.py"]


def test_a_row_is_a_line_of_the_file_and_no_text_takes_its_place(tmp_path):
    told = table("m", "", ["x", "y"], [[1, "a"], [2.5, None]])
    run = left(tmp_path, tables=[told, table("n", "", ["x"], [])], notes=["\x000", "\x001"])
    assert '    [1, "a"],\n    [2.5, null]\n' in (tmp_path / RUN).read_text()
    assert read_run(tmp_path) == run


@pytest.mark.parametrize(
    ("many", "why"),
    [
        (lambda: {"tables": [table("m", "", [], [])] * 201}, "more than 200 tables"),
        (lambda: {"files": [RunFile(f"{k}") for k in range(501)]}, "or 500 files"),
        (lambda: {"files": [RunFile("x")] * 2}, "names a file twice"),
        (lambda: {"tables": [table("m", "", ["x"], [[1]] * 300_001)]}, "more than 300000 values"),
        (lambda: {"tables": [table("m", "", ["x"] * 65, [])]}, "'m' has more than 64 columns"),
    ],
)
def test_more_than_any_run_has_is_damage(tmp_path, many, why):
    left(tmp_path, **many())
    with pytest.raises(DamagedRun, match=why):
        read_run(tmp_path)


def test_a_row_has_a_cell_for_each_column(tmp_path):
    left(tmp_path, tables=[RunTable("m", "", [Column("x"), Column("y")], [[1]])])
    with pytest.raises(DamagedRun, match="a row of the table 'm' has too many or few values"):
        read_run(tmp_path)
