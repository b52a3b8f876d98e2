"""Elements of an SVG that are skipped, counted while it is read, and reported.  Pure."""

from __future__ import annotations

MAX_EXAMPLES = 3
"""Number of elements of a kind that are named; the others are counted."""
LONGEST_EXAMPLE = 40

SENTENCES = {
    "layer": (
        "The layer {names} is hidden: show it in the editor to draw it.",
        "{count} layers are hidden{which}: show them in the editor to draw them.",
    ),
    "hidden": (
        "An element is hidden{which}.",
        "{count} elements are hidden{which}.",
    ),
    "text": (
        "The text {names} is in a font that is not on this computer: make it a path first "
        "(Inkscape: Path > Object to Path).",
        "{count} texts are in fonts that are not on this computer{which}: make them paths first "
        "(Inkscape: Path > Object to Path).",
    ),
    "text path": (
        "A text along a line is not drawn{which}: make it a path first "
        "(Inkscape: Path > Object to Path).",
        "{count} texts along lines are not drawn{which}: make them paths first "
        "(Inkscape: Path > Object to Path).",
    ),
    "font": (
        "A font is not on this computer, and another stands for it{which}.",
        "{count} fonts are not on this computer, and others stand for them{which}.",
    ),
    "letter": (
        "A letter is not in its font, and not drawn{which}.",
        "{count} letters are not in their fonts, and not drawn{which}.",
    ),
    "image": (
        "A picture is not drawn{which}: draw the picture's own file.",
        "{count} pictures are not drawn{which}: draw each picture's own file.",
    ),
    "clipped": (
        "A shape behind a mask, or a clip that is too tangled, is not drawn{which}: "
        "release the mask in the editor.",
        "{count} shapes behind a mask, or a clip that is too tangled, are not drawn{which}: "
        "release the mask in the editor.",
    ),
    "clip": (
        "A clip by CSS does not cut{which}.",
        "{count} clips by CSS do not cut{which}.",
    ),
    "area": (
        "An area is drawn by its outline, not hatched.",
        "{count} areas are drawn by their outlines, not hatched.",
    ),
    "tangled": (
        "An area is too tangled to be hatched{which}.",
        "{count} areas are too tangled to be hatched{which}.",
    ),
    "white": (
        "A white shape is as the paper, and not drawn{which}.",
        "{count} white shapes are as the paper, and not drawn{which}.",
    ),
    "unpainted": (
        "A shape has neither line nor fill{which}, and is not drawn.",
        "{count} shapes have neither line nor fill{which}, and are not drawn.",
    ),
    "dashes": (
        "A dashed line is drawn through.",
        "{count} dashed lines are drawn through.",
    ),
    "markers": (
        "An arrow head or other marker on a line is not drawn.",
        "Arrow heads or other markers on {count} lines are not drawn.",
    ),
    "broken": (
        "A path is broken, and drawn up to there{which}.",
        "{count} paths are broken, and drawn up to there{which}.",
    ),
    "ignored": (
        "A value that cannot be read is passed over{which}.",
        "{count} values that cannot be read are passed over{which}.",
    ),
    "value": (
        "An element is not drawn since it has a value that cannot be read{which}.",
        "{count} elements are not drawn since they have values that cannot be read{which}.",
    ),
    "use": (
        "A reference leads nowhere{which}.",
        "{count} references lead nowhere{which}.",
    ),
    "circle": (
        "A reference leads back to itself{which}, and is not followed.",
        "{count} references lead back to themselves{which}, and are not followed.",
    ),
    "outside": (
        "A reference to another file is not followed{which}.",
        "{count} references to other files are not followed{which}.",
    ),
    "import": (
        "A style sheet in another file is not read{which}.",
        "{count} style sheets in other files are not read{which}.",
    ),
    "selector": (
        "A style rule is not understood, and not followed{which}.",
        "{count} style rules are not understood, and not followed{which}.",
    ),
    "script": (
        "A script is not run.",
        "{count} scripts are not run.",
    ),
    "foreignObject": (
        "Something foreign inside the drawing is not drawn.",
        "{count} foreign things inside the drawing are not drawn.",
    ),
    "point": (
        "A line without length is not drawn.",
        "{count} lines without length are not drawn.",
    ),
}
"""Sentences for one and for several elements of each kind; `which` is the names in brackets."""


class SkippedElements:
    """Counts of skipped elements, by the kinds of WORDS, with examples."""

    def __init__(self) -> None:
        self._counts: dict[str, int] = {}
        self._names: dict[str, list[str]] = {}

    def add(self, kind: str, name: str = "") -> None:
        """Count one, with a name or a text for people."""
        self._counts[kind] = self._counts.get(kind, 0) + 1
        names = self._names.setdefault(kind, [])
        name = _shown(name)
        if name and name not in names and len(names) <= MAX_EXAMPLES:
            names.append(name)

    def has(self, kind: str) -> bool:
        """Return whether there is one of a kind."""
        return kind in self._counts

    def sentences(self) -> tuple[str, ...]:
        """Return a sentence for each kind present, in the order of their first occurrence."""
        found = []
        for kind, count in self._counts.items():
            names = self._names[kind]
            shown = ", ".join(names[:MAX_EXAMPLES]) + (", ..." if len(names) > MAX_EXAMPLES else "")
            one, several = SENTENCES[kind]
            which = f" ({shown})" if names else ""
            found.append(
                (one if count == 1 else several).format(
                    count=count, names=shown or '""', which=which
                )
            )
        return tuple(found)


def _shown(text: str) -> str:
    """Return a text in one line, quoted and shortened."""
    text = "".join(c if c.isprintable() else " " for c in text[: 2 * LONGEST_EXAMPLE]).strip()
    if len(text) > LONGEST_EXAMPLE:
        text = text[:LONGEST_EXAMPLE] + "..."
    return text if text.startswith("<") or not text else f'"{text}"'
