"""Part of the card of drawings that shows where the paper is, and starts Look around."""

from __future__ import annotations

from nicegui import ui

from laptop.page.cards.browser_state import BrowserState
from laptop.page.drawing_snapshots import DrawingState
from laptop.page.interface import DrawCalls
from laptop.page.marker_height import HEIGHT_LIMITS_MM, MarkerHeight
from laptop.page.paper_text import needs_look, where_text


class PaperPart:
    """Part that shows the state of the mapping to the paper.

    Args:
        browser_state: the browser's choices.
    """

    def __init__(self, browser_state: BrowserState) -> None:
        self._browser_state = browser_state
        self._marker: MarkerHeight | None = None  # the tracker's last one
        self._typing_height = False
        self._mapping = ui.label().classes("quiet")
        self._height = ui.number(
            "marker above the paper, mm", min=HEIGHT_LIMITS_MM[0], max=HEIGHT_LIMITS_MM[1], step=1
        )
        self._height.classes("field").props("dense")
        self._height.on("focus", lambda: setattr(self, "_typing_height", True))
        for event in ("blur", "keydown.enter"):
            self._height.on(event, self._on_height)
        self._look_around = ui.button(
            "Look around",
            icon="travel_explore",
            on_click=lambda: self._browser_state.draw(DrawCalls.look_around),
        ).props("outline dense no-caps")

    def show(self, drawing: DrawingState, several: bool, can_look: bool) -> None:
        """Show what is known.

        Args:
            drawing: how it stands.
            several: there are several cameras.
            can_look: the arm may look around now.
        """
        self._mapping.set_text(where_text(drawing, several))
        self._look_around.set_visibility(needs_look(drawing))
        self._look_around.set_enabled(can_look)
        self._height.set_visibility(drawing.asks_height)
        if drawing.marker != self._marker and not self._typing_height:
            self._marker = drawing.marker
            cm = drawing.marker.cm
            self._height.set_value(None if cm is None else round(10 * cm, 1))

    async def _on_height(self) -> None:
        """Take what was typed as the marker's height; an empty field: it is not known."""
        self._typing_height = False
        value, known = self._height.value, self._marker and self._marker.cm
        before = None if known is None else round(10 * known, 1)
        self._marker = None  # the field returns to the tracker's value
        if value != before:
            await self._browser_state.draw(DrawCalls.set_marker_height, value)
