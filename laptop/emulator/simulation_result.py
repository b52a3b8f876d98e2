"""Result of a run on a rig: how it ended, and the truth about what it did."""

from typing import Any, Dict, List, NamedTuple, Optional, Sequence, Tuple

from laptop.emulator.device.motion_record import MotionRecord
from laptop.emulator.host.runner import Outcome

SimulationResult = NamedTuple(
    "SimulationResult",
    [
        ("outcome", Outcome),
        ("record", MotionRecord),
        ("wanted", List[List[Tuple[float, ...]]]),
        ("motors", Dict[str, Dict[str, Any]]),
        ("names", Optional[List[str]]),
        ("skeleton", Sequence[Tuple[float, ...]]),
        ("reach", Optional[Tuple[float, float]]),
        ("pace", Optional[float]),
        ("asked", List[str]),
        ("began", float),
    ],
)
SimulationResult.__doc__ = """Result of a run.

Attributes:
    outcome: Outcome, its times in s of the rig's world.  A program that fails says why on stderr.
    record: MotionRecord of this run alone: a MotionSample per 5 ms, the true links and tip.
    wanted: the paths that the script reported as wanted, each a list of points, cm.
    motors: port -> state of its motor at the end, a dict: its `mode`, whether it is `driven`, and
        its `position`, encoder counts.
    names: names of the angles in the record; None: the arm's joints.
    skeleton: final positions of the arm's joints and its tip, cm; empty without an arm.
    reach: least and greatest distance of the tip from the base, cm; None without an arm.
    pace: emulated seconds per second of this computer's clock; None in virtual time.
    asked: ports of the motors that were commanded to turn.
    began: start of the run on the clock of the rig's world, s.
"""
