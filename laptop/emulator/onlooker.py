"""A person beside the emulated arm, who answers what `driver.py check` asks by what truly moves."""

import io
import math
from typing import Optional

MYPY = False
if MYPY:
    from laptop.emulator.device.brick import EmulatedBrick  # noqa: F401


MIN_VISIBLE_TURN = math.radians(0.7)
"""Least turn of a joint that a person sees, rad."""


class Onlooker(io.TextIOBase):
    """Standard input of a script, with what that person types.

    First that all is ready; then, again and again, which part moved since the last answer, and
    which way.

    Args:
        brick: EmulatedBrick.
    """

    def __init__(self, brick: "EmulatedBrick") -> None:
        super(Onlooker, self).__init__()
        self._brick = brick
        self._begun = None  # type: Optional[int]  # samples of the record at the last answer
        # The answer to the next question, where that is which way.
        self._direction = None  # type: Optional[str]

    # Text, where the base of its base has bytes.
    def readline(self, size: Optional[int] = -1) -> str:  # type: ignore[override]
        """Return the next line that is typed."""
        record, begun = self._brick.record, self._begun
        self._begun = len(record)
        if begun is None:
            return "\n"
        if self._direction:
            direction, self._direction = self._direction, None
            return direction
        first = record[begun - 1].q
        turns = [
            max((sample.q[k] - first[k] for sample in record[begun:]), key=abs)
            for k in range(len(first))
        ]
        most = max(turns, key=abs)
        if abs(most) < MIN_VISIBLE_TURN:
            return "n\n"
        arm = self._brick.arm
        assert arm is not None, "a person looks on while an arm moves"
        joint = arm.joints[turns.index(most)]
        directions = "lr" if arm.chain == "planar" or joint.name == "base" else "ud"
        self._direction = directions[most < 0] + "\n"
        return joint.name[0] + "\n"
