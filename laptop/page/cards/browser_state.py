"""The choices made in one browser, which the cards of its page share."""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Concatenate, NamedTuple, ParamSpec

from nicegui import ui

from laptop.page.async_controller import AsyncController
from laptop.page.interface import (
    ORDER_LIFETIME,
    ColourCalls,
    DrawCalls,
    RunCalls,
    SteeringCalls,
)
from laptop.page.marker_text import marker_title
from laptop.page.rpc import RpcError
from laptop.page.steering import browser_title
from laptop.see.serve.pipeline import Point
from shared.messages import EFFECTOR

P = ParamSpec("P")


class Tool(NamedTuple):
    """A use of the pointer in a camera's image: its name and its explanation, for people."""

    name: str
    explanation: str


AIM, PICK, ADD, REMOVE, DRAW = "aim", "pick", "add", "remove", "draw"
TOOLS = {
    AIM: Tool("Aim", "Click the goal; drag a path for the tip to follow."),
    PICK: Tool("Pick", "Click a marker, or drag a box into it: this is its colour."),
    ADD: Tool("Add", "Click what the marker's colour should take in, too."),
    REMOVE: Tool("Remove", "Click what is wrongly taken for the marker."),
}
COLOUR_EDITS = {PICK: ColourCalls.pick, ADD: ColourCalls.add, REMOVE: ColourCalls.remove}
"""Edit of a marker's colour that a tool makes."""


@dataclass
class BrowserState:
    """One browser's choices, and its connection to the tracker.

    Attributes:
        controller: the tracker's.
        browser: its number.
        name: what it is, for people.
        age: returns how old, s, what it has seen may be.
        tool: what the pointer does in an image, a key of TOOLS; or DRAW: it has the drawing.
        marker: name of the marker whose colour is learned.
        mask: name of the marker whose pixels are shown, or "".
        windows: whether search windows are shown.
        paused: whether the images stand still.
        folds: by title whether what folds away is open, as far as a hand was at it.
        show_tab: shows the tab "drive" or "draw".
    """

    controller: AsyncController
    browser: int = 0
    name: str = ""
    age: Callable[[], float] = field(default=lambda: 0.0)
    tool: str = AIM
    marker: str = EFFECTOR
    mask: str = ""
    windows: bool = True
    paused: bool = False
    folds: dict[str, bool] = field(default_factory=dict)
    show_tab: Callable[[str], None] = field(default=lambda tab: None)

    def warn(self, why: str) -> None:
        """Show the user why something was not done; "" shows nothing."""
        if why:
            ui.notify(why, type="warning", position="bottom", timeout=6000, multi_line=True)

    @property
    def title(self) -> str:
        """This browser's number and what it is, for people."""
        return browser_title(self.browser, self.name)

    @property
    def steers(self) -> bool:
        """True if this browser gives the orders."""
        state = self.controller.state
        return state is not None and state.driver == self.browser

    async def order(
        self,
        method: Callable[Concatenate[RunCalls, P], str],
        *args: P.args,
        **kwargs: P.kwargs,
    ) -> bool:
        """Give an order, or show why not; return True if it was carried out."""
        return await self._done(partial(self.controller.call, method, *args, **kwargs))

    async def draw(
        self,
        method: Callable[Concatenate[DrawCalls, P], str],
        *args: P.args,
        **kwargs: P.kwargs,
    ) -> bool:
        """Change the drawing, or show why not; return True if it was changed."""
        return await self._done(partial(self.controller.call_slowly, method, *args, **kwargs))

    async def edit(
        self,
        method: Callable[Concatenate[ColourCalls, P], str],
        *args: P.args,
        **kwargs: P.kwargs,
    ) -> bool:
        """Change a marker's colour, or show why not; return True if it was changed."""
        return await self._done(partial(self.controller.call_slowly, method, *args, **kwargs))

    async def _done(self, do: Callable[[], Awaitable[str]]) -> bool:
        try:
            why = await self._why_not() or await do()
        except RpcError as error:
            why = f"the tracker could not do this ({error}); look, then do it again"
        self.warn(why)
        return not why

    async def take_over(self) -> None:
        """Steer from now on."""
        if why := self._why_late():
            self.warn(why)
        else:
            await self.controller.call(SteeringCalls.take_over, self.browser, self.name)

    async def _why_not(self) -> str:
        """Return why this browser gives no orders just now, or ""."""
        return self._why_late() or await self.controller.call(
            SteeringCalls.claim, self.browser, self.name
        )

    def _why_late(self) -> str:
        """Return why what was pressed is not done, or "": browsers send on what had to wait."""
        if self.age() > ORDER_LIFETIME:
            return "the page was cut off when this was pressed; look, then do it again"
        return ""

    async def apply_tool(self, camera: str, index: int, points: Sequence[Point]) -> None:
        """Use the chosen tool in an image.

        Args:
            camera: its name.
            index: number of the frame.
            points: a click, or the points of a drag, px.
        """
        if self.tool == AIM:
            if len(points) > 1:
                await self._drag(camera, list(points))
            else:
                await self.order(RunCalls.aim, camera, *points[0])
        else:
            where = (*points[0], *points[-1]) if len(points) > 1 else points[0]
            edit = COLOUR_EDITS[self.tool]
            if await self.edit(edit, self.marker, camera, index, where):
                message = f"{marker_title(self.marker)}: kept"
                ui.notify(message, type="positive", position="bottom", timeout=1500)

    async def _drag(self, camera: str, points: list[Point]) -> None:
        """Make a drawing of a dragged path, where that can be; else the tip goes after it."""
        state = self.controller.state
        if state and camera not in state.drawing.unmapped and self.controller.feeds:
            if await self.draw(DrawCalls.trace, camera, points):
                self.show_tab(DRAW)
        elif await self.order(RunCalls.follow, camera, points):
            ui.notify(
                "The tip goes after this path goal by goal: where the table is in the picture is "
                "not known. To draw it in one go, look around first, in the tab Draw.",
                position="bottom", timeout=6000, multi_line=True,
            )  # fmt: skip


BROWSERS = (
    ("Edg", "Edge"), ("OPR", "Opera"), ("Firefox", "Firefox"), ("Chrome", "Chrome"),
    ("Safari", "Safari"),
)  # fmt: skip
SYSTEMS = ("Android", "iPhone", "iPad", "Windows", "Mac", "Linux")
"""Words of a User-Agent, the more special ones first: most browsers claim to be others, too."""


def browser_name(user_agent: str) -> str:
    """Return a browser's name for people from its User-Agent; "" if unknown."""
    browser = next((name for word, name in BROWSERS if word in user_agent), "")
    system = next((word for word in SYSTEMS if word in user_agent), "")
    return " on ".join(filter(None, (browser, system)))
