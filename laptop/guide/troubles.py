"""What can go wrong, each with the sentence that the programs say: made by them, not copied."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

from laptop.simulator.device.brick import EmulatedBrick
from laptop.simulator.host.world import World
from robot.motion import kinematics
from robot.motion.arm import RobotArm
from robot.motion.arm_motors import PenDisplaced
from robot.motion.control_loop import Stalled, TooSlow
from robot.motion.zero import Zero
from shared import verdicts
from shared.arm_description import Arm, ArmError, read_arm


class Trouble(NamedTuple):
    """Something that goes wrong: what is seen, the sentence, what was the matter."""

    seen: str
    sentence: str
    cause: str


def troubles(arm: Arm) -> list[Trouble]:
    """Return what can go wrong with an arm, in the order in which one meets it."""
    return [
        Trouble(
            "a program of the brick begins",
            _said(lambda: _without_motor(arm)),
            "A plug is not in to the click, or it is in another port than the arm's file says.",
        ),
        Trouble(
            "any command that moves",
            _said(lambda: _unknown_zero(arm)),
            "The brick was switched off, or Brickman ended the last program.",
        ),
        Trouble(
            "your own arm file",
            _said(lambda: _wrong_file(arm)),
            "A number was mistyped. The line names it and what is allowed.",
        ),
        Trouble(
            "drawing",
            _said(lambda: kinematics.inverse(arm, _far_point(arm))),
            "The point lies outside of the blue region of the plan.",
        ),
        Trouble(
            "homing, drawing",
            _said(lambda: _stall(arm)),
            "A beam or a cable is in the way, a gear jams, or the cable has come off.",
        ),
        *(
            [
                Trouble(
                    "drawing",
                    _said(lambda: _displace_pen(arm)),
                    "The pen is pressed on too hard, or the lift slips on its axle.",
                )
            ]
            if arm.pen
            else []
        ),
        Trouble(
            "any motion",
            str(TooSlow(0.3)),
            "Something else computes on the brick, such as a second ssh or an update.",
        ),
        *(
            Trouble("servoing", verdicts.VERDICT_TEXTS[word], cause)
            for word, cause in (
                (
                    verdicts.MARKER_LOST,
                    "A hand, a cable or the arm hides it, or the light changed.",
                ),
                (verdicts.SINGULAR, "The arm is stretched, or the marker is not on the tip."),
                (verdicts.LIMIT, "The goal lies beyond a blue limit of the plan."),
                (verdicts.CAMERA_SLOW, "It is dark, so the camera exposes for long."),
                (verdicts.LINK_LOST, "WiFi stalls at times; the USB cable does not."),
            )
        ),
    ]


def _said(provoke: Callable[[], object]) -> str:
    """Return the line in which the programs refuse."""
    try:
        provoke()
    except ArmError as error:
        return str(error)
    raise AssertionError("nothing went wrong")


def _without_motor(arm: Arm) -> None:
    world = World()
    brick = EmulatedBrick(world, arm)
    brick.unplug(arm.joints[-1].port)
    with brick.sysfs.installed():
        RobotArm(arm, world)


def _unknown_zero(arm: Arm) -> None:
    with tempfile.TemporaryDirectory() as folder:
        Zero(arm, folder).confirmed({})


def _wrong_file(arm: Arm) -> None:
    joint = arm.joints[0].name
    text = Path(arm.file).read_text(encoding="utf-8-sig")
    head, section, rest = text.partition(f"[{joint}]")
    lines = [
        "backlash = two" if line.startswith("backlash") else line for line in rest.splitlines()
    ]
    with tempfile.TemporaryDirectory() as folder:
        file = os.path.join(folder, "my.ini")
        Path(file).write_text(head + section + "\n".join(lines), encoding="utf-8")
        try:
            read_arm(file)
        except ArmError as error:
            raise ArmError(str(error).replace(folder + os.sep, "")) from None


def _far_point(arm: Arm) -> tuple[float, ...]:
    far = kinematics.reach(arm)[1] + 4.2
    return (far, 0.0) if arm.chain == "planar" else (far, 0.0, arm.joints[0].link)


def _stall(arm: Arm) -> None:
    raise Stalled(arm.joints[0], "12.0 deg are missing")


def _displace_pen(arm: Arm) -> None:
    raise PenDisplaced(arm.pen, 0.35)
