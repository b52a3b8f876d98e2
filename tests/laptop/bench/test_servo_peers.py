"""Laws of the literature: their updates beside other ways to the same numbers; their servo."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

from laptop.bench import servo_peers, servo_setups
from laptop.bench.servo_peers import PeerServo, broyden, kalman, law_named, rls
from laptop.bench.servo_scenarios import PEERS, SCENARIOS
from robot.servoing.measurement import Measurement
from robot.servoing.rows import Rows
from shared.arm_description import find_arm, read_arm

SEED = 77
NOMINAL = SCENARIOS["nominal"][0][1]
STEP = math.radians(8)
TOLERANCE = 5.0

LEARNING = [name for name in PEERS if name != "peer-ibvs"]
SLOPES = {
    "planar": {"A": [[410.0, -120.0], [90.0, 260.0]]},
    "spatial": {
        "A": [[310.0, -120.0, 40.0], [90.0, 260.0, -75.0]],
        "B": [[-20.0, 180.0, 210.0], [330.0, 15.0, 60.0]],
    },
}
"""J of linear cameras, px/rad, by arm and camera."""


# ---- the updates


def drawn(rows, columns, steps=1):
    """J, and steps of the joints and what was seen of them, all at random."""
    draw = np.random.default_rng(SEED)
    J = draw.normal(0, 300, (rows, columns))
    pairs = [(draw.normal(0, 0.2, columns), draw.normal(0, 60, rows)) for _ in range(steps)]
    return J, pairs


@pytest.mark.parametrize("shape", [(2, 2), (4, 3)])
def test_broydens_update_explains_the_step_by_the_least_change(shape):
    """The least change of all that do is the shortest solution of the secant equation."""
    J, [(dq, ds)] = drawn(*shape)
    after, _ = broyden(J, np.zeros((shape[1], shape[1])), dq, ds)
    assert after @ dq == pytest.approx(ds)
    secant = np.kron(np.eye(shape[0]), dq)
    least, *_ = np.linalg.lstsq(secant, ds - J @ dq)
    assert (after - J).ravel() == pytest.approx(least)


@pytest.mark.parametrize("shape", [(2, 2), (4, 3)])
def test_kalmans_update_is_the_filter_of_all_elements_of_j(shape):
    """A state that walks by 30 px/rad a step; each of the two places of a step is off by 1 px."""
    rows, columns = shape
    J, pairs = drawn(*shape, steps=5)
    P = law_named("peer-kalman").P * np.eye(columns)
    state, covariance = J.ravel(), 100.0**2 * np.eye(rows * columns)
    for dq, ds in pairs:
        J, P = kalman(J, P, dq, ds)
        H = np.kron(np.eye(rows), dq)
        covariance = covariance + 30.0**2 * np.eye(rows * columns)
        innovation = H @ covariance @ H.T + 2 * 1.0**2 * np.eye(rows)
        K = covariance @ H.T @ np.linalg.inv(innovation)
        state = state + K @ (ds - H @ state)
        covariance = (np.eye(rows * columns) - K @ H) @ covariance
        assert J.ravel() == pytest.approx(state)
        assert np.kron(np.eye(rows), P) == pytest.approx(covariance, abs=1e-6)


@pytest.mark.parametrize("shape", [(2, 2), (4, 3)])
def test_rls_is_least_squares_that_weigh_a_step_by_its_age(shape):
    """By 0.9 for each step since; what was known before counts as its P says, and ages as well."""
    first, pairs = drawn(*shape, steps=6)
    J, P = first, 50.0 * np.eye(shape[1])
    for dq, ds in pairs:
        J, P = rls(J, P, dq, ds)
    weights = [0.9 ** (len(pairs) - 1 - k) for k in range(len(pairs))]
    roots = np.sqrt([0.9 ** len(pairs) / 50.0] * shape[1] + weights)[:, None]
    inputs = roots * np.vstack([np.eye(shape[1]), [dq for dq, _ in pairs]])
    outputs = roots * np.vstack([first.T, [ds for _, ds in pairs]])
    best, *_ = np.linalg.lstsq(inputs, outputs)
    assert pytest.approx(best.T) == J
    assert np.linalg.inv(inputs.T @ inputs) == pytest.approx(P)


def test_rls_weighs_exploring_as_steps_like_all_others():
    """P is then the inverse of the sum of dq dq'."""
    assert np.linalg.inv(STEP**2 * np.eye(2)) == pytest.approx(law_named("peer-rls").P * np.eye(2))


# ---- the servo


class LinearWorld:
    """Joints that go where they are told, cameras whose places are linear in them.

    The goal is seen where the tip is at `goal`, rad.
    """

    def __init__(self, name, q, goal, kind="planar", rows="stereo"):
        self.arm = read_arm(find_arm(kind))
        self.slopes = {camera: np.array(J) for camera, J in SLOPES[kind].items()}
        self.J = np.vstack(list(self.slopes.values()))
        self.q, self.goal = list(q), goal
        self.servo = PeerServo(
            law_named(name), self.arm, TOLERANCE, Rows(rows, len(q)),
            lambda cameras: {c: self.slopes[c] for c in cameras},
        )  # fmt: skip

    def seen(self, camera, q):
        """Place at q, px."""
        return self.slopes[camera] @ q + (320, 240)

    def decide(self):
        """Look, let the servo decide, and go there."""
        places = {c: (self.seen(c, self.q), self.seen(c, self.goal)) for c in self.slopes}
        looks = [Measurement(c, tuple(s), tuple(goal), 1, 6) for c, (s, goal) in places.items()]
        decision = self.servo.decide(self.q, looks)
        self.q = decision.q or self.q
        return decision

    def off(self):
        """Distance from the goal, px."""
        return np.linalg.norm(self.J @ np.subtract(self.q, self.goal))


def explored(name, q, goal, kind="planar"):
    """A world whose servo has explored every joint, and is about to decide on its first step."""
    world = LinearWorld(name, q, goal, kind)
    for _ in q:
        assert world.decide().action == "explore"
    return world


def test_each_name_is_a_laws_of_its_own():
    laws = [law_named(name) for name in PEERS]
    assert len(laws) == len({law.update for law in laws}) > 0


@pytest.mark.parametrize("name", LEARNING)
@pytest.mark.parametrize("kind", SLOPES)
def test_every_joint_is_explored_once_towards_the_middle_of_its_range(name, kind):
    joints = read_arm(find_arm(kind)).joints
    near = [(j.upper - 0.01 if k % 2 else j.lower + 0.01) for k, j in enumerate(joints)]
    world = LinearWorld(name, near, [(j.lower + j.upper) / 2 for j in joints], kind)
    at = list(near)
    for k in range(len(joints)):
        at[k] += -STEP if k % 2 else STEP
        decision = world.decide()
        assert decision.action == "explore"
        assert decision.q == pytest.approx(at)
    assert world.decide().action == "move"
    assert np.array(world.servo.J) == pytest.approx(world.J)


@pytest.mark.parametrize("name", PEERS)
@pytest.mark.parametrize("kind", SLOPES)
def test_a_goal_is_reached_and_that_is_said(name, kind):
    start, goal = [0.2, 0.3, 0.4], [0.7, 0.9, 0.1]
    joints = len(read_arm(find_arm(kind)).joints)
    world = LinearWorld(name, start[:joints], goal[:joints], kind)
    for _ in range(20):
        near, decision = world.off() < TOLERANCE, world.decide()
        assert (decision.action == "end") == near
        if near:
            break
    assert (decision.action, decision.verdict, decision.q) == ("end", "converged", None)


@pytest.mark.parametrize("name", PEERS)
def test_a_goal_is_reached_by_three_rows_as_well(name):
    """Of J's rows three count, from the end of exploring on; they say where the goal is."""
    world = LinearWorld(name, [0.2, 0.3, 0.4], [0.7, 0.9, 0.1], "spatial", "xyz")
    for _ in range(20):
        decision = world.decide()
        if decision.action == "move":
            assert np.shape(world.servo.J) == (3, 3)
            assert len(world.servo.rows.names(world.servo.cameras)) == 3
        if decision.action == "end":
            break
    assert decision.verdict == "converged"
    assert world.off() < 3 * TOLERANCE


@pytest.mark.parametrize(("off", "action"), [(4.99, "end"), (5.01, "move")])
def test_it_ends_where_the_distance_of_all_rows_is_within_the_tolerance(off, action):
    goal = [0.7, 0.9]
    q = goal + np.linalg.solve(SLOPES["planar"]["A"], [0.6 * off, -0.8 * off])
    assert LinearWorld("peer-ibvs", q, goal).decide().action == action


@pytest.mark.parametrize("name", LEARNING)
def test_a_step_is_damped_least_squares(name):
    """By 5 % of J's greatest singular value: as if each joint's step were wished to be none."""
    world = explored(name, [0.2, 0.3], [0.4, 0.45])
    before = np.array(world.q)
    e = world.J @ (before - world.goal)
    damping = 0.05 * np.sqrt(np.linalg.eigvalsh(world.J.T @ world.J)[-1])
    inputs = np.vstack([world.J, damping * np.eye(2)])
    dq, *_ = np.linalg.lstsq(inputs, np.append(-e, [0, 0]))
    assert world.decide().q == pytest.approx(before + dq)


def test_the_classical_law_is_there_in_one_step():
    world = LinearWorld("peer-ibvs", [0.2, 0.3], [0.7, 0.9])
    assert world.decide().q == pytest.approx(world.goal)


@pytest.mark.parametrize(
    ("name", "largest"), [(name, 60 if name == "peer-ibvs" else 30) for name in PEERS]
)
def test_no_joint_steps_farther_than_it_may_and_all_keep_their_shares(name, largest):
    world = LinearWorld(name, [-1.0, 0.2], [1.0, 1.0])
    while world.servo.J is None:
        before = world.q
        decision = world.decide()
    dq = np.subtract(decision.q, before)
    assert np.abs(dq).max() == pytest.approx(math.radians(largest))
    damping = law_named(name).damping * np.linalg.norm(world.J, 2)
    inputs = np.vstack([world.J, damping * np.eye(2)])
    e = world.J @ np.subtract(before, world.goal)
    free, *_ = np.linalg.lstsq(inputs, np.append(-e, [0, 0]))
    assert dq[0] * free[1] == pytest.approx(dq[1] * free[0])


@pytest.mark.parametrize("name", PEERS)
def test_no_step_leaves_a_joints_range(name):
    joints = read_arm(find_arm("planar")).joints
    world = LinearWorld(name, [0.2, 0.3], [joints[0].upper + 0.5, joints[1].lower - 0.5])
    for _ in range(12):
        for joint, angle in zip(joints, world.decide().q):
            assert joint.lower <= angle <= joint.upper
    assert world.q == pytest.approx([joints[0].upper, joints[1].lower])


@pytest.mark.parametrize("name", LEARNING)
def test_what_a_step_shows_is_learned(name):
    """By the law's update of the explored J; the camera is another one meanwhile."""
    world = explored(name, [-1.0, 0.2], [1.0, 1.0])
    first, before, s = world.J, world.q, world.seen("A", world.q)
    world.decide()
    world.slopes["A"] = world.slopes["A"] * 1.3
    dq, ds = np.subtract(world.q, before), world.seen("A", world.q) - s
    world.decide()
    learned, _ = law_named(name).update(first, law_named(name).P * np.eye(2), dq, ds)
    assert np.array(world.servo.J) == pytest.approx(learned)
    assert np.abs(learned - first).max() > 30


# ---- what knows the truth


def brick_at(q):
    """What stands at q truly."""
    return SimpleNamespace(plant=SimpleNamespace(q=tuple(q)))


def test_the_oracle_knows_the_jacobian_of_the_true_pose():
    """Also where the encoders say something else."""
    setting, cameras = servo_setups.set_up("planar", SEED, NOMINAL)
    brick, camera = brick_at(setting.start), cameras["A"]
    told, s = [a + 0.02 for a in setting.start], (300.0, 200.0)
    picture = servo_peers.TrueJacobian(camera, brick).seen_from(told, s)
    truth = np.array(camera.jacobian(setting.start))
    assert np.array(picture.jacobian(told)) == pytest.approx(truth)
    assert picture.predict(told) == pytest.approx(s)
    ahead = picture.predict([told[0] + 0.1, told[1] - 0.2])
    assert ahead == pytest.approx(s + truth @ (0.1, -0.2))


def test_the_classical_law_is_told_the_jacobians_of_all_cameras_at_the_true_pose():
    setting, cameras = servo_setups.set_up("spatial", SEED, NOMINAL)
    told = servo_peers.true_jacobians(cameras, brick_at(setting.start))
    for name, J in told("AB").items():
        assert pytest.approx(np.array(cameras[name].jacobian(setting.start))) == J
    assert list(told("B")) == ["B"]
