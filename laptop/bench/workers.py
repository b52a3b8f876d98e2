"""Distribution of a bench's cases to all cores of this machine or to the workers of a cluster."""

from __future__ import annotations

import asyncio
import multiprocessing
import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import BrokenExecutor, Executor, Future, ProcessPoolExecutor, wait
from contextlib import ExitStack, contextmanager
from importlib.util import find_spec
from typing import TypeVar

import cv2

from shared.arm_description import ArmError

C = TypeVar("C")
R = TypeVar("R")

POLL_PERIOD = 0.5
"""Period between two wake-ups of a thread that waits for a result, s."""

ANSWER_TIMEOUT = 5.0
"""Longest time until a cluster's scheduler answers, and until it has a worker, s."""

_one_at_a_time = threading.Lock()
"""Lock of the process: an emulated brick replaces its modules."""


class NoCluster(ArmError):
    """No cluster can be reached."""


class WorkerLost(ArmError):
    """A process that did some of the work has ended."""


@contextmanager
def cluster(address: str) -> Iterator[Executor]:
    """Provide an executor on the workers of the Dask scheduler at `address`.

    Raises:
        NoCluster: distributed is not installed, no scheduler answers, or it has no worker.
    """
    try:
        from distributed import Client
        from distributed.comm.addressing import parse_address, parse_host_port
    except ImportError:
        raise NoCluster(
            "Dask's distributed is not installed; write uv run --group cluster ..."
        ) from None
    try:
        parse_host_port(parse_address(address)[1])  # half a client would complain of its end
        client = Client(address, timeout=ANSWER_TIMEOUT, set_as_default=False)
    except (OSError, ValueError, asyncio.TimeoutError):
        raise NoCluster(
            f"no scheduler answers at {address}; start one in the checkout: "
            "python -m dask scheduler"
        ) from None
    with client:
        start = f"in the checkout: python -m dask worker {address} --nthreads 1"
        try:
            client.wait_for_workers(1, ANSWER_TIMEOUT)
        except (OSError, asyncio.TimeoutError):
            raise NoCluster(
                f"the scheduler at {address} has no worker; start some {start}"
            ) from None
        try:  # a worker that cannot import what it is sent would die, and the bench wait for ever
            client.run_on_scheduler(find_spec, "laptop.bench")
            client.run(find_spec, "laptop.bench")
        except ImportError:
            raise NoCluster(
                f"the cluster at {address} has not this checkout; start its scheduler there, too, "
                f"and its workers {start}"
            ) from None
        yield client.get_executor()


def _run_chunk(work: Callable[[C], R], cases: Sequence[C]) -> list[R]:
    with _one_at_a_time:
        cv2.setNumThreads(1)
        return [work(case) for case in cases]


def map_cases(
    work: Callable[[C], R], cases: Sequence[C], chunk: int = 1, executor: Executor | None = None
) -> Iterator[R]:
    """Yield the result of `work` for every case, in their order.

    However that ends, by Ctrl-C or SIGTERM, say, no process of this machine stays behind, and
    nothing waits in `executor`.

    Args:
        work: a function of a module, so that other processes find it.
        cases: its arguments.
        chunk: number of cases that go to a process at a time.
        executor: does the work; None for a process on every core of this machine.

    Raises:
        WorkerLost: a process was ended from outside.
    """
    with ExitStack() as stack:
        if threading.current_thread() is threading.main_thread():
            before = signal.signal(signal.SIGTERM, lambda number, _: sys.exit(128 + number))
            stack.callback(signal.signal, signal.SIGTERM, before)
        if executor is None:
            # A forked process would inherit OpenCV's threads without their lives.
            context = multiprocessing.get_context("spawn")
            executor = stack.enter_context(ProcessPoolExecutor(os.cpu_count(), context))
            stack.push(_terminate_at_error)
        futures: list[Future[list[R]]] = []
        try:
            with _signals_held():
                for k in range(0, len(cases), chunk):
                    futures.append(executor.submit(_run_chunk, work, cases[k : k + chunk]))
            for future in futures:
                # A signal that came while a process was started may have gone to another thread; it
                # is obeyed as soon as this one does anything, but that does not wake it up.
                while not wait([future], POLL_PERIOD).done:
                    pass
                yield from future.result()
        except BrokenExecutor:
            raise WorkerLost(
                "a process of this bench was ended from outside, perhaps for want of memory; "
                "free some, or take fewer --seeds at a time"
            ) from None
        finally:
            for future in futures:
                future.cancel()


@contextmanager
def _signals_held() -> Iterator[None]:
    """Delay Ctrl-C and SIGTERM to the block's end: a half started pool cannot be ended."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    came: list[int] = []
    before = {
        number: signal.signal(number, lambda number, _: came.append(number))
        for number in (signal.SIGINT, signal.SIGTERM)
    }
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
    for one in came:
        signal.raise_signal(one)


def _terminate_at_error(kind: object, error: object, traceback: object) -> None:
    """End the processes of the local pool if the block ends by an exception."""
    if kind:
        for process in multiprocessing.active_children():
            process.terminate()
