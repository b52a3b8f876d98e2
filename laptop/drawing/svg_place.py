"""Types that the parts of the SVG reader share: places, shapes, and a view of the tree.

Clips, letters and paint are parts of a shape's place, and to tell them shapes and places of other
elements are needed.  They know the tree as what it does for them, `SvgElements`.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Iterator, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from shapely.geometry.base import BaseGeometry

from laptop.drawing.svg_css import Style
from laptop.drawing.svg_path import Subpaths
from laptop.drawing.svg_skipped import SkippedElements
from laptop.drawing.svg_units import FONT_SIZE

Box = tuple[float, float, float, float]


@dataclass(frozen=True)
class SvgPlace:
    """Properties that an element inherits from those around it.

    affine    from its coordinates to the sheet's, cm (2, 3)
    viewport  width and height that percentages are of, px
    font      size of letters, px
    opacity   of all around it together, 0 to 1
    layer     name of the layer
    clips     areas on the sheet that all of it must be inside of; None is one that is not known
    uses      the `use` elements and the clips that led here
    """

    affine: np.ndarray
    style: Style
    viewport: tuple[float, float]
    font: float = FONT_SIZE
    opacity: float = 1.0
    layer: str = ""
    clips: tuple[BaseGeometry | None, ...] = ()
    uses: tuple[ET.Element, ...] = ()


@dataclass(frozen=True)
class Shape:
    """A shape that may be visible: its lines in cm on the sheet."""

    tag: str
    pieces: Subpaths
    place: SvgPlace


class SvgElements(Protocol):
    """The elements of an SVG, as `svg_tree.SvgTree` has them.

    left_out     what of them is not drawn
    areas        what clips and masks leave, by what they are and where
    first_style  of the outermost element
    """

    left_out: SkippedElements
    areas: dict[Any, BaseGeometry | None]
    first_style: Style

    def find(self, address: str) -> ET.Element | None:
        """Return the element that `#name` leads to."""

    def style(self, element: ET.Element, outer: Style) -> dict[str, str]:
        """Return the style of an element by that of the one around it."""

    def font(self, style: Style, outer: SvgPlace) -> float:
        """Return the size of letters in an element, px."""

    def place(self, element: ET.Element, outer: SvgPlace) -> SvgPlace | None:
        """Return the place of an element; None where it is not shown."""

    def extent(self, element: ET.Element, place: SvgPlace) -> Box | None:
        """Return x, y, width and height of all that an element shows, in its own coordinates."""

    def shapes(self, begin: Sequence[tuple[ET.Element, SvgPlace]]) -> Iterator[Shape]:
        """Yield what is in some elements, in the order of drawing."""

    def muted(self) -> AbstractContextManager[None]:
        """Record nothing as skipped while the block runs."""
