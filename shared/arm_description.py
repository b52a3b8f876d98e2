"""Description of one arm: read from its INI file, checked once, then immutable.

This is the only place where a number about one machine enters the programs. Files hold degrees and
centimetres; everything handed out is in radians, centimetres and seconds. A file that is wrong in
any way is refused in one line that names the file, the section, the key, the value, what is allowed
and the next step.
"""

import math
import os

from shared.arm_keys import (  # noqa: F401 (some are for those who have an arm)
    ARM_KEYS,
    CHAINS,
    HOMING_KEYS,
    JOINT_KEYS,
    MARKER_KEYS,
    MOTOR_SPEEDS,
    PEN_KEYS,
    PULLED_DOWN,
    REST_KEYS,
    SEEK_BEYOND,
    STOPS_TOUCHED,
    WEIGHT_KEYS,
    check_joint,
    stops_to_seek,
)
from shared.config_files import InvalidFile, read_text
from shared.ini import BadIni, read_ini
from shared.record import record
from shared.state import OWN_ARMS_FOLDER, state_folder

MYPY = False
if MYPY:
    from typing import Any, Dict, List, Mapping, NoReturn, Optional, Sequence, Tuple  # noqa: F401  # noqa: F401

    from shared.arm_keys import Keys  # noqa: F401
    from shared.config_files import AnyPath  # noqa: F401
    from shared.records import Arm, Joint, Pen

    Sections = Mapping[str, Mapping[str, str]]  # values by section and key
    __all__ = ["Arm", "Joint", "Pen"]
    __all__ += ["MOTOR_SPEEDS", "PULLED_DOWN", "SEEK_BEYOND", "STOPS_TOUCHED"]
else:
    Pen = record("Pen", "port motor up down")
    Joint = record(
        "Joint",
        "name link port motor gear direction lower upper stop_lower stop_upper"
        " backlash max_speed home find_home touch_port touch_at seek mass centre friction"
        " park_angle",
    )
    Arm = record(
        "Arm", "name chain joints pen elbow speed file marker_offset", defaults=((0.0, 0.0),)
    )

JOINT_ACCELERATION = math.radians(200)
"""Maximum acceleration of a joint that carries others, rad/s^2: slowed harder than its friction
does, a link runs ahead in its backlash."""

MOTOR_ACCELERATION = math.radians(3000)
"""Maximum acceleration of a motor's shaft, rad/s^2: by a quarter of its torque."""

ARMS_FOLDER = os.path.join(os.path.dirname(os.path.abspath(__file__)), "arms")


class ArmError(Exception):
    """Base of every error that is shown to people as one line."""


class BadArmFile(ArmError, ValueError):
    """An arm file that is missing, unreadable or wrong."""


Arm.__doc__ = """One arm.

name    the file's name without its ending
chain   name of the kinematic chain, a key of CHAINS
joints  tuple of Joint, from the base outwards
pen     Pen, or None for an arm without a pen motor
elbow   "up" | "down": the branch preferred where both reach a point; up = planar: positive elbow
        angle; spatial: the elbow above
speed   of the tip while drawing, cm/s
file    path of the file it was read from
marker_offset  of the marker that cameras look for from the pen's tip, (x, y) in the last link's
        frame, cm: x along the link, y to its left; spatial: y upwards of it
"""

Joint.__doc__ = """One joint; angles are relative to the link before it, counter-clockwise, those of
a spatial arm's shoulder and elbow upwards.

name        the section's name
link        length of the link that it moves, cm; of a base, the height of the shoulder's axis
port        "A" | "B" | "C" | "D"
motor       "large" | "medium"
gear        motor turns per joint turn, > 0
direction   +1 | -1: sign of the joint angle when the motor's count rises
lower       least angle allowed, rad
upper       greatest angle allowed, rad
stop_lower  angle of the hard stop on the lower side, rad, or None if there is none
stop_upper  the same on the upper side
backlash    total play seen at the joint, rad
max_speed   greatest joint speed, rad/s
home        angle of the home pose, rad
find_home   how `home` finds the zero: "here" (a person has placed the joint at `home`), or from
            there "both" (touch both stops, take the middle), "lower" | "upper" (touch that stop) or
            "touch" (go to the touch sensor)
touch_port  "in1" .. "in4", where that sensor is plugged in, or None
touch_at    angle of the joint at which it closes, rad, or None; at the lower limit or up to
            SEEK_BEYOND below it, or so at the upper one
seek        which stops `home --seek` touches from anywhere: "both" | "lower" | "upper", or None:
            there are none
mass        of the link with all that it carries but the next link, kg; 0 where nothing is said
centre      where that balances, cm from the joint's axis along the link
friction    of the link in its bearings, Nm
park_angle  angle at which the arm is parked low, rad, or None: wherever it is
"""

Pen.__doc__ = """The pen's motor: port, "large" | "medium", its shaft's angles up and down, rad."""


def joint_accelerations(joints):
    # type: (Sequence[Joint]) -> List[float]
    """Return the maximum acceleration of each joint, rad/s^2.

    Friction F slows a link of inertia I by F / I.  What the last joint carries lies near the tip,
    as most of what the joint before it carries does.  So I goes with the square of the reach.
    """
    out = [JOINT_ACCELERATION] * len(joints)
    if len(joints) > 1:
        before, last = joints[-2:]
        lighter = (1 + before.link / last.link) ** 2 * JOINT_ACCELERATION
        out[-1] = max(JOINT_ACCELERATION, min(lighter, MOTOR_ACCELERATION / last.gear))
    return out


def move_accelerations(joints):
    # type: (Sequence[Joint]) -> List[float]
    """Return the maximum acceleration of each joint in a move, rad/s^2.

    It is half of the joint's own, as along a path: a weak motor that lifts its link lags by more
    than a free joint may.
    """
    return [max(JOINT_ACCELERATION, 0.5 * most) for most in joint_accelerations(joints)]


def find_arm(name_or_path):
    # type: (AnyPath) -> str
    """Return the path of an arm file, given as a path or as the bare name of an arm.

    An existing file wins. Otherwise `planar` and `planar.ini` both mean the one in the folder of
    one's own arms, in the state folder, and else the one in shared/arms.
    Raises BadArmFile, listing the arms that are known by name, when there is none.
    """
    name_or_path = str(name_or_path)
    if os.path.isfile(name_or_path):
        return name_or_path
    name = name_or_path[:-4] if name_or_path.endswith(".ini") else name_or_path
    for folder in _arm_folders():
        if name in _arms_in(folder):
            return os.path.join(folder, name + ".ini")
    raise _no_such_file(name_or_path)


def user_arm_file(name):
    # type: (str) -> str
    """Return the path of the user's own file of an arm of this name; it need not exist."""
    return os.path.join(_own_arms(), name + ".ini")


def is_bundled(arm):
    # type: (Arm) -> bool
    """Return whether an Arm was read from one of the files that come with the programs."""
    return os.path.dirname(os.path.realpath(arm.file)) == os.path.realpath(ARMS_FOLDER)


def read_arm(path):
    # type: (AnyPath) -> Arm
    """Read the Arm described by the INI file at `path`.

    Raises:
        BadArmFile: the file is missing, unreadable or wrong; in one line.
    """
    path = str(path)
    sections = _parse(path)
    known = _known_sections(sections)
    for section in sections:
        if section not in known:
            raise _bad(
                path,
                section,
                None,
                "is an unknown section; known here: {}".format(", ".join(known)),
            )
    arm = _read_section(path, sections, "arm", ARM_KEYS, MARKER_KEYS)
    names = CHAINS[arm["chain"]]
    joints = tuple(_read_joint(path, sections, name, arm["chain"]) for name in names)
    pen = _read_pen(path, sections) if "pen" in sections else None
    _check_ports(path, sections, names + (("pen",) if pen else ()))
    name = os.path.splitext(os.path.basename(path))[0]
    offset = arm.get("marker_offset", (0.0, 0.0))
    return Arm(name, arm["chain"], joints, pen, arm["elbow"], arm["speed"], path, offset)


# ---- reading


def _parse(path):
    # type: (str) -> Sections
    """Return the file's values by section and key."""
    try:
        return read_ini(read_text(path, encoding="utf-8-sig").split("\n"))
    except FileNotFoundError:
        raise _no_such_file(path) from None
    except InvalidFile as error:
        raise _bad(path, None, None, str(error)) from None
    except OSError as error:
        raise BadArmFile(
            "{}: cannot be read ({}); give the path of an arm file".format(
                _shown_path(path), error.strerror
            )
        ) from None
    except BadIni as error:
        raise _bad(path, error.section, error.key, error.problem) from None


def _known_sections(sections):
    # type: (Sections) -> Tuple[str, ...]
    chain = sections.get("arm", {}).get("chain", "")
    joints = CHAINS.get(chain) or sorted(set(sum(CHAINS.values(), ())))
    return ("arm",) + tuple(joints) + ("pen",)


def _read_section(path, sections, section, keys, others=()):
    # type: (str, Sections, str, Keys, Keys) -> Dict[str, Any]
    """Read a section's values by the rules of its keys.

    Args:
        path: of the file, for people.
        sections: the file's texts by section and key.
        section: name of the section to read.
        keys: pairs (key, rule) that must be there.
        others: pairs (key, rule) that may be missing.

    Returns:
        {key: value}.
    """
    if section not in sections:
        raise _bad(
            path,
            section,
            None,
            "is missing; needed are the keys {}".format(", ".join(key for key, _ in keys)),
        )
    known = [key for key, _ in keys + others]
    for key in sections[section]:
        if key not in known:
            raise _bad(
                path,
                section,
                key,
                "is an unknown key; known here: {}".format(", ".join(known)),
                sections,
            )
    values = {}
    for key, rule in keys + tuple(one for one in others if one[0] in sections[section]):
        try:
            values[key] = rule(sections[section].get(key, ""))
        except ValueError as error:
            problem = str(error)
            if key not in sections[section]:
                problem = "is missing; it " + problem
            raise _bad(path, section, key, problem, sections) from None
    return values


def _read_joint(path, sections, name, chain):
    # type: (str, Sections, str, str) -> Joint
    others = HOMING_KEYS + (WEIGHT_KEYS + REST_KEYS if chain in PULLED_DOWN else ())
    defaults = {"mass": 0.0, "centre": 0.0, "friction": 0.0, "park_angle": None, "touch_at": None}
    values = _read_section(path, sections, name, JOINT_KEYS, others)
    if "rest" in values:
        values["park_angle"] = values.pop("rest")
    method, port = values.pop("find_home", ("here", None))
    values.setdefault("seek", stops_to_seek(values, method))
    joint = Joint(name=name, find_home=method, touch_port=port, **dict(defaults, **values))

    def refuse(key, problem, *others):
        # type: (str, str, *str) -> NoReturn
        texts = [sections[name][other] for other in others]
        raise _bad(path, name, key, problem.format(*texts), sections)

    check_joint(joint, values, refuse)
    return joint


def _read_pen(path, sections):
    # type: (str, Sections) -> Pen
    pen = Pen(**_read_section(path, sections, "pen", PEN_KEYS))
    if pen.up == pen.down:
        raise _bad(path, "pen", "down", "must differ from up", sections)
    return pen


def _check_ports(path, sections, names):
    # type: (str, Sections, Sequence[str]) -> None
    taken = {}  # type: Dict[str, str]
    for section in names:
        port = sections[section]["port"]
        if port in taken:
            raise _bad(
                path,
                section,
                "port",
                "is taken by [{}]; each motor needs a port of its own, A to D".format(taken[port]),
                sections,
            )
        taken[port] = section


# ---- wording


def _bad(path, section, key, problem, sections=None):
    # type: (str, Optional[str], Optional[str], str, Optional[Sections]) -> BadArmFile
    where = _shown_path(path) + ":"
    if section is not None:
        where += " [{}]".format(_one_line(section))
        if key is not None:
            where += " " + _one_line(key)
            if sections is not None and key in sections[section]:
                where += " = " + _one_line(sections[section][key])
            where += ":"
    return BadArmFile("{} {}; correct the file".format(where, problem))


def _no_such_file(path):
    # type: (str) -> BadArmFile
    return BadArmFile(
        "{}: there is no such arm file; give the path of one or a known name: {}".format(
            _shown_path(path), ", ".join(sorted({n for f in _arm_folders() for n in _arms_in(f)}))
        )
    )


def _arm_folders():
    # type: () -> Tuple[str, str]
    """Return the folders of arms; a user's own arm hides a bundled one of the same name."""
    return _own_arms(), ARMS_FOLDER


def _own_arms():
    # type: () -> str
    return os.path.join(state_folder(), OWN_ARMS_FOLDER)


def _arms_in(folder):
    # type: (str) -> List[str]
    try:
        entries = os.listdir(folder)
    except OSError:
        return []
    return sorted(entry[:-4] for entry in entries if entry.endswith(".ini"))


def _shown_path(path):
    # type: (str) -> str
    """Return a path for people: relative to the working folder where it lies below that."""
    here = os.getcwd() + os.sep
    return _one_line(path[len(here) :] if path.startswith(here) else path, 200)


def _one_line(text, longest=60):
    # type: (str, int) -> str
    text = "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in text)
    return text if len(text) <= longest else text[:longest] + "..."
