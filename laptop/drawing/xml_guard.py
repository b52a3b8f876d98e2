"""XML from strangers: read into a tree within bounds, or refused in one sentence.

Expat reads, and opens nothing: no DTD, no other file, no address. Of entities only short names for
plain text are read, as Illustrator declares them. What a file may have is bounded while it is read,
not afterwards.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from xml.parsers import expat

from laptop.drawing.artwork import BadArtwork

GZIP = b"\x1f\x8b"
"""First bytes of data compressed by gzip."""

MAX_DEPTH = 200
"""Greatest depth of nested elements; editors nest some ten."""

MAX_ELEMENTS = 100_000
"""Most elements of a file."""

MAX_TEXT = 1_000_000
"""Most characters kept between tags, all together: style sheets and texts, which are short."""

MAX_ENTITIES, LONGEST_ENTITY = 50, 200
"""Greatest number of entities of a file, and of characters that one of them stands for."""

MAX_ATTRIBUTES = 60_000_000
"""Most characters of all attributes together, with what entities stand for."""

MAX_DEFAULTS = 500
"""Most characters of default attributes that a file may declare."""

LONGEST_EMBEDDED = 100
"""Number of characters that are kept of a picture embedded as text."""


def is_svg(data: bytes) -> bool:
    """Return whether data begins as XML does, plain or compressed."""
    if data.startswith(GZIP):
        return True
    for mark, encoding in ((b"\xff\xfe", "utf-16-le"), (b"\xfe\xff", "utf-16-be")):
        if data.startswith(mark):
            return data[2:200].decode(encoding, "replace").lstrip().startswith("<")
    return data.removeprefix(b"\xef\xbb\xbf").lstrip().startswith(b"<")


def read_xml(data: bytes, name: str) -> tuple[ET.Element, tuple[str, ...]]:
    """Return the tree's root, tags as `{namespace}name`, and the processing instructions.

    Args:
        data: the file's bytes, plain or compressed by gzip.
        name: of the file, for messages.

    Raises:
        BadArtwork: It is no XML, declares entities, or is deeper or longer than allowed.
    """
    reader = _BoundedReader(name)
    try:
        reader.parser.Parse(data, True)
    except expat.ExpatError as error:
        raise BadArtwork(
            f"{name}: is broken XML ({expat.ErrorString(error.code)}, line {error.lineno}, column "
            f"{error.offset + 1}); save it again, from the program that made it"
        ) from None
    except BadArtwork:
        raise
    except (LookupError, ValueError):  # an encoding that neither expat nor Python reads
        raise BadArtwork(
            f"{name}: is in an encoding that is not read; save it again as UTF-8"
        ) from None
    return reader.builder.close(), tuple(reader.instructions)


class _BoundedReader:
    """Builder of a tree from Expat's events, with limits on what it counts."""

    def __init__(self, name: str) -> None:
        self.name = name
        self.builder = ET.TreeBuilder()
        self.instructions: list[str] = []
        self._depth = self._elements = self._text = self._entities = self._attribute_count = (
            self._defaults
        ) = 0
        self.parser = expat.ParserCreate(namespace_separator="}")
        self.parser.buffer_text = True
        self.parser.StartElementHandler = self._start
        self.parser.EndElementHandler = self._end
        self.parser.CharacterDataHandler = self._characters
        self.parser.ProcessingInstructionHandler = self._instruct
        self.parser.EntityDeclHandler = self._declare
        self.parser.AttlistDeclHandler = self._declare_default
        self.parser.SetParamEntityParsing(expat.XML_PARAM_ENTITY_PARSING_NEVER)

    def _start(self, tag: str, attributes: dict[str, str]) -> None:
        self._depth += 1
        self._elements += 1
        if self._depth > MAX_DEPTH:
            raise BadArtwork(
                f"{self.name}: has more than {MAX_DEPTH} elements inside one another; "
                "ungroup it in the program that made it"
            )
        if self._elements > MAX_ELEMENTS:
            raise BadArtwork(
                f"{self.name}: has more than {MAX_ELEMENTS} elements; draw a part of it"
            )
        clean = {}
        self._attribute_count += sum(map(len, attributes.values()))
        if self._attribute_count > MAX_ATTRIBUTES:
            raise BadArtwork(
                f"{self.name}: is longer than {MAX_ATTRIBUTES // 1_000_000} MB with what its "
                "entities stand for; save it as plain SVG"
            )
        for key, value in attributes.items():
            embedded = value.startswith("data:")
            clean[_full(key)] = value[:LONGEST_EMBEDDED] if embedded else value
        self.builder.start(_full(tag), clean)

    def _end(self, tag: str) -> None:
        self._depth -= 1
        self.builder.end(_full(tag))

    def _characters(self, text: str) -> None:
        self._text += len(text) if text.strip() else 0
        if self._text > MAX_TEXT:
            raise BadArtwork(
                f"{self.name}: has more than {MAX_TEXT} characters of text; "
                "a drawing has lines instead"
            )
        self.builder.data(text)

    def _instruct(self, target: str, data: str) -> None:
        if len(self.instructions) < 10:
            self.instructions.append(f"{target} {data}"[:LONGEST_EMBEDDED])

    def _declare_default(
        self, element: str, attribute: str, kind: str, default: str | None, is_needed: bool
    ) -> None:
        # It then stands in each such element, however many there are.
        self._defaults += len(default or "")
        if self._defaults > MAX_DEFAULTS:
            raise BadArtwork(
                f"{self.name}: declares more than {MAX_DEFAULTS} letters as what attributes are "
                f"by themselves ({attribute[:30]} of <{element[:30]}>); save it as plain SVG"
            )

    def _declare(self, entity: str, is_parameter: bool, value: str | None, *_: object) -> None:
        self._entities += 1
        if (
            is_parameter
            or value is None
            or len(value) > LONGEST_ENTITY
            or set(value) & set("<&%")
            or self._entities > MAX_ENTITIES
        ):
            raise BadArtwork(
                f"{self.name}: declares an entity (&{entity[:30]};), which may hide anything and "
                "is not read; save it as plain SVG"
            )


def _full(name: str) -> str:
    """Return a name as ElementTree writes it."""
    return "{" + name if "}" in name else name
