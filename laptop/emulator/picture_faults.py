"""Pictures of emulated cameras that come again with new times: frozen, in a loop, or each twice.

What stands still is the picture: its time of capture and its number go on, as behind a capture card
whose input is gone, or in front of a driver that hands out its last buffer again and again.
"""

from collections import deque
from typing import Callable, Optional

MYPY = False
if MYPY:
    from typing import Any, Deque, Dict, TypeVar  # noqa: F401

    Picture = TypeVar("Picture")


MAX_LOOP = 120
"""Pictures of a camera that are kept, so that a loop may begin with them."""


class PictureFaults(object):
    """What the cameras of one world show instead of what they see."""

    def __init__(self) -> None:
        # By camera: its last true pictures, and how often the last one was shown.
        self._kept = {}  # type: Dict[str, Deque[Any]]
        self._shown = {}  # type: Dict[str, int]
        # By camera, or None for all: pictures of the loop, and how often each picture is shown.
        self._loops = {}  # type: Dict[Optional[str], int]
        self._times = {}  # type: Dict[Optional[str], int]

    def freeze(self, camera: Optional[str] = None, frames: int = 1) -> None:
        """From now on the last picture comes again; or the last `frames`, in turn.

        Args:
            camera: name; None for all.
        """
        if not 1 <= frames <= MAX_LOOP:
            raise ValueError("a loop of {} pictures; 1 to {}".format(frames, MAX_LOOP))
        self._loops[camera] = frames

    def repeat(self, times: int, camera: Optional[str] = None) -> None:
        """From now on each true picture is shown so many times, as at too high a rate."""
        self._times[camera] = times

    def release(self, camera: Optional[str] = None) -> None:
        """The camera shows again what it sees; all of them if None."""
        for faults in (self._loops, self._times):
            if camera is None:
                faults.clear()
            faults.pop(camera, None)

    @property
    def frozen(self) -> bool:
        """Whether any camera shows what it has shown before."""
        return bool(self._loops)

    def shown(self, camera: str, take: Callable[[], "Picture"]) -> "Picture":
        """The picture that a camera gives now.

        Args:
            take: gives the true one; it is not asked for one that nobody sees.
        """
        kept = self._kept.setdefault(camera, deque(maxlen=MAX_LOOP))  # type: Deque[Picture]
        frames = self._loops.get(camera, self._loops.get(None))
        if frames is not None and kept:
            # The oldest of the loop comes next, and goes to its end.
            picture = kept[-min(frames, len(kept))]
            del kept[len(kept) - min(frames, len(kept))]
            kept.append(picture)
            return picture
        times = self._times.get(camera, self._times.get(None, 1))
        count = self._shown.get(camera, times)
        if count < times and kept:
            self._shown[camera] = count + 1
            return kept[-1]
        self._shown[camera] = 1
        kept.append(take())
        return kept[-1]
