"""Convex bodies in space, and the order in which they hide one another.

A body is painted as its hull and, on that, the faces that a camera can see.  As no two bodies are
inside one another, to paint them one after the other is exact if each comes after all that it can
hide; a plane between two bodies tells which that is: the one on the camera's side.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from laptop.emulator.scene.items import SIDE_SHARE, Item
from laptop.emulator.scene.optics import LAMP, MIN_DEPTH, Pinhole, light_of, rectangle

BLACK = light_of("#26282b")
"""Light (3,), B, G, R, of rods, and of bodies seen from within."""


class Face(NamedTuple):
    """Outlines (k, n, 3) in a plane of a body's surface, its normal (3,), and their light (3,)."""

    rings: np.ndarray
    normal: np.ndarray
    light: np.ndarray


class ConvexBody(NamedTuple):
    """A body in its own frame, cm.

    points         (n, 3), whose hull it is
    light          of what is not a face, None if there is no such thing
    faces          what lies on another comes after it
    centre, half   of the box that it fills
    """

    points: np.ndarray
    light: np.ndarray | None
    faces: Sequence[Face]
    centre: np.ndarray
    half: np.ndarray


class Solid(NamedTuple):
    """A body in the world: its items, in the order of painting, and its bounding box.

    items      the first is its hull, or a ball
    centre     (3,), cm
    axes       (3, 3), of the box, in rows
    half       (3,), cm: from the centre to the box's sides
    radius     by which the box is rounded on top of that, cm
    """

    items: list[Item]
    centre: np.ndarray
    axes: np.ndarray
    half: np.ndarray
    radius: float = 0.0


Mark = tuple[Sequence[np.ndarray], Any]
"""Mark on a face: outlines, each (n, 2), cm, and their light."""


def prism(
    outline: np.ndarray,
    across: tuple[float, float],
    light: np.ndarray,
    up: str = "y",
    marks: Sequence[Mark] = (),
) -> ConvexBody:
    """Return a body with two parallel faces of the same outline.

    Args:
        outline: convex, (n, 2), counter-clockwise, cm.
        across: from where to where it goes along the axis `up`, cm.
        light: (3,).
        up: "y": the outline is in x and z; "z": it is in x and y.
        marks: on both faces.
    """

    def placed(flat: np.ndarray, height: float) -> np.ndarray:
        x, other = flat.T
        third = np.full(len(flat), height)
        return np.stack([x, third, other] if up == "y" else [x, other, third], axis=1)

    low, high = (placed(outline, height) for height in across)
    sides = _straights(outline)
    faces = []
    for begin, end in sides:
        edge = outline[end % len(outline)] - outline[begin]
        normal = placed(np.array([[edge[1], -edge[0]]]) / np.hypot(*edge), 0.0)[0]
        along = np.arange(begin, end + 1) % len(outline)
        faces.append(Face(np.concatenate([low[along], high[along][::-1]])[None], normal, light))
    for height, sign in zip(across, (-1.0, 1.0)):
        normal = sign * placed(np.zeros((1, 2)), 1.0)[0]
        for rings, tone in (([outline], light), *marks):
            faces.append(Face(np.array([placed(ring, height) for ring in rings]), normal, tone))
    points = np.concatenate([low, high])
    least, most = points.min(axis=0), points.max(axis=0)
    straight = sum(end - begin for begin, end in sides) == len(outline)
    rest = None if straight else light * SIDE_SHARE
    return ConvexBody(points, rest, faces, (least + most) / 2, (most - least) / 2)


def _straights(outline: np.ndarray) -> list[tuple[int, int]]:
    """Return the first and last indices of an outline's straight sides of several edges."""
    steps = np.roll(outline, -1, axis=0) - outline
    before = np.roll(steps, 1, axis=0)
    bent = np.abs(before[:, 0] * steps[:, 1] - before[:, 1] * steps[:, 0])
    limit = 1e-6 * np.hypot(*steps.T) * np.hypot(*before.T)
    corners = np.flatnonzero(bent > limit).tolist()
    ends = [*corners[1:], corners[0] + len(outline)]
    return [(a, b) for a, b in zip(corners, ends) if b - a > 1]


def box(
    x: tuple[float, float], y: tuple[float, float], z: tuple[float, float], light: np.ndarray
) -> ConvexBody:
    """Return a box between two coordinates along each of its axes, cm."""
    return prism(rectangle(x[0], y[0], x[1], y[1], 3), z, light, "z")


def ball(item: Item) -> Solid:
    """Return the body of a ball's item."""
    assert item.ball is not None
    centre, radius = item.ball
    return Solid([item], centre, np.eye(3), np.zeros(3), radius)


def solid(part: ConvexBody, eye: np.ndarray, axes: np.ndarray, origin: np.ndarray) -> Solid:
    """Return a part in the world, as a camera at `eye` (3,) sees it.

    Args:
        part: in its own frame.
        eye: place of the camera, cm.
        axes: (3, 3), its own in rows.
        origin: (3,), cm.
    """
    points, eye_in_body, lamp = part.points @ axes + origin, axes @ (eye - origin), axes @ LAMP
    faces = [face for face in part.faces if (eye_in_body - face.rings[0, 0]) @ face.normal > 0]
    # What a box shows are faces: the first lies under the others, so that no seam is left open.
    # From within it nothing is seen.
    lights = [face.light * _lit(float(face.normal @ lamp)) for face in faces]
    items = [Item(list(face.rings @ axes + origin), tone) for face, tone in zip(faces, lights)]
    if part.light is None and items:
        items[0] = Item([points], lights[0], "hull")
    else:
        items.insert(0, Item([points], part.light if items else BLACK, "hull"))
    return Solid(items, part.centre @ axes + origin, axes, part.half)


def _lit(towards: float) -> float:
    """Return the share of its light that a face shows, by its cosine to the lamp; 1 if it is up."""
    return 0.42 + 0.58 * max(0.0, towards) / float(LAMP[2])


def in_order(solids: Sequence[Solid], camera: Pinhole) -> list[Solid]:
    """Sort solids, each after all that it can hide from the camera."""
    eye = camera.position
    one, other = _overlapping(solids, camera)
    centres = np.array([s.centre for s in solids])
    axes = np.array([s.axes for s in solids])
    half = np.array([s.half for s in solids])
    radius = np.array([s.radius for s in solids])

    def nearest(a: np.ndarray, b: np.ndarray) -> np.ndarray:
        """Return the points of the boxes a nearest to the centres of b."""
        off = np.einsum("pij,pj->pi", axes[a], centres[b] - centres[a])
        return np.asarray(
            centres[a] + np.einsum("pi,pij->pj", np.clip(off, -half[a], half[a]), axes[a])
        )

    # Normals of planes that may part two boxes: those of their sides, those along two of their
    # edges, and those across the shortest way from one to the other.
    edges = np.cross(axes[one][:, :, None], axes[other][:, None]).reshape(-1, 9, 3)
    steps = [nearest(one, other) - centres[other], nearest(other, one) - centres[one]]
    normals = np.concatenate([axes[one], axes[other], edges, np.stack(steps, axis=1)], axis=1)
    length = np.linalg.norm(normals, axis=2)
    normals = normals / np.maximum(length, 1e-9)[..., None]
    distance = np.einsum("pki,pi->pk", normals, centres[other] - centres[one])
    normals = normals * np.where(distance < 0, -1.0, 1.0)[..., None]

    def extent(which: np.ndarray) -> np.ndarray:
        along = np.abs(np.einsum("pki,pji->pkj", normals, axes[which]))
        return np.asarray(np.einsum("pkj,pj->pk", along, half[which]) + radius[which][:, None])

    upper = np.einsum("pki,pi->pk", normals, centres[one]) + extent(one)
    lower = np.einsum("pki,pi->pk", normals, centres[other]) - extent(other)
    best = np.where(length > 1e-6, lower - upper, -np.inf).argmax(axis=1)
    pairs = np.arange(len(one))
    seen = normals[pairs, best] @ eye
    upper, lower = upper[pairs, best], lower[pairs, best]
    # Where two overlap a little, as at a joint, the middle decides.
    middle = (upper + lower) / 2
    hides = np.zeros((len(solids), len(solids)), bool)
    hides[other, one] = seen > np.maximum(lower, middle)
    hides[one, other] = seen < np.minimum(upper, middle)
    left = np.argsort(-np.linalg.norm(centres - eye, axis=1)).tolist()
    order = []
    while left:
        # In a ring of such that hide one another, the farthest.
        now = next((k for k in left if not hides[k, left].any()), left[0])
        left.remove(now)
        order.append(solids[now])
    return order


def _overlapping(solids: Sequence[Solid], camera: Pinhole) -> tuple[np.ndarray, np.ndarray]:
    """Return the pairs (indices) that overlap in the picture in each of eight directions."""
    bodies = [np.concatenate(s.items[0].rings) for s in solids]
    firsts = np.cumsum([0, *map(len, bodies[:-1])])
    x, y, z = camera.seen(np.concatenate(bodies)).T
    places = np.stack([x, y], axis=1) / np.maximum(z, MIN_DEPTH)[:, None]
    angles = np.arange(8) * (math.pi / 8)
    along = places @ np.stack([np.cos(angles), np.sin(angles)])
    low = np.minimum.reduceat(along, firsts)
    high = np.maximum.reduceat(along, firsts)
    one, other = np.triu_indices(len(solids), 1)
    met = ((low[one] < high[other]) & (low[other] < high[one])).all(axis=1)
    return one[met], other[met]
