"""Kinds of markers that can be looked for, as people write them, and what finds each."""

from __future__ import annotations

from typing import NamedTuple


class MarkerKind(NamedTuple):
    """A kind of marker.

    name       as it is typed, and as it stands in files
    finder     module:function, a laptop.see.markers.tracker.MarkerFinder
    has_color  it is of one colour, which can be named and picked
    """

    name: str
    finder: str
    has_color: bool


MARKER_KINDS = (
    MarkerKind("disc", "laptop.see.markers.finders.disc:find_disc", True),
    MarkerKind("ball", "laptop.see.markers.finders.ball:find_ball", True),
    MarkerKind("aruco", "laptop.see.markers.finders.aruco:find_aruco", False),
)
"""The kinds: the one place where they are registered."""

COLOR_KINDS = tuple(kind.name for kind in MARKER_KINDS if kind.has_color)
"""Names of the kinds of one colour."""

KINDS = tuple(kind.name for kind in MARKER_KINDS)
"""Names of all kinds."""
