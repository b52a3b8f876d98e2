"""Motors by python-ev3dev2, and nothing above it: radians at the joint <-> motor counts.

The only place that knows counts.  While a joint is followed, its motor runs `run-timed` with a
speed set-point renewed every tick: should the program freeze or die, the motor's driver itself
stops it after DEAD_MAN.  The driver's integral action is switched off meanwhile, so that the
set-point acts like a force with damping and our own loop has the only integrator.

Two things of the driver matter here.  Its hold writes nothing to the motor before the count has
changed: one that pushes at something goes on pushing, so whoever is to hold is braked first.  And
its integral sums up also while it has no gain, and gains act at once: they are given back only to a
motor that stands.
"""

import math
import os

import ev3dev2.motor

from shared.arm_description import ArmError
from shared.state import laptop_program

MYPY = False
if MYPY:
    from typing import IO, List, Optional, Tuple, Union  # noqa: F401

DEAD_MAN = 0.2
"""Time after which a motor stops whose set-point is not renewed, s."""

SPEED_P, SPEED_I = 1000, 60
"""Gains of the driver's own speed regulation, in its units."""

_KINDS = {"large": ev3dev2.motor.LargeMotor, "medium": ev3dev2.motor.MediumMotor}


class MotorNotFound(ArmError, OSError):
    """A motor that is not there, or no longer."""


def motors_folder():
    # type: () -> str
    """Return the folder in which the system shows the motors."""
    return os.path.join(ev3dev2.motor.Device.DEVICE_ROOT_PATH, "tacho-motor")


def plugged_in():
    # type: () -> List[Tuple[str, ...]]
    """Return the motors that are plugged in: sorted pairs of address ("outA") and driver's name."""
    folder, found = motors_folder(), []
    for name in ev3dev2.motor.list_device_names(folder, "*"):
        values = []
        for attribute in ("address", "driver_name"):
            with open(os.path.join(folder, name, attribute)) as file:
                values.append(file.read().strip().replace("ev3-ports:", ""))
        found.append(tuple(values))
    return sorted(found)


class JointMotor(object):
    """One motor and the gear behind it.

    Args:
        name: name of the joint, for messages, e.g. "shoulder".
        port: "A" .. "D".
        kind: "large" | "medium".
        gear: motor turns per joint turn.
        direction: +1 | -1, sign of the joint angle when the count rises.

    Attributes:
        zero: counts at joint angle 0.
        resolution: rad at the joint per count.
        falls: True if something pulls on the joint, so that braking alone would let it sink.

    Raises:
        MotorNotFound: there is no such motor at the port; the message lists what there is.
    """

    def __init__(self, name, port, kind, gear, direction):
        # type: (str, str, str, float, int) -> None
        self.name = name
        self.port = port
        try:
            self._motor = _KINDS[kind]("out" + port)
        except ev3dev2.DeviceNotFound:
            found = ["{} ({})".format(*motor) for motor in plugged_in()]
            raise MotorNotFound(
                "no {} motor at port {} for the {}; {}".format(
                    kind,
                    port,
                    name,
                    "found {}: check the cable or the arm file".format(", ".join(found))
                    if found
                    else "no motor found at all: check the cables, or run this on the brick or, "
                    "emulated, by {} simulate".format(laptop_program()),
                )
            ) from None
        self._undo_settings()
        per_turn = self._motor.count_per_rot  # type: int
        self._per_radian = direction * gear * per_turn / (2 * math.pi)
        self.resolution = 1 / abs(self._per_radian)
        self.zero = 0.0
        self.falls = False
        self._max_speed = self._motor.max_speed  # type: int
        # The loop reads and writes these on the library's own handles: through its properties, a
        # tick would take twice as long.
        self._position, self._speed_sp, self._command = (
            self._opened(name) for name in ("position", "speed_sp", "command")
        )
        self._set_speed = None  # type: Optional[int]
        self._carry = 0.0
        self._stiffness = None  # type: Optional[float]
        """Stiffness by which it is engaged; 0: the driver has its own gains; None: not known."""
        self._action = None  # type: Optional[str]
        """Stop action that is set; None: not known."""

    def _undo_settings(self):
        # type: () -> None
        """Undo settings of another program: its polarity would reverse counts and speeds.

        With its ramps no stop would be immediate.
        """
        try:
            for name, value in (("polarity", "normal"), ("ramp_up_sp", 0), ("ramp_down_sp", 0)):
                if getattr(self._motor, name) != value:
                    setattr(self._motor, name, value)
        except (ev3dev2.DeviceNotFound, OSError) as error:
            raise self._lost(error) from None

    @property
    def device(self):
        # type: () -> str
        """Name of the motor in the system: another one whenever it is plugged in."""
        path = self._motor._path  # type: str
        return os.path.basename(path)

    def _opened(self, attribute):
        # type: (str) -> IO[bytes]
        try:
            opened = self._motor._attribute_file_open(attribute)  # type: IO[bytes]
            return opened
        except OSError as error:
            raise self._lost(error) from None

    def counts(self):
        # type: () -> int
        """Return the encoder's reading, counts."""
        try:
            self._position.seek(0)
            return int(self._position.read(16))
        except OSError as error:
            raise self._lost(error) from None

    def bounds(self):
        # type: () -> Tuple[float, float]
        """Return the least and greatest angle that the encoder's reading allows, rad.

        Counts are halves of the encoder's steps, truncated towards zero, and the zero lies anywhere
        within a step, on average in its middle: a positive reading n means n - 1/4 .. n + 3/4.
        """
        n = self.counts()
        low = n - self.zero
        high = low + (0.75 if n >= 0 else 0.25)
        low -= 0.25 if n > 0 else 0.75
        if self._per_radian > 0:
            return low / self._per_radian, high / self._per_radian
        return high / self._per_radian, low / self._per_radian

    def angle(self):
        # type: () -> float
        """Return the middle of `bounds`, rad."""
        return sum(self.bounds()) / 2

    def duty(self):
        # type: () -> float
        """Return the duty that the driver gives now, %; positive where the joint's angle rises."""
        try:
            duty = self._motor.duty_cycle  # type: int
            return math.copysign(1.0, self._per_radian) * duty
        except (ev3dev2.DeviceNotFound, OSError) as error:
            raise self._lost(error) from None

    def in_counts(self, radians):
        # type: (float) -> float
        """Return a difference of angles at the joint (rad) as counts."""
        return radians * self._per_radian

    def engage(self, stiffness):
        # type: (float) -> None
        """Make the motor ready for `drive`.

        Args:
            stiffness: duty per difference between set and measured speed of the motor, % per deg/s.
        """
        self._set_action("hold" if self.falls else "brake")  # of the dead man
        if stiffness == self._stiffness:
            return
        if not self._stiffness:
            self._set("speed_i", 0)
            self._set("time_sp", int(DEAD_MAN * 1000))
            self._carry = 0.0
            self._set_speed = None
        self._stiffness = stiffness
        self._set("speed_p", int(round(stiffness * 10000)))

    def drive(self, speed):
        # type: (float) -> None
        """Set the speed, rad/s at the joint, for at most DEAD_MAN; rounding is carried over."""
        wanted = speed * self._per_radian + self._carry
        rounded = int(wanted + 0.5 if wanted > 0 else wanted - 0.5)
        most = self._max_speed
        if rounded > most:
            rounded, self._carry = most, 1.0
        elif rounded < -most:
            rounded, self._carry = -most, -1.0
        else:
            self._carry = wanted - rounded
        try:
            if rounded != self._set_speed:
                self._speed_sp.seek(0)
                self._speed_sp.write(b"%d" % rounded)
                self._set_speed = rounded
            self._command.seek(0)
            self._command.write(b"run-timed")
        except OSError as error:
            raise self._lost(error) from None

    def go(self, angle, speed):
        # type: (float, float) -> int
        """Start towards `angle` (rad) at `speed` (rad/s at the joint); then hold there.

        Returns:
            The target, counts.
        """
        if self._stiffness:
            self.hold()
        self.disengage()
        target = int(round(self.zero + angle * self._per_radian))
        fastest = min(abs(speed * self._per_radian), self._max_speed)
        self._set_speed = None
        self._set("speed_sp", int(round(fastest)))
        self._set("position_sp", target)
        self._set_action("hold")
        self._set("command", "run-to-abs-pos")
        return target

    def disengage(self):
        # type: () -> None
        """Restore the driver's own speed gains, as after a reset; the motor is stopped."""
        if self._stiffness != 0:
            self._set("speed_p", SPEED_P)
            self._set("speed_i", SPEED_I)
            self._stiffness = 0

    def hold(self):
        # type: () -> None
        """Stop here and hold."""
        self.brake()
        self.clamp()

    def brake(self):
        # type: () -> None
        """Stop by a short circuit of the windings: nothing holds it then."""
        self._stop("brake")

    def clamp(self):
        # type: () -> None
        """Hold where a braked motor is."""
        self._stop("hold")

    def coast(self):
        # type: () -> None
        """Release it: it can be turned by hand."""
        self._stop("coast")

    def _stop(self, action):
        # type: (str) -> None
        self._set_action(action)
        self._set("command", "stop")

    def _set_action(self, action):
        # type: (str) -> None
        if action != self._action:
            self._set("stop_action", action)
            self._action = action

    def check_plugged_in(self):
        # type: () -> None
        """Notice a pulled cable without an access.

        Raises:
            MotorNotFound: the motor is unplugged.
        """
        # Not by device_index: the library takes only the last digit of "motor12" for it.
        if not os.path.isdir(self._motor._path):
            raise self._lost("it is not connected")

    def _set(self, attribute, value):
        # type: (str, Union[int, str]) -> None
        try:
            setattr(self._motor, attribute, value)
        except (ev3dev2.DeviceNotFound, OSError) as error:
            raise self._lost(error) from None

    def _lost(self, error):
        # type: (object) -> MotorNotFound
        return MotorNotFound(
            "the {} motor at port {} no longer answers ({}); plug it in again, then home".format(
                self.name, self.port, str(error).strip().rstrip(".")
            )
        )
