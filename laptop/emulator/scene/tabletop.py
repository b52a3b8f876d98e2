"""All that stands still around an arm: table, paper, the brick with its cable, and clutter."""

from __future__ import annotations

import functools
import math
from typing import Any

import cv2
import numpy as np

from laptop.emulator.scene.board_items import board_items
from laptop.emulator.scene.items import SIDE_SHARE, Item, block, place_outline
from laptop.emulator.scene.marker_items import shown_markers
from laptop.emulator.scene.optics import circle, light_of, rectangle, similar_hues
from laptop.emulator.scene.painter import Painter
from laptop.emulator.scene.workcell import Workcell

BRICKS = ("red", "blue", "yellow", "green", "white", "black", "orange", "lime", "grey", "cyan")
"""Colours of the bricks on the table."""

STUD_RADIUS = 0.24
"""Radius of a brick's stud, cm."""

PAPER, EDGE = light_of("#efeee9"), light_of("#4b3a29")
"""Light (3,), B, G, R, of the paper, and of the dark edge beside paper and cable."""
WOOD, WALL = light_of("#a98358"), light_of("#8d9299")
"""Light (3,), B, G, R, of table and wall."""

CONTROLLER_AT = np.array([-0.85, -0.55])
"""Place of the brick itself, reaches."""

MAX_PLACE_TRIES = 200
"""Number of places that are tried for a brick until one is free."""

Block = tuple[list[Item], np.ndarray]
"""The items of a thing on the table, and its place (3,), cm."""


def paint_ground(cell: Workcell, painter: Painter) -> np.ndarray:
    """Paint all that stands still: float32 (height, width, 3), light."""
    constants, camera = cell.constants, painter.camera
    ground = _table(cell, painter).astype(np.float32)
    flat = [*_paper(cell.reach), *board_items(constants), *cell.static_items(camera)]
    painter.paint(ground, flat)
    blocks = _bricks(cell, np.random.default_rng([constants["seed"], 1]))
    if constants["clutter"]:
        blocks.append((_controller(cell.reach), np.append(CONTROLLER_AT * cell.reach, 0.0)))
    blocks += cell.fixtures()
    # The farthest first.
    blocks.sort(key=lambda block: -float(np.linalg.norm(block[1] - camera.position)))
    shadows = [i for items, _ in blocks for i in items if i.kind == "shadow"]
    rest = [i for items, _ in blocks for i in items if i.kind != "shadow"]
    if constants["clutter"]:
        rest = _cable(cell.reach) + rest
    if shadows and constants["shadow"]:
        rings = [ring for item in shadows for ring in item.rings]
        rest.insert(0, Item(rings, constants["shadow"], "shadow"))
    if rest:
        painter.paint(ground, rest)
    return ground


@functools.lru_cache(maxsize=4)
def _grain(seed: int) -> np.ndarray:
    """Return the logarithm (n, n) of how much lighter wood is here and there."""
    draw = np.random.default_rng([seed, 2])
    grain = draw.normal(size=(512, 512)).astype(np.float32)
    streaks = cv2.GaussianBlur(grain, (0, 0), 24, sigmaY=1.6, borderType=cv2.BORDER_REFLECT)
    blotches = cv2.GaussianBlur(grain, (0, 0), 30, borderType=cv2.BORDER_REFLECT)
    return np.asarray(0.10 * streaks / streaks.std() + 0.05 * blotches / blotches.std())


def _table(cell: Workcell, painter: Painter) -> np.ndarray:
    """Return the light of the table, where each pixel's ray meets it, and of the wall behind."""
    camera, rays = painter.camera, painter.rays
    grain = _grain(cell.constants["seed"])
    if not cell.constants["clutter"]:
        grain = np.zeros_like(grain)
    side = len(grain)
    ray = np.dstack([rays, np.ones(rays.shape[:2], np.float32)])
    ray = ray @ camera.rotation.astype(np.float32)
    depth = camera.position[2] / np.maximum(-ray[..., 2], 1e-3)
    x = camera.position[0] + depth * ray[..., 0]
    y = camera.position[1] + depth * ray[..., 1]
    scale = side / (8 * cell.reach)
    looked_up = cv2.remap(
        grain,
        (x * scale + side / 2).astype(np.float32),
        (y * scale + side / 2).astype(np.float32),
        cv2.INTER_LINEAR,
        borderMode=cv2.BORDER_REFLECT,
    )
    table = WOOD * np.exp(looked_up)[..., None]
    wall = ray[..., 2] > -0.02
    wall |= np.maximum(np.abs(x), np.abs(y)) > cell.table_half_side
    table[wall] = WALL
    return np.asarray(table)


def _paper(reach: float) -> list[Item]:
    corners = rectangle(-0.36 * reach, -0.78 * reach, 1.06 * reach, 1.22 * reach, 16)
    sheet = place_outline(corners, (0, 0), 0.02, 0.0)
    return [Item([sheet + (0.12, -0.15, 0)], EDGE), Item([sheet], PAPER)]


def _bricks(cell: Workcell, draw: np.random.Generator) -> list[Block]:
    """Return LEGO bricks beside the paper, of a marker's colour only the decoys."""
    r = cell.reach
    low, high = cell.clutter_area
    area = tuple(c * r for c in low), tuple(c * r for c in high)
    blocks: list[Block] = []
    places: list[np.ndarray] = []
    for colour in _brick_colours(cell.constants, draw):
        for _ in range(MAX_PLACE_TRIES):
            at = draw.uniform(*area)
            on_paper = -0.52 * r < at[0] < 1.18 * r and -0.9 * r < at[1] < 1.35 * r
            beside = at - CONTROLLER_AT * r
            on_controller = abs(beside[0]) < 7 and abs(beside[1]) < 9
            clear_of_others = all(np.linalg.norm(at - other) > 4.2 for other in places)
            if clear_of_others and not on_paper and not on_controller and not cell.keeps_clear(at):
                break
        places.append(at)
        across, along = int(draw.integers(1, 3)), int(draw.integers(2, 5))
        angle = float(draw.uniform(0, math.pi))
        blocks.append((_brick(at, angle, along, across, colour), np.append(at, 0.0)))
    return blocks


def _brick_colours(constants: dict[str, Any], draw: np.random.Generator) -> list[str]:
    markers = [constants[name] for name in shown_markers(constants)]
    if constants["marker"] == "aruco":
        markers = []
    plain = [word for word in BRICKS if not any(similar_hues(word, other) for other in markers)]
    colours = [plain[draw.integers(len(plain))] for _ in range(constants["clutter"])]
    decoys = constants["decoys"] if markers else 0
    return colours + [markers[k % len(markers)] for k in range(decoys)]


def _brick(at: np.ndarray, angle: float, along: int, across: int, colour: str) -> list[Item]:
    """Return the items of one LEGO brick.

    Args:
        at: its middle (2,), cm.
        angle: to which it is turned, rad.
        along: number of studs along it.
        across: number of studs across it.
        colour: a word of `optics.COLOURS`.
    """
    light = light_of(colour)
    w, d = 0.4 * along, 0.4 * across
    items = block(rectangle(-w, -d, w, d, 3), at, angle, 0.96, light)
    c, s = math.cos(angle), math.sin(angle)
    for i in range(along):
        for j in range(across):
            x, y = -w + 0.4 + 0.8 * i, -d + 0.4 + 0.8 * j
            place = at + (c * x - s * y, s * x + c * y)
            ring = circle(STUD_RADIUS, 14)
            foot, lid = (place_outline(ring, place, 0, z) for z in (0.96, 1.13))
            items += [Item([foot, lid], light * SIDE_SHARE, "hull"), Item([lid], light * 1.05)]
    return items


def _controller(reach: float) -> list[Item]:
    """Return the items of the EV3 brick, with screen and buttons."""
    at, angle, height = CONTROLLER_AT * reach, 0.25, 3.0
    items = block(rectangle(-3.6, -5.5, 3.6, 5.5, 3), at, angle, height, light_of("#c9cccd"))
    for outline, code in (
        (rectangle(-2.6, 0.6, 2.6, 4.4), "#5d6b58"),
        (rectangle(-2.8, -5.5, 2.8, -4.6), "#3c3f42"),
        (circle(1.9, 24) + (0, -2.0), "#6a6e72"),
        (rectangle(-0.7, -2.7, 0.7, -1.3), "#2e3033"),
    ):
        items.append(Item([place_outline(outline, at, angle, height)], light_of(code)))
    return items


def _cable(reach: float) -> list[Item]:
    """Return the items of the cable from the brick to the shoulder's motor, and its shadow."""
    share = np.linspace(0, 1, 40)[:, None]
    a, b = np.array([-0.75 * reach, -0.3 * reach]), np.array([-6.3, 0.0])
    path = a + share * (b - a)
    path = path + np.sin(share * 7) * (1 - share) * np.array([0.02 * reach, 0.09 * reach])
    along = np.gradient(path, axis=0)
    across = np.stack([-along[:, 1], along[:, 0]], axis=1)
    across = 0.25 * across / np.linalg.norm(across, axis=1, keepdims=True)
    outline = np.concatenate([path + across, (path - across)[::-1]])
    return [
        Item([np.c_[outline + (0.2, -0.2), np.zeros(80)]], EDGE),
        Item([np.c_[outline, np.full(80, 0.3)]], light_of("#26282b")),
    ]
