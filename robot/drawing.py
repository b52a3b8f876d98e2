"""A drawing arm: lines, arcs, circles, rectangles, by joint motions planned on the brick."""

import math
import os

from robot.motion import kinematics, paths, trajectory
from shared.arm_description import ArmError
from shared.config_files import open_to_write
from shared.state import PLAN

MYPY = False
if MYPY:
    from typing import List, Optional, Sequence, Tuple  # noqa: F401

    from robot.motion.arm import RobotArm  # noqa: F401
    from robot.motion.chains import FixedPoint, Point  # noqa: F401
    from robot.motion.pace import ReportLine  # noqa: F401
    from robot.motion.paths import Piece  # noqa: F401
    from robot.motion.trajectory import Trajectory  # noqa: F401

METHODS = ("smooth", "steps")

BACKLASH_TOLERANCE = math.radians(1.5)
"""Tolerance of measured against described backlash, rad; beyond, a line is printed."""

MAX_STEPS = 200
"""Greatest number of the report's steps on a line: more would go round the base several times."""


class NotAnnounced(ArmError, OSError):
    """The file of the wanted path cannot be written."""


class Driver(object):
    """A drawing arm.

    Args:
        arm: robot.motion.arm.RobotArm.
        speed: speed of the tip, cm/s; the arm's own if None.
        elbow: "up" | "down" | None: the arm's own where it can.
        say: called with each line of progress.
    """

    def __init__(self, arm, speed=None, elbow=None, say=print):
        # type: (RobotArm, Optional[float], Optional[str], ReportLine) -> None
        self.arm = arm
        self.speed = speed
        self.elbow = elbow
        self.say = say
        self._pen_is_down = None  # type: Optional[bool]

    def home(self, here=False, seek=False):
        # type: (bool, bool) -> None
        """Find the zero, see RobotArm.home; if something was sought, then go to the home pose.

        Args:
            here: whether the arm stands in its home pose.
            seek: whether to seek its hard stops from wherever it is.

        Raises:
            ArmError: after stopping; the zero is then unknown.
        """
        every = self.arm.home(here, self.say, seek)
        for found, joint in zip(every, self.arm.description.joints):
            backlash = (
                ""
                if found.backlash is None
                else ", play {:.1f} deg".format(math.degrees(found.backlash))
            )
            self.say(
                "{}: zero at {:.1f} counts, touches within {:.0f}{}".format(
                    found.joint, found.zero, found.spread, backlash
                )
            )
            if (
                found.backlash is not None
                and abs(found.backlash - joint.backlash) > BACKLASH_TOLERANCE
            ):
                self.say(
                    "{}: the arm file says {:.1f} deg of play; correct it, or the stops".format(
                        joint.name, math.degrees(joint.backlash)
                    )
                )
        if every:
            self.arm.go_to([joint.home for joint in self.arm.description.joints], speed=0.5)

    def position(self):
        # type: () -> FixedPoint
        """Return the tip (x, y) or (x, y, z), cm, as the encoders have it."""
        return self.arm.position()

    def pen_up(self):
        # type: () -> None
        """Lift the pen; do nothing where the arm has no pen motor."""
        self._move_pen(False)

    def pen_down(self):
        # type: () -> None
        """Lower the pen."""
        self._move_pen(True)

    def _move_pen(self, down):
        # type: (bool) -> None
        pen = self.arm.description.pen
        if pen and self._pen_is_down is not down:
            self.arm.move_pen(pen.down if down else pen.up)
            self._pen_is_down = down

    def move_to(self, p):
        # type: (Point) -> None
        """Move to `p` (cm) with the pen up, not necessarily straight.

        Raises:
            kinematics.Unreachable: nothing has moved.
        """
        q = kinematics.inverse(self.arm.description, p, self.elbow, near=self.arm.angles())
        self.pen_up()
        self.arm.go_to(q)

    def go_low(self):
        # type: () -> None
        """Go to where the arm rests, if there is such a place and a path; say what came of it."""
        try:
            if self.arm.go_low():
                self.say("gone low, where the arm rests")
        except kinematics.Unreachable as problem:
            self.say(str(problem))

    def draw_line(self, start, end, method="smooth"):
        # type: (Point, Point, str) -> None
        """Draw a straight line.

        Args:
            start: (x, y) or (x, y, z), cm.
            end: likewise.
            method: "smooth" or the report's "steps".

        Raises:
            kinematics.Unreachable: some point of it cannot be had; nothing has moved.
        """
        pieces = paths.polyline([start, end])
        plans = trajectory.plan(self.arm.description, pieces, self.speed, self.elbow)
        self.draw_planned(pieces, plans, method)

    def draw(self, strokes, method="smooth"):
        # type: (Sequence[Sequence[Point]], str) -> None
        """Draw strokes; the pen lifts between two, but where one begins where the last one ends.

        Args:
            strokes: each a sequence of points (x, y) or (x, y, z), cm, of any shape.
            method: "smooth" or the report's "steps".

        Raises:
            paths.BadPath: a stroke that is none.
            kinematics.Unreachable: some point cannot be had; nothing has moved.
        """
        merged = []  # type: List[List[Piece]]
        for stroke in strokes:
            pieces = paths.pieces_of(stroke)
            if (
                merged
                and kinematics.distance(merged[-1][-1][-1], pieces[0][0]) < paths.MIN_POINT_DISTANCE
            ):
                merged[-1].extend(pieces)
            else:
                merged.append(pieces)
        arm = self.arm.description
        planned = [trajectory.plan(arm, pieces, self.speed, self.elbow) for pieces in merged]
        if method == "steps":
            for pieces, plans in zip(merged, planned):
                self._check_steps(pieces, plans)
        for pieces, plans in zip(merged, planned):
            self.draw_planned(pieces, plans, method)

    def draw_planned(self, pieces, plans, method="smooth"):
        # type: (Sequence[Piece], Sequence[Trajectory], str) -> None
        """Draw the pieces of one stroke (robot.motion.paths), planned by trajectory.plan."""
        if method not in METHODS:
            raise ArmError(
                "there is no method '{}'; take one of {}".format(method, ", ".join(METHODS))
            )
        if method == "steps":
            self._check_steps(pieces, plans)
        announce(pieces)
        self.pen_up()
        if method == "steps":
            self._draw_in_steps(pieces, plans)
        else:
            self.arm.pre_approach(plans[0])
            self.pen_down()
            self.arm.follow(plans)
        self.pen_up()

    def _check_steps(self, pieces, plans):
        # type: (Sequence[Piece], Sequence[Trajectory]) -> None
        """Refuse, by Unreachable, pieces along which no joint step leads from their start."""
        from robot.motion.classic_steps import jacobian_step  # not above: few draw in steps

        for piece, plan in zip(pieces, plans):
            jacobian_step(self.arm.description, plan.start, _direction(piece))

    def _draw_in_steps(self, pieces, plans):
        # type: (Sequence[Piece], Sequence[Trajectory]) -> None
        self.arm.go_to(plans[0].start)
        self.pen_down()
        for piece in pieces:
            for start, goal in zip(piece, piece[1:]):
                self._steps(start, goal)

    def _steps(self, start, goal):
        # type: (FixedPoint, FixedPoint) -> None
        """Draw a line by the report's method: dy fixed, dx = J^-1 dy, cut to 5 deg, repeated."""
        from robot.motion import classic_steps  # not above: few draw in steps

        description = self.arm.description
        dy = _direction((start, goal))
        for _ in range(MAX_STEPS):
            q = self.arm.angles()
            if classic_steps.has_arrived(start, goal, kinematics.forward(description, q)):
                return
            dq = classic_steps.jacobian_step(description, q, dy)
            self.arm.step_to([a + d for a, d in zip(q, dq)])
        raise ArmError(
            "{} steps did not get from ({}) to ({}) cm; use --method smooth".format(
                MAX_STEPS, *(", ".join("{:g}".format(x) for x in p) for p in (start, goal))
            )
        )


def _direction(piece):
    # type: (Piece) -> FixedPoint
    """Return the vector from the first point of a piece to the second, cm."""
    return tuple(b - a for a, b in zip(*piece[:2]))


def announce(pieces):
    # type: (Sequence[Piece]) -> None
    """Tell observers the wanted path, if there are any."""
    if os.environ.get(PLAN):
        import json  # not above: few are watched

        points = [pieces[0][0]] + [p for piece in pieces for p in piece[1:]]
        append_to_plan(json.dumps({"path": points}) + "\n")


def append_to_plan(line):
    # type: (str) -> None
    """Append a line of JSON, a path or a stroke of a job, to the file $BRICKSERVO_PLAN."""
    file = os.environ[PLAN]
    try:
        with open(open_to_write(file, os.O_APPEND), "a") as out:
            out.write(line)
    except OSError as error:
        raise NotAnnounced(
            "cannot write {}: {}; make room or unset BRICKSERVO_PLAN".format(file, error.strerror)
        ) from None
