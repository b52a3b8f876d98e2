"""The emulated EV3 tacho motor: encoder, regulation, commands, states, attributes.

Behaves as the kernel's driver was observed to, oddities included: a 500 Hz tick, integer PI speed
regulation on a speed taken from encoder edges, P-only hold, set-points that take effect with a
command, but gains and positions at once.  At each tick k of 2 ms, with the error e in counts/s (of
a hold in counts),

    duty = (Kp e[k] + Ki (e[1] + ... + e[k]) + Kd (e[k-1] - e[k])) / 10000,  percent, towards zero.

Where that is beyond 100 %, the duty is cut off there, and the sum does not take e[k]: conditional
integration (Astrom and Hagglund, 1995).  Source: ev3dev's driver, run on this plant with the same
commands; none of its code is here.  A textbook's regulator would be smoother, but differs where a
program can tell: the sum grows even with Ki = 0, a positive Kd drives on instead of damping, and
whole numbers leave a small error alone.  A duty equal to the one before is not written to the
motor, see `_write_duty`.
"""

import errno
import math
import re
from operator import itemgetter
from typing import Any, Callable, Dict, Tuple

from laptop.emulator.device.encoder import EDGES_PER_COUNT, STANDSTILL_TIME, Encoder

MYPY = False
if MYPY:
    from typing import Optional  # noqa: F401

    from laptop.emulator.device.motor_and_link import Drive  # noqa: F401

    Settings = Dict[str, Any]  # attribute -> whole number, or one of its WORDS
    Gains = Callable[[Settings], Tuple[int, int, int]]  # Kp, Ki and Kd among them


TICK = 0.002
"""Period of the driver, s."""
COUNTS_PER_TURN = 360
MAX_SPEED = {"large": 1050, "medium": 1560}
"""Greatest speed that may be set, counts/s."""
HOLD_KP = {"large": 80000, "medium": 160000}
"""Gain of `hold` after a reset, 1/10000 percent per count."""
DRIVER = {"large": "lego-ev3-l-motor", "medium": "lego-ev3-m-motor"}
COMMANDS = (
    "run-forever",
    "run-to-abs-pos",
    "run-to-rel-pos",
    "run-timed",
    "run-direct",
    "stop",
    "reset",
)
STOP_ACTIONS = ("coast", "brake", "hold")
NOTIFY_PERIOD = 0.05
"""Period in which changes of the state wake `poll`, s."""
STALL_TIME = 0.1
"""Time at speed 0 after which a running motor counts as stalled, s."""
RAMP_PERIOD = 0.1
"""Period between two steps of a ramp, s."""
MIN_RAMP_SPEED = 20
"""Least speed on a ramp down to a position, counts/s, so that it arrives."""
SIGNED = ("position", "speed", "duty_cycle", "speed_sp", "position_sp", "duty_cycle_sp")
"""Attributes whose sign polarity flips where they are shown and stored, and only there."""
_INT32 = 2**31 - 1
_NUMBER = re.compile("[-+]?[0-9]+")
LIMITS = {
    "duty_cycle_sp": (-100, 100),
    "ramp_up_sp": (0, 60000),
    "ramp_down_sp": (0, 60000),
    "time_sp": (0, _INT32),
}
WORDS = {
    "stop_action": STOP_ACTIONS,
    "polarity": ("normal", "inversed"),
    "command": COMMANDS,
}
_speed_gains = itemgetter("speed_pid/Kp", "speed_pid/Ki", "speed_pid/Kd")
_hold_gains = itemgetter("hold_pid/Kp", "hold_pid/Ki", "hold_pid/Kd")


def _flipped(value: int, sign: int) -> int:
    """Return `value` times `sign`, in 32 bits, whose least has no positive counterpart."""
    return value if value == -_INT32 - 1 else sign * value


def _truncated(a: int, b: int) -> int:
    """Return a / b, divided as in C: towards zero."""
    return -(-a // b) if (a < 0) != (b < 0) else a // b


class TachoMotor(object):
    """One motor's driver; a device for `Sysfs`.

    Args:
        port: letter of the output port.
        kind: "large" or "medium".
        drive: the plant's Drive; its `duty` is set, its `angle` and `shaft` are read.
        phase: angle of the shaft past an encoder edge where it starts, deg.
        fineness: counts per degree of its encoder, 1 as it is.  The driver regulates by degrees.

    Attributes:
        notifications: number of changes of the state that `poll` has been woken for.
        unplugged: whether its cable is pulled.
    """

    def __init__(
        self, port: str, kind: str, drive: "Drive", phase: float = 0.25, fineness: int = 1
    ) -> None:
        self.port = port
        self.kind = kind
        self.drive = drive
        self.encoder = Encoder(phase, fineness)
        self._fineness = fineness
        self.notifications = 0
        self.unplugged = False
        self._fixed = {  # type: Settings
            "address": "ev3-ports:out" + port,
            "driver_name": DRIVER[kind],
            "commands": " ".join(COMMANDS),
            "stop_actions": " ".join(STOP_ACTIONS),
            "count_per_rot": COUNTS_PER_TURN * fineness,
            "max_speed": MAX_SPEED[kind] * fineness,
        }
        self._top = top = MAX_SPEED[kind] * fineness
        self._limits = dict(LIMITS, speed_sp=(-top, top))
        self.t = 0.0
        self._sensed_at = None  # type: Optional[float]  # the drive's angle
        self._notified = ""
        self._next_notify = NOTIFY_PERIOD
        self._defaults()
        self._zero = 0
        self._clear_state()

    def _defaults(self) -> None:
        """Set set-points and gains as after `reset`."""
        self._set = {  # type: Settings
            "speed_sp": 0,
            "position_sp": 0,
            "duty_cycle_sp": 0,
            "time_sp": 0,
            "ramp_up_sp": 0,
            "ramp_down_sp": 0,
            "speed_pid/Kp": 1000,
            "speed_pid/Ki": 60,
            "speed_pid/Kd": 0,
            "hold_pid/Kp": HOLD_KP[self.kind],
            "hold_pid/Ki": 0,
            "hold_pid/Kd": 0,
            "stop_action": "coast",
            "polarity": "normal",
        }

    def _clear_state(self) -> None:
        self._active = {}  # type: Settings
        self._command = "stop"
        self._mode = "coast"
        """One of coast, brake, hold, speed and direct."""
        self._target = 0
        """Target of the last move, counts, from which relative ones go on."""
        self._hold_position = 0
        """Position that `hold` keeps, counts."""
        self._direction = 1
        self._at_target = False
        self._deadline = None  # type: Optional[float]
        self._goal_speed = 0
        self._ramp_speed = 0.0
        self._ramping = False
        self._ramp_end = None  # type: Optional[float]
        """End of a ramp down and of its command, s; None if there is no such ramp."""
        self._next_ramp = 0.0
        self._clear_pid()
        self._overloaded = False
        self._still_since = None  # type: Optional[float]
        self._duty = 0

    # The interface to programs

    def read(self, attribute: str) -> str:
        """Return the text of one attribute.

        Raises:
            OSError: ENODEV when unplugged, ENOENT for an attribute there is not.
        """
        self._check_plugged()
        if attribute == "position":
            value = self.position  # type: Any
        elif attribute == "speed":
            value = self.encoder.speed
        elif attribute == "duty_cycle":
            value = self._duty
        elif attribute == "state":
            value = self.state
        elif attribute in self._set:
            value = self._set[attribute]
        elif attribute in self._fixed:
            value = self._fixed[attribute]
        else:
            raise OSError(errno.ENOENT, "no such attribute", attribute)
        return str(_flipped(value, self._sign) if attribute in SIGNED else value)

    def write(self, attribute: str, text: str) -> None:
        """Store one attribute.

        Raises:
            OSError: EINVAL for a value out of range, ERANGE for one that no int of 32 bits has,
                ENODEV when unplugged.
        """
        self._check_plugged()
        if attribute in WORDS:
            if text not in WORDS[attribute]:
                raise OSError(errno.EINVAL, "invalid argument", attribute)
            if attribute == "command":
                self._start(text)
            else:
                self._set[attribute] = text
            return
        if attribute not in self._set and attribute != "position":
            raise OSError(errno.EACCES, "not writable", attribute)
        if not _NUMBER.fullmatch(text):
            raise OSError(errno.EINVAL, "invalid argument", attribute)
        value = int(text)
        if not -_INT32 - 1 <= value <= _INT32:
            raise OSError(errno.ERANGE, "numerical result out of range", attribute)
        any_number = (0 if "_pid/" in attribute else -_INT32 - 1, _INT32)
        lower, upper = self._limits.get(attribute, any_number)
        if not lower <= value <= upper:
            raise OSError(errno.EINVAL, "invalid argument", attribute)
        if attribute in SIGNED:
            value = _flipped(value, self._sign)
        if attribute == "position":
            # The position of a hold stays as it was: a held motor jumps.  A move is over.
            self._set_position(value)
            self._target = value
        else:
            self._set[attribute] = value
            if attribute == "duty_cycle_sp" and self._mode == "direct":
                self._active["duty_cycle_sp"] = value

    @property
    def position(self) -> int:
        """Position, counts, truncated towards zero."""
        return _truncated(self.encoder.edges - self._zero, EDGES_PER_COUNT)

    def _set_position(self, counts: int) -> None:
        """Count on from here as if this were `counts`."""
        self._zero = self.encoder.edges - counts * EDGES_PER_COUNT

    @property
    def state(self) -> str:
        """State words, in the driver's order."""
        running = self._mode in ("speed", "direct")
        flags = (
            ("running", running),
            ("ramping", self._ramping),
            ("holding", self._mode == "hold"),
            ("overloaded", self._overloaded),
            ("stalled", running and self._stalled),
        )
        return " ".join(word for word, on in flags if on)

    @property
    def mode(self) -> str:
        """One of coast, brake, hold, speed and direct."""
        return self._mode

    @property
    def driven(self) -> bool:
        """Whether a command is turning the motor (held and braked motors are stopped)."""
        return self._mode in ("speed", "direct") and not self.unplugged

    def hold(self) -> None:
        """Hold the position, as an ended program leaves it; attributes are as after `reset`."""
        self._active = dict(self._set, stop_action="hold")
        self._stop(self.position)

    def begin_at(self, t: float) -> None:
        """Count from where the shaft is at `t`, s, as a driver that is loaded then."""
        turned = math.degrees(self.drive.shaft) * self._fineness
        self.encoder.edges = math.floor(turned + self.encoder.phase) * EDGES_PER_COUNT
        self.encoder.updated_at = self.t = t
        self._sensed_at = self.drive.angle
        self._next_notify = t + NOTIFY_PERIOD
        self._set_position(0)

    def unplug(self) -> None:
        """Pull the cable: the motor coasts, every access fails."""
        self.unplugged = True
        self._stop_as("coast")

    def _check_plugged(self) -> None:
        if self.unplugged:
            raise OSError(errno.ENODEV, "no such device")

    @property
    def _sign(self) -> int:
        return -1 if self._set["polarity"] == "inversed" else 1

    @property
    def _stalled(self) -> bool:
        return self._still_since is not None and self.t - self._still_since >= STALL_TIME

    # Commands

    def _start(self, command: str) -> None:
        if command == "reset":
            self._defaults()
            self._clear_state()
            self._set_position(0)
            self.drive.duty = None
            return
        previous, was_running = self._command, self._mode
        self._active = dict(self._set)
        self._command = command
        self._deadline = None
        self._ramping, self._ramp_end = False, None
        if command == "stop":
            self._end()
            return
        if was_running not in ("speed", "direct"):
            self._clear_pid()  # of the hold
            self._still_since = None
        if command == "run-direct":
            self._mode = "direct"
            self._overloaded = False
            return
        speed = self._active["speed_sp"]
        if command == "run-timed":
            self._deadline = self.t + self._active["time_sp"] / 1000.0
        elif command != "run-forever":
            target = step = self._active["position_sp"]
            if command == "run-to-rel-pos":
                target += self._target if previous == command else self.position
            self._target = target
            if command == "run-to-rel-pos" and step == 0:
                self._stop(self.position)
                return
            self._direction = 1 if target >= self.position else -1
            self._at_target = target == self.position
            speed = self._direction * abs(speed)
        if was_running != "speed":
            self._ramp_speed = 0.0
        self._mode = "speed"
        self._goal_speed = speed
        self._next_ramp = self.t
        if self._active["ramp_up_sp"] or self._active["ramp_down_sp"]:
            self._ramping = self._ramp_speed != speed
        else:
            self._ramp_speed = speed

    def _end(self) -> None:
        """End a command with its stop action, behind a ramp down if one is set."""
        if self._mode == "speed" and self._active["ramp_down_sp"] and self._ramp_speed:
            self._begin_ramp_down()
            self._ramp_end = self.t + abs(self._ramp_speed) / self._deceleration
            self._next_ramp = self.t
        else:
            self._stop(self.position)

    @property
    def _deceleration(self) -> float:
        """Deceleration of a ramp down, counts/s2."""
        ramp_down = self._active["ramp_down_sp"]  # type: int
        return self._top * 1000.0 / ramp_down

    def _begin_ramp_down(self) -> None:
        self._ramping = True
        self._goal_speed = 0
        self._deadline = None
        self._clear_pid()

    def _stop(self, position: int) -> None:
        """Take the stop action; hold keeps `position`."""
        self._hold_position = position
        self._ramp_end = None
        self._overloaded = False
        self._still_since = None
        self._clear_pid()
        self._stop_as(self._active["stop_action"])

    def _stop_as(self, action: str) -> None:
        # A hold writes nothing to the motor before the count changes: the last duty stays on,
        # though `duty_cycle` is 0.
        self._mode = action
        self._duty = 0
        if action != "hold":
            self.drive.duty = None if action == "coast" else 0.0

    def _write_duty(self, duty: int) -> None:
        """Write the duty (percent) to the motor if it has changed."""
        if duty != self._duty:
            self._duty = duty
            self.drive.duty = duty / 100.0

    def _clear_pid(self) -> None:
        self._integral = 0
        self._last_error = 0

    # The driver's periodic work

    def sense(self, t: float) -> None:
        """Update the encoder, at every step of the physics; `t` is the time, s."""
        encoder, angle = self.encoder, self.drive.angle
        if angle != self._sensed_at:
            self._sensed_at = angle
            encoder.update(t, self.drive.shaft)
        elif t - encoder.updated_at >= STANDSTILL_TIME:
            encoder.add_standstill(t)

    def tick(self, t: float) -> None:
        """Regulate once, at 500 Hz; `t` is the time, s."""
        self.t = t
        if not self.unplugged:
            mode = self._mode
            if mode == "speed" or mode == "direct":
                self._watch_for_stall()
                self._regulate(mode)
                if mode == "speed":
                    self._finish_if_due()
            elif mode == "hold":
                self._write_duty(self._pid(_hold_gains, self._hold_position - self.position))
        if t >= self._next_notify:
            self._next_notify += NOTIFY_PERIOD
            if self.state != self._notified:
                self._notified = self.state
                self.notifications += 1

    def _finish_if_due(self) -> None:
        if self._deadline is not None and self.t >= self._deadline:
            self._end()
        elif self._ramp_end is not None and self.t >= self._ramp_end:
            self._ramping = False
            self._stop(self.position)
        elif self._command.endswith("-pos") and self._has_crossed():
            self._stop(self._target)

    def _has_crossed(self) -> bool:
        if not (self._ramp_speed or self._at_target):
            return False  # at speed 0 it never arrives, not even by hand
        return self._direction * (self.position - self._target) >= 0

    def _watch_for_stall(self) -> None:
        if self.encoder.speed:
            self._still_since = None
        elif self._still_since is None:
            self._still_since = self.t

    def _regulate(self, mode: str) -> None:
        if mode == "direct":
            self._write_duty(self._active["duty_cycle_sp"])
            return
        if self._ramping or self._active["ramp_down_sp"]:
            self._ramp()
        if self._ramp_speed == 0:
            self._clear_pid()
            self._overloaded = False
            self._write_duty(0)
        else:
            self._write_duty(self._pid(_speed_gains, int(self._ramp_speed) - self.encoder.speed))

    def _pid(self, gains: "Gains", error: int) -> int:
        kp, ki, kd = gains(self._set)
        self._integral += error  # also where Ki is 0
        total = kp * error + ki * self._integral + kd * (self._last_error - error)
        self._last_error = error
        duty = _truncated(total, 10000 * self._fineness)
        self._overloaded = not -100 <= duty <= 100
        if self._overloaded:
            self._integral -= error
            duty = 100 if duty > 0 else -100
        return duty

    def _ramp(self) -> None:
        """Move the regulated speed towards the goal, in steps of 100 ms."""
        if self.t < self._next_ramp:
            return
        self._next_ramp += RAMP_PERIOD
        to_position = self._ramp_end is None and self._command.endswith("-pos")
        if to_position and self._goal_speed and self._active["ramp_down_sp"]:
            left = abs(self._target - self.position)
            if left <= self._ramp_speed * self._ramp_speed / (2 * self._deceleration):
                self._begin_ramp_down()
        goal = self._goal_speed
        if to_position and not goal:
            goal = self._direction * min(
                MIN_RAMP_SPEED * self._fineness, abs(self._active["speed_sp"])
            )
        rising = abs(goal) > abs(self._ramp_speed)
        time = self._active["ramp_up_sp" if rising else "ramp_down_sp"] / 1000.0
        top = float(self._top)
        step = top * RAMP_PERIOD / time if time else top * 2
        self._ramp_speed += max(-step, min(step, goal - self._ramp_speed))
        if self._ramp_end is None:
            self._ramping = self._ramp_speed != self._goal_speed
