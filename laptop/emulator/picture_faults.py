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
"""Greatest number of pictures in a loop, which are stored for each camera."""


class PictureFaults(object):
    """Faults of the cameras of one world: pictures shown instead of those taken."""

    def __init__(self) -> None:
        # By camera: its last true pictures, and how often the last one was shown.
        self._stored = {}  # type: Dict[str, Deque[Any]]
        self._shown = {}  # type: Dict[str, int]
        # By camera, or None for all: pictures of the loop, and how often each picture is shown.
        self._loops = {}  # type: Dict[Optional[str], int]
        self._times = {}  # type: Dict[Optional[str], int]

    def freeze(self, camera: Optional[str] = None, frames: int = 1) -> None:
        """Repeat the last picture from now on; or the last `frames`, in turn.

        Args:
            camera: name; None for all.
            frames: number of pictures to repeat.
        """
        if not 1 <= frames <= MAX_LOOP:
            raise ValueError("a loop of {} pictures; 1 to {}".format(frames, MAX_LOOP))
        self._loops[camera] = frames

    def repeat(self, times: int, camera: Optional[str] = None) -> None:
        """Show each true picture so many times from now on, as at too high a rate."""
        self._times[camera] = times

    def release(self, camera: Optional[str] = None) -> None:
        """End the faults of a camera; of all if None."""
        for faults in (self._loops, self._times):
            if camera is None:
                faults.clear()
            faults.pop(camera, None)

    @property
    def frozen(self) -> bool:
        """Whether any camera shows what it has shown before."""
        return bool(self._loops)

    def shown(self, camera: str, capture: Callable[[], "Picture"]) -> "Picture":
        """Return the picture that a camera gives now.

        Args:
            camera: name.
            capture: returns the true picture; not called where another one is shown.
        """
        stored = self._stored.setdefault(camera, deque(maxlen=MAX_LOOP))  # type: Deque[Picture]
        frames = self._loops.get(camera, self._loops.get(None))
        if frames is not None and stored:
            # The oldest of the loop comes next, and goes to its end.
            picture = stored[-min(frames, len(stored))]
            del stored[len(stored) - min(frames, len(stored))]
            stored.append(picture)
            return picture
        times = self._times.get(camera, self._times.get(None, 1))
        count = self._shown.get(camera, times)
        if count < times and stored:
            self._shown[camera] = count + 1
            return stored[-1]
        self._shown[camera] = 1
        stored.append(capture())
        return stored[-1]
