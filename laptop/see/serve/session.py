"""The session over all cameras: their pipelines run until the last has ended or a signal comes.

Every camera has a tracker of its own.  Live cameras run side by side, each in a thread, so that
none waits for another; when one ends, the others go on.  Recordings that are not played live are
processed in turn, frame by frame, so that the same files give the same CSV.
"""

from __future__ import annotations

import signal
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager

from rich.console import Console

from laptop.see.serve.observation_csv import ObservationCsv, TrackingInterrupted
from laptop.see.serve.pipeline import CameraPipeline
from laptop.see.serve.process_signals import EXIT_STATUS
from laptop.see.serve.status_display import StatusDisplay
from laptop.see.serve.status_text import line_printer, pipeline_status

STATUS_PERIOD = 0.2
"""Time between two updates of the status, s."""
READ_TIMEOUT = 0.2
"""Longest wait of a pipeline for one frame before it checks whether the session is over, s."""
JOIN_TIMEOUT = 2.0
"""Longest wait for a busy pipeline at the end, s; then it is left to itself."""


class TrackingSession:
    """Runs until every camera has ended and nobody has the page open, or a signal comes.

    Args:
        pipelines: one for each camera.
        csv: is flushed meanwhile, or None.
        link: gives the link's status in a few words, or None.
        console: shows the status.
        has_viewers: returns True while somebody has the page open; only asked if all went well.
        others: gives further lines of status.
    """

    def __init__(
        self,
        pipelines: Sequence[CameraPipeline],
        csv: ObservationCsv | None,
        link: Callable[[], str] | None,
        console: Console,
        has_viewers: Callable[[], bool] = lambda: False,
        others: Callable[[], list[str]] = list,
    ) -> None:
        self.display = StatusDisplay(pipelines, link, console, others)
        self.threads: list[threading.Thread] = []
        self._pipelines = pipelines
        self._csv = csv
        self._print_line = line_printer(console)
        self._has_viewers = has_viewers
        self._staying = False  # though every camera has ended
        self._stop = threading.Event()
        self._group_ended = threading.Event()
        self._signal: int | None = None
        self._error: BaseException | None = None
        self._announced: list[CameraPipeline] = []  # that they have ended

    def run(self, on_ready: Callable[[], None] = lambda: None) -> int:
        """Run it and return the exit status: 0 at the end, or that of the signal before it.

        Args:
            on_ready: called once frames are taken, and a signal ends it in order.

        Raises:
            TrackingInterrupted: no camera is left and some were given up, or the CSV cannot be
                written.
        """
        with self._signals_handled():
            groups = [[pipeline] for pipeline in self._pipelines if pipeline.live]
            in_turn = [pipeline for pipeline in self._pipelines if not pipeline.live]
            groups += [in_turn] if in_turn else []
            ended = threading.Semaphore(0)
            self.threads = [
                threading.Thread(target=self._run_group, args=(group, ended), daemon=True)
                for group in groups
            ]
            for thread in self.threads:
                thread.start()
            try:
                on_ready()
                self._wait(len(groups), ended)
            finally:
                self._stop.set()
                deadline = time.monotonic() + JOIN_TIMEOUT
                for thread in self.threads:
                    thread.join(max(0.0, deadline - time.monotonic()))
        if self._error:
            raise self._error
        if self._signal and not self._staying:
            return EXIT_STATUS[signal.Signals(self._signal)]
        if given_up := [pipeline.trouble for pipeline in self._pipelines if pipeline.trouble]:
            raise TrackingInterrupted("; ".join(given_up))
        return 0

    @property
    def ended_by(self) -> str:
        """Name of the signal that ended it before its time, or ""."""
        if not self._signal or self._staying:
            return ""
        name = signal.Signals(self._signal).name
        return "Ctrl-C" if name == "SIGINT" else name

    def _run_group(self, group: list[CameraPipeline], ended: threading.Semaphore) -> None:
        """Step the pipelines of a group in turn; for a thread of its own."""
        try:
            for pipeline in group:
                pipeline.begin()
            while group and not self._stop.is_set():
                for pipeline in list(group):
                    if not pipeline.step(READ_TIMEOUT):
                        group.remove(pipeline)
        except BaseException as error:  # the main thread reports it
            self._error = self._error or error
            self._stop.set()
        finally:
            ended.release()
            self._group_ended.set()

    def _wait(self, running: int, ended: threading.Semaphore) -> None:
        """Show the status until all groups (`running`, a number) have ended, or a signal comes."""
        with self.display.shown() as update:
            while (running or self._stays()) and not (self._stop.is_set() or self._signal):
                self._group_ended.wait(STATUS_PERIOD)
                self._group_ended.clear()
                while ended.acquire(blocking=False):
                    running -= 1
                self._print_ends()
                update()
                if self._csv:
                    self._csv.flush()

    def _stays(self) -> bool:
        """Return True while somebody looks at what has ended."""
        if self._error or any(pipeline.trouble for pipeline in self._pipelines):
            return False
        stays = self._has_viewers()
        if stays and not self._staying:
            self._staying = True
            self._print_line(
                "all is tracked; the page shows it as long as it is open: close it, or Ctrl-C"
            )
        return stays

    def _print_ends(self) -> None:
        """Print which live cameras have ended since, and which go on."""
        going = [pipeline.name for pipeline in self._pipelines if not pipeline.ended]
        for pipeline in self._pipelines:
            if pipeline.ended and pipeline.live and going and pipeline not in self._announced:
                self._announced.append(pipeline)
                others = f"{' and '.join(going)} {'goes' if len(going) == 1 else 'go'} on"
                self._print_line(f"camera {pipeline.name}: {pipeline_status(pipeline)}; {others}")

    @contextmanager
    def _signals_handled(self) -> Iterator[None]:
        """Note signals while the block runs: they end the session in order."""

        def on_signal(number: int, _frame: object) -> None:
            # No Event is set here: it may just be waited for, with its lock held, for ever then.
            self._signal = number

        if threading.current_thread() is not threading.main_thread():
            yield
            return
        before = {number: signal.signal(number, on_signal) for number in EXIT_STATUS}
        try:
            yield
        finally:
            for number, handler in before.items():
                signal.signal(number, handler)
