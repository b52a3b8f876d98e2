"""The shapes of an SVG, each with its style, where it lies on the sheet, and what cuts it.

The tree is walked with a limit on all that is met: a `use` may refer to itself, or multiply.
Nothing but the tree is read: what it refers to elsewhere is named as left out.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from laptop.drawing.areas import widened
from laptop.drawing.artwork import BadArtwork
from laptop.drawing.curves import flatten
from laptop.drawing.svg_clips import clips_of
from laptop.drawing.svg_css import (
    GEOMETRY,
    INHERITED,
    MAX_TRIED,
    NOT_INHERITED,
    Style,
    StyleSheets,
    TooManyRules,
    style_of,
)
from laptop.drawing.svg_elements import CONTAINERS, DRAWABLE, href_of, is_for_us, layer_of, tag_of
from laptop.drawing.svg_letters import letters_of, words_of
from laptop.drawing.svg_paint import share
from laptop.drawing.svg_path import BadShape, Subpaths
from laptop.drawing.svg_place import Box, Shape, SvgPlace
from laptop.drawing.svg_shapes import NoShape, shape_pieces
from laptop.drawing.svg_skipped import SkippedElements
from laptop.drawing.svg_text import Layout, NoFont
from laptop.drawing.svg_units import (
    IDENTITY,
    UnreadableValue,
    about,
    compose,
    css_angle,
    length,
    numbers,
    origin,
    transform,
    view_box,
)
from laptop.drawing.xml_guard import MAX_DEPTH

MAX_SVG_BYTES = 20_000_000
"""Longest SVG that is read, unpacked, bytes; drawings for plotters have some megabytes."""

MAX_REPEATED = 20_000
"""Most elements that `use` elements repeat."""

MAX_READ = 3 * MAX_SVG_BYTES
"""Most bytes that are read, with all that `use` elements repeat."""

MAX_POINTS = 300_000
"""Most points of a drawing: at a point a millimetre a pen of 2 cm/s takes four hours."""


class SvgTree:
    """The elements of an SVG.

    name      of the file, for people
    left_out  what of it is not drawn
    layout    sets its texts
    areas     what clips and masks leave, by what they are and where
    """

    def __init__(self, root: ET.Element, name: str) -> None:
        self.name, self.root = name, root
        self.left_out = SkippedElements()
        self.layout = Layout()
        self._ids: dict[str, ET.Element] = {}
        for element in root.iter():
            if "id" in element.attrib:
                self._ids.setdefault(element.attrib["id"], element)
        self._sheets = StyleSheets(root, lambda element: tag_of(element) == "style")
        for kind, values in (
            ("import", self._sheets.imports),
            ("selector", self._sheets.unreadable),
        ):
            for value in values:
                self.left_out.add(kind, value)
        self.areas: dict[Any, BaseGeometry | None] = {}
        self.first_style: Style = {**INHERITED, **NOT_INHERITED}
        self._points = self._repeated = self._read = 0
        self._known: dict[tuple[ET.Element, tuple[float, float], float], Subpaths] = {}

    # ---- the walk

    def shapes(self, begin: Sequence[tuple[ET.Element, SvgPlace]]) -> Iterator[Shape]:
        """Yield what is in some elements, in the order of drawing.

        Raises:
            BadArtwork: It is beyond a limit.
        """
        waiting = list(reversed(begin))
        while waiting:
            element, outer = waiting.pop()
            self._repeated += bool(outer.uses)
            self._read += sum(map(len, element.attrib.values()))
            if self._repeated > MAX_REPEATED or self._read > MAX_READ:
                raise BadArtwork(
                    f"{self.name}: its <use> elements repeat more than {MAX_REPEATED} elements, or "
                    f"{MAX_READ // 1_000_000} MB; draw a part of it"
                )
            try:
                place = self.place(element, outer)
            except UnreadableValue as error:
                self.left_out.add("value", str(error))
                continue
            if place is None:
                continue
            inner, found = self.inside(element, place)
            yield from found
            waiting.extend(reversed(inner))

    def inside(
        self, element: ET.Element, place: SvgPlace
    ) -> tuple[list[tuple[ET.Element, SvgPlace]], list[Shape]]:
        """Return the elements to be visited in an element, and the one that itself shows."""
        tag = tag_of(element)
        if tag == "use":
            return self._use(element, place), []
        if tag == "svg" and element is not self.root:
            inner = self._viewport(element, place)
            return [(child, inner) for child in element] if inner else [], []
        if tag in CONTAINERS:
            children = list(element)
            if tag == "switch":
                children = [c for c in children if tag_of(c) in DRAWABLE and is_for_us(c)][:1]
            return [(child, place) for child in children], []
        return [], list(self._drawn(tag, element, place))

    def place(self, element: ET.Element, outer: SvgPlace) -> SvgPlace | None:
        """Return the place of an element; None where it is not shown.

        Raises:
            UnreadableValue: Nobody knows where.
        """
        tag = tag_of(element)
        if tag in ("script", "foreignObject"):
            self.left_out.add(tag)
            return None
        if tag not in (*DRAWABLE, "symbol", "clipPath", "mask") or not is_for_us(element):
            return None
        style = self.style(element, outer.style)
        layer = layer_of(element)
        if style["display"] == "none":
            self.left_out.add("layer" if layer else "hidden", layer or f"<{tag}>")
            return None
        font = self.font(style, outer)
        style["font-size"] = f"{font!r}px"
        place = replace(
            outer,
            style=style,
            font=font,
            opacity=outer.opacity * (share(style["opacity"]) or 0.0),
            layer=layer or outer.layer,
        )
        affine = compose(outer.affine, self._own_affine(element, place))
        if not affine[0, 0] * affine[1, 1] - affine[0, 1] * affine[1, 0]:
            return None  # squeezed to a line, or to a point, which is not shown
        place = replace(place, affine=affine)
        if tag in DRAWABLE and (style["clip-path"] != "none" or style["mask"] != "none"):
            place = replace(place, clips=outer.clips + clips_of(self, style, element, place))
        return place

    def font(self, style: Style, outer: SvgPlace) -> float:
        """Return the size of letters in an element, px."""
        text = style["font-size"]
        named = {"small": 13.0, "medium": 16.0, "large": 18.0, "x-large": 24.0, "x-small": 10.0}
        if text in named:
            return named[text]
        try:
            found = length(text, outer.font, None, outer.font)
        except UnreadableValue:
            return outer.font
        return outer.font if found is None or found < 0 else found

    def _own_affine(self, element: ET.Element, place: SvgPlace) -> np.ndarray:
        """Return an element's own transform; one that cannot be read is ignored."""
        style = place.style
        named = [style[key] for key in ("translate", "rotate", "scale", "transform")]
        if named == ["none"] * 4:
            return IDENTITY
        try:
            box: Box = (0.0, 0.0, *place.viewport)
            if style["transform-box"] in ("fill-box", "content-box", "stroke-box", "border-box"):
                box = self.extent(element, place) or box
            full = (box[2], box[3])
            affine = IDENTITY
            if named[0] != "none":
                affine = transform(f"translate({named[0].replace(' ', ',')})", full, place.font)
            if named[1] != "none":
                affine = compose(affine, transform(f"rotate({css_angle(named[1])!r})"))
            if named[2] != "none":
                affine = compose(affine, transform(f"scale({named[2].replace(' ', ',')})"))
            if named[3] != "none":
                affine = compose(affine, transform(named[3], full, place.font))
            return about(affine, origin(style["transform-origin"], box, place.font))
        except UnreadableValue as error:
            self.left_out.add("ignored", str(error))
            return IDENTITY

    def extent(self, element: ET.Element, place: SvgPlace) -> Box | None:
        """Return x, y, width and height of all that an element shows, in its own coordinates."""
        with self.muted():
            alone = replace(place, affine=IDENTITY, clips=(), uses=(*place.uses, element))
            if element in place.uses or len(alone.uses) > MAX_DEPTH:
                return None
            inner, found = self.inside(element, alone)
            found += self.shapes(inner)
        lines = [line for shape in found for line in shape.pieces]
        if not lines:
            return None
        hull = np.concatenate([piece.hull() for line in lines for piece in line])
        fine = max(float(np.ptp(hull, axis=0).max()) * 1e-4, 1e-9)
        points = np.concatenate([flatten(line, fine) for line in lines])
        least, most = points.min(axis=0), points.max(axis=0)
        return float(least[0]), float(least[1]), *map(float, most - least)  # type: ignore[return-value]

    @contextmanager
    def muted(self) -> Iterator[None]:
        """Record nothing as skipped while the block runs."""
        skipped, self.left_out = self.left_out, SkippedElements()
        try:
            yield
        finally:
            self.left_out = skipped

    def find(self, address: str) -> ET.Element | None:
        """Return the element that `#name` leads to."""
        return self._ids.get(address[1:]) if address.startswith("#") else None

    # ---- sizes

    def length(self, element: ET.Element, place: SvgPlace, key: str, full: float) -> float | None:
        """Return a length of an element, px; None where nothing that can be read says it."""
        text = place.style.get(key) if key in GEOMETRY else None
        text = element.get(key) if text is None else text
        if text is None or text.strip() in ("", "auto", "none"):
            return None
        try:
            return length(text, full, None, place.font)
        except UnreadableValue:
            self.left_out.add("ignored", text)
            return None

    def box(self, attributes: Mapping[str, str]) -> Box | None:
        """Return a view box, None where there is none that is one."""
        text = attributes.get("viewBox", "").strip()
        if text in ("", "none"):
            return None
        found = numbers(text[:200])
        if len(found) != 4 or not np.isfinite(found).all() or min(found[2:]) < 0:
            self.left_out.add("ignored", text)
            return None
        return found[0], found[1], found[2], found[3]

    def _viewport(
        self, element: ET.Element, place: SvgPlace, user: tuple[ET.Element, SvgPlace] | None = None
    ) -> SvgPlace | None:
        """Return the place inside a nested `svg`, or a `symbol`, to which a `use` may give a size.

        None where it has no size.
        """
        across, down = place.viewport
        x = self.length(element, place, "x", across) or 0.0
        y = self.length(element, place, "y", down) or 0.0
        size = []
        for key, full in (("width", across), ("height", down)):
            given = self.length(*user, key, full) if user else None
            given = self.length(element, place, key, full) if given is None else given
            size.append(full if given is None else given)
        if min(size) <= 0:
            return None
        box = self.box(element.attrib)
        if box is not None and min(box[2:]) <= 0:
            return None
        area: Box = (x, y, size[0], size[1])
        clips = place.clips
        if place.style["overflow"] not in ("visible", "auto"):
            corners = _corners(area) @ place.affine[:, :2].T + place.affine[:, 2]
            clips = (*clips, widened(shapely.Polygon(corners)))
        inner = np.array([[1.0, 0.0, x], [0.0, 1.0, y]])
        if box is not None:
            inner = view_box(box, area, element.get("preserveAspectRatio"))
        return replace(
            place,
            affine=compose(place.affine, inner),
            viewport=(size[0], size[1]) if box is None else (box[2], box[3]),
            clips=clips,
        )

    def _use(self, element: ET.Element, place: SvgPlace) -> list[tuple[ET.Element, SvgPlace]]:
        href = href_of(element)
        target = self.find(href)
        if target is None:
            self.left_out.add("use" if href.startswith("#") or not href else "outside", href)
            return []
        if element in place.uses or target is self.root or len(place.uses) > MAX_DEPTH:
            self.left_out.add("circle", href)
            return []
        x, y = (
            self.length(element, place, key, full) or 0.0
            for key, full in zip("xy", place.viewport, strict=True)
        )
        moved = np.array([[1.0, 0.0, x], [0.0, 1.0, y]])
        inner = replace(place, affine=compose(place.affine, moved), uses=(*place.uses, element))
        if tag_of(target) not in ("symbol", "svg"):
            return [(target, inner)]
        inner_place = self.place(target, inner)
        within = self._viewport(target, inner_place, (element, place)) if inner_place else None
        return [(child, within) for child in target] if within else []

    # ---- what is seen

    def _drawn(self, tag: str, element: ET.Element, place: SvgPlace) -> Iterator[Shape]:
        if tag == "image":
            href = href_of(element)
            self.left_out.add("image", "" if href.startswith("data:") else href)
            return
        if tag == "text":
            yield from self._texts(element, place)
            return
        if place.style["visibility"] in ("hidden", "collapse"):
            self.left_out.add("hidden", f"<{tag}>")
            return
        pieces = self._pieces(tag, element, place)
        if pieces:
            mapped = [[piece.mapped(place.affine) for piece in line] for line in pieces]
            yield Shape(tag, mapped, place)

    def _pieces(self, tag: str, element: ET.Element, place: SvgPlace) -> Subpaths:
        """Return an element's strokes in its own coordinates, cached for reuse."""
        key = (element, place.viewport, place.font)
        if key in self._known:
            return self._count(self._known[key])
        attributes: Mapping[str, str] = element.attrib
        css = place.style.get("d", "")
        if css.startswith("path("):
            attributes = {**attributes, "d": css[5:].rstrip(") ").strip("\"' ")}
        try:
            found = shape_pieces(
                tag,
                attributes,
                partial(self.length, element, place),
                place.viewport,
                MAX_POINTS - self._points,
            )
        except NoShape:
            found = []
        except BadShape as error:
            if error.is_too_long:
                raise self.too_many() from None
            self.left_out.add("broken", error.text)
            found = error.before
        if place.uses:
            self._known[key] = found
        return self._count(found)

    def _count(self, found: Subpaths) -> Subpaths:
        self._points += sum(len(piece.hull()) for line in found for piece in line)
        if self._points > MAX_POINTS:
            raise self.too_many()
        return found

    def _texts(self, element: ET.Element, place: SvgPlace) -> Iterator[Shape]:
        try:
            letters = letters_of(self, element, place)
            for shapes, style in self.layout.outlines(letters):
                pieces = [[piece.mapped(place.affine) for piece in line] for line in shapes]
                if self._count(pieces):
                    yield Shape("text", pieces, replace(place, style=style))
        except NoFont:
            self.left_out.add("text", words_of(element))

    def style(self, element: ET.Element, outer: Style) -> dict[str, str]:
        """Return the style of an element by that of the one around it.

        Raises:
            BadArtwork: There are too many rules.
        """
        try:
            return style_of(element, outer, self._sheets)
        except TooManyRules:
            raise BadArtwork(
                f"{self.name}: the rules of its style sheets would be tried more than {MAX_TRIED} "
                "times on its elements; save it as plain SVG in the program that made it"
            ) from None

    def too_many(self) -> BadArtwork:
        """Return the error of a drawing of too many points."""
        return BadArtwork(
            f"{self.name}: has more than {MAX_POINTS} points; simplify it first, "
            "or draw a part of it"
        )


def _corners(box: Box) -> np.ndarray:
    x, y, width, height = box
    return np.array([[x, y], [x + width, y], [x + width, y + height], [x, y + height]])
