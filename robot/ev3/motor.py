"""Interface of the joints' motors, of whatever kind they are.

`ArmMotors(..., kind=...)` takes a class of which this is the interface; it need not derive from it.
`motors.JointMotor` is the brick's own.  Nothing here is imported by a program.
"""

MYPY = False
if MYPY:
    from typing import Protocol, Tuple  # noqa: F401
else:
    Protocol = object


class Motor(Protocol):
    """One motor and the gear behind it; angles are the joint's, rad, speeds rad/s.

    Whatever it does not obey raises an ArmError, at best `motors.MotorNotFound`.

    Args:
        name: name of the joint, for messages, e.g. "shoulder".
        port: "A" .. "D".
        kind: "large" | "medium".
        gear: motor turns per joint turn.
        direction: +1 | -1, sign of the joint angle when the count rises.

    Attributes:
        name, port: as given.
        zero: counts at joint angle 0, which others set.
        resolution: rad at the joint per count.
        falls: True if something pulls on the joint, so that braking alone would let it sink; others
            set it.
    """

    if MYPY:
        name = ""  # type: str
        port = ""  # type: str
        zero = 0.0  # type: float
        resolution = 0.0  # type: float
        falls = False  # type: bool

        @property
        def device(self):
            # type: () -> str
            """Name of the motor in the system: another one whenever it is plugged in."""
    else:
        ATTRIBUTES = ("name", "port", "zero", "resolution", "falls", "device")

    def __init__(self, name, port, kind, gear, direction):
        # type: (str, str, str, float, int) -> None
        raise NotImplementedError

    def counts(self):
        # type: () -> int
        """Return the encoder's reading, counts, a whole number."""
        raise NotImplementedError

    def bounds(self):
        # type: () -> Tuple[float, float]
        """Return the least and greatest angle that the encoder's reading allows, rad."""
        raise NotImplementedError

    def angle(self):
        # type: () -> float
        """Return the middle of `bounds`, rad."""
        raise NotImplementedError

    def duty(self):
        # type: () -> float
        """Return the duty that drives it now, %; positive where the joint's angle rises."""
        raise NotImplementedError

    def in_counts(self, radians):
        # type: (float) -> float
        """Return a difference of angles at the joint (rad) as counts."""
        raise NotImplementedError

    def engage(self, stiffness):
        # type: (float) -> None
        """Make it ready for `drive`.

        Args:
            stiffness: duty per difference between set and measured speed of the motor, % per deg/s.
        """
        raise NotImplementedError

    def drive(self, speed):
        # type: (float) -> None
        """Set the speed, rad/s; it stops by itself if that is not renewed within DEAD_MAN."""
        raise NotImplementedError

    def go(self, angle, speed):
        # type: (float, float) -> int
        """Start towards an angle (rad) at a speed (rad/s), hold there; return the target counts."""
        raise NotImplementedError

    def disengage(self):
        # type: () -> None
        """Undo the settings of `engage`; it is stopped."""
        raise NotImplementedError

    def hold(self):
        # type: () -> None
        """Stop here and hold."""
        raise NotImplementedError

    def brake(self):
        # type: () -> None
        """Stop; nothing needs to hold it then."""
        raise NotImplementedError

    def clamp(self):
        # type: () -> None
        """Hold where it is, once it was braked."""
        raise NotImplementedError

    def coast(self):
        # type: () -> None
        """Release it: it can be turned by hand."""
        raise NotImplementedError

    def check_plugged_in(self):
        # type: () -> None
        """Raise MotorNotFound if it is unplugged, without an access: it is called every tick."""
        raise NotImplementedError
