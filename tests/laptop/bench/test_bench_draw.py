"""The drawing bench: what it draws in space, and how it tells of it."""

import itertools
import math
from collections import Counter
from dataclasses import replace

import pytest
from click.testing import CliRunner

from laptop.bench import draw
from laptop.cli.main import laptop
from robot.driver import LINES
from robot.motion.kinematics import inverse, jacobian

FELT, WITHOUT, NOT_FED, OFF = "felt", "no preload", "not fed forward", "off"


def case(line, weight=FELT, play=2.0, at=draw.EVERY_JOINT, plant=""):
    points = LINES[3][draw.SPACE_LINES.index(line)]
    return draw.DrawCase("spatial", "smooth", "", plant, play, points, line, at, weight)


def floors(*args, **options):
    """The greatest deviation of a line, in floors."""
    result = draw.draw(case(*args, **options))
    assert result.error == ""
    return result.greatest / result.floor


@pytest.mark.short("level", rest="claims")
@pytest.mark.parametrize("line", ["upright", "level", "slanting"])
def test_with_gravity_and_no_play_lines_are_within_one_and_a_half_floors(line):
    assert floors(line, play=0.0) <= 1.5


@pytest.mark.claims
@pytest.mark.parametrize(
    ("line", "at"), [("level", "shoulder"), ("upright", "elbow"), ("slanting", "elbow")]
)
def test_the_preload_makes_up_for_the_play_of_a_loaded_joint(line, at):
    assert floors(line, at=at) < 2
    assert floors(line, WITHOUT, at=at) > 4
    assert floors(line, OFF, at=at) < 1.5


@pytest.mark.claims
def test_a_turntable_has_no_preload_and_needs_none():
    cases = [case("level", weight, at="base") for weight in (FELT, WITHOUT)]
    # (In no time: to work out the preload takes some.)
    with_it, without = (draw.draw(replace(one, cpu=0.0)) for one in cases)
    assert with_it == without
    for one in cases:
        drawn = draw.draw(one)
        assert drawn.greatest < 1.5 * drawn.floor


@pytest.mark.claims
def test_the_sag_is_fed_forward():
    assert draw.sag(NOT_FED) > 0.7
    assert draw.sag(FELT) < 0.55


def test_play_is_described_where_it_is():
    plays = [joint.backlash for joint in draw.described("spatial", 2.0, "elbow").joints]
    assert plays == [0, 0, math.radians(2)]
    assert all(joint.backlash == math.radians(2) for joint in draw.described("planar", 2.0).joints)


@pytest.mark.parametrize("line", LINES[3])
def test_the_floor_is_half_a_count_at_every_joint_in_the_worst_signs(line):
    arm = draw.described("spatial", 0.0)
    way = [(b - a) / math.dist(*line) for a, b in zip(*line)]
    worst = 0.0
    for k in range(241):
        p = [a + (b - a) * k / 240 for a, b in zip(*line)]
        slopes = jacobian(arm, inverse(arm, p, elbow=arm.elbow))
        for signs in itertools.product((-1, 1), repeat=3):
            half = [s * math.radians(0.5) / j.gear for s, j in zip(signs, arm.joints)]
            off = [sum(a * b for a, b in zip(row, half)) for row in slopes]
            along = sum(a * b for a, b in zip(off, way))
            worst = max(worst, math.dist(off, [along * w for w in way]))
    assert draw.floor(arm, line) == pytest.approx(10 * worst, rel=1e-6)


def test_every_joint_and_condition_is_drawn_once():
    cases = draw.space_cases(range(5, 8))
    assert len({(c.condition, c.plant, c.line) for c in cases}) == len(cases)
    assert {c.at for c in cases} == {draw.EVERY_JOINT, "base", "shoulder", "elbow"}
    assert {c.weight for c in cases} == set(draw.WEIGHTS)
    assert sum(c.plant == "seed=6" for c in cases) == 3 * 4


def test_a_row_per_condition_and_two_for_many_plants():
    def result(condition, line, greatest, error=""):
        return draw.DrawResult(
            "spatial", "smooth", condition, line, 0.5, greatest, 0.1, 0.1, 0.1, 3.0, 9, error
        )

    rows = draw.space_table(
        [
            result("none; off; -", "upright", 0.4),
            result("none; off; -", "level", 0.6, "Stalled: no"),
            *(result("all, 3 plants; fed; on", "random", x) for x in (1.0, 2.0, 3.0)),
        ]
    )
    assert len(draw.SPACE_HEADINGS) == len(rows[0])
    assert rows == [
        ("none", "off", "-", "0.40", "0.80", "failed", "failed", "", "", "", "", "1"),
        ("all, 3 plants", "fed", "on, p50", "", "", "", "", "", "", "2.00", "4.00", "0"),
        ("all, 3 plants", "fed", "on, p95", "", "", "", "", "", "", "3.00", "6.00", "0"),
    ]


@pytest.mark.parametrize("words", ["--arm", "--arm table"])
def test_an_arm_it_does_not_know_is_refused(words):
    shown = CliRunner().invoke(laptop, ["bench", "draw", *words.split()])
    assert shown.exit_code == 2


def test_the_planar_cases_are_drawn_by_every_method_of_their_arm():
    cases = list(draw.cases(range(1000, 1002)))
    assert {c.arm for c in cases} == {"planar", "geared"}
    assert {(c.at, c.weight) for c in cases} == {(draw.EVERY_JOINT, FELT)}
    own, down = ([c for c in cases if c.elbow == elbow] for elbow in (None, "down"))
    assert Counter((c.arm, c.method) for c in own) == dict.fromkeys(
        [("geared", method) for method in ("smooth", "steps")]
        + [
            ("planar", method)
            for method in ("smooth", "steps", "timed steps", "timed steps, halved")
        ],
        4 * 5 + 2 * 4,
    )
    assert len(own) + len(down) == len(cases)
    assert {(c.arm, c.method, c.plant, c.line) for c in down} == {
        ("planar", method, plant, line)
        for method in ("smooth", "steps", "timed steps", "timed steps, halved")
        for plant in ("backlash=2", "backlash=2,seed=1000", "backlash=2,seed=1001")
        for line in LINES[2]
    }


def test_a_row_tells_how_far_short_a_line_stops():
    line = LINES[2][0]
    results = [
        draw.draw(
            draw.DrawCase("planar", method, "", "backlash=2", 2.0, line, "line 1", elbow="down")
        )
        for method in ("smooth", "timed steps")
    ]
    rows = [dict(zip(draw.HEADINGS, row, strict=True)) for row in draw.table(results)]
    assert [row["method"] for row in rows] == ["smooth", "timed steps"]
    smooth, timed = (float(row["short mm"]) for row in rows)
    assert abs(smooth) < 2
    assert 13 < timed < 22, "it ends within 2 cm, as the encoders have it"
    assert timed == pytest.approx(results[1].end, abs=1), "it is nearly on the line"


@pytest.mark.short(every=3)
@pytest.mark.parametrize(
    "words", [(), ("--plant", "cpu=2"), ("--arm", "spatial", "--plant", "cpu=2")]
)
def test_the_bench_computes_as_slowly_as_asked_and_says_so(monkeypatch, words):
    asked = []

    def drawn(cases):
        for one in cases:
            asked.append(one.cpu)
            yield draw.DrawResult(
                one.arm, one.method, one.condition, one.name, 1.0, 0.9, 0.5, 0.5, 0.1, 2.0, 6, ""
            )

    monkeypatch.setattr(draw, "BENCH", replace(draw.BENCH, in_turn=drawn))
    monkeypatch.setattr(draw, "sag", lambda weight, cpu: 0.5)
    shown = CliRunner().invoke(laptop, ["bench", "draw", "--seeds", "5:6", *words])
    assert shown.exit_code == 0, shown.output
    cpu = 2.0 if words else 1.0
    assert set(asked) == {cpu}
    assert f"cpu={cpu:g}," in shown.stdout


@pytest.mark.long
def test_a_line_is_drawn_alike_whatever_this_process_has_drawn_before():
    drawn = [
        draw.DrawCase("planar", method, "", "backlash=2", 2.0, LINES[2][0], "line 1")
        for method in ("steps", "smooth")
    ]
    forwards = [draw.draw(one) for one in drawn]
    assert forwards == [draw.draw(one) for one in reversed(drawn)][::-1]
