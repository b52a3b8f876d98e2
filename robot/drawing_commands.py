"""The commands of `driver.py`: command lines become drawings, and those are drawn."""

import math
import re
import sys

from robot import program
from robot.clock import Clock
from robot.command_line import CODE_HELP, BadArgument, Parser, number_in
from robot.drawing import METHODS, Driver
from robot.motion import kinematics, paths, trajectory
from robot.motion.checked import NotChecked
from robot.motion.zero import NotHomed
from shared.arm_description import ArmError, find_arm, read_arm
from shared.state import default_arm, laptop_program

MYPY = False
if MYPY:
    from typing import Dict, List, Optional, Sequence, Tuple  # noqa: F401

    from robot.command_line import Values  # noqa: F401
    from robot.motion.arm import RobotArm  # noqa: F401
    from robot.motion.chains import FixedPoint, Point, Pose  # noqa: F401
    from robot.motion.paths import Piece  # noqa: F401
    from robot.tracker_address import ServerAddress  # noqa: F401
    from shared.arm_description import Arm  # noqa: F401

LINES = {
    2: (((10, 0), (5, 10)), ((15, 0), (0, 15)), ((12, 15), (0, 15))),
    3: (((14, 0, 4), (14, 0, 16)), ((12, -6, 8), (12, 6, 8)), ((15, -4, 6), (9, 4, 12.6))),
}  # type: Dict[int, Tuple[Tuple[FixedPoint, FixedPoint], ...]]
"""Lines that are drawn by default, cm: in the plane those of the report that the methods come from;
in space an upright, a level and a slanting one."""


ABOUT = """\
Draw with the arm; all lengths in cm. What a laptop has planned: driver.py job --help.
Points that you touch with the arm: driver.py touch --help."""
"""Description in the help."""

EXAMPLES = """\
  driver.py line 10,0 5,10
  driver.py --arm spatial line 14,0,4 14,0,16"""
"""Examples in the help."""


def _point(text):
    # type: (str) -> FixedPoint
    try:
        point = tuple(float(part) for part in text.split(","))  # type: FixedPoint
    except ValueError:
        point = ()
    if len(point) not in (2, 3):
        raise BadArgument(
            "'{}' is not a point; write X,Y in cm, like 10,0, or X,Y,Z".format(text.strip())
        )
    if not all(map(math.isfinite, point)):
        raise BadArgument("'{}' is not a place; give finite numbers".format(text.strip()))
    return point


def _parser():
    # type: () -> Parser
    parser = Parser("driver.py", ABOUT, EXAMPLES)
    _add_options(parser)
    _add_arm_commands(parser)
    _add_drawings(parser)
    return parser


def _add_options(parser):
    # type: (Parser) -> None
    """Add the options of every command."""
    parser.add_argument(
        "--arm",
        default=default_arm(),
        metavar="FILE",
        help="arm file (default: $BRICKSERVO_ARM, else planar)",
    )
    parser.add_argument("--method", choices=METHODS, default="smooth")
    parser.add_argument(
        "--speed",
        type=number_in(0.1, 50, "cm/s"),
        metavar="CM_PER_S",
        help="(default: the arm's)",
    )
    parser.add_argument(
        "--height",
        type=number_in(-100, 100, "cm"),
        metavar="CM",
        help="z of points given as X,Y to an arm in space (default: 0)",
    )
    parser.add_argument(
        "--stay",
        action="store_true",
        help="stay where it ends; else an arm with a resting place goes there, except after move, "
        "or home by hand",
    )
    program.add_take(parser)
    parser.add_argument("--elbow", choices=("up", "down"), help="(default: the arm's, if it can)")


def _add_arm_commands(parser):
    # type: (Parser) -> None
    """Add the commands that report on the arm, check it, find its zero or move it, pen up."""
    add = parser.add_command
    add("where", "where the tip is")
    inverse = add("inverse", "the joint angles for a point, found in three ways; moves nothing")
    inverse.add_argument("point", type=_point, metavar="X,Y[,Z]")
    check = add("check", "which motor is where and which way it turns: turns each a little, asks")
    check.add_argument(
        "place", nargs="?", default="", metavar="HOST",
        help="with --camera the laptop of the tracker, or HOST:PORT (default: where ssh came from, "
        "else as remembered)",
    )  # fmt: skip
    check.add_argument(
        "--camera", action="store_true", help="does not ask, but looks through the tracker's camera"
    )
    check.add_argument("--code", help=CODE_HELP)
    home = add("home", "find the zero: you put the arm in its home pose, it says where that is")
    home.add_argument("--here", action="store_true", help="it stands there already")
    home.add_argument(
        "--seek", action="store_true", help="it may be anywhere: find its hard stops, both ways"
    )
    move = add("move", "go there, pen up")
    move.add_argument("point", type=_point, metavar="X,Y[,Z]")


def _add_drawings(parser):
    # type: (Parser) -> None
    """Add the commands that draw."""
    add = parser.add_command
    line = add("line", "a straight line")
    line.add_argument("points", type=_point, nargs="+", metavar="X,Y[,Z]")
    line.add_argument("--angle", type=number_in(-360, 360, "deg"), metavar="DEG")
    line.add_argument("--length", type=number_in(0.1, 100, "cm"), metavar="CM")
    line.add_argument("--trials", metavar="N", help="says how, for that takes the laptop's camera")
    for name, text in (
        ("polyline", "straight from point to point"),
        ("arc", "smoothly through n points"),
    ):
        add(name, text).add_argument("points", type=_point, nargs="+", metavar="X,Y[,Z]")
    circle = add("circle", "a circle round a point")
    circle.add_argument("point", type=_point, metavar="X,Y[,Z]")
    circle.add_argument("--radius", type=number_in(0.1, 100, "cm"), metavar="CM", required=True)
    rectangle = add("rectangle", "an upright rectangle between two corners")
    rectangle.add_argument("points", type=_point, nargs=2, metavar="X,Y[,Z]")
    add("lines", "three lines (default); in the plane those of the report")


def _compare_inverses(description, p):
    # type: (Arm, Point) -> None
    """Print the analytic poses for `p` (cm), and Newton's and Broyden's steps from home."""
    from robot.motion import inverse_iteration  # not above: only this command needs it

    def degrees(q):
        # type: (Pose) -> str
        return ", ".join("{:8.3f}".format(math.degrees(angle)) for angle in q)

    for q in kinematics.branches(description, p):
        print("analytic     {} deg".format(degrees(q)))
    home = [joint.home for joint in description.joints]
    for name, method in (
        ("newton", inverse_iteration.newton_inverse),
        ("broyden", inverse_iteration.broyden_inverse),
    ):
        for step in method(description, p, home).trace:
            print(
                "{:7} {:3}  {} deg, {:.6f} cm off".format(
                    name, step.iteration, degrees(step.q), step.error_cm
                )
            )


def _placed(description, point, height):
    # type: (Arm, FixedPoint, Optional[float]) -> FixedPoint
    """Return a point as this arm has them, cm; a height completes X,Y to X,Y,Z."""
    size = kinematics.coordinates(description)
    if size == 3 and len(point) == 2:
        return point + (height or 0.0,)
    if len(point) != size or (size == 2 and height is not None):
        raise ArmError(
            "{} is no point for {}, an arm in the plane; give X,Y and no height, or --arm spatial"
            "".format(",".join(map("{:g}".format, point)), description.name)
        )
    return point


def _drawings(parser, args, description):
    # type: (Parser, Values, Arm) -> List[List[Piece]]
    """Return a list of drawings, each the pieces of a stroke."""
    if args.command in ("where", "inverse", "check", "home", "move"):
        return []
    if args.command == "line":
        if args.trials is not None:
            points = " ".join(",".join(map("{:g}".format, p[:2])) for p in args.points)
            parser.error(
                'a brick has no camera; on the laptop: {} draw --line "{}" --trials {}'.format(
                    laptop_program(), points, args.trials
                )
            )
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


def _home(arm, driver):
    # type: (RobotArm, Driver) -> None
    """Have a person put the arm in its home pose, then find the zero from there."""
    from robot import placing  # not above: it is seldom needed

    placing.place(arm, Clock())
    driver.home()


def _check(description, take_over, tracker=None):
    # type: (Arm, bool, Optional[ServerAddress]) -> None
    from robot import check_command  # not above: it is seldom needed

    check_command.run(description, Clock(), take_over, tracker=tracker)


def _tracker(parser, args):
    # type: (Parser, Values) -> Optional[ServerAddress]
    """Return the ServerAddress of the tracker that `check` is to see by; None: it asks."""
    if not args.camera:
        if args.place or args.code is not None:
            parser.error("HOST and --code are of the tracker that a camera sees by; add --camera")
        return None
    # not above: most programs see nothing
    from robot.tracker_address import at_terminal, find_tracker

    return find_tracker(args.place, args.code, ask=at_terminal())


def _from_menu():
    # type: () -> bool
    """Return whether the brick's menu has started this, where no command can be typed."""
    from robot.asking import Person  # not above, see there

    return Person(None).at_brick


def _run(parser, args):
    # type: (Parser, Values) -> None
    description = read_arm(find_arm(args.arm))
    if "point" in args:
        args.point = _placed(description, args.point, args.height)
    if "points" in args:
        args.points = [_placed(description, point, args.height) for point in args.points]
    if args.command == "inverse":
        _compare_inverses(description, args.point)
        return
    if args.command == "home" and args.here and args.seek:
        parser.error("--here means that nothing is sought; leave it or --seek out")
    if args.command == "check":
        _check(description, args.take, _tracker(parser, args))
        return
    drawings = _drawings(parser, args, description)
    plans = [trajectory.plan(description, s, args.speed, args.elbow) for s in drawings]
    take_over = None if args.command == "where" else args.take
    try:
        arm = program.connect(description, Clock(), take_over)
    except NotChecked as problem:
        if args.command or not _from_menu():
            raise
        print("{}".format(problem).split(";")[0])
        _check(description, args.take)
        print("Start driver.py again to draw.")
        return
    driver = Driver(arm, args.speed, args.elbow)
    with program.parking(arm):
        if args.command == "home" and (args.here or args.seek):
            driver.home(args.here, args.seek)
        elif args.command == "home":
            _home(arm, driver)
        else:
            try:
                arm.load_zero()
            except NotHomed as problem:
                if args.command:
                    raise
                print("{}".format(problem).split(";")[0] + ": homing")
                _home(arm, driver)
        if args.command == "move":
            driver.move_to(args.point)
        for number, pieces in enumerate(drawings, 1):
            length = sum(kinematics.distance(a, b) for s in pieces for a, b in zip(s, s[1:]))
            print("drawing {} of {}: {:.1f} cm".format(number, len(drawings), length))
            driver.draw_planned(pieces, plans[number - 1], args.method)
        tip = ",".join("{:.2f}".format(value) for value in driver.position())
        angles = ", ".join("{:.1f}".format(math.degrees(a)) for a in arm.angles())
        print("tip at {} cm, joints at {} deg, as the encoders have it".format(tip, angles))
        by_hand = args.command == "home" and not args.seek  # which may be there still
        if not (args.stay or args.command == "move" or by_hand):
            driver.go_low()


def main(argv=None):
    # type: (Optional[Sequence[str]]) -> int
    """Run one command; return the exit status."""
    argv = sys.argv[1:] if argv is None else argv
    # A leading space tells argparse that "-5,10" is a point and not an option.
    argv = [" " + arg if re.match(r"-(\d|\.|inf|nan)", arg) else arg for arg in argv]
    parser = _parser()
    args = parser.parse_args(argv)
    return program.run(parser.prog, lambda: _run(parser, args))
