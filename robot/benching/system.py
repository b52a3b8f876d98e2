"""Times of a brick beside computing: Python's start, an access to a motor, waking up."""

import os

from robot.ev3.motors import JointMotor, plugged_in

MYPY = False  # which a type checker takes for true
if MYPY:
    from typing import List, Optional, Tuple  # noqa: F401

    from robot.benching.laps import Laps  # noqa: F401
    from robot.clock import Clock  # noqa: F401

ACCESSES = 20
NAPS, NAP_TIME = 100, 0.02
"""Number of sleeps that are measured, and their time, a control tick's, s."""

STAT = "/proc/self/stat"
START_FIELD = 19
"""Index of the field in STAT, behind the name, of the process's start, ticks since the system's."""

KINDS = {"lego-ev3-l-motor": "large", "lego-ev3-m-motor": "medium"}


def age(now):
    # type: (float) -> Optional[float]
    """Return the seconds since this process was started, to a hundredth; None where not known.

    Args:
        now: time of robot.clock.Clock, which also counts from the system's start, s.
    """
    try:
        with open(STAT) as file:
            started = float(file.read().rpartition(")")[2].split()[START_FIELD])
        started /= os.sysconf("SC_CLK_TCK")
    except (OSError, ValueError, IndexError, AttributeError):
        return None
    # (A laptop's two clocks part when it sleeps.)
    return now - started if 0 <= now - started < 600 else None


def motors_found():
    # type: () -> List[Tuple[str, str]]
    """Return pairs (port letter, "large" | "medium") of the EV3 motors that are plugged in."""
    return [(address[-1], KINDS[driver]) for address, driver in plugged_in() if driver in KINDS]


def measure_accesses(laps):
    # type: (Laps) -> Optional[str]
    """Time the reading and writing of a real motor's attribute; nothing turns.

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
    """Time how late a sleep wakes up."""
    late = laps.taken.setdefault("late from a sleep of {:.0f} ms".format(1000 * NAP_TIME), [])
    for _ in range(NAPS):
        began = clock.now()
        clock.sleep(NAP_TIME)
        late.append(clock.now() - began - NAP_TIME)
