"""The bench of drawing by sight: which cases, and what its table says of results."""

import math

from laptop.bench import ilc_bounds, ilc_drawings
from laptop.bench.ilc import HEADINGS, IlcResult, cases, table
from laptop.bench.ilc_rig import WITHOUT, AgeingRig, IlcCase
from laptop.measure.ilc.trials import merged_numbers
from shared.arm_description import find_arm, read_arm


def result(greatest, *, wrong=True, path="line 1", failed=False, means=(), rendered=False):
    case = IlcCase(1, "planar", path, wrong, rendered)
    if failed:
        return IlcResult(case, why="it fell over", failed=True)
    return IlcResult(case, greatest, (2.0, 0.5), (1.0, 0.2), (1.0,), 3.0, 0.4, means)


def test_every_seed_draws_every_path_as_built_and_as_described():
    todo = cases(range(3), rendered=1, cpu=2.0)
    assert len(todo) == len(set(todo)) == 3 * 2 * 5
    assert {case.arm for case in todo if case.seed == 1} == {"geared"}
    assert {(case.seed, case.wrong) for case in todo if case.rendered} == {(0, True)}
    assert {case.cpu for case in todo} == {2.0}


def test_the_table_has_a_row_for_each_path_and_for_all_of_a_kind():
    rows = table(
        [
            result((4.0, 1.0), rendered=True),
            result((8.0, 2.0), path="line 2"),
            result((), path="line 2", failed=True),
            result((1.0, 0.5), wrong=False, means=(1.25, 1.0)),
            result((3.0, 0.5), path="wave"),
        ]
    )
    assert [row[1:3] for row in rows] == [
        ["line 1", "otherwise"],
        ["line 2", "otherwise"],
        ["wave", "otherwise"],
        ["all lines", "otherwise"],
        ["all curves", "otherwise"],
        ["lines, rendered", "otherwise"],
        ["line 1", "as described"],
        ["all lines", "as described"],
    ]
    assert {len(row) for row in rows} == {len(HEADINGS)}
    lines = dict(zip(HEADINGS, rows[3], strict=True))
    assert lines["drawn"] == "2 of 3"
    assert lines["greatest, median"] == "6.00 1.50"
    assert lines["p95"] == "7.80 1.95"
    assert rows[-1][-1] == "1.25 1.00 (1 learned)"


def test_a_group_of_which_nothing_was_drawn_has_no_figures():
    (row, _) = table([result((), failed=True)])
    assert row[3:] == ["0 of 1"] + [""] * (len(HEADINGS) - 4)


def test_each_cause_is_taken_away_of_the_same_arms():
    todo = ilc_bounds.cases(range(2), ["line 1", "line 2"])
    assert len(todo) == len(set(todo)) == 2 * 2 * len(WITHOUT)
    plants = {
        without: AgeingRig(IlcCase(7, "planar", "line 1", without=without)) for without in WITHOUT
    }
    assert plants["backlash"].arm.joints[0].backlash == 0 < plants[""].arm.joints[0].backlash
    assert plants["backlash"].arm.joints[0].link == plants[""].arm.joints[0].link
    changed = plants["half of the motors' friction"].plant
    assert changed == plants[""].plant + ",rotor_friction=0.5"


def test_what_a_cause_costs_is_told_of_pairs():
    def drawn(greatest, without="", path="line 1"):
        case = IlcCase(1, "planar", path, without=without)
        return IlcResult(case, (9.0, greatest), (2.0, 0.5), (1.0, 0.2), (1.0,), 3.0, 0.4)

    failed = IlcResult(IlcCase(1, "planar", "line 3", without="backlash"), failed=True)
    rows = ilc_bounds.table(
        [
            drawn(1.0),
            drawn(3.0, path="line 2"),
            drawn(0.5, "backlash"),
            drawn(1.5, "backlash", "line 2"),
            failed,
        ]
    )
    plain, without = (dict(zip(ilc_bounds.HEADINGS, row, strict=True)) for row in rows)
    assert plain["greatest, median"] == "2.00"
    assert plain["less than with all, mean"] == ""
    assert without["drawn"] == "2 of 3"
    # 0.5 and 1.5 less: their mean, and its standard error.
    assert without["less than with all, mean"] == f"1.00 +- {math.sqrt(0.5) / math.sqrt(2):.2f}"


def test_thirty_strokes_of_the_sunflower_stay_apart():
    for arm in ("planar", "geared"):
        plan = ilc_drawings.plan_of(read_arm(find_arm(arm)))
        assert len(merged_numbers(plan)) == ilc_drawings.STROKES


def test_drawings_are_told_by_arm_and_by_how_many_strokes_were_rehearsed():
    def drawn(arm, count, greatest, kinds=()):
        case = IlcCase(1, arm, ilc_drawings.PATH)
        return ilc_drawings.DrawingResult(case, count, greatest, greatest / 2, 10.0 * count, kinds)

    failed = ilc_drawings.DrawingResult(IlcCase(2, "planar", ilc_drawings.PATH), 6, failed=True)
    rows = ilc_drawings.table(
        [
            drawn("geared", 0, 3.0),
            drawn("planar", 6, 2.0, ("zeros",)),
            drawn("planar", 6, 4.0),
            failed,
            drawn("planar", 0, 8.0),
        ]
    )
    assert [row[:2] for row in rows] == [
        ["planar", "0 of 30"],
        ["planar", "6 of 30"],
        ["geared", "0 of 30"],
    ]
    some = dict(zip(ilc_drawings.HEADINGS, rows[1], strict=True))
    assert some["drawn"] == "2 of 3"
    assert some["foretold"] == "1 of 2"
    assert some["greatest, median"] == "3.00"
    assert some["rehearsals, s"] == "60"
