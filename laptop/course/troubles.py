"""Failures that people may meet, each with the sentence that the programs say, made by them."""

from __future__ import annotations

import os
import re
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

from laptop.brick.connection import BrickAddress, another_brick, unreached
from laptop.brick.diagnosis import judge, judge_link, judge_program, judge_turned
from laptop.brick.finding import NO_BRICK
from laptop.brick.install import why_not_taken
from laptop.emulator.rig import Rig
from robot.ev3.battery import BatteryFlat
from robot.motion import kinematics
from robot.motion.arm import RobotArm
from robot.motion.arm_motors import PenDisplaced
from robot.motion.checked import Checked
from robot.motion.control_loop import Stalled, TooSlow
from robot.motion.zero import Zero
from shared import verdicts
from shared.arm_description import Arm, ArmError, read_arm


class Trouble(NamedTuple):
    """A failure that people may meet: when, the sentence, the remedy."""

    seen: str
    sentence: str
    remedy: str


ADDRESS = BrickAddress("ev3dev.local")
"""Address of the brick in the sentences."""

NOW = 1.8e9
"""Time of the laptop in the sentences, s: in 2027."""

HEALTHY: dict[str, Any] = {
    "python": "3.5.3", "library": "2.1.0", "kernel": "4.14.117-ev3dev-2.3.5-ev3", "memory": 21.0,
    "load": 0.4, "cores": 1, "others": [], "room": 900.0, "battery": 7.9, "time": NOW,
    "host": "ev3dev", "connection": "", "problem": None,
}  # fmt: skip
"""Answers of doctor.py on a brick where all is fine but the motors."""


def troubles(arm: Arm) -> list[Trouble]:
    """Return the failures that are possible with an arm, in the order in which one meets them."""
    return [*_before_the_brick(), *_of_the_doctor(arm), *_at_the_arm(arm), *_in_a_servo_run()]


def _before_the_brick() -> Iterator[Trouble]:
    """Yield what the commands say that do not get to the brick."""
    find, any_command, install = "brick find", "any brick command", "brick install"
    yield Trouble(find, NO_BRICK, "Do what is said under Card, cable, network; then try again.")
    yield Trouble(
        any_command,
        unreached(ADDRESS, ConnectionRefusedError()),
        "It is still starting: the lights are orange until it is done.",
    )
    yield Trouble(
        any_command,
        unreached(ADDRESS, TimeoutError()),
        "Mostly the network: take the USB cable, and choose Connect in the brick's menu.",
    )
    yield Trouble(
        any_command,
        another_brick(ADDRESS, "SHA256:abc...", "this one has SHA256:def..."),
        "After a new card this is so. In a class each brick needs a name of its own.",
    )
    full = why_not_taken(1, "No space left on device")
    yield Trouble(install, full, "The old program stays whole and goes on working.")


def _of_the_doctor(arm: Arm) -> Iterator[Trouble]:
    """Yield the lines of `brick doctor` that are not fine."""
    motors = {joint.port: {"kind": joint.motor, "position": 0} for joint in arm.joints}
    if arm.pen:
        motors[arm.pen.port] = {"kind": arm.pen.motor, "position": 0}
    last = arm.joints[-1].port
    others = {port: motor for port, motor in motors.items() if port != last}
    exchanged = {**motors, last: {"kind": "medium", "position": 0}}
    busy = {"load": 2.4, "others": [[412, "python3 robot/driver.py"]]}

    def doctor_line(facts: dict[str, Any], motors: dict[str, Any] = motors) -> str:
        found = judge({**HEALTHY, "motors": motors, **facts}, arm, NOW)
        (line,) = (str(finding) for finding in found if finding.advice)
        return line

    for sentence, remedy in (
        (str(judge_link([0.21] * 3)), "WiFi through walls is slow. The cable takes 1 ms."),
        (str(judge_program("", "0.2.0+1a2b3c4d")), "brick run does that by itself, too."),
        (doctor_line({"library": None}), "It is another system than ev3dev, or an old one."),
        (doctor_line({"room": 3.0}), "In the shell: df shows what is left, rm deletes a file."),
        (
            doctor_line(busy),
            "Only one program at a time: end the others in the brick's menu by Back.",
        ),
        (
            doctor_line({"battery": 6.2}),
            "Charge, or put in six new ones. A weak battery draws badly.",
        ),
        (
            doctor_line({"time": NOW - 3e8}),
            "When it is off its clock stands still. Nothing else is wrong.",
        ),
        (doctor_line({}, others), "Push both plugs in until they click; try another cable."),
        (
            doctor_line({}, exchanged),
            "Plug it in where the line says, or write the port into your file.",
        ),
    ):
        yield Trouble("brick doctor", re.sub(" +", " ", sentence), remedy)
    blind = "Its encoder is dead, or you turned another joint."
    yield Trouble("brick doctor --motors", str(judge_turned(last, None)), blind)


def _at_the_arm(arm: Arm) -> Iterator[Trouble]:
    """Yield what the programs on the brick say."""
    moves = "whatever moves"
    yield Trouble(
        moves,
        _refusal(lambda: _unchecked(arm)),
        "Do what it says, with somebody who looks at the arm. Once is enough.",
    )
    yield Trouble(
        moves,
        _refusal(lambda: _without_motor(arm)),
        "A plug is not in to the click, or it is in another port than the arm's file says.",
    )
    yield Trouble("check, home", str(BatteryFlat(5.7)), "It takes some hours; or put in new ones.")
    yield Trouble(
        moves,
        _refusal(lambda: _unknown_zero(arm)),
        "The brick was switched off, or its menu ended the last program. Home again.",
    )
    yield Trouble(
        "your own arm file",
        _refusal(lambda: _wrong_file(arm)),
        "A number was mistyped. The line names it and what is allowed.",
    )
    yield Trouble(
        "drawing",
        _refusal(lambda: kinematics.inverse(arm, _far_point(arm))),
        "The point lies outside of the blue region of the plan.",
    )
    yield Trouble(
        "homing, drawing",
        _stalled(arm),
        "A beam or a cable is in the way, a gear jams, or the cable has come off. Turn the joint "
        "by hand, with the motor off: it must go freely.",
    )
    if arm.pen:
        yield Trouble(
            "drawing",
            str(PenDisplaced(arm.pen, 0.35)),
            "The pen is pressed on too hard, or the lift slips on its axle. Let it fall freely.",
        )
    yield Trouble(
        "any motion",
        str(TooSlow(0.3)),
        "Something else computes on the brick, such as a second ssh or an update. Wait for it.",
    )


def _in_a_servo_run() -> Iterator[Trouble]:
    """Yield the verdicts that one may meet."""
    for verdict, remedy in (
        (verdicts.MARKER_LOST, "A hand, a cable or the arm hides it, or the light changed."),
        (verdicts.SINGULAR, "The arm is stretched: bend it. Or the marker is not on the tip."),
        (verdicts.LIMIT, "The goal lies beyond a blue limit of the plan. Move it."),
        (verdicts.CAMERA_SLOW, "It is dark, so the camera exposes for long. Switch on a lamp."),
        (verdicts.LINK_LOST, "WiFi stalls at times; the USB cable does not."),
    ):
        yield Trouble("servoing", verdicts.VERDICT_TEXTS[verdict], remedy)


def _refusal(provoke: Callable[[], object]) -> str:
    """Return the line in which the programs refuse."""
    try:
        provoke()
    except ArmError as error:
        return str(error)
    raise AssertionError("nothing went wrong")


def _stalled(arm: Arm) -> str:
    with Rig(arm) as rig, rig.brick.sysfs.installed():
        return str(Stalled(RobotArm(arm, rig.world).joints[0], "12.0 deg are missing"))


def _without_motor(arm: Arm) -> None:
    with Rig(arm) as rig:
        rig.brick.unplug(arm.joints[-1].port)
        with rig.brick.sysfs.installed():
            RobotArm(arm, rig.world)


def _unchecked(arm: Arm) -> None:
    with tempfile.TemporaryDirectory() as folder:
        Checked(arm, folder).confirm(dict)


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
