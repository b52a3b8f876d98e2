"""Orders are read or refused in one line; who gives them may be a button, a key or a laptop."""

import math
import os

import pytest

from robot.jobs.orders import (
    MAX_PEN_TRIM,
    POLL_PERIOD,
    SPEED_BOUNDS,
    BadOrder,
    JobOrders,
    Keys,
    read_order,
)
from shared.job_messages import PEN_STEP, RELATIVE_SPEED


class Pressed:
    """Buttons that somebody presses: a list a look."""

    def __init__(self, *looks):
        self._looks = [list(look) for look in looks]

    def pressed(self):
        return self._looks.pop(0) if self._looks else []


def looked(orders, times):
    """The rates that so many looks give."""
    return [orders.sample(k * 1.01 * POLL_PERIOD) for k in range(times)]


@pytest.mark.parametrize(
    ("text", "order"),
    [
        ("pause", ("pause", [])),
        (" resume\n", ("resume", [])),
        ("abort", ("abort", [])),
        ("speed 60", ("speed", [60.0])),
        ("pen -5", ("pen", [-5.0])),
        ("nudge 0.5 -1", ("nudge", [0.5, -1.0])),
    ],
)
def test_an_order_is_read(text, order):
    assert read_order(text) == order


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "is no order; write one of abort, nudge, pause, pen, resume, speed"),
        ("Pause", "'Pause' is no order"),
        ("speed", "takes a number from 25 to 100 per cent"),
        ("speed 5", "from 25 to 100"),
        ("speed 200", "from 25 to 100"),
        ("speed nan", "from 25 to 100"),
        ("speed fast", "from 25 to 100"),
        ("speed 50 50", "takes a number"),
        ("pen 31", "from -30 to 30 degrees"),
        ("nudge 1", "takes two numbers from -10 to 10 mm"),
        ("nudge 11 0", "takes two numbers"),
        ("nudge inf 0", "takes two numbers"),
        ("pause now", "pause takes nothing"),
        ("x" * 5000, "is no order"),
        ("\x1b[2J", "is no order"),
    ],
)
def test_what_is_no_order_is_refused_in_one_line(text, message):
    with pytest.raises(BadOrder) as error:
        read_order(text)
    printed = str(error.value)
    assert message in printed
    assert len(printed) < 200
    assert "\x1b" not in printed
    assert "\n" not in printed


def test_orders_come_from_lines_that_are_appended_to_a_file(tmp_path):
    path = tmp_path / "orders"
    path.write_text("abort\n")  # of a job that is over
    orders = JobOrders(path=str(path))
    now = iter(range(5000))

    def speed_after(text, how="a"):
        with open(str(path), how) as file:
            file.write(text)
        return orders.sample(next(now))

    assert orders.sample(next(now)) == 1.0
    assert not orders.aborted
    assert speed_after("pause\n") == 0.0
    assert speed_after("res") == 0.0  # the rest is to come
    assert speed_after("ume\nspeed 60\n") == 0.6
    assert speed_after("spe ed\n\xe9\x00\n") == 0.6
    assert len(orders.notes) == 2
    assert speed_after("speed 30\n", "w") == 0.3  # begun anew
    for k in range(2000):
        speed_after(f"pen {k % 30}\n")
    assert orders.pen == pytest.approx(math.radians(1999 % 30))
    assert speed_after("x" * 20000) == 0.3
    for _ in range(10):
        orders.sample(next(now))
    assert speed_after("\nabort\n") == 0.0
    assert orders.aborted
    orders.close()
    orders.close()


def test_between_looks_nothing_costs_anything():
    asked = []

    class Counting:
        def pressed(self):
            asked.append(1)
            return []

    orders = JobOrders(presses=[Counting()])
    for k in range(100):
        orders.sample(k * POLL_PERIOD / 10)
    assert len(asked) == pytest.approx(10, abs=1)


def test_the_button_in_the_middle_pauses_and_resumes():
    orders = JobOrders(presses=[Pressed([], ["enter"], [], ["enter"])])
    assert looked(orders, 5) == [1.0, 0.0, 0.0, 1.0, 1.0]


def test_the_arrows_change_the_speed_and_in_a_pause_nudge():
    presses = Pressed(["down"], ["down"], ["up"], ["left"], ["enter"], ["up"], ["left", "right"])
    orders = JobOrders(presses=[presses])
    assert looked(orders, 4) == [0.9, 0.8, 0.9, 0.9]
    assert orders.pop_nudge() is None
    assert [orders.sample(1 + k) for k in range(3)] == [0.0, 0.0, 0.0]
    assert orders.pop_nudge() == pytest.approx((0.05, 0.0))
    assert orders.pop_nudge() is None


def test_the_speed_stays_within_its_bounds():
    orders = JobOrders(presses=[Pressed(*[["down"]] * 20)])
    assert looked(orders, 20)[-1] == pytest.approx(0.25)
    orders = JobOrders(presses=[Pressed(*[["up"]] * 20)])
    assert looked(orders, 20)[-1] == 1.0


def test_a_nudge_without_a_pause_is_answered():
    orders = JobOrders()
    orders.handle("nudge 1 0")
    assert orders.pop_nudge() is None
    assert "pause it first" in orders.notes[0]


def test_a_terminals_keys_stand_for_the_buttons(monkeypatch):
    pty, termios = pytest.importorskip("pty"), pytest.importorskip("termios")
    person, terminal = pty.openpty()
    try:
        with open(terminal, closefd=False) as stdin:
            monkeypatch.setattr("sys.stdin", stdin)
            before = termios.tcgetattr(terminal)
            keys = Keys()
            assert keys.pressed() == []
            os.write(person, b"\n\x1b[A\x1b[Dx\x1b[Z ")
            assert keys.pressed() == ["enter", "up", "left", "enter"]
            assert keys.pressed() == []
            keys.close()
            assert termios.tcgetattr(terminal) == before
    finally:
        os.close(person)
        os.close(terminal)


def test_what_is_no_terminal_has_no_keys(monkeypatch, tmp_path):
    with open(str(tmp_path / "x"), "w+") as file:
        monkeypatch.setattr("sys.stdin", file)
        with pytest.raises((OSError, ImportError)):
            Keys()


def test_the_page_orders_no_speed_that_the_brick_does_not_take():
    assert RELATIVE_SPEED[:2] == SPEED_BOUNDS
    assert PEN_STEP[:2] == (-MAX_PEN_TRIM, MAX_PEN_TRIM)
