"""SVG becomes an Artwork: its shapes as strokes, and what is not drawn in words.

svgelements reads paths, shapes and transforms. The tree is walked here, with a limit on all that is
met: a `use` may refer to itself, or multiply, and what stands in masks and definitions is no line.
Nothing but the bytes is read: what they refer to elsewhere is named as left out.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
import zlib
from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import islice

import numpy as np

from laptop.drawing.artwork import Artwork, BadArtwork
from laptop.drawing.curves import Piece, flatten
from laptop.drawing.svg_leftovers import Leftovers
from laptop.drawing.svg_shapes import BadShape, NoShape, Subpaths, shape_pieces
from laptop.drawing.svg_style import (
    INITIAL,
    MARKERS,
    Style,
    StyleSheet,
    is_painted,
    is_white,
    style_of,
)
from laptop.drawing.svg_units import (
    PX,
    UnreadableValue,
    compose,
    length,
    numbers,
    transform,
    view_box,
)
from laptop.drawing.xml_guard import MAX_DEPTH, read_xml

MAX_SVG_BYTES = 20_000_000
"""Longest SVG that is read, unpacked; drawings for plotters have some megabytes."""

MAX_REPEATED = 20_000
"""Most elements that `use` elements repeat."""

MAX_READ = 3 * MAX_SVG_BYTES
"""Most bytes that are looked at, with all that `use` elements repeat."""

MAX_POINTS = 300_000
"""Most points of a drawing: at a point a millimetre a pen of 2 cm/s takes four hours."""

MAX_COORDINATE = 1e5
"""Where a drawing may be, cm: what is a kilometre away is a mistake."""

TOLERANCE = 3e-4
"""How far a curve may be from its chords, as a share of the drawing's greater side."""

DOT = 0.02
"""What is a dot, a line without length with round ends, becomes a dash of this length, cm."""

SVG = "{http://www.w3.org/2000/svg}"
INKSCAPE = "{http://www.inkscape.org/namespaces/inkscape}"
HREF = ("href", "{http://www.w3.org/1999/xlink}href")
GZIP = b"\x1f\x8b"

SHAPES = ("path", "rect", "circle", "ellipse", "line", "polyline", "polygon")
CONTAINERS = ("g", "a", "svg", "switch")
DRAWABLE = (*SHAPES, *CONTAINERS, "use", "text", "image")


@dataclass(frozen=True)
class _Place:
    """What an element takes from those around it.

    affine    from its coordinates to the sheet's, cm (2, 3)
    viewport  width and height that percentages are of, px
    layer     name of the layer
    clips     what all of it must be inside of: affine maps (2, 3) from the sheet to a unit square,
              or None for a clip of another form
    uses      the `use` elements that led here
    """

    affine: np.ndarray
    style: Style
    viewport: tuple[float, float]
    layer: str = ""
    clips: tuple[np.ndarray | None, ...] = ()
    uses: tuple[ET.Element, ...] = ()


@dataclass(frozen=True)
class _Stroke:
    pieces: list[Piece]
    layer: str
    has_round_ends: bool


def read_svg(data: bytes, name: str = "drawing.svg") -> Artwork:
    """The Artwork of an SVG, or of one packed by gzip.

    Args:
        data: all of the file.
        name: of the file, for people.

    Raises:
        BadArtwork: It is no SVG, beyond a limit, or nothing in it is drawn.
    """
    data = _unpacked(data, name)
    root, instructions = read_xml(data, name)
    if _tag(root) != "svg":
        shown = root.tag.rpartition("}")[2][:30]
        raise BadArtwork(
            f"{name}: is XML, but no SVG: it begins with <{shown}>; give a drawing saved as SVG"
        )
    reader = _SvgReader(root, name)
    for instruction in instructions:
        if instruction.startswith("xml-stylesheet"):
            reader.left_out.add("import", instruction)
    return reader.artwork()


def is_svg(data: bytes) -> bool:
    """Whether this begins as XML does, or packed XML."""
    if data.startswith(GZIP):
        return True
    for mark, encoding in ((b"\xff\xfe", "utf-16-le"), (b"\xfe\xff", "utf-16-be")):
        if data.startswith(mark):
            return data[2:200].decode(encoding, "replace").lstrip().startswith("<")
    return data.removeprefix(b"\xef\xbb\xbf").lstrip().startswith(b"<")


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


def _tag(element: ET.Element) -> str:
    """The name of an SVG element, "" for one of another kind."""
    tag = element.tag
    return tag.removeprefix(SVG) if tag.startswith(SVG) or "}" not in tag else ""


class _SvgReader:
    """Walks the tree once, and collects the strokes' pieces in cm."""

    def __init__(self, root: ET.Element, name: str) -> None:
        self.name = name
        self.root = root
        self.left_out = Leftovers()
        self._ids: dict[str, ET.Element] = {}
        for element in root.iter():
            if "id" in element.attrib:
                self._ids.setdefault(element.attrib["id"], element)
        texts = (element.text or "" for element in root.iter() if _tag(element) == "style")
        self._sheet = StyleSheet(texts)
        for kind, values in (("import", self._sheet.imports), ("selector", self._sheet.unread)):
            for value in values:
                self.left_out.add(kind, value)
        self._strokes: list[_Stroke] = []
        self._points = self._drawn = self._repeated = self._read = 0
        self._known: dict[tuple[ET.Element, tuple[float, float]], Subpaths] = {}
        self.size: tuple[float, float] | None = None

    def artwork(self) -> Artwork:
        """All that is drawn.

        Raises:
            BadArtwork: See `read_svg`.
        """
        with np.errstate(over="ignore", invalid="ignore"):  # what is not finite is refused below
            self._walk()
        if not self._strokes:
            reasons = " ".join(self.left_out.sentences())
            raise BadArtwork(
                f"{self.name}: nothing in it is drawn{': ' + reasons if reasons else ''}"
                f"{'' if reasons else '; it has no lines: give a drawing that has'}"
            )
        hulls = [piece.hull() for stroke in self._strokes for piece in stroke.pieces]
        every = np.concatenate(hulls)
        if not np.isfinite(every).all() or np.abs(every).max() > MAX_COORDINATE:
            raise BadArtwork(
                f"{self.name}: has a line more than {MAX_COORDINATE / 100:g} m away; "
                "scale the drawing down"
            )
        greater = float(np.ptp(every, axis=0).max())
        strokes, layers = [], []
        for stroke in self._strokes:
            points = flatten(stroke.pieces, max(greater * TOLERANCE, 1e-9))
            if len(points) == 1 and stroke.has_round_ends:
                points = points + np.array([[-DOT / 2, 0.0], [DOT / 2, 0.0]])
            if len(points) > 1:
                strokes.append(points)
                layers.append(stroke.layer)
                self._drawn += len(points)
                if self._drawn > MAX_POINTS:
                    raise self._too_many()
            else:
                self.left_out.add("point")
        if not strokes:
            raise BadArtwork(f"{self.name}: no line in it has a length; give a drawing that has")
        if self.size is None:  # with the top at y = 0 until here
            least = min(stroke[:, 1].min() for stroke in strokes)
            strokes = [stroke - [0.0, min(least, 0.0)] for stroke in strokes]
        return Artwork(
            *(self.name, tuple(strokes), tuple(layers), self.size, self.left_out.sentences())
        )

    def _too_many(self) -> BadArtwork:
        return BadArtwork(
            f"{self.name}: has more than {MAX_POINTS} points; simplify it first, "
            "or draw a part of it"
        )

    # ---- the walk

    def _walk(self) -> None:
        waiting = [(self.root, self._sheet_place())]
        while waiting:
            element, outer = waiting.pop()
            self._repeated += bool(outer.uses)
            self._read += sum(map(len, element.attrib.values()))
            if self._repeated > MAX_REPEATED or self._read > MAX_READ:
                raise BadArtwork(
                    f"{self.name}: its <use> elements repeat more than {MAX_REPEATED} elements, or "
                    f"{MAX_READ // 1_000_000} MB; draw a part of it"
                )
            waiting.extend(reversed(list(self._visit(element, outer))))

    def _visit(self, element: ET.Element, outer: _Place) -> Iterator[tuple[ET.Element, _Place]]:
        """Draw an element; what is to be visited next, with its place."""
        tag = _tag(element)
        if tag in ("script", "foreignObject"):
            self.left_out.add(tag)
            return
        if tag not in DRAWABLE:
            return
        attributes = element.attrib
        style = style_of(tag, attributes, outer.style, self._sheet)
        layer = self._layer(element)
        if style.get("display") == "none":
            self.left_out.add("layer" if layer else "hidden", layer or f"<{tag}>")
            return
        try:
            affine = outer.affine
            if "transform" in style and style["transform"] != "none":
                affine = compose(affine, transform(style["transform"]))
            own = (outer.viewport, layer or outer.layer, outer.clips, outer.uses)
            place = _Place(affine, style, *own)
            if "clip-path" in style or "mask" in style:
                place = replace(place, clips=outer.clips + self._clips(style, place))
            if tag in CONTAINERS:
                if tag == "svg" and element is not self.root:
                    place = self._viewport(attributes, place)
                children = list(element)
                if tag == "switch":
                    known = (child for child in children if _tag(child) in DRAWABLE)
                    children = [c for c in known if "requiredExtensions" not in c.attrib][:1]
                for child in children:
                    yield child, place
            elif tag == "use":
                yield from self._use(element, place)
            else:
                self._draw(tag, element, place)
        except UnreadableValue as error:
            self.left_out.add("value", str(error))

    def _layer(self, element: ET.Element) -> str:
        """The name of the layer that a group is, "" where it is none."""
        if element.attrib.get(INKSCAPE + "groupmode") != "layer":
            return ""
        return element.attrib.get(INKSCAPE + "label") or element.attrib.get("id") or "layer"

    def _sheet_place(self) -> _Place:
        """From the root's coordinates to the sheet's; sets `size`."""
        attributes = self.root.attrib
        box = self._box(attributes)
        try:
            # Of a width in per cent nobody knows what it is a part of
            given = [
                None if "%" in attributes.get(key, "") else length(attributes.get(key), 0.0, None)
                for key in ("width", "height")
            ]
        except UnreadableValue as error:
            raise BadArtwork(
                f"{self.name}: the size of its sheet, {str(error)[:30]!r}, is no length; "
                "set the size of the page in the program that made it"
            ) from None
        width, height = given
        if box is not None:  # what is not given follows from its shape
            if width is None:
                width = box[2] if height is None else height * box[2] / box[3]
            if height is None:
                height = width * box[3] / box[2]
        if width is None or height is None:
            affine = np.array([[PX, 0.0, 0.0], [0.0, -PX, 0.0]])
            return _Place(affine, INITIAL, (width or 100.0, height or 100.0))
        if not (0 < width * PX <= MAX_COORDINATE and 0 < height * PX <= MAX_COORDINATE):
            raise BadArtwork(
                f"{self.name}: its sheet is {width * PX:.3g} x {height * PX:.3g} cm; it must have "
                f"a size above 0 and below {MAX_COORDINATE / 100:g} m: set the size of the page"
            )
        self.size = (width * PX, height * PX)
        affine = np.array([[PX, 0.0, 0.0], [0.0, -PX, self.size[1]]])
        if box is None:
            return _Place(affine, INITIAL, (width, height))
        fitted = view_box(box, (0, 0, width, height), attributes.get("preserveAspectRatio"))
        return _Place(compose(affine, fitted), INITIAL, (box[2], box[3]))

    def _box(self, attributes: dict[str, str]) -> tuple[float, float, float, float] | None:
        text = attributes.get("viewBox")
        if text is None:
            return None
        found = numbers(text[:200])
        if len(found) != 4 or not np.isfinite(found).all() or min(found[2:]) <= 0:
            raise BadArtwork(
                f"{self.name}: its viewBox is {text[:40]!r}, which is no area; "
                "it must be x, y, width and height, the last two above 0"
            )
        return found[0], found[1], found[2], found[3]

    def _viewport(
        self, attributes: dict[str, str], place: _Place, use: dict[str, str] | None = None
    ) -> _Place:
        """The place inside a nested `svg`, or a `symbol` that a `use` may give a size."""
        across, down = place.viewport
        whole = {"x": across, "width": across, "y": down, "height": down}
        said: dict[str, str] = {
            **attributes,
            **{k: use[k] for k in ("width", "height") if use and k in use},
        }
        x, y = (length(said.get(key), whole[key]) or 0.0 for key in "xy")
        width, height = (length(said.get(k, "100%"), whole[k]) or 0.0 for k in ("width", "height"))
        box = self._box(attributes)
        if box is None or width <= 0 or height <= 0:
            inner = np.array([[1.0, 0.0, x], [0.0, 1.0, y]])
            return replace(place, affine=compose(place.affine, inner), viewport=(width, height))
        inner = view_box(box, (x, y, width, height), attributes.get("preserveAspectRatio"))
        return replace(place, affine=compose(place.affine, inner), viewport=(box[2], box[3]))

    def _use(self, element: ET.Element, place: _Place) -> Iterator[tuple[ET.Element, _Place]]:
        attributes = element.attrib
        href = next((attributes[key] for key in HREF if key in attributes), "").strip()
        target = self._ids.get(href[1:]) if href.startswith("#") else None
        if target is None:
            self.left_out.add("use" if href.startswith("#") or not href else "outside", href)
            return
        if element in place.uses or target is self.root or len(place.uses) > MAX_DEPTH:
            self.left_out.add("circle", href)
            return
        x, y = (length(attributes.get(k), w) for k, w in zip("xy", place.viewport, strict=True))
        moved = np.array([[1.0, 0.0, x], [0.0, 1.0, y]], float)
        inner = replace(place, affine=compose(place.affine, moved), uses=(*place.uses, element))
        if _tag(target) != "symbol":
            yield target, inner
            return
        style = style_of("symbol", target.attrib, inner.style, self._sheet)
        inner = self._viewport(target.attrib, replace(inner, style=style), attributes)
        for child in target:
            yield child, inner

    # ---- what is drawn

    def _draw(self, tag: str, element: ET.Element, place: _Place) -> None:
        style, attributes = place.style, element.attrib
        if style["visibility"] in ("hidden", "collapse"):
            self.left_out.add("hidden", f"<{tag}>")
            return
        if tag == "text":
            words = "".join(part[:100] for part in islice(element.itertext(), 10)).split()
            self.left_out.add("text", " ".join(words))
            return
        if tag == "image":
            href = next((attributes[key] for key in HREF if key in attributes), "")
            self.left_out.add("image", "" if href.startswith("data:") else href)
            return
        has_line, has_area = is_painted(style["stroke"]), is_painted(style["fill"])
        if not has_line and (not has_area or is_white(style["fill"])):
            self.left_out.add("white" if has_area else "unpainted", f"<{tag}>")
            return
        shapes = self._shapes(tag, element, place)
        mapped = [[piece.mapped(place.affine) for piece in pieces] for pieces in shapes]
        if not mapped:
            return
        if place.clips and not self._is_inside(mapped, place.clips):
            self.left_out.add("clipped", f"<{tag}>")
            return
        if has_area and tag != "line" and not is_white(style["fill"]):
            self.left_out.add("area")
        if has_line and style["stroke-dasharray"] not in ("none", "", "0"):
            self.left_out.add("dashes")
        if any(style[key] != "none" for key in MARKERS):
            self.left_out.add("markers")
        has_round_ends = has_line and style["stroke-linecap"] in ("round", "square")
        for pieces in mapped:
            self._points += sum(len(piece.hull()) for piece in pieces)
            self._strokes.append(_Stroke(pieces, place.layer, has_round_ends))

    def _shapes(self, tag: str, element: ET.Element, place: _Place) -> Subpaths:
        """An element's strokes in its own coordinates; one that is used again is read once."""
        key = (element, place.viewport)
        if key in self._known:
            return self._known[key]
        try:
            found = shape_pieces(tag, element.attrib, place.viewport, MAX_POINTS - self._points)
        except NoShape:
            found = []
        except BadShape as error:
            if error.is_too_long:
                raise self._too_many() from None
            self.left_out.add("broken", error.text)
            found = error.before
        if place.uses:
            self._known[key] = found
        return found

    def _clips(self, style: Style, place: _Place) -> tuple[np.ndarray | None, ...]:
        """What an element is clipped by besides what is around it."""
        found: list[np.ndarray | None] = []
        for key in ("clip-path", "mask"):
            if style.get(key, "none") == "none":
                continue
            target = self._ids.get(style[key].strip().removeprefix("url(").strip("\"'#) "))
            if target is None and style[key].startswith("url("):
                continue  # as if it were not said (SVG 1.1, section 14.3.5: an error)
            found.append(self._rectangle(target, place) if key == "clip-path" else None)
        return tuple(found)

    def _rectangle(self, clip: ET.Element | None, place: _Place) -> np.ndarray | None:
        """From the sheet to the unit square that a clip of one plain rectangle is, or None."""
        if clip is None or _tag(clip) != "clipPath" or len(clip) != 1:
            return None
        (rect,) = clip
        if (
            _tag(rect) != "rect"
            or clip.attrib.get("clipPathUnits", "userSpaceOnUse") != "userSpaceOnUse"
            or {"clip-path", "style", "rx", "ry", "class"} & {*rect.attrib, *clip.attrib}
        ):
            return None
        affine = place.affine
        for element in (clip, rect):
            affine = compose(affine, transform(element.attrib.get("transform", "")))
        x, width = (length(rect.attrib.get(k), place.viewport[0]) for k in ("x", "width"))
        y, height = (length(rect.attrib.get(k), place.viewport[1]) for k in ("y", "height"))
        affine = compose(affine, np.array([[width, 0.0, x], [0.0, height, y]], float))
        try:
            inverse = np.linalg.inv(affine[:, :2])
        except np.linalg.LinAlgError:
            return None
        return np.column_stack([inverse, -inverse @ affine[:, 2]])

    def _is_inside(self, shapes: list[list[Piece]], clips: tuple[np.ndarray | None, ...]) -> bool:
        """Whether no clip takes anything away."""
        points = np.concatenate([piece.hull() for pieces in shapes for piece in pieces])
        for clip in clips:
            if clip is None:
                return False
            inside = points @ clip[:, :2].T + clip[:, 2]
            if inside.min() < -1e-6 or inside.max() > 1 + 1e-6:
                return False
        return True
