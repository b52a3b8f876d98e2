"""The interface between the page and the tracker: all that a page can see and do.

The tracker's process has a `PageController`, which implements `PageInterface`; the page, in a
process of its own, calls its methods by `laptop.page.rpc`.  Nothing is pushed: a page that does not
ask costs nothing, and no camera ever waits for one.  Orders answer with "", or in one line with the
reason why not.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Protocol, TypeVar

from laptop.drawing.pictures import Tracing
from laptop.page.drawing_snapshots import DrawingSnapshot, InkPoint, Placing
from laptop.page.run_records import RunGroup
from laptop.page.silence import PageReport
from laptop.page.snapshots import DEFAULTS, FrameSnapshot, PageState, PlotSample
from laptop.see.serve.pipeline import Point

# ruff: noqa: D102  (each method has its docstring where it is implemented)


class StatusCalls(Protocol):
    """State, history and reports; implemented by `laptop.page.controller.PageController`."""

    def opened(self) -> None: ...
    def arrived(self) -> None: ...
    def state(self) -> PageState: ...
    def history(self, after: float = -math.inf) -> list[PlotSample]: ...
    def record(self, number: int | None = None) -> RunGroup | None: ...


class FrameCalls(Protocol):
    """Frames of the cameras; implemented by `laptop.page.frames.Frames`."""

    def view(
        self, camera: str, newer_than: int = -1, masks: Sequence[str] = (), within: float = 0.0
    ) -> FrameSnapshot | None: ...
    def still(self, camera: str, index: int, masks: Sequence[str] = ()) -> FrameSnapshot | str: ...
    def pin(self, camera: str, index: int) -> str: ...


class ColourCalls(Protocol):
    """Edits of the markers' colours; implemented by `laptop.page.colour_edits.ColourEdits`."""

    def pick(self, name: str, camera: str, index: int, where: Sequence[float]) -> str: ...
    def add(self, name: str, camera: str, index: int, where: Sequence[float]) -> str: ...
    def remove(self, name: str, camera: str, index: int, where: Sequence[float]) -> str: ...
    def rename(self, name: str, new: str) -> str: ...
    def undo(self) -> str: ...


class RunCalls(Protocol):
    """Goal and runs; implemented by `laptop.page.run_control.RunControl`."""

    def aim(self, camera: str, u: float, v: float) -> str: ...
    def aim_at_marker(self) -> str: ...
    def follow(self, camera: str, points: Sequence[Point]) -> str: ...
    def start(
        self,
        method: str = DEFAULTS.method,
        mode: str = "",
        rows: str = DEFAULTS.rows,
        tolerance: float = DEFAULTS.tolerance,
        budget: float = DEFAULTS.budget,
        follow: bool = DEFAULTS.follow,
    ) -> str: ...
    def call_brick(self) -> str: ...
    def hold(self, by: str = "") -> str: ...
    def stop(self, by: str = "") -> str: ...


class DrawCalls(Protocol):
    """Drawings; implemented by `laptop.page.draw_control.DrawControl`."""

    def load(self, name: str, data: bytes) -> str: ...
    def write(self, text: str) -> str: ...
    def choose(self, name: str) -> str: ...
    def trace(self, camera: str, points: Sequence[Point]) -> str: ...
    def trace_picture(self, tracing: Tracing) -> str: ...
    def hatch(self, areas: bool) -> str: ...
    def place(self, placing: Placing) -> str: ...
    def set_pens(self, pens: str) -> str: ...
    def clear(self) -> str: ...
    def look_around(self) -> str: ...
    def set_marker_height(self, mm: float | None) -> str: ...
    def start(self, dry: bool = False, alone: bool = False) -> str: ...
    def order(self, what: str, value: float | None = None) -> str: ...


class DrawViews(Protocol):
    """Views of a drawing for browsers; implemented by `laptop.page.draw_control.DrawControl`."""

    def drawing(self) -> DrawingSnapshot: ...
    def ink(self, camera: str, version: int, after: int) -> tuple[int, list[InkPoint]]: ...


class SteeringCalls(Protocol):
    """Steering; implemented by `laptop.page.steering.Steering`."""

    def on_status(self, browsers: Mapping[int, float], report: PageReport = ...) -> None: ...
    def report_return(self, stood: float) -> None: ...
    def claim(self, browser: int, name: str) -> str: ...
    def take_over(self, browser: int, name: str) -> None: ...
    def name(self, browser: int) -> str: ...


class AdmissionCalls(Protocol):
    """Login; implemented by `laptop.page.login.Admission`."""

    def redeem(self, token: str) -> str: ...


class PageInterface(StatusCalls, Protocol):
    """Everything that the page may call, in eight groups."""

    @property
    def frames(self) -> FrameCalls: ...
    @property
    def colours(self) -> ColourCalls: ...
    @property
    def runs(self) -> RunCalls: ...
    @property
    def drawings(self) -> DrawCalls: ...
    @property
    def drawing_views(self) -> DrawViews: ...
    @property
    def steering(self) -> SteeringCalls: ...
    @property
    def admission(self) -> AdmissionCalls: ...


Calls = TypeVar(
    "Calls",
    StatusCalls,
    FrameCalls,
    ColourCalls,
    RunCalls,
    DrawCalls,
    DrawViews,
    SteeringCalls,
    AdmissionCalls,
)
"""Group of calls to which an exposed method belongs."""

_GROUPS: dict[type, Callable[[PageInterface], Any]] = {
    StatusCalls: lambda controller: controller,
    FrameCalls: lambda controller: controller.frames,
    ColourCalls: lambda controller: controller.colours,
    RunCalls: lambda controller: controller.runs,
    DrawCalls: lambda controller: controller.drawings,
    DrawViews: lambda controller: controller.drawing_views,
    SteeringCalls: lambda controller: controller.steering,
    AdmissionCalls: lambda controller: controller.admission,
}

EXPOSED_METHODS = {
    f"{group.__name__}.{name}": (part, name)
    for group, part in _GROUPS.items()
    for name in vars(group)
    if not name.startswith("_")
}
"""Exposed methods by the name under which they are called, e.g. "RunCalls.aim"."""

PERISHABLE = {
    f"{group.__name__}.{name}"
    for group in (RunCalls, ColourCalls, DrawCalls)
    for name in vars(group)
    if not name.startswith("_")
} - {"RunCalls.stop"}
"""Orders that are refused when they come late; a stop never is."""
ORDER_LIFETIME = 1.5
"""Time, s, after which an order is late: much may have happened that who gave it has not seen."""


def exposed_method(controller: PageInterface, name: str) -> Callable[..., Any]:
    """Return a controller's method.

    Args:
        controller: whose method.
        name: key of EXPOSED_METHODS.

    Raises:
        KeyError: this method is not exposed.
    """
    part, method = EXPOSED_METHODS[name]
    return getattr(part(controller), method)
