"""Rates at which pictures of each camera come.  Pure."""

from collections import deque

MYPY = False  # which a type checker takes for true
if MYPY:
    from typing import Deque, Dict, Tuple  # noqa: F401

    from shared.messages import Observation  # noqa: F401

RATE_WINDOW, MIN_PICTURES = 3.2, 3
"""Time over which pictures are counted, s; the least number of pictures for a rate."""


class PictureRates(object):
    """The times of the last pictures of each camera, whatever is seen in them.

    Args:
        gap: pictures farther apart are too few, s.
    """

    def __init__(self, gap):
        # type: (float) -> None
        self._gap = gap
        self._most = int(RATE_WINDOW / gap) + 2  # more, and some of them are nearer than the gap
        # Camera: (when each came, s; its number).
        self._came = {}  # type: Dict[str, Deque[Tuple[float, int]]]
        self._began = {}  # type: Dict[str, float]  # camera: when the first came, s

    def add(self, seen, now):
        # type: (Observation, float) -> None
        """Add that an Observation came at the time `now`, s."""
        came = self._came.get(seen.camera)
        if came is None:
            came = self._came[seen.camera] = deque(maxlen=self._most)
            self._began[seen.camera] = now
        came.append((now, seen.seq))

    def slow(self, now):
        # type: (float) -> Dict[str, Tuple[float, float]]
        """Return {camera: (pictures that come, pictures it gives, 1/s)} of slow cameras."""
        found = {}
        for camera, came in self._came.items():
            lately = [entry for entry in came if entry[0] >= now - RATE_WINDOW]
            if len(lately) < MIN_PICTURES or now - self._began[camera] < RATE_WINDOW:
                continue
            times = [t for t, _ in lately]
            if min([b - a for a, b in zip(times, times[1:])]) > self._gap:
                duration = times[-1] - times[0]
                found[camera] = (
                    (len(lately) - 1) / duration,
                    (lately[-1][1] - lately[0][1]) / duration,
                )
        return found
