"""The keys of an arm's file: each has a rule, text -> value, that raises ValueError saying why.

Files hold degrees and centimetres; the values are in radians, centimetres and seconds.
"""

import math

# The joints of each kinematic chain, from the base outwards: these are the names of their sections.
CHAINS = {
    "planar": ("shoulder", "elbow"),
    "spatial": ("base", "shoulder", "elbow"),
}

# The speed in deg/s beyond which the motor's driver refuses a set-point.
MOTOR_SPEEDS = {"large": 1050.0, "medium": 1560.0}

PULLED_DOWN = ("spatial",)
"""The chains whose links gravity turns; those of the others lie level."""

FIND_HOME = ("both", "lower", "upper", "here")
# The hard stops that each way of finding the zero touches.
STOPS_TOUCHED = {
    "both": ("stop_lower", "stop_upper"),
    "lower": ("stop_lower",),
    "upper": ("stop_upper",),
    "here": (),
    "touch": (),
}

TOUCH_PORTS = ("in1", "in2", "in3", "in4")

SEEK_BEYOND = math.radians(15)
"""A joint that was put at home by hand goes no farther than this beyond its limits to find its
zero, rad; and so exactly is it to be put there."""


def _number(low, high, scale=1.0):
    def read(text):
        try:
            value = float(text)
        except ValueError:
            value = math.nan
        if not low <= value <= high:  # also refuses NaN
            raise ValueError("must be a number from {:g} to {:g}".format(low, high))
        return value * scale

    return read


def _one_of(words):
    def read(text):
        if text not in words:
            raise ValueError("must be one of {}".format(", ".join(words)))
        return text

    return read


def _angle_or_none(text):
    if text == "none":
        return None
    try:
        return _ANGLE(text)
    except ValueError as error:
        raise ValueError("{}, or none".format(error)) from None


def _way_home(text):
    """("here" | "both" | "lower" | "upper" | "touch", port of the touch sensor or None)."""
    way, _, port = text.partition(" ")
    if way == "touch" and port.strip() in TOUCH_PORTS:
        return way, port.strip()
    if text not in FIND_HOME:
        raise ValueError(
            "must be one of {}, or touch and the sensor's port, like touch in1".format(
                ", ".join(FIND_HOME)
            )
        )
    return text, None


def _two_lengths(text):
    """(x, y), cm."""
    parts = text.replace(",", " ").split()
    try:
        if len(parts) != 2:
            raise ValueError
        return tuple(map(_OFFSET, parts))
    except ValueError:
        raise ValueError("must be two numbers from -20 to 20, like 0.3 -0.1") from None


def _sign(text):
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
)
# What need not be said: where the marker that cameras look for sits beside the pen.
MARKER_KEYS = (("marker_offset", _two_lengths),)
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
)
# What need not be said: how the zero is found.
HOMING_KEYS = (
    ("find_home", _way_home),
    ("touch_at", _ANGLE),
    ("seek", _one_of(("both", "lower", "upper"))),
)
# Only of an arm that gravity pulls down: what it weighs, and where it rests.
WEIGHT_KEYS = (
    ("mass", _number(1, 2000, 0.001)),
    ("centre", _number(0.1, 100)),
    ("friction", _number(0, 50, 0.01)),
)
REST_KEYS = (("rest", _ANGLE),)
PEN_KEYS = (
    ("port", _PORT),
    ("motor", _MOTOR),
    ("up", _ANGLE),
    ("down", _ANGLE),
)
