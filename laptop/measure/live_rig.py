"""Real cameras, and a brick that waits for jobs over the link."""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from laptop.measure.run_data import BadMeasurement, RunData, Sights
from laptop.see.serve.job_offer import JobOffer
from laptop.see.serve.pipeline import CameraPipeline
from laptop.see.serve.server import TrackingServer
from shared.arm_description import Arm
from shared.job_messages import ABORT, DONE, ENDS, JobStatus, Order
from shared.messages import EFFECTOR, LEAST_CONFIDENCE, Observation, Stop

POLL_PERIOD = 0.05
"""Period of checks of the job's progress, s."""
READ_TIMEOUT = 0.2
"""Longest wait of a pipeline for one frame, s."""
BEGIN_TIMEOUT = 10.0
"""Longest silence of a brick about a job since it was offered or linked anew, s; then it will not
do it."""
LOG_GRACE = 2.0
"""Time after a job's end for which its log may still come in, s."""
JOIN_TIMEOUT = 2.0


class SightCollector:
    """Passes every observation on to the link, and stores those of a while.

    Whoever waits, for a brick or a sheet of paper, may do so for hours: then nothing is stored.

    Args:
        server: of the brick.
    """

    def __init__(self, server: TrackingServer) -> None:
        self._server = server
        self._lock = threading.Lock()
        self._seen: dict[str, list[tuple[float, float, float]]] = {}
        self._is_recording = False

    def publish(self, observation: Observation) -> None:
        """Pass on an observation, and store it while a run is recorded."""
        seen = observation.markers.get(EFFECTOR)
        u, v = seen[:2] if seen and seen[2] >= LEAST_CONFIDENCE else (math.nan, math.nan)
        with self._lock:
            if self._is_recording:
                self._seen.setdefault(observation.camera, []).append((observation.t, u, v))
        self._server.publish(observation)

    def begin(self) -> None:
        """Store what is seen from now on."""
        with self._lock:
            self._seen, self._is_recording = {}, True

    def finish(self) -> dict[str, Sights]:
        """Return what was seen since it began, by camera, and store no more."""
        with self._lock:
            seen, self._seen, self._is_recording = self._seen, {}, False
        found = {}
        for camera, rows in seen.items():
            values = np.array(rows)
            found[camera] = Sights(values[:, 0], values[:, 1:])
        return found


class LiveRig:
    """An arm whose brick does jobs that are offered over the link, before real cameras.

    Args:
        arm: as it is described.
        pipelines: one for each camera; they publish to `collector`.
        server: of the brick.
        collector: of what they see.
        on_status: called with the JobStatus while a job is done.
        brick_ended: returns why a brick that was started for this has ended, "" while it has not;
            None: none was.
    """

    def __init__(
        self,
        arm: Arm,
        pipelines: Sequence[CameraPipeline],
        server: TrackingServer,
        collector: SightCollector,
        on_status: Callable[[JobStatus], None] = lambda status: None,
        brick_ended: Callable[[], str] | None = None,
    ) -> None:
        self.arm = arm
        self._pipelines, self._server, self._collector = pipelines, server, collector
        self._on_status, self._brick_ended = on_status, brick_ended
        self._over = threading.Event()
        self._error: BaseException | None = None

    @contextmanager
    def watching(self) -> Iterator[LiveRig]:
        """Let the cameras look while the block runs."""
        threads = [
            threading.Thread(target=self._watch, args=(pipeline,), daemon=True)
            for pipeline in self._pipelines
        ]
        for thread in threads:
            thread.start()
        try:
            yield self
        finally:
            self._over.set()
            for thread in threads:
                thread.join(JOIN_TIMEOUT)

    def _watch(self, pipeline: CameraPipeline) -> None:
        try:
            pipeline.begin()
            while not self._over.is_set() and pipeline.step(READ_TIMEOUT):
                continue
        except BaseException as error:  # the main thread reports it
            self._error = self._error or error

    def image(self, camera: str = "A") -> np.ndarray:
        """Return the newest picture of a camera, BGR, (height, width, 3).

        Raises:
            BadMeasurement: none came.
        """
        (pipeline,) = (one for one in self._pipelines if one.name == camera)
        deadline = time.monotonic() + BEGIN_TIMEOUT
        while pipeline.view is None:
            self._check()
            if time.monotonic() > deadline:
                raise BadMeasurement(f"camera {camera} has given no picture; is it in use?")
            pipeline.wait(POLL_PERIOD)
        return pipeline.view.frame.image

    def watch(self, seconds: float) -> dict[str, Sights]:
        """Return where the marker is seen for so many s, by camera, whatever the arm does.

        Raises:
            BadMeasurement: a camera has ended.
        """
        self._collector.begin()
        until = time.monotonic() + seconds
        while time.monotonic() < until:
            self._check()
            time.sleep(POLL_PERIOD)
        return self._collector.finish()

    def wait_for_brick(self, timeout: float = math.inf) -> None:
        """Wait until a brick is linked.

        Raises:
            BadMeasurement: none came within so many s, or the one that was started has ended.
        """
        deadline = time.monotonic() + timeout
        while self._server.state().client is None:
            self._check()
            if self._brick_ended and (why := self._brick_ended()):
                raise BadMeasurement(f"the brick's program has ended: {why}")
            if time.monotonic() > deadline:
                raise BadMeasurement(f"no brick has called within {timeout:.0f} s")
            time.sleep(POLL_PERIOD)

    def measure(self, job: Path, dry: bool = True) -> RunData:
        """Let the arm do a job, and look; see MeasuringRig.

        Raises:
            BadMeasurement: the job did not come to its end, or a camera has ended.
        """
        self.wait_for_brick()
        offer = JobOffer(job, dry=dry)
        self._collector.begin()
        last_status = self._server.state().progress
        if not self._server.offer(offer):
            raise BadMeasurement("the link has just broken; it mends by itself, then do it again")
        done = False
        try:
            self._wait_for_end(offer, last_status.t if last_status else -math.inf)
            done = True
        finally:
            if not done:
                self._collector.finish()
                self._server.send(Order(ABORT, None))
                self._server.send(Stop("the measurement has ended"))
        rows = list(offer.log)
        if not rows:
            raise BadMeasurement(
                "the brick has logged nothing: put today's program on it: brickservo brick install"
            )
        return RunData(rows, offer.job.header.rest, self._collector.finish())

    def _wait_for_end(self, offer: JobOffer, last_status: float) -> None:
        """Wait until the job has ended.

        Args:
            offer: the job.
            last_status: time by the brick's clock, s, up to which it reported an earlier job.
        """
        last_status_at, begun = time.monotonic(), False
        ended_at = None
        header = offer.job.header
        while True:
            self._check()
            state = self._server.state()
            progress = state.progress
            status = None
            if progress and progress.crc == offer.draw.crc and progress.t > last_status:
                status, last_status_at, begun = progress, time.monotonic(), True
            if status is None:
                if state.client is None:
                    raise BadMeasurement(f"the link was lost: {state.lost}; do it again")
                if time.monotonic() - last_status_at > BEGIN_TIMEOUT:
                    why = "the brick did not begin; does its program run with --wait?"
                    if begun:
                        why = "the link broke, and since then the brick says nothing of its job; "
                        why += "do it again"
                    raise BadMeasurement(why)
            elif status.state == DONE:
                ended_at = ended_at or time.monotonic()
                rest_count = sum(row.rest for row in offer.log)
                is_complete = not header.rest or rest_count >= header.strokes
                if is_complete or time.monotonic() - ended_at > LOG_GRACE:
                    return
            elif status.state in ENDS:
                raise BadMeasurement(
                    f"the brick has {status.state}: {status.reason or 'no reason'}"
                )
            else:
                self._on_status(status)
            time.sleep(POLL_PERIOD)

    def _check(self) -> None:
        if self._error:
            raise self._error
        for pipeline in self._pipelines:
            if pipeline.ended:
                raise BadMeasurement(f"camera {pipeline.name} has ended: {pipeline.trouble}")
