"""How a run may be ordered: the brick's command line and the laptop offer and refuse the same."""

from shared.arm_description import ArmError

METHODS = ("report", "broyden", "kalman", "chain")
"""How the image Jacobian is known."""
MODES = ("look", "stream")
ROWS = ("stereo", "xyz")
"""Of the cameras' u and v."""


class BadOrders(ArmError):
    """What is ordered does not go together."""


class TooFewPixels(ArmError):
    """The goals leave joints undetermined."""


def check(orders, joints):
    """Refuse what no run can be made of.

    Args:
        orders: shared.messages.Start.
        joints: how many the arm has; 0 if that is not known.

    Raises:
        BadOrders, TooFewPixels: saying in one line, wherever that is read, what is wrong and what
            to do.
    """
    for what, known in (("method", METHODS), ("mode", MODES), ("rows", ROWS)):
        if getattr(orders, what) not in known:
            raise BadOrders(
                "'{}' is no {}; take one of {}".format(
                    getattr(orders, what), what, ", ".join(known)
                )
            )
    if orders.goals and 2 * len(orders.goals) < joints:
        raise TooFewPixels(
            "one pixel does not say where {} joints are to go; give one of each of two cameras,"
            " such as A:400,200 and B:310,150".format(joints)
        )
    if orders.method == "report" and orders.mode == "stream":
        raise BadOrders("the report's method looks, then moves; take the mode look with it")
    if orders.follow and orders.mode != "stream":
        raise BadOrders("a goal that moves is followed in the mode stream only; take that")
    if orders.follow and orders.goals:
        raise BadOrders("only a goal marker can be followed; aim at it, not at a pixel")
