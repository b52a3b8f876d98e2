"""What the joints' motors have to do, of whatever kind they are.

`ArmMotors(..., kind=...)` takes a class of which this is the interface; it need not derive from it.
`motors.JointMotor` is the brick's own.  Nothing here is imported by a program.
"""


class Motor(object):
    """One motor and the gear behind it; angles are the joint's, rad, speeds rad/s.

    Whatever it does not obey raises an ArmError, at best `motors.MotorNotFound`.

    Args:
        name: for messages, e.g. "shoulder".
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

    ATTRIBUTES = ("name", "port", "zero", "resolution", "falls", "device")

    def __init__(self, name, port, kind, gear, direction):
        raise NotImplementedError

    def counts(self):
        """The encoder's reading, a whole number."""
        raise NotImplementedError

    def bounds(self):
        """Least and greatest angle that the encoder's reading allows, ascending."""
        raise NotImplementedError

    def angle(self):
        """The middle of `bounds`."""
        raise NotImplementedError

    def duty(self):
        """What drives it now, %; positive where the joint's angle rises."""
        raise NotImplementedError

    def in_counts(self, radians):
        """A difference of angles at the joint as counts."""
        raise NotImplementedError

    def engage(self, stiffness):
        """Make it ready for `drive`.

        Args:
            stiffness: its force on the difference between set and seen speed, % per deg/s.
        """
        raise NotImplementedError

    def drive(self, speed):
        """Set the speed; it stops by itself if that is not said again within DEAD_MAN."""
        raise NotImplementedError

    def go(self, angle, speed):
        """Start towards an angle, hold there, and return the target in counts."""
        raise NotImplementedError

    def disengage(self):
        """Take back what `engage` has set; it is stopped."""
        raise NotImplementedError

    def hold(self):
        """Stop here and hold."""
        raise NotImplementedError

    def brake(self):
        """Stop; nothing needs to hold it then."""
        raise NotImplementedError

    def clamp(self):
        """Hold where it is, once it was braked."""
        raise NotImplementedError

    def let_go(self):
        """Let somebody turn it by hand."""
        raise NotImplementedError

    def check_plugged_in(self):
        """Raise MotorNotFound if it is gone; without asking it, for this is done every tick."""
        raise NotImplementedError
