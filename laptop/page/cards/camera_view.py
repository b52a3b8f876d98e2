"""One camera in one browser: its image, its overlays, and clicks in it."""

from __future__ import annotations

import asyncio
import json
import math
import time
from contextlib import suppress
from pathlib import Path

from nicegui import events, ui

from laptop.page.cards.browser_state import AIM, DRAW, BrowserState
from laptop.page.drawing_view import DrawingView
from laptop.page.interface import DrawCalls, FrameCalls
from laptop.page.marker_text import marker_title
from laptop.page.overlay import overlay
from laptop.page.pointer import Pointer
from laptop.page.snapshots import CameraStatus, FrameSnapshot, PageState
from shared.messages import GOAL

IMAGE_TIMEOUT = 10.0
"""Longest time after which an image that a browser has neither shown nor refused is given up, s:
none comes before, for what is clicked is clicked in the image that was shown last."""

SCRIPT = Path(__file__).with_name("camera_view.js")
ON_LOAD = "event => showOverlay(event, getHtmlElement({id}), emit)"
ON_ERROR = "event => reportRefusal(event, emit)"
DRAG_PERIOD = 0.06
"""Period of updates of a drawing that is dragged, s."""
ON_KEY = "event => pressKey(event, emit)"


class CameraView:
    """One camera in one browser: the newest image that it has time for.

    It stands still while the page is paused, or once its recording has ended; then any frame of a
    recording can be had, and the markers in it are found anew whenever a marker's colour changes.

    Args:
        browser_state: the browser's choices.
        camera: name of the camera.
    """

    def __init__(self, browser_state: BrowserState, camera: str) -> None:
        self._browser_state = browser_state
        self.camera = camera
        self._shown: FrameSnapshot | None = None  # by the browser
        self._sent: FrameSnapshot | None = None  # to the browser, which has not shown it yet
        self._sent_at = -math.inf  # s
        self._answered = asyncio.Event()  # by the browser: it has shown or refused what was sent
        self._source, self._overlay = "", ""  # that were last given to the browser
        self._fragment = 0  # of the last source
        self._searched: tuple[object, ...] = ()  # what was sent: its frame, for which colours
        self._pointer = Pointer()
        self.drawing = DrawingView(camera)
        self._drawn = ""  # the drawing's SVG that the browser has
        self._drawn_at = -math.inf  # s
        self._inked = -1, 0  # version and number of the points of ink that the browser has
        self._wanted: int | None = None  # a frame of a recording
        self._pinned: int | None = None  # a frame at which it stands
        self._warnings: list[tuple[str, str, str]] = []  # of markers: name, why, advice
        with ui.element("div").classes("camera"):
            self._add_image()
            self._add_scrub_bar()
        self._timer = ui.timer(browser_state.controller.pace, self._refresh)

    @staticmethod
    def add_script() -> None:
        """Add to the page what all views need in the browser."""
        ui.add_head_html(f"<script>{SCRIPT.read_text(encoding='utf-8')}</script>")

    def _add_image(self) -> None:
        with ui.element("div").classes("picture empty") as self._frame:
            self._frame.props(
                f'tabindex=0 role=application aria-label="picture of camera {self.camera}: arrow '
                'keys move a cross, Enter clicks there"'
            ).on("keydown", self._on_key, js_handler=ON_KEY)
            self._image = ui.interactive_image(
                content='<g class="drawing"></g><path class="ink"/><g class="over"></g>'
                '<g class="cross"></g>',
                events=["pointerdown", "pointermove", "pointerup", "pointercancel"],
                sanitize=False,
            )
            self._image.classes("aiming w-full").on_mouse(self._on_pointer)
            self._image.on("loaded", self._on_loaded, js_handler=ON_LOAD.format(id=self._image.id))
            self._image.on("error.capture", self._on_refused, js_handler=ON_ERROR)
            with ui.element("div").classes("caption"):
                self._caption = ui.label()
                ui.label().classes("age")  # the script fills it: of what is on the screen
            self._lost = ui.element("div").classes("lost").props("role=status aria-live=polite")

    def _add_scrub_bar(self) -> None:
        self._scrub_bar = ui.row().classes("scrub")
        with self._scrub_bar:
            self._add_step_button("chevron_left", "frame back", -1)
            self._slider = ui.slider(min=0, max=self._last_frame, value=0).props(
                f'aria-label="frame of camera {self.camera}"'
            )
            self._slider.on("update:model-value", self._on_slider, throttle=0.05)
            self._add_step_button("chevron_right", "frame on", 1)
            self._frame_number = ui.label()
        self._scrub_bar.set_visibility(False)

    def _add_step_button(self, icon: str, label: str, frames: int) -> None:
        ui.button(icon=icon, on_click=lambda: self.step(frames)).props(
            f'flat round dense aria-label="{label}"'
        )

    @property
    def _status(self) -> CameraStatus:
        state = self._browser_state.controller.state
        assert state is not None
        return next(camera for camera in state.cameras if camera.name == self.camera)

    @property
    def ratio(self) -> float | None:
        """Width of its pictures by their height; None: none has been shown yet."""
        return self._shown.width / self._shown.height if self._shown else None

    @property
    def _last_frame(self) -> int:
        return max(1, self._status.frames - 1)

    @property
    def _markers(self) -> tuple[tuple[str, str], ...]:
        """Name and description of each marker, as far as known."""
        state = self._browser_state.controller.state
        return tuple(state.markers.items()) if state else ()

    @property
    def _is_running(self) -> bool:
        """True if newer images are to be shown as they come."""
        connected = self._image.client.has_socket_connection
        return connected and not self._browser_state.paused and self._wanted is None

    @property
    def _awaits_browser(self) -> bool:
        """True if the browser may still show what was sent to it."""
        return self._sent is not None and time.monotonic() - self._sent_at < IMAGE_TIMEOUT

    async def _refresh(self) -> None:
        """Send the next image, and wait until the browser has shown it."""
        self._timer.interval = self._browser_state.controller.pace
        if not self._is_running:
            return
        shown = await self._browser_state.controller.feeds[self.camera].next()
        # (After a look ahead in a recording it may well be an earlier one.)
        new = shown and (self._sent or not self._shown or shown.index != self._shown.index)
        # Meanwhile a still may have been sent.
        if shown and new and self._is_running and not self._awaits_browser:
            mask = self._browser_state.mask
            self._searched = shown.index, mask if mask in shown.masks else "", self._markers
            self._send(shown)
            with suppress(asyncio.TimeoutError):
                await asyncio.wait_for(self._answered.wait(), IMAGE_TIMEOUT)

    async def refresh_still(self) -> None:
        """While it stands: send the frame that is wanted, with its markers as they look now."""
        standing = self._browser_state.paused or self._status.ended
        self._scrub_bar.set_visibility(standing and self._status.frames > 0)
        if self._slider.props["max"] != self._last_frame:  # it was a guess before the end
            self._slider.props["max"] = self._last_frame
        if not standing:
            self._pinned = self._wanted = None
        if not standing or not self._shown or self._awaits_browser:
            return
        if self._sent:
            self._give_up()
        controller, mask = self._browser_state.controller, self._browser_state.mask
        index = self._shown.index if self._wanted is None else self._wanted
        searched = index, mask, self._markers
        if self._wanted is None and self._pinned != index:
            self._pinned = index
            self._slider.set_value(index)
            controller.feeds[self.camera].store_still(self._shown)
            await controller.call(FrameCalls.pin, self.camera, index)
        elif self._searched != searched:
            self._searched = searched
            still = await controller.still(self.camera, index, (mask,) if mask else ())
            if isinstance(still, FrameSnapshot):
                self._send(still)
            else:
                self._browser_state.warn(still)
        else:
            self._draw(self._shown)
        self._frame_number.set_text(f"frame {self._shown.index} of 0 to {self._status.frames - 1}")

    def step(self, frames: int) -> None:
        """Go on by so many frames, or back, in a recording that stands."""
        if self._pinned is not None and self._shown and self._status.frames:
            index = self._shown.index if self._wanted is None else self._wanted
            self._wanted = min(max(0, index + frames), self._status.frames - 1)
            self._slider.set_value(self._wanted)

    def describe(self, state: PageState) -> None:
        """Show in a line how the camera is doing."""
        camera = next(camera for camera in state.cameras if camera.name == self.camera)
        facts = [camera.name, camera.source]
        if self._browser_state.paused or camera.ended:
            facts.append(camera.trouble if camera.ended else "paused")
        else:
            facts.append(f"{camera.rate:.0f} fps")
            if camera.trouble:
                facts.append(camera.trouble)
        self._caption.set_text(" · ".join(facts))

    # Images that are sent to the browser, and its answers

    def _send(self, shown: FrameSnapshot) -> None:
        self._sent, self._sent_at = shown, time.monotonic()
        self._answered.clear()
        if not self._draw(shown):  # it looks the same
            self._note_shown()

    def _draw(self, shown: FrameSnapshot) -> bool:
        """Return True if there is anything new for the browser to load."""
        browser_state = self._browser_state
        if browser_state.tool == DRAW:  # the ink is shown, which is not where the marker went
            shown = shown._replace(trail=())
        over = overlay(
            shown,
            browser_state.mask,
            browser_state.windows,
            self._pointer.drag,
            browser_state.tool != AIM,
        )
        source = f"/view/{self.camera}/{shown.index}.jpg?{browser_state.controller.run}"
        new = (source, over) != (self._source, self._overlay)
        if new:
            self._source, self._overlay = source, over
            self._fragment += 1  # what has another one is loaded anew, if only from memory
            self._image.props["data-over"] = over
            standing = browser_state.paused or self._wanted is not None or self._status.ended
            self._image.props["data-taken"] = "" if standing else f"{shown.taken:.3f}"
            self._image.set_source(f"{source}#{self._fragment}")
        self._show_warnings(shown)
        return new

    def _show_warnings(self, shown: FrameSnapshot) -> None:
        """Show which markers are lost or doubtful."""
        warnings = [
            (mark.name, mark.why, mark.advice)
            for mark in shown.marks
            if mark.why and not (mark.name == GOAL and shown.aim)
        ]
        if warnings == self._warnings:
            return
        self._warnings = warnings
        self._lost.clear()
        with self._lost:
            for name, why, advice in warnings:
                name = marker_title(name)
                what = f"{name} lost: {why}" if why != "doubtful" else f"{name} {why}"
                what = what[:1].upper() + what[1:]
                then = f". {advice[:1].upper()}{advice[1:]}." if advice else "."
                ui.label(what + then).classes("doubt" if why == "doubtful" else "")

    def _note_shown(self) -> None:
        self._shown, self._sent = self._sent, None
        self._frame.classes(remove="empty")
        self._answered.set()

    def _give_up(self) -> None:
        """Let the next image be loaded: the one that was sent failed."""
        self._sent, self._searched = None, ()
        self._source, self._overlay = "", ""
        self._answered.set()

    def _is_sent(self, source: object) -> bool:
        """Return True if this is the browser's address of what was sent."""
        return self._sent is not None and str(source).endswith(f"#{self._fragment}")

    def _on_loaded(self, event: events.GenericEventArguments) -> None:
        if self._is_sent(event.args):
            self._note_shown()

    def _on_refused(self, event: events.GenericEventArguments) -> None:
        if self._is_sent(event.args):
            self._give_up()

    # Input by pointer and keys

    def _on_slider(self, event: events.GenericEventArguments) -> None:
        if isinstance(event.args, (int, float)):
            self._wanted = min(max(0, int(event.args)), self._status.frames - 1)

    async def _on_key(self, event: events.GenericEventArguments) -> None:
        match event.args:
            case [int(u) | float(u), int(v) | float(v)] if self._shown:
                await self._browser_state.apply_tool(self.camera, self._shown.index, [(u, v)])

    async def _on_pointer(self, event: events.MouseEventArguments) -> None:
        if self._shown is None:
            return
        point = (
            min(max(event.image_x - 0.5, 0.0), self._shown.width - 1.0),
            min(max(event.image_y - 0.5, 0.0), self._shown.height - 1.0),
        )
        if self._browser_state.tool == DRAW:
            await self._on_hand(event, point)
            return
        done = self._pointer.handle(event.type, point, event.button, event.buttons)
        if done:
            await self._browser_state.apply_tool(self.camera, self._shown.index, done)

    # The drawing

    async def _on_hand(self, event: events.MouseEventArguments, point: tuple[float, float]) -> None:
        """Move, turn or scale the drawing."""
        assert self._shown
        drawing = self.drawing
        if event.type == "pointerdown" and event.button == 0:
            drawing.press(point, self._shown.width)
        elif event.type == "pointermove" and drawing.is_held:
            if not event.buttons:
                await self._let_go()  # it was let go of outside the picture
            elif time.monotonic() - self._drawn_at > DRAG_PERIOD:
                drawing.move(point)
                self.show_drawing()
        elif event.type == "pointerup" and drawing.is_held:
            drawing.move(point)
            await self._let_go()
        elif event.type == "pointercancel":
            drawing.cancel()
            self.show_drawing()

    async def _let_go(self) -> None:
        """Have the drawing lie where a hand has brought it."""
        placing = self.drawing.release()
        if placing and not await self._browser_state.draw(DrawCalls.place, placing):
            self.drawing.cancel()
        self.show_drawing()

    def show_drawing(self) -> None:
        """Show the drawing as it is now, with handles while it can be moved."""
        if self._shown is None:
            return
        svg = self.drawing.svg(self._shown.width, self._browser_state.tool == DRAW)
        if svg != self._drawn:
            self._drawn, self._drawn_at = svg, time.monotonic()
            self._image.client.run_javascript(f"showDrawing({self._image.id}, {json.dumps(svg)})")

    async def show_ink(self) -> None:
        """Show the ink that has come since."""
        if self._shown is None:
            return
        ink = await self._browser_state.controller.ink(self.camera)
        version, count = self._inked
        anew = version != ink.version
        fresh = ink.points[0 if anew else count :]
        if fresh or anew:
            self._inked = ink.version, len(ink.points)
            path = "".join(f"{'M' if p.begins else 'L'}{p.u:.1f} {p.v:.1f}" for p in fresh)
            path = path.replace("L", "M", 1) if anew and path.startswith("L") else path
            k = self._shown.width / 640
            self._image.client.run_javascript(
                f"showInk({self._image.id}, {json.dumps(path)}, {json.dumps(anew)}, {k:g})"
            )
