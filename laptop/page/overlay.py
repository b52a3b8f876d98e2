"""The overlay of a camera's image, as SVG in its pixels.

It is drawn for every image in every browser: templates would take several times as long.
"""

from __future__ import annotations

import base64
from collections.abc import Sequence
from html import escape

from laptop.page.marker_text import marker_title
from laptop.page.snapshots import FrameSnapshot, MarkerSnapshot
from laptop.see.serve.pipeline import Point
from shared.messages import EFFECTOR, GOAL

MARKER_COLORS = {EFFECTOR: "#ffd60a", GOAL: "#40e0ff"}
HIGH_CONFIDENCE = 0.9
"""Confidence from which on it is not shown."""
OTHER_COLORS = ("#7dff8a", "#ff9df5", "#b9a5ff")


def marker_color(name: str, names: Sequence[str]) -> str:
    """Return the colour of a marker's overlay; `names`: of all markers in the image."""
    others = [other for other in names if other not in MARKER_COLORS]
    return MARKER_COLORS.get(name) or OTHER_COLORS[others.index(name) % len(OTHER_COLORS)]


def overlay(
    shown: FrameSnapshot,
    mask: str = "",
    windows: bool = True,
    drag: Sequence[Point] = (),
    box: bool = False,
) -> str:
    """Return the SVG that belongs to one image.

    Args:
        shown: the image, and what was found in it.
        mask: the marker whose pixels are shown, or "".
        windows: whether search windows are shown.
        drag: what the pointer draws just now, px.
        box: that is a rectangle, else a path.
    """
    k = shown.width / 640
    names = [mark.name for mark in shown.marks]
    parts = []
    if png := shown.masks.get(mask):
        data = base64.b64encode(png).decode()
        parts.append(
            f'<rect width="{shown.width}" height="{shown.height}" fill="#000" opacity=".55"/>'
            f'<image width="{shown.width}" height="{shown.height}" opacity=".95" '
            f'href="data:image/png;base64,{data}"/>'
        )
    parts.append(
        f'<g transform="translate(.5 .5)" style="--k:{k:g}" fill="none" stroke-linecap="round">'
    )
    if len(shown.trail) > 1:
        parts.append(_polyline(shown.trail, "#ffd60a", 1.6 * k, "opacity='.75'"))
    if shown.hint:
        parts.append(_hint(shown.hint, shown, k))
    if shown.aim:
        if shown.ahead:
            path = [shown.aim, *shown.ahead]
            dashes = f"stroke-dasharray='{5 * k:g} {5 * k:g}'"
            parts.append(_polyline(path, "#ff5ca8", 2 * k, dashes))
            parts += [_dot(u, v, 3 * k, "#ff5ca8") for u, v in shown.ahead]
        parts.append(_target(*shown.aim, k))
    for mark in shown.marks:
        color = marker_color(mark.name, names)
        if windows and mark.window:
            left, top, right, bottom = mark.window
            parts.append(
                f'<rect x="{left:.1f}" y="{top:.1f}" width="{right - left:.1f}" '
                f'height="{bottom - top:.1f}" stroke="{color}" stroke-width="{k:g}" '
                f'stroke-dasharray="{3 * k:g} {4 * k:g}" opacity=".8"/>'
            )
        parts.append(_marker(mark, color, shown, k))
    if len(drag) > 1:
        if box:
            (u0, v0), (u1, v1) = drag[0], drag[-1]
            parts.append(
                f'<rect x="{min(u0, u1):.1f}" y="{min(v0, v1):.1f}" width="{abs(u1 - u0):.1f}" '
                f'height="{abs(v1 - v0):.1f}" stroke="#fff" stroke-width="{1.5 * k:g}" '
                f'stroke-dasharray="{4 * k:g}"/>'
            )
        else:
            parts.append(_polyline(drag, "#ff5ca8", 2.5 * k))
    return "".join([*parts, "</g>"])


def _polyline(points: Sequence[Point], color: str, width: float, attributes: str = "") -> str:
    text = " ".join(f"{u:.1f},{v:.1f}" for u, v in points)
    return f'<polyline points="{text}" stroke="{color}" stroke-width="{width:g}" {attributes}/>'


def _dot(u: float, v: float, radius: float, color: str) -> str:
    return f'<circle cx="{u:.1f}" cy="{v:.1f}" r="{radius:g}" fill="{color}"/>'


def _target(u: float, v: float, k: float) -> str:
    """Return the cross at the goal, dark below and coloured above: to be seen on anything."""
    rings = "".join(
        f'<circle r="{9 * k:g}" stroke="{color}" stroke-width="{width * k:g}"/>'
        f'<path d="M{-15 * k:g},0H{15 * k:g}M0,{-15 * k:g}V{15 * k:g}" stroke="{color}" '
        f'stroke-width="{width * k:g}"/>'
        for color, width in (("#000a", 5), ("#ff5ca8", 2.4))
    )
    return f'<g data-aim="{u:.1f},{v:.1f}" transform="translate({u:.1f} {v:.1f})">{rings}</g>'


def _hint(hint: Sequence[Point], shown: FrameSnapshot, k: float) -> str:
    """Return the line on which the goal must be as another camera has it, or a ring about it."""
    u, v = (sum(values) / len(hint) for values in zip(*hint, strict=True))
    if len(hint) == 1:
        shape = f'<circle cx="{u:.1f}" cy="{v:.1f}" r="{12 * k:g}" '
        word, off = "the goal, if it is in the tip's plane", 16 * k
    else:
        (u0, v0), (u1, v1) = hint
        shape = f'<line x1="{u0:.1f}" y1="{v0:.1f}" x2="{u1:.1f}" y2="{v1:.1f}" '
        word, off = "the goal is on this line", 8 * k
    u, anchor = (u + off, "start") if u < shown.width / 2 else (u - off, "end")  # in the picture
    strokes = "".join(
        f'{shape}stroke="{color}" stroke-width="{width * k:g}" '
        f'stroke-dasharray="{8 * k:g} {5 * k:g}"/>'
        for color, width in (("#000a", 4.5), ("#ff5ca8", 2))
    )
    return (
        f'<g data-hint="{len(hint)}">{strokes}<text x="{u:.1f}" y="{v - off:.1f}" '
        f'text-anchor="{anchor}" font-weight="600" fill="#ff5ca8" stroke="#000c" '
        f'stroke-width="{3.2 * k:g}" paint-order="stroke" '
        f'font-family="Roboto, sans-serif">{word}</text></g>'
    )


def _marker(mark: MarkerSnapshot, color: str, shown: FrameSnapshot, k: float) -> str:
    """Return a ring round a marker and its label, "" where it was not seen."""
    if mark.u is None or mark.v is None:
        return ""
    radius = mark.radius or 10 * k
    shapes = "".join(
        f'<circle r="{radius:.1f}" stroke="{tone}" stroke-width="{width * k:g}"/>'
        f'<path d="M{-5 * k:g},0H{5 * k:g}M0,{-5 * k:g}V{5 * k:g}" stroke="{tone}" '
        f'stroke-width="{width * k:g}"/>'
        for tone, width in (("#000a", 4.5), (color, 2))
    )
    text = marker_title(mark.name)
    if mark.confidence is not None:
        if mark.confidence < HIGH_CONFIDENCE:
            text += f", {100 * mark.confidence:.0f} % sure"
        text += f", {mark.why}" if mark.why else ""
    if mark.place:
        text += f" at {mark.place}"
    size = 14 * k
    # On a small page the text is larger than that, see the style.
    right = mark.u + radius + 6 * k + 0.58 * 24 * k * len(text) < shown.width
    below = mark.v - radius - size < 0
    label = (
        f'<text x="{(radius + 5 * k) * (1 if right else -1):.1f}" '
        f'y="{(radius + size) if below else -radius * 0.6:.1f}" '
        f'text-anchor="{"start" if right else "end"}" font-weight="600" '
        f'fill="{color}" stroke="#000c" stroke-width="{3.2 * k:g}" paint-order="stroke" '
        f'font-family="Roboto, sans-serif">{escape(text)}</text>'
    )
    return (
        f'<g data-marker="{escape(mark.name)}" data-frame="{shown.index}" '
        f'transform="translate({mark.u:.2f} {mark.v:.2f})">{shapes}{label}</g>'
    )
