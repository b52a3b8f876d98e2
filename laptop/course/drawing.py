"""An arm drawn from its numbers, as vector graphics true to a scale that is printed beside them."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from markupsafe import Markup
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Arc, Circle, Rectangle

from laptop.course.lego import PITCH, gear_pairs, link_of
from laptop.record.figures.formulas import data_url, svg
from laptop.record.figures.sheet import INK, QUIET, draw_beam
from robot.motion.kinematics import Unreachable, branches, forward, joint_positions, reach
from shared.arm_description import Arm, Joint

WIDTH, HEIGHT = 180.0, 250.0
"""Room for a drawing on a page of A4 within its margins, mm."""
SCALES = (1, 2, 2.5, 3, 4, 5, 7.5, 10, 15, 20, 30, 50, 100)
"""Factors by which a drawing may be smaller than the arm."""
BEAM, HOLE, STEEL, STOP, LIMIT, ROOM, TIP, GOAL = (
    "#e6c84b", "#ffffff", "#aab3bb", "#b3430a", "#1f5fae", "#e3eef9",
    "#d01020", "#109040",
)  # fmt: skip
MARKER, RIM = 20.0, 34.0
"""Diameters of a marker and of the circle along which it is cut out, mm."""
MARKER_HEIGHT = 128.0
"""Height of a planar arm's marker above the table, mm."""
BRICK, BRICK_ROOM = (72.0, 112.0), 12.0
"""Width and length of the EV3 brick, and free room around it, mm."""
VIEW_ANGLE = 2 * math.atan(320 / 650)
"""Field of view of the emulated camera, rad; many webcams have the same."""


@dataclass(frozen=True)
class Drawing:
    """A drawing for a page: its SVG, its width on paper in mm, how many times smaller it is."""

    svg: str
    width: float
    scale: float

    def picture(self, alt: str) -> Markup:
        """Return it as an image that holds itself, as wide as it must be."""
        return Markup('<img alt="{}" style="width: {}mm" src="{}">').format(
            alt, f"{self.width:.3f}", data_url(self.svg)
        )


class _Draft:
    """A drawing in the making, true to its scale; places are real mm.

    box    left, bottom, right, top of what is shown
    width  greatest width on paper, mm
    """

    def __init__(self, box: Sequence[float], width: float = WIDTH, height: float = HEIGHT) -> None:
        left, bottom, right, top = box
        fits = [s for s in SCALES if right - left <= s * width and top - bottom <= s * height]
        self.scale = fits[0] if fits else SCALES[-1]
        self.width = (right - left) / self.scale
        size = (self.width / 25.4, (top - bottom) / self.scale / 25.4)
        self.figure = Figure(figsize=size)
        self.axes: Axes = self.figure.add_axes((0, 0, 1, 1), xlim=(left, right), ylim=(bottom, top))
        self.axes.axis("off")

    def drawing(self) -> Drawing:
        return Drawing(svg(self.figure), self.width, self.scale)

    def line(self, *points: Sequence[float] | np.ndarray, **style: Any) -> None:
        self.axes.plot(*np.array(points).T, **{"color": INK, "lw": 0.7, **style})

    def text(self, x: float, y: float, label: str, **style: Any) -> None:
        style = {"size": 7.5, "color": INK, "ha": "center", "va": "center", **style}
        self.axes.text(x, y, label, **style)

    def circle(self, place: Sequence[float], radius: float, **style: Any) -> None:
        style = {"fc": "none", "ec": INK, "lw": 0.6, **style}
        self.axes.add_patch(Circle((place[0], place[1]), radius, **style))

    def box(self, x: float, y: float, w: float, h: float, label: str = "", **style: Any) -> None:
        style = {"fc": "#eceff1", "ec": STEEL, "lw": 0.7, "zorder": 1, **style}
        self.axes.add_patch(Rectangle((x, y), w, h, **style))
        if label:
            self.text(x + w / 2, y + h / 2, label, size=6.5, color=QUIET, zorder=6)

    def arc(self, place: Sequence[float], radius: float, a: float, b: float, **style: Any) -> None:
        """Draw an arc from angle a to angle b, deg."""
        style = {"color": LIMIT, "lw": 0.9, **style}
        self.axes.add_patch(
            Arc((place[0], place[1]), 2 * radius, 2 * radius, theta1=a, theta2=b, **style)
        )

    def dimension(
        self, a: Sequence[float], b: Sequence[float], off: float, label: str, back: float = 0.0
    ) -> None:
        """Draw a length from a to b beside them: `off` mm to their left; lines begin `back` off."""
        start, end = np.array(a, float), np.array(b, float)
        along = (end - start) / np.linalg.norm(end - start)
        across = np.array((-along[1], along[0]))
        p, q = start + off * across, end + off * across
        side = math.copysign(1.0, off)
        for at, to in ((start, p), (end, q)):
            self.line(at + side * back * across, to + side * 1.5 * self.scale * across, lw=0.4)
        style = {"arrowstyle": "<|-|>,head_width=0.12,head_length=0.3", "lw": 0.5, "shrinkA": 0,
                 "shrinkB": 0, "color": INK}  # fmt: skip
        self.axes.annotate("", tuple(p), tuple(q), arrowprops=style)
        angle = math.degrees(math.atan2(along[1], along[0]))
        angle -= 180 * round(angle / 180)
        place = (p + q) / 2 + side * 2.2 * self.scale * across
        self.text(place[0], place[1], label, rotation=angle, rotation_mode="anchor", size=7)

    def beam(self, a: Sequence[float], b: Sequence[float], z: float = 2.0) -> None:
        """Draw a beam with its holes from axis to axis."""
        points = 72 / 25.4 / self.scale
        draw_beam(self.axes, np.array(a), np.array(b), PITCH, points, (BEAM, INK, HOLE), z)

    def axis(self, place: Sequence[float], size: float = 6.0) -> None:
        """Mark an axis by a cross of thin lines."""
        x, y = place
        for dx, dy in ((size, 0.0), (0.0, size)):
            self.line((x - dx, y - dy), (x + dx, y + dy), lw=0.4, color=STOP, zorder=7)

    def scale_bar(self, x: float, y: float, length: float) -> None:
        """Draw a bar of so many real mm."""
        self.line((x, y), (x + length, y), lw=1.4, solid_capstyle="butt")
        for end in (x, x + length):
            self.line((end, y - self.scale), (end, y + self.scale), lw=0.8)
        label = f"{length:g} mm" if self.scale == 1 else f"{length:g} mm at the arm"
        label += f", {length / self.scale:.4g} mm on paper" if self.scale != 1 else ""
        self.text(
            x + length + 2 * self.scale, y, f"{label}   (1 : {self.scale:g})", ha="left", size=7
        )


def draw_links(arm: Arm) -> Drawing:
    """Draw the links side by side, to lay beams on: holes, axes, wheels, the marker."""
    joints = [joint for joint in arm.joints if joint.name != "base"]
    longest = max(max(10 * joint.link, link_of(joint.link).built) for joint in joints)
    pitch, left = 58.0, -34.0
    top, bottom = 34.0, -pitch * (len(joints) - 1) - 36
    draft = _Draft((left, bottom, max(longest + 30, 126.0 + left + 20), top))
    for k, joint in enumerate(joints):
        y = -pitch * k
        link = link_of(joint.link)
        is_last = joint is joints[-1]
        draft.text(left + 1, y + 27, f"{joint.name}'s link", ha="left", size=9, weight="bold")
        _draw_wheels(draft, (0.0, y), joint)
        draft.beam((0, y), (link.built, y))
        draft.axis((0, y))
        end = (10 * joint.link, y)
        draft.axis(end)
        draft.dimension((0, y), end, 17, f"{10 * joint.link:g} mm in the arm's file", back=5)
        draft.dimension(
            (0, y), (link.built, y), -13,
            f"{link.holes} holes, {link.pitches} x 8 = {link.built:g} mm", back=5,
        )  # fmt: skip
        draft.text(0, y - 24, f"{joint.name}'s axis", size=6.5, color=QUIET)
        if is_last:
            draft.circle(end, MARKER / 2, ec=TIP, lw=1.2, ls=(0, (3, 2)), zorder=8)
            draft.circle(end, RIM / 2, ec=QUIET, lw=0.4, ls=(0, (2, 2)), zorder=8)
            label = f"pen, and the red marker above it: {MARKER:g}, its rim {RIM:g}"
            draft.text(end[0], y - 24, label, size=6.5, color=TIP)
        else:
            draft.text(end[0], y - 24, f"{joints[k + 1].name}'s axis", size=6.5, color=QUIET)
    if draft.scale == 1:
        y = bottom + 5
        draft.line((left + 2, y), (left + 102, y), lw=1.2, solid_capstyle="butt")
        for end_x in (left + 2, left + 102):
            draft.line((end_x, y - 1.5), (end_x, y + 1.5), lw=0.8)
        draft.text(left + 104, y, "check: 100 mm   (1 : 1)", ha="left", size=7)
    else:
        draft.scale_bar(left + 2 * draft.scale, bottom + 4 * draft.scale, 100.0)
    return draft.drawing()


def _draw_wheels(draft: _Draft, place: Sequence[float], joint: Joint) -> None:
    """Draw the joint's wheel on its axis and the motor's beside it, or the motor's hub."""
    pairs = gear_pairs(joint.gear)
    if not pairs:
        draft.circle(place, 12, ec=STEEL, lw=0.9)  # the motor's hub, three holes across
        return
    pair = pairs[0]
    draft.circle(place, pair.wheel / 2, ec=STEEL, lw=0.9)
    beside = (place[0] - pair.distance, place[1])
    draft.circle(beside, pair.pinion / 2, ec=STEEL, lw=0.9)
    draft.axis(beside, 4)
    draft.text(beside[0], place[1] + pair.pinion / 2 + 4, f"{pair.pinion}", size=6.5, color=QUIET)
    draft.text(
        place[0] + 4, place[1] + pair.wheel / 2 + 2.5, f"{pair.wheel}", size=6.5, color=QUIET
    )


def draw_plan(arm: Arm) -> Drawing:
    """Draw what is seen from above: where the tip gets to, limits and stops, arm, camera, brick."""
    far = 10 * reach(arm)[1]
    x0, y0, x1, y1 = workspace(arm)
    edge = 1.1 * far + 8
    draft = _Draft((-edge, -1.14 * edge, edge, edge))
    _shade_workspace(draft, arm)
    if arm.chain == "planar":
        place = brick_place(arm)
        draft.box(*place, *BRICK, "EV3 brick", fc="#d9dde1")
    origin = (0.0, 0.0)
    turn = arm.joints[0]  # what turns about the upright axis
    if arm.chain == "planar":
        _draw_pose(draft, [(10 * x, 10 * y) for x, y in joint_positions(arm, _home(arm))], arm)
        q = [_between(turn, 0.66), _between(arm.joints[1], 0.64)]
        bent = [(10 * x, 10 * y) for x, y in joint_positions(arm, q)]
        _draw_pose(draft, bent, arm)
        _draw_range(draft, bent[1], 0.3 * far, arm.joints[1], math.degrees(q[0]))
        _draw_range(draft, origin, 0.62 * far, turn, 0.0)
        a, b, c = ((10 * x, 10 * y) for x, y in joint_positions(arm, _home(arm)))
        draft.dimension(a, b, -0.13 * far, f"{10 * turn.link:g}", back=6)
        draft.dimension(b, c, -0.13 * far, f"{10 * arm.joints[1].link:g}", back=6)
    else:
        tip = forward(arm, _home(arm))
        _draw_pose(draft, [origin, (10 * tip[0], 10 * tip[1])], arm)
        _draw_range(draft, origin, 0.62 * far, turn, 0.0)
    draft.circle(origin, far, ec=QUIET, lw=0.4, ls=(0, (4, 3)))
    draft.text(0.0, -far - 3.5 * draft.scale, f"reach {far:g} mm", size=7, color=QUIET)
    draft.axis(origin, 10)
    middle = ((x0 + x1) / 2, (y0 + y1) / 2)
    draft.line((middle[0] - 8, middle[1]), (middle[0] + 8, middle[1]), color=GOAL, lw=0.9)
    draft.line((middle[0], middle[1] - 8), (middle[0], middle[1] + 8), color=GOAL, lw=0.9)
    place = (middle[0] - 12, middle[1] - 5 * draft.scale)
    draft.text(*place, "the camera looks here", size=7, color=GOAL, ha="right")
    for axis, label in (((0.28 * far, 0.0), "x"), ((0.0, 0.28 * far), "y")):
        draft.axes.annotate(
            "", axis, origin, arrowprops={"arrowstyle": "-|>", "lw": 0.8, "color": STOP}, zorder=9
        )
        draft.text(axis[0] + 6, axis[1] + 6, label, size=8, color=STOP, zorder=9)
    left, bottom = draft.axes.get_xlim()[0], draft.axes.get_ylim()[0]
    draft.scale_bar(left + 3 * draft.scale, bottom + 4 * draft.scale, 100.0)
    return draft.drawing()


def draw_side(arm: Arm) -> Drawing:
    """Draw what is seen from the side; of a planar arm the heights are a proposal."""
    return _draw_planar_side(arm) if arm.chain == "planar" else _draw_spatial_side(arm)


def _draw_planar_side(arm: Arm) -> Drawing:
    first, second = (10 * joint.link for joint in arm.joints)
    tip = first + second
    low, body = 40.0, 27.0  # of the upper arm's beams above the table; of a motor that lies
    fore = low + body + 14  # of the forearm's beams
    draft = _Draft((-96, -24, tip + 48, fore + 90), height=140)
    right = draft.axes.get_xlim()[1]
    draft.box(-96, -4, right + 96, 4, fc="#d9d2c5", ec="none")
    draft.box(20, 0, right - 26, 0.9, fc="#ffffff", ec=STEEL, lw=0.5)
    draft.text(tip - 12, 5, "paper, flat on the table", size=7, color=QUIET, ha="right")
    draft.box(-84, 4, 98, body, "shoulder's motor, on its side in a\nframe, held down on a board")
    draft.box(-5, 4 + body, 10, low - 8 - body, fc=STEEL)
    draft.beam((0, low), (first, low))
    draft.box(first - 76, low + 4, 84, body, "elbow's motor,\nlying on the upper arm")
    draft.box(first - 5, low + 4 + body, 10, 6, fc=STEEL)
    draft.beam((first, fore), (tip, fore))
    if arm.pen:
        draft.box(tip - 50, fore + 4, 34, 22, "pen's motor", zorder=3)
        draft.line((tip - 16, fore + 15), (tip - 4, fore + 15), lw=2.2, color=STEEL, zorder=4)
        draft.box(tip - 7, fore + 17, 14, 3, fc=STEEL, zorder=5)
        draft.text(tip + 10, fore + 18, "collar", size=6.5, color=QUIET, ha="left")
    draft.box(tip - 4, 1.5, 8, fore + 44, fc="#fdfdfd", ec=INK, zorder=4.5)
    draft.line((tip - 4, 1.5), (tip, 0.6), (tip + 4, 1.5), zorder=5)
    top = MARKER_HEIGHT
    draft.line((tip - MARKER / 2, top), (tip + MARKER / 2, top), color=TIP, lw=3, zorder=6)
    draft.text(tip - 14, top, "red marker, flat", size=7, color=TIP, ha="right")
    for at, label in ((0.0, "shoulder's axis"), (first, "elbow's axis"), (tip, "pen")):
        draft.line((at, -6), (at, fore + 55), lw=0.4, ls=(0, (6, 2, 1, 2)), color=STOP, zorder=7)
        draft.text(at, fore + 60, label, size=7, color=STOP)
    draft.dimension((0, -4), (first, -4), -9, f"{first:g}", back=1)
    draft.dimension((first, -4), (tip, -4), -9, f"{second:g}", back=1)
    bow = fore + 26
    draft.line((-60, 4 + body), (-66, 60), (-46, bow), color=QUIET, lw=1.4)
    draft.line((first - 72, low + 26), (0.2 * first, fore), (-46, bow), color=QUIET, lw=1.4)
    draft.text(-62, bow + 12, "cables in a bow above\nthe shoulder's axis", size=7, color=QUIET)
    draft.scale_bar(-92, fore + 82, 50.0)
    return draft.drawing()


def _draw_spatial_side(arm: Arm) -> Drawing:
    base, shoulder, elbow = arm.joints
    height, far = 10 * base.link, 10 * reach(arm)[1]
    draft = _Draft((-0.75 * far, -0.12 * far, far + 30, height + far + 30), height=120)
    left, right = draft.axes.get_xlim()
    draft.box(left, -5, right - left, 5, fc="#d9d2c5", ec="none")
    draft.box(-36, 0, 72, 16, "turntable")
    draft.box(-26, 16, 52, height - 16, "shoulder's motor,\nupright")
    q = [0.0, *_home(arm)[1:]]
    places = [(10 * x, 10 * z) for x, _, z in joint_positions(arm, q)[1:]]
    _draw_pose(draft, places, arm)
    _draw_range(draft, places[0], 0.55 * far, shoulder, 0.0)
    _draw_range(draft, places[1], 0.32 * far, elbow, math.degrees(q[1]))
    draft.dimension((0, 0), (0, height), 42, f"{height:g}", back=20)
    draft.dimension(places[0], places[1], 0.16 * far, f"{10 * shoulder.link:g}", back=6)
    draft.dimension(places[1], places[2], 0.16 * far, f"{10 * elbow.link:g}", back=6)
    draft.text(places[-1][0] + 14, places[-1][1], "red ball", color=TIP, ha="left", size=7)
    draft.scale_bar(left + 4 * draft.scale, -0.12 * far + 3 * draft.scale, 100.0)
    return draft.drawing()


def draw_camera(arm: Arm) -> Drawing:
    """Draw the camera's place above the plane, for one that sees VIEW_ANGLE wide."""
    x0, _, x1, _ = workspace(arm)
    height, middle = camera_height(arm), (x0 + x1) / 2
    half, table = height * math.tan(VIEW_ANGLE / 2), -_marker_height(arm)
    box = (middle - 1.5 * half, table - 0.16 * height, middle + 1.5 * half, 1.2 * height)
    draft = _Draft(box, height=120)
    left, right = draft.axes.get_xlim()
    s = draft.scale
    draft.box(left, table - 1.5 * s, right - left, 1.5 * s, fc="#d9d2c5", ec="none")
    for side in (-1, 1):
        draft.line((middle, height), (middle + side * half, 0), color=GOAL, lw=0.7)
    draft.box(middle - 3 * s, height, 6 * s, 3 * s)
    draft.text(middle, height + 5 * s, "camera", size=7)
    post = middle + 1.1 * half
    draft.line((middle + 3 * s, height + 1.5 * s), (post, height + 1.5 * s), lw=2, color=STEEL)
    draft.line((post, height + 1.5 * s), (post, table), lw=2, color=STEEL)
    draft.line((x0, 0.6 * s), (x1, 0.6 * s), color=LIMIT, lw=2)
    under = -3 * s if table else 3 * s
    draft.text(middle, under, f"all that the marker gets to: {x1 - x0:.0f}", size=7, color=LIMIT)
    ruler = middle - 1.15 * half
    for bottom, top, label in ((0.0, height, f"{height:.0f}"), (table, 0.0, f"{-table:.0f}")):
        if top > bottom:
            draft.dimension((ruler, bottom), (ruler, top), 0, "")
            draft.text(ruler + 2 * s, (bottom + top) / 2, label, size=8, ha="left")
    draft.scale_bar(left + 2 * s, table - 0.11 * height, 200.0)
    return draft.drawing()


def _marker_height(arm: Arm) -> float:
    """Return the marker's height above the table, mm: a proposal; in space 0, for it varies."""
    return MARKER_HEIGHT if arm.chain == "planar" else 0.0


def camera_height(arm: Arm, angle: float = VIEW_ANGLE) -> float:
    """Return the height above the marker at which a camera sees all its places, mm, plus a tenth.

    Args:
        arm: the arm that is watched.
        angle: the camera's field of view, rad.
    """
    x0, y0, x1, y1 = workspace(arm)
    width = max(x1 - x0, (y1 - y0) * 4 / 3)
    return 1.1 * width / 2 / math.tan(angle / 2)


def workspace(arm: Arm, count: int = 60) -> tuple[float, float, float, float]:
    """Return the box that holds all places of the tip, seen from above: x0, y0, x1, y1, mm."""
    ranges = [np.linspace(joint.lower, joint.upper, count) for joint in arm.joints]
    if len(ranges) == 3:
        ranges[1:] = [grid[::6] for grid in ranges[1:]]
    grid = np.stack(np.meshgrid(*ranges), axis=-1).reshape(-1, len(ranges))
    tips = 10 * np.array([forward(arm, tuple(map(float, q)))[:2] for q in grid])
    (x0, y0), (x1, y1) = tips.min(axis=0), tips.max(axis=0)
    return float(x0), float(y0), float(x1), float(y1)


def _shade_workspace(draft: _Draft, arm: Arm) -> None:
    """Shade where the tip gets to; in space at the height of the shoulder."""
    for outline in _outlines(arm):
        draft.axes.fill(*outline.T, color=ROOM, lw=0, zorder=0)


def _outlines(arm: Arm, count: int = 181) -> list[np.ndarray]:
    """Return the outlines of all that the tip gets to, mm; together they cover it."""
    turn = arm.joints[0]
    if arm.chain == "planar":
        # On either side of the stretched arm each place is reached by one pose.
        bend = arm.joints[1]
        sides = [(max(bend.lower, 0.0), bend.upper), (bend.lower, min(bend.upper, 0.0))]
        return [
            np.array(
                [
                    [10 * x for x in forward(arm, q)]
                    for q in _around((turn.lower, turn.upper), side, count)
                ]
            )
            for side in sides
            if side[0] < side[1]
        ]
    far, outlines, begin = reach(arm)[1], [], None
    for radius in np.linspace(0.0, 1.001 * far, 1000):
        inside = _reached(arm, (float(radius), 0.0, turn.link))
        if inside and begin is None:
            begin = radius
        if not inside and begin is not None:
            ring = np.array(_around((turn.lower, turn.upper), (begin, radius), count))
            outlines.append(
                10 * ring[:, 1:] * np.column_stack([np.cos(ring[:, 0]), np.sin(ring[:, 0])])
            )
            begin = None
    return outlines


def _around(
    a: tuple[float, float], b: tuple[float, float], count: int
) -> list[tuple[float, float]]:
    """Return places along the edges of the rectangle of two ranges."""
    along, across = np.linspace(*a, count), np.linspace(*b, count)
    edges = (
        [(x, b[0]) for x in along],
        [(a[1], y) for y in across],
        [(x, b[1]) for x in along[::-1]],
        [(a[0], y) for y in across[::-1]],
    )
    return [(float(x), float(y)) for edge in edges for x, y in edge]


def _reached(arm: Arm, place: tuple[float, ...]) -> bool:
    try:
        return bool(branches(arm, place))
    except Unreachable:
        return False


def brick_place(arm: Arm) -> tuple[float, float]:
    """Return the left lower corner of the place of the brick, near a planar arm, mm.

    Nothing there is reached by the tip, nor passed by the upper arm.
    """
    turn = arm.joints[0]
    middle = (turn.lower + turn.upper) / 2 + math.pi
    size = np.array(BRICK)
    swept = 10 * turn.link + BRICK_ROOM
    for distance in itertools.count(60.0, 5.0):  # far enough away nothing is reached
        centre = distance * np.array((math.cos(middle), math.sin(middle)))
        grid = np.stack(np.meshgrid(*(np.linspace(-1, 1, 9),) * 2), axis=-1).reshape(-1, 2)
        places = centre + grid * (size / 2 + BRICK_ROOM)
        if min(np.linalg.norm(places, axis=1)) > swept and not any(
            _reached(arm, (float(x) / 10, float(y) / 10)) for x, y in places
        ):
            break
    x, y = centre - size / 2
    return float(x), float(y)


def _draw_pose(draft: _Draft, places: Sequence[Sequence[float]], arm: Arm) -> None:
    for k, (a, b) in enumerate(zip(places, places[1:], strict=False)):
        draft.beam(a, b, 2 + k)
    draft.circle(places[-1], MARKER / 2, ec=TIP, fc="#f3c3c7", lw=0.8, zorder=6)


def _draw_range(
    draft: _Draft, place: Sequence[float], radius: float, joint: Joint, zero: float
) -> None:
    """Draw a joint's limits as an arc, and its stops as rays; `zero` is where 0 is, deg."""
    lower, upper = (zero + math.degrees(angle) for angle in (joint.lower, joint.upper))
    draft.arc(place, radius, lower, upper)
    for angle, stop in ((joint.lower, joint.stop_lower), (joint.upper, joint.stop_upper)):
        end = _at(place, radius, zero + math.degrees(angle))
        draft.line(_at(place, 0.93 * radius, zero + math.degrees(angle)), end, color=LIMIT, lw=0.9)
        inner = _at(place, 0.82 * radius, zero + math.degrees(angle))
        draft.text(*inner, f"{math.degrees(angle):g}°", size=7, color=LIMIT, zorder=8)
        if stop is not None:
            direction = zero + math.degrees(stop)
            draft.line(
                _at(place, 0.9 * radius, direction), _at(place, 1.12 * radius, direction),
                color=STOP, lw=2.4, zorder=8,
            )  # fmt: skip
            at = _at(place, 1.3 * radius, direction)
            draft.text(*at, f"stop {math.degrees(stop):g}°", size=7, color=STOP, zorder=8)


def _at(place: Sequence[float], radius: float, angle: float) -> tuple[float, float]:
    """Return the place at a distance, in a direction in deg."""
    turn = math.radians(angle)
    return place[0] + radius * math.cos(turn), place[1] + radius * math.sin(turn)


def _home(arm: Arm) -> list[float]:
    return [joint.home for joint in arm.joints]


def _between(joint: Joint, share: float) -> float:
    return joint.lower + share * (joint.upper - joint.lower)
