"""Drawings in ink or pencil: their lines on paper, followed along their middles.

The paper may be lit unevenly: what is darker than the paper around it is ink.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import cv2
import numpy as np

from laptop.drawing.pixel_walks import Pixels

PAPER_DIVISOR = 24
"""Divisor of the longer side: so far away the paper's brightness is sought."""
MIN_INK = 0.10
"""Least share of the paper's light that ink absorbs; a soft shadow's is less so near by."""
MIN_PEAK_INK = 0.2
"""Share of the light that a line absorbs at least somewhere."""
SPECK_DIVISOR = 30
"""Divisor of the longer side: what is shorter, all in all, is a speck."""
WIDTH_DIVISOR = 60
"""Divisor of the longer side: the greatest width of a line."""

DIRECTION_REACH, MAX_BEND_COSINE = 6, -0.7
"""Distance from a crossing at which a line's direction is taken, px; and cosine between two leaving
directions below which they are one line, as it bends by less than 45 degrees."""

MAX_SPUR = 2.5
"""Length, in half widths, up to which a side branch is a corner of a wide line."""

MAX_INK_SHARE, MIN_INK_SHARE = 0.2, 5e-4
"""Greatest and least share of a drawing's pixels that have ink."""
MIN_LINE_SHARE, MIN_CLEAN_SHARE = 0.75, 0.8
"""Least share of a drawing's ink that is in lines, and least share of clean paper in the rest."""

PixelPath = tuple[list[tuple[int, int]], tuple[int, int]]
"""Pixels (x, y) from node to node, and the numbers of these; both 0 for a loop."""


@dataclass(frozen=True)
class InkMask:
    """The ink of a picture: a mask (height, width), and half the width of its lines, px, there."""

    ink: np.ndarray
    half_width: np.ndarray


def ink_of(grey: np.ndarray) -> InkMask:
    """Return the ink mask of a picture (height, width) uint8."""
    side = max(grey.shape)
    darkness = _darkness(grey)
    threshold = max(_threshold(darkness), MIN_PEAK_INK)
    weak = (darkness > max(threshold / 2, MIN_INK)).astype(np.uint8)
    count, labels, stats, _ = cv2.connectedComponentsWithStats(weak, connectivity=8)
    is_ink = np.zeros(count, bool)
    is_ink[np.unique(labels[darkness > threshold])] = True
    spread = np.hypot(stats[:, cv2.CC_STAT_WIDTH], stats[:, cv2.CC_STAT_HEIGHT])
    is_ink &= spread > side / SPECK_DIVISOR
    is_ink[0] = False
    ink = is_ink[labels]
    return InkMask(ink, cv2.distanceTransform(ink.astype(np.uint8), cv2.DIST_L2, 5))


# A photograph of a drawing is light times reflectance, I = L R: a shadow lowers L by a factor and
# ink lowers R.  L changes slowly, and lines are thin.  So L is a morphological closing of I, which
# fills all that is dark and narrower than its disc, and the darkness is 1 - I / L, whatever the
# light.  N. Otsu's threshold (1979) then parts ink from paper where the variance between both
# classes is greatest; plain paper is left out before, for of two classes one of which has nearly
# all pixels, it would cut the larger one in two.  A fixed threshold on I would find ink in every
# shadow; an edge detector would draw each line twice, along both of its sides.
def _darkness(grey: np.ndarray) -> np.ndarray:
    """Return the share of the paper's light that is absorbed, 0 to 1."""
    reach = max(3, max(grey.shape) // PAPER_DIVISOR) | 1
    kernel = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (reach, reach))
    # What is brighter than its surroundings by noise alone is no paper: it is smoothed before.
    paper = cv2.morphologyEx(cv2.GaussianBlur(grey, (0, 0), 1.5), cv2.MORPH_CLOSE, kernel)
    paper = cv2.GaussianBlur(paper, (0, 0), reach / 3)
    fine = cv2.GaussianBlur(grey, (0, 0), max(grey.shape) / 1600).astype(np.float32)
    return np.clip(1 - fine / np.maximum(paper, 1), 0, 1)


def _threshold(darkness: np.ndarray) -> float:
    """Return Otsu's threshold (1979) between ink and paper, plain paper left out."""
    some = darkness[darkness > MIN_INK / 2]
    if not len(some):
        return 1.0
    levels = np.clip(some * 255, 0, 255).astype(np.uint8)
    return cv2.threshold(levels, 0, 255, cv2.THRESH_BINARY | cv2.THRESH_OTSU)[0] / 255


def centre_lines(grey: np.ndarray) -> list[np.ndarray]:
    """Return the centre lines of a drawing (height, width) uint8: each (n, 2) of x, y, px.

    They run from end to end, or round; where lines cross, each goes on as straight as it can.
    """
    from skimage.morphology import skeletonize  # it takes a second to load

    mask = ink_of(grey)
    thin = skeletonize(mask.ink)
    around = cv2.filter2D(
        thin.astype(np.uint8), -1, np.ones((3, 3)), borderType=cv2.BORDER_CONSTANT
    )
    is_node = thin & (around != 3)  # itself, and two neighbours
    count, nodes = cv2.connectedComponents(is_node.astype(np.uint8), connectivity=8)
    places = [np.argwhere(nodes == k)[:, ::-1].mean(axis=0) for k in range(1, count)]
    wide = [float(mask.half_width[nodes == k].max()) for k in range(1, count)]
    paths = _without_bridges(_paths(thin & ~is_node, nodes), places, wide)
    degree = np.bincount([node for _, ends in paths for node in ends if node], minlength=count)
    remaining = []
    for pixels, ends in paths:
        far = [node for node in ends if node and degree[node] > 1]
        is_spur = len(far) == 1 and len(pixels) < MAX_SPUR * wide[far[0] - 1]
        if not is_spur or ends[0] == ends[1]:  # else it is a corner of a wide line
            remaining.append((pixels, ends))
    return _joined(remaining, places)


def _without_bridges(
    paths: list[PixelPath], places: list[np.ndarray], wide: list[float]
) -> list[PixelPath]:
    """Return the paths with nodes merged that lie within a line's width: oblique crossings."""
    parent = list(range(len(places) + 1))

    def root(node: int) -> int:
        while parent[node] != node:
            node = parent[node]
        return node

    remaining = []
    for pixels, (a, b) in paths:
        if a and b and a != b and len(pixels) < wide[a - 1] + wide[b - 1] + 2:
            parent[root(b)] = root(a)
        else:
            remaining.append((pixels, (a, b)))
    clusters: dict[int, list[int]] = {}
    for node in range(1, len(parent)):
        clusters.setdefault(root(node), []).append(node)
    for node, others in clusters.items():
        places[node - 1] = np.mean([places[other - 1] for other in others], axis=0)
    return [(pixels, (root(a), root(b))) for pixels, (a, b) in remaining]


def _joined(paths: list[PixelPath], places: list[np.ndarray]) -> list[np.ndarray]:
    """Return paths joined to long lines, each continued at a node by the straightest path."""
    at: dict[int, list[tuple[int, int]]] = {}
    for k, (_, ends) in enumerate(paths):
        for side in (0, 1):
            if ends[side]:
                at.setdefault(ends[side], []).append((k, side))
    beyond: dict[tuple[int, int], tuple[int, int]] = {}
    for node, leaving in at.items():
        place = places[node - 1]
        leaves = {
            one: _direction(paths[one[0]][0][:: 1 if one[1] == 0 else -1], place) for one in leaving
        }
        pairs = sorted(
            (float(leaves[a] @ leaves[b]), a, b) for a, b in combinations(leaving, 2)
        )  # the straightest first: -1
        for bend, a, b in pairs:
            if (
                a not in beyond
                and b not in beyond
                and (bend < MAX_BEND_COSINE or len(leaving) == 2)
            ):
                beyond[a], beyond[b] = b, a
    found, used = [], [False] * len(paths)
    begins = [(k, side) for k in range(len(paths)) for side in (0, 1) if (k, side) not in beyond]
    for k, side in (*begins, *((k, 0) for k in range(len(paths)))):  # what is left is round
        if used[k]:
            continue
        first = paths[k][1][side]
        line: list[np.ndarray] = [places[first - 1]] if first else []
        while not used[k]:
            used[k] = True
            pixels, ends = paths[k]
            line += [np.array(pixel, float) for pixel in pixels[:: 1 if side == 0 else -1]]
            if ends[1 - side]:
                line.append(places[ends[1 - side] - 1])
            k, side = beyond.get((k, 1 - side), (k, side))
        if not first:
            line.append(line[0])
        found.append(np.array(line))
    return found


def _direction(pixels: Sequence[tuple[int, int]], place: np.ndarray) -> np.ndarray:
    """Return the direction in which a path leaves a node."""
    ahead = np.array(pixels[: 2 * DIRECTION_REACH][-DIRECTION_REACH:], float).mean(axis=0) - place
    return ahead / max(float(np.hypot(*ahead)), 1e-9)


def _paths(thin: np.ndarray, nodes: np.ndarray) -> list[PixelPath]:
    """Return paths of pixels (x, y) between nodes, and their node numbers; 0, 0 for a loop."""
    remaining = Pixels(thin)

    def node_at(x: int, y: int, other_than: int = 0) -> int:
        near = nodes[max(y - 1, 0) : y + 2, max(x - 1, 0) : x + 2]
        found = [int(n) for n in np.unique(near) if n and n != other_than]
        return found[0] if found else 0

    paths = []
    # Those at a node first, so that only round ones are begun elsewhere.
    every = sorted(remaining.left)
    at_nodes = [pixel for pixel in every if node_at(*pixel)]
    for start in (*at_nodes, *every):
        if start not in remaining.left:
            continue
        remaining.left.remove(start)
        first, path = node_at(*start), [start, *remaining.walk(start)]
        last = node_at(*path[-1], other_than=first if len(path) == 1 else 0)
        paths.append((path, (first, last)))
    return paths


def is_line_drawing(grey: np.ndarray) -> bool:
    """Return whether a picture is a line drawing: little ink, and clean paper elsewhere."""
    lines = ink_of(grey)
    share = lines.ink.mean()
    if not MIN_INK_SHARE <= share <= MAX_INK_SHARE:
        return False
    side = max(grey.shape)
    wide = (lines.half_width > side / WIDTH_DIVISOR / 2).astype(np.uint8)
    wide = cv2.dilate(wide, np.ones((3, 3), np.uint8), iterations=side // WIDTH_DIVISOR // 2)
    thin = 1 - (lines.ink & (wide > 0)).sum() / lines.ink.sum()
    darkness = _darkness(grey)
    around = cv2.dilate(lines.ink.astype(np.uint8), np.ones((5, 5), np.uint8)) == 0
    clean = (darkness[around] < MIN_INK / 2).mean()
    return bool(thin > MIN_LINE_SHARE and clean > MIN_CLEAN_SHARE)
