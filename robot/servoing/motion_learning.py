"""Learning and aiming while the arm moves: in slices, in what a control tick leaves of its time."""

import math
from collections import deque

from robot.servoing.linear_algebra import distance

MYPY = False  # which a type checker takes for true
if MYPY:
    from typing import Deque, Dict, Iterable, Iterator, Optional, Tuple  # noqa: F401

    from robot.clock import Timepiece  # noqa: F401
    from robot.servoing.decision import AnyServo  # noqa: F401
    from robot.servoing.image_model import Pose  # noqa: F401
    from robot.servoing.sightings import MarkerFrame  # noqa: F401
    from robot.servoing.stream import Stream  # noqa: F401


LEARNING_STEP = math.radians(0.5)
"""Least motion of a joint between two frames that are learned from, rad."""

MAX_WAITING_FRAMES, MAX_CHASE_WAITING = 60, 3
"""Frames that may wait to be learned from: until the arm stands, and in a chase, which goes by
them."""

SLICE_SHARE = 0.5
"""Share of the slice before that must fit into what is left of a tick to begin another one."""

MAX_SKIPPED_TICKS = 3
"""Ticks in a row that may be skipped for want of time; the next one does a slice all the same."""


class LearningInMotion(object):
    """The frames that wait to be learned from, and the slice that is next.

    Args:
        servo: Servo, or what learns in its stead.
        clock: has `now()`.
    """

    def __init__(self, servo, clock):
        # type: (AnyServo, Timepiece) -> None
        self._servo, self._clock = servo, clock
        self._stream = None  # type: Optional[Stream]  # that aims in a chase
        # Frames of a motion, and q of each.
        self._unlearned = deque(maxlen=MAX_WAITING_FRAMES)  # type: Deque[Tuple[MarkerFrame, Pose]]
        # Camera: where the joints were in the last of these.
        self._kept_at = {}  # type: Dict[str, Pose]
        # Camera: when the last was taken that was learned from in a chase, s.
        self._learned_at = {}  # type: Dict[str, float]
        self._slices = iter(())  # type: Iterator[None]
        self._slice, self._skipped = 0.0, 0  # how long the last slice took, s

    @property
    def waits(self):
        # type: () -> bool
        """Whether there is something to learn from."""
        return bool(self._unlearned)

    def begin(self, stream=None):
        # type: (Optional[Stream]) -> None
        """Begin a motion; in a chase `stream` aims."""
        self._stream, self._slices = stream, iter(())

    def handle(self, frames):
        # type: (Iterable[MarkerFrame]) -> None
        """Keep those MarkerFrames, seen in motion, that are informative."""
        for frame in frames:
            before, q = self._kept_at.get(frame.camera), frame.q
            if q is not None and (before is None or distance(q, before) > LEARNING_STEP):
                self._kept_at[frame.camera] = q
                self._unlearned.append((frame, q))
        while self._stream and len(self._unlearned) > MAX_CHASE_WAITING:
            self._unlearned.popleft()

    def learn(self):
        # type: () -> bool
        """Learn from one frame; return whether there was one."""
        if not self._unlearned:
            return False
        frame, q = self._unlearned.popleft()
        self._servo.observe_in_motion(frame.camera, q, frame.s)
        return True

    def finish(self):
        # type: () -> None
        """Learn from all frames that wait."""
        while self.learn():
            pass

    def work(self, now, until):
        # type: (float, float) -> None
        """Do slices from the time `now` to `until`, s; the first one if there is room for it.

        A slice that is too long for every tick of a slow brick is done now and then all the same.
        """
        if now + SLICE_SHARE * self._slice > until and self._skipped < MAX_SKIPPED_TICKS:
            self._skipped += 1
            return
        self._skipped = 0
        begun = False
        while True:
            if next(self._slices, self) is self:
                if begun:
                    return  # there is nothing to do
                self._slices = self._chase(self._stream) if self._stream else self._learn_all()
                begun = True
                continue
            begun = False
            began, now = now, self._clock.now()
            self._slice = now - began
            if now + SLICE_SHARE * self._slice > until:
                return

    def _learn_all(self):
        # type: () -> Iterator[None]
        """Learn from frames, one in a slice."""
        while self.learn():
            yield

    def _chase(self, stream):
        # type: (Stream) -> Iterator[None]
        """Aim by what was seen; then learn from the frames that wait: slice by slice."""
        for _ in stream.reaim():
            yield
        while self._unlearned:  # each camera in its turn: they come in the same order every time
            waited = min(self._unlearned, key=lambda one: self._learned_at.get(one[0].camera, 0.0))
            self._unlearned.remove(waited)
            frame, q = waited
            self._learned_at[frame.camera] = frame.t
            for _ in self._servo.learn_shape(frame.camera, q, frame.s):
                yield
