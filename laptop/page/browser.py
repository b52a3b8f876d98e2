"""One browser's page, put together of its cards.

It knows nothing but what the tracker's controller answers.
"""

from __future__ import annotations

import asyncio
import math
import time
from functools import partial
from pathlib import Path

from nicegui import events, ui

from laptop.page import cards
from laptop.page.async_controller import MAX_FRAME_RATE
from laptop.page.cards.browser_state import AIM, DRAW, TOOLS, BrowserState
from laptop.page.cards.camera_view import CameraView
from laptop.page.cards.colours import ColourCard
from laptop.page.cards.draw import DrawCard
from laptop.page.cards.drive import DriveCard
from laptop.page.cards.header import Header
from laptop.page.cards.plots import PlotsCard
from laptop.page.cards.state import StateCard
from laptop.page.interface import StatusCalls
from laptop.page.snapshots import SAMPLE_PERIOD, PageState

STYLE = Path(cards.__file__).with_name("style.css")
FIRST_TAB = "drive"
"""Tab that is shown at first, unless the one of drawings was left open."""
FACTS_PERIOD = 1.0
"""Period of the figures that change all the time, for one browser, s."""


class Page:
    """One browser's page.

    Args:
        browser_state: its choices, and its way to the tracker.
        gate_port: of laptop.page.stop_gate.
    """

    def __init__(self, browser_state: BrowserState, gate_port: int) -> None:
        self._controller = browser_state.controller
        self._browser_state = browser_state
        self._gate_port = gate_port
        self._state_due = self._facts_due = -math.inf  # s

    async def build(self) -> None:
        """Add everything."""
        tool = self._browser_state.tool  # of before, if this page is loaded anew
        await self._controller.call(StatusCalls.opened)
        state = await self._controller.poll()
        ui.add_css(STYLE)
        CameraView.add_script()
        ui.colors(primary="#1c62ad", positive="#23814a", negative="#c8101c")
        several = len(state.cameras) > 1
        self._header = Header(self._browser_state, self._gate_port)
        self._desk = ui.element("div").classes("desk several" if several else "desk")
        with self._desk.style(f"--count: {len(state.cameras)}"):
            with ui.element("div").classes("pictures"):
                self._views = [
                    CameraView(self._browser_state, camera.name) for camera in state.cameras
                ]
            with ui.element("div").classes("side"):
                self._add_tabs()
                self._drive = DriveCard(self._browser_state)
                self._draw = DrawCard(self._browser_state, self._views)
                with ui.element("div").classes("more"):
                    self._add_more(several)
            if several:  # beside each other they leave room below
                PlotsCard(self._browser_state, has_room=True)
        self._browser_state.show_tab = self.show_tab
        self.show_tab(DRAW if tool == DRAW else FIRST_TAB)
        if tool != DRAW:
            self._colours.choose_tool(tool)
        ui.keyboard(self._on_key, ignore=["input", "select", "textarea"], repeating=False)
        ui.keyboard(self._on_arrow, ignore=["input", "select", "textarea"])
        ui.timer(1 / MAX_FRAME_RATE, self._refresh_stills)
        ui.timer(SAMPLE_PERIOD, self._refresh_state)
        await self._show(state)

    def _add_more(self, several: bool) -> None:
        """Add the parts below the fold, which scroll separately."""
        self._state = StateCard(self._browser_state)
        self._drive.add_more(several)
        self._draw.add_more()
        self._colours = ColourCard(self._browser_state)
        if not several:
            PlotsCard(self._browser_state)
        self._state.add_more()

    def _add_tabs(self) -> None:
        with ui.button_group().props("unelevated role=tablist").classes("tools tabs"):
            self._tabs = {
                tab: ui.button(
                    name, icon=icon, on_click=partial(self.show_tab, tab), color=None
                ).props("role=tab")
                for tab, name, icon in (
                    (FIRST_TAB, "Drive", "my_location"),
                    (DRAW, "Draw", "draw"),
                )
            }

    def show_tab(self, tab: str) -> None:
        """Show what the tab "drive" or "draw" holds; the pointer in pictures is for that."""
        self._tab = tab
        for key, button in self._tabs.items():
            button.props(f"aria-selected={'true' if key == tab else 'false'}")
        for element in (self._drive.element, self._drive.more, self._colours.element):
            element.set_visibility(tab == FIRST_TAB)
        for element in (self._draw.element, self._draw.more):
            element.set_visibility(tab == DRAW)
        if tab == DRAW:
            self._browser_state.tool = DRAW
        else:
            self._colours.choose_tool(AIM)
        for view in self._views:
            view.show_drawing()

    async def _refresh_stills(self) -> None:
        await asyncio.gather(*(view.refresh_still() for view in self._views))

    async def _refresh_state(self) -> None:
        connected = ui.context.client.has_socket_connection
        if connected and time.monotonic() >= self._state_due:
            self._state_due = self._controller.due(SAMPLE_PERIOD)
            await self._show(await self._controller.poll())

    async def _show(self, state: PageState) -> None:
        self._header.show(state)
        self._drive.show(state)
        self._colours.show(state)
        self._state.show(state)
        await self._draw.show(state)
        if time.monotonic() >= self._facts_due:
            self._facts_due = self._controller.due(FACTS_PERIOD)
            if (ratio := self._views[0].ratio) is not None:
                self._desk.style(f"--ratio: {ratio:.4f}")
            for view in self._views:
                view.describe(state)
            self._state.show_facts(state)

    def _on_arrow(self, event: events.KeyEventArguments) -> None:
        if event.action.keydown and (event.key.arrow_left or event.key.arrow_right):
            for view in self._views:
                view.step((10 if event.modifiers.shift else 1) * (-1) ** event.key.arrow_left)

    async def _on_key(self, event: events.KeyEventArguments) -> None:
        modified = event.modifiers.ctrl or event.modifiers.alt or event.modifiers.meta
        if not event.action.keydown or modified:
            return
        key = event.key.name.lower()
        if self._tab == DRAW and key in "sh":
            await (self._draw.start() if key == "s" else self._draw.pause())
        elif self._tab == FIRST_TAB and key in [str(n) for n in range(1, len(TOOLS) + 1)]:
            self._colours.choose_tool(list(TOOLS)[int(key) - 1])
        elif key == "s":
            await self._drive.start()
        elif key == "h":
            await self._drive.hold()
        elif key == "p":
            self._colours.toggle_pause()
        elif key == "u":
            await self._colours.undo()
        elif key == "m":
            self._colours.toggle_mask()
        elif key == "d":
            self._header.toggle_dark()
