"""The command of `visual_servoing.py`: one run, or runs as the laptop orders them."""

import contextlib
import re
import sys

from robot import program
from robot.clock import Clock
from robot.command_line import CODE_HELP, BadArgument, Parser, number_in
from robot.ev3.battery import Battery
from robot.servoing.rows import Rows
from robot.servoing.run_reporter import verdict_text
from robot.servoing.runs import Runs, print_line
from robot.tracker_address import at_terminal, find_tracker
from shared.arm_description import ArmError, find_arm, read_arm
from shared.messages import BUDGET, TOLERANCE, Start
from shared.run_options import METHODS, MODES, ROWS, InvalidRunOptions, check_options, usual_mode
from shared.state import default_arm
from shared.verdicts import CONVERGED

MYPY = False  # which a type checker takes for true
if MYPY:
    from argparse import Namespace  # noqa: F401
    from typing import Dict, Optional, Sequence, Tuple  # noqa: F401

    from robot.servoing.image_model import Pixel  # noqa: F401

DEFAULT_CAMERA = "A"
"""Name of the camera of a goal that is given as a pixel alone."""

DEFAULTS = Start()
"""Options of a run by default."""

EXAMPLES = """\
  visual_servoing.py 192.168.0.5
  visual_servoing.py --goal 400,200"""
"""Examples in the help."""


class NotReached(ArmError):
    """The run has ended with another verdict than `converged`."""


def _goal(text):
    # type: (str) -> Optional[Tuple[str, Pixel]]
    """Return (camera, (u, v) in px) of a text; None for the marker."""
    if text == "marker":
        return None
    number = r"(-?\d+(?:\.\d*)?)"
    match = re.match(r"\s*(?:([A-Z]):)?{0},{0}\s*\Z".format(number), text)
    if not match or not all(abs(float(x)) <= 1e5 for x in match.groups()[1:]):
        raise BadArgument(
            "'{}' is no goal; write marker, or a pixel U,V like 400,200, or B:U,V if it is one of"
            " camera B".format(text.strip()[:40])
        )
    u, v = (float(x) for x in match.groups()[1:])
    return match.group(1) or DEFAULT_CAMERA, (u, v)


def _fixed_goals(goals):
    # type: (Sequence[Optional[Tuple[str, Pixel]]]) -> Dict[str, Pixel]
    """Return {camera: (u, v) in px} of what was given with --goal.

    Raises:
        ArmError: that is no one goal.
    """
    fixed = dict(goal for goal in goals if goal is not None)
    if len(fixed) != len(goals) and len(goals) > 1:
        raise ArmError("--goal twice for one camera, or for a marker and a pixel; give one of them")
    return fixed


def _parser():
    # type: () -> Parser
    parser = Parser("visual_servoing.py", "Bring the tip where the camera sees the goal.", EXAMPLES)
    parser.add_argument(
        "place", nargs="?", default="", metavar="HOST",
        help="the laptop, or HOST:PORT (default: where ssh came from, else as remembered)",
    )  # fmt: skip
    parser.add_argument("--code", help=CODE_HELP)
    parser.add_argument(
        "--goal", type=_goal, action="append", default=[], metavar="GOAL",
        help="marker, a pixel U,V, or one of each camera, as B:U,V (default: marker)",
    )  # fmt: skip
    parser.add_argument(
        "--rows", choices=ROWS, default=DEFAULTS.rows,
        help="of the cameras' u and v, all, weighed by their noise, or as the report has it, those"
        " of the first and one of the second (default: stereo)",
    )  # fmt: skip
    parser.add_argument(
        "--third", choices=sorted(Rows.ONE),
        help="the second camera's row with --rows xyz (default: as exploring shows)",
    )  # fmt: skip
    parser.add_argument("--method", choices=METHODS, default=DEFAULTS.method)
    parser.add_argument(
        "--mode", choices=MODES,
        help="look, then move; or steer while moving (default: stream; with the report's, look)",
    )  # fmt: skip
    parser.add_argument(
        "--follow", action="store_true",
        help="after a goal that moves, until the budget is spent",
    )  # fmt: skip
    parser.add_argument(
        "--tolerance", type=number_in(*TOLERANCE), default=DEFAULTS.tolerance, metavar="PX"
    )
    parser.add_argument("--budget", type=number_in(*BUDGET), default=DEFAULTS.budget, metavar="S")
    parser.add_argument(
        "--wait", action="store_true",
        help="until ended by a signal, do a run whenever the laptop says so, as it orders, or draw"
        " what it offers, and hold the arm between them",
    )  # fmt: skip
    program.add_take(parser)
    parser.add_argument(
        "--arm", default=default_arm(), metavar="FILE",
        help="arm file (default: $BRICKSERVO_ARM, else planar)",
    )  # fmt: skip
    parser.add_argument(
        "--low", action="store_true",
        help="once at the goal, go low before parking, if the arm's file says where it rests",
    )  # fmt: skip
    parser.add_argument(
        "--log", metavar="FILE",
        help="what happened, as lines of JSON; with --wait, in the last run",
    )  # fmt: skip
    return parser


def _run(parser, args):
    # type: (Parser, Namespace) -> None
    description = read_arm(find_arm(args.arm))
    goals = _fixed_goals(args.goal)
    if args.third and args.rows != "xyz":
        parser.error(
            "--third is the second camera's row with --rows xyz; add that, or leave it out"
        )
    mode = args.mode or usual_mode(args.method)
    options = Start(
        args.method, mode, args.rows, args.tolerance, args.budget, args.follow, goals
    )  # fmt: skip
    if args.wait and (options != DEFAULTS or args.low):
        parser.error(
            "with --wait the laptop orders each run, and the arm is held at its goal; leave all but"
            " HOST, --code, --arm, --take, --third and --log out"
        )
    if args.low and all(joint.park_angle is None for joint in description.joints):
        parser.error("--low: {} does not say where it rests; leave it out".format(description.name))
    try:
        check_options(options, len(description.joints))
    except InvalidRunOptions as error:
        parser.error(str(error))
    tracker = find_tracker(args.place, args.code, ask=at_terminal())
    clock = Clock()
    arm = program.connect(description, clock, args.take)
    arm.load_zero()
    from robot.tracking import TrackingClient  # only now: the arm knows where it is

    client = TrackingClient(*tracker, clock=clock, say=print_line, battery=Battery(clock).volts)
    runs = Runs(arm, client, clock, args.log, args.third)
    reached = False
    try:
        if args.wait:
            runs.wait()
        verdict = runs.run(options)
        reached = verdict.word == CONVERGED
        if reached and args.low:
            arm.go_low()
    finally:
        program.ignore_signals()
        with contextlib.ExitStack() as last:
            last.callback(
                client.close, "the program has ended" if args.wait else "the run has ended"
            )
            if not reached:
                last.enter_context(contextlib.suppress(ArmError))  # the first error is reported
            arm.park()
    if not reached:
        raise NotReached(verdict_text(verdict))
    print_line(verdict_text(verdict))


def main(argv=None):
    # type: (Optional[Sequence[str]]) -> int
    """Run one servo run; return the exit status."""
    argv = sys.argv[1:] if argv is None else argv
    argv = [" " + arg if re.match(r"-\d", arg) else arg for arg in argv]
    parser = _parser()
    args = parser.parse_args(argv)
    return program.run(parser.prog, lambda: _run(parser, args))
