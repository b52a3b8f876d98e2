"""The card of drawings: source, placement, duration and progress."""

from __future__ import annotations

from functools import partial
from pathlib import Path

from nicegui import events, ui

from laptop.drawing.gallery_files import gallery
from laptop.drawing.timing import in_minutes
from laptop.page.cards.browser_state import DRAW, BrowserState
from laptop.page.cards.camera_view import CameraView
from laptop.page.cards.card import card, fold, heading
from laptop.page.cards.draw_paper import PaperPart
from laptop.page.cards.draw_place import PlacePart
from laptop.page.cards.draw_progress import ProgressPart
from laptop.page.cards.draw_tracing import TracingPart
from laptop.page.drawing_snapshots import DrawingSnapshot, DrawingState
from laptop.page.drawing_view import figure
from laptop.page.interface import DrawCalls
from laptop.page.snapshots import PageState
from shared.job_messages import ABORT, FETCHING, PAUSE, PAUSED, RESUME

SCRIPT = Path(__file__).with_name("drop.js")
MAX_FILE_BYTES = 8_000_000
"""Greatest size of a file, bytes."""


class DrawCard:
    """The card of drawings.

    Args:
        browser_state: the browser's choices.
        views: of the cameras, over which a drawing lies.
    """

    def __init__(self, browser_state: BrowserState, views: list[CameraView]) -> None:
        self._browser_state, self._views = browser_state, views
        self._revision = -1
        self._snapshot = DrawingSnapshot(None, {})
        ui.add_head_html(f"<script>{SCRIPT.read_text(encoding='utf-8')}</script>")
        ui.add_body_html(f"<script>acceptDrops({MAX_FILE_BYTES})</script>")
        ui.on("drawing-sent", lambda: browser_state.show_tab(DRAW))
        ui.on("drawing-refused", self._on_refused)
        with card("Draw").classes("main") as self.element:
            heading("Draw")
            self._add_facts()
            self._progress = ProgressPart(browser_state)
            self._add_buttons()

    def add_more(self) -> None:
        """Add the parts below the fold."""
        with ui.element("div").classes("part") as self.more:
            self._result = ui.element("div").classes("card result")
            with fold(self._browser_state, "What to draw", "collections", is_open=True):
                self._add_sources()
                self._tracing = TracingPart(self._browser_state)
            with fold(self._browser_state, "Where and how", "open_with", is_open=True):
                self._paper = PaperPart(self._browser_state)
                self._place = PlacePart(self._browser_state, self._show_again)
                self._add_options()

    def _add_sources(self) -> None:
        ui.label("Drop an SVG, PNG or JPEG on the page, or").classes("quiet")
        with ui.row().classes("w-full gap-1 sources"):
            ui.button("Open a file", icon="upload_file").props("flat dense no-caps").on(
                "click", js_handler=f"() => chooseDrawing({MAX_FILE_BYTES})"
            )
            for name in gallery():
                ui.button(
                    name, on_click=partial(self._browser_state.draw, DrawCalls.choose, name)
                ).props("outline dense no-caps")
        with ui.row().classes("w-full gap-2 no-wrap items-end"):
            self._text = ui.input("or type a text").classes("grow").props("dense clearable")
            self._text.on("keydown.enter", self._write)
            ui.button("Write", on_click=self._write).props("flat dense no-caps")

    def _add_facts(self) -> None:
        with ui.element("div").classes("draw-status").props("role=status aria-live=polite"):
            self._facts = ui.label().classes("facts-line")
            self._trouble = ui.label().classes("trouble")

    def _add_buttons(self) -> None:
        with ui.row().classes("w-full gap-2 no-wrap"):
            self._start = (
                ui.button("Start", icon="draw", on_click=self.start)
                .props("color=positive unelevated aria-keyshortcuts=S")
                .classes("draws")
            )
            self._pause = (
                ui.button("Pause", icon="pause", on_click=self.pause)
                .props("outline aria-keyshortcuts=H")
                .classes("draws")
            )
            self._abort = (
                ui.button("Abort", icon="close", on_click=partial(self._order, ABORT))
                .props("outline")
                .classes("draws")
            )

    def _add_options(self) -> None:
        with ui.row().classes("w-full gap-2 items-center"):
            self._dry = ui.checkbox("Pen up: rehearse").props("dense")
            self._alone = (
                ui.checkbox("Go on without the link")
                .props("dense")
                .tooltip("else it pauses, pen up, when the link is lost")
            )

    # Display

    async def show(self, state: PageState) -> None:
        """Show the state, and enable the possible orders."""
        drawing, browser_state = state.drawing, self._browser_state
        if drawing.revision != self._revision:
            self._snapshot = await browser_state.controller.drawing(drawing.revision)
            self._revision = drawing.revision
            for view in self._views:
                view.drawing.update(self._snapshot)
            self._place.show(self._snapshot.placed)
            self._progress.show_deviation(self._snapshot.deviation)
            self._show_result()
        for view in self._views:
            view.show_drawing()
            if drawing.job is not None:
                await view.show_ink()
        self._tracing.show(drawing)
        self._show_facts(drawing)
        steers, job = browser_state.steers, drawing.job
        is_on = job is not None and job.is_on
        self._start.set_enabled(
            drawing.can_start and state.brick is not None and not state.running and steers
        )
        self._start.set_visibility(not is_on)
        self._pause.set_visibility(is_on)
        self._abort.set_visibility(is_on)
        self._pause.set_enabled(steers and job is not None and job.state != FETCHING)
        paused = job is not None and job.state == PAUSED
        self._pause.set_text("Resume" if paused else "Pause")
        self._pause.set_icon("play_arrow" if paused else "pause")
        self._abort.set_enabled(steers)
        can_look = steers and state.brick is not None and not is_on
        self._paper.show(drawing, len(self._views) > 1, can_look)
        self._progress.show(job)

    def _show_again(self) -> None:
        """Reset all fields to the tracker's state."""
        self._revision = -1

    def _show_facts(self, drawing: DrawingState) -> None:
        placed = self._snapshot.placed
        if placed is None:
            facts = f"{drawing.busy.capitalize()} ..." if drawing.busy else ""
        else:
            facts = f"{placed.name}: {placed.strokes} stroke{'s' * (placed.strokes != 1)}"
            facts += f", {placed.cm:.0f} cm"
            if placed.seconds is not None:
                facts += f", {in_minutes(placed.seconds)}"
            elif drawing.busy:
                facts += f", {drawing.busy} ..."
        self._facts.set_text(facts)
        why = drawing.trouble or (placed.why_not if placed else "")
        self._trouble.set_text(why[:1].upper() + why[1:] + "." * bool(why))

    def _show_result(self) -> None:
        self._result.clear()
        deviation = self._snapshot.deviation
        self._result.set_visibility(deviation is not None)
        if deviation is None:
            return
        with self._result:
            ui.label(
                "Green: the wish. Blue: the ink, by the tip as the camera saw it at "
                f"{deviation.points} places with the pen down, in the plane of its marker."
            ).classes("quiet")
            ui.html(figure(self._snapshot), sanitize=False)

    # Orders

    async def start(self) -> None:
        """Start the drawing, or resume it."""
        job = (
            self._browser_state.controller.state
            and self._browser_state.controller.state.drawing.job
        )
        if job and job.state == PAUSED:
            await self._order(RESUME)
        else:
            await self._browser_state.draw(
                DrawCalls.start, dry=bool(self._dry.value), alone=bool(self._alone.value)
            )

    async def pause(self) -> None:
        """Pause it, or go on with it."""
        job = (
            self._browser_state.controller.state
            and self._browser_state.controller.state.drawing.job
        )
        await self._order(RESUME if job and job.state == PAUSED else PAUSE)

    async def _order(self, what: str, value: float | None = None) -> None:
        await self._browser_state.draw(DrawCalls.order, what, value)

    async def _write(self) -> None:
        await self._browser_state.draw(DrawCalls.write, str(self._text.value or ""))

    def _on_refused(self, event: events.GenericEventArguments) -> None:
        self._browser_state.warn(str(event.args))
