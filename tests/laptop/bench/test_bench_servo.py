"""The bench of servoing: its set-ups, what counts as success, and its tables by hand."""

import json
import math
from dataclasses import replace

import numpy as np
import pytest
from click.testing import CliRunner

from laptop.bench import servo, servo_setups, servo_table
from laptop.bench.servo import ServoCase, ServoResult
from laptop.bench.servo_scenarios import ARMS, SCENARIOS, ServoScenario
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
RUN = ServoResult("nominal", "planar", "chain", 1, True, True, "converged", 5, 6, 36, 6.0, 2.0)
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


def test_the_oracle_knows_the_jacobian_of_the_true_pose():
    """Also where the encoders say something else."""
    setting, cameras = servo_setups.set_up("planar", SEED, NOMINAL)
    brick = brick_of(setting)
    told, s, camera = [a + 0.02 for a in setting.start], (300.0, 200.0), cameras["A"]
    picture = servo.TrueJacobian(camera, brick).seen_from(told, s)
    truth = np.array(camera.jacobian(brick.plant.q))
    assert np.array(picture.jacobian(told)) == pytest.approx(truth)
    assert picture.predict(told) == pytest.approx(s)
    ahead = picture.predict([told[0] + 0.1, told[1] - 0.2])
    assert ahead == pytest.approx(s + truth @ (0.1, -0.2))


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
    """A run whose loop says `verdict` at once: the arm stays where it started."""

    class Loop:
        def __init__(self, *args, **kwargs):
            pass

        def run(self):
            if isinstance(verdict, Exception):
                raise verdict
            return verdict

    monkeypatch.setattr(loop, "VisualServoing", Loop)
    # What computes in no time has this process's own modules.
    return servo.run_one(
        ServoCase("nominal", scenario, "planar", SEED, ("chain",), cpu=0.0), "chain"
    )


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
    assert (said.moves, said.seconds) == (3, 4.5)


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


def verdict_of(word, error=None):
    return Verdict(word, "", error, (0.0, 0.0), 3, 4, 24, 4.5)


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
    assert bench.orders == [(range(3, 5), "latency", ("geared",), methods, True, "stereo", 2)]
    first, second = json.loads(shown.stdout)
    assert (first["success"], first["verdict"], first["rms"]) == (True, "converged", None)
    assert (second["success"], second["seconds"]) == (False, 180.0)


def test_whatever_a_run_may_be_ordered_to_do_is_compared():
    (offered,) = (
        p.type.choices
        for p in laptop.commands["bench"].commands["servo"].params
        if p.name == "methods"
    )
    assert set(METHODS) < set(offered)
    (case,) = servo.cases(range(5, 6), "nominal", ("planar",))
    assert case.methods == offered


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


@pytest.mark.parametrize("mode", ["look", "stream"])
def test_the_oracle_gets_there(mode):
    """A crash of a method is a result of the bench; this one's would be a bound that is none."""
    case = ServoCase("nominal", replace(NOMINAL, mode=mode), "planar", SEED, ("oracle",))
    assert servo.run_case(case)[0].success


@pytest.mark.parametrize("which", [0, 1], ids=["30 ms late", "120 ms late"])
def test_a_stream_that_is_to_go_to_another_posture_is_not_steered_back(which):
    """The nearest place where it is expected to be is where it is stuck: that took 27 moves."""
    case = list(servo.cases(range(3013, 3014), "latency", ("planar",), ("chain",), cpu=0.0))[which]
    (result,) = servo.run_case(case)
    assert result.success
    assert result.moves < 15
