"""What a servo decides."""

from shared.record import record

Decision = record("Decision", "action q verdict reason")
Decision.__doc__ = """What to do.

action   "explore" | "move" | "restart": go to q (rad); "end": with a verdict and its reason
"""


def end_of_run(verdict, reason=""):
    """The Decision to end."""
    return Decision("end", None, verdict, reason)
