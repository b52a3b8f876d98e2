"""All cores at work on the cases of a bench."""

from __future__ import annotations

import multiprocessing
import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, wait
from contextlib import ExitStack
from typing import TypeVar

import cv2

Case = TypeVar("Case")
Result = TypeVar("Result")


LOOK = 0.5
"""So often whoever waits for a result wakes up, s."""


def _each(work: Callable[[Case], Result], cases: Sequence[Case]) -> list[Result]:
    return [work(case) for case in cases]


def results(
    work: Callable[[Case], Result], cases: Sequence[Case], chunk: int = 1
) -> Iterator[Result]:
    """What `work` makes of every case, in their order.

    However that ends, by Ctrl-C or SIGTERM, say, no process stays behind.

    Args:
        chunk: so many cases go to a process at a time.
    """
    # A forked process would inherit OpenCV's threads without their lives.
    context = multiprocessing.get_context("spawn")
    with ExitStack() as stack:
        if threading.current_thread() is threading.main_thread():
            before = signal.signal(signal.SIGTERM, lambda number, _: sys.exit(128 + number))
            stack.callback(signal.signal, signal.SIGTERM, before)
        pool = ProcessPoolExecutor(os.cpu_count(), context, cv2.setNumThreads, (1,))
        stack.enter_context(pool)
        try:
            parts = [cases[k : k + chunk] for k in range(0, len(cases), chunk)]
            for future in [pool.submit(_each, work, part) for part in parts]:
                # A signal that came while a process was started may have gone to another thread; it
                # is obeyed as soon as this one does anything, but that does not wake it up.
                while not wait([future], LOOK).done:
                    pass
                yield from future.result()
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            for process in multiprocessing.active_children():
                process.terminate()
            raise
