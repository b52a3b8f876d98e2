"""Jobs on a brick: what is told of one, and what is typed while it is drawn."""

import json

import pytest

from laptop.brick.jobs import BrickJobStatus, JobKeys, StatusReader, read_status

TOLD = {
    "state": "drawing", "job": "rose", "crc": 1, "pid": 8, "reason": "", "stroke": 3,
    "strokes": 9, "cm": 12.5, "cm_all": 50.0, "left_s": 33, "repeat": 1, "repeats": 2,
    "tip": [10.1, 4.2], "volts": 7.6, "speed": 100, "pen": 0.0,
}  # fmt: skip


def test_a_status_is_read_as_the_brick_tells_it():
    status = read_status(TOLD)
    assert status == BrickJobStatus(
        "drawing", "rose", "", 3, 9, 12.5, 50.0, 33, 1, 2, (10.1, 4.2), 7.6, 100, 0.0
    )
    assert status.share == 0.25


@pytest.mark.parametrize("value", [None, 7, [], {}, {"state": 1}, "drawing"])
def test_what_is_no_status_is_none(value):
    assert read_status(value) is None


def test_nothing_strange_in_a_status_gets_through():
    strange = {
        "state": "draw\x1b[2J", "job": None, "cm": "12", "cm_all": float("nan"), "tip": [1, "2"],
        "volts": True, "left_s": [],
    }  # fmt: skip
    assert read_status(strange) == BrickJobStatus("draw [2J", "")


def test_statuses_are_taken_until_they_are_over_and_then_what_is_said():
    reported = [json.dumps(TOLD), "", json.dumps(dict(TOLD, stroke=4)), '{"over": true}']
    reader = StatusReader()
    found = [reader.handle(line) for line in [*reported, "driver.py: the elbow is blocked"]]
    assert [status and status.stroke for status in found] == [3, None, 4, None, None]
    assert reader.final_output == "driver.py: the elbow is blocked\n"


@pytest.mark.parametrize(
    "line",
    [
        json.dumps(TOLD)[:60],
        "[" * 50_000,
        '{"state": "drawing", "x": ' + "[" * 50_000,
        '{"cm": ' + "9" * 5000,
        "\x1b[2J",
    ],
)
def test_a_line_that_is_no_status_is_left_out(line):
    reader = StatusReader()
    assert reader.handle(line) is None
    assert reader.handle(json.dumps(TOLD)).stroke == 3


@pytest.mark.parametrize("number", ["1e999", "-1e308", "1" + "0" * 400, "NaN", "1e300"])
def test_a_number_beyond_all_bounds_is_not_taken(number):
    line = f'{{"state": "drawing", "cm": {number}, "stroke": {number}, "left_s": {number}}}'
    assert StatusReader().handle(line) in (None, BrickJobStatus("drawing"))


def test_what_a_program_says_at_its_end_is_kept_in_part_only():
    reader = StatusReader()
    reader.handle('{"over": true}')
    for _ in range(1000):
        reader.handle("A" * 1000)
    assert len(reader.final_output) <= 4000


@pytest.fixture
def keys():
    orders = []
    keys = JobKeys(orders.append, lambda: orders.append("left"))
    keys.orders = orders
    return keys


def test_ctrl_c_pauses_and_a_second_one_aborts(keys):
    keys.handle(b"\x03")
    assert keys.orders == ["pause"]
    keys.update(BrickJobStatus("drawing"))  # it has not come to a stop yet
    keys.handle(b"\x03")
    assert keys.orders == ["pause", "abort"]


def test_after_a_pause_that_is_over_ctrl_c_pauses_again(keys):
    keys.handle(b"\x03")
    keys.update(BrickJobStatus("paused"))
    keys.handle(b" ")
    keys.update(BrickJobStatus("paused"))  # told before it took the order
    keys.update(BrickJobStatus("drawing"))
    keys.handle(b"\x03")
    assert keys.orders == ["pause", "resume", "pause"]


def test_space_pauses_and_goes_on(keys):
    keys.handle(b" ")
    keys.update(BrickJobStatus("paused"))
    keys.handle(b"\r")
    assert keys.orders == ["pause", "resume"]


@pytest.mark.parametrize(
    ("typed", "orders"),
    [
        (b"+", ["speed 60"]),
        (b"-", ["speed 40"]),
        (b"dd", ["pen 3", "pen 5"]),
        (b"u", ["pen -1"]),
        (b"a", ["abort"]),
        (b"q", ["left"]),
        (b"x\x1b[A\xff", []),
    ],
)
def test_keys_are_orders(keys, typed, orders):
    keys.update(BrickJobStatus("drawing", speed=50, pen=1))
    keys.handle(typed)
    assert keys.orders == orders


def test_speed_stays_within_what_the_brick_takes(keys):
    keys.update(BrickJobStatus("drawing", speed=30))
    keys.handle(b"-")
    keys.update(BrickJobStatus("drawing", speed=100))
    keys.handle(b"+")
    assert keys.orders == ["speed 25", "speed 100"]
