"""The zero on file: believed while the encoders agree, refused in one line otherwise."""

import json
import math
import os

import pytest
from refusals import in_one_line, refused
from rig import Shell

import robot.motion.zero
from robot.motion.zero import MAX_PARKED_DRIFT, VERSION, NotHomed, StateNotSaved, Zero, meaning
from shared.arm_description import find_arm, read_arm

ARM = read_arm(find_arm("planar"))
ZERO = {"A": -12.5, "B": 100.25}
PARKED = {"A": 40, "B": -7}


@pytest.fixture
def zero(tmp_path):
    return Zero(ARM, str(tmp_path / "state"))


def change(its, **changes):
    """Change the file of a Zero; a value is a function of what was there."""
    with open(its.file) as file:
        state = json.loads(file.read())
    for key, changed in changes.items():
        state[key] = changed(state.get(key))
        if state[key] is None:
            del state[key]
    with open(its.file, "w") as file:
        file.write(json.dumps(state))


def test_what_was_saved_is_confirmed_where_it_was_parked(zero):
    zero.save(ZERO, PARKED)
    assert zero.confirmed(PARKED) == ZERO
    assert Zero(ARM, os.path.dirname(zero.file)).confirmed(PARKED) == ZERO


@pytest.mark.parametrize("port", ["A", "B"])
@pytest.mark.parametrize("sign", [1, -1])
def test_a_motor_may_settle_by_a_few_counts_and_no_more(zero, port, sign):
    zero.save(ZERO, PARKED)
    assert zero.confirmed(dict(PARKED, **{port: PARKED[port] + sign * MAX_PARKED_DRIFT})) == ZERO
    turned = PARKED[port] + sign * (MAX_PARKED_DRIFT + 1)
    with pytest.raises(NotHomed) as error:
        zero.confirmed(dict(PARKED, **{port: turned}))
    assert refused(error, "motor " + port, str(turned), str(PARKED[port]), "driver.py home")


def test_an_arm_never_homed(zero):
    with pytest.raises(NotHomed) as error:
        zero.confirmed(PARKED)
    assert refused(error, "not been homed", "driver.py home")


def test_an_arm_that_was_not_parked(zero):
    zero.save(ZERO, PARKED)
    zero.save(ZERO, None)
    with pytest.raises(NotHomed) as error:
        zero.confirmed(PARKED)
    assert refused(error, "without parking", "driver.py home")


def test_an_arm_that_may_have_been_moved_while_the_brick_was_off(zero, monkeypatch, tmp_path):
    """Parked at counts near 0 and switched off, the encoders alone could not tell."""
    other = tmp_path / "boot_id"
    other.write_text("another start\n")
    zero.save(ZERO, PARKED)
    monkeypatch.setattr(robot.motion.zero, "BOOT_ID", str(other))
    with pytest.raises(NotHomed) as error:
        zero.confirmed(PARKED)
    assert refused(error, "switched off", "driver.py home")


def test_each_arm_has_its_own(zero):
    zero.save(ZERO, PARKED)
    with pytest.raises(NotHomed):
        Zero(read_arm(find_arm("geared")), os.path.dirname(zero.file)).confirmed(PARKED)


def test_a_motor_that_the_file_does_not_know(zero):
    zero.save(ZERO, PARKED)
    with pytest.raises(NotHomed) as error:
        zero.confirmed(dict(PARKED, C=0))
    assert refused(error, zero.file)


def test_only_the_motors_there_are_count(zero):
    zero.save(dict(ZERO, C=3.0), dict(PARKED, C=9))
    assert zero.confirmed(PARKED) == ZERO


@pytest.mark.parametrize(
    "changes",
    [
        {"zero": 3},
        {"zero": None},
        {"zero": {"A": "1", "B": 2}},
        {"zero": {"A": 1}},
        {"zero": {"A": True, "B": 2}},
        {"zero": {"A": 10**400, "B": 2}},
        {"zero": {}},
        {"zero": [1, 2]},
        {"parked": True},
        {"parked": [40, -7]},
        {"parked": {"A": None, "B": -7}},
        {"parked": {"A": False, "B": -7}},
        {"parked": "no"},
        {"version": True},
        {"version": "2"},
        {"version": [2]},
        {"arm": None},
        {"arm": []},
        {"arm": {"shoulder.gear": {}}},
        {"arm": {"shoulder.gear": True}},
        {"arm": {}, "file": 7},
    ],
    ids=str,
)
def test_a_file_that_makes_no_sense_is_not_believed(zero, changes):
    zero.save(ZERO, PARKED)
    change(zero, **{key: lambda _, value=value: value for key, value in changes.items()})
    with pytest.raises(NotHomed) as error:
        zero.confirmed(PARKED)
    assert refused(error, zero.file, "so the zero is unknown", "driver.py home")


@pytest.mark.parametrize(
    "garbage",
    [
        b"",
        b"poem",
        b"\xff\xfe\x00",
        b"[]",
        b"7",
        b"null",
        b"[" * 9000,
        b'{"a":' * 9000,
        b"9" * 5000,
    ],
)
def test_what_is_none_of_ours_is_not_believed(zero, garbage):
    os.makedirs(os.path.dirname(zero.file))
    with open(zero.file, "wb") as file:
        file.write(garbage)
    with pytest.raises(NotHomed) as error:
        zero.confirmed(PARKED)
    assert refused(error, zero.file, "driver.py home")


@pytest.mark.parametrize("word", ["NaN", "Infinity", "-Infinity"])
@pytest.mark.parametrize("key", ["zero", "parked"])
def test_what_is_no_number_is_not_believed(zero, key, word):
    zero.save(ZERO, PARKED)
    change(zero, **{key: lambda there: dict(there, A=1234567)})
    with open(zero.file) as file:
        text = file.read().replace("1234567", word)
    with open(zero.file, "w") as file:
        file.write(text)
    with pytest.raises(NotHomed) as error:
        zero.confirmed(PARKED)
    assert refused(error, zero.file)


# Whose zero it is


def test_a_file_of_an_earlier_version_says_nothing_of_the_arm(zero):
    zero.save(ZERO, PARKED)
    change(zero, version=lambda _: None, arm=lambda _: None, file=lambda _: None)
    with pytest.raises(NotHomed) as error:
        zero.confirmed(PARKED)
    assert refused(error, zero.file, "an earlier version", "driver.py home")


def test_a_file_of_a_later_version_is_not_guessed_at(zero):
    zero.save(ZERO, PARKED)
    change(zero, version=lambda now: now + 1, arm=lambda _: None)
    with pytest.raises(NotHomed) as error:
        zero.confirmed(PARKED)
    assert refused(error, zero.file, "a later version", "driver.py home")


EDITS = {
    "port": "D", "motor": "medium", "gear": 3.0, "direction": -1, "stop_lower": -2.0,
    "stop_upper": 2.9, "home": 0.1, "backlash": 0.1,
}  # fmt: skip


@pytest.mark.parametrize("key", sorted(EDITS))
def test_an_arm_that_was_edited_after_homing_is_told_so(zero, key):
    zero.save(ZERO, PARKED)
    joints = (ARM.joints[0]._replace(**{key: EDITS[key]}),) + ARM.joints[1:]
    edited = Zero(ARM._replace(joints=joints), os.path.dirname(zero.file))
    with pytest.raises(NotHomed) as error:
        edited.confirmed(PARKED)
    assert refused(error, "planar", "edited: its shoulder." + key + " was", "driver.py home")
    edited.save(ZERO, PARKED)
    assert edited.confirmed(PARKED) == ZERO
    with pytest.raises(NotHomed):
        zero.confirmed(PARKED)


def test_another_arm_of_the_same_name_is_told_by_its_file(zero):
    zero.save(ZERO, PARKED)
    geared = read_arm(find_arm("geared"))._replace(name="planar", file="/other/planar.ini")
    with pytest.raises(NotHomed) as error:
        Zero(geared, os.path.dirname(zero.file)).confirmed(PARKED)
    assert refused(error, "another arm, " + ARM.file, "elbow.direction is 1 there and -1 here")


def test_what_does_not_change_what_counts_mean_may_be_edited(zero):
    zero.save(ZERO, PARKED)
    joints = tuple(
        joint._replace(link=9.0, max_speed=0.5, lower=-0.5, upper=1.0, find_home="here", mass=0.1)
        for joint in ARM.joints
    )
    other = ARM._replace(joints=joints, speed=1.0, elbow="down", file="/moved/planar.ini")
    assert Zero(other, os.path.dirname(zero.file)).confirmed(PARKED) == ZERO


def test_the_pen_counts_where_there_is_one(zero):
    zero.save(ZERO, PARKED)
    for pen, word in (
        (ARM.pen._replace(up=ARM.pen.up + 0.1), "pen.up was"),
        (ARM.pen._replace(port="D"), "pen.port was C and is D"),
        (None, "pen.motor was medium and is not there"),
    ):
        with pytest.raises(NotHomed) as error:
            Zero(ARM._replace(pen=pen), os.path.dirname(zero.file)).confirmed(PARKED)
        assert refused(error, word)


@pytest.mark.parametrize("name", ["planar", "geared", "spatial"])
def test_the_numbers_of_an_arm_survive_the_file(name, tmp_path):
    arm = read_arm(find_arm(name))
    assert json.loads(json.dumps(meaning(arm))) == meaning(arm)
    Zero(arm, str(tmp_path)).save(ZERO, PARKED)
    assert Zero(read_arm(find_arm(name)), str(tmp_path)).confirmed(PARKED) == ZERO


# Where an arm cannot stand


def test_an_angle_beyond_a_stop_is_refused(zero):
    home = [joint.home for joint in ARM.joints]
    zero.check_angles(home, ARM.pen.up)
    slack = math.radians(1)
    for k, joint in enumerate(ARM.joints):
        for stop, sign in ((joint.stop_lower, -1), (joint.stop_upper, 1)):
            angles = list(home)
            angles[k] = stop + sign * (joint.backlash + slack)
            zero.check_angles(angles, ARM.pen.down)
            angles[k] = stop + sign * (joint.backlash + math.radians(10) + slack)
            with pytest.raises(NotHomed) as error:
                zero.check_angles(angles)
            reported = "{} stands at {:.1f} deg".format(joint.name, math.degrees(angles[k]))  # noqa: UP032
            assert refused(error, reported, zero.file, "driver.py home")
    with pytest.raises(NotHomed) as error:
        zero.check_angles(home, ARM.pen.up + math.radians(100) * (1 if ARM.pen.up else -1))
    assert refused(error, "pen stands at")


def test_where_there_is_no_stop_the_limit_counts(tmp_path):
    joints = tuple(joint._replace(stop_lower=None, stop_upper=None) for joint in ARM.joints)
    zero = Zero(ARM._replace(joints=joints), str(tmp_path))
    zero.check_angles([joint.upper + joint.backlash for joint in joints])
    with pytest.raises(NotHomed):
        zero.check_angles([joint.upper + 0.4 for joint in joints])


def test_no_zero_of_millions_of_degrees_is_said_or_driven_by(tmp_path, monkeypatch, capsys):
    shell = Shell(tmp_path, monkeypatch, capsys)
    far = dict(shell.on_file()["zero"], A=1e6)
    shell.state.save(far, dict.fromkeys(far, 0))
    for args in (("where",), ("move", "12,6")):
        shown = shell.run(*args)
        assert shown.status == 1
        assert in_one_line(shown.err, "shoulder stands at -1000000", "driver.py home")
    assert not shell.busy


def test_a_folder_where_the_file_should_be(zero):
    os.makedirs(zero.file)
    with pytest.raises(NotHomed):
        zero.confirmed(PARKED)
    with pytest.raises(StateNotSaved) as error:
        zero.save(ZERO, PARKED)
    assert refused(error, zero.file, "BRICKSERVO_STATE")


def test_a_folder_that_cannot_be_made(tmp_path):
    (tmp_path / "state").write_text("in the way")
    zero = Zero(ARM, str(tmp_path / "state"))
    with pytest.raises(StateNotSaved) as error:
        zero.save(ZERO, PARKED)
    assert refused(error, zero.file, "BRICKSERVO_STATE")
    with pytest.raises(NotHomed):
        zero.confirmed(PARKED)


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write everywhere")
def test_a_folder_that_may_not_be_written(zero):
    zero.save(ZERO, PARKED)
    os.chmod(os.path.dirname(zero.file), 0o500)
    try:
        with pytest.raises(StateNotSaved):
            zero.save(ZERO, None)
    finally:
        os.chmod(os.path.dirname(zero.file), 0o700)
    assert zero.confirmed(PARKED) == ZERO


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="no /dev/full to stand for a full disk")
def test_on_a_full_disk_the_old_file_survives(zero):
    zero.save(ZERO, PARKED)
    before = os.listdir(os.path.dirname(zero.file))
    os.symlink("/dev/full", zero.file + ".new")
    with pytest.raises(StateNotSaved) as error:
        zero.save(ZERO, None)
    assert refused(error, zero.file, "No space left")
    assert zero.confirmed(PARKED) == ZERO
    os.remove(zero.file + ".new")
    zero.save(ZERO, {"A": 0, "B": 0})
    assert os.listdir(os.path.dirname(zero.file)) == before, "no drafts are left behind"


def test_a_write_cut_short_leaves_the_old_file(zero):
    """As when the brick is switched off while it writes: only the draft is torn."""
    zero.save(ZERO, PARKED)
    with open(zero.file + ".new", "w") as draft:
        draft.write('{"parked": {"A"')
    assert zero.confirmed(PARKED) == ZERO
    zero.save(ZERO, PARKED)
    assert zero.confirmed(PARKED) == ZERO


def test_where_the_file_is(monkeypatch, tmp_path):
    monkeypatch.setenv("BRICKSERVO_STATE", str(tmp_path / "there"))
    assert Zero(ARM).file == str(tmp_path / "there" / "planar.json")
    monkeypatch.delenv("BRICKSERVO_STATE")
    monkeypatch.setenv("HOME", str(tmp_path))
    assert Zero(ARM).file == str(tmp_path / ".brickservo" / "planar.json")


def test_the_file_is_plain_json(zero):
    zero.save(ZERO, PARKED)
    with open(zero.file) as file:
        state = json.loads(file.read())
    assert state.pop("boot") == robot.motion.zero.boot_id()
    assert state.pop("arm") == meaning(ARM)
    assert state == {"version": VERSION, "file": ARM.file, "zero": ZERO, "parked": PARKED}
