"""The zero on file: believed while the encoders agree, refused in one line otherwise."""

import json
import os

import pytest
from refusals import refused

import robot.motion.zero
from robot.motion.zero import MAX_PARKED_DRIFT, NotHomed, StateNotSaved, Zero

ZERO = {"A": -12.5, "B": 100.25}
PARKED = {"A": 40, "B": -7}


@pytest.fixture
def zero(tmp_path):
    return Zero("planar", str(tmp_path / "state"))


def test_what_was_saved_is_confirmed_where_it_was_parked(zero):
    zero.save(ZERO, PARKED)
    assert zero.confirmed(PARKED) == ZERO
    assert Zero("planar", os.path.dirname(zero.file)).confirmed(PARKED) == ZERO


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
        Zero("geared", os.path.dirname(zero.file)).confirmed(PARKED)


def test_a_motor_that_the_file_does_not_know(zero):
    zero.save(ZERO, PARKED)
    with pytest.raises(NotHomed) as error:
        zero.confirmed(dict(PARKED, C=0))
    assert refused(error, zero.file)


def test_only_the_motors_there_are_count(zero):
    zero.save(dict(ZERO, C=3.0), dict(PARKED, C=9))
    assert zero.confirmed(PARKED) == ZERO


@pytest.mark.parametrize(
    "garbage",
    [
        b"",
        b"poem",
        b"\xff\xfe\x00",
        b"[]",
        b"7",
        b"null",
        b'{"zero": {"A": 1, "B": 2}}',
        b'{"parked": {"A": 40, "B": -7}}',
        b'{"zero": null, "parked": {"A": 40, "B": -7}}',
        b'{"zero": {"A": "x", "B": 2}, "parked": {"A": 40, "B": -7}}',
        b'{"zero": {"A": 1, "B": 2}, "parked": true}',
        b'{"zero": {"A": 1, "B": 2}, "parked": [40, -7]}',
        b'{"zero": {"A": 1, "B": 2}, "parked": {"A": null, "B": -7}}',
        b'{"zero": {"A": NaN, "B": 2}, "parked": {"A": 40, "B": -7}}',
        b'{"zero": {"A": Infinity, "B": 2}, "parked": {"A": 40, "B": -7}}',
        b'{"zero": {"A": 1, "B": 2}, "parked": {"A": NaN, "B": -7}}',
    ],
)
def test_a_file_that_makes_no_sense_is_not_believed(zero, garbage):
    os.makedirs(os.path.dirname(zero.file))
    with open(zero.file, "wb") as file:
        file.write(garbage)
    with pytest.raises(NotHomed) as error:
        zero.confirmed(PARKED)
    assert refused(error, "driver.py home")


def test_a_folder_where_the_file_should_be(zero):
    os.makedirs(zero.file)
    with pytest.raises(NotHomed):
        zero.confirmed(PARKED)
    with pytest.raises(StateNotSaved) as error:
        zero.save(ZERO, PARKED)
    assert refused(error, zero.file, "BRICKSERVO_STATE")


def test_a_folder_that_cannot_be_made(tmp_path):
    (tmp_path / "state").write_text("in the way")
    zero = Zero("planar", str(tmp_path / "state"))
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
    assert Zero("planar").file == str(tmp_path / "there" / "planar.json")
    monkeypatch.delenv("BRICKSERVO_STATE")
    monkeypatch.setenv("HOME", str(tmp_path))
    assert Zero("planar").file == str(tmp_path / ".brickservo" / "planar.json")


def test_the_file_is_plain_json(zero):
    zero.save(ZERO, PARKED)
    with open(zero.file) as file:
        state = json.loads(file.read())
    assert state.pop("boot") == robot.motion.zero._boot()
    assert state == {"zero": ZERO, "parked": PARKED}
