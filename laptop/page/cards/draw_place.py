"""Part of the card of drawings for the placement and the pens."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from functools import partial

from nicegui import ui

from laptop.page.cards.browser_state import BrowserState
from laptop.page.drawing_snapshots import PlacedDrawing, Placing
from laptop.page.drawing_view import SIDE_LIMITS, placing_of
from laptop.page.interface import DrawCalls

ANSWER_TIMEOUT = 3.0
"""Longest wait for an answer to what was typed, s."""
PEN_MODES = {"": "one pen", "layers": "a pen for each layer", "colours": "a pen for each colour"}
"""Names of what may draw it, for people."""


class PlacePart:
    """Fields and buttons for where a drawing lies.

    Args:
        browser_state: the browser's choices.
        show_again: has all be shown again that the tracker tells.
    """

    def __init__(self, browser_state: BrowserState, show_again: Callable[[], None]) -> None:
        self._browser_state, self._show_again = browser_state, show_again
        self._placed: PlacedDrawing | None = None  # the tracker's last one
        self._typing = False  # in a field: what is typed is not to be changed
        self._asked: Placing | None = None  # by typing, not answered yet
        self._asked_at = -math.inf  # s
        self._notes = ui.column().classes("w-full gap-1 draw-notes")
        with ui.row().classes("w-full gap-2 no-wrap place") as self._place:
            self._fields = {
                key: ui.number(label, step=step, format="%.1f").classes("field").props("dense")
                for key, label, step in (
                    ("x", "ahead, cm", 0.5),
                    ("y", "left, cm", 0.5),
                    ("size", "size, cm", 0.5),
                    ("rotate", "turned, °", 5.0),
                )
            }
            for key, field in self._fields.items():
                field.on("focus", lambda: setattr(self, "_typing", True))
                field.on("blur", partial(self._apply, key))
                field.on("keydown.enter", partial(self._apply, key))
        self._pens = ui.select(PEN_MODES, label="drawn by").classes("w-full").props("dense")
        self._pens.on("update:model-value", self._on_pens)
        with ui.row().classes("w-full gap-1") as self._place_buttons:
            for label, icon, change in (
                ("Fit", "fit_screen", self._fit),
                ("Turn", "rotate_left", partial(self._change, turn=15.0)),
                ("Larger", "zoom_in", partial(self._change, scale=1.1)),
                ("Smaller", "zoom_out", partial(self._change, scale=1 / 1.1)),
                ("Remove", "delete", partial(self._browser_state.draw, DrawCalls.clear)),
            ):
                ui.button(label, icon=icon, on_click=change).props("flat dense no-caps")

    def show(self, placed: PlacedDrawing | None) -> None:
        """Show where it lies; None: there is none."""
        self._placed = placed
        self._place.set_visibility(placed is not None)
        self._place_buttons.set_visibility(placed is not None)
        self._pens.set_visibility(placed is not None and bool(placed.several))
        self._notes.clear()
        if placed is None:
            return
        self._pens.set_options({k: PEN_MODES[k] for k in ("", *placed.several)}, value=placed.pens)
        at = placing_of(placed)
        late = time.monotonic() - self._asked_at > ANSWER_TIMEOUT
        if self._asked and not late and not _alike(at, self._asked):
            return self._show_notes(placed)  # it answers what was asked before that
        self._asked = None
        if not self._typing:
            for key, field in self._fields.items():
                field.set_value(round(getattr(at, key), 1) + 0.0)  # no -0.0
        self._show_notes(placed)

    def _show_notes(self, placed: PlacedDrawing) -> None:
        with self._notes:
            for note in placed.notes[:4]:
                ui.label(note).classes("quiet")

    async def _on_pens(self) -> None:
        if not await self._browser_state.draw(DrawCalls.set_pens, str(self._pens.value or "")):
            self._show_again()

    async def _fit(self) -> None:
        placed = self._placed
        await self._browser_state.draw(
            DrawCalls.place, Placing(rotate=placed.rotate if placed else 0.0)
        )

    async def _change(self, turn: float = 0.0, scale: float = 1.0) -> None:
        if (placed := self._placed) is not None:
            at = placing_of(placed)
            size = min(max(SIDE_LIMITS[0], (at.size or 1.0) * scale), SIDE_LIMITS[1])
            rotate = (at.rotate + turn + 180) % 360 - 180
            await self._browser_state.draw(DrawCalls.place, at._replace(size=size, rotate=rotate))

    async def _apply(self, key: str) -> None:
        """Place the drawing by one field; the other fields may show an earlier placement."""
        self._typing = False
        placed, value = self._placed, self._fields[key].value
        if placed is None or value is None or not math.isfinite(value):
            return
        base = self._asked or placing_of(placed)
        asked = base._replace(**{key: float(value)})
        if not _alike(asked, base):
            self._asked, self._asked_at = asked, time.monotonic()
            if not await self._browser_state.draw(DrawCalls.place, asked):
                self._asked = None


def _alike(one: Placing, other: Placing) -> bool:
    """Return True if fields, which show tenths, show the same of both."""
    pairs = zip(one, other, strict=True)
    return all(abs((a or 0.0) - (b or 0.0)) <= 0.051 for a, b in pairs)
