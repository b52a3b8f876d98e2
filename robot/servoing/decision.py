"""The decision of a servo."""

from shared.record import record

MYPY = False  # which a type checker takes for true
if MYPY:
    from typing import List, NamedTuple, Optional, Union  # noqa: F401

    from robot.servoing.report_servo import ReportServo  # noqa: F401
    from robot.servoing.servo import Servo  # noqa: F401

    AnyServo = Union[Servo, ReportServo]

if MYPY:
    Decision = NamedTuple(
        "Decision",
        [
            ("action", str),
            ("q", Optional[List[float]]),
            ("verdict", str),
            ("reason", str),
        ],
    )
else:
    Decision = record("Decision", "action q verdict reason")
Decision.__doc__ = """Decision of a servo.

action   "explore" | "move" | "restart": go to q (rad, n); "end": with a verdict and its reason
reason   of the verdict; where it goes on, a line for people, or ""
"""


def end_of_run(verdict, reason=""):
    # type: (str, str) -> Decision
    """Return the Decision to end."""
    return Decision("end", None, verdict, reason)
