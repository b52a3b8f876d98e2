"""Protocols of the objects that motion is given, for type checkers alone: no program imports it."""

MYPY = False
if MYPY:
    from typing import List, Protocol, Sequence, Tuple  # noqa: F401

    from robot.motion.trajectory import SetPoint  # noqa: F401

    class AtPort(Protocol):
        """Anything at a port: a motor, or the Pen of an arm's description."""

        @property
        def port(self):
            # type: () -> str
            """Name of its port."""

    class LinkMotion(Protocol):
        """A motion of the links, whose `duration` is in s: a Trajectory or a JointMove."""

        duration = 0.0  # type: float

        @property
        def start(self):
            # type: () -> Tuple[float, ...]
            """Joint angles at the start, rad."""

        @property
        def directions(self):
            # type: () -> Tuple[int, ...]
            """Sign of the first motion of each joint; 0: it does not move."""

        @property
        def reversals(self):
            # type: () -> Tuple[Tuple[float, ...], ...]
            """Times of each joint's reversals, s."""

        @property
        def extremes(self):
            # type: () -> Tuple[Tuple[float, ...], ...]
            """Angles of each joint at the start, at its reversals and at the end, rad."""

        def at(self, t):
            # type: (float) -> SetPoint
            """Return (q, path) at time `t` (s), see Trajectory.at."""

        def speeds(self, t):
            # type: (float) -> List[float]
            """Return dq/dt at time `t` (s), rad/s."""

    class MotorPlan(Protocol):
        """A plan of the motors for ControlLoop.run."""

        @property
        def before(self):
            # type: () -> float
            """Time of the plan before 0, s: it begins at -before."""

        @property
        def duration(self):
            # type: () -> float
            """Time of its end, s."""

        @property
        def rests_from(self):
            # type: () -> Sequence[float]
            """Time at which each motor's set-point comes to rest, s."""

        def at(self, t):
            # type: (float) -> SetPoint
            """Return (q, path) at time `t` (s), see Trajectory.at."""

        def speeds(self, t):
            # type: (float) -> List[float]
            """Return dq/dt at time `t` (s), rad/s."""
