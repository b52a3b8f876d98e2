"""Options of a run: the brick's command line and the laptop offer and refuse the same ones."""

from shared.arm_description import ArmError

MYPY = False
if MYPY:
    from shared.messages import Start  # noqa: F401

METHODS = ("report", "broyden", "kalman", "chain")
"""Sources of the image Jacobian."""
MODES = ("look", "stream")
"""Ways of servoing: look, then move; or move while pictures stream in."""
ROWS = ("stereo", "xyz")
"""Sets of rows of the error, from the cameras' u and v."""


class InvalidRunOptions(ArmError):
    """Error for options that exclude each other."""


class TooFewPixels(ArmError):
    """Error for goals that leave joints undetermined."""


def check_options(options, joints):
    # type: (Start, int) -> None
    """Refuse options that exclude each other.

    Args:
        options: shared.messages.Start.
        joints: number of the arm's joints; 0 if unknown.

    Raises:
        InvalidRunOptions, TooFewPixels: saying in one line, wherever that is read, what is wrong
            and what to do.
    """
    for what, known in (("method", METHODS), ("mode", MODES), ("rows", ROWS)):
        if getattr(options, what) not in known:
            raise InvalidRunOptions(
                "'{}' is no {}; take one of {}".format(
                    getattr(options, what), what, ", ".join(known)
                )
            )
    if options.goals and 2 * len(options.goals) < joints:
        raise TooFewPixels(
            "one pixel does not say where {} joints are to go; give one of each of two cameras,"
            " such as A:400,200 and B:310,150".format(joints)
        )
    if options.method == "report" and options.mode == "stream":
        raise InvalidRunOptions("the report's method looks, then moves; take the mode look with it")
    if options.follow and options.mode != "stream":
        raise InvalidRunOptions("a goal that moves is followed in the mode stream only; take that")
    if options.follow and options.goals:
        raise InvalidRunOptions("only a goal marker can be followed; aim at it, not at a pixel")
