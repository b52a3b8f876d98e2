"""What motion asks of what it is given, for type checkers alone: no program imports this."""

MYPY = False
if MYPY:
    from typing import List, Protocol, Sequence, Tuple  # noqa: F401

    from robot.motion.trajectory import SetPoint  # noqa: F401

    class AtPort(Protocol):
        """What is plugged in: a motor, or the Pen of an arm's description."""

        @property
        def port(self):
            # type: () -> str
            """Its port."""

    class DrivenMotor(Protocol):
        """A joint's motor as robot.ev3.motor.Motor says: JointMotor, or another kind."""

        name = ""  # type: str
        port = ""  # type: str
        zero = 0.0  # type: float
        resolution = 0.0  # type: float
        falls = False  # type: bool

        @property
        def device(self):
            # type: () -> str
            """The system's name of the motor."""

        def counts(self):
            # type: () -> int
            """The encoder's reading."""

        def bounds(self):
            # type: () -> Tuple[float, float]
            """Least and greatest angle that the reading allows, rad."""

        def angle(self):
            # type: () -> float
            """The middle of `bounds`, rad."""

        def duty(self):
            # type: () -> float
            """What drives it, %."""

        def in_counts(self, radians):
            # type: (float) -> float
            """A difference of angles as counts."""

        def engage(self, stiffness):
            # type: (float) -> None
            """Make it ready for `drive`; % per deg/s."""

        def drive(self, speed):
            # type: (float) -> None
            """Set the speed, rad/s."""

        def go(self, angle, speed):
            # type: (float, float) -> int
            """Start towards an angle, rad, at a speed, rad/s; the target in counts."""

        def disengage(self):
            # type: () -> None
            """Take back what `engage` has set."""

        def hold(self):
            # type: () -> None
            """Stop here and hold."""

        def brake(self):
            # type: () -> None
            """Stop."""

        def clamp(self):
            # type: () -> None
            """Hold where a braked motor is."""

        def let_go(self):
            # type: () -> None
            """Let somebody turn it by hand."""

        def check_plugged_in(self):
            # type: () -> None
            """Raise MotorNotFound if it is gone."""

    class LinkMotion(Protocol):
        """What the links are to do: a Trajectory or a JointMove."""

        duration = 0.0  # type: float

        @property
        def start(self):
            # type: () -> Tuple[float, ...]
            """Joint angles there, rad."""

        @property
        def directions(self):
            # type: () -> Tuple[int, ...]
            """Per joint, the sign of its first motion."""

        @property
        def reversals(self):
            # type: () -> Tuple[Tuple[float, ...], ...]
            """Per joint, when it turns round, s."""

        def at(self, t):
            # type: (float) -> SetPoint
            """As Trajectory.at."""

        def speeds(self, t):
            # type: (float) -> List[float]
            """As Trajectory.speeds."""

    class MotorPlan(Protocol):
        """What the loop follows, see ControlLoop.run."""

        @property
        def before(self):
            # type: () -> float
            """It begins at minus this time, s."""

        @property
        def duration(self):
            # type: () -> float
            """It ends then, s."""

        @property
        def rests_from(self):
            # type: () -> Sequence[float]
            """Per motor, when its set-point comes to rest, s."""

        def at(self, t):
            # type: (float) -> SetPoint
            """As Trajectory.at."""

        def speeds(self, t):
            # type: (float) -> List[float]
            """As Trajectory.speeds."""
