#!/usr/bin/env python3
"""Draw with the arm: lines, arcs, circles, rectangles, by joint motions worked out on the brick.

    driver.py home                      find the zero against the hard stops (--here: as it stands)
    driver.py line 10,0 5,10            centimetres: x forward, y left, from the shoulder
    driver.py line 10,0,5 5,10,15       in space: z up, from the table
    driver.py                           home if need be, then the three lines of the first report

From Brickman start it by its name; from a shell also as `python3 -m robot.driver`.
"""

import argparse
import contextlib
import json
import math
import os
import re
import sys

sys.path.insert(0, os.path.dirname(os.path.dirname(os.path.abspath(__file__))))

from robot import program  # noqa: E402

if __name__ == "__main__":
    program.let_signals_end()

from robot.clock import Clock  # noqa: E402
from robot.motion import classic_steps, kinematics, paths, trajectory  # noqa: E402
from robot.motion.zero import NotHomed  # noqa: E402
from shared.arm_description import ArmError, find_arm, read_arm  # noqa: E402

LINES = {
    2: (((10, 0), (5, 10)), ((15, 0), (0, 15)), ((12, 15), (0, 15))),
    3: (((14, 0, 4), (14, 0, 16)), ((12, -6, 8), (12, 6, 8)), ((15, -4, 6), (9, 4, 12.6))),
}
"""What is drawn if nothing is said, cm: in the plane the lines of the report that the methods come
from; in space an upright, a level and a slanting one."""

METHODS = ("smooth", "steps")

PLAY_DIFFERS = math.radians(1.5)
"""Measured and described play may differ by this much before a word is said, rad."""

MOST_STEPS = 200
"""The report's steps end somewhere; this many would go round the base several times."""


class NotAnnounced(ArmError, OSError):
    """The file for whoever watches cannot be written."""


class Driver(object):
    """A drawing arm.

    Args:
        arm: robot.motion.arm.RobotArm.
        speed: of the tip, cm/s; the arm's own if None.
        elbow: "up" | "down" | None: the arm's own where it can.
        say: called with each line of progress.
    """

    def __init__(self, arm, speed=None, elbow=None, say=print):
        self.arm = arm
        self.speed = speed
        self.elbow = elbow
        self.say = say
        self._pen_is_down = None

    def home(self, here=False):
        """Find the zero, or take the arm as it stands for its home pose, then go to the home pose.

        Raises:
            ArmError: after stopping; the zero is then unknown.
        """
        for found, joint in zip(self.arm.home(here, self.say), self.arm.description.joints):
            play = (
                "" if found.play is None else ", play {:.1f} deg".format(math.degrees(found.play))
            )
            self.say(
                "{}: zero at {:.1f} counts, touches within {:.0f}{}".format(
                    found.joint, found.zero, found.spread, play
                )
            )
            if found.play is not None and abs(found.play - joint.backlash) > PLAY_DIFFERS:
                self.say(
                    "{}: the arm file says {:.1f} deg of play; correct it, or the stops".format(
                        joint.name, math.degrees(joint.backlash)
                    )
                )
        if not here:
            self.arm.go_to([joint.home for joint in self.arm.description.joints], speed=0.5)

    def position(self):
        """The tip (x, y) or (x, y, z), cm, as the encoders have it."""
        return self.arm.position()

    def pen_up(self):
        """Lift the pen; nothing where the arm has no pen motor."""
        self._move_pen(False)

    def pen_down(self):
        """Lower the pen."""
        self._move_pen(True)

    def _move_pen(self, down):
        pen = self.arm.description.pen
        if pen and self._pen_is_down is not down:
            self.arm.move_pen(pen.down if down else pen.up)
            self._pen_is_down = down

    def move_to(self, p):
        """Move to `p` (cm) with the pen up, not necessarily straight.

        Raises:
            kinematics.Unreachable: nothing has moved.
        """
        q = kinematics.inverse(self.arm.description, p, self.elbow, near=self.arm.angles())
        self.pen_up()
        self.arm.go_to(q)

    def go_low(self):
        """Go to where the arm rests, if there is such a place and a way; say what came of it."""
        try:
            if self.arm.go_low():
                self.say("gone low, where the arm rests")
        except kinematics.Unreachable as problem:
            self.say(str(problem))

    def draw_line(self, start, end, method="smooth"):
        """Draw the straight line from `start` to `end`, cm.

        Args:
            method: "smooth" or the report's "steps".

        Raises:
            kinematics.Unreachable: some point of it cannot be had; nothing has moved.
        """
        self.draw(paths.polyline([start, end]), method)

    def draw(self, strokes, method="smooth"):
        """Draw strokes (see robot.motion.paths), each beginning where the one before ends.

        Raises:
            kinematics.Unreachable: some point cannot be had; nothing has moved.
        """
        plans = trajectory.plan(self.arm.description, strokes, self.speed, self.elbow)
        self.play(strokes, plans, method)

    def play(self, strokes, plans, method="smooth"):
        """Draw strokes whose Trajectories (trajectory.plan) are known."""
        if method not in METHODS:
            raise ArmError(
                "there is no method '{}'; take one of {}".format(method, ", ".join(METHODS))
            )
        if method == "steps":
            for stroke, plan in zip(strokes, plans):
                classic_steps.jacobian_step(self.arm.description, plan.start, _way(stroke))
        announce(strokes)
        self.pen_up()
        if method == "steps":
            self._draw_in_steps(strokes, plans)
        else:
            self.arm.approach(plans[0])
            self.pen_down()
            self.arm.follow(plans)
        self.pen_up()

    def _draw_in_steps(self, strokes, plans):
        self.arm.go_to(plans[0].start)
        self.pen_down()
        for stroke in strokes:
            for start, goal in zip(stroke, stroke[1:]):
                self._steps(start, goal)

    def _steps(self, start, goal):
        """The report's method: dy fixed, dx = J^-1 dy here, cut to 5 degrees, repeated."""
        description = self.arm.description
        dy = _way((start, goal))
        for _ in range(MOST_STEPS):
            q = self.arm.angles()
            if classic_steps.has_arrived(start, goal, kinematics.forward(description, q)):
                return
            dq = classic_steps.jacobian_step(description, q, dy)
            self.arm.step_to([a + d for a, d in zip(q, dq)])
        raise ArmError(
            "{} steps did not get from ({}) to ({}) cm; use --method smooth".format(
                MOST_STEPS, *(", ".join("{:g}".format(x) for x in p) for p in (start, goal))
            )
        )


def _way(stroke):
    """From the first point of a stroke towards the second, cm."""
    return tuple(b - a for a, b in zip(*stroke[:2]))


def announce(strokes):
    """Append the wanted path to the file $BRICKSERVO_PLAN, for whoever watches; one JSON line."""
    file = os.environ.get("BRICKSERVO_PLAN")
    if file:
        points = [strokes[0][0]] + [p for stroke in strokes for p in stroke[1:]]
        try:
            with open(file, "a") as out:
                out.write(json.dumps({"path": points}) + "\n")
        except OSError as error:
            raise NotAnnounced(
                "cannot write {}: {}; make room or unset BRICKSERVO_PLAN".format(
                    file, error.strerror
                )
            ) from None


# The command line


def _point(text):
    try:
        point = tuple(float(part) for part in text.split(","))
    except ValueError:
        point = ()
    if len(point) not in (2, 3):
        raise argparse.ArgumentTypeError(
            "'{}' is not a point; write X,Y in cm, like 10,0, or X,Y,Z".format(text.strip())
        )
    if not all(map(math.isfinite, point)):
        raise argparse.ArgumentTypeError(
            "'{}' is not a place; give finite numbers".format(text.strip())
        )
    return point


def _options(**defaults):
    """The options of every command, accepted before and after its name."""
    options = program.Parser(add_help=False, argument_default=argparse.SUPPRESS)
    options.add_argument(
        "--arm", metavar="FILE", help="arm file (default: $BRICKSERVO_ARM, else planar)"
    )
    options.add_argument("--method", choices=METHODS)
    options.add_argument(
        "--speed",
        type=program.number_in(0.1, 50, "cm/s"),
        metavar="CM_PER_S",
        help="(default: the arm's)",
    )
    options.add_argument(
        "--height",
        type=program.number_in(-100, 100, "cm"),
        metavar="CM",
        help="z of points given as X,Y to an arm in space (default: 0)",
    )
    options.add_argument(
        "--stay",
        action="store_true",
        help="stay where it ends; else an arm with a resting place goes there, except after move",
    )
    options.add_argument("--elbow", choices=("up", "down"), help="(default: the arm's, if it can)")
    options.set_defaults(**defaults)
    return options


def _parser():
    first = _options(
        arm=os.environ.get("BRICKSERVO_ARM", "planar"),
        method="smooth",
        speed=None,
        elbow=None,
        height=None,
        stay=False,
    )
    parser = program.Parser(
        prog="driver.py", description="Draw with the arm; all lengths in cm.", parents=[first]
    )
    commands = parser.add_subparsers(dest="command", metavar="COMMAND")

    def add(name, text):
        return commands.add_parser(name, help=text, parents=[_options()])

    add("where", "where the tip is")
    inverse = add("inverse", "the joint angles for a point, found in three ways; moves nothing")
    inverse.add_argument("point", type=_point, metavar="X,Y[,Z]")
    home = add("home", "find the zero against the hard stops")
    home.add_argument("--here", action="store_true", help="the arm stands in its home pose")
    move = add("move", "go there, pen up")
    move.add_argument("point", type=_point, metavar="X,Y[,Z]")
    line = add("line", "a straight line")
    line.add_argument("points", type=_point, nargs="+", metavar="X,Y[,Z]")
    line.add_argument("--angle", type=program.number_in(-360, 360, "deg"), metavar="DEG")
    line.add_argument("--length", type=program.number_in(0.1, 100, "cm"), metavar="CM")
    for name, text in (
        ("polyline", "straight from point to point"),
        ("arc", "smoothly through n points"),
    ):
        add(name, text).add_argument("points", type=_point, nargs="+", metavar="X,Y[,Z]")
    circle = add("circle", "a circle round a point")
    circle.add_argument("point", type=_point, metavar="X,Y[,Z]")
    circle.add_argument(
        "--radius", type=program.number_in(0.1, 100, "cm"), metavar="CM", required=True
    )
    rectangle = add("rectangle", "an upright rectangle between two corners")
    rectangle.add_argument("points", type=_point, nargs=2, metavar="X,Y[,Z]")
    add("lines", "three lines (default); in the plane those of the report")
    return parser


def _compare_inverses(description, p):
    """Print the analytic poses for `p`, and the ways of Newton and Broyden from the home pose."""

    def degrees(q):
        return ", ".join("{:8.3f}".format(math.degrees(angle)) for angle in q)

    for q in kinematics.branches(description, p):
        print("analytic     {} deg".format(degrees(q)))
    home = [joint.home for joint in description.joints]
    for name, method in (
        ("newton", kinematics.newton_inverse),
        ("broyden", kinematics.broyden_inverse),
    ):
        for step in method(description, p, home).trace:
            print(
                "{:7} {:3}  {} deg, {:.6f} cm off".format(
                    name, step.iteration, degrees(step.q), step.error_cm
                )
            )


def _placed(description, point, height):
    """The point as this arm has them; a height completes X,Y to X,Y,Z."""
    size = kinematics.coordinates(description)
    if size == 3 and len(point) == 2:
        return point + (height or 0.0,)
    if len(point) != size or (size == 2 and height is not None):
        raise ArmError(
            "{} is no point for {}, an arm in the plane; give X,Y and no height, or --arm spatial"
            "".format(",".join(map("{:g}".format, point)), description.name)
        )
    return point


def _strokes(parser, args, description):
    """What to draw: a list of drawings, each a list of strokes."""
    if args.command in ("where", "inverse", "home", "move"):
        return []
    if args.command == "line":
        if args.angle is None and args.length is None and len(args.points) == 2:
            return [paths.polyline(args.points)]
        if args.angle is not None and args.length is not None and len(args.points) == 1:
            return [paths.line_from(args.points[0], math.radians(args.angle), args.length)]
        parser.error("a line takes two points, or one with --angle and --length")
    if args.command == "polyline":
        return [paths.polyline(args.points)]
    if args.command == "arc":
        return [paths.arc(args.points)]
    if args.command == "circle":
        return [paths.circle(args.point, args.radius)]
    if args.command == "rectangle":
        return [paths.rectangle(*args.points)]
    return [paths.polyline(line) for line in LINES[kinematics.coordinates(description)]]


def _run(parser, args):
    description = read_arm(find_arm(args.arm))
    if "point" in args:
        args.point = _placed(description, args.point, args.height)
    if "points" in args:
        args.points = [_placed(description, point, args.height) for point in args.points]
    if args.command == "inverse":
        _compare_inverses(description, args.point)
        return
    drawings = _strokes(parser, args, description)
    plans = [trajectory.plan(description, s, args.speed, args.elbow) for s in drawings]
    arm = program.connect(description, Clock())
    driver = Driver(arm, args.speed, args.elbow)
    try:
        if args.command == "home":
            driver.home(args.here)
        else:
            try:
                arm.wake()
            except NotHomed as problem:
                if args.command:
                    raise
                print("{}".format(problem).split(";")[0] + ": homing")
                driver.home()
        if args.command == "move":
            driver.move_to(args.point)
        for number, strokes in enumerate(drawings, 1):
            length = sum(kinematics.distance(a, b) for s in strokes for a, b in zip(s, s[1:]))
            print("drawing {} of {}: {:.1f} cm".format(number, len(drawings), length))
            driver.play(strokes, plans[number - 1], args.method)
        tip = ",".join("{:.2f}".format(value) for value in driver.position())
        angles = ", ".join("{:.1f}".format(math.degrees(a)) for a in arm.angles())
        print("tip at {} cm, joints at {} deg, as the encoders have it".format(tip, angles))
        if not args.stay and args.command != "move":
            driver.go_low()
    except BaseException:
        program.ignore_signals()
        with contextlib.suppress(ArmError):  # the first trouble is the one to tell
            arm.park()
        raise
    program.ignore_signals()
    arm.park()


def main(argv=None):
    """Run one command; the exit status."""
    argv = sys.argv[1:] if argv is None else argv
    # A leading space tells argparse that "-5,10" is a point and not an option.
    argv = [" " + word if re.match(r"-(\d|\.|inf|nan)", word) else word for word in argv]
    parser = _parser()
    args = parser.parse_args(argv)
    return program.run(parser.prog, lambda: _run(parser, args))


if __name__ == "__main__":
    sys.exit(main())
