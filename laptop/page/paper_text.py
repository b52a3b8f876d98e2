"""Texts about where a drawing is shown, at which height, and how well that is known."""

from __future__ import annotations

from laptop.page.drawing_snapshots import DrawingState
from laptop.page.marker_height import MarkerHeight


def where_text(drawing: DrawingState, several: bool) -> str:
    """Return it, for people; "" while there is nothing to say.

    Args:
        drawing: its state.
        several: there are several cameras.
    """
    if drawing.unmapped:
        name, why = next(iter(drawing.unmapped.items()))
        where = f"camera {name}'s picture" if several else "the picture"
        return (
            f"Where the table is in {where} is not known: {why}. Then the drawing lies over "
            "the picture, and the ink is measured. Looking around moves the arm, pen up; "
            "an arm that cannot lift its pen: take it out first."
        )
    if drawing.misfit is None:
        return ""
    known = (
        f"Where that is in the picture is known by {drawing.source}, to {drawing.misfit:.1f} mm."
    )
    if drawing.is_on_paper:
        text = f"The drawing is shown on the paper. {known}"
        if drawing.asks_height:
            text += f" The arm's marker is {height_text(drawing.marker)}."
        return text
    text = f"The drawing is shown where the arm's marker moves, above the paper. {known} "
    if drawing.marker.cm is None:
        return text + (
            "So ink is seen beside it. Measure from the paper up to the marker, and type it here."
        )
    return text + "So ink is seen beside it. Look around: then the paper's place is found."


def height_text(marker: MarkerHeight) -> str:
    """Return a known height over the paper, for people."""
    assert marker.cm is not None
    unsure = f" \u00b1 {10 * marker.sigma:.0f}" if marker.sigma else ""
    mm = f"{10 * marker.cm:.0f}" if marker.sigma else f"{10 * marker.cm:g}"
    return f"{mm}{unsure} mm above it, {marker.source}"


def needs_look(drawing: DrawingState) -> bool:
    """Return True if looking around would improve the mapping to the paper."""
    known = drawing.marker.cm is not None
    return bool(drawing.unmapped) or (known and not drawing.is_on_paper)
