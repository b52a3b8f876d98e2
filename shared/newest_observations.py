"""The newest observation of each camera, dated on the own clock.  Pure."""

from shared.messages import (
    MAX_CAMERAS,
    OBSERVATION_BEGINS,
    BadMessage,
    Observation,
    seq_of,
)

MYPY = False
if MYPY:
    from typing import Dict, Iterable, List, Sequence, Set, Tuple  # noqa: F401

    from shared.peer_clock import Pings  # noqa: F401

    Line = Tuple[bytes, float]  # without its newline; when it came in, s

FUTURE_SLACK = 0.01
"""Tolerance of an observation from the future, s, beyond the uncertainty of the clock offset."""

MAX_NAMES = 64
"""Greatest number of names of cameras and markers that are stored."""


def by_camera(lines):
    # type: (Sequence[Line]) -> Tuple[List[Line], Iterable[List[Line]]]
    """Sort lines that came together, without parsing them.

    Args:
        lines: list of (line, time it came in, s).

    Returns:
        Those that are no observations, in order; and a list per camera, the newest last.
    """
    others, cameras = [], {}  # type: List[Line], Dict[bytes, List[Line]]
    for entry in lines:
        line = entry[0]
        if line.startswith(OBSERVATION_BEGINS):
            camera = line[: line.find(b'"', len(OBSERVATION_BEGINS))]
            cameras.setdefault(camera, []).append(entry)
        else:
            others.append(entry)
    for entries in cameras.values():
        if len(entries) > 1:
            entries.sort(key=lambda entry: seq_of(entry[0]))  # a correct sender has sorted them
    return others, cameras.values()


class NewestObservations(object):
    """Observations that a link has to hand over: one slot per camera.

    Args:
        pings: peer_clock.Pings, which dates them.
        counters: {name: count} by link.COUNTERS; those of observations are raised here.

    Attributes:
        names: set of the names of cameras and markers that were checked before.
        late: {camera: age, s} of those whose last observation was too old to be handed over.
    """

    def __init__(self, pings, counters):
        # type: (Pings, Dict[str, int]) -> None
        self._pings, self._counters = pings, counters
        # camera: (seq, t on their clock) of the newest observation accepted
        self._latest = {}  # type: Dict[str, Tuple[int, float]]
        self._slots = {}  # type: Dict[str, Observation]  # camera: the observation to hand over
        self.names, self.late = set(), {}  # type: Set[str], Dict[str, float]

    def __len__(self):
        # type: () -> int
        return len(self._latest)

    def forget_times(self):
        # type: () -> None
        """Forget all times of the other side's clock, which has jumped."""
        self._slots.clear()
        self._latest = {camera: (seq, 0.0) for camera, (seq, _) in self._latest.items()}

    def pop_fresh(self, now, max_age):
        # type: (float, float) -> Dict[str, Observation]
        """Return {camera: Observation} of those not older than max_age (s) at `now` (s), once."""
        fresh = {camera: seen for camera, seen in self._slots.items() if now - seen.t <= max_age}
        for camera, seen in self._slots.items():
            if camera not in fresh:
                self.late[camera] = now - seen.t
            elif self.late:
                self.late.pop(camera, None)
        self._counters["stale"] += len(self._slots) - len(fresh)
        self._slots.clear()
        return fresh

    def handle(self, seen, t):
        # type: (Observation, float) -> bool
        """Put an observation that came in at t (s) into its slot, if it is newer and can be dated.

        Returns:
            bool: whether it was accepted.
        """
        seq, last = self._latest.get(seen.camera, (-1, -1.0))
        if seq < 0 and len(self._latest) == MAX_CAMERAS:
            raise BadMessage("more than {} cameras".format(MAX_CAMERAS))
        for name in [seen.camera] + list(seen.markers) if seq < 0 else seen.markers:
            if name not in self.names and len(self.names) < MAX_NAMES:
                self.names.add(name)
        if seen.seq <= seq:
            self._counters["out_of_sequence"] += 1
            return False
        if not self._pings.can_convert(t):
            self._counters["undated"] += 1
            return False
        age = t - (seen.t - self._pings.clock.offset)
        if seen.t < last:
            self._counters["out_of_sequence"] += 1
            self._pings.invalidate(t)
        elif age < -FUTURE_SLACK and age < -FUTURE_SLACK - self._pings.clock.uncertainty(t):
            self._counters["future"] += 1
            self._pings.invalidate(t)
        else:
            self._latest[seen.camera] = seen.seq, seen.t
            self._slots[seen.camera] = Observation(seen.seq, seen.camera, t - age, seen.markers)
            return True
        return False
