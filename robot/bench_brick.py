#!/usr/bin/env python3
"""Measure this brick: how fast it starts, computes, reads, wakes up; and how its motors turn.

    bench_brick.py                    three minutes; nothing turns, no laptop is needed
    bench_brick.py planar             control ticks and decisions of one arm only
    bench_brick.py --move             the arm's motors, too: it is homed, free and carries nothing
    bench_brick.py --move --bare D    and a motor at D that turns nothing, to tell motor from link
    bench_brick.py --json FILE        the figures into this file (default: brick.json)

`python -m laptop simulate --constants FILE ...` then emulates this brick.
"""

import _signal  # type: ignore[import-not-found]
import os
import sys

if __name__ == "__main__":  # first of all: until then Ctrl-C is a traceback
    _signal.signal(_signal.SIGINT, _signal.SIG_DFL)

sys.path.insert(0, os.path.dirname(os.path.dirname(os.path.realpath(__file__))))

from robot.clock import Clock  # noqa: E402

BEGUN = Clock().now()

from robot import program  # noqa: E402

if __name__ == "__main__":
    program.use_default_signals()

from robot.command_line import Parser  # noqa: E402
from shared.state import default_arm  # noqa: E402

MYPY = False  # which a type checker takes for true
if MYPY:
    from argparse import Namespace  # noqa: F401
    from typing import Optional, Sequence  # noqa: F401

ARMS = ("planar", "spatial")
EXAMPLES = """\
  bench_brick.py planar
  bench_brick.py --move --json mine.json"""
"""Examples in the help."""


def _run(args):
    # type: (Namespace) -> None
    from robot.benching.measuring import run  # not above: how long imports take is measured

    run(args, BEGUN)


def main(argv=None):
    # type: (Optional[Sequence[str]]) -> int
    """Run the command line; return the exit status."""
    parser = Parser("bench_brick.py", "Measure this brick.", EXAMPLES)
    parser.add_argument("arms", nargs="*", metavar="ARM", help="planar or spatial (default: both)")
    parser.add_argument(
        "--json", metavar="FILE", default="brick.json", help="(default: %(default)s)"
    )
    parser.add_argument("--marks", metavar="FILE", help="write there what each mark is the end of")
    parser.add_argument(
        "--move",
        action="store_true",
        help="turn the arm's motors: it must be homed, free to move and carry nothing",
    )
    parser.add_argument(
        "--arm",
        metavar="FILE",
        default=default_arm(),
        help="its arm file (default: $BRICKSERVO_ARM, else planar)",
    )
    parser.add_argument(
        "--bare",
        metavar="PORT",
        action="append",
        default=[],
        choices=tuple("ABCD"),
        help="turn the motor there, which moves nothing, at full speed; several times if needed",
    )
    program.add_take(parser)
    args = parser.parse_args(argv)
    for name in args.arms:
        if name not in ARMS:
            parser.error(
                "'{}' is not an arm that is measured; choose planar or spatial".format(name)
            )
    args.arms = args.arms or ARMS
    return program.run(parser.prog, lambda: _run(args))


if __name__ == "__main__":
    sys.exit(main())
