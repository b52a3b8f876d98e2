"""Remote calls from the page's process to the tracker's, over a pipe, one at a time.

The caller names a method of `laptop.page.interface` and its arguments, which mypy checks:

    client.call(RunCalls.aim, "A", 120.0, 80.0)
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from contextlib import suppress
from multiprocessing.connection import Connection
from typing import Any, Concatenate, ParamSpec, TypeVar

from laptop.page.interface import (
    EXPOSED_METHODS,
    ORDER_LIFETIME,
    PERISHABLE,
    Calls,
    PageInterface,
    exposed_method,
)

P = ParamSpec("P")
R = TypeVar("R")


class RpcError(Exception):
    """A call that failed on the tracker's side, or that is not exposed."""


class RpcClient:
    """Caller's side of a pipe: calls the methods of a controller in another process.

    Args:
        pipe: to `serve_requests` on the other side.
    """

    def __init__(self, pipe: Connection) -> None:
        self._pipe = pipe
        self._lock = threading.Lock()

    def call(
        self, method: Callable[Concatenate[Calls, P], R], *args: P.args, **kwargs: P.kwargs
    ) -> R:
        """Return what the controller's method returns.

        Args:
            method: of one of the groups in `laptop.page.interface`, e.g. RunCalls.aim.
            *args: of the method, which can be pickled.
            **kwargs: the same.

        Raises:
            EOFError, OSError: there is no controller any more.
            RpcError: the method failed, or is not exposed.
        """
        with self._lock:
            self._pipe.send((method.__qualname__, args, kwargs, time.monotonic()))
            answer, trouble = self._pipe.recv()
        if trouble:
            raise RpcError(trouble)
        return answer


def serve_requests(controller: PageInterface, pipe: Connection) -> None:
    """Answer calls until the other side is gone; for a thread of its own.

    Args:
        controller: whose methods are called.
        pipe: to an `RpcClient` on the other side.
    """
    with suppress(EOFError, OSError):
        while True:
            name, args, kwargs, asked = pipe.recv()
            reply: tuple[Any, str]
            try:
                if name not in EXPOSED_METHODS:
                    raise RpcError(f"{name} is not exposed")
                late = time.monotonic() - asked  # of the same machine: the clock is one
                if name in PERISHABLE and late > ORDER_LIFETIME:
                    reply = f"the tracker stood still for {late:.0f} s; look, then do it again", ""
                else:
                    reply = exposed_method(controller, name)(*args, **kwargs), ""
            except Exception as error:  # for the caller; this thread goes on
                reply = None, f"{type(error).__name__}: {error}"
            pipe.send(reply)
