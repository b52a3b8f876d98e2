"""The building guide of an arm: one document, drawn from the numbers in the arm's file."""

from __future__ import annotations

import base64
import math
from collections.abc import Iterable
from pathlib import Path
from typing import NamedTuple

from laptop.brick.connection import PASSWORD, USER
from laptop.brick.install import LINKS
from laptop.course import drawing, lego
from laptop.course.troubles import troubles
from laptop.record.figures.document import render_report
from robot.motion.mounting import jog_angles
from shared.arm_description import SEEK_BEYOND, Arm, Joint, is_bundled
from shared.state import laptop_program
from shared.version import VERSION

TEMPLATE = Path(__file__).with_name("templates") / "guide.html"
VIEW_ANGLES = (drawing.VIEW_ANGLE, *map(math.radians, (60, 70, 78)))
"""Fields of view of cameras, rad, for which the guide gives the height."""


class Need(NamedTuple):
    """A row of the table of parts.

    wanted     how many
    available  in each of the sets
    sets       those that have enough
    """

    name: str
    wanted: int
    available: tuple[int, int]
    sets: str


def render_guide(arm: Arm, arm_file: str) -> str:
    """Return the guide of an arm as the text of an HTML file.

    Args:
        arm: the arm to be built.
        arm_file: path of its file, as people write it.
    """
    is_own = not is_bundled(arm)
    links = [(joint.name, lego.link_of(joint.link)) for joint in moving(arm)]
    pairs = [(joint.name, joint.gear, lego.gear_pairs(joint.gear)) for joint in arm.joints]
    return render_report(
        TEMPLATE,
        title=f"Build the arm {arm.name}",
        kind=f"BrickServo {VERSION}: a building guide",
        arm=arm,
        arm_file=arm_file,
        is_own=is_own,
        chosen="" if arm_file == "planar" else f" --arm {arm_file}",
        there="" if arm.name == "planar" else f" --arm {arm.name}",
        source="data:text/plain;base64," + base64.b64encode(Path(arm.file).read_bytes()).decode(),
        usual=PASSWORD,
        user=USER,
        on_brick=[*LINKS, ".brickservo"],
        jog=f"{max(math.degrees(jog_angles(arm, k)[1]) for k in range(len(arm.joints))):.0f}",
        believed=f"{math.degrees(SEEK_BEYOND):.0f}",
        program=laptop_program(),
        sets=lego.SETS,
        needs=list(needs(arm)),
        links=links,
        pairs=pairs,
        drawings={
            name: draw(arm)
            for name, draw in (
                ("links", drawing.draw_links),
                ("plan", drawing.draw_plan),
                ("side", drawing.draw_side),
                ("camera", drawing.draw_camera),
            )
        },
        stops=stops(arm),
        view_angle=math.degrees(drawing.VIEW_ANGLE),
        camera_heights=[
            (math.degrees(angle), drawing.camera_height(arm, angle) / 10) for angle in VIEW_ANGLES
        ],
        troubles=troubles(arm),
    )


def moving(arm: Arm) -> list[Joint]:
    """Return the joints whose links are made of beams: all but a base."""
    return [joint for joint in arm.joints if joint.name != "base"]


def stops(arm: Arm) -> list[tuple[str, float]]:
    """Return each hard stop as the name of its joint and its angle, deg."""
    return [
        (joint.name, math.degrees(stop))
        for joint in arm.joints
        for stop in (joint.stop_lower, joint.stop_upper)
        if stop is not None
    ]


def needs(arm: Arm) -> Iterable[Need]:
    """Yield the parts of an arm that its numbers tell, and what the sets have of them."""
    wanted: dict[lego.Part, int] = {lego.OTHERS[0]: 1}

    def want(part: lego.Part, count: int) -> None:
        wanted[part] = wanted.get(part, 0) + count

    motors = [joint.motor for joint in arm.joints] + ([arm.pen.motor] if arm.pen else [])
    for motor in motors:
        want(lego.LARGE if motor == "large" else lego.MEDIUM, 1)
    for joint in moving(arm):
        beam = lego.link_of(joint.link).beam
        if beam:
            want(lego.Part(f"straight beam, {beam} holes", lego.BEAMS[beam]), 2)
    for joint in arm.joints:
        for pair in lego.gear_pairs(joint.gear)[:1]:
            for teeth in (pair.wheel, pair.pinion):
                want(lego.Part(f"gear wheel, {teeth} teeth", lego.WHEELS[teeth]), 1)
    for part, _ in zip(lego.OTHERS[1:4], motors, strict=False):
        want(part, 1)  # a longer one for each motor farther out
    if len(motors) > 3:
        want(lego.OTHERS[3], len(motors) - 3)
    for part in lego.OTHERS[4:]:
        want(part, {"frame 5 x 7": 1, "angle beam 3 x 5": len(stops(arm))}.get(part.name, 10))
    if arm.pen:
        want(lego.Part("straight beam, 5 holes", lego.BEAMS[5]), 2)
        want(lego.Part("straight beam, 3 holes", lego.BEAMS[3]), 1)
    for part, count in wanted.items():
        yield Need(
            part.name,
            count,
            part.counts,
            " and ".join(lego.enough(count, part.counts)) or "neither",
        )
