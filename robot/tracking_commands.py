"""The command of `tracking_client.py`, which shows what the tracker sees."""

from robot import program
from robot.clock import Clock
from robot.command_line import CODE_HELP, BadArgument, Parser
from robot.tracker_address import (
    NotPaired,
    Refusal,
    at_terminal,
    check_is_no_code,
    find_tracker,
    shortened,
)
from robot.tracking import TrackingClient

MYPY = False  # which a type checker takes for true
if MYPY:
    from argparse import Namespace  # noqa: F401
    from typing import Dict, Optional, Sequence  # noqa: F401

    from shared.messages import Observation  # noqa: F401

LINE_PERIOD = 0.1
"""Period of printed lines, s: a person reads no faster, and printing costs the brick."""

EXAMPLES = """\
  tracking_client.py 192.168.0.5
  tracking_client.py --seconds 10"""
"""Examples in the help."""


def _line(seen, now):
    # type: (Observation, float) -> str
    parts = ["camera {}: {:4.0f} ms ago".format(seen.camera, 1000 * (now - seen.t))]
    for name in sorted(seen.markers):
        place = seen.markers[name]
        parts.append(
            "{} {:.2f},{:.2f} px ({:.2f})".format(name, *place)
            if place
            else "{} not seen".format(name)
        )
    return ", ".join(parts)


def _say(line):
    # type: (str) -> None
    print(line, flush=True)


def _seconds(text):
    # type: (str) -> float
    try:
        value = float(text)
    except ValueError:
        value = float("nan")
    if not 0.1 <= value <= 86400:
        raise BadArgument("'{}' must be a number from 0.1 to 86400 s".format(shortened(text)))
    return value


def _parser():
    # type: () -> Parser
    parser = Parser("tracking_client.py", "Show what the tracker on the laptop sees.", EXAMPLES)
    parser.add_argument(
        "place",
        nargs="?",
        default="",
        metavar="HOST[:PORT]",
        help="the laptop (default: where ssh came from, else as remembered)",
    )
    parser.add_argument("--code", help=CODE_HELP)
    parser.add_argument("--seconds", type=_seconds, metavar="S", help="(default: until Ctrl-C)")
    return parser


def _run(args):
    # type: (Namespace) -> None
    clock = Clock()
    tracker = find_tracker(args.place, args.code, ask=at_terminal())
    client = TrackingClient(*tracker, clock=clock, say=_say)
    start = clock.now()
    end = start + args.seconds if args.seconds else float("inf")
    some = False
    try:
        while clock.now() < end:
            pause = min(end, clock.now() + LINE_PERIOD)
            newest = {}  # type: Dict[str, Observation]
            while clock.now() < pause and not client.refused:
                newest.update(client.poll(max(0.0, pause - clock.now())))
                if not client.linked:
                    newest.clear()  # it has just said so: nothing older after that
            for camera in sorted(newest):
                some = True
                _say(_line(newest[camera], clock.now()))
            if client.refused:
                raise Refusal(client.why)
        if not some:
            raise NotPaired(
                "no observation in {:g} s: {}".format(
                    args.seconds, client.why or "linked, but the tracker sends none"
                )
            )
    finally:
        program.ignore_signals()
        client.close("the client has ended")


def main(argv=None):
    # type: (Optional[Sequence[str]]) -> int
    """Show what the tracker sees; return the exit status."""
    parser = _parser()
    args, others = parser.parse_known_args(argv)
    if others:
        if args.code is None:
            try:
                check_is_no_code(others[0])
            except NotPaired as problem:
                parser.error(str(problem))
        parser.error("unrecognized arguments: {}".format(" ".join(others)))
    return program.run(parser.prog, lambda: _run(args))
