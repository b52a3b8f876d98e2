"""The drawings that come along, each by the name of its file; nothing of them is read here."""

from __future__ import annotations

from pathlib import Path

GALLERY = Path(__file__).parent / "gallery"


def gallery() -> tuple[str, ...]:
    """Return the names of the bundled drawings, in their order."""
    return tuple(sorted(path.stem for path in GALLERY.glob("*.svg")))
