"""What style an SVG element has: attributes, style sheets and inheritance.  Pure."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping

INHERITED = (
    *("fill", "stroke", "stroke-linecap", "stroke-dasharray", "visibility", "color"),
    *("marker-start", "marker-mid", "marker-end"),
)
"""Properties that a child takes from its parent, of those that matter here."""
OWN = ("display", "clip-path", "mask", "transform")
"""Those that it does not."""

INITIAL = {
    **{"fill": "black", "stroke": "none", "stroke-linecap": "butt", "stroke-dasharray": "none"},
    **{"visibility": "visible", "color": "black"},
    **{"marker-start": "none", "marker-mid": "none", "marker-end": "none"},
}
"""What a property is where nothing says it (SVG 1.1, appendix N)."""

MARKERS = ("marker-start", "marker-mid", "marker-end")
SIMPLE = re.compile(r"(?P<tag>\*|[\w-]+)?(?P<kind>[.#])?(?P<word>(?(kind)[\w-]+))")
LONGEST_SELECTOR = 200
MAX_CLASSES = 50
"""So many classes of an element are looked at."""

Style = Mapping[str, str]


class StyleSheet:
    """The rules of all `style` elements, as far as they have plain selectors: tag, .class, #id.

    imports  what they import from elsewhere, which is not read
    unread   selectors that are not understood
    """

    def __init__(self, texts: Iterable[str]) -> None:
        self.imports: list[str] = []
        self.unread: list[str] = []
        self._rules: dict[tuple[str, str], dict[str, tuple[int, str]]] = {}
        self._count = 0
        for text in texts:
            self._read(_without_comments(text))

    def _read(self, text: str) -> None:
        for part in text.split("}"):
            head, brace, body = part.rpartition("{")
            while "@import" in head:  # ends by a semicolon, where rules have braces
                before, _, after = head.partition("@import")
                imported, _, rest = after.partition(";")
                self.imports.append(imported.strip()[:60])
                head = before + rest
            if not brace:
                continue
            declared = declarations(body)
            selectors = head.rpartition("{")[2].rpartition(";")[2]  # without @media, @charset
            for selector in selectors.split(","):
                self._add(selector.strip(), declared)

    def _add(self, selector: str, declared: dict[str, str]) -> None:
        if not selector or selector.startswith("@"):
            return
        match = SIMPLE.fullmatch(selector[:LONGEST_SELECTOR])
        if match is None:
            self.unread.append(selector[:60])
            return
        tag = match["tag"] or "*"
        weight = {"#": 4, ".": 2}.get(match["kind"] or "", 0) + (tag != "*")
        key = (tag, f"{match['kind'] or ''}{match['word'] or ''}")
        self._count += 1
        rank = weight * 1_000_000_000 + self._count
        said = self._rules.setdefault(key, {})
        for name, value in declared.items():  # a later one of the same selector counts
            said[name] = (rank, value)

    def of(self, tag: str, attributes: Mapping[str, str]) -> dict[str, str]:
        """What the rules say of an element, the more special and the later ones last."""
        if not self._rules:
            return {}
        words = ["", *(f".{word}" for word in attributes.get("class", "").split()[:MAX_CLASSES])]
        if "id" in attributes:
            words.append(f"#{attributes['id']}")
        merged: dict[str, tuple[int, str]] = {}
        for key in ((element, word) for element in ("*", tag) for word in words):
            for name, ranked in self._rules.get(key, {}).items():
                merged[name] = max(merged.get(name, ranked), ranked)
        return {name: value for name, (_, value) in merged.items()}


def declarations(text: str) -> dict[str, str]:
    """`key: value; ...` as a dict, of the properties that matter."""
    found = {}
    for part in text.split(";"):
        key, colon, value = part.partition(":")
        key = key.strip().lower()
        if colon and (key in INHERITED or key in OWN or key == "marker"):
            value = value.replace("!important", "").strip()
            found.update(dict.fromkeys(MARKERS, value) if key == "marker" else {key: value})
    return found


def style_of(
    tag: str, attributes: Mapping[str, str], parent: Style, sheet: StyleSheet
) -> dict[str, str]:
    """All properties of an element: its parent's where they are inherited, and its own.

    Its attributes weigh least, then the style sheets, then its attribute `style`.
    """
    style = {key: parent[key] for key in INHERITED}
    given = {key: attributes[key].strip() for key in (*INHERITED, *OWN) if key in attributes}
    given.update(sheet.of(tag, attributes))
    given.update(declarations(attributes.get("style", "")))
    style.update({key: value for key, value in given.items() if value != "inherit"})
    return style


def is_painted(paint: str) -> bool:
    """Whether a fill or stroke shows at all."""
    return paint not in ("none", "transparent", "")


def is_white(paint: str) -> bool:
    """Whether a fill or stroke is as white as the paper."""
    return re.sub(r"\s", "", paint.lower()) in (
        *("white", "#fff", "#ffffff", "rgb(255,255,255)", "rgb(100%,100%,100%)"),
    )


def _without_comments(text: str) -> str:
    kept = []
    for part in text.split("*/"):
        kept.append(part.partition("/*")[0])
    return "".join(kept)
