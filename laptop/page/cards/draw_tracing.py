"""Part of the card of drawings for tracing a picture and hatching an SVG."""

from __future__ import annotations

from nicegui import ui

from laptop.drawing.pictures import DETAILS, SHADES, SMOOTHINGS, Tracing
from laptop.page.cards.browser_state import BrowserState
from laptop.page.drawing_snapshots import DrawingState
from laptop.page.interface import DrawCalls

TRACING_SLIDERS = (
    ("detail", "Detail", DETAILS, 5, "how weak an edge still gets an outline"),
    ("shades", "Shades", SHADES, 1, "how many tones are hatched"),
    ("smoothing", "Smoothing", SMOOTHINGS, 5, "how much of what is fine is left out"),
)
"""Sliders of a picture: fields of a Tracing, their names for people, bounds, steps, and what they
do."""
STYLE_NAMES = {"auto": "as it looks", "photo": "photo", "lines": "lines"}
"""Names of the styles of a traced picture, for people."""


class TracingPart:
    """Style and sliders of a picture, and whether areas of an SVG are hatched.

    Args:
        browser_state: the browser's choices.
    """

    def __init__(self, browser_state: BrowserState) -> None:
        self._browser_state = browser_state
        self._tracing: Tracing | None = None  # the tracker's last one
        self._is_hatched: bool | None = None  # the tracker's last one
        self._traced: list[Tracing] = []  # requested here, not confirmed yet
        self._style = ui.select(STYLE_NAMES, label="style").classes("w-full").props("dense")
        self._style.on("update:model-value", self._on_tracing)
        self._style.set_visibility(False)
        with ui.element("div").classes("w-full tracing") as self._tracing_box:
            self._sliders = {}
            for key, name, (least, most), step, what in TRACING_SLIDERS:
                ui.label(name).classes("quiet").tooltip(what)
                slider = ui.slider(min=least, max=most, step=step)
                slider.props(f'label dense aria-label="{name.lower()}: {what}"')
                shown = ui.label().classes("quiet")
                shown.bind_text_from(slider, "value", lambda value: f"{value or 0:g}")
                self._sliders[key] = slider.on("change", self._on_slider)
        self._tracing_box.set_visibility(False)
        self._hatch = ui.checkbox("Hatch areas").props("dense")
        self._hatch.on("update:model-value", self._on_hatch)
        self._hatch.set_visibility(False)

    def show(self, drawing: DrawingState) -> None:
        """Show how it is drawn."""
        self._show_tracing(drawing.tracing)
        self._hatch.set_visibility(drawing.is_hatched is not None)
        if drawing.is_hatched != self._is_hatched:
            self._is_hatched = drawing.is_hatched
            self._hatch.set_value(bool(drawing.is_hatched))

    def _show_tracing(self, reported: Tracing | None) -> None:
        """Have the sliders show how the picture is drawn, unless a hand has moved them to that."""
        if reported == self._tracing:
            return
        self._tracing = reported
        for element in (self._tracing_box, self._style):
            element.set_visibility(reported is not None)
        if reported in self._traced:
            del self._traced[: self._traced.index(reported) + 1]
        elif reported:
            self._traced.clear()
            for key, slider in self._sliders.items():
                slider.set_value(getattr(reported, key))
            self._style.set_value(reported.style)

    async def _on_slider(self) -> None:
        """Draw the picture as a photo, which the sliders are for."""
        self._style.set_value("photo")
        await self._on_tracing()

    async def _on_tracing(self) -> None:
        """Trace the picture by the style and the sliders."""
        values = {key: slider.value for key, slider in self._sliders.items()}
        shades = int(values["shades"])
        style = str(self._style.value)
        asked = Tracing(values["detail"], shades, values["smoothing"], style=style)
        if asked == self._tracing and not self._traced:
            return
        self._traced.append(asked)
        if not await self._browser_state.draw(DrawCalls.trace_picture, asked):
            self._traced.clear()
            self._tracing = None  # the sliders return to the tracker's values

    async def _on_hatch(self) -> None:
        if not await self._browser_state.draw(DrawCalls.hatch, bool(self._hatch.value)):
            self._is_hatched = None  # it returns to the tracker's value
