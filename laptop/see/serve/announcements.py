"""Announcements of a run to the program that started it: one JSON object per line.

Each has an "event", and beside it:

    cameras  "cameras": a list of {"name", "source", "size" (width, height, px), "fps"}, where known
    serving  "host" and "port" at which programs on this machine reach the link, and the "code";
             "addresses": a list of HOST:PORT for everybody else
    page     "url", which holds a token that lets one browser in; once it has, a new one comes
    ready    nothing: from here on frames are taken, and a signal ends it in order
    end      "status", the exit status, and "reason" in words
"""

from __future__ import annotations

import json
from typing import Protocol, TextIO

CAMERAS, SERVING, PAGE, READY, END = "cameras", "serving", "page", "ready", "end"
"""Events, in the order in which they come; link and page are optional."""


class Announce(Protocol):
    """A function that announces an event with its facts."""

    def __call__(self, event: str, **facts: object) -> None: ...  # noqa: D102


def json_lines(out: TextIO) -> Announce:
    """Return a function that writes each event as a line of JSON, at once."""

    def announce(event: str, **facts: object) -> None:
        out.write(json.dumps({"event": event, **facts}) + "\n")
        out.flush()

    return announce


def silence(event: str, **facts: object) -> None:
    """Announce nothing."""
