"""Arms that are built otherwise than described are named before they go far; right ones pass."""

from dataclasses import replace

import pytest
from click.testing import CliRunner

from tests.claims import wrong_arms
from tests.claims.__main__ import claims
from tests.claims.wrong_arms import RIGHT, WrongArmCase, cases, run_case

SEEDS = range(1, 21)


def test_every_kind_comes_in_turn_and_as_many_right_ones():
    kinds = [case.kind for case in cases(SEEDS)]
    assert [kinds.count(kind) for kind in (*wrong_arms.WRONG, RIGHT)] == [5, 5, 5, 5, 20]


@pytest.mark.short("reversed-4", "touch-3")
@pytest.mark.parametrize(
    "case", [pytest.param(case, id=f"{case.kind}-{case.seed}") for case in cases(SEEDS)]
)
def test_each_is_as_it_should_be(case):
    result = run_case(case)
    assert result.good, result
    if case.kind in ("reversed", "swapped"):
        assert 3 < result.turned <= 15
        assert any(word in result.said for word in ("swapped", "another's port", "other way round"))
    else:
        assert result.beyond <= 15
        assert not any(motor in result.said for motor in ("Traceback", "STILL DRIVEN"))
    assert result.status == (0 if case.kind not in ("no stops", "touch") else result.status)


def test_what_turns_too_far_is_told_by_table_and_status(monkeypatch):
    monkeypatch.setattr(wrong_arms, "MOST_TURNED", 2.0)
    only = WrongArmCase(4, "reversed")
    here = replace(wrong_arms.BENCH, in_turn=lambda todo: iter([run_case(only)]))
    monkeypatch.setattr(wrong_arms, "BENCH", here)
    shown = CliRunner().invoke(claims, ["wrong-arms", "--seeds", "4:5"])
    assert shown.exit_code == 1
    assert " NO " in shown.stdout
    assert "0 of 1 reversed or swapped named in time" in shown.stdout
