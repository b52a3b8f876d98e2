"""`driver.py touch`: hand guiding of the arm; a press takes the point where its tip is."""

import contextlib
import re
import sys

from robot import program
from robot.command_line import BadArgument, Parser
from robot.touch_presses import END, TAKE, press_sources
from shared.arm_description import ArmError
from shared.arm_keys import PULLED_DOWN
from shared.state import default_arm

MYPY = False  # which a type checker takes for true
if MYPY:
    from argparse import Namespace  # noqa: F401
    from typing import IO, Callable, List, Optional, Sequence, Tuple  # noqa: F401

    from robot.clock import Clock  # noqa: F401
    from robot.motion.arm import RobotArm  # noqa: F401
    from robot.touch_presses import PressSource  # noqa: F401
    from robot.touching import TouchPoint  # noqa: F401

    _Say = Callable[[str], object]
    _OnPoint = Callable[[TouchPoint, float], object]  # and its backlash, cm

COMMAND = "touch"

EXAMPLES = """\
  driver.py touch
  driver.py touch --points 2 --go midpoint
  driver.py touch --json --points 9"""
"""Examples in the help."""

POLL_PERIOD = 0.03
"""Period of sampling encoders and buttons, s."""

MAX_POINTS = 10000
"""Greatest number of points."""


class TouchRefused(ArmError):
    """This arm cannot be led by hand, or not so."""


def _count(text):
    # type: (str) -> int
    try:
        number = int(text)
    except ValueError:
        number = 0
    if not 1 <= number <= MAX_POINTS:
        raise BadArgument("'{}' must be a whole number from 1 to {}".format(
            text.strip()[:40], MAX_POINTS
        ))  # fmt: skip
    return number


def _parser():
    # type: () -> Parser
    parser = Parser(
        "driver.py",
        "Touch points with the arm, led by hand: where they are, their distance, angle, midpoint.\n"
        "Within its play a joint turns unseen: a point is known to half of the play, which is told",
        EXAMPLES,
    )
    parser.add_argument(
        "--arm", default=default_arm(), metavar="FILE",
        help="arm file (default: $BRICKSERVO_ARM, else planar)",
    )  # fmt: skip
    program.add_take(parser)
    touch = parser.add_command(COMMAND, "lead the arm by hand; each press takes a point")
    touch.add_argument(
        "--points", type=_count, metavar="N", help="end after so many (default: at the end key)"
    )
    touch.add_argument(
        "--pen",
        choices=("up", "down"),
        help="put it there before the motors let go (default: where it is)",
    )
    touch.add_argument(
        "--go", choices=("point", "midpoint"),
        help="in the end, after one more press, go to the last point or to the midpoint of the "
        "last two, pen up",
    )  # fmt: skip
    touch.add_argument(
        "--json", action="store_true",
        help="for programs: a line of JSON for each point, with p (cm), q (rad), t (s) and play "
        "(cm); what is for people goes to the standard error",
    )  # fmt: skip
    return parser


class Touching(object):
    """The points that a person collects with one arm.

    Args:
        arm: robot.motion.arm.RobotArm, whose motors coast.
        clock: has `now()` and `sleep(seconds)`.
        sources: objects whose `pressed()` gives TAKE and END for presses since the last call.
        say: called with lines for people.
        on_point: called with each touching.TouchPoint and its backlash, cm.

    Attributes:
        points: touching.TouchPoints.
    """

    def __init__(self, arm, clock, sources, say, on_point):
        # type: (RobotArm, Clock, Sequence[PressSource], _Say, _OnPoint) -> None
        self._arm, self._clock, self._sources = arm, clock, sources
        self._say, self._on_point = say, on_point
        self.points = []  # type: List[TouchPoint]

    def collect(self, most=None):
        # type: (Optional[int]) -> bool
        """Collect points until a person ends it, or there are `most`; return whether there are."""
        from robot.touching import StandstillDetector

        joints = self._arm.joints
        watch = StandstillDetector([motor.resolution for motor in joints])
        while most is None or len(self.points) < most:
            presses = self.presses()
            now = self._clock.now()
            if END in presses:
                return False
            if presses:
                watch.press(now)
            q = watch.see(now, [motor.angle() for motor in joints])
            if q:
                self._add(q, now)
            elif q is not None:
                self._say("the arm moves, no point taken:\nhold it still, and press again")
        return True

    def presses(self):
        # type: () -> List[str]
        """Wait POLL_PERIOD, and return the presses; a pulled cable or a slipping pen raises."""
        self._clock.sleep(POLL_PERIOD)
        self._arm.motors.check()
        return [one for hand in self._sources for one in hand.pressed() if one in (TAKE, END)]

    def _add(self, q, now):
        # type: (Tuple[float, ...], float) -> None
        """Add the point of joint angles `q` (rad), taken at the time `now` (s)."""
        from robot.motion import kinematics
        from robot.touching import TouchPoint, backlash_at, describe_points

        arm = self._arm.description
        point = TouchPoint(tuple(kinematics.forward(arm, q)), q, now)
        self.points.append(point)
        backlash = backlash_at(arm, q)
        self._on_point(point, backlash)
        lines = describe_points([one.p for one in self.points[-3:]], backlash, len(self.points))
        self._say("\n".join(lines))


def _sayer():
    # type: () -> _Say
    """Return a function that prints short lines: each its own on the brick's screen, else one."""
    from robot.asking import Person

    below = Person(None).at_brick

    def say(text):
        # type: (str) -> None
        if not below:
            text = re.sub("([:,;])\n", "\\1 ", text).replace("\n", "; ")
        print(text, flush=True)

    return say


def _announce(out, point, backlash):
    # type: (IO[str], TouchPoint, float) -> None
    """Print a point and its backlash (cm) as a line of JSON."""
    import json

    fields = {"p": [round(x, 4) for x in point.p], "q": [round(x, 6) for x in point.q],
              "t": round(point.t, 3), "play": round(backlash, 4)}  # fmt: skip
    print(json.dumps(fields, sort_keys=True), file=out, flush=True)


def _go(arm, touching, go, say):
    # type: (RobotArm, Touching, str, _Say) -> None
    """Go to the last point or the midpoint, after a press."""
    from robot.drawing import Driver
    from robot.touching import midpoint

    needed = 1 if go == "point" else 2
    if len(touching.points) < needed:
        raise TouchRefused("--go {} needs {} point{}, and there {}: nothing has moved".format(
            go, needed, "s" * (needed > 1),
            "is 1" if touching.points else "are none",
        ))  # fmt: skip
    last = [point.p for point in touching.points[-2:]]
    place = last[-1] if go == "point" else midpoint(*last)
    say("take your hands off; a press goes to {}".format(
        ",".join("{:.2f}".format(x + 0.0) for x in place)
    ))  # fmt: skip
    presses = []  # type: List[str]
    while not presses:
        presses = touching.presses()
    if END in presses:
        say("stays here")
        return
    driver = Driver(arm)
    driver.move_to(place)
    say("tip at {} cm, as the encoders have it".format(
        ",".join("{:.2f}".format(x + 0.0) for x in driver.position())
    ))  # fmt: skip


def _touch(args, on_point):
    # type: (Namespace, _OnPoint) -> None
    from robot.clock import Clock
    from shared.arm_description import find_arm, read_arm

    description = read_arm(find_arm(args.arm))
    if description.chain in PULLED_DOWN:
        raise TouchRefused(
            "{} is an arm in space: its motors hold it up, and let go it would drop; touch is for "
            "an arm in the plane, like --arm planar".format(description.name)
        )
    if args.pen and not description.pen:
        raise TouchRefused(
            "--pen {}: {} has no pen motor ([pen] in its file); leave it out".format(
                args.pen, description.name
            )
        )
    clock = Clock()
    arm = program.connect(description, clock, args.take)
    say = _sayer()
    with program.parking(arm):
        arm.load_zero()
        if description.pen and args.pen:
            _put_pen(arm, args.pen)
        hands = press_sources(description, say)
        touching = Touching(arm, clock, hands, say, on_point)
        try:
            with arm.lend_motors():
                for motor in arm.joints:
                    motor.coast()
                touching.collect(args.points)
                arm.motors.hold(arm.joints)
            if args.go:
                _go(arm, touching, args.go, say)
            if args.pen == "down":
                _put_pen(arm, "up")
        finally:
            for hand in hands:
                hand.close()


def _put_pen(arm, where):
    # type: (RobotArm, str) -> None
    pen = arm.description.pen
    if pen is not None:  # without a motor for it there is no such option
        arm.move_pen(pen.down if where == "down" else pen.up)


def main(argv=None):
    # type: (Optional[Sequence[str]]) -> int
    """Run the command; return the exit status."""
    argv = sys.argv[1:] if argv is None else argv
    # A leading space tells argparse that "-5" is a number and not an option.
    argv = [" " + arg if re.match(r"-(\d|\.)", arg) else arg for arg in argv]
    parser = _parser()
    args = parser.parse_args(argv)

    def command():
        # type: () -> None
        with contextlib.ExitStack() as stack:
            out = sys.stdout
            if args.json:  # all output for people goes to the standard error
                stack.enter_context(contextlib.redirect_stdout(sys.stderr))

            def on_point(point, backlash):
                # type: (TouchPoint, float) -> None
                if args.json:
                    _announce(out, point, backlash)

            _touch(args, on_point)

    return program.run(parser.prog, command)
