"""Records of the brick's last runs, so that there can be a report of each.

They hold no more than the brick says of itself and the cameras see, the same with any brick.
"""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import cv2
import numpy as np

from laptop.see.markers.view import AnnotatedFrame
from shared.messages import EFFECTOR, GOAL, LEAST_CONFIDENCE, Start, Status
from shared.verdicts import READY

MAX_GROUPS = 10
"""Greatest number of groups of runs that are stored."""
MAX_POINTS = 4000
"""A curve of more points is thinned to half of them."""
JPEG_QUALITY = 90
"""Quality of the images, 0 to 100."""

Curve = list[tuple[float, float, float]]
"""Points (s, u px, v px)."""


class StatusSample(NamedTuple):
    """The brick's status at time t (s), see `Status`."""

    t: float
    error: float | None
    e: Mapping[str, float]
    q: tuple[float, ...]
    condition: float | None
    moves: int


@dataclass
class RunRecord:
    """One run of the brick; times in s on the tracker's clock.

    Attributes:
        number: the brick's.
        orders: None where they were not given here.
        began: when it was first heard of.
        ended: None while it goes on.
        verdict: "" while it goes on, and where its end was not heard.
        reason: of the verdict.
        samples: of the brick's status, in order.
        holds: (s, why) whenever it was held on the way.
        tips: per camera the tip as it was seen.
        goals: per camera the goal.
    """

    number: int
    orders: Start | None
    began: float
    ended: float | None = None
    verdict: str = ""
    reason: str = ""
    samples: list[StatusSample] = field(default_factory=list)
    holds: list[tuple[float, str]] = field(default_factory=list)
    tips: dict[str, Curve] = field(default_factory=dict)
    goals: dict[str, Curve] = field(default_factory=dict)

    def copy(self) -> RunRecord:
        """Return a copy that changes no more."""
        tips = {camera: list(curve) for camera, curve in self.tips.items()}
        goals = {camera: list(curve) for camera, curve in self.goals.items()}
        return replace(
            self, samples=list(self.samples), holds=list(self.holds), tips=tips, goals=goals
        )


@dataclass
class RunGroup:
    """One run, or those along one path.

    Attributes:
        number: from 1 on; the brick counts anew whenever its program starts.
        when: it began, s since 1970.
        brick: its address.
        runs: in order.
        images: per camera the last one, as JPEG.
    """

    number: int
    when: float
    brick: str
    runs: list[RunRecord]
    images: dict[str, bytes] = field(default_factory=dict)


class RunSummary(NamedTuple):
    """A group of runs in short: its number, when it began (s since 1970), the verdict so far."""

    number: int
    when: float
    verdict: str


class RunRecorder:
    """Recorder of the last groups of runs; for one thread at a time.

    Args:
        wall_clock: returns the time of day, s since 1970.
    """

    def __init__(self, wall_clock: Callable[[], float] = time.time) -> None:
        self._wall_clock = wall_clock
        self._groups: deque[RunGroup] = deque(maxlen=MAX_GROUPS)
        self._frames: dict[str, np.ndarray] = {}  # the last ones of the newest group
        self._last_status: Status | None = None
        self._order = 0  # that the newest group obeys; 0: none

    def receive(
        self, status: Status, t: float, brick: str, order: int, orders: Start | None
    ) -> None:
        """Take up the brick's status.

        Args:
            status: the newest.
            t: when it was received, s.
            brick: its address.
            order: number of the order that it obeys, 0 if it is none from here; the runs of one
                order make one group.
            orders: how it was to be done; None if they are not from here.
        """
        last, self._last_status = self._last_status, status
        if status is last:
            return
        same = last is not None and last.run == status.run
        if status.verdict == "":
            if self._current_run and (not same or (last and last.moves > status.moves)):
                self._end(t, "", "")
            if not self._current_run:
                self._begin(status, t, brick, order, orders)
            self._add(status, t)
        elif self._current_run and same:
            self._add(status, t)
            self._end(t, status.verdict, status.reason)
        else:
            if self._current_run:
                self._end(t, "", "")
            if last is not None and not same and status.verdict != READY:
                self._begin(status, t, brick, order, orders)  # it was over in no time
                self._add(status, t)
                self._end(t, status.verdict, status.reason)

    def lose_brick(self, t: float) -> None:
        """End the run at t (s): the brick is gone for good, its verdict will not be received."""
        if self._current_run:
            self._end(t, "", "")

    def add_views(self, views: Mapping[str, AnnotatedFrame | None]) -> None:
        """Take up what each camera sees."""
        run = self._current_run
        if run is None:
            return
        for camera, view in views.items():
            if view is None:
                continue
            frame = view.frame
            self._frames[camera] = frame.image
            tip, goal = view.found.get(EFFECTOR), view.found.get(GOAL)
            if tip and tip.confidence >= LEAST_CONFIDENCE:
                _append(run.tips.setdefault(camera, []), (frame.t, tip.u, tip.v))
            if run.orders and run.orders.goals:
                if camera in run.orders.goals and camera not in run.goals:
                    run.goals[camera] = [(frame.t, *run.orders.goals[camera])]
            elif GOAL in view.fixed:
                run.goals[camera] = [(frame.t, *view.fixed[GOAL][:2])]
            elif goal and goal.confidence >= LEAST_CONFIDENCE:
                _append(run.goals.setdefault(camera, []), (frame.t, goal.u, goal.v))

    def summaries(self) -> tuple[RunSummary, ...]:
        """Return all groups in short, oldest first."""
        return tuple(
            RunSummary(group.number, group.when, group.runs[-1].verdict) for group in self._groups
        )

    def group(self, number: int | None = None) -> RunGroup | None:
        """Return a group as it is now, by default the newest; None if there is none such."""
        for group in reversed(self._groups):
            if number in (None, group.number):
                if group is self._groups[-1]:
                    self._encode_images()
                runs = [run.copy() for run in group.runs]
                return replace(group, runs=runs, images=dict(group.images))
        return None

    @property
    def _current_run(self) -> RunRecord | None:
        """The run that goes on."""
        run = self._groups[-1].runs[-1] if self._groups else None
        return run if run and run.ended is None else None

    def _begin(
        self, status: Status, t: float, brick: str, order: int, orders: Start | None
    ) -> None:
        run = RunRecord(status.run, orders, t)
        if order and order == self._order:
            self._groups[-1].runs.append(run)
            return
        number = 1
        if self._groups:
            self._encode_images()
            number = self._groups[-1].number + 1
        self._frames = {}
        self._order = order
        self._groups.append(RunGroup(number, self._wall_clock(), brick, [run]))

    def _add(self, status: Status, t: float) -> None:
        run = self._groups[-1].runs[-1]
        sample = StatusSample(t, status.error, status.e, status.q, status.condition, status.moves)
        _append(run.samples, sample)
        if not status.verdict and status.reason and (not run.holds or run.reason != status.reason):
            _append(run.holds, (t, status.reason))
        run.reason = status.reason

    def _end(self, t: float, verdict: str, reason: str) -> None:
        run = self._groups[-1].runs[-1]
        run.ended, run.verdict, run.reason = t, verdict, reason

    def _encode_images(self) -> None:
        """Make the newest group's images; so late because only its last ones are wanted."""
        for camera, image in self._frames.items():
            _, data = cv2.imencode(".jpg", image, (cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY))
            self._groups[-1].images[camera] = data.tobytes()


def _append(curve: list[Any], point: Any) -> None:
    """Add a point to a curve if its time is later, and thin a curve that gets too long."""
    if curve and curve[-1][0] >= point[0]:
        return
    curve.append(point)
    if len(curve) > MAX_POINTS:
        del curve[1:-1:2]
