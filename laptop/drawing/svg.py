"""Reader of SVG: the visible as strokes of an Artwork, and the skipped in words.

An area is drawn by its outline.  Lines are cut where a clip ends what is seen of them.
"""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import chain

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from laptop.drawing.areas import NOTHING, TooTangled, area_of, cut_at, hatching, outlines, widened
from laptop.drawing.artwork import DOT, Artwork, BadArtwork, stroke_length
from laptop.drawing.curves import Piece, Straight, flatten
from laptop.drawing.svg_clips import filled
from laptop.drawing.svg_css import MARKERS
from laptop.drawing.svg_elements import tag_of
from laptop.drawing.svg_paint import Paint
from laptop.drawing.svg_place import Shape, SvgPlace
from laptop.drawing.svg_servers import paint_of
from laptop.drawing.svg_tree import MAX_POINTS, MAX_SVG_BYTES, SvgTree
from laptop.drawing.svg_units import PX, UnreadableValue, compose, length, view_box
from laptop.drawing.xml_guard import GZIP, is_svg, read_xml

MAX_COORDINATE = 1e5
"""Greatest coordinate of a drawing, cm: a kilometre away is a mistake."""

TOLERANCE = 3e-4
"""Greatest distance of a curve from its chords, as a share of the drawing's greater side."""

HATCH_ANGLE, HATCH_LINES = math.radians(45), 90
"""Direction of the hatching of areas, rad, and number of lines of a black area across the drawing's
greater side; lighter ones are farther apart."""

COVERING_OPACITY = 0.99
"""Opacity from which an area hides what is below it."""


@dataclass(frozen=True)
class _Stroke:
    """A stroke from pen down to pen up, before it is cut.

    area  by whose clipped outline it is drawn: lines that belong together, and whether they
          surround by even and odd; None for a line
    """

    pieces: list[Piece]
    layer: str
    colour: str
    has_round_ends: bool
    clips: tuple[BaseGeometry, ...] = ()
    area: tuple[list[list[Piece]], bool] | None = None


def read_svg(data: bytes, name: str = "drawing.svg", is_hatched: bool = False) -> Artwork:
    """Return the Artwork of an SVG, plain or compressed by gzip.

    Args:
        data: all of the file.
        name: of the file, for people.
        is_hatched: whether areas are hatched by their tone, besides their outlines.

    Raises:
        BadArtwork: It is no SVG, beyond a limit, or nothing in it is drawn.
    """
    data = _unpacked(data, name)
    root, instructions = read_xml(data, name)
    if tag_of(root) != "svg":
        shown = root.tag.rpartition("}")[2][:30]
        raise BadArtwork(
            f"{name}: is XML, but no SVG: it begins with <{shown}>; give a drawing saved as SVG"
        )
    reader = _SvgReader(root, name, is_hatched)
    for instruction in instructions:
        if instruction.startswith("xml-stylesheet"):
            reader.left_out.add("import", instruction)
    return reader.artwork()


def _unpacked(data: bytes, name: str) -> bytes:
    if data.startswith(GZIP):
        unpacker = zlib.decompressobj(wbits=31)
        try:
            data = unpacker.decompress(data, MAX_SVG_BYTES + 1)
        except zlib.error:
            raise BadArtwork(f"{name}: is packed (gzip) and damaged; copy it again") from None
        if not unpacker.eof and len(data) <= MAX_SVG_BYTES:
            raise BadArtwork(f"{name}: is packed (gzip) and cut off; copy it again")
        if data.startswith(GZIP) or not is_svg(data):
            raise BadArtwork(f"{name}: is packed (gzip), but holds no SVG; give a drawing")
    if len(data) > MAX_SVG_BYTES:
        raise BadArtwork(
            f"{name}: is longer than {MAX_SVG_BYTES // 1_000_000} MB, which is too much for a "
            "drawing of lines; simplify it, or draw a part"
        )
    return data


class _SvgReader:
    """Converter of a tree's shapes to strokes, in cm."""

    def __init__(self, root: ET.Element, name: str, is_hatched: bool) -> None:
        self.name, self.root, self._is_hatched = name, root, is_hatched
        self._tree = SvgTree(root, name)
        self.left_out = self._tree.left_out
        self._strokes: list[_Stroke] = []
        self._areas: list[tuple[Shape, Paint, tuple[BaseGeometry, ...]]] = []
        self.size: tuple[float, float] | None = None

    def artwork(self) -> Artwork:
        """Return the Artwork of the whole document.

        Raises:
            BadArtwork: See `read_svg`.
        """
        with np.errstate(over="ignore", invalid="ignore"):  # what is not finite is refused below
            for shape in self._tree.shapes([(self.root, self._sheet_place())]):
                self._draw(shape)
        self._name_fonts()
        if not self._strokes:
            raise self._empty()
        greater = self._greater()
        strokes: list[np.ndarray] = []
        layers: list[str] = []
        colours: list[str] = []
        count = 0
        for points, layer, colour in chain(
            self._all_lines(max(greater * TOLERANCE, 1e-9)), self._hatching(greater / HATCH_LINES)
        ):
            strokes.append(points)
            layers.append(layer)
            colours.append(colour)
            count += len(points)
            if count > MAX_POINTS:
                raise self._tree.too_many()
        if not strokes:
            if self.left_out.has("point"):
                raise BadArtwork(
                    f"{self.name}: no line in it has a length; give a drawing that has"
                )
            raise self._empty()
        if self.size is None:  # with the top at y = 0 until here
            least = min(stroke[:, 1].min() for stroke in strokes)
            strokes = [stroke - [0.0, min(least, 0.0)] for stroke in strokes]
        return Artwork(
            *(self.name, tuple(strokes), tuple(layers), self.size, self.left_out.sentences()),
            kind="SVG",
            colours=tuple(colours),
        )

    def _empty(self) -> BadArtwork:
        reasons = " ".join(self.left_out.sentences())
        return BadArtwork(
            f"{self.name}: nothing in it is drawn{': ' + reasons if reasons else ''}"
            f"{'' if reasons else '; it has no lines: give a drawing that has'}"
        )

    def _name_fonts(self) -> None:
        for asked, taken in self._tree.layout.instead:
            self.left_out.add("font", f"{asked}: {taken}")
        for letter in self._tree.layout.lacking:
            self.left_out.add("letter", letter)

    def _greater(self) -> float:
        """Return the greater side of all visible shapes, cm.

        Raises:
            BadArtwork: It is too far away.
        """
        least, most = np.full(2, np.inf), np.full(2, -np.inf)
        for stroke in self._strokes:
            hull = np.concatenate([piece.hull() for piece in stroke.pieces])
            low, high = hull.min(axis=0), hull.max(axis=0)
            if not np.isfinite([low, high]).all() or np.abs([low, high]).max() > MAX_COORDINATE:
                raise BadArtwork(
                    f"{self.name}: has a line more than {MAX_COORDINATE / 100:g} m away; "
                    "scale the drawing down"
                )
            for clip in stroke.clips:
                if not clip.is_empty:
                    low = np.maximum(low, clip.bounds[:2])
                    high = np.minimum(high, clip.bounds[2:])
            if (low <= high).all():
                least, most = np.minimum(least, low), np.maximum(most, high)
        return float(max(most - least)) if np.isfinite(least).all() else 0.0

    def _all_lines(self, tolerance: float) -> Iterator[tuple[np.ndarray, str, str]]:
        for stroke in self._strokes:
            for points in self._lines(stroke, tolerance):
                yield points, stroke.layer, stroke.colour

    def _hatching(self, distance: float) -> Iterator[tuple[np.ndarray, str, str]]:
        """Return hatching of visible areas, denser for darker ones, with its layers and colours."""
        areas = []
        for shape, _, clips in self._areas:
            try:
                area = filled(shape, "fill-rule")
                for clip in clips:
                    area = area.intersection(clip)
            except (TooTangled, shapely.GEOSException):
                self.left_out.add("tangled", f"<{shape.tag}>")
                area = NOTHING
            areas.append(area)
        known = shapely.STRtree(areas)
        for k, (shape, ink, _) in enumerate(self._areas):
            if ink.is_paper:
                continue
            over = [
                areas[j]
                for j in known.query(areas[k], "intersects")
                if j > k and self._areas[j][1].opacity > COVERING_OPACITY
            ]
            try:
                seen = areas[k].difference(shapely.union_all(over)) if over else areas[k]
                for line in hatching(seen, HATCH_ANGLE, distance / ink.tone):
                    yield line, shape.place.layer, ink.colour
            except (TooTangled, shapely.GEOSException):
                self.left_out.add("tangled", f"<{shape.tag}>")

    def _lines(self, stroke: _Stroke, tolerance: float) -> list[np.ndarray]:
        """Return the visible parts of a stroke, each (n, 2), cm."""
        points = flatten(stroke.pieces, tolerance)
        if len(points) == 1:
            if not stroke.has_round_ends:
                self.left_out.add("point")
                return []
            points = points + np.array([[-DOT / 2, 0.0], [DOT / 2, 0.0]])
        if stroke.area is not None:
            return self._outline(*stroke.area, stroke.clips, tolerance)
        lines = [points]
        for clip in stroke.clips:
            lines = [part for line in lines for part in cut_at(line, clip)]
        return lines

    def _outline(
        self,
        contours: list[list[Piece]],
        is_even_odd: bool,
        clips: tuple[BaseGeometry, ...],
        tolerance: float,
    ) -> list[np.ndarray]:
        """Return the outlines of the visible part of an area."""
        lines = [flatten(pieces, tolerance) for pieces in contours]
        lines = [points for points in lines if len(points) > 1]
        try:
            area = area_of(lines, is_even_odd)
        except (TooTangled, shapely.GEOSException):
            for clip in clips:
                lines = [part for line in lines for part in cut_at(line, clip)]
            return lines
        for clip in clips:
            area = area.intersection(clip)
        found = outlines(area)
        length = sum(map(stroke_length, lines))
        if len(found) == len(lines) and math.isclose(
            sum(map(stroke_length, found)), length, rel_tol=1e-9
        ):
            return lines  # all of them are seen: in their own order, and from their own begin
        return found

    # ---- the sheet

    def _sheet_place(self) -> SvgPlace:
        """Return the map from the root's coordinates to the sheet's; set `size`."""
        attributes = self.root.attrib
        box = self._tree.box(attributes)
        if box is not None and min(box[2:]) <= 0:
            self.left_out.add("ignored", attributes["viewBox"])
            box = None
        width, height = (self._side(attributes.get(key)) for key in ("width", "height"))
        if box is not None:  # what is not given follows from its shape
            if width is None:
                width = box[2] if height is None else height * box[2] / box[3]
            if height is None:
                height = width * box[3] / box[2]
        style = self._tree.first_style
        if width is None or height is None:
            affine = np.array([[PX, 0.0, 0.0], [0.0, -PX, 0.0]])
            return SvgPlace(affine, style, (width or 100.0, height or 100.0))
        if max(width, height) * PX > MAX_COORDINATE:
            raise BadArtwork(
                f"{self.name}: its sheet is {width * PX:.3g} x {height * PX:.3g} cm; it must have "
                f"a size below {MAX_COORDINATE / 100:g} m: set the size of the page"
            )
        self.size = (width * PX, height * PX)
        affine = np.array([[PX, 0.0, 0.0], [0.0, -PX, self.size[1]]])
        clips: tuple[BaseGeometry, ...] = (widened(shapely.box(0.0, 0.0, *self.size)),)
        if attributes.get("overflow") == "visible":
            clips = ()
        if box is None:
            return SvgPlace(affine, style, (width, height), clips=clips)
        fitted = view_box(box, (0, 0, width, height), attributes.get("preserveAspectRatio"))
        return SvgPlace(compose(affine, fitted), style, (box[2], box[3]), clips=clips)

    def _side(self, text: str | None) -> float | None:
        """Return a side of the sheet, px; None where it is not given, or given in per cent."""
        if text is None or text.strip() in ("", "auto") or text.strip().endswith("%"):
            return None
        try:
            found = length(text, 0.0, None)
        except UnreadableValue:
            found = None
        if found is None or found <= 0 or text.strip().endswith("ch"):
            self.left_out.add("ignored", text)
            return None
        return found

    # ---- what is drawn

    def _draw(self, shape: Shape) -> None:
        tag, place = shape.tag, shape.place
        style = place.style
        line, area = (paint_of(self._tree, key, place) for key in ("stroke", "fill"))
        if line and not self._is_wide(style["stroke-width"], place):
            line = None
        if tag == "line":
            area = None
        if self._is_hatched and area and None not in place.clips:
            self._areas.append((shape, area, tuple(c for c in place.clips if c is not None)))
        if all(ink is None or ink.is_paper for ink in (line, area)):
            self.left_out.add("white" if line or area else "unpainted", f"<{tag}>")
            return
        line, area = (None if ink is None or ink.is_paper else ink for ink in (line, area))
        if None in place.clips:
            self.left_out.add("clipped", f"<{tag}>")
            return
        clips = tuple(clip for clip in place.clips if clip is not None)
        if area and not self._is_hatched:
            self.left_out.add("area")
        if line and style["stroke-dasharray"] not in ("none", "", "0"):
            self.left_out.add("dashes")
        if any(style[key] != "none" for key in MARKERS) and tag != "text":
            self.left_out.add("markers")
        if line:
            has_round_ends = style["stroke-linecap"] in ("round", "square")
            for pieces in shape.pieces:
                self._strokes.append(
                    _Stroke(pieces, place.layer, line.colour, has_round_ends, clips)
                )
            return
        assert area is not None
        contours = [pieces for pieces in map(_closed, shape.pieces) if pieces]
        if not contours:
            self.left_out.add("unpainted", f"<{tag}>")
            return
        area_of = (contours, style["fill-rule"] == "evenodd")
        if (clips and not self._is_within(contours, clips)) or len(contours) > 1:
            both = [piece for pieces in contours for piece in pieces]
            self._strokes.append(_Stroke(both, place.layer, area.colour, False, clips, area_of))
            return
        self._strokes.append(_Stroke(contours[0], place.layer, area.colour, False))

    def _is_wide(self, text: str, place: SvgPlace) -> bool:
        """Return whether a stroke has a width at all."""
        across = float(np.hypot(*place.viewport)) / 2**0.5
        try:
            return (length(text, across, 1.0, place.font) or 0.0) > 0
        except UnreadableValue:
            return True  # as if it were absent: 1

    def _is_within(self, contours: list[list[Piece]], clips: tuple[BaseGeometry, ...]) -> bool:
        """Return whether the clips take nothing away, as is usual."""
        hull = np.concatenate([piece.hull() for pieces in contours for piece in pieces])
        if not np.isfinite(hull).all():
            return True  # which is refused later
        around = shapely.box(*hull.min(axis=0), *hull.max(axis=0))
        return all(clip.covers(around) for clip in clips)


def _closed(pieces: list[Piece]) -> list[Piece]:
    """Return an area's contour, closed by a straight line; empty where it has no area."""
    hull = np.concatenate([piece.hull() for piece in pieces])
    off = hull - hull[0]
    far = off[np.argmax(np.hypot(*off.T))]
    if np.abs(off[:, 0] * far[1] - off[:, 1] * far[0]).max(initial=0.0) <= 1e-9 * (far @ far):
        return []  # all of it in a line
    first, last = _end(pieces[0], 0.0), _end(pieces[-1], 1.0)
    if np.abs(first - last).max() <= 1e-9 * max(np.abs(far).max(), 1e-12):
        return pieces
    return [*pieces, Straight(np.array([last, first]))]


def _end(piece: Piece, t: float) -> np.ndarray:
    if isinstance(piece, Straight):
        return piece.points[0 if t == 0 else -1]
    return piece.at(np.array([t]))[0]
