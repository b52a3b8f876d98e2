"""Keys of an arm's file: each has a rule, text -> value, that raises ValueError saying why.

Values of a joint that contradict each other are refused here, too.
Files hold degrees and centimetres; the values are in radians, centimetres and seconds.
"""

import math

MYPY = False
if MYPY:
    from typing import (  # noqa: F401
        Any,
        Callable,
        Container,
        Dict,
        List,
        Mapping,
        NoReturn,
        Optional,
        Sequence,
        Tuple,
    )

    from shared.records import Joint  # noqa: F401

    Refuse = Callable[..., NoReturn]  # of a key, a problem, other keys
    Keys = Tuple[Tuple[str, Callable[[str], object]], ...]  # a key and its rule, in order


# The joints of each kinematic chain, from the base outwards: these are the names of their sections.
CHAINS = {
    "planar": ("shoulder", "elbow"),
    "spatial": ("base", "shoulder", "elbow"),
}  # type: Dict[str, Tuple[str, ...]]

# The speed in deg/s beyond which the motor's driver refuses a set-point.
MOTOR_SPEEDS = {"large": 1050.0, "medium": 1560.0}

PULLED_DOWN = ("spatial",)
"""Names of the chains whose links gravity turns; the links of the others lie level."""

FIND_HOME = ("both", "lower", "upper", "here")
# The hard stops that each way of finding the zero touches.
STOPS_TOUCHED = {
    "both": ("stop_lower", "stop_upper"),
    "lower": ("stop_lower",),
    "upper": ("stop_upper",),
    "here": (),
    "touch": (),
}  # type: Dict[str, Tuple[str, ...]]

TOUCH_PORTS = ("in1", "in2", "in3", "in4")

SEEK_BEYOND = math.radians(15)
"""Greatest search beyond a joint's limits for its zero, rad, after it was put at home by hand;
also the tolerance of that placing."""


def _number(low, high, scale=1.0):
    # type: (float, float, float) -> Callable[[str], float]
    def read(text):
        # type: (str) -> float
        try:
            value = float(text)
        except ValueError:
            value = math.nan
        if not low <= value <= high:  # also refuses NaN
            raise ValueError("must be a number from {:g} to {:g}".format(low, high))
        return value * scale

    return read


def _one_of(choices):
    # type: (Sequence[str]) -> Callable[[str], str]
    def read(text):
        # type: (str) -> str
        if text not in choices:
            raise ValueError("must be one of {}".format(", ".join(choices)))
        return text

    return read


def _angle_or_none(text):
    # type: (str) -> Optional[float]
    if text == "none":
        return None
    try:
        return _ANGLE(text)
    except ValueError as error:
        raise ValueError("{}, or none".format(error)) from None


def _homing_method(text):
    # type: (str) -> Tuple[str, Optional[str]]
    """Read ("here" | "both" | "lower" | "upper" | "touch", port of the touch sensor or None)."""
    method, _, port = text.partition(" ")
    if method == "touch" and port.strip() in TOUCH_PORTS:
        return method, port.strip()
    if text not in FIND_HOME:
        raise ValueError(
            "must be one of {}, or touch and the sensor's port, like touch in1".format(
                ", ".join(FIND_HOME)
            )
        )
    return text, None


def _two_lengths(text):
    # type: (str) -> Tuple[float, ...]
    """Read (x, y), cm."""
    parts = text.replace(",", " ").split()
    try:
        if len(parts) != 2:
            raise ValueError
        return tuple(map(_OFFSET, parts))
    except ValueError:
        raise ValueError("must be two numbers from -20 to 20, like 0.3 -0.1") from None


def _sign(text):
    # type: (str) -> int
    return int(_one_of(("1", "+1", "-1"))(text))


_DEGREE = math.pi / 180
_ANGLE = _number(-360, 360, _DEGREE)
_OFFSET = _number(-20, 20)
_PORT = _one_of(("A", "B", "C", "D"))
_MOTOR = _one_of(tuple(sorted(MOTOR_SPEEDS)))

# Pairs, not dicts: the order of the checks must be the same on every Python.
ARM_KEYS = (
    ("chain", _one_of(tuple(sorted(CHAINS)))),
    ("elbow", _one_of(("up", "down"))),
    ("speed", _number(0.1, 50)),
)  # type: Keys
# Optional: where the marker that cameras look for sits beside the pen.
MARKER_KEYS = (("marker_offset", _two_lengths),)  # type: Keys
JOINT_KEYS = (
    ("link", _number(1, 100)),
    ("port", _PORT),
    ("motor", _MOTOR),
    ("gear", _number(0.1, 100)),
    ("direction", _sign),
    ("lower", _ANGLE),
    ("upper", _ANGLE),
    ("stop_lower", _angle_or_none),
    ("stop_upper", _angle_or_none),
    ("backlash", _number(0, 20, _DEGREE)),
    ("max_speed", _number(1, max(MOTOR_SPEEDS.values()), _DEGREE)),
    ("home", _ANGLE),
)  # type: Keys
# Optional: how the zero is found.
HOMING_KEYS = (
    ("find_home", _homing_method),
    ("touch_at", _ANGLE),
    ("seek", _one_of(("both", "lower", "upper"))),
)  # type: Keys
# Only of an arm that gravity pulls down: what it weighs, and where it rests.
WEIGHT_KEYS = (
    ("mass", _number(1, 2000, 0.001)),
    ("centre", _number(0.1, 100)),
    ("friction", _number(0, 50, 0.01)),
)  # type: Keys
REST_KEYS = (("rest", _ANGLE),)  # type: Keys
PEN_KEYS = (
    ("port", _PORT),
    ("motor", _MOTOR),
    ("up", _ANGLE),
    ("down", _ANGLE),
)  # type: Keys


def stops_to_seek(values, method):
    # type: (Mapping[str, Any], str) -> Optional[str]
    """Return a joint's default `seek`: "both" | "lower" | "upper", or None without stops.

    Args:
        values: of the joint, by key.
        method: by which it finds its zero, a key of STOPS_TOUCHED.
    """
    if STOPS_TOUCHED[method]:
        return method
    sides = [side for side in ("lower", "upper") if values["stop_" + side] is not None]
    return "both" if len(sides) == 2 else sides[0] if sides else None


def check_joint(joint, given, refuse):
    # type: (Joint, Container[str], Refuse) -> None
    """Refuse a Joint whose values, each of them right, contradict each other.

    Args:
        joint: Joint.
        given: keys that are in its section.
        refuse: raises an error; called with a key, the problem as a format text, and the keys
            whose values fill it.
    """
    _check_limits(joint, refuse)
    _check_weight(given, refuse)
    for key in ("find_home", "seek"):
        _check_stops(joint, key, refuse)
    _check_touch(joint, refuse)
    fastest = MOTOR_SPEEDS[joint.motor] / joint.gear
    if joint.max_speed > math.radians(fastest):
        refuse(
            "max_speed",
            "must be a number from 1 to {:g} for this motor with gear = {{}}".format(fastest),
            "gear",
        )


def _check_limits(joint, refuse):
    # type: (Joint, Refuse) -> None
    if joint.lower >= joint.upper:
        refuse("lower", "must be below upper = {}", "upper")
    if joint.stop_lower is not None and joint.lower < joint.stop_lower:
        refuse("lower", "must not be beyond the hard stop, stop_lower = {}", "stop_lower")
    if joint.stop_upper is not None and joint.upper > joint.stop_upper:
        refuse("upper", "must not be beyond the hard stop, stop_upper = {}", "stop_upper")
    if not joint.lower <= joint.home <= joint.upper:
        refuse("home", "must be within the limits, from {} to {}", "lower", "upper")
    if joint.park_angle is not None and not joint.lower <= joint.park_angle <= joint.upper:
        refuse("rest", "must be within the limits, from {} to {}", "lower", "upper")


def _check_weight(given, refuse):
    # type: (Container[str], Refuse) -> None
    needed = [key for key, _ in WEIGHT_KEYS]
    present = [key for key in needed if key in given]
    if present and present != needed:
        refuse(present[0], "is only a part of the weight; give {}".format(", ".join(needed)))


def _check_stops(joint, key, refuse):
    # type: (Joint, str, Refuse) -> None
    """Refuse "find_home" or "seek" (`key`) if a stop that it touches does not exist."""
    for stop in STOPS_TOUCHED[getattr(joint, key) or "here"]:
        if getattr(joint, stop) is None:
            refuse(
                key,
                "touches a stop that is not there, {} = none; without it use {}".format(
                    stop, " or ".join(_possible_methods(joint, key)) or "no such line"
                ),
            )


def _possible_methods(joint, key):
    # type: (Joint, str) -> List[str]
    return [
        method
        for method in FIND_HOME
        if all(getattr(joint, stop) is not None for stop in STOPS_TOUCHED[method])
        and (key, method) != ("seek", "here")
    ]


def _check_touch(joint, refuse):
    # type: (Joint, Refuse) -> None
    at = joint.touch_at
    if joint.find_home != "touch":
        if at is not None:
            refuse("touch_at", "is of a touch sensor; give its port, too: find_home = touch in1")
        return
    if at is None:
        refuse("find_home", "give the angle at which the sensor closes, too: touch_at = -95")
    if not (
        0 <= joint.lower - at <= SEEK_BEYOND + 1e-9 or 0 <= at - joint.upper <= SEEK_BEYOND + 1e-9
    ):
        refuse(
            "touch_at",
            "must be at a limit or up to {:g} beyond it: lower = {{}}, upper = {{}}".format(
                math.degrees(SEEK_BEYOND)
            ),
            "lower",
            "upper",
        )
