"""One browser's page: what it shows and what can be done on it.

It knows nothing but what the tracker's desk answers.
"""

from __future__ import annotations

import asyncio
import itertools
import math
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from html import escape

from nicegui import events, ui

from laptop.page.async_controller import MAX_FRAME_RATE, AsyncController
from laptop.page.interface import ColourCalls, FrameCalls, RunCalls, StatusCalls
from laptop.page.overlay import overlay
from laptop.page.pointer import Pointer
from laptop.page.record import Summary
from laptop.page.snapshots import (
    DEFAULTS,
    HISTORY_DURATION,
    LOW_BATTERY,
    SAMPLE_PERIOD,
    VERDICTS,
    CameraStatus,
    FrameSnapshot,
    PageState,
    PlotSample,
    points,
)
from laptop.tracking.watching import Point
from shared.messages import BUDGET, EFFECTOR, GOAL, TOLERANCE
from shared.orders import METHODS, MODES, ROWS

FACTS, PLOTS = 1.0, 1.0
"""Figures and plots are shown anew every so many s for each browser."""
UNSEEN = 10.0
"""A picture that a browser has neither shown nor refused so long after it was sent, s, is given up:
none comes before, for what is clicked is clicked in the picture that was shown last."""
BACK = 1.0
"""A start that comes so soon after the browser has come back, s, was pressed before."""

AIM, PICK, ADD, REMOVE = "aim", "pick", "add", "remove"
TOOLS = {
    AIM: ("Aim", "ads_click", "Click the goal; drag a path for the tip to follow."),
    PICK: ("Pick", "colorize", "Click a marker, or drag a box into it: this is its colour."),
    ADD: ("Add", "add_circle", "Click what the marker's colour should take in, too."),
    REMOVE: ("Remove", "remove_circle", "Click what is wrongly taken for the marker."),
}
"""What a click in the picture does: name, icon, explanation."""
COLOUR_EDITS = {PICK: ColourCalls.pick, ADD: ColourCalls.add, REMOVE: ColourCalls.remove}
"""Edit of a marker's colour that a tool makes."""

STYLE = """
:root { --ok: #2e9e5b; --bad: #d92d3a; --warm: #d97b00; }
body { font-size: 16px; }
.nicegui-content { padding: 0; max-width: none; }
.bar { display: flex; flex-wrap: wrap; align-items: center; gap: .5rem 1rem; width: 100%; }
.q-header { background: #10243a !important; color: #fff; padding: .5rem 1rem; }
.word { font-size: 1.35rem; font-weight: 700; letter-spacing: .01em; }
.pill { border-radius: 99px; padding: .2rem .75rem; font-size: .95rem; font-weight: 600;
        background: #ffffff22; white-space: nowrap; }
.pill.ok { background: var(--ok); } .pill.warm { background: var(--warm); }
.stop { font-size: 1.5rem !important; font-weight: 800 !important; min-width: 10rem;
        min-height: 3.4rem; border: 3px solid #fff8; letter-spacing: .08em; }
.desk { display: grid; grid-template-columns: minmax(0, 1fr) 23rem; gap: 1rem; padding: 1rem;
        width: 100%; align-items: start; }
.pictures { display: grid; grid-template-columns: repeat(auto-fit, minmax(min(100%, 26rem), 1fr));
            gap: 1rem; width: 100%; }
.pictures.one .sight { max-width: calc((100vh - 13rem) * 4 / 3); margin: 0 auto; width: 100%; }
.scrub { flex-wrap: nowrap; align-items: center; gap: .3rem .6rem; padding: .2rem .2rem 0; }
.scrub .q-slider { flex: 1; }
.scrub > :last-child { font-variant-numeric: tabular-nums; white-space: nowrap; font-size: .95rem; }
.picture img { display: block; }
.picture { position: relative; border-radius: .6rem; overflow: hidden; background: #000;
           width: 100%; }
.picture.empty { aspect-ratio: 4 / 3; }
.picture .aiming { cursor: crosshair; touch-action: none; }
.caption { position: absolute; top: 0; left: 0; right: 0; padding: .3rem .7rem; font-size: .9rem;
           color: #fff; background: linear-gradient(#000b, #0000); pointer-events: none;
           font-variant-numeric: tabular-nums; }
.lost { position: absolute; left: .6rem; right: .6rem; bottom: .6rem; pointer-events: none;
        display: flex; flex-direction: column; gap: .4rem; }
.lost > div { background: #b3121fee; color: #fff; border-radius: .5rem; padding: .4rem .8rem;
              font-size: 1.05rem; line-height: 1.3; }
.lost > .doubt { background: #8a5a00ee; }
.side { display: flex; flex-direction: column; gap: 1rem; }
.card { border-radius: .6rem; padding: .9rem 1rem; width: 100%; background: #fff;
        border: 1px solid #0002; display: flex; flex-direction: column; gap: .6rem; }
.body--dark .card { background: #1c2733; border-color: #fff2; }
.body--light { background: #f1f4f7; } .body--dark { background: #0f161e; }
.card h2 { font-size: .85rem; font-weight: 700; letter-spacing: .06em; text-transform: uppercase;
           line-height: 1.2; margin: 0; opacity: .75; }
.verdict { font-size: 1.3rem; font-weight: 650; line-height: 1.25; }
.verdict.ok { color: var(--ok); } .verdict.bad { color: var(--bad); }
.body--dark .verdict.ok { color: #55d68a; } .body--dark .verdict.bad { color: #ff7a83; }
.error { font-size: 2.4rem; font-weight: 700; font-variant-numeric: tabular-nums; line-height: 1; }
.quiet { opacity: .8; font-size: .95rem; line-height: 1.35; }
.mono { font-family: ui-monospace, monospace; font-size: .85rem; overflow-wrap: anywhere;
        user-select: all; background: #8882; border-radius: .3rem; padding: .4rem .5rem; }
.field { width: 100%; }
.go { font-size: 1.15rem !important; min-height: 3rem; flex: 1; }
.card.naming { width: min(24rem, 90vw); }
.tools { width: 100%; } .tools .q-btn { flex: 1; padding: .3rem; }
.plots { display: grid; grid-template-columns: repeat(auto-fit, minmax(min(100%, 17rem), 1fr));
         gap: .6rem; width: 100%; }
.plot { height: 10.5rem; width: 100%; }
table.facts { border-collapse: collapse; width: 100%; table-layout: fixed; font-size: .95rem;
              font-variant-numeric: tabular-nums; }
table.facts td { padding: .15rem 0; vertical-align: top; overflow-wrap: anywhere; }
table.facts td:first-child { opacity: .75; padding-right: .8rem; width: 6.2rem; }
table.facts .warn td { color: var(--bad); font-weight: 700; opacity: 1; }
.body--dark table.facts .warn td { color: #ff7a83; }
.body--dark .q-btn--flat, .body--dark .q-btn--outline { --q-primary: #86bcff; }
.picture text { font-size: calc(14px * var(--k)); }
.pictures:not(.one) .picture text { font-size: calc(21px * var(--k)); }
:focus-visible { outline: 3px solid #ff9f0a !important; outline-offset: 2px; }
@media (max-width: 60rem) {
  .desk { grid-template-columns: minmax(0, 1fr); padding: .5rem; gap: .5rem; }
  .side { display: contents; }
  .picture text, .pictures:not(.one) .picture text { font-size: calc(24px * var(--k)); }
  .later { order: 1; }
  .stop { min-width: 7rem; flex: 1; }
  .word { display: none; }
  .q-header { padding: .4rem .5rem; }
}
"""


TOGETHER = (
    "e => {{ const c = getHtmlElement({id}); "
    "c.querySelector('.over').innerHTML = c.dataset.over; emit(e.source); }}"
)
"""In the browser, once a picture is there: only now is its overlay shown."""
REFUSED = "e => emit(e.target.src || '')"
"""In the browser, once a picture cannot be had (or the none that an image has at first)."""


class Picture:
    """One camera in one browser: the newest picture that it has time for, and what is clicked.

    It stands still while the page is paused, or once its recording has ended; then any frame of a
    recording can be had, and what is seen in it is told anew whenever a marker's colour changes.
    """

    def __init__(self, view: Page, camera: str) -> None:
        self._view = view
        self.camera = camera
        self._sent: FrameSnapshot | None = None  # what it was sent and has not shown yet
        self._last = -math.inf  # when that was
        self._loaded = asyncio.Event()
        self.shown: FrameSnapshot | None = None  # what the browser shows
        self._drawn = "", ""
        self._draws = 0
        self._pointer = Pointer()
        self._wanted: int | None = None  # a frame of a recording
        self._pinned: int | None = None  # a frame that it stands at
        self._looked: tuple[object, ...] = ()  # at what was sent: its frame, for which colours
        with ui.element("div").classes("sight"):
            with ui.element("div").classes("picture empty") as self._frame:
                self.image = ui.interactive_image(
                    content='<g class="over"></g>',
                    events=["pointerdown", "pointermove", "pointerup", "pointercancel"],
                    sanitize=False,
                )
                self.image.classes("aiming w-full").on_mouse(self._on_pointer)
                self.image.on(
                    "loaded", self._on_loaded, js_handler=TOGETHER.format(id=self.image.id)
                )
                self.image.on("error.capture", self._on_refused, js_handler=REFUSED)
                self.image.props(f'alt="camera {camera}"')
                self._caption = ui.label().classes("caption")
                self._lost = ui.element("div").classes("lost").props("role=status aria-live=polite")
            self._scrub = ui.row().classes("scrub")
            with self._scrub:
                self._button("chevron_left", "frame back", -1)
                self._slider = ui.slider(min=0, max=max(1, self._eye.frames - 1), value=0).props(
                    f'aria-label="frame of camera {camera}"'
                )
                self._slider.on("update:model-value", self._on_slider, throttle=0.05)
                self._button("chevron_right", "frame on", 1)
                self._which = ui.label()
            self._scrub.set_visibility(False)
        self._told: list[tuple[str, str, str]] = []
        self._timer = ui.timer(self._view.controller.pace, self._refresh)

    def _button(self, icon: str, what: str, frames: int) -> None:
        ui.button(icon=icon, on_click=lambda: self.step(frames)).props(
            f'flat round dense aria-label="{what}"'
        )

    @property
    def _eye(self) -> CameraStatus:
        state = self._view.controller.state
        assert state is not None
        return next(eye for eye in state.cameras if eye.camera == self.camera)

    @property
    def _markers(self) -> tuple[tuple[str, str], ...]:
        """What is looked for, as far as is known here."""
        state = self._view.controller.state
        return tuple(state.markers.items()) if state else ()

    async def _refresh(self) -> None:
        """Send the next picture, until the browser has shown it."""
        self._timer.interval = self._view.controller.pace
        if not self._runs:
            return
        shown = await self._view.controller.feeds[self.camera].next()
        # (After a look ahead in a recording it may well be an earlier one.)
        new = shown and (self._sent or not self.shown or shown.index != self.shown.index)
        sent = self._sent and time.monotonic() - self._last < UNSEEN  # a still, meanwhile
        if shown and new and self._runs and not sent:
            mask = self._view.mask
            self._looked = shown.index, mask if mask in shown.masks else "", self._markers
            self._send(shown)
            with suppress(asyncio.TimeoutError):
                await asyncio.wait_for(self._loaded.wait(), UNSEEN)

    @property
    def _runs(self) -> bool:
        """Whether what is shown goes on."""
        connected = self.image.client.has_socket_connection
        return connected and not self._view.paused and self._wanted is None

    async def stand(self) -> None:
        """While it stands: send the frame that is wanted, as the markers are looked for now."""
        standing = self._view.paused or self._eye.ended
        self._scrub.set_visibility(standing and self._eye.frames > 0)
        if not standing:
            self._pinned = self._wanted = None
        if not standing or not self.shown:
            return
        if self._sent:
            if time.monotonic() - self._last < UNSEEN:
                return
            self._give_up()
        mask = self._view.mask
        index = self.shown.index if self._wanted is None else self._wanted
        now = index, mask, self._markers
        if self._wanted is None and self._pinned != index:
            self._pinned = index
            self._slider.set_value(index)
            self._view.controller.feeds[self.camera].keep(self.shown)
            await self._view.controller.call(FrameCalls.pin, self.camera, index)
        elif self._looked != now:
            self._looked = now
            still = await self._view.controller.still(self.camera, index, (mask,) if mask else ())
            if isinstance(still, FrameSnapshot):
                self._send(still)
            else:
                self._view.tell(still)
        else:
            self._draw(self.shown)
        self._which.set_text(f"frame {self.shown.index} of 0 to {self._eye.frames - 1}")

    def step(self, frames: int) -> None:
        """Go on by so many frames, or back, in a recording that stands."""
        if self._pinned is not None and self.shown and self._eye.frames:
            index = self.shown.index if self._wanted is None else self._wanted
            self._wanted = min(max(0, index + frames), self._eye.frames - 1)
            self._slider.set_value(self._wanted)

    def _on_slider(self, event: events.GenericEventArguments) -> None:
        if isinstance(event.args, (int, float)):
            self._wanted = min(max(0, int(event.args)), self._eye.frames - 1)

    def _send(self, shown: FrameSnapshot) -> None:
        self._sent, self._last = shown, time.monotonic()
        self._loaded.clear()
        if not self._draw(shown):  # it looks the same
            self._show()

    def _show(self) -> None:
        """What was sent is shown."""
        self.shown, self._sent = self._sent, None
        self._frame.classes(remove="empty")
        self._loaded.set()

    def _draw(self, shown: FrameSnapshot) -> bool:
        """Whether there is anything new for the browser to load."""
        view = self._view
        drawn = overlay(shown, view.mask, view.windows, self._pointer.drag, view.tool != AIM)
        source = f"/view/{self.camera}/{shown.index}.jpg?{view.controller.run}"
        new = (source, drawn) != self._drawn
        if new:
            self._drawn = source, drawn
            self._draws += 1  # what has another fragment is loaded anew, if only from memory
            self.image.props["data-over"] = drawn
            self.image.set_source(f"{source}#{self._draws}")
        lost = [
            (mark.name, mark.why, mark.advice)
            for mark in shown.marks
            if mark.why and not (mark.name == GOAL and shown.aim)
        ]
        if lost != self._told:
            self._told = lost
            self._lost.clear()
            with self._lost:
                for name, why, advice in lost:
                    what = f"{name} lost: {why}" if why != "doubtful" else f"{name} {why}"
                    then = f". {advice[:1].upper()}{advice[1:]}." if advice else "."
                    ui.label(what + then).classes("doubt" if why == "doubtful" else "")
        return new

    def describe(self, state: PageState) -> None:
        """The camera in a line."""
        eye = next(eye for eye in state.cameras if eye.camera == self.camera)
        if self._view.paused or eye.ended:
            self._caption.set_text(
                " · ".join([eye.camera, eye.source, eye.trouble if eye.ended else "paused"])
            )
            return
        facts = [f"{eye.camera}", eye.source, f"{eye.rate:.0f} fps"]
        if eye.age is not None:
            facts.append(f"{1000 * eye.age:.0f} ms")
        if eye.trouble:
            facts.append(eye.trouble)
        self._caption.set_text(" · ".join(facts))

    def _on_loaded(self, event: events.GenericEventArguments) -> None:
        if self._is_sent(event.args):
            self._show()

    def _on_refused(self, event: events.GenericEventArguments) -> None:
        if self._is_sent(event.args):
            self._give_up()

    def _is_sent(self, source: object) -> bool:
        """Whether what was sent has this address in the browser."""
        return self._sent is not None and str(source).endswith(f"#{self._draws}")

    def _give_up(self) -> None:
        """What was sent is not to be had; let whatever comes next be loaded."""
        self._sent, self._looked, self._drawn = None, (), ("", "")
        self._loaded.set()

    async def _on_pointer(self, event: events.MouseEventArguments) -> None:
        if self.shown is None:
            return
        point = (
            min(max(event.image_x - 0.5, 0.0), self.shown.width - 1.0),
            min(max(event.image_y - 0.5, 0.0), self.shown.height - 1.0),
        )
        done = self._pointer.take(event.type, point, event.button, event.buttons)
        if done:
            await self._view.clicked(self.camera, self.shown.index, done)


class Plot:
    """The last minute of something, as lines.

    Args:
        title: what it is, and its unit.
        values: by name, of a sample of the history.
    """

    def __init__(
        self, title: str, values: Callable[[PlotSample], Mapping[str, float | None]]
    ) -> None:
        self._values = values
        quiet = {"color": "#8a94a0", "fontSize": 12}
        grid = {"lineStyle": {"color": "#8a94a033"}}
        self.chart = ui.echart(
            {
                "animation": False,
                "title": {"text": title, "left": 0, "top": 0,
                          "textStyle": {"color": "#8a94a0", "fontSize": 14}},
                "legend": {"right": 0, "top": 0, "textStyle": quiet, "itemWidth": 14,
                           "itemHeight": 8},
                "grid": {"left": 44, "right": 8, "top": 30, "bottom": 22},
                "xAxis": {"type": "value", "min": -HISTORY_DURATION, "max": 0, "axisLabel":
                          {**quiet, ":formatter": "v => v + ' s'"}, "splitLine": grid},
                "yAxis": {"type": "value", "scale": True, "axisLabel": quiet,
                          "splitLine": grid, "splitNumber": 3, "axisLine": {"show": False},
                          "axisTick": {"show": False}},
                "color": ["#e8590c", "#1c7ed6", "#37b24d", "#ae3ec9", "#f59f00", "#0ca678"],
                "series": [],
            }
        ).classes("plot")  # fmt: skip

    def show(self, past: Sequence[PlotSample]) -> None:
        """Draw a line for each name."""
        rows = [self._values(sample) for sample in past]
        names = dict.fromkeys(name for row in rows for name in row)
        times = [round(sample.t - past[-1].t, 2) for sample in past]
        options = self.chart.options
        options["legend"]["show"] = len(names) > 1
        options["series"] = [
            {"name": name, "type": "line", "showSymbol": False, "lineStyle": {"width": 2},
             "data": [
                 (t, None if (value := row.get(name)) is None else round(value, 3))
                 for t, row in zip(times, rows, strict=True)
             ]}
            for name in names
        ]  # fmt: skip
        self.chart.update()


class Page:
    """One browser's page."""

    def __init__(self, controller: AsyncController) -> None:
        self.controller = controller
        self.tool = AIM
        self.mask = ""
        self.windows = True
        self.paused = False
        self._pictures: dict[str, Picture] = {}
        self._marker = EFFECTOR
        self._typed: tuple[str, ...] = ()  # what is shown to be typed on the brick
        self._state_due = self._facts_due = self._plot_due = -math.inf
        self._runs: tuple[Summary, ...] = ()
        self._connected = 0  # times
        self._back = -math.inf  # when it was cut off no more

    async def build(self) -> None:
        """Everything on it."""
        state = await self.controller.poll()
        await self.controller.call(StatusCalls.opened)
        ui.context.client.on_connect(self._on_connect)
        ui.add_css(STYLE)
        ui.colors(primary="#1c62ad", positive="#23814a", negative="#c8101c")
        self._dark = ui.dark_mode(None)
        self._header()
        several = len(state.cameras) > 1
        with ui.element("main").classes("desk"):
            with ui.element("div").classes("side"):
                with ui.element("div").classes("pictures" + " one" * (not several)):
                    for eye in state.cameras:
                        self._pictures[eye.camera] = Picture(self, eye.camera)
                self._plots_card()
            with ui.element("div").classes("side"):
                self._drive_card(several)
                self._click_card()
                self._state_card()
        ui.keyboard(self._on_escape, ignore=[], repeating=False)
        ui.keyboard(self._on_key, ignore=["input", "select", "textarea"], repeating=False)
        ui.keyboard(self._on_arrow, ignore=["input", "select", "textarea"])
        ui.timer(1 / MAX_FRAME_RATE, self._stand)
        ui.timer(SAMPLE_PERIOD, self._describe)
        ui.timer(PLOTS / len(self._plots), self._plot)
        self._show_state(state)

    # Parts

    def _header(self) -> None:
        with ui.header(), ui.element("div").classes("bar"):
            ui.label("BrickServo").classes("word")
            self._brick = ui.label().classes("pill").mark("brick")
            ui.space()
            ui.button(icon="dark_mode", on_click=self._toggle_dark).props(
                'flat round color=white aria-label="dark or light"'
            ).tooltip("dark or light (D)")
            self._stop = (
                ui.button("STOP", on_click=self.stop)
                .props('color=negative unelevated aria-label="STOP the arm (Escape)"')
                .classes("stop")
                .tooltip("stop the arm (Escape)")
            )

    def _drive_card(self, several: bool) -> None:
        with ui.element("section").classes("card").props('aria-label="drive"'):
            ui.html("<h2>Drive</h2>", sanitize=False)
            with ui.element("div").props("role=status aria-live=polite"):
                self._verdict = ui.label().classes("verdict").mark("verdict")
                self._reason = ui.label().classes("quiet")
            with ui.row().classes("items-end gap-3"):
                self._error = ui.label().classes("error").mark("error")
                self._run = ui.label().classes("quiet")
            self._goal = ui.label().classes("quiet")
            with ui.row().classes("w-full gap-2 no-wrap"):
                self._start = (
                    ui.button("Start", icon="play_arrow", on_click=self.start)
                    .props("color=positive unelevated")
                    .classes("go")
                )
                _say_above(self._start, "to the goal (S)")
                self._hold = (
                    ui.button("Hold", icon="pause", on_click=self.hold)
                    .props("outline")
                    .classes("go")
                )
                _say_above(self._hold, "halt here; Start goes on (H)")
            self._to_marker = ui.button(
                "Aim at the goal marker", on_click=self._aim_at_marker
            ).props("flat dense no-caps icon=my_location")
            with ui.row().classes("w-full gap-2 no-wrap"):
                self._report = (
                    ui.button("Report", icon="assessment")
                    .props("flat dense no-caps type=a href=/report target=_blank")
                    .tooltip("of the last run, in a new tab")
                )
                with ui.button("Earlier", icon="history").props("flat dense no-caps") as earlier:
                    self._reports = ui.menu()
                self._earlier = earlier
            with ui.expansion("How", icon="tune").classes("w-full").props("dense"):
                self._method = ui.select(list(METHODS), value=DEFAULTS.method, label="method")
                self._mode = ui.select(list(MODES), value=DEFAULTS.mode, label="mode")
                self._rows = ui.select(list(ROWS), value=DEFAULTS.rows, label="rows of two cameras")
                self._rows.set_visibility(several)
                self._tolerance, self._budget = (
                    ui.number(f"{what}, {unit}", value=usual, min=least, max=most, step=step)
                    for what, usual, (least, most, unit), step in (
                        ("tolerance", DEFAULTS.tolerance, TOLERANCE, 0.5),
                        ("budget", DEFAULTS.budget, BUDGET, 10.0),
                    )
                )
                choices = self._method, self._mode, self._rows, self._tolerance, self._budget
                for choice in choices:
                    choice.classes("field").props("dense")
                self._follow = ui.switch("follow the goal marker as it moves").props("dense")
                ui.label(
                    "in the mode stream, until the budget is spent or Hold or STOP ends it"
                ).classes("quiet")

    def _click_card(self) -> None:
        with ui.element("section").classes("card").props('aria-label="a click in the picture"'):
            ui.html("<h2>A click in the picture</h2>", sanitize=False)
            self._tool = (
                ui.toggle({tool: name for tool, (name, _, _) in TOOLS.items()}, value=AIM)
                .props("no-caps unelevated spread toggle-color=primary")
                .classes("tools")
                .on_value_change(self._on_tool)
            )
            self._explained = ui.label(TOOLS[AIM][2]).classes("quiet")
            self._named = ui.row().classes("w-full gap-2 no-wrap items-end")
            with self._named:
                self._which = (
                    ui.select([EFFECTOR, GOAL], value=EFFECTOR, with_input=True,
                              label="of the marker (or a new name)", new_value_mode="add-unique")
                    .classes("grow").props("dense")
                    .on_value_change(self._on_which)
                )  # fmt: skip
                self._rename = ui.button("Rename", icon="edit", on_click=self._ask_name).props(
                    "flat dense no-caps"
                )
            self._named.set_visibility(False)
            with ui.dialog() as self._naming, ui.element("div").classes("card naming"):
                self._name_field = ui.element("div")
                ui.label(
                    f"The arm brings the marker named {EFFECTOR} to the one named {GOAL}."
                ).classes("quiet")
                with ui.row().classes("w-full justify-end"):
                    ui.button("Leave it", on_click=self._naming.close).props("flat no-caps")
                    ui.button("Rename it", on_click=self.rename).props("unelevated no-caps")
            with ui.row().classes("w-full gap-2 items-center"):
                self._undo = ui.button("Undo", icon="undo", on_click=self._undo_colour).props(
                    "flat dense no-caps"
                )
                self._pause = ui.button(
                    "Pause", icon="pause_circle", on_click=self._toggle_pause
                ).props("flat dense no-caps")
                self._masked = ui.checkbox("Mask", on_change=self._on_mask).props("dense")
                ui.checkbox("Windows", value=True, on_change=self._on_windows).props("dense")

    def _state_card(self) -> None:
        with ui.element("section").classes("card later").props('aria-label="state"'):
            ui.html("<h2>State</h2>", sanitize=False)
            self._note = ui.label().classes("quiet")
            self._invite = ui.element("div")
            with self._invite:
                ui.label("On the brick, type one of").classes("quiet")
                self._commands = ui.column().classes("w-full gap-1")
            self._table = ui.html("", sanitize=False).classes("w-full")

    def _plots_card(self) -> None:
        with ui.element("section").classes("card later").props('aria-label="the last minute"'):
            with ui.row().classes("w-full items-center gap-2"):
                ui.html("<h2>The last minute</h2>", sanitize=False)
                ui.space()
                self._plotting = ui.checkbox("Run", value=True).props("dense")
                ui.button(
                    "CSV", icon="download", on_click=lambda: ui.download.from_url("/history.csv")
                ).props("flat dense no-caps")
            with ui.element("div").classes("plots"):
                self._plots = [
                    Plot("error, px", lambda s: {"error": s.error}),
                    Plot("components, px", lambda s: s.e),
                    Plot(
                        "joints, degrees",
                        lambda s: {f"q{n}": math.degrees(q) for n, q in enumerate(s.q, 1)},
                    ),
                    Plot(
                        "steps, condition",
                        lambda s: {"steps": float(s.moves), "condition": s.condition},
                    ),
                    Plot(
                        "frame age, ms",
                        lambda s: {name: age and 1000 * age for name, age in s.ages.items()},
                    ),
                    Plot("frames per second", lambda s: s.rates),
                ]
                self._turns = itertools.cycle(self._plots)

    # What is shown

    async def _stand(self) -> None:
        await asyncio.gather(*(picture.stand() for picture in self._pictures.values()))

    async def _describe(self) -> None:
        seen = ui.context.client.has_socket_connection
        if seen and time.monotonic() >= self._state_due:
            self._state_due = self.controller.due(SAMPLE_PERIOD)
            self._show_state(await self.controller.poll())

    def _show_state(self, state: PageState) -> None:
        status = state.status if state.brick else None
        verdict = status.verdict if status else None
        if state.running:
            words, tone = ("On its way." if verdict == "" else "Starting ..."), ""
            if status and verdict == "" and status.reason:
                words = f"Held: {status.reason.split(':')[0]}. It goes on by itself."
        elif status is None:
            words = "The emulated brick is coming ..." if state.own else "No brick is connected."
            tone = ""
        else:
            words = VERDICTS.get(status.verdict, f"{status.verdict}.")
            tone = {"converged": "ok", "ready": "", "stopped": ""}.get(status.verdict, "bad")
        if state.running and state.left:
            words = f"Along the path, {points(state.left)} to go."
        if state.following and verdict == "":
            words = "Following the goal marker. Hold or STOP ends it."
        self._verdict.set_text(words)
        self._verdict.classes(remove="ok bad", add=tone)
        self._reason.set_text(status.reason if status else "")
        known = status is not None and status.error is not None
        self._error.set_text(f"{status.error:.1f} px" if status and known else "– px")
        self._run.set_text(
            f"run {status.run}, {status.moves} moves" if status and status.run else ""
        )
        self._goal.set_text("Goal: " + goal_text(state))
        self._to_marker.set_visibility(bool(state.aims) and GOAL in state.markers)
        self._start.set_enabled(state.brick is not None and not state.running)
        self._hold.set_enabled(state.running)
        self._undo.set_enabled(state.undoable > 0)
        self._show_runs(state.runs)
        self._brick.set_text(brick_text(state))
        self._brick.classes(remove="ok warm", add="ok" if state.brick else "warm")
        self._note.set_text(state.note)
        self._invite.set_visibility(state.brick is None and not state.own and bool(state.commands))
        self._rename.set_enabled(self._marker in state.markers)
        self._pause.set_visibility(not all(eye.ended for eye in state.cameras))
        names = list(state.markers)
        if self._which.options != [*dict.fromkeys([EFFECTOR, GOAL, *names, self._marker])]:
            self._which.set_options([*dict.fromkeys([EFFECTOR, GOAL, *names, self._marker])])
        if state.commands != self._typed:
            self._typed = state.commands
            self._commands.clear()
            with self._commands:
                for command in state.commands:
                    ui.label(f"{command} --wait").classes("mono")
                if len(state.cameras) > 1:
                    ui.label("for an arm in space with --arm spatial").classes("quiet")
        if time.monotonic() >= self._facts_due:  # figures that change all the time
            self._facts_due = self.controller.due(FACTS)
            for picture in self._pictures.values():
                picture.describe(state)
            self._table.set_content(facts_of(state))

    def _show_runs(self, runs: tuple[Summary, ...]) -> None:
        """Let there be a report of each."""
        self._report.set_enabled(bool(runs))
        self._earlier.set_enabled(len(runs) > 1)
        if runs == self._runs:
            return
        self._runs = runs
        self._reports.clear()
        with self._reports:
            for run in reversed(runs[:-1]):
                words = f"{clock(run.when)} {run.verdict or 'on its way'}"
                href = f"href=/report/{run.number} target=_blank"
                ui.menu_item(words).props(href)

    def _plot(self) -> None:
        if not self._plotting.value or time.monotonic() < self._plot_due:
            return
        self._plot_due = self.controller.due(PLOTS / len(self._plots))
        if self.controller.past:
            next(self._turns).show(self.controller.past)  # all at once would hold up the picture

    # What is done

    def tell(self, why: str) -> None:
        """Say why something was not done; "" for nothing."""
        if why:
            ui.notify(why, type="warning", position="bottom", timeout=6000, multi_line=True)

    async def clicked(self, camera: str, index: int, points: Sequence[Point]) -> None:
        """A click at a point, or a drag along some, in a picture."""
        if self.tool == AIM:
            if len(points) > 1:
                why = await self.controller.call(RunCalls.follow, camera, list(points))
            else:
                why = await self.controller.call(RunCalls.aim, camera, *points[0])
        else:
            where = (*points[0], *points[-1]) if len(points) > 1 else points[0]
            edit = COLOUR_EDITS[self.tool]
            why = await self.controller.call_slowly(edit, self._marker, camera, index, where)
            if not why:
                ui.notify(f"{self._marker}: kept", type="positive", position="bottom", timeout=1500)
        self.tell(why)

    def _on_connect(self) -> None:
        self._connected += 1
        if self._connected > 1:
            self._back = time.monotonic()

    async def start(self) -> None:
        """Start a run.

        Browsers send on what was pressed while they were cut off.  That is right for a STOP.
        """
        if time.monotonic() - self._back < BACK:
            self.tell("the page was cut off when Start was pressed; look, then press it again")
            return
        numbers = []
        for what, field, (_, _, unit) in (
            ("tolerance", self._tolerance, TOLERANCE),
            ("budget", self._budget, BUDGET),
        ):
            if field.value is None:
                self.tell(f"{what}: write a number of {unit}, e.g. {getattr(DEFAULTS, what):g}")
                return
            numbers.append(float(field.value))
        tolerance, budget = numbers
        how = self._method.value, self._mode.value, self._rows.value
        self.tell(
            await self.controller.call(RunCalls.start, *how, *numbers, bool(self._follow.value))
        )

    async def hold(self) -> None:
        """Halt."""
        self.tell(await self.controller.call(RunCalls.hold))

    async def stop(self) -> None:
        """STOP."""
        self.tell(await self.controller.call(RunCalls.stop))

    async def _aim_at_marker(self) -> None:
        self.tell(await self.controller.call(RunCalls.aim_at_marker))

    async def _undo_colour(self) -> None:
        before = dict(self.controller.state.markers) if self.controller.state else {}
        self.tell(await self.controller.call_slowly(ColourCalls.undo))
        now = (await self.controller.call(StatusCalls.state)).markers
        if self._marker in before and self._marker not in now:  # its name was undone
            back = next((name for name in now if name not in before), EFFECTOR)
            self._which.set_options([*dict.fromkeys([*self._which.options, back])], value=back)

    def _ask_name(self) -> None:
        self._name_field.clear()  # an old field that is set anew undoes what is typed meanwhile
        with self._name_field:
            self._new_name = ui.input(f"{self._marker} is from now on", value=self._marker)
            self._new_name.classes("w-full").props("autofocus").on("keydown.enter", self.rename)
        self._naming.open()

    async def rename(self) -> None:
        """Give the chosen marker the name that was written."""
        old, new = self._marker, str(self._new_name.value).strip()
        if new != old:
            why = await self.controller.call_slowly(ColourCalls.rename, old, new)
            self.tell(why)
            if why:
                return
            self._which.set_options([*{**dict.fromkeys(self._which.options), new: None}], value=new)
        self._naming.close()

    def _toggle_pause(self) -> None:
        self.paused = not self.paused
        self._pause.set_text("Go on" if self.paused else "Pause")
        self._pause.set_icon("play_circle" if self.paused else "pause_circle")

    def _toggle_dark(self) -> None:
        # The first time it is as the system has it; then the other way round.
        self._dark.set_value(self._dark.value is not True)

    def _on_tool(self, event: events.ValueChangeEventArguments) -> None:
        self.tool = event.value
        self._explained.set_text(TOOLS[self.tool][2])
        self._named.set_visibility(self.tool != AIM)

    def _on_which(self, event: events.ValueChangeEventArguments) -> None:
        self._marker = str(event.value or EFFECTOR)
        self._on_mask()

    def _on_mask(self) -> None:
        self.mask = self._marker if self._masked.value else ""
        for feed in self.controller.feeds.values():
            feed.masks.pop(ui.context.client.id, None)
            if self.mask:
                feed.masks[ui.context.client.id] = self.mask

    def _on_windows(self, event: events.ValueChangeEventArguments) -> None:
        self.windows = event.value

    async def _on_escape(self, event: events.KeyEventArguments) -> None:
        if event.action.keydown and event.key.escape:
            await self.stop()

    def _on_arrow(self, event: events.KeyEventArguments) -> None:
        if event.action.keydown and (event.key.arrow_left or event.key.arrow_right):
            for picture in self._pictures.values():
                picture.step((10 if event.modifiers.shift else 1) * (-1) ** event.key.arrow_left)

    async def _on_key(self, event: events.KeyEventArguments) -> None:
        modified = event.modifiers.ctrl or event.modifiers.alt or event.modifiers.meta
        if not event.action.keydown or modified:
            return
        key = event.key.name.lower()
        if key in "1234" and len(key) == 1:
            self._tool.set_value(list(TOOLS)[int(key) - 1])
        elif key == "s":
            await self.start()
        elif key == "h":
            await self.hold()
        elif key == "p":
            self._toggle_pause()
        elif key == "u":
            await self._undo_colour()
        elif key == "m":
            self._masked.set_value(not self._masked.value)
        elif key == "d":
            self._toggle_dark()


def _say_above(element: ui.element, text: str) -> None:
    """A tooltip that hides nothing below."""
    with element:
        ui.tooltip(text).props('anchor="top middle" self="bottom middle"')


def clock(when: float) -> str:
    """The time of day."""
    return time.strftime("%H:%M:%S", time.localtime(when))


def goal_text(state: PageState) -> str:
    """Where the tip is to go, for people."""
    if state.aims:
        where = [f"{u:.0f}, {v:.0f}" for u, v in state.aims.values()]
        if len(state.cameras) > 1:
            where = [f"{name} {text}" for name, text in zip(state.aims, where, strict=True)]
        path = f", then {state.left} more" if state.left else ""
        return "pixel " + " and ".join(where) + path
    if state.fixed:
        return "the pixel that the command line fixed"
    return "the goal marker" if GOAL in state.markers else "none yet; click one in the picture"


def brick_text(state: PageState) -> str:
    """Whether there is a brick, for people."""
    if state.brick is None:
        return "emulated brick is coming" if state.own else "no brick connected"
    return "emulated brick" if state.own else f"brick {state.brick.removeprefix('::ffff:')}"


def facts_of(state: PageState) -> str:
    """The state as a table in HTML."""
    rows = []
    if state.round_trip is not None:
        rows.append(("link", f"{1000 * state.round_trip:.1f} ms round trip"))
    volts = state.status.battery if state.brick and state.status else None
    low = volts is not None and volts < LOW_BATTERY
    if volts is not None:
        advice = ": low, charge it or put in fresh cells" if low else ""
        rows.append(("battery", f"{volts:.1f} V{advice}"))
    for eye in state.cameras:
        age = "" if eye.age is None else f", {1000 * eye.age:.0f} ms old"
        rows.append((f"camera {eye.camera}", f"{eye.rate:.0f} fps{age}, {eye.dropped} dropped"))
    rows += [(name, look) for name, look in state.markers.items()]
    rows.append(("colours in", state.file))
    cells = "".join(
        f"<tr{' class=warn' * (low and a == 'battery')}><td>{escape(a)}</td>"
        f"<td>{escape(b)}</td></tr>"
        for a, b in rows
    )
    return f'<table class="facts">{cells}</table>'
