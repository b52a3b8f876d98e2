"""Runs as they are ordered from the page: where the tip is to go, start, hold and stop."""

from __future__ import annotations

import math
import threading
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from typing import Protocol

from laptop.page.camera_feed import CameraFeed
from laptop.page.colour_edits import ColourEdits
from laptop.page.snapshots import USUAL, points
from laptop.tracking.pipeline import Point
from laptop.tracking.server import ServerState as LinkState
from shared.arm_description import ArmError
from shared.messages import BUDGET, GOAL, TOLERANCE, Start, Status, Stop
from shared.orders import check

ANSWER = 3.0
"""A brick that has not begun so long after a start, s, does not."""
APART = 25.0
"""Between two points of a path, px."""

_BUSY = "a run is on; hold or stop it first"


class Server(Protocol):
    """What is used of the tracking server."""

    def send(self, message: Start | Stop) -> bool: ...  # noqa: D102
    def state(self) -> LinkState: ...  # noqa: D102
    def commands(self) -> list[str]: ...  # noqa: D102


class RunControl:
    """The goal, and the runs to it that the page orders, of which the brick says how they go.

    Orders answer with "", or in one line with the reason why not.

    Args:
        cameras: by name.
        colours: what is looked for.
        server: of the brick, or None.
        now: the clock of the frames, s.

    Attributes:
        aims: per camera where the tip is to go, px; {}: to the goal's marker.
        note: what was last to be said about the link or the run, or "".
        lock: held while an order is carried out: one after the other.
    """

    def __init__(
        self,
        cameras: Mapping[str, CameraFeed],
        colours: ColourEdits,
        server: Server | None,
        now: Callable[[], float],
    ) -> None:
        self._cameras, self._colours = cameras, colours
        self._server = server
        self._now = now
        self.lock = threading.RLock()
        self.aims: dict[str, Point] = {}
        self._path: deque[Point] = deque()
        self._along = ""  # the camera in which the path was drawn
        self._orders = USUAL
        self._ordered: tuple[float, int] | None = None  # when, and the brick's last run by then
        self._awaited = 0  # the run that the rest of a path waits for; 0: none
        self._order = 0  # number of the last start from here
        self._obeyed: tuple[int, int] | None = None  # that number, and the brick's last run by then
        self.note = ""
        self._stopping = ""  # why, until the brick has heard it
        self._stop_told: Status | None = None  # the brick's status when it was last told

    @property
    def left(self) -> int:
        """Points of a path still to come."""
        return len(self._path)

    def ahead(self, camera: str) -> tuple[Point, ...]:
        """Those of them that lie in a camera's picture, px."""
        return tuple(self._path) if camera == self._along else ()

    @property
    def follows(self) -> bool:
        """Whether the run was ordered here, to go after a goal that moves."""
        return self._obeyed is not None and self._orders.follow

    def orders_of(self, status: Status) -> tuple[int, Start | None]:
        """The number and the orders of the run that a status is of; (0, None): not from here.

        With its verdict the run is over here, too.
        """
        number, before = self._obeyed or (0, status.run)
        if status.run <= before:
            return 0, None
        if status.verdict:
            self._obeyed = None
        return number, self._orders

    def aim_at_marker(self) -> str:
        """Let the goal be the goal's marker."""
        with self.lock:
            if self.running():
                return _BUSY
            self.aims, self._path, self._along, self.note = {}, deque(), "", ""
            return ""

    def follow(self, camera: str, points: Sequence[Point]) -> str:
        """Let the goal be a path, point after point, in the picture of the only camera."""
        if len(self._cameras) > 1:
            return "a path is drawn in one picture; with several cameras aim at a point in each"
        return self.aim(camera, _thinned(points))

    def aim(self, camera: str, points: Sequence[Point]) -> str:
        """Let the goal be a pixel of a camera; of several, one after the other."""
        with self.lock:
            if self.running():
                return _BUSY
            view = self._cameras[camera].watcher.view
            if view is None:
                return f"camera {camera} gives no picture to aim in; look at its cable"
            height, width = view.frame.image.shape[:2]
            for u, v in points:
                if not (0 <= u <= width - 1 and 0 <= v <= height - 1):
                    return (
                        f"goal {u:.0f},{v:.0f} is outside the picture; u from 0 to {width - 1}, "
                        f"v from 0 to {height - 1}"
                    )
            self.note = ""
            first, *others = points
            self.aims[camera] = first
            self._path = deque(others)
            self._along = camera if others else ""
            return ""

    def start(self, orders: Start) -> str:
        """Send the tip to the goal, or on along the path; where that is, is known here."""
        for what, value, (least, most, unit) in (
            ("tolerance", orders.tolerance, TOLERANCE), ("budget", orders.budget, BUDGET),
        ):  # fmt: skip
            if not least <= value <= most:
                return f"{what} {value:g}: from {least:g} to {most:g} {unit}"
        with self.lock:
            if self.running():
                return _BUSY
            if why := self._not_aimed():
                return why
            orders = orders._replace(goals=dict(self.aims))
            try:
                check(orders, self._joints())
            except ArmError as error:
                return str(error)
            self._orders = orders
            self._order += 1
            return self._send_start()

    def hold(self) -> str:
        """End the run; the arm is held where it is, and a start goes on from there."""
        with self.lock:
            self._awaited = 0
            return self._send_stop("held from the page")

    def stop(self) -> str:
        """End the run; the arm is held, and a path is given up."""
        with self.lock:
            self._awaited = 0
            self._path, self._along, self.note = deque(), "", ""
            return self._send_stop("stopped from the page")

    def _send_stop(self, reason: str) -> str:
        """Stop, and go on saying so until the brick tells that no run is on."""
        self._ordered = None
        self._stopping, self._stop_told = reason, None
        if self._server and self._server.send(Stop(reason)):
            return ""
        return "no brick is connected; it is stopped as soon as it is back"

    def _insist(self, status: Status) -> None:
        """A stop gets lost with the link, behind which a run may go on by itself."""
        assert self._server is not None
        if status.verdict:
            self._stopping = ""
        elif status is not self._stop_told:
            self._stop_told = status
            self._server.send(Stop(self._stopping))

    def _joints(self) -> int:
        """How many the brick's arm has; 0 while that is not known."""
        status = self._server.state().status if self._server else None
        return len(status.q) if status else 0

    @property
    def is_fixed(self) -> bool:
        """Whether the command line has fixed the goal."""
        return all(
            bool(eye.watcher.view and eye.watcher.view.fixed) for eye in self._cameras.values()
        )

    def _not_aimed(self) -> str:
        """Why there is no goal, or ""."""
        if self.aims:
            missing = [name for name in self._cameras if name not in self.aims]
            if missing:
                return f"click the goal in the picture of camera {' and '.join(missing)}, too"
            return ""
        if not self.is_fixed and GOAL not in (marker.name for marker in self._colours.markers):
            return "there is no goal yet; click one in the picture, or pick a goal marker"
        return ""

    def _send_start(self) -> str:
        link = self._server.state() if self._server else LinkState()
        if self._server is None or link.client is None:
            return "no brick is connected; type the command below on it"
        run = link.status.run if link.status else 0
        self._orders = self._orders._replace(goals=dict(self.aims))
        if not self._server.send(self._orders):
            return "the link has just broken; it mends by itself, then start again"
        self._stopping = ""
        self._ordered = self._now(), run
        self._obeyed = self._order, run
        self._awaited = run + 1 if self._path else 0
        self.note = ""
        return ""

    def running(self, link: LinkState | None = None) -> bool:
        """Whether a run is on, or was ordered a moment ago."""
        if self._server is None:
            return False
        link = link or self._server.state()
        if link.client is None:
            return False
        ordered, status = self._ordered, link.status
        if ordered and (status is None or status.run <= ordered[1]):
            return self._now() - ordered[0] < ANSWER
        return status is not None and (status.verdict == "" or self._goes_on(status))

    def _goes_on(self, status: Status) -> bool:
        """Whether a run has ended where the next point of a path is due."""
        arrived = status.run == self._awaited and status.verdict == "converged"
        return arrived and bool(self._path)

    def go_on(self) -> None:
        """What is due after a run: the next point of a path."""
        if self._server is None:
            return
        link = self._server.state()
        status = link.status
        if self._stopping and link.client and status:
            self._insist(status)
        if self._ordered and not self.running(link):
            if link.client and (status is None or status.run <= self._ordered[1]):
                self.note = "the brick did not begin; does its program run with --wait?"
                self._awaited = 0
                self._obeyed = None
            self._ordered = None
        over = status is not None and status.run >= self._awaited and status.verdict
        if not self._awaited or (link.client and not over):
            return
        if link.client and status and self._goes_on(status):
            self.aims[self._along] = self._path.popleft()
            self._awaited = 0
            self.note = self._send_start()
        else:
            self._awaited = 0
            self.note = f"the path ends here, {points(len(self._path))} before its end"


def _thinned(points: Sequence[Point]) -> list[Point]:
    """The points of a path, no two closer than APART but the last one."""
    kept = [points[0]]
    for point in points[1:]:
        if math.dist(kept[-1], point) >= APART:
            kept.append(point)
    if len(kept) > 1 and math.dist(kept[-1], points[-1]) < APART / 2:
        kept[-1] = points[-1]
    elif kept[-1] != points[-1]:
        kept.append(points[-1])
    return kept
