"""Homing finds the zero that the emulated arm really has, gently, or says why not."""

import math

import pytest
from rig import degrees, described, switched_on, zero_of

from robot.motion.stops import MAX_TOUCH_SPREAD, Blocked
from robot.motion.zero import NotHomed


def quiet(line):
    pass


def off(found, rig, start):
    """How far the zeros found are from the true ones, deg at the joint."""
    true = zero_of(rig.arm, start)
    return {
        joint.name: abs(f.zero - true[joint.port]) / joint.gear
        for f, joint in zip(found, rig.arm.joints)
    }


@pytest.mark.short("planar-2-start1")
@pytest.mark.parametrize(
    ("name", "play", "start"),
    [
        ("planar", 0, (0, 0)),
        ("planar", 2, (120, -100)),
        ("planar", 5, (-85, 145)),
        ("geared", 0, (-85, 145)),
        ("geared", 5, (120, -100)),
    ],
)
def test_from_both_stops_the_play_cancels_even_if_it_is_not_the_described(
    tmp_path, name, start, play
):
    start = degrees(*start)
    plant = f"backlash={play}"
    with switched_on(tmp_path, name, plant, start=start, homed=False) as rig:
        found = rig.robot(awake=False).home(say=quiet, seek=True)
        assert max(off(found, rig, start).values()) < 1.0
        for f in found:
            assert math.degrees(f.backlash) == pytest.approx(play, abs=1.0)
            assert f.spread <= MAX_TOUCH_SPREAD


@pytest.mark.parametrize("plant", ["seed=24,load=0.015", "seed=24,rotor_friction=2"])
def test_a_joint_that_is_too_stiff_for_a_soft_push_is_pushed_harder(tmp_path, plant):
    start = degrees(20, -30)
    with switched_on(tmp_path, "planar", plant, start=start, homed=False) as rig:
        found = rig.robot(awake=False).home(say=quiet, seek=True)
        assert max(off(found, rig, start).values()) < 2.0


@pytest.mark.short("planar-lower", "geared-upper")
@pytest.mark.parametrize("side", ["lower", "upper"])
@pytest.mark.parametrize("name", ["planar", "geared"])
def test_from_one_stop_the_described_play_is_allowed_for(tmp_path, name, side):
    start = degrees(20, -30)
    arm = described(name, 4, seek=side)
    with switched_on(tmp_path, arm, start=start, homed=False) as rig:
        lines = []
        found = rig.robot(awake=False).home(say=lines.append, seek=True)
        assert max(off(found, rig, start).values()) < 1.3
        assert [f.backlash for f in found] == [None, None]
        assert all(side in line for line in lines)


@pytest.mark.short("seed=4,backlash=3")
@pytest.mark.parametrize("plant", ["seed=3", "seed=4,backlash=3", "voltage=7", "access=0.002"])
def test_on_other_plants(tmp_path, plant):
    start = degrees(60, 60)
    with switched_on(tmp_path, "planar", plant, start=start, homed=False) as rig:
        found = rig.robot(awake=False).home(say=quiet, seek=True)
        assert max(off(found, rig, start).values()) < 1.3


def test_the_push_is_gentle(tmp_path):
    with switched_on(tmp_path, start=degrees(20, -30), homed=False) as rig:
        pushes = []

        def watch(t):
            for drive in rig.brick.plant.joints:
                link = drive.link
                if not link.lower + 1e-4 < link.angle < link.upper - 1e-4:
                    side = math.copysign(1, link.angle - (link.lower + link.upper) / 2)
                    pushes.append(side * math.copysign(1, drive.ratio) * (drive.duty or 0))

        rig.world.bodies.append(watch)
        rig.robot(awake=False).home(say=quiet, seek=True)
        assert len(pushes) > 100
        assert max(pushes) <= 0.30  # of the duty: what is called gentle


def test_afterwards_the_zero_is_on_file_and_the_arm_draws(tmp_path):
    with switched_on(tmp_path, start=degrees(100, -70), homed=False) as rig:
        with pytest.raises(rig.its(NotHomed)):
            rig.robot()
        driver = rig.driver(awake=False)
        driver.home(seek=True)
        assert max(abs(math.degrees(angle)) for angle in rig.q) < 2.5, "at its home pose"
        driver.arm.park()
        second = rig.driver()
        second.move_to((8, 12))
        assert rig.tip == pytest.approx((8, 12), abs=0.6)


def test_progress_is_told(tmp_path):
    with switched_on(tmp_path, homed=False) as rig:
        lines = []
        driver = rig.driver(awake=False, say=lines.append)
        driver.home(seek=True)
    text = "\n".join(lines)
    for name in (
        "shoulder, lower",
        "shoulder, upper",
        "elbow, lower",
        "elbow, upper",
        "play 2.",
    ):
        assert name in text


def test_here_takes_the_arm_as_it_stands_and_nothing_moves(tmp_path):
    arm = described("planar", home=math.radians(20))
    with switched_on(tmp_path, arm, start=degrees(21, 19), homed=False) as rig:
        driver = rig.driver(awake=False)
        driver.home(here=True)
        assert rig.writes == []
        assert rig.driver().arm.angles() == pytest.approx(degrees(20, 20))


def test_a_joint_that_is_placed_by_hand_beside_one_that_homes(tmp_path):
    arm = described("planar")
    arm = arm._replace(joints=(arm.joints[0]._replace(seek=None), arm.joints[1]))
    with switched_on(tmp_path, arm, start=degrees(0, 50), homed=False) as rig:
        found = rig.robot(awake=False).home(say=quiet, seek=True)
        assert max(off(found, rig, degrees(0, 50)).values()) < 1.0
        assert max(abs(math.degrees(sample.q[0])) for sample in rig.brick.record) < 2.5


# What is not as described


def homed_as(rig, **changes):
    """Home with a description whose elbow differs from the one on the brick."""
    shoulder, elbow = rig.arm.joints
    joints = (shoulder, elbow._replace(**changes))
    robot = rig.robot(awake=False, arm=rig.arm._replace(joints=joints))
    try:
        robot.home(say=quiet, seek=True)
    finally:
        robot.park()


def refused(rig, error, *messages):
    text = str(error.value)
    assert "\n" not in text
    assert all(word in text for word in messages), text
    assert rig.brick.driven() == []
    with pytest.raises(rig.its(NotHomed)):
        rig.robot()
    return True


@pytest.mark.short("200")
@pytest.mark.parametrize(("stop", "is_short"), [(154, False), (200, True)], ids=["154", "200"])
def test_stops_that_are_not_those_of_the_arm_file(tmp_path, stop, is_short):
    with switched_on(tmp_path, homed=False) as rig:
        with pytest.raises(rig.its(Blocked)) as error:
            homed_as(rig, stop_upper=math.radians(stop), upper=math.radians(120))
        assert refused(rig, error, "elbow", "stops", "measure them")
    # What gets farther than the arm file says meets nothing on its way.
    assert ("clear its way, ease it if it runs stiffly" in str(error.value)) == is_short


def test_a_stop_that_is_not_there(tmp_path):
    arm = described("planar", stop_upper=None)
    with switched_on(tmp_path, arm, homed=False) as rig:
        with pytest.raises(rig.its(Blocked)) as error:
            homed_as(rig, stop_upper=math.radians(160))
        assert refused(rig, error, "elbow", "no stop")


def test_a_stop_that_gives_way(tmp_path):
    """Something leans against the joint, and slips with every other touch, to the last."""
    with switched_on(tmp_path, homed=False) as rig:
        link = rig.brick.plant.drives["B"].link
        link.lower += math.radians(36)
        touches, slipped = [False], []

        def slip(t):
            off = link.angle - link.lower
            if touches[-1] != (off <= 1e-6) and not 0 < off < math.radians(0.5):
                touches.append(not touches[-1])
            if len(touches) >= 5 + 4 * len(slipped) and not touches[-1]:  # twice there and back
                slipped.append(t)
                link.lower -= math.radians(6)

        rig.world.bodies.append(slip)
        with pytest.raises(rig.its(Blocked)) as error:
            homed_as(rig)
        assert slipped
        assert refused(rig, error, "elbow", "counts apart")


def test_an_arm_that_had_a_zero_loses_it_when_homing_fails(tmp_path):
    with switched_on(tmp_path) as rig:
        with pytest.raises(rig.its(Blocked)) as error:
            homed_as(rig, stop_upper=math.radians(200))
        assert refused(rig, error, "stops")


@pytest.mark.long
@pytest.mark.parametrize(("play", "message"), [(2, False), (3, False), (5, True)])
def test_play_that_is_not_the_described_is_told(tmp_path, play, message):
    with switched_on(tmp_path, "planar", f"backlash={play}", homed=False) as rig:
        lines = []
        driver = rig.driver(awake=False)
        driver.say = lines.append
        driver.home(seek=True)
    assert [line for line in lines if "says 2.0 deg of play" in line] == [
        f"{name}: the arm file says 2.0 deg of play; correct it, or the stops"
        for name in ("shoulder", "elbow")
        if message
    ]
