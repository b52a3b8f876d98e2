"""Options of a run: the brick's command line and the laptop offer and refuse the same ones."""

from shared.arm_description import ArmError

MYPY = False
if MYPY:
    from shared.messages import Start  # noqa: F401


class ServoMethod(object):
    """A method of servoing.

    Args:
        name: as it is typed, and as it stands in files.
        maker: module:function; the function makes a servo as robot.servoing.runs.model_servo does.
        streams: whether it can move while pictures stream in.
        help: how it learns the image Jacobian, as a part of a sentence.
        paragraphs: names of paragraphs of laptop.record.report.method that describe it.
        words: what the lab report says of it beside them: sentences.
    """

    def __init__(self, name, maker, streams, help, paragraphs, words=""):
        # type: (str, str, bool, str, str, str) -> None
        self.name, self.maker, self.streams = name, maker, streams
        self.help, self.paragraphs, self.words = help, paragraphs, words


SERVO_METHODS = (
    ServoMethod(
        "report", "robot.servoing.report_servo:make", False, "as in the lab report",
        "lab-step broyden",
    ),
    ServoMethod(
        "broyden", "robot.servoing.runs:model_servo", True, "by each move",
        "least-squares broyden",
    ),
    ServoMethod(
        "kalman", "robot.servoing.runs:model_servo", True, "by each move",
        "least-squares kalman",
    ),
    ServoMethod(
        "chain", "robot.servoing.runs:model_servo", True, "by a model of the arm, from each frame",
        "least-squares chain",
    ),
)  # fmt: skip
"""The methods of servoing: the one place where they are registered, for the brick's programs, the
page, the bench and the lab report."""

METHODS = tuple(method.name for method in SERVO_METHODS)
"""Their names: sources of the image Jacobian."""
MODES = ("look", "stream")
"""Ways of servoing: look, then move; or move while pictures stream in."""
ROWS = ("stereo", "xyz")
"""Sets of rows of the error, from the cameras' u and v."""


class InvalidRunOptions(ArmError):
    """Error for options that exclude each other."""


class TooFewPixels(ArmError):
    """Error for goals that leave joints undetermined."""


def method_named(name):
    # type: (str) -> ServoMethod
    """Return the method of servoing of this name, one of METHODS."""
    return SERVO_METHODS[METHODS.index(name)]


def usual_mode(method):
    # type: (str) -> str
    """Return the mode of a method where none is asked for: it steers while it moves if it can."""
    return "look" if method in METHODS and not method_named(method).streams else "stream"


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
    if options.mode == "stream" and not method_named(options.method).streams:
        raise InvalidRunOptions(
            "the {}'s method looks, then moves; take the mode look with it".format(options.method)
        )
    if options.follow and options.mode != "stream":
        raise InvalidRunOptions("a goal that moves is followed in the mode stream only; take that")
    if options.follow and options.goals:
        raise InvalidRunOptions("only a goal marker can be followed; aim at it, not at a pixel")
