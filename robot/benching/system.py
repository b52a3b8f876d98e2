"""What the brick takes beside computing: Python's start, an access to a motor, waking up."""

import os

from robot.ev3.motors import JointMotor, plugged_in

MYPY = False  # which a type checker takes for true
if MYPY:
    from typing import List, Optional, Tuple  # noqa: F401

    from robot.benching.laps import Laps  # noqa: F401
    from robot.clock import Clock  # noqa: F401

ACCESSES = 20
NAPS, NAP = 100, 0.02
"""How many sleeps of a control tick's length, s, are looked at."""

STAT = "/proc/self/stat"
STARTED = 19
"""In STAT, behind the name: when the process was started, ticks since the system was."""

KINDS = {"lego-ev3-l-motor": "large", "lego-ev3-m-motor": "medium"}


def age(now):
    # type: (float) -> Optional[float]
    """Seconds since this process was started, to a hundredth; None where Linux does not tell.

    Args:
        now: of robot.clock.Clock, which also counts from the system's start.
    """
    try:
        with open(STAT) as file:
            started = float(file.read().rpartition(")")[2].split()[STARTED])
        started /= os.sysconf("SC_CLK_TCK")
    except (OSError, ValueError, IndexError, AttributeError):
        return None
    # (A laptop's two clocks part when it sleeps.)
    return now - started if 0 <= now - started < 600 else None


def motors_found():
    # type: () -> List[Tuple[str, str]]
    """Pairs (port letter, "large" | "medium") of the EV3 motors that are plugged in."""
    return [(address[-1], KINDS[driver]) for address, driver in plugged_in() if driver in KINDS]


def measure_accesses(laps):
    # type: (Laps) -> Optional[str]
    """An attribute of a real motor read and written; nothing turns.

    Returns:
        The port of the motor, or None: there is no motor.
    """
    found = motors_found()
    if not found:
        return None
    port, kind = found[0]
    motor = JointMotor("motor", port, kind, 1.0, 1)._motor
    same = motor.speed_sp  # nothing takes note of it before a command
    for _ in range(ACCESSES):
        laps.timed("motor: read position", lambda: motor.position)()
        laps.timed("motor: write speed_sp", lambda: setattr(motor, "speed_sp", same))()
    return port


def measure_naps(clock, laps):
    # type: (Clock, Laps) -> None
    """How late a sleep wakes up."""
    late = laps.taken.setdefault("late from a sleep of {:.0f} ms".format(1000 * NAP), [])
    for _ in range(NAPS):
        began = clock.now()
        clock.sleep(NAP)
        late.append(clock.now() - began - NAP)
