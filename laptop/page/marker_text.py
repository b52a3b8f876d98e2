"""Names and descriptions of markers, for people."""

from __future__ import annotations

from laptop.see.markers.markers import NAMED_COLORS, Marker
from shared.messages import EFFECTOR, GOAL

MARKER_TITLES = {EFFECTOR: "tip's marker", GOAL: "goal marker"}
"""Names for people of the markers that the arm knows."""


def marker_title(name: str) -> str:
    """Return what a marker is called, for people."""
    return MARKER_TITLES.get(name, name)


def describe_marker(marker: Marker) -> str:
    """Return a marker's description for people, its colour by the nearest named one."""
    if marker.color is None:
        return str(marker)
    hue = marker.color.hue
    nearest = min(NAMED_COLORS, key=lambda name: _hue_distance(NAMED_COLORS[name].hue, hue))
    return f"{nearest} {marker.kind}"


def _hue_distance(one: float, other: float) -> float:
    """Return the distance of two hues, degrees."""
    return abs((one - other + 180) % 360 - 180)
