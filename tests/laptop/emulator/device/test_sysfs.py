"""The seams under the unmodified library, over a device of one value."""

import errno
import os
import select
import time

import ev3dev2
import ev3dev2.motor
import pytest

from laptop.emulator.device.sysfs import Attribute, Poll, Sysfs
from laptop.emulator.host.world import World

COST = 0.004
FOUND = {"address": "ev3-ports:outB", "driver_name": "lego-ev3-l-motor"}


class OneValue:
    """Holds the text that was written last; refuses "bad", is gone once `gone`."""

    def __init__(self):
        self.text = "360"
        self.notifications = 0
        self.gone = False

    def read(self, attribute):
        self._answer()
        return self.text

    def write(self, attribute, text):
        self._answer()
        if text in ("bad", "9999"):
            raise OSError(errno.EINVAL, "invalid")
        self.text = text

    def _answer(self):
        if self.gone:
            raise OSError(errno.ENODEV, "gone")


@pytest.fixture
def world():
    return World()


@pytest.fixture
def device():
    return OneValue()


@pytest.fixture
def sysfs(world, device):
    sysfs = Sysfs(world, COST)
    sysfs.add("tacho-motor", "motor1", FOUND, device)
    return sysfs


def test_every_access_is_counted_and_takes_its_time(world, sysfs, device):
    attribute = Attribute(sysfs, device, "position")
    for _ in range(3):
        attribute.seek(0)
        assert attribute.read() == b"360\n"
        attribute.seek(0)
        attribute.write(b"12\n")
        attribute.flush()
        device.text = "360"
    assert sysfs.accesses == 6
    assert world.now() == pytest.approx(6 * COST)
    assert world.busy == pytest.approx(6 * COST)


def test_a_refused_access_is_an_access_too(world, sysfs, device):
    attribute = Attribute(sysfs, device, "position")
    with pytest.raises(OSError, match="invalid"):
        attribute.write(b"bad")
    assert sysfs.accesses == 1
    assert world.now() == COST


def test_the_value_is_the_one_at_the_end_of_the_access(world, sysfs, device):
    world.at(COST / 2, lambda: setattr(device, "text", "7"))
    assert Attribute(sysfs, device, "position").read() == b"7\n"


def test_a_read_can_be_cut_short_like_a_files(sysfs, device):
    device.text = "12345"
    assert Attribute(sysfs, device, "position").read(2) == b"12"


# Under the library


def test_the_library_finds_the_device_by_both_spellings_of_its_address(sysfs):
    with sysfs.installed():
        for address in ("outB", "ev3-ports:outB"):
            assert ev3dev2.motor.LargeMotor(address).address == "360"
    assert sysfs.accesses == 2 * 3  # max_speed, count_per_rot, and address just above


@pytest.mark.parametrize(
    ("kind", "address"),
    [("LargeMotor", "outA"), ("MediumMotor", "outB"), ("LargeMotor", "outC")],
    ids=["another port", "another type", "no port"],
)
def test_what_is_not_plugged_in_is_not_found(sysfs, kind, address):
    with sysfs.installed(), pytest.raises(ev3dev2.DeviceNotFound, match="is not connected"):
        getattr(ev3dev2.motor, kind)(address)


def test_errors_reach_the_program_as_the_library_words_them(sysfs, device):
    device.text = "1050"
    with sysfs.installed():
        motor = ev3dev2.motor.Motor("outB")
        with pytest.raises(ValueError, match=r"speed value b'9999' was out of range.*\+/-1050"):
            motor.speed_sp = 9999
        with pytest.raises(ValueError, match="out of range or invalid, value b'bad'"):
            motor.command = "bad"
        device.gone = True
        with pytest.raises(ev3dev2.DeviceNotFound, match="no longer connected"):
            motor.position  # noqa: B018
        with pytest.raises(ev3dev2.DeviceNotFound, match="no longer connected"):
            motor.stop()


def test_the_library_truncates_numbers_before_we_see_them(sysfs, device):
    with sysfs.installed():
        motor = ev3dev2.motor.LargeMotor("outB")
        motor.position_sp = 89.9
        assert device.text == "89"


def test_a_removed_device_is_no_longer_found_but_old_handles_still_lead_to_it(sysfs, device):
    with sysfs.installed():
        motor = ev3dev2.motor.LargeMotor("outB")
        path = motor._path
        assert sysfs.has(path)
        sysfs.remove("tacho-motor", "motor1")
        assert not sysfs.has(path)
        assert not os.path.exists(path)
        with pytest.raises(ev3dev2.DeviceNotFound):
            ev3dev2.motor.LargeMotor("outB")
        device.gone = True
        with pytest.raises(ev3dev2.DeviceNotFound, match="no longer"):
            motor.position  # noqa: B018


def test_a_device_can_be_added_while_installed(sysfs):
    late = OneValue()
    late.text = "3"
    with sysfs.installed():
        sysfs.add("tacho-motor", "motor2", dict(FOUND, address="ev3-ports:outC"), late)
        assert ev3dev2.motor.LargeMotor("outC").position == 3


def test_the_library_is_itself_again_afterwards_and_the_folder_gone(sysfs):
    def seams():
        device = ev3dev2.Device
        motor = ev3dev2.motor
        return device.DEVICE_ROOT_PATH, device._attribute_file_open, motor.select, motor.time

    before = seams()
    assert before[2:] == (select, time)

    def fail():
        with sysfs.installed():
            root = ev3dev2.Device.DEVICE_ROOT_PATH
            files = os.listdir(os.path.join(root, "tacho-motor", "motor1"))
            assert sorted(files) == ["address", "driver_name"]
            assert all(new != old for new, old in zip(seams(), before))
            raise KeyError(root)

    with pytest.raises(KeyError) as caught:
        fail()
    assert seams() == before
    assert not os.path.exists(caught.value.args[0])


def test_the_librarys_time_is_the_worlds(world, sysfs):
    with sysfs.installed():
        ev3dev2.motor.time.sleep(2.5)
        assert ev3dev2.motor.time.time() == world.now() == 2.5


# Waiting


@pytest.mark.parametrize(
    ("notified_at", "timeout", "returned_at"),
    [(0.03, 100, 0.03), (None, 100, 0.1), (0.2, 100, 0.1), (0.2, None, 0.2), (None, 0, 0.0)],
    ids=["notified", "timeout", "too late", "no timeout", "only a look"],
)
def test_poll_returns_when_notified_or_when_time_is_up(
    world, sysfs, device, notified_at, timeout, returned_at
):
    attribute = Attribute(sysfs, device, "state")
    attribute.read()
    start = world.now()
    poll = Poll(world)
    poll.register(attribute, select.POLLPRI)
    if notified_at:
        world.at(start + notified_at, lambda: setattr(device, "notifications", 1))
    ready = poll.poll(timeout)
    assert world.now() - start == pytest.approx(returned_at, abs=Poll.TICK)
    notified = notified_at and notified_at <= returned_at + Poll.TICK
    assert ready == ([(attribute, select.POLLPRI)] if notified else [])


def test_poll_is_armed_by_reading(world, sysfs, device):
    attribute = Attribute(sysfs, device, "state")
    poll = Poll(world)
    poll.register(attribute)
    assert poll.poll(100)  # never read
    assert poll.poll(100)  # nor since
    attribute.read()
    device.notifications += 1
    attribute.read()
    before = world.now()
    assert not poll.poll(100)  # what happened before the last look is no news
    assert world.now() - before == pytest.approx(0.1)
