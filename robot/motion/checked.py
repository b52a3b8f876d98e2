"""The stored confirmation of which motor turns which joint, and which way, per arm.

It holds for the numbers of the arm's file that it is about, and for the motors that were plugged
in.  Once one is plugged in anew, or those numbers change, it is void.
"""

import os

from robot.motion.zero import boot_id
from shared.arm_description import ArmError
from shared.config_files import InvalidFile, read_json, write_whole

MYPY = False
if MYPY:
    from typing import Callable, Dict, Optional  # noqa: F401

    from robot.motion.zero import Number  # noqa: F401
    from shared.arm_description import Arm  # noqa: F401

VERSION = 1
"""Version of the file's format."""

ADVICE = "; nothing moves until then: type driver.py check"
"""End of the messages that refuse an arm."""


class NotChecked(ArmError):
    """An arm whose mounting is unconfirmed: which motor turns what, and which way."""


class CheckNotSaved(ArmError, OSError):
    """A confirmation that cannot be stored."""


def checked_numbers(arm):
    # type: (Arm) -> Dict[str, Number]
    """Return the numbers of an arm that a check of its joints confirms, by "part.key"."""
    numbers = {"arm.chain": arm.chain}  # type: Dict[str, Number]
    for joint in arm.joints:
        for key in ("port", "motor", "gear", "direction"):
            numbers[joint.name + "." + key] = getattr(joint, key)
    if arm.pen:
        numbers["pen.port"], numbers["pen.motor"] = arm.pen.port, arm.pen.motor
    return numbers


class Checked(object):
    """The confirmation on file.

    Args:
        arm: shared.arm_description.Arm; each name has its own file.
        folder: folder of the file.

    Attributes:
        file: path of the file.
        needed: whether it has to be confirmed before anything moves.
    """

    def __init__(self, arm, folder):
        # type: (Arm, str) -> None
        self.file = os.path.join(folder, arm.name + ".checked")
        self.needed = True
        self._arm = arm

    def confirm(self, devices):
        # type: (Callable[[], Dict[str, str]]) -> None
        """Raise NotChecked for an arm that was not checked as it is now; once is enough.

        Args:
            devices: returns the system's device names of its motors, by port; plugging in a motor
                changes its name.

        Raises:
            NotChecked: with the reason.
        """
        problem = self.needed and self._problem(devices())
        if problem:
            raise NotChecked(
                "which motor of {} is where, and which way it turns, {}{}".format(
                    self._arm.name, problem, ADVICE
                )
            )
        self.needed = False

    def _problem(self, devices):
        # type: (Dict[str, str]) -> Optional[str]
        """Return why the stored confirmation is void, or None if it holds."""
        try:
            known = read_json(self.file)
            then, before = known["arm"], known["motors"]
            if not (isinstance(then, dict) and isinstance(before, dict)):
                raise KeyError
            same_boot = known["boot"] == boot_id()
            if known["version"] != VERSION:
                raise KeyError
        except FileNotFoundError:
            return "was never checked"
        except (OSError, InvalidFile, KeyError):
            return "is to be checked again, for {} cannot be understood".format(self.file)
        now = checked_numbers(self._arm)
        for key in sorted(set(then) | set(now)):
            if then.get(key) != now.get(key):
                return "was checked while its file said {} = {}, not {}".format(
                    *[_shown(value) for value in (key, then.get(key), now.get(key))]
                )
        for port in sorted(devices):
            if same_boot and before.get(port, devices[port]) != devices[port]:
                return "was checked before the motor at port {} was plugged in anew".format(port)
        return None

    def save(self, devices):
        # type: (Dict[str, str]) -> None
        """Store that the arm is as its file says.

        Args:
            devices: device names of its motors, {port: name}.

        Raises:
            CheckNotSaved: with the file and the reason.
        """
        import json  # not above: few save it

        known = {
            "version": VERSION, "arm": checked_numbers(self._arm), "motors": devices,
            "boot": boot_id(),
        }  # fmt: skip
        try:
            write_whole(self.file, json.dumps(known, sort_keys=True) + "\n")
        except OSError as error:
            raise CheckNotSaved(
                "cannot write {}: {}; make room or set BRICKSERVO_STATE to another folder".format(
                    self.file, error.strerror
                )
            ) from None


def _shown(value):
    # type: (object) -> str
    """Return a value of an arm's file, of any type, as text of at most 40 characters."""
    if value is None:
        return "nothing"
    return ("{:g}".format(value) if isinstance(value, float) else ascii(value)).strip("'")[:40]
