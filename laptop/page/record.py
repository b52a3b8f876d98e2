"""What the tracker's side knows of the brick's last runs, so that there can be a report of each.

It is no more than the brick says of itself and the cameras see, and the same with any brick.
"""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import cv2
import numpy as np

from laptop.vision.view import AnnotatedFrame
from shared.messages import EFFECTOR, GOAL, LEAST_CONFIDENCE, Start, Status
from shared.verdicts import READY

KEPT = 10
"""So many records are kept."""
MOST = 4000
"""A curve of more points is thinned to half of them."""
QUALITY = 90
"""Of a JPEG."""

Curve = list[tuple[float, float, float]]
"""Of (s, u, v)."""


class Told(NamedTuple):
    """What the brick said at time t (s), see `Status`."""

    t: float
    error: float | None
    e: Mapping[str, float]
    q: tuple[float, ...]
    condition: float | None
    moves: int


@dataclass
class Run:
    """One run of the brick; times in s on the tracker's clock.

    Attributes:
        number: the brick's.
        orders: None where they were not given here.
        began: when it was first heard of.
        ended: None while it goes on.
        verdict: "" while it goes on, and where its end was not heard.
        reason: of the verdict.
        told: what the brick said, in order.
        held: (s, why) whenever it was held on the way.
        tips: per camera where the tip was seen.
        goals: per camera where the goal was.
    """

    number: int
    orders: Start | None
    began: float
    ended: float | None = None
    verdict: str = ""
    reason: str = ""
    told: list[Told] = field(default_factory=list)
    held: list[tuple[float, str]] = field(default_factory=list)
    tips: dict[str, Curve] = field(default_factory=dict)
    goals: dict[str, Curve] = field(default_factory=dict)

    def copy(self) -> Run:
        """As it is now."""
        tips = {camera: list(curve) for camera, curve in self.tips.items()}
        goals = {camera: list(curve) for camera, curve in self.goals.items()}
        return replace(self, told=list(self.told), held=list(self.held), tips=tips, goals=goals)


@dataclass
class Record:
    """One run, or those along one path.

    Attributes:
        number: from 1 on; the brick counts anew whenever its program starts.
        when: it began, s since 1970.
        brick: its address.
        runs: in order.
        pictures: per camera the last one, as JPEG.
    """

    number: int
    when: float
    brick: str
    runs: list[Run]
    pictures: dict[str, bytes] = field(default_factory=dict)


class Summary(NamedTuple):
    """A record in short: its number, when it began (s since 1970), the verdict so far."""

    number: int
    when: float
    verdict: str


class Recorder:
    """Keeps records; one thread at a time.

    Args:
        wall: the time of day, s since 1970.
    """

    def __init__(self, wall: Callable[[], float] = time.time) -> None:
        self._wall = wall
        self._records: deque[Record] = deque(maxlen=KEPT)
        self._frames: dict[str, np.ndarray] = {}  # the last ones of the newest record
        self._last: Status | None = None
        self._order = 0  # that the newest record obeys; 0: none

    def hear(self, status: Status, t: float, brick: str, order: int, orders: Start | None) -> None:
        """What the brick says.

        Args:
            t: when it was heard, s.
            brick: its address.
            order: number of the order that it obeys, 0 if it is none from here; the runs of one
                order make one record.
            orders: how it was to be done; None if they are not from here.
        """
        last, self._last = self._last, status
        if status is last:
            return
        same = last is not None and last.run == status.run
        if status.verdict == "":
            if self._going and (not same or (last and last.moves > status.moves)):
                self._end(t, "", "")
            if not self._going:
                self._begin(status, t, brick, order, orders)
            self._add(status, t)
        elif self._going and same:
            self._add(status, t)
            self._end(t, status.verdict, status.reason)
        else:
            if self._going:
                self._end(t, "", "")
            if last is not None and not same and status.verdict != READY:
                self._begin(status, t, brick, order, orders)  # it was over in no time
                self._add(status, t)
                self._end(t, status.verdict, status.reason)

    def lose(self, t: float) -> None:
        """The brick is gone for good: how its run ended will not be heard; t in s."""
        if self._going:
            self._end(t, "", "")

    def see(self, views: Mapping[str, AnnotatedFrame | None]) -> None:
        """What the cameras see."""
        run = self._going
        if run is None:
            return
        for camera, view in views.items():
            if view is None:
                continue
            frame = view.frame
            self._frames[camera] = frame.image
            tip, goal = view.found.get(EFFECTOR), view.found.get(GOAL)
            if tip and tip.confidence >= LEAST_CONFIDENCE:
                _keep(run.tips.setdefault(camera, []), (frame.t, tip.u, tip.v))
            if run.orders and run.orders.goals:
                if camera in run.orders.goals and camera not in run.goals:
                    run.goals[camera] = [(frame.t, *run.orders.goals[camera])]
            elif GOAL in view.fixed:
                run.goals[camera] = [(frame.t, *view.fixed[GOAL][:2])]
            elif goal and goal.confidence >= LEAST_CONFIDENCE:
                _keep(run.goals.setdefault(camera, []), (frame.t, goal.u, goal.v))

    def summaries(self) -> tuple[Summary, ...]:
        """All records, oldest first."""
        return tuple(
            Summary(record.number, record.when, record.runs[-1].verdict) for record in self._records
        )

    def record(self, number: int | None = None) -> Record | None:
        """A record as it is now, None if there is none of this number; the newest by default."""
        for record in reversed(self._records):
            if number in (None, record.number):
                if record is self._records[-1]:
                    self._develop()
                runs = [run.copy() for run in record.runs]
                return replace(record, runs=runs, pictures=dict(record.pictures))
        return None

    @property
    def _going(self) -> Run | None:
        run = self._records[-1].runs[-1] if self._records else None
        return run if run and run.ended is None else None

    def _begin(
        self, status: Status, t: float, brick: str, order: int, orders: Start | None
    ) -> None:
        run = Run(status.run, orders, t)
        if order and order == self._order:
            self._records[-1].runs.append(run)
            return
        number = 1
        if self._records:
            self._develop()
            number = self._records[-1].number + 1
        self._frames = {}
        self._order = order
        self._records.append(Record(number, self._wall(), brick, [run]))

    def _add(self, status: Status, t: float) -> None:
        run = self._records[-1].runs[-1]
        told = Told(t, status.error, status.e, status.q, status.condition, status.moves)
        _keep(run.told, told)
        if not status.verdict and status.reason and (not run.held or run.reason != status.reason):
            _keep(run.held, (t, status.reason))
        run.reason = status.reason

    def _end(self, t: float, verdict: str, reason: str) -> None:
        run = self._records[-1].runs[-1]
        run.ended, run.verdict, run.reason = t, verdict, reason

    def _develop(self) -> None:
        """Make the newest record's pictures; so late because only its last ones are wanted."""
        for camera, image in self._frames.items():
            _, data = cv2.imencode(".jpg", image, (cv2.IMWRITE_JPEG_QUALITY, QUALITY))
            self._records[-1].pictures[camera] = data.tobytes()


def _keep(curve: list, point: tuple) -> None:
    """Add a point of a later time to a curve."""
    if curve and curve[-1][0] >= point[0]:
        return
    curve.append(point)
    if len(curve) > MOST:
        del curve[1:-1:2]
