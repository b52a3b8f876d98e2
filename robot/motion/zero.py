"""Where the joints' zero is: remembered in a small file, believed only while the encoders agree.

The encoders forget when the brick is switched off, and are reset after the Back button.  So the
file holds, beside the counts at joint angle zero, the counts at which the arm was parked, and since
which start of the brick; while it moves, it is on record as not parked.
"""

import math
import os

from shared.arm_description import ArmError
from shared.state import state_folder

MAX_PARKED_DRIFT = 2
"""Counts by which a parked motor may have settled since."""


BOOT_ID = "/proc/sys/kernel/random/boot_id"
"""Another text after every start of the system."""


class NotHomed(ArmError):
    """The zero is unknown, or the encoders contradict it."""


class StateNotSaved(ArmError, OSError):
    """The state file cannot be written."""


class Zero(object):
    """The zero of one arm on file.

    Args:
        name: of the arm; each has its own file.
        folder: None takes $BRICKSERVO_STATE, or ~/.brickservo.
    """

    def __init__(self, name, folder=None):
        self.name = name
        self.file = os.path.join(folder or state_folder(), name + ".json")

    def confirmed(self, counts):
        """Counts at joint angle zero, by port.

        Args:
            counts: what the encoders read now, by port.

        Raises:
            NotHomed: the arm was never homed, was not parked, or the encoders say otherwise.
        """
        import json  # not above: a program that finds no motors does without

        advice = "; lift the pen and home it first: driver.py home (or home --here)"
        try:
            with open(self.file) as file:
                state = json.loads(file.read())
            zero = {port: float(state["zero"][port]) for port in counts}
            parked = state["parked"]
            parked = parked and {port: float(parked[port]) for port in counts}
            if not all(
                math.isfinite(n) for n in list(zero.values()) + list((parked or {}).values())
            ):
                raise ValueError("not a number of counts")
        except FileNotFoundError:
            raise NotHomed(
                "the arm {} has not been homed, so its zero is unknown{}".format(self.name, advice)
            ) from None
        except (OSError, ValueError, KeyError, TypeError, AttributeError):
            raise NotHomed(
                "{} cannot be read, so the zero is unknown{}".format(self.file, advice)
            ) from None
        if not parked:
            raise NotHomed(
                "the last program ended without parking the arm, its zero is in doubt" + advice
            )
        if state.get("boot") != _boot():
            raise NotHomed(
                "the brick was switched off since the arm was parked, it may have been moved"
                + advice
            )
        for port in sorted(counts):
            if abs(counts[port] - parked[port]) > MAX_PARKED_DRIFT:
                raise NotHomed(
                    "motor {} reads {:.0f} but was parked at {:.0f}: switched off or turned "
                    "since{}".format(port, counts[port], parked[port], advice)
                )
        return zero

    def forget(self):
        """Remember no zero: it is about to be found anew.

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
        """Remember the zero; `parked` is the counts by port, or None while the arm moves.

        Raises:
            StateNotSaved: naming the file and why.
        """
        import json

        text = json.dumps({"boot": _boot(), "parked": parked, "zero": zero}, sort_keys=True)
        draft = self.file + ".new"
        try:
            os.makedirs(os.path.dirname(self.file), exist_ok=True)
            with open(draft, "w") as file:
                file.write(text + "\n")
            os.rename(draft, self.file)
        except OSError as error:
            raise self._not_saved(error) from None

    def _not_saved(self, error):
        return StateNotSaved(
            "cannot write {}: {}; make room or set BRICKSERVO_STATE to another folder".format(
                self.file, error.strerror
            )
        )


def _boot():
    try:
        with open(BOOT_ID) as file:
            return file.read().strip()
    except OSError:
        return ""
