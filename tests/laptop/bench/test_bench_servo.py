"""The bench of servoing: its set-ups, what counts as success, and its tables by hand."""

import json
import math
from dataclasses import replace
from typing import NamedTuple, Tuple

import numpy as np
import pytest
from click.testing import CliRunner

from laptop.bench import servo, servo_phases, servo_setups, servo_table, show
from laptop.bench.servo import ServoCase, ServoResult
from laptop.bench.servo_scenarios import ARMS, PEERS, SCENARIOS, ServoScenario
from laptop.bench.servo_table import wilson
from laptop.cli.main import laptop
from laptop.emulator.device.plant_constants import read_plant
from laptop.emulator.rig import Rig
from robot.motion import kinematics
from robot.servoing import loop
from robot.servoing.rows import Rows
from robot.servoing.run_reporter import Verdict
from shared.run_options import METHODS

SEED = 77
NOMINAL = SCENARIOS["nominal"][0][1]
RUN = ServoResult(
    "nominal", "planar", "chain", 1, True, True, "converged", 5, 6, 36, 6.0, 2.0,
    phases=dict(zip(servo_phases.PHASES, (0.3, 1.0, 2.5, 2.0, 0.2))),
)  # fmt: skip
FAILED = replace(
    RUN, success=False, claimed=False, verdict="budget spent", moves=60, seconds=180.0, error=140.0
)


# ---- set-ups


def test_a_seed_is_one_set_up():
    first, _ = servo_setups.set_up.__wrapped__("planar", SEED, NOMINAL)
    again, _ = servo_setups.set_up.__wrapped__("planar", SEED, NOMINAL)
    late, _ = servo_setups.set_up.__wrapped__("planar", SEED, SCENARIOS["latency"][3][1])
    other, _ = servo_setups.set_up.__wrapped__("planar", SEED + 1, NOMINAL)
    assert first == again == late != other


def test_both_arms_have_the_same_task():
    planar, _ = servo_setups.set_up("planar", SEED, NOMINAL)
    geared, _ = servo_setups.set_up("geared", SEED, NOMINAL)
    assert (planar.start, planar.goal, planar.scenes) == (geared.start, geared.goal, geared.scenes)
    assert [j.gear for j in planar.arm.joints] != [j.gear for j in geared.arm.joints]


@pytest.mark.short("nominal")
@pytest.mark.parametrize("name", ["nominal", "lego"])
def test_set_ups_keep_within_their_bounds(name):
    scene = SCENARIOS[name][0][1]
    for seed in range(SEED, SEED + 8):
        setting, cameras = servo_setups.set_up("planar", seed, scene)
        one, two = setting.arm.joints
        assert 10 <= one.link <= 16
        assert 8 <= two.link <= 14
        assert setting.start[1] * setting.goal[1] > 0
        for turn, bend in (setting.start, setting.goal):
            assert abs(math.degrees(turn)) <= scene.turn < math.degrees(one.upper)
            assert scene.bend[0] <= abs(math.degrees(bend)) <= scene.bend[1]
            assert scene.bend[1] < math.degrees(two.upper)
        places = cameras["A"](setting.start), cameras["A"](setting.goal)
        assert math.dist(*places) >= 80
        assert all(0 <= u < 640 and 0 <= v < 480 for u, v in places)
        assert 0 <= setting.scenes["A"]["tilt"] <= scene.tilt
        for told, joint in zip(setting.configured.joints, setting.arm.joints, strict=True):
            assert 0 < abs(told.link / joint.link - 1) <= 0.05
            assert told._replace(link=joint.link) == joint
        assert 0 < abs(read_plant(setting.plant)["zero_error"]) <= 1.5


@pytest.mark.long
def test_set_ups_in_space_keep_within_their_bounds():
    for seed in range(SEED, SEED + 8):
        setting, cameras = servo_setups.set_up("spatial", seed, NOMINAL)
        assert list(cameras) == ["A", "B"]
        for name, tilts in (
            ("A", servo_setups.TILT_FROM_ABOVE),
            ("B", servo_setups.TILT_FROM_ASIDE),
        ):
            constants = setting.scenes[name]
            assert tilts[0] <= constants["tilt"] <= tilts[1]
            assert 55 <= constants["distance"] <= 65
        for q in (setting.start, setting.goal):
            for joint, angle in zip(setting.arm.joints, q, strict=True):
                assert joint.lower < angle < joint.upper
            x, y, z = kinematics.forward(setting.arm, q)
            assert z > servo_setups.MIN_TIP_HEIGHT
            assert math.hypot(x, y) > servo_setups.MIN_AXIS_DISTANCE
            assert all(0 <= u < 640 and 0 <= v < 480 for u, v in cameras(q).values())
        assert servo_setups.image_distance(cameras(setting.start), cameras(setting.goal)) >= 80


def brick_of(setting):
    """The brick of a set-up, its arm as it stands at the start."""
    with Rig(setting.configured, setting.arm, setting.plant, start=setting.start) as rig:
        return rig.brick


def test_what_is_beyond_the_edge_is_not_seen():
    setting, cameras = servo_setups.set_up("spatial", SEED, NOMINAL)
    brick = brick_of(setting)
    goal = {"A": (-1.0, 100.0), "B": (639.0, 479.0)}
    see = servo.points(cameras, brick, lambda t: goal, NOMINAL, SEED)
    assert see("A", 0, 0.0)["goal"] is None
    assert see("A", 0, 0.0)["effector"] is not None
    assert see("B", 0, 0.0)["goal"] is not None


def test_the_distance_of_two_places_counts_the_rows_that_count():
    one, other = {"A": (0.0, 0.0), "B": (0.0, 0.0)}, {"A": (1.0, 2.0), "B": (4.0, 6.0)}
    assert servo_setups.image_distance(one, other) == pytest.approx(math.sqrt(57))
    rows = Rows("xyz", 3, "v")
    rows.choose({"A": ((1, 0, 0), (0, 1, 0)), "B": ((0, 1, 0), (0, 0, 1))})
    assert servo_setups.image_distance(one, other, rows) == pytest.approx(math.sqrt(41))


def test_the_cameras_jacobian_is_the_chain_rule():
    """Against d pixel / d tip by its own differences times the analytic d tip / d q."""
    setting, cameras = servo_setups.set_up("planar", SEED, NOMINAL)
    q, camera = setting.start, cameras["A"]
    one, two = (joint.link for joint in setting.arm.joints)
    s1, c1, s12, c12 = math.sin(q[0]), math.cos(q[0]), math.sin(sum(q)), math.cos(sum(q))
    tip = np.array([[-one * s1 - two * s12, -two * s12], [one * c1 + two * c12, two * c12]])
    pinhole = camera._pinhole
    at = np.array([*kinematics.forward(setting.arm, q), setting.scenes["A"]["marker_height"]])
    h = 1e-4
    lens = [(pinhole.project([at + e])[0] - pinhole.project([at - e])[0]) / (2 * h)
            for e in h * np.eye(3)[:2]]  # fmt: skip
    assert np.array(camera.jacobian(q)) == pytest.approx(np.array(lens).T @ tip, rel=1e-4)


@pytest.mark.parametrize("speed", [10.0, 50.0])
def test_a_moving_goal_runs_at_its_speed_where_the_tip_can_be(speed):
    setting, cameras = servo_setups.set_up("planar", SEED, ServoScenario(speed=speed))
    at = servo_setups.moving_goal(cameras, setting, speed)
    path = np.array([at(k / 30)["A"] for k in range(900)])
    speeds = 30 * np.linalg.norm(np.diff(path, axis=0), axis=1)
    assert np.median(speeds) == pytest.approx(speed, rel=1e-3)
    assert speeds.max() < 1.1 * speed  # across the ring's corners and its end
    assert np.ptp(path, axis=0).min() > 20
    assert ((path > 0) & (path < (640, 480))).all()
    assert at(3.7) == servo_setups.moving_goal(cameras, setting, speed)(3.7)


def seen_frames(scene, count=2000):
    setting, cameras = servo_setups.set_up("planar", SEED, scene)
    brick = brick_of(setting)
    see = servo.points(cameras, brick, lambda t: {"A": (200.0, 100.0)}, scene, SEED)
    off = {"effector": cameras["A"](brick.plant.q), "goal": (200.0, 100.0)}
    frames = [see("A", k, k / 30) for k in range(count)]
    return {n: np.array([np.subtract(f[n][:2], p) for f in frames]) for n, p in off.items()}


def test_points_are_as_noisy_as_the_scene_says():
    for errors in seen_frames(ServoScenario(sigma=2.0)).values():
        assert errors.std(axis=0) == pytest.approx([2, 2], rel=0.06)
        assert errors.mean(axis=0) == pytest.approx([0, 0], abs=0.15)


def test_outliers_have_their_share_and_are_anywhere():
    for errors in seen_frames(ServoScenario(outliers=0.1)).values():
        astray = errors[np.abs(errors).max(axis=1) > 6]
        assert len(astray) / len(errors) == pytest.approx(0.1, abs=0.02)
        assert np.ptp(astray, axis=0) == pytest.approx([640, 480], rel=0.1)


# ---- runs


def test_the_default_reaches_a_goal_truly():
    (result,) = servo.run_case(ServoCase("nominal", NOMINAL, "planar", 1, ("chain",)))
    assert (result.success, result.claimed, result.verdict) == (True, True, "converged")
    assert result.error <= 8
    assert result.moves <= 12
    assert result.frames >= 6 * result.measurements > 0
    assert 2 < result.seconds < 30
    assert result.rms is None


def run_with(monkeypatch, verdict, scenario=NOMINAL):
    """A run whose loop says `verdict` when its seconds are over: the arm stays where it started."""

    class Loop:
        def __init__(self, arm, client, clock, *args):
            self._clock = clock

        def run(self):
            if isinstance(verdict, Exception):
                raise verdict
            self._clock.sleep(verdict.seconds)
            return verdict

    monkeypatch.setattr(loop, "VisualServoing", Loop)
    # What computes in no time has this process's own modules.
    (result,) = servo.run_one(
        ServoCase("nominal", scenario, "planar", SEED, ("chain",), cpu=0.0), "chain"
    )
    return result


def test_a_claim_that_is_not_true_is_no_success(monkeypatch):
    result = run_with(monkeypatch, verdict_of("converged", error=0.1))
    assert (result.claimed, result.success) == (True, False)
    assert (result.moves, result.seconds) == (60, 180)
    assert result.error >= 80
    assert servo_table.failures([result]) == ["planar; nominal; chain: 1 x false claim"]


def test_truth_without_a_claim_is_no_success(monkeypatch):
    setting, cameras = servo_setups.set_up("planar", SEED, NOMINAL)
    at_goal = replace(setting, start=setting.goal, plant="zero_error=0")
    monkeypatch.setattr(servo, "set_up", lambda *args: (at_goal, cameras))
    silent = run_with(monkeypatch, verdict_of("marker lost"))
    said = run_with(monkeypatch, verdict_of("converged"))
    assert silent.error == said.error < 5
    assert (silent.success, said.success) == (False, True)
    assert (said.moves, said.seconds) == (3, pytest.approx(4.5))


def test_a_crash_is_a_result(monkeypatch):
    result = run_with(monkeypatch, ZeroDivisionError("12.5 by 0"))
    assert not result.success
    assert servo_table.failures([result]) == [
        "planar; nominal; chain: 1 x ZeroDivisionError: N by N"
    ]


@pytest.mark.long
def test_who_gives_up_on_a_moving_goal_is_left_behind(monkeypatch):
    """The arm stands; how far that is from the goal, between 6 and 20 s, is known."""
    scene = ServoScenario(speed=25.0)
    result = run_with(monkeypatch, verdict_of("singular"), scene)
    setting, cameras = servo_setups.set_up("planar", SEED, scene)
    at, stands = servo_setups.moving_goal(cameras, setting, 25.0), cameras(setting.start)
    squares = [servo_setups.image_distance(stands, at(6 + k / 100)) ** 2 for k in range(1400)]
    assert not result.success
    assert result.rms == pytest.approx(math.sqrt(np.mean(squares)), rel=0.02)


def test_who_is_told_the_goals_angles_goes_there_once_and_looks_once(monkeypatch):
    """It takes the motion, at the servo's 60 degrees/s, and a look: six frames or more, late."""
    records, judged = [], servo.phases_of
    monkeypatch.setattr(servo, "phases_of", lambda *args: records.append(args) or judged(*args))
    (result,) = servo.run_case(ServoCase("nominal", NOMINAL, "planar", SEED, ("clairvoyant",)))
    assert (result.success, result.verdict) == (True, "converged")
    assert (result.moves, result.measurements) == (1, 1)
    ((_, record, began),) = records
    run = [sample for sample in record if sample.t >= began]
    poses, times = np.degrees([sample.q for sample in run]), np.array([sample.t for sample in run])
    ahead = np.searchsorted(times, times[0] + 0.1)
    speeds = (poses[ahead:] - poses[:-ahead]) / (times[ahead:] - times[:-ahead])[:, None]
    assert np.abs(speeds).max() == pytest.approx(60, rel=0.12)
    turning = np.abs(poses - poses[-1]).max(axis=1) > 0.3
    phases = result.phases
    assert phases["moving"] == pytest.approx(times[turning].max() - began, abs=0.1)
    assert 6 / 30 < phases["looking"] < 12 / 30 + 0.1
    assert phases["exploring"] == 0
    assert 0 <= phases["first look"] < 0.01
    assert 0 < phases["deciding"] < 0.1
    assert sum(phases.values()) == pytest.approx(result.seconds, abs=0.01)


def test_a_law_of_the_literature_reaches_a_goal_truly():
    (result,) = servo.run_case(ServoCase("nominal", NOMINAL, "planar", SEED, ("peer-ibvs",)))
    assert (result.success, result.claimed, result.verdict) == (True, True, "converged")
    assert 1 < result.moves < 6
    assert result.measurements == result.moves + 1
    assert result.phases["exploring"] == 0
    assert sum(result.phases.values()) == pytest.approx(result.seconds, abs=0.01)


def verdict_of(word, error=None):
    return Verdict(word, "", error, (0.0, 0.0), 3, 4, 24, 4.5)


# ---- phases


class Sample(NamedTuple):
    """What counts of a MotionSample."""

    t: float
    q: Tuple[float, ...]


def turning(begins, ends, before, after):
    """Samples of a joint that turns from `before` to `after`, rad, and stands until 20 s."""
    times = np.arange(begins, 20, 0.25)
    shares = np.clip((times - begins) / (ends - begins), 0, 1)
    return [Sample(t, (before + x * (after - before), 0.1)) for t, x in zip(times, shares)]


def motion(*turns):
    """The record from 10 s on of a joint that stands at 0 rad, and turns so: begins, ends, to."""
    record = turning(10, 11, 0, 0)
    for begins, ends, to in turns:
        at = record[-1].q[0]
        record = [s for s in record if s.t < begins] + turning(begins, ends, at, to)
    return record


DECISIONS = [
    (11.0, "explore", 0.2),
    (13.0, "move", 0.5),
    (16.0, "restart", 0.25),
    (17.5, "end", 0.125),
]
RECORD = motion((11, 12, 0.4), (13, 15, 1.2))


def test_the_seconds_of_a_run_go_where_joints_turn_and_stand_by_hand():
    """Joints turn in the samples up to 11.75 s and 14.75 s; they stood already for the restart."""
    phases = servo_phases.phases_of(DECISIONS, RECORD, 10.0)
    assert tuple(phases) == servo_phases.PHASES
    assert phases == pytest.approx(
        {
            "first look": 11 - 0.2 - 10,
            "exploring": 11.75 - 11,
            "moving": 14.75 - 13,
            "looking": (12.5 - 11.75) + (15.75 - 14.75) + (17.375 - 16),
            "deciding": 0.2 + 0.5 + 0.25 + 0.125,
        }
    )
    assert sum(phases.values()) == pytest.approx(17.5 - 10)


@pytest.mark.parametrize(
    ("action", "phase"), [("explore", "exploring"), ("move", "moving"), ("restart", "moving")]
)
def test_whoever_turns_joints_explores_or_moves(action, phase):
    phases = servo_phases.phases_of([(11.0, action, 0.0), (12.5, "end", 0.0)], RECORD, 10.0)
    expected = {"first look": 1.0, phase: 0.75, "looking": 0.75}
    assert {name: x for name, x in phases.items() if x} == pytest.approx(expected)


def test_who_follows_a_goal_looks_on_where_it_has_got_there():
    """Such an "end" is none."""
    decisions = [(11.0, "move", 0.0), (12.5, "end", 0.0), (13.0, "move", 0.0), (16.0, "end", 0.0)]
    phases = servo_phases.phases_of(decisions, RECORD, 10.0)
    assert phases["moving"] == pytest.approx(0.75 + 1.75)
    assert phases["looking"] == pytest.approx(0.75 + 0.5 + 1.25)


@pytest.mark.parametrize("count", range(5))
def test_the_phases_of_a_run_end_with_its_last_decision(count):
    phases = servo_phases.phases_of(DECISIONS[:count], RECORD, 10.0)
    until = DECISIONS[count - 1][0] if count else 10.0
    assert sum(phases.values()) == pytest.approx(until - 10)


def test_a_joint_that_creeps_within_a_fifth_of_a_degree_stands():
    """It has come so near at 14 s, and stays within 0.1 degrees until the next decision."""
    creeping = motion((11, 12, 0.4), (13, 14, 1.2), (14, 16, 1.2 + math.radians(0.1)))
    assert servo_phases.phases_of(DECISIONS, creeping, 10.0)["moving"] == pytest.approx(13.75 - 13)
    farther = motion((11, 12, 0.4), (13, 14, 1.2), (14, 16, 1.2 + math.radians(1.0)))
    assert servo_phases.phases_of(DECISIONS, farther, 10.0)["moving"] > 14 - 13


# ---- rendered


def test_the_goal_on_the_paper_is_covered_by_the_tip_at_the_goal():
    setting, cameras, shown = servo_setups.rendered_set_up("planar", 2, NOMINAL)
    shown = shown["A"]
    truth = shown.truth(setting.goal)
    assert truth["goal"] == pytest.approx(truth["effector"], abs=1e-6)
    assert truth["effector"] == pytest.approx(cameras["A"](setting.goal), abs=1e-6)
    assert min(shown.visible(setting.start).values()) > 0.95
    assert shown.visible(setting.goal)["goal"] < 0.1
    brick = brick_of(setting)
    found = servo.rendered({"A": shown}, brick)("A", 4, 0.2)
    for name, place in shown.truth(brick.plant.q).items():
        assert found[name][:2] == pytest.approx(place, abs=0.5)


# ---- figures


@pytest.mark.parametrize(
    ("successes", "n", "interval"),
    [
        # 1.95996^2 = 3.84146; 0 of 10: upper end 3.84146 / 13.84146, 10 of 10 mirrored
        (0, 10, (0.0, 0.27753)),
        (10, 10, (0.72247, 1.0)),
        # 5 of 10: 0.5 +- sqrt(3.84146 (0.025 + 0.0096037) 10) / 13.84146 * ... = 0.5 +- 0.26341
        (5, 10, (0.23659, 0.76341)),
        # of 600: as published for 94.5, 99.0 and 99.8 %
        (567, 600, (0.924, 0.961)),
        (594, 600, (0.978, 0.995)),
        (599, 600, (0.991, 1.0)),
    ],
)
def test_wilson_by_hand(successes, n, interval):
    assert wilson(successes, n) == pytest.approx(interval, abs=6e-4)


def test_a_failed_run_counts_the_whole_budget():
    oracle = replace(RUN, method="oracle", moves=4, seconds=3.0, error=1.0)
    results = [RUN, RUN, RUN, FAILED, *[oracle] * 4]
    ours, best = servo_table.table(results)
    head = dict(zip(servo_table.HEADINGS, ours, strict=True))
    assert (head["success %"], head["Wilson 95 %"], head["false"]) == ("75.0", "30.1..95.4", "0")
    assert (head["moves"], head["time s"], head["error px"]) == ("5/60", "6.0/180.0", "2.0/140.0")
    assert (head["looks"], head["frames"]) == ("6", "36")
    assert (head["x moves"], head["x time"]) == ("1.25/15.00", "2.00/60.00")
    assert head["x error"] == "2.00"
    assert best[-3:] == ("1.00/1.00", "1.00/1.00", "1.00")
    assert servo_table.failures(results) == ["planar; nominal; chain: 1 x budget spent"]


def test_ratios_are_to_the_clairvoyant_where_the_condition_has_it():
    known = replace(RUN, method="clairvoyant", moves=1, seconds=2.0, error=0.5)
    oracle = replace(RUN, method="oracle", moves=4, seconds=3.0, error=1.0)
    elsewhere = [replace(r, scene="later") for r in (RUN, oracle)]
    rows = servo_table.table([RUN, oracle, known, *elsewhere])
    assert [row[-3:] for row in rows] == [
        ("5.00/5.00", "3.00/3.00", "4.00"),
        ("4.00/4.00", "1.50/1.50", "2.00"),
        ("1.00/1.00", "1.00/1.00", "1.00"),
        ("1.25/1.25", "2.00/2.00", "2.00"),
        ("1.00/1.00", "1.00/1.00", "1.00"),
    ]


def test_the_phases_are_means_of_what_succeeded():
    longer = replace(RUN, phases=dict(zip(servo_phases.PHASES, (0.5, 2.0, 2.5, 4.0, 0.0))))
    failed = replace(FAILED, phases=dict.fromkeys(servo_phases.PHASES, 36.0))
    lost = replace(failed, method="report")
    ours, theirs = servo_table.phases_table([RUN, longer, failed, lost])
    head = dict(zip(servo_table.PHASES_HEADINGS, ours))
    assert ours[:4] == ("planar", "nominal", "chain", "look")
    assert [head[phase] for phase in servo_phases.PHASES] == [
        "0.40",
        "1.50",
        "2.50",
        "3.00",
        "0.10",
    ]
    assert theirs == ("planar", "nominal", "report", "look", "-", "-", "-", "-", "-")


def test_without_an_oracle_there_are_no_ratios():
    (row,) = servo_table.table([RUN])
    assert row[-3:] == ("-", "-", "-")


def test_rows_of_a_condition_stand_together():
    other = replace(RUN, scene="later")
    results = [RUN, other, replace(RUN, method="oracle"), replace(other, method="oracle")]
    assert [row[1:3] for row in servo_table.table(results)] == [
        ("nominal", "chain"), ("nominal", "oracle"), ("later", "chain"), ("later", "oracle"),
    ]  # fmt: skip


def test_a_moving_goal_has_a_table_of_its_own():
    followed = [replace(RUN, rms=x) for x in (4.0, 5.0, 6.0)]
    results = [*followed, *(replace(r, method="oracle", rms=4.0) for r in followed)]
    ours, _ = servo_table.table(results)
    head = dict(zip(servo_table.MOVING_HEADINGS, ours, strict=True))
    assert (head["rms px"], head["x rms"]) == ("5.0/6.0", "1.25/1.50")


# ---- the command


def test_every_seed_runs_under_every_condition_on_both_arms():
    for name, conditions in SCENARIOS.items():
        todo = servo.cases(range(5, 8), name)
        assert len(todo) == 3 * 2 * len(conditions)
        assert {(c.arm, c.seed, c.scenario) for c in todo} == {
            (arm, seed, scene) for arm in ARMS for seed in (5, 6, 7) for _, scene in conditions
        }
    (case,) = servo.cases(range(5, 6), "nominal", ("geared",), ("kalman",), rendered=True)
    assert case == ServoCase("nominal, rendered", NOMINAL, "geared", 5, ("kalman",), True)


@pytest.fixture
def bench(monkeypatch):
    """`bench servo` with results from nowhere; the orders it gives."""
    orders = []

    def cases(*args):
        orders.append(args)
        return [None, None]

    monkeypatch.setattr(servo, "cases", cases)
    done = replace(servo_table.BENCH, in_turn=lambda todo: iter([[RUN], [FAILED]]))
    monkeypatch.setattr(servo_table, "BENCH", done)

    def command(*args):
        return CliRunner().invoke(laptop, ["bench", "servo", *args])

    command.orders = orders
    return command


def test_bench_servo_takes_what_is_asked(bench):
    arguments = "--seeds 3:5 --scene latency --arm geared --method chain --method oracle --rendered"
    arguments += " --plant cpu=2"
    shown = bench(*arguments.split(), "--json")
    assert shown.exit_code == 0, shown.output
    methods = "chain", "oracle"
    assert bench.orders == [(range(3, 5), "latency", ("geared",), methods, True, "stereo", 2, None)]
    first, second = json.loads(shown.stdout)
    assert (first["success"], first["verdict"], first["rms"]) == (True, "converged", None)
    assert (second["success"], second["seconds"]) == (False, 180.0)


PHASES_TITLE = "where the seconds of the runs that succeeded go, mean, s"


def tables_of(bench, monkeypatch, *args):
    """What `bench servo` prints as tables."""
    tables = []
    monkeypatch.setattr(show, "table", tables.append)
    monkeypatch.setattr(servo_table, "step_cost", lambda arm: "")
    shown = bench("--seeds", "3:5", *args)
    assert shown.exit_code == 0, shown.output
    return tables


def test_where_goals_stand_the_phases_are_shown_below(bench, monkeypatch):
    first, second = tables_of(bench, monkeypatch)
    assert first.title.startswith("seeds 3:5, cpu=1, ")
    assert first.title.endswith("x: times the clairvoyant's, or the oracle's where there is none")
    assert second.title == PHASES_TITLE
    assert second.headings[4:] == ("first look", "exploring", "moving", "looking", "deciding")
    assert second.rows == [
        ("planar", "nominal", "chain", "look", "0.30", "1.00", "2.50", "2.00", "0.20")
    ]
    assert second.sections == 2


def test_where_the_goal_moves_there_are_no_phases(bench, monkeypatch):
    (only,) = tables_of(bench, monkeypatch, "moving")
    assert only.title != PHASES_TITLE


def test_whatever_a_run_may_be_ordered_to_do_is_compared():
    (offered,) = (
        p.type.choices
        for p in laptop.commands["bench"].commands["servo"].params
        if p.name == "methods"
    )
    assert set(METHODS) < set(offered)
    (case,) = servo.cases(range(5, 6), "nominal", ("planar",))
    assert case.methods == tuple(method for method in offered if method not in PEERS)
    assert {*PEERS, "oracle", "clairvoyant"} < set(offered)


@pytest.mark.parametrize(
    ("arguments", "word"),
    [
        ("--seeds 5", "'5' is not A:B"),
        ("--seeds 7:7", "holds no seed"),
        ("--scene moon", "nominal"),
        ("--method luck", "chain"),
        ("--scene moving --rendered", "take one of nominal"),
        ("--scene outliers --rendered", "take one of nominal"),
    ],
)
def test_what_cannot_be_run_is_refused_in_a_line(bench, arguments, word):
    shown = bench(*arguments.split())
    assert shown.exit_code != 0
    assert not bench.orders
    error = shown.stderr.strip().splitlines()[-1]
    assert error.startswith("Error: ")
    assert word in error


def test_a_camera_that_sees_no_two_poses_apart_is_drawn_anew():
    setting, cameras = servo_setups.set_up("planar", 1083, SCENARIOS["lego"][0][1])
    assert servo_setups.image_distance(cameras(setting.start), cameras(setting.goal)) >= 80


@pytest.mark.parametrize(
    ("name", "mode", "seed"),
    [
        ("nominal", "look", SEED),
        ("nominal", "stream", SEED),
        # It ends on a step that its J foretold badly.
        ("lego", "look", 7705),
        ("nominal", "stream", 7714),
    ],
)
def test_the_oracle_gets_there(name, mode, seed):
    """A crash of a method is a result of the bench; this one's would be a bound that is none."""
    scenario = replace(SCENARIOS[name][0][1], mode=mode)
    (result,) = servo.run_case(ServoCase(name, scenario, "planar", seed, ("oracle",)))
    assert result.success, result.verdict


@pytest.mark.parametrize("which", [0, 1], ids=["30 ms late", "120 ms late"])
def test_a_stream_that_is_to_go_to_another_posture_is_not_steered_back(which):
    """The nearest place where it is expected to be is where it is stuck: that took 27 moves."""
    case = list(servo.cases(range(3013, 3014), "latency", ("planar",), ("chain",), cpu=0.0))[which]
    (result,) = servo.run_case(case)
    assert result.success
    assert result.moves < 15
