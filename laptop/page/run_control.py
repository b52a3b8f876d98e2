"""Runs that are ordered from the page: where the tip is to go; start, hold and stop."""

from __future__ import annotations

import math
import threading
from collections.abc import Callable, Mapping, Sequence

from laptop.page.brick_call import BrickCall, StartBrick
from laptop.page.brick_link import BrickLink
from laptop.page.camera_feed import CameraFeed
from laptop.page.colour_edits import ColourEdits
from laptop.page.repeated_stop import RepeatedStop
from laptop.page.run_goal import RunGoal, thinned
from laptop.page.run_states import (
    ORDERED_HERE,
    RUN_IS_ON,
    TRANSITIONS,
    RunAction,
    RunEvent,
    RunState,
    next_state,
)
from laptop.page.silence import SilenceCause
from laptop.page.snapshots import DEFAULTS, points
from laptop.see.serve.pipeline import Point
from laptop.see.serve.server_state import ServerState as LinkState
from shared.arm_description import ArmError
from shared.messages import BUDGET, TOLERANCE, Start, Status
from shared.run_options import check_options, usual_mode
from shared.verdicts import CONVERGED

START_TIMEOUT = 3.0
"""Time after a start, s, within which the brick begins if it does at all."""

_BUSY = "a run is on; hold or stop it first"
_DRAWING = "a drawing is on; abort it first"


class RunControl:
    """The goal, and the runs to it; `laptop.page.run_states` has the protocol as a table.

    Orders answer with "", or in one line with the reason why not.

    Args:
        cameras: feeds by camera name.
        colours: has the markers that are looked for.
        link: to the brick.
        now: clock of the frames, s.
        start_on_brick: what a click does to have a real brick; None: there is nothing to click.

    Attributes:
        note: last thing to tell about the link or the run, or "".
        state: of the protocol.
        lock: held while an order is carried out: one after the other.
        is_drawing: tells whether a drawing is on, which no run may disturb.
        on_stop: is told of every STOP, and why.
    """

    def __init__(
        self,
        cameras: Mapping[str, CameraFeed],
        colours: ColourEdits,
        link: BrickLink,
        now: Callable[[], float],
        start_on_brick: StartBrick | None = None,
    ) -> None:
        self._goal = RunGoal(cameras, colours)
        self._link = link
        self._now = now
        self.lock = threading.RLock()
        self.brick_call = BrickCall(start_on_brick, link)
        self.is_drawing: Callable[[], bool] = lambda: False
        self.on_stop: Callable[[str], None] = lambda reason: None
        self._has_several_cameras = len(cameras) > 1
        self.note = ""
        self.state = RunState.IDLE
        self._options = DEFAULTS
        self._sent_at = -math.inf  # s, the last start
        self._run_before = 0  # number of the brick's last run by then
        self._order = 0  # number of the last order, of which each waypoint has a start
        self._recorded: tuple[int, int] | None = None  # order, run before: until its verdict
        self._repeated_stop = RepeatedStop(link)
        self._actions: dict[RunAction, Callable[[LinkState], None]] = {
            RunAction.SEND_STOP: self._send_stop,
            RunAction.DROP_PATH_SEND_STOP: self._drop_path_send_stop,
            RunAction.REPEAT_STOP: self._repeat_stop,
            RunAction.SEND_NEXT_START: self._send_next_start,
            RunAction.END_PATH: self._end_path,
            RunAction.REPORT_NO_RUN: self._report_no_run,
        }

    def call_brick(self) -> str:
        """Run the servo's program on the real brick, over ssh; return why not, or ""."""
        with self.lock:
            why = self.brick_call.begin()
            self.note = why or "calling the brick over ssh; that takes a brick half a minute"
            return why

    # What is on

    @property
    def aims(self) -> dict[str, Point]:
        """Goal of each camera, (u, v) px; {}: the goal's marker is the goal."""
        return self._goal.aims

    @property
    def left(self) -> int:
        """Number of waypoints still to come."""
        return self._goal.left

    def ahead(self, camera: str) -> tuple[Point, ...]:
        """Return the waypoints still to come in a camera's picture, (u, v) px."""
        return self._goal.ahead(camera)

    @property
    def follows(self) -> bool:
        """Return True if the run was ordered here and goes after a goal that moves."""
        return self._recorded is not None and self._options.follow

    @property
    def is_driven(self) -> bool:
        """Return True if a run is on that was ordered here."""
        return self.state in ORDERED_HERE

    @property
    def is_fixed(self) -> bool:
        """Return True if the command line has fixed the goal."""
        return self._goal.is_fixed

    def running(self, link: LinkState | None = None) -> bool:
        """Return True if a run is on, or was ordered a moment ago."""
        return next_state(self.state, self._event(link or self._link.state())) in RUN_IS_ON

    def orders_of(self, status: Status) -> tuple[int, Start | None]:
        """Return the number and the options of the order that a status belongs to.

        (0, None) if its run was not ordered here.  With its verdict the run is over here, too.
        """
        number, before = self._recorded or (0, status.run)
        if status.run <= before:
            return 0, None
        if status.verdict:
            self._recorded = None
        return number, self._options

    # Orders

    def aim(self, camera: str, u: float, v: float) -> str:
        """Set the goal to a pixel (u, v), px, of a camera."""
        return self._aim(camera, [(u, v)])

    def follow(self, camera: str, points: Sequence[Point]) -> str:
        """Set the goal to a path of points (u, v), px, in the picture of the only camera."""
        if self._has_several_cameras:
            return "a path is drawn in one picture; with several cameras aim at a point in each"
        return self._aim(camera, thinned(points))

    def aim_at_marker(self) -> str:
        """Set the goal to the goal's marker."""
        with self.lock:
            if self._refuses(RunEvent.AIM):
                return _BUSY
            self._handle(RunEvent.AIM)
            self._goal.aim_at_marker()
            self.note = ""
            return ""

    def start(
        self,
        method: str = DEFAULTS.method,
        mode: str = "",
        rows: str = DEFAULTS.rows,
        tolerance: float = DEFAULTS.tolerance,
        budget: float = DEFAULTS.budget,
        follow: bool = DEFAULTS.follow,
    ) -> str:
        """Send the tip to the goal, or on along the path.

        Args:
            method: name of the control method, see `shared.run_options`.
            mode: a word, see there; "": as is usual with the method.
            rows: a word, see there.
            tolerance: distance from the goal, px, that is near enough.
            budget: time for the run, s.
            follow: the goal's marker moves.
        """
        for what, value, (least, most, unit) in (
            ("tolerance", tolerance, TOLERANCE), ("budget", budget, BUDGET),
        ):  # fmt: skip
            if not least <= value <= most:
                return f"{what} {value:g}: from {least:g} to {most:g} {unit}"
        with self.lock:
            if self._refuses(RunEvent.START):
                return _BUSY
            if self.is_drawing():
                return _DRAWING
            if why := self._goal.why_none():
                return why
            mode = mode or usual_mode(method)
            options = Start(method, mode, rows, tolerance, budget, follow, goals=dict(self.aims))
            try:
                check_options(options, self._joint_count())
            except ArmError as error:
                return str(error)
            self._options = options
            self._order += 1
            if why := self._send_start():
                return why
            self._handle(RunEvent.START)
            return ""

    def hold(self, by: str = "") -> str:
        """End the run; the arm is held where it is, and a start goes on from there.

        Args:
            by: who holds it, for people; or "".
        """
        return self._stop(RunEvent.HOLD, "held from the page" + (f" by {by}" if by else ""))

    def stop(self, by: str = "") -> str:
        """End the run; the arm is held, and a path is given up.

        Args:
            by: who stops it, for people; or "".
        """
        reason = "stopped from the page" + (f" by {by}" if by else "")
        self.on_stop(reason)
        return self._stop(RunEvent.STOP, reason)

    def hold_on_timeout(self, silence: float, why: SilenceCause) -> None:
        """Hold a run that was ordered here, because no page is heard.

        Args:
            silence: time since one was, s.
            why: that is so.
        """
        with self.lock:
            if self.is_driven:
                reason = why.text(silence)
                self._stop(RunEvent.HOLD, f"held: {reason}. {why.advice}")
                self.note = f"{reason}: held; Start goes on. {why.advice}"

    # Protocol

    def poll(self) -> None:
        """Handle the brick's status, and do what is due; to be called at every heartbeat."""
        with self.lock:
            link = self._link.state()
            self._handle(self._event(link), link)

    def _event(self, link: LinkState) -> RunEvent:
        """Return the event that the link's state is, as seen from the present state."""
        status = link.status
        ordered = self.state is RunState.ORDERED
        if link.client is None:
            return RunEvent.UNLINKED
        if ordered and (status is None or status.run <= self._run_before):
            overdue = self._now() - self._sent_at >= START_TIMEOUT
            return RunEvent.OVERDUE if overdue else RunEvent.SILENT
        if status is None:
            return RunEvent.SILENT
        if status.verdict == "":
            return RunEvent.RUN_ON
        arrived = status.verdict == CONVERGED and status.run == self._run_before + 1
        if arrived and self.left and (ordered or self.state is RunState.RUNNING):
            return RunEvent.ARRIVED
        return RunEvent.ENDED

    def _handle(self, event: RunEvent, link: LinkState | None = None) -> None:
        """Make the transition of an event, if there is one, and then its action."""
        transition = TRANSITIONS.get((self.state, event))
        if transition is None:
            return
        self.state, action = transition
        if action is not RunAction.NONE:
            self._actions[action](link or self._link.state())

    def _refuses(self, order: RunEvent) -> bool:
        """Return True if the table has no row for an order; else handle the brick's status."""
        link = self._link.state()
        event = self._event(link)
        if (next_state(self.state, event), order) not in TRANSITIONS:
            return True
        self._handle(event, link)
        return False

    def _stop(self, order: RunEvent, reason: str) -> str:
        with self.lock:
            self._repeated_stop.begin(reason)
            self._handle(order)
            if self._repeated_stop.was_sent:
                return ""
        return "no brick is connected; it is stopped as soon as it is back"

    # Actions

    def _send_stop(self, link: LinkState) -> None:
        self._repeated_stop.send()

    def _drop_path_send_stop(self, link: LinkState) -> None:
        self._goal.drop_path()
        self.note = ""
        self._repeated_stop.send()

    def _repeat_stop(self, link: LinkState) -> None:
        self._repeated_stop.repeat(link.status)

    def _send_next_start(self, link: LinkState) -> None:
        self._goal.go_on()
        self.note = self._send_start()
        self._handle(RunEvent.NEXT_NOT_SENT if self.note else RunEvent.NEXT_SENT)

    def _end_path(self, link: LinkState) -> None:
        if self.left:
            self.note = f"the path ends here, {points(self.left)} before its end"

    def _report_no_run(self, link: LinkState) -> None:
        self.note = "the brick did not begin; does its program run with --wait?"
        self._recorded = None

    def _send_start(self) -> str:
        link = self._link.state()
        if link.client is None:
            return "no brick is connected; type the command below on it"
        run = link.status.run if link.status else 0
        self._options = self._options._replace(goals=dict(self.aims))
        if not self._link.send(self._options):
            return "the link has just broken; it mends by itself, then start again"
        self._sent_at, self._run_before = self._now(), run
        self._recorded = self._order, run
        self._goal.use()
        self.note = ""
        return ""

    # Goals

    def _aim(self, camera: str, points: Sequence[Point]) -> str:
        """Set the goal to pixels (u, v), px, of a camera, one after the other."""
        with self.lock:
            if self._refuses(RunEvent.AIM):
                return _BUSY
            if why := self._goal.why_not(camera, points):
                return why
            self._handle(RunEvent.AIM)
            self.note = ""
            self._goal.aim(camera, points)
            return ""

    def _joint_count(self) -> int:
        """Return the number of joints of the brick's arm; 0 while that is not known."""
        status = self._link.state().status
        return len(status.q) if status else 0
