"""The mutants: each line and test is still there; what is read of a run; no mutant is run."""

import ast
from pathlib import Path
from types import SimpleNamespace

import pytest
from places import ROOT

from tests.claims import mutants
from tests.claims.mutant_list import GROUPS, MUTANTS, Mutant
from tests.claims.mutants import LineGone, MutantResult

KILLED = MutantResult("zero", "one", "a.py", "test_a.py::test_b", "failed", 3.4, True)
SURVIVES = MutantResult("zero", "two", "a.py", "", "passed", 1.0, False)
UNBROKEN = MutantResult("", "nothing", "", "", "passed", 90.0, True)


@pytest.mark.parametrize("mutant", MUTANTS, ids=lambda mutant: mutant.what)
def test_its_line_is_there_once_and_its_tests_are_run_by_all(mutant):
    source = (Path(ROOT) / mutant.file).read_text(encoding="utf-8")
    changed = mutants.mutated(mutant, source)
    assert changed != source
    ast.parse(changed)
    assert mutant.tests
    for path in mutant.tests:
        file, _, name = path.partition("::")
        tree = ast.parse((Path(ROOT) / file).read_text(encoding="utf-8"))
        if name:
            name = name.partition("[")[0]
            (test,) = (one for one in tree.body if getattr(one, "name", "") == name)
            assert not any("claims" in ast.unparse(mark) for mark in test.decorator_list)


def test_each_guards_one_of_the_kinds_and_all_kinds_are_guarded():
    assert sorted({mutant.group for mutant in MUTANTS}) == sorted(GROUPS)
    assert len({mutant.what for mutant in MUTANTS}) == len(MUTANTS) >= 30


@pytest.mark.parametrize(("source", "count"), [("a = 2\n", 0), ("  a = 1\na = 1\n", 2)])
def test_a_line_that_is_gone_is_told_in_one_line(source, count):
    mutant = Mutant("zero", "one", "a.py", "a = 1", "a = 3", ("tests",))
    with pytest.raises(LineGone, match=rf"^a\.py has {count} lines 'a = 1', not one: .*$") as error:
        mutants.mutated(mutant, source)
    assert "\n" not in str(error.value)
    assert mutants.mutated(mutant, "if b:\n    a = 1\n") == "if b:\n    a = 3\n"


def test_by_kind_the_unbroken_come_first_with_the_same_tests():
    unbroken, *chosen = mutants.BENCH.cases(SimpleNamespace(groups=("jobs",)))
    assert {mutant.group for mutant in chosen} == {"jobs"}
    assert unbroken.file == ""
    assert set(unbroken.tests) == {path for mutant in chosen for path in mutant.tests}


def test_the_test_that_failed_first_is_read():
    out = "..F\nFAILED tests/a/test_b.py::test_c[1 - 2/3] - assert 1 == 2\n1 failed\n"
    assert mutants.failed_test(out) == "test_b.py::test_c[1 - 2/3]"
    assert mutants.failed_test("3 passed\n") == ""
    assert mutants.last_line("ERROR: not found\n\n") == "ERROR: not found"


def test_the_table_has_a_row_for_each_and_the_status_tells_a_survivor():
    results = [UNBROKEN, KILLED, SURVIVES]
    assert mutants.table(results) == [
        ["zero", "one", "a.py", "test_a.py::test_b", "3"],
        ["zero", "two", "a.py", "SURVIVES: passed", "1"],
    ]
    assert mutants.summary(results) == ("1 of 2 are killed. Unbroken the tests passed (90 s).")
    assert mutants.BENCH.holds([UNBROKEN, KILLED])
    assert not mutants.BENCH.holds(results)
