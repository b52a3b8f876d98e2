"""What is learned of the image: Broyden's update, the Kalman filter, the chain of revolute joints.

The cameras here are formulas, so that everything that is predicted is known.
"""

# J, P: the letters of the literature.
# ruff: noqa: N803, N806

import math
import random
from operator import mul

import pytest

from robot.motion import kinematics
from robot.servoing.chain_model import REWEIGH_PERIOD, ChainModel
from robot.servoing.local_jacobian import MIN_SIGMA, LocalJacobian
from shared.arm_description import find_arm, read_arm

LINKS = (11.3, 9.5)
CHAINS = {2: "planar", 3: "spatial"}
TRUE = ((520.0, -210.0), (90.0, 340.0))


def tip(q, links=LINKS):
    """Where the tip of a chain is, cm: of two joints in the plane, of three in space."""
    *yaw, first, second = q
    out = links[-2] * math.cos(first) + links[-1] * math.cos(first + second)
    up = links[-2] * math.sin(first) + links[-1] * math.sin(first + second)
    if not yaw:
        return out, up, 0.0
    return out * math.cos(yaw[0]), out * math.sin(yaw[0]), links[0] + up


def affine(q, links=LINKS):
    """An oblique parallel projection, px."""
    x, y, z = tip(q, links)
    return (310 + 11 * x - 3 * y + 2 * z, 250 - 2 * x - 9 * y - 8 * z)


def perspective(q, links=LINKS):
    """A pinhole camera that looks at the plane from a slant, px."""
    x, y, _ = tip(q, links)
    depth = 60 + 0.3 * x + 0.45 * y
    return (320 + 800 * x / depth, 240 - 800 * (0.8 * y + 2) / depth)


def linear(q, J=TRUE):
    return tuple(100 + sum(a * x for a, x in zip(row, q)) for row in J)


def distance(a, b):
    return math.sqrt(sum((x - y) ** 2 for x, y in zip(a, b)))


def flat(J):
    return [a for row in J for a in row]


def differences(predict, q, h=1e-5):
    """J of `predict` by central differences."""
    columns = []
    for k in range(len(q)):
        ahead, back = list(q), list(q)
        ahead[k] += h
        back[k] -= h
        columns.append([(a - b) / (2 * h) for a, b in zip(predict(ahead), predict(back))])
    return list(zip(*columns))


def is_positive(P, slack=1e-6):
    """Whether P is symmetric and has no negative eigenvalue, by Cholesky's factors."""
    n = len(P)
    assert all(
        P[i][j] == pytest.approx(P[j][i], rel=1e-6, abs=1e-6) for i in range(n) for j in range(i)
    )
    scale = max(abs(P[i][i]) for i in range(n))
    L = [[0.0] * n for _ in range(n)]
    for i in range(n):
        for j in range(i + 1):
            left = P[i][j] - sum(L[i][k] * L[j][k] for k in range(j))
            if i == j:
                if left < -slack * scale:
                    return False
                L[i][i] = math.sqrt(max(left, slack * scale))
            else:
                L[i][j] = left / L[j][j]
    return True


def explored(noise_aware, J=TRUE, variance=1e-4):
    """A LocalJacobian that has seen one step along every joint."""
    n = len(J[0])
    model = LocalJacobian(len(J), n, noise_aware)
    q = [0.0] * n
    model.observe(q, linear(q, J), variance)
    for k in range(n):
        q[k] += 0.15
        model.observe(q, linear(q, J), variance)
    return model, q


def taught(see, poses, links=LINKS, variance=0.05):
    """A ChainModel that was shown these poses."""
    model = ChainModel(CHAINS[len(links)], links)
    for q in poses:
        model.observe(q, see(q), variance)
    return model


def scattered(count, seed=1, joints=2, low=-1.2, high=1.2):
    rng = random.Random(seed)
    return [tuple(rng.uniform(low, high) for _ in range(joints)) for _ in range(count)]


# ---- Broyden


@pytest.mark.parametrize("noise_aware", [False, True])
def test_a_step_along_every_joint_gives_the_columns_of_a_linear_camera(noise_aware):
    wide = ((300.0, -40.0, 7.0), (20.0, 150.0, -90.0), (1.0, 2.0, 3.0), (0.0, -80.0, 60.0))
    for J in (TRUE, wide):
        model, _ = explored(noise_aware, J)
        assert flat(model.J) == pytest.approx(flat(J), rel=2e-3, abs=0.1)


def test_exploring_gives_plain_broyden_the_columns_exactly():
    model, _ = explored(False)
    assert flat(model.J) == pytest.approx(flat(TRUE), rel=1e-9)


def test_after_plain_broyden_the_last_step_is_explained_and_nothing_else_has_changed():
    model, q = explored(False)
    before = model.J
    to = [q[0] + 0.2, q[1] - 0.1]
    ds = (61.0, -17.0)
    s = linear(q)
    model.observe(to, [a + b for a, b in zip(s, ds)], 1.0)
    # by hand: (ds - J dq) dq' / dq'dq with dq = (0.2, -0.1): the residual times (4, -2)
    missed = [ds[0] - (520 * 0.2 + 210 * 0.1), ds[1] - (90 * 0.2 - 340 * 0.1)]
    change = [b - a for a, b in zip(flat(before), flat(model.J))]
    assert change == pytest.approx(
        [4 * missed[0], -2 * missed[0], 4 * missed[1], -2 * missed[1]], rel=1e-9
    )
    # across dq nothing was learned
    for old, new in zip(before, model.J):
        assert new[0] * 0.1 + new[1] * 0.2 == pytest.approx(old[0] * 0.1 + old[1] * 0.2)


def test_plain_broyden_takes_nothing_that_was_seen_in_motion():
    model, q = explored(False)
    before = model.J
    model.observe([q[0] + 0.3, q[1]], (0.0, 0.0), 1.0, standing=False)
    assert before == model.J
    # nor as the beginning of the next step
    to = [q[0] + 0.1, q[1]]
    model.observe(to, linear(to), 1.0)
    assert flat(model.J) == pytest.approx(flat(TRUE), rel=1e-9)


def test_a_measurement_without_a_step_teaches_nothing():
    for noise_aware in (False, True):
        model, q = explored(noise_aware)
        before = model.J
        model.observe(q, (1e3, 1e3), 1.0)
        assert before == model.J


# ---- Kalman


def test_the_gain_is_broydens_on_a_long_move_without_noise():
    model, q = explored(True, variance=1e-6)
    to = [q[0] + 0.5, q[1] - 0.3]
    ds = [0.5 * 520 + 0.3 * 210 + 20, 0.5 * 90 - 0.3 * 340 - 20]
    model.observe(to, [a + b for a, b in zip(linear(q), ds)], 1e-6)
    explained = [row[0] * 0.5 - row[1] * 0.3 for row in model.J]
    assert explained == pytest.approx(ds, abs=0.05)


def test_the_gain_is_nothing_on_a_move_that_noise_outweighs():
    model, q = explored(True, variance=1.0)
    before = flat(model.J)
    to = [q[0] + 0.003, q[1]]
    s = [a + off for a, off in zip(linear(to), (3.0, -3.0))]
    model.observe(to, s, 9.0)
    assert max(abs(a - b) for a, b in zip(flat(model.J), before)) < 0.02 * 520


def test_what_was_seen_in_motion_teaches_the_filter_less():
    changes = []
    for variance in (0.01, 100.0):
        model, q = explored(True)
        to = [q[0] + 0.1, q[1]]
        model.observe(to, [a + 3 for a in linear(to)], variance, standing=False)
        changes.append(abs(model.J[0][0] - 520))
    assert changes[1] < 0.5 * changes[0]


@pytest.mark.parametrize("noise_aware", [False, True])
def test_the_covariance_stays_symmetric_positive_and_bounded(noise_aware):
    rng = random.Random(3)
    model = LocalJacobian(2, 3, noise_aware)
    J = ((300.0, -40.0, 70.0), (20.0, 150.0, -90.0))
    unknown = model.covariance()[0][0]
    for k in range(300):
        step = 10 ** rng.uniform(-4, 0)
        q = [rng.uniform(-step, step) for _ in range(3)]
        s = [y + rng.gauss(0, 1) for y in linear(q, J)]
        model.observe(q, s, 2.0)
        if k % 50 == 49:
            model.inflate_variances()
        P = [list(row) for row in model.covariance()]
        assert is_positive(P)
        for i in range(3):
            assert 0.99 * MIN_SIGMA**2 <= P[i][i] <= 1.001 * unknown


def test_the_filter_never_freezes():
    """After a long stay at one camera, another one is learned within a few moves."""
    model, q = explored(True)
    rng = random.Random(5)
    for _ in range(200):
        q = [rng.uniform(-0.3, 0.3) for _ in range(2)]
        model.observe(q, linear(q), 0.1)
    turned = ((340.0, 100.0), (210.0, 520.0))
    model.inflate_variances()
    for _ in range(12):
        q = [rng.uniform(-0.3, 0.3) for _ in range(2)]
        model.observe(q, linear(q, turned), 0.1)
    assert flat(model.J) == pytest.approx(flat(turned), abs=25)


def test_one_false_sighting_does_not_spoil_the_filter():
    changes = {}
    for noise_aware in (True, False):
        model, q = explored(noise_aware, variance=0.3)
        worst = 0.0
        for k, off in enumerate((0, 300, 0, 0)):
            q = [q[0] + 0.1, q[1] - 0.1 * (-1) ** k]
            model.observe(q, [a + off for a in linear(q)], 0.3)
            worst = max(worst, max(abs(a - b) for a, b in zip(flat(model.J), flat(TRUE))))
        changes[noise_aware] = worst
    assert changes[True] < 15
    assert changes[False] > 500


def test_after_all_was_doubted_the_step_across_the_change_is_not_learned():
    for noise_aware in (True, False):
        model, q = explored(noise_aware)
        before = model.J
        model.inflate_variances()
        to = [q[0] + 0.2, q[1] + 0.1]
        model.observe(to, [a + 80 for a in linear(to)], 0.1)
        assert before == model.J


def test_doubt_makes_the_filter_believe_a_new_step_more():
    changes = []
    for doubted in (False, True):
        model, q = explored(True)
        for _ in range(5):
            q = [q[0] + 0.02, q[1]]
            model.observe(q, linear(q), 4.0)
        if doubted:
            model.inflate_variances()
        model.observe(q, linear(q), 4.0)
        to = [q[0] + 0.05, q[1]]
        model.observe(to, [a + 8 for a in linear(to)], 4.0)
        changes.append(abs(model.J[0][0] - 520))
    assert changes[1] > 2 * changes[0]


def test_a_local_picture_is_the_plane_through_where_the_arm_is():
    model, q = explored(True)
    here, s = (0.2, -0.1), (300.0, 200.0)
    picture = model.seen_from(here, s)
    assert picture.predict(here) == pytest.approx(s)
    there = (0.35, 0.1)
    expected = [y + row[0] * 0.15 + row[1] * 0.2 for y, row in zip(s, model.J)]
    assert picture.predict(there) == pytest.approx(expected)
    assert picture.jacobian(there) == model.J


@pytest.mark.parametrize("noise_aware", [False, True])
def test_a_local_picture_does_not_change_when_the_model_learns(noise_aware):
    model, q = explored(noise_aware)
    picture = model.seen_from(q, linear(q))
    before = picture.predict((0.5, 0.5)), picture.jacobian((0.5, 0.5))
    model.observe((1.0, -1.0), (0.0, 0.0), 0.01)
    model.inflate_variances()
    model.observe((0.0, 1.0), (900.0, 20.0), 0.01)
    assert before[1] != model.J
    assert (picture.predict((0.5, 0.5)), picture.jacobian((0.5, 0.5))) == before


# ---- the chain


def test_five_key_frames_of_a_parallel_camera_predict_sixty_degrees_away():
    here = (0.3, -0.5)
    near = [(a, b) for a, b in zip((0.1, 0.3, 0.25, 0.5, 0.3), (-0.5, -0.3, -0.75, -0.6, -0.5))]
    picture = taught(affine, near).seen_from(here, affine(here))
    for a, b in ((1.05, 0), (-1.05, 0), (0, 1.05), (0, -1.05), (0.8, -0.8)):
        there = (here[0] + a, here[1] + b)
        assert distance(picture.predict(there), affine(there)) < 4
    # the local plane through the same place is nowhere near
    J = differences(affine, here)
    plane = [y + row[1] * 1.05 for y, row in zip(affine(here), J)]
    assert distance(plane, affine((here[0], here[1] + 1.05))) > 30


def test_where_the_arm_is_the_picture_is_what_is_seen():
    model = taught(affine, scattered(6))
    assert model.seen_from((0.2, 0.4), (123.0, 45.0)).predict((0.2, 0.4)) == pytest.approx(
        (123.0, 45.0)
    )


@pytest.mark.parametrize("joints", [2, 3])
def test_the_chains_jacobian_is_the_slope_of_what_it_predicts(joints):
    links = (9.0, 7.0, 5.0)[:joints]

    def see(q):
        return affine(q, links)

    poses = scattered(9, joints=joints)
    picture = taught(see, poses, links).seen_from(poses[0], see(poses[0]))
    for q in scattered(4, seed=8, joints=joints, low=-2, high=2):
        J = picture.jacobian(q)
        assert len(J) == 2
        assert all(len(row) == joints for row in J)
        assert flat(J) == pytest.approx(flat(differences(picture.predict, q)), abs=1e-4)


def test_a_chain_of_three_joints_is_learned():
    links = (9.0, 7.0, 5.0)

    def see(q):
        return affine(q, links)

    model = taught(see, scattered(12, joints=3), links)
    here = (0.1, 0.2, 0.3)
    picture = model.seen_from(here, see(here))
    for there in scattered(10, seed=4, joints=3):
        assert distance(picture.predict(there), see(there)) < 5


def test_links_that_were_measured_a_fifth_wrong_are_made_up_for_around_the_key_frames():
    wrong = (11.3 * 0.8, 9.5 * 1.2)
    here = (0.3, -0.5)
    poses = [(here[0] + 0.3 * a, here[1] + 0.3 * b) for a in (-1, 0, 1) for b in (-1, 0, 1)]
    picture = taught(affine, poses, wrong).seen_from(here, affine(here))
    for a, b in ((0.3, 0.2), (-0.3, 0.3), (0.4, -0.4)):
        there = (here[0] + a, here[1] + b)
        moved = distance(affine(here), affine(there))
        assert distance(picture.predict(there), affine(there)) < 0.2 * moved


def test_the_first_joints_motion_tells_what_the_second_will_do():
    """A camera from above sees a similarity, if a foreshortened one: y runs up, v down."""

    def above(q):
        x, y, _ = tip(q)
        return (300 + 9 * x + 4 * y, 200 + 4 * x - 8 * y)

    start, end = (0.2, 0.9), (0.2, 0.6)
    model = taught(above, [(0.2 + 0.05 * k, 0.9) for k in range(4)])
    picture = model.seen_from(start, above(start))
    assert distance(picture.predict(end), above(end)) < 0.25 * distance(above(start), above(end))
    # a mirrored one it takes for what it is as soon as both have moved
    mirrored = taught(lambda q: (640 - above(q)[0], above(q)[1]), scattered(5, seed=3))
    seen = (640 - above(start)[0], above(start)[1])
    off = distance(
        mirrored.seen_from(start, seen).predict(end), (640 - above(end)[0], above(end)[1])
    )
    assert off < 0.1 * distance(above(start), above(end))


def test_a_camera_with_perspective_is_followed_from_key_frames_around():
    here = (0.3, 0.4)
    poses = [(0.3 + 0.5 * a, 0.4 + 0.5 * b) for a in (-1, 0, 1) for b in (-1, 0, 1)]
    picture = taught(perspective, poses).seen_from(here, perspective(here))
    for a, b in ((0.3, 0.2), (-0.3, 0.3), (0.5, -0.4)):
        there = (here[0] + a, here[1] + b)
        moved = distance(perspective(here), perspective(there))
        assert distance(picture.predict(there), perspective(there)) < 0.08 * moved


def test_no_more_than_the_last_key_frames_are_held():
    poses = [(0.2 * a - 1.5, 0.2 * b - 0.8) for a in range(12) for b in range(9)]

    def other(q):
        u, v = affine(q)
        return (700 - v, u - 200)

    old = taught(affine, poses)
    for q in poses[:24]:
        old.observe(q, other(q), 0.05)
    fresh = taught(other, poses[:24])
    here, there = poses[3], (1.0, 1.0)
    assert old.seen_from(here, other(here)).predict(there) == pytest.approx(
        fresh.seen_from(here, other(here)).predict(there), abs=1e-6
    )


def test_a_key_frame_takes_the_place_of_one_at_the_same_pose():
    poses = scattered(8)
    model = taught(lambda q: (5.0, 5.0), poses)
    for q in poses:
        model.observe((q[0] + 0.001, q[1]), affine((q[0] + 0.001, q[1])), 0.05)
    here, there = (0.0, 0.0), (0.8, 0.4)
    assert distance(model.seen_from(here, affine(here)).predict(there), affine(there)) < 3


def test_what_was_seen_in_motion_does_not_replace_what_was_seen_standing():
    poses = scattered(8)
    here, there = (0.0, 0.0), (0.8, 0.4)
    model = taught(affine, poses)
    for q in poses:
        model.observe(q, (0.0, 0.0), 5.0, standing=False)
    assert distance(model.seen_from(here, affine(here)).predict(there), affine(there)) < 3
    # but fills a place where nothing is known
    fresh = ChainModel("planar", LINKS)
    for q in poses:
        fresh.observe(q, affine(q), 5.0, standing=False)
    assert distance(fresh.seen_from(here, affine(here)).predict(there), affine(there)) < 6


def test_a_false_key_frame_loses_its_weight():
    poses = scattered(12, seed=6)
    model = taught(affine, poses)
    q = (1.1, 1.1)
    model.observe(q, [y + 250 for y in affine(q)], 0.05)
    here, there = (0.0, 0.0), (1.2, 1.0)
    off = []
    for _ in range(5 * REWEIGH_PERIOD):
        picture = model.seen_from(here, affine(here))
        off.append(distance(picture.predict(there), affine(there)))
    assert off[0] > 10
    assert off[-1] < 2


def test_a_model_that_is_wrong_about_most_of_what_it_sees_is_not_locked_in():
    """Without a word that the camera was moved: the newer majority wins."""

    def moved(q):
        u, v = affine(q)
        return (u + 80, v - 60)

    model = ChainModel("planar", LINKS)
    here, there = (0.0, 0.0), (1.0, 0.6)
    for q in scattered(6, seed=11):
        model.observe(q, affine(q), 0.05)
        model.seen_from(q, affine(q))
    for q in scattered(14, seed=12):
        model.observe(q, moved(q), 0.05)
        model.seen_from(q, moved(q))
    for _ in range(2 * REWEIGH_PERIOD):
        picture = model.seen_from(here, moved(here))
    assert distance(picture.predict(there), moved(there)) < 4


def test_after_all_was_doubted_a_few_new_key_frames_win():
    def turned(q):
        u, v = affine(q)
        return (640 - v, u - 100)

    here, there = (0.0, 0.0), (0.9, 0.5)
    off = []
    for doubted in (True, False):
        model = taught(affine, scattered(10, seed=11))
        model.seen_from(here, affine(here))
        if doubted:
            model.inflate_variances()
        for q in scattered(6, seed=13, low=-0.8, high=0.8):
            model.observe(q, turned(q), 0.05)
        for _ in range(4):
            picture = model.seen_from(here, turned(here))
        off.append(distance(picture.predict(there), turned(there)))
    assert off[0] < 30
    assert off[0] < 0.3 * off[1]


def test_a_chains_picture_does_not_change_when_the_model_learns():
    model = taught(affine, scattered(6))
    here, there = (0.1, 0.2), (0.9, -0.3)
    picture = model.seen_from(here, affine(here))
    before = picture.predict(there), picture.jacobian(there)
    for q in scattered(30, seed=9):
        model.observe(q, (0.0, 0.0), 0.01)
    model.inflate_variances()
    assert distance(model.seen_from(here, affine(here)).predict(there), before[0]) > 20
    assert (picture.predict(there), picture.jacobian(there)) == before


@pytest.mark.parametrize("joints", [2, 3])
def test_the_chains_covariance_is_positive_and_shrinks_with_what_is_known(joints):
    links = (9.0, 7.0, 5.0)[:joints]
    model = ChainModel(CHAINS[joints], links)
    here = (0.2,) * joints
    sizes = []
    for q in scattered(10, joints=joints):
        model.observe(q, affine(q, links), 0.5)
        model.seen_from(here, affine(here, links))
        P = model.covariance()
        assert is_positive(P)
        sizes.append(sum(P[k][k] for k in range(joints)))
    assert sizes == sorted(sizes, reverse=True) or sizes[-1] < 0.05 * sizes[0]
    assert sizes[-1] < 0.05 * sizes[0]


@pytest.mark.parametrize("chain", ["planar", "spatial"])
def test_how_the_image_moves_with_the_place_is_that_of_an_affine_camera(chain):
    arm = read_arm(find_arm(chain))
    axes = kinematics.coordinates(arm)
    C = [[12.0, -3.0, 1.0][:axes], [2.0, 5.0, -9.0][:axes]]
    model = ChainModel(arm.chain, [joint.link for joint in arm.joints])
    for q in scattered(40, joints=len(arm.joints)):
        p = kinematics.forward(arm, q)
        model.observe(q, [300 + sum(map(mul, row, p)) for row in C], 0.01)
    for found, row in zip(model.by_space(), C):
        assert found == pytest.approx(row, abs=0.1)


@pytest.mark.parametrize("name", ["planar", "spatial"])
def test_the_shape_in_a_chase_is_of_what_was_seen_at_rest_before_it(name):
    arm = read_arm(find_arm(name))
    poses = iter(scattered(12, joints=len(arm.joints)))
    model = ChainModel(arm.chain, [joint.link for joint in arm.joints])
    for k in range(6):
        model.observe(next(poses), (10.0 * k, 5.0), 1.0)
    before = model.shape().W
    rest = next(poses)
    model.observe(rest, (300.0, 200.0), 1.0)
    at_rest = model.seen_from(rest, (300.0, 200.0))
    assert model.shape().W == at_rest.W != before


@pytest.mark.parametrize("name", ["planar", "spatial"])
@pytest.mark.parametrize("standing", [True, False])
def test_every_new_key_frame_is_in_the_next_fit(name, standing):
    arm = read_arm(find_arm(name))
    poses = iter(scattered(12, joints=len(arm.joints)))
    model = ChainModel(arm.chain, [joint.link for joint in arm.joints])
    for k in range(6):
        model.observe(next(poses), (10.0 * k, 5.0), 1.0)
    before = model.by_space()
    assert model.by_space() == before
    model.observe(next(poses), (300.0, 200.0), 1.0, standing=standing)
    assert model.by_space() != before
