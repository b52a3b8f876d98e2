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
