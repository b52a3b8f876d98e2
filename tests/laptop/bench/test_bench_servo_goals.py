"""The bench of servoing: its modes, goals one after the other, and the budget of who is told."""

import subprocess
import sys
from dataclasses import replace

import pytest
from places import ROOT

from laptop.bench import servo, servo_setups, servo_table
from laptop.bench.bench import BadBench
from laptop.bench.servo import FOLLOW_WINDOW, ServoCase, ServoResult, StandingGoals
from laptop.bench.servo_scenarios import SCENARIOS, ServoScenario
from laptop.cli.main import laptop
from shared.messages import Start

SEED = 77
LOOK = replace(SCENARIOS["nominal"][0][1], mode="look")
STREAM = replace(LOOK, mode="stream")
RUN = ServoResult("goals, first", "planar", "chain", 1, True, True, "converged", 5, 6, 36, 6.0, 2.0)


def run(method, scenario=LOOK, arm="planar", **options):
    """The results of one method on one set-up."""
    return servo.run_case(ServoCase("nominal", scenario, arm, SEED, (method,), **options))


# ---- modes


@pytest.mark.parametrize("mode", ["look", "stream"])
@pytest.mark.parametrize("method", ["chain", "oracle"])
def test_a_run_is_in_the_mode_that_is_asked_for(method, mode):
    (result,) = run(method, replace(LOOK, mode=mode))
    assert result.success
    assert result.mode == mode


@pytest.mark.parametrize("method", ["report", "peer-ibvs"])
def test_a_method_that_only_looks_says_so(method):
    scenario = replace(STREAM, tolerance=200.0)  # it is reached soon
    assert run(method, scenario)[0].mode == "look"


def modes_of(name, mode=None):
    return {case.scenario.mode for case in servo.cases(range(5, 6), name, mode=mode)}


def test_where_no_mode_is_asked_for_it_is_that_of_the_brick():
    assert modes_of("nominal") == modes_of("lego") == {Start().mode}
    assert modes_of("latency") == modes_of("moving") == {"stream"}
    assert ServoScenario().mode == Start().mode


@pytest.mark.parametrize("mode", ["look", "stream"])
def test_all_conditions_are_in_the_mode_that_is_asked_for(mode):
    assert modes_of("nominal", mode) == modes_of("latency", mode) == {mode}


FOLLOWS = """
from shared import messages
start = messages.Start
messages.Start = lambda *args, **options: start(*args, **options)._replace(mode="look")
from laptop.bench import servo
(case,) = servo.cases(range(5, 6), "nominal", ("planar",))
assert case.scenario.mode == "look"
"""


def test_another_default_is_the_benchs_at_once():
    subprocess.run([sys.executable, "-c", FOLLOWS], cwd=ROOT, check=True)


def test_every_table_says_in_which_mode_its_methods_ran():
    streamed = replace(RUN, mode="stream")
    for headings, rows in (
        (servo_table.HEADINGS, servo_table.table([streamed])),
        (servo_table.MOVING_HEADINGS, servo_table.table([replace(streamed, rms=4.0)])),
        (servo_table.PHASES_HEADINGS, servo_table.phases_table([replace(streamed, success=False)])),
    ):
        (row,) = rows
        assert dict(zip(headings, row))["mode"] == "stream"


# ---- goals


def further_goals(setting, cameras, count):
    return servo_setups.further_goals(setting, cameras, replace(LOOK, goals=count + 1))


def test_goals_that_follow_are_in_every_picture_and_a_way_off():
    for arm in ("planar", "spatial"):
        setting, cameras = servo_setups.set_up(arm, SEED, LOOK)
        goals = further_goals(setting, cameras, 4)
        assert len(goals) == 4
        assert goals[:2] == further_goals(setting, cameras, 2)
        for before, goal in zip([setting.goal, *goals], goals):
            assert cameras.shows(goal)
            assert servo_setups.image_distance(cameras(before), cameras(goal)) >= 80
            assert goal[-1] * setting.goal[-1] > 0


def test_a_goal_stands_until_the_next_one():
    goals = StandingGoals({"A": (1.0, 2.0)})
    goals.add(3.0, {"A": (4.0, 5.0)})
    assert [goals(t)["A"][0] for t in (0.0, 2.9, 3.0, 9.0)] == [1, 1, 4, 4]


def test_where_no_other_goal_is_far_enough_off_it_goes_back(monkeypatch):
    setting, cameras = servo_setups.set_up("planar", SEED, LOOK)
    monkeypatch.setattr(servo_setups, "LEAST_WAY", 2000)
    goals = further_goals(setting, cameras, 3)
    assert goals == [setting.start, setting.goal, setting.start]


@pytest.mark.parametrize("scenario", [LOOK, STREAM], ids=["look", "stream"])
def test_the_second_goal_is_reached_by_what_was_learned_at_the_first(scenario):
    (alone,) = run("chain", scenario)
    first, second = run("chain", replace(scenario, goals=2))
    assert replace(first, scene=alone.scene) == alone
    assert (first.scene, second.scene) == ("nominal, first", "nominal, later")
    assert (first.goal, second.goal) == (1, 2)
    assert first.success
    assert second.success
    assert first.phases["exploring"] > 0.5
    assert second.phases["exploring"] == 0
    assert sum(second.phases.values()) == pytest.approx(second.seconds, abs=0.01)


def test_who_learns_nothing_begins_anew_at_each_goal():
    first, second = run("report", replace(LOOK, tolerance=40.0, goals=2))
    assert first.phases["exploring"] > 0.5
    assert second.phases["exploring"] > 0.5


def test_who_is_told_the_angles_is_told_them_of_each_goal():
    results = run("clairvoyant", replace(LOOK, goals=3))
    assert [(r.success, r.moves, r.goal) for r in results] == [(True, 1, k) for k in (1, 2, 3)]


def test_the_first_goal_and_the_later_ones_have_rows_of_their_own():
    later = [replace(RUN, scene="goals, later", goal=k, seconds=2.0) for k in (2, 3)]
    first, second = servo_table.table([RUN, *later])
    at = servo_table.HEADINGS.index("time s")
    assert (first[1], first[at]) == ("goals, first", "6.0/6.0")
    assert (second[1], second[at]) == ("goals, later", "2.0/2.0")


@pytest.mark.parametrize(
    ("arguments", "word"),
    [
        ("moving --mode look", "take that"),
        ("goals --rendered", "take one of nominal"),
    ],
)
def test_what_does_not_go_together_is_refused_in_a_line(arguments, word):
    command = laptop.commands["bench"].commands["servo"]
    typed = command.make_context("servo", arguments.split()).params
    it = type("It", (), typed)
    with pytest.raises(BadBench, match=word):
        servo_table.BENCH.cases(it)


# ---- after a goal that moves


def test_the_budget_of_who_is_told_begins_with_its_motion():
    """It goes to where the goal is at first, and follows it until the others' time is over."""
    (result,) = run("clairvoyant", ServoScenario(latency=0.12, speed=10.0, mode="stream"))
    assert result.success
    assert result.seconds == pytest.approx(FOLLOW_WINDOW[1], abs=0.3)
    assert result.rms < 6


# ---- the next program


@pytest.mark.parametrize(("meanwhile", "explores"), [("program", False), ("moved", True)])
def test_the_next_program_explores_only_where_a_camera_was_moved(meanwhile, explores):
    first, second = run("chain", ServoScenario(goals=2, meanwhile=meanwhile))
    assert first.success
    assert second.success
    assert first.phases["exploring"] > 0
    assert (second.phases["exploring"] > 0) == explores


def test_a_moved_camera_sees_the_arm_where_it_stands_and_not_at_its_old_place():
    setting, cameras = servo_setups.set_up("planar", SEED, LOOK)
    moved = servo_setups.moved_cameras(setting, cameras)
    for q in (setting.start, setting.goal):
        assert moved.shows(q)
    assert servo_setups.image_distance(cameras(setting.goal), moved(setting.goal)) > 10
    assert servo_setups.set_up("planar", SEED, LOOK)[1](setting.goal) == cameras(setting.goal)
