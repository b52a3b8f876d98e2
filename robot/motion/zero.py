"""The zero of the joints, stored in a small file, and valid only while all agrees with it.

The encoders lose their counts when the brick is switched off, and are reset after the Back button.
So the file holds, beside the counts at joint angle zero, those at which the arm was parked, and the
identity of the brick's start.  While the arm moves, it is stored as not parked.

The file also holds the arm's numbers by which counts mean angles, see `meaning`.  For another arm
of the same name, or after an edit of the arm's file, the same counts are other angles.
"""

import math
import os

from shared.arm_description import ArmError
from shared.config_files import InvalidFile, number, read_json, write_whole
from shared.state import state_folder

MYPY = False
if MYPY:
    from typing import Any, Dict, Mapping, Optional, Union  # noqa: F401

    from robot.motion.chains import Pose  # noqa: F401
    from shared.arm_description import Arm  # noqa: F401

    Number = Union[str, int, float, None]  # of an arm's file
    Counts = Mapping[str, float]  # by port

VERSION = 2
"""Version of the file's format; it rises when something in it changes its meaning."""

MAX_PARKED_DRIFT = 2
"""Maximum drift of a parked motor, counts."""

MAX_OVERTRAVEL = math.radians(10)
"""Maximum overtravel of a joint beyond its stop and backlash, or of a pen beyond its ends, rad: the
stop was found to 5 degrees, and links bend."""

ADVICE = "; lift the pen and home it first: driver.py home (or home --here)"
"""End of the messages that refuse a zero."""

NOT_LOADED = (
    "the zero is on file, but this program has not loaded it, so it does not know where the arm "
    "stands: call load_zero() of its RobotArm before anything is to move"
)
"""Message to a user's own program."""

BOOT_ID = "/proc/sys/kernel/random/boot_id"
"""File with another text after every start of the system."""


class NotHomed(ArmError):
    """An unknown zero, or one that the encoders contradict; nothing has moved."""


class StateNotSaved(ArmError, OSError):
    """A state file that cannot be written."""


def meaning(arm):
    # type: (Arm) -> Dict[str, Number]
    """Return the numbers of an arm by which encoder counts mean joint angles, by "part.key".

    Port, motor, gear and direction convert counts to angles.  The stops, the home pose, the
    backlash and the pen's upper end determine the zero.  A name, a speed, a link's length or weight
    does not affect it, nor do limits within the stops.

    Args:
        arm: shared.arm_description.Arm.
    """
    numbers = {}  # type: Dict[str, Number]
    for joint in arm.joints:
        for key in ("port", "motor", "gear", "direction"):
            numbers[joint.name + "." + key] = getattr(joint, key)
        for key in ("stop_lower", "stop_upper", "touch_at", "home", "backlash"):
            numbers[joint.name + "." + key] = _degrees(getattr(joint, key))
    if arm.pen:
        numbers["pen.port"], numbers["pen.motor"] = arm.pen.port, arm.pen.motor
        numbers["pen.up"] = _degrees(arm.pen.up)
    return numbers


def _degrees(angle):
    # type: (Optional[float]) -> Optional[float]
    """Return an angle (rad) in degrees as an arm's file has it; None for None."""
    return angle if angle is None else round(math.degrees(angle), 6)


class Zero(object):
    """The zero of one arm on file.

    Args:
        arm: shared.arm_description.Arm; each name has its own file.
        folder: folder of the file; None: $BRICKSERVO_STATE, or ~/.brickservo.

    Attributes:
        file: path of the file.
    """

    def __init__(self, arm, folder=None):
        # type: (Arm, Optional[str]) -> None
        self.file = os.path.join(folder or state_folder(), arm.name + ".json")
        self._arm = arm

    def confirmed(self, counts):
        # type: (Counts) -> Dict[str, float]
        """Return the counts at joint angle zero, by port.

        Args:
            counts: readings of the encoders now, by port.

        Raises:
            NotHomed: the arm was never homed, was not parked, is another one by its numbers, or the
                encoders contradict the file.
        """
        try:
            state = read_json(self.file)
            self._check_meaning(state)
            zero, parked = (
                values and {port: number(values[port]) for port in counts}
                for values in (state["zero"], state["parked"])
            )
            if not zero:
                raise InvalidFile("has no zero")
        except FileNotFoundError:
            raise NotHomed(
                "the arm {} has not been homed, so its zero is unknown{}".format(
                    self._arm.name, ADVICE
                )
            ) from None
        except OSError as error:
            raise self._not_read("cannot be read ({})".format(error.strerror)) from None
        except InvalidFile as error:
            raise self._not_read(error) from None
        except (KeyError, TypeError):
            raise self._not_read("lacks something") from None
        if not parked:
            raise NotHomed(
                "the last program ended without parking the arm, its zero is in doubt" + ADVICE
            )
        if state.get("boot") != boot_id():
            raise NotHomed(
                "the brick was switched off since the arm was parked, it may have been moved"
                + ADVICE
            )
        for port in sorted(counts):
            if abs(counts[port] - parked[port]) > MAX_PARKED_DRIFT:
                raise NotHomed(
                    "motor {} reads {:.0f} but was parked at {:.0f}: switched off or turned "
                    "since{}".format(port, counts[port], parked[port], ADVICE)
                )
        return zero

    def _check_meaning(self, state):
        # type: (Dict[str, Any]) -> None
        """Raise NotHomed for a zero of other numbers than this arm's, or of another version."""
        version = state.get("version", 1)
        if version != VERSION:
            number(version)
            raise NotHomed(
                "{} is of {} version of these programs, so the zero is unknown{}".format(
                    self.file, "a later" if version > VERSION else "an earlier", ADVICE
                )
            )
        then, now = state["arm"], meaning(self._arm)
        plain = (str, int, float, type(None))
        if not isinstance(then, dict) or any(type(value) not in plain for value in then.values()):
            raise InvalidFile("has something else where the arm's numbers should be")
        if not isinstance(state["file"], str):
            raise InvalidFile("has something else where the arm's file should be")
        for key in sorted(set(then) | set(now)):
            if then.get(key) != now.get(key):
                values = [ascii(key)[1:-1][:40], _shown(then.get(key)), _shown(now.get(key))]
                if state["file"] == _path(self._arm):
                    problem = "from before its file was edited: its {} was {} and is {}"
                else:
                    problem = "that of another arm, {}: its {} is {} there and {} here"
                    values = [ascii(state["file"])[1:-1][:100]] + values
                raise NotHomed(
                    "the zero of {} on file is {}{}".format(
                        self._arm.name, problem.format(*values), ADVICE
                    )
                )

    def _not_read(self, why):
        # type: (object) -> NotHomed
        """Return the error for a file that cannot be used, for the reason `why`."""
        return NotHomed("{} {}, so the zero is unknown{}".format(self.file, why, ADVICE))

    def check_angles(self, angles, pen=None):
        # type: (Pose, Optional[float]) -> None
        """Raise NotHomed for a zero by which a joint stands where it cannot.

        A joint without a stop on one side is taken to stop at its limit: no program leaves it
        beyond.

        Args:
            angles: of the joints, rad.
            pen: angle of the pen's motor, rad; None: it has none.

        Raises:
            NotHomed: naming the joint, its angle and the stop.
        """
        parts = [
            (
                joint.name,
                angle,
                joint.lower if joint.stop_lower is None else joint.stop_lower,
                joint.upper if joint.stop_upper is None else joint.stop_upper,
                joint.backlash,
            )
            for joint, angle in zip(self._arm.joints, angles)
        ]
        if self._arm.pen and pen is not None:
            ends = sorted((self._arm.pen.up, self._arm.pen.down))
            parts.append(("pen", pen, ends[0], ends[1], 0.0))
        for name, angle, lower, upper, backlash in parts:
            if not lower - backlash - MAX_OVERTRAVEL <= angle <= upper + backlash + MAX_OVERTRAVEL:
                raise NotHomed(
                    "by the zero in {} the {} stands at {:.1f} deg, but it cannot leave {:.0f} to "
                    "{:.0f}{}".format(
                        self.file,
                        name,
                        math.degrees(angle),
                        math.degrees(lower),
                        math.degrees(upper),
                        ADVICE,
                    )
                )

    def forget(self):
        # type: () -> None
        """Remove the stored zero: it is about to be found anew.

        Raises:
            StateNotSaved: the old file cannot be removed.
        """
        try:
            os.remove(self.file)
        except FileNotFoundError:
            pass
        except OSError as error:
            raise self._not_saved(error) from None

    def save(self, zero, parked):
        # type: (Counts, Optional[Counts]) -> None
        """Store the zero; `parked` is the counts by port, or None while the arm moves.

        Raises:
            StateNotSaved: with the file and the reason.
        """
        import json

        state = {
            "version": VERSION, "arm": meaning(self._arm), "file": _path(self._arm),
            "boot": boot_id(), "parked": parked, "zero": zero,
        }  # fmt: skip
        try:
            write_whole(self.file, json.dumps(state, sort_keys=True) + "\n")
        except OSError as error:
            raise self._not_saved(error) from None

    def _not_saved(self, error):
        # type: (OSError) -> StateNotSaved
        """Return the error for a file that cannot be written."""
        return StateNotSaved(
            "cannot write {}: {}; make room or set BRICKSERVO_STATE to another folder".format(
                self.file, error.strerror
            )
        )


def check_not_reset(counts, before):
    # type: (Counts, Counts) -> None
    """Raise NotHomed if all encoders begin anew: the Back button has ended a program.

    Args:
        counts: readings now, by port.
        before: the last valid readings, by port.
    """
    turned = [port for port in sorted(before) if abs(before[port]) > MAX_PARKED_DRIFT]
    if turned and all(abs(counts[port]) <= MAX_PARKED_DRIFT for port in counts):
        raise NotHomed(
            "motor {} reads {:.0f} but stood at {:.0f}: the motors were reset since{}".format(
                turned[0], counts[turned[0]], before[turned[0]], ADVICE
            )
        )


def _path(arm):
    # type: (Arm) -> str
    """Return the absolute path of the arm's file, which tells two arms apart."""
    return os.path.abspath(arm.file)


def _shown(value):
    # type: (object) -> str
    """Return a value of an arm's file, of any type, as text of at most 40 characters."""
    if value is None:
        return "not there"
    shown = "{:g}".format(value) if isinstance(value, float) else ascii(value)
    return shown.strip("'")[:40]


def boot_id():
    # type: () -> str
    """Return a text that changes with every start of the system; "" where it has none."""
    try:
        with open(BOOT_ID) as file:
            return file.read().strip()
    except OSError:
        return ""
