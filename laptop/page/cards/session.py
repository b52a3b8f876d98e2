"""The choices made in one browser, which the cards of its page share."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

from nicegui import ui

from laptop.page.async_controller import AsyncController
from laptop.page.interface import ColourCalls, RunCalls
from laptop.tracking.pipeline import Point
from shared.messages import EFFECTOR


class Tool(NamedTuple):
    """A use of the pointer in a camera's image: its name and its explanation, for people."""

    name: str
    explanation: str


AIM, PICK, ADD, REMOVE = "aim", "pick", "add", "remove"
TOOLS = {
    AIM: Tool("Aim", "Click the goal; drag a path for the tip to follow."),
    PICK: Tool("Pick", "Click a marker, or drag a box into it: this is its colour."),
    ADD: Tool("Add", "Click what the marker's colour should take in, too."),
    REMOVE: Tool("Remove", "Click what is wrongly taken for the marker."),
}
COLOUR_EDITS = {PICK: ColourCalls.pick, ADD: ColourCalls.add, REMOVE: ColourCalls.remove}
"""Edit of a marker's colour that a tool makes."""


@dataclass
class BrowserSession:
    """One browser's choices, and its way to the tracker.

    Attributes:
        controller: the tracker's.
        tool: what the pointer does in an image, a key of TOOLS.
        marker: name of the marker whose colour is learned.
        mask: name of the marker whose pixels are shown, or "".
        windows: whether search windows are shown.
        paused: whether the images stand still.
    """

    controller: AsyncController
    tool: str = AIM
    marker: str = EFFECTOR
    mask: str = ""
    windows: bool = True
    paused: bool = False

    def warn(self, why: str) -> None:
        """Tell the user why something was not done; "" for nothing."""
        if why:
            ui.notify(why, type="warning", position="bottom", timeout=6000, multi_line=True)

    async def apply_tool(self, camera: str, index: int, points: Sequence[Point]) -> None:
        """Use the chosen tool in an image.

        Args:
            camera: its name; `index`: of the frame.
            points: a click, or the points of a drag, px.
        """
        if self.tool == AIM:
            if len(points) > 1:
                why = await self.controller.call(RunCalls.follow, camera, list(points))
            else:
                why = await self.controller.call(RunCalls.aim, camera, *points[0])
        else:
            where = (*points[0], *points[-1]) if len(points) > 1 else points[0]
            edit = COLOUR_EDITS[self.tool]
            why = await self.controller.call_slowly(edit, self.marker, camera, index, where)
            if not why:
                ui.notify(f"{self.marker}: kept", type="positive", position="bottom", timeout=1500)
        self.warn(why)
