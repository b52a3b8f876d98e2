"""The card of drawings: what is drawn, where it lies, how long it takes, how the brick gets on."""

from __future__ import annotations

import math
import time
from functools import partial
from pathlib import Path

from nicegui import events, ui

from laptop.drawing.gallery_files import gallery
from laptop.drawing.pictures import DETAILS, SHADES, SMOOTHINGS, Tracing
from laptop.drawing.timing import in_minutes
from laptop.page.cards.camera_view import CameraView
from laptop.page.cards.card import card, fold, heading, term
from laptop.page.cards.session import DRAW, BrowserSession
from laptop.page.drawing_snapshots import (
    DrawingSnapshot,
    DrawingState,
    JobState,
    PlacedDrawing,
    Placing,
)
from laptop.page.drawing_view import SIZES, figure, placing_of
from laptop.page.interface import DrawCalls
from laptop.page.marker_height import LIMITS, MarkerHeight
from laptop.page.paper_words import needs_look, where_text
from laptop.page.snapshots import PageState
from shared.job_messages import (
    ABORT,
    DONE,
    FAILED,
    FETCHING,
    PAUSE,
    PAUSED,
    PEN,
    RELATIVE_SPEED,
    RESUME,
    SPEED,
)

SCRIPT = Path(__file__).with_name("drop.js")
MAX_FILE = 8_000_000
"""Bytes of a file, at the most."""
SHOWN_FIRST = "rose", "spirograph", "knot", "owl", "house"
"""Of the drawings that come along; the others follow."""
ANSWER_TIMEOUT = 3.0
"""So long is an answer waited for to what was typed, s."""
TRACING_SLIDERS = (
    ("detail", "Detail", DETAILS, 5, "how weak an edge still gets an outline"),
    ("shades", "Shades", SHADES, 1, "how many tones are hatched"),
    ("smoothing", "Smoothing", SMOOTHINGS, 5, "how much of what is fine is left out"),
)
"""Of a picture: fields of a Tracing, their names for people, bounds, steps, and what they do."""
STYLES = {"auto": "as it looks", "photo": "photo", "lines": "lines"}
"""How a picture may be drawn, for people."""
PENS = {"": "one pen", "layers": "a pen for each layer", "colours": "a pen for each colour"}
"""What may draw it, for people."""
OFF = (
    "How far the ink is from the wish. On the whole: the RMS, the root of the mean of the squares, "
    "in which large ones count more."
)
PEN_STEP, MAX_PEN = 5.0, 30.0
"""Degrees of the pen's motor: a press of a button, and the most."""


class DrawCard:
    """The card of drawings.

    Args:
        session: the browser's choices.
        views: of the cameras, over which a drawing lies.
    """

    def __init__(self, session: BrowserSession, views: list[CameraView]) -> None:
        self._session, self._views = session, views
        self._revision = -1
        self._snapshot = DrawingSnapshot(None, {})
        self._typing = False  # in a field of the placing: what is typed is not to be changed
        self._asked: Placing | None = None  # by typing, not answered yet
        self._asked_at = -math.inf  # s
        self._tracing: Tracing | None = None  # the last that the tracker told
        self._is_hatched: bool | None = None  # the last that the tracker told
        self._traced: list[Tracing] = []  # asked for here, not told yet
        self._pen = 0.0  # degrees deeper
        self._marker: MarkerHeight | None = None  # the last that the tracker told
        self._typing_height = False
        ui.add_head_html(f"<script>{SCRIPT.read_text(encoding='utf-8')}</script>")
        ui.add_body_html(f"<script>takeDrops({MAX_FILE})</script>")
        ui.on("drawing-sent", lambda: session.show_tab(DRAW))
        ui.on("drawing-refused", self._on_refused)
        with card("Draw").classes("main") as self.element:
            heading("Draw")
            self._add_facts()
            self._add_progress()
            self._add_buttons()

    def add_more(self) -> None:
        """Add what is not always in sight."""
        with ui.element("div").classes("part") as self.more:
            self._result = ui.element("div").classes("card result")
            with fold(self._session, "What to draw", "collections", is_open=True):
                self._add_sources()
                self._add_tracing()
            with fold(self._session, "Where and how", "open_with", is_open=True):
                self._add_mapping()
                self._add_place()
                self._add_options()

    def _add_sources(self) -> None:
        ui.label("Drop an SVG, PNG or JPEG on the page, or").classes("quiet")
        with ui.row().classes("w-full gap-1 sources"):
            ui.button("Open a file", icon="upload_file").props("flat dense no-caps").on(
                "click", js_handler=f"() => chooseDrawing({MAX_FILE})"
            )
            for name in dict.fromkeys((*SHOWN_FIRST, *gallery())):
                ui.button(name, on_click=partial(self._session.draw, DrawCalls.choose, name)).props(
                    "outline dense no-caps"
                )
        with ui.row().classes("w-full gap-2 no-wrap items-end"):
            self._text = ui.input("or type a text").classes("grow").props("dense clearable")
            self._text.on("keydown.enter", self._write)
            ui.button("Write", on_click=self._write).props("flat dense no-caps")

    def _add_tracing(self) -> None:
        self._style = ui.select(STYLES, label="style").classes("w-full").props("dense")
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

    def _add_facts(self) -> None:
        with ui.element("div").classes("told").props("role=status aria-live=polite"):
            self._facts = ui.label().classes("facts-line")
            self._trouble = ui.label().classes("trouble")

    def _add_place(self) -> None:
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
        self._pens = ui.select(PENS, label="drawn by").classes("w-full").props("dense")
        self._pens.on("update:model-value", self._on_pens)
        with ui.row().classes("w-full gap-1") as self._place_buttons:
            for label, icon, change in (
                ("Fit", "fit_screen", self._fit),
                ("Turn", "rotate_left", partial(self._change, turn=15.0)),
                ("Larger", "zoom_in", partial(self._change, scale=1.1)),
                ("Smaller", "zoom_out", partial(self._change, scale=1 / 1.1)),
                ("Remove", "delete", partial(self._session.draw, DrawCalls.clear)),
            ):
                ui.button(label, icon=icon, on_click=change).props("flat dense no-caps")

    def _add_mapping(self) -> None:
        self._mapping = ui.label().classes("quiet")
        self._height = ui.number("marker above the paper, mm", min=LIMITS[0], max=LIMITS[1], step=1)
        self._height.classes("field").props("dense")
        self._height.on("focus", lambda: setattr(self, "_typing_height", True))
        for event in ("blur", "keydown.enter"):
            self._height.on(event, self._on_height)
        self._look = ui.button(
            "Look around",
            icon="travel_explore",
            on_click=lambda: self._session.draw(DrawCalls.look_around),
        ).props("outline dense no-caps")

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

    def _add_progress(self) -> None:
        with ui.element("div").classes("w-full job") as self._job:
            self._bar = ui.linear_progress(0.0, show_value=False).props("size=.7rem rounded")
            self._bar.props('aria-label="share that is drawn"')
            self._word = ui.label().classes("job-word").props("role=status aria-live=polite")
            self._why = ui.label().classes("quiet why")
            with ui.element("div").classes("deviation") as self._deviation:
                self._off = term("", OFF).classes("job-word")
            with ui.row().classes("w-full gap-2 items-center no-wrap pen") as self._on_the_way:
                ui.label("Speed").classes("quiet")
                self._speed = ui.slider(
                    min=RELATIVE_SPEED[0], max=RELATIVE_SPEED[1], step=5, value=100
                ).props('label aria-label="speed, per cent" :label-value="$event"')
                self._speed.props(remove=":label-value")
                self._speed.on("change", self._on_speed)
                ui.label("Pen").classes("quiet")
                for label, step in (("lower", PEN_STEP), ("higher", -PEN_STEP)):
                    ui.button(label, on_click=partial(self._move_pen, step)).props(
                        "flat dense no-caps"
                    )

    # What is shown

    async def show(self, state: PageState) -> None:
        """Show what there is, and let be pressed what can be done."""
        drawing, session = state.drawing, self._session
        if drawing.revision != self._revision:
            self._snapshot = await session.controller.drawing(drawing.revision)
            self._revision = drawing.revision
            for view in self._views:
                view.drawing.take(self._snapshot)
            self._show_placed()
            self._show_result()
        for view in self._views:
            view.show_drawing()
            if drawing.job is not None:
                await view.show_ink()
        self._show_tracing(drawing.tracing)
        self._hatch.set_visibility(drawing.is_hatched is not None)
        if drawing.is_hatched != self._is_hatched:
            self._is_hatched = drawing.is_hatched
            self._hatch.set_value(bool(drawing.is_hatched))
        self._show_facts(drawing)
        steers, job = session.steers, drawing.job
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
        self._look.set_enabled(steers and state.brick is not None and not is_on)
        self._on_the_way.set_visibility(is_on)
        self._job.set_visibility(job is not None)
        if job is not None:
            self._show_job(job)

    def _show_tracing(self, told: Tracing | None) -> None:
        """Have the sliders show how the picture is drawn, unless a hand has moved them to that."""
        if told == self._tracing:
            return
        self._tracing = told
        for element in (self._tracing_box, self._style):
            element.set_visibility(told is not None)
        if told in self._traced:
            del self._traced[: self._traced.index(told) + 1]
        elif told:
            self._traced.clear()
            for key, slider in self._sliders.items():
                slider.set_value(getattr(told, key))
            self._style.set_value(told.style)

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
        self._mapping.set_text(where_text(drawing, len(self._views) > 1))
        self._look.set_visibility(needs_look(drawing))
        self._height.set_visibility(drawing.asks_height)
        if drawing.marker != self._marker and not self._typing_height:
            self._marker = drawing.marker
            cm = drawing.marker.cm
            self._height.set_value(None if cm is None else round(10 * cm, 1))

    def _show_placed(self) -> None:
        placed = self._snapshot.placed
        self._place.set_visibility(placed is not None)
        self._place_buttons.set_visibility(placed is not None)
        self._pens.set_visibility(placed is not None and bool(placed.several))
        self._notes.clear()
        if placed is None:
            return
        self._pens.set_options({k: PENS[k] for k in ("", *placed.several)}, value=placed.pens)
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

    def _show_job(self, job: JobState) -> None:
        self._bar.set_value(round(job.share, 3))
        self._bar.set_visibility(job.is_on)
        self._word.set_text(job_text(job))
        self._word.classes(remove="ok bad", add={DONE: "ok", FAILED: "bad"}.get(job.state, ""))
        self._why.set_text(job.reason[:1].upper() + job.reason[1:])
        if not job.is_on:
            self._pen = 0.0

    def _show_result(self) -> None:
        self._result.clear()
        deviation = self._snapshot.deviation
        self._result.set_visibility(deviation is not None)
        self._deviation.set_visibility(deviation is not None)
        if deviation is None:
            return
        self._off.set_text(
            f"Off by {deviation.rms:.1f} mm on the whole, {deviation.greatest:.1f} mm at most"
        )
        with self._result:
            ui.label(
                "Green: the wish. Blue: the ink, by the tip as the camera saw it at "
                f"{deviation.points} places with the pen down, in the plane of its marker."
            ).classes("quiet")
            ui.html(figure(self._snapshot), sanitize=False)

    # What is done

    async def start(self) -> None:
        """Have it drawn, or go on with it."""
        job = self._session.controller.state and self._session.controller.state.drawing.job
        if job and job.state == PAUSED:
            await self._order(RESUME)
        else:
            await self._session.draw(
                DrawCalls.start, dry=bool(self._dry.value), alone=bool(self._alone.value)
            )

    async def pause(self) -> None:
        """Pause it, or go on with it."""
        job = self._session.controller.state and self._session.controller.state.drawing.job
        await self._order(RESUME if job and job.state == PAUSED else PAUSE)

    async def _order(self, what: str, value: float | None = None) -> None:
        await self._session.draw(DrawCalls.order, what, value)

    async def _on_speed(self, event: events.GenericEventArguments) -> None:
        await self._order(SPEED, float(self._speed.value))

    async def _move_pen(self, step: float) -> None:
        self._pen = min(max(-MAX_PEN, self._pen + step), MAX_PEN)
        await self._order(PEN, self._pen)

    async def _write(self) -> None:
        await self._session.draw(DrawCalls.write, str(self._text.value or ""))

    async def _on_slider(self) -> None:
        """Draw the picture as a photo, which the sliders are for."""
        self._style.set_value("photo")
        await self._on_tracing()

    async def _on_tracing(self) -> None:
        """Have the picture drawn as style and sliders say."""
        values = {key: slider.value for key, slider in self._sliders.items()}
        shades = int(values["shades"])
        style = str(self._style.value)
        asked = Tracing(values["detail"], shades, values["smoothing"], style=style)
        if asked == self._tracing and not self._traced:
            return
        self._traced.append(asked)
        if not await self._session.draw(DrawCalls.trace_picture, asked):
            self._traced.clear()
            self._tracing = None  # the sliders show again what is

    async def _on_hatch(self) -> None:
        if not await self._session.draw(DrawCalls.hatch, bool(self._hatch.value)):
            self._is_hatched = None  # it shows again what is

    async def _on_height(self) -> None:
        """Take what was typed as the marker's height; an empty field: it is not known."""
        self._typing_height = False
        value, known = self._height.value, self._marker and self._marker.cm
        before = None if known is None else round(10 * known, 1)
        self._marker = None  # the field shows again what is
        if value != before:
            await self._session.draw(DrawCalls.set_marker_height, value)

    async def _on_pens(self) -> None:
        if not await self._session.draw(DrawCalls.take_pens, str(self._pens.value or "")):
            self._revision = -1  # it shows again what is

    async def _fit(self) -> None:
        placed = self._snapshot.placed
        await self._session.draw(DrawCalls.place, Placing(rotate=placed.rotate if placed else 0.0))

    async def _change(self, turn: float = 0.0, scale: float = 1.0) -> None:
        if (placed := self._snapshot.placed) is not None:
            at = placing_of(placed)
            size = min(max(SIZES[0], (at.size or 1.0) * scale), SIZES[1])
            rotate = (at.rotate + turn + 180) % 360 - 180
            await self._session.draw(DrawCalls.place, at._replace(size=size, rotate=rotate))

    async def _apply(self, key: str) -> None:
        """Lay it where a field says; what others say may be of an earlier place."""
        self._typing = False
        placed, value = self._snapshot.placed, self._fields[key].value
        if placed is None or value is None or not math.isfinite(value):
            return
        base = self._asked or placing_of(placed)
        asked = base._replace(**{key: float(value)})
        if not _alike(asked, base):
            self._asked, self._asked_at = asked, time.monotonic()
            if not await self._session.draw(DrawCalls.place, asked):
                self._asked = None

    def _on_refused(self, event: events.GenericEventArguments) -> None:
        self._session.warn(str(event.args))


def _alike(one: Placing, other: Placing) -> bool:
    """Return True if fields, which show tenths, show the same of both."""
    pairs = zip(one, other, strict=True)
    return all(abs((a or 0.0) - (b or 0.0)) <= 0.051 for a, b in pairs)


def job_text(job: JobState) -> str:
    """Return how the brick gets on, for people."""
    share = f"{100 * job.share:.0f} %"
    if job.state == FETCHING:
        return f"The brick fetches {job.name}: {share}"
    if job.state == DONE:
        return f"{job.name}: done"
    if job.state == FAILED:
        return f"{job.name}: ended at {share}" if job.share else f"{job.name}: not begun"
    if job.is_on:
        word = "Paused, pen up" if job.state == PAUSED else "Drawing"
        text = f"{word}: {share}, stroke {job.stroke} of {job.strokes}"
        return text + (f", {in_minutes(job.seconds)} left" if job.seconds is not None else "")
    return f"{job.name}: {job.state} at {share}"
