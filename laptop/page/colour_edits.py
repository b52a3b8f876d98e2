"""Changes of the markers' colours: picked, widened, narrowed, renamed, taken back; and kept."""

from __future__ import annotations

import re
import threading
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from laptop.page.camera_feed import CameraFeed
from laptop.vision.learning import exclude, include, learn
from laptop.vision.markers import BadMarker, Marker, read_markers, write_markers
from shared.arm_description import ArmError
from shared.messages import MAX_MARKERS

UNDONE = 50
"""Changes of colours that can be taken back."""


class _Change(NamedTuple):
    """What there was before a change: the markers that were tracked, and those in the file."""

    tracked: Mapping[str, Marker]
    kept: Mapping[str, Marker]


class ColourEdits:
    """What the cameras' trackers look for, and how that was changed.

    Every change answers with "", or in one line with the reason why not.  To learn a colour takes a
    while; nothing else waits for it.

    Args:
        cameras: by name.
        file: where learned colours are kept.
    """

    def __init__(self, cameras: Mapping[str, CameraFeed], file: Path) -> None:
        self._cameras = cameras
        self._file = file
        self._before: deque[_Change] = deque(maxlen=UNDONE)
        self._lock = threading.RLock()

    def pick(self, name: str, camera: str, index: int, where: Sequence[float]) -> str:
        """Learn a marker's colour at a pixel (u, v), or in a rectangle (u0, v0, u1, v1), px.

        Args:
            name: an old marker's or a new one's.
            index: of the frame, one that was given out.
        """
        if why := _bad_name(name):
            return why
        names = [marker.name for marker in self.markers]
        if name not in names and len(names) >= MAX_MARKERS - 1:
            return f"{len(names)} markers are all that can be tracked; pick one of them anew"
        return self._change(name, camera, index, lambda old, image: learn(name, image, (*where,)))

    def add(self, name: str, camera: str, index: int, where: Sequence[float]) -> str:
        """Add what is at a pixel or in a rectangle to a marker's colour, see `pick`."""
        return self._change(
            name, camera, index, lambda old, image: include(_known(old, name), image, (*where,))
        )

    def remove(self, name: str, camera: str, index: int, where: Sequence[float]) -> str:
        """Remove what is at a pixel or in a rectangle from a marker's colour, see `pick`."""
        return self._change(
            name, camera, index, lambda old, image: exclude(_known(old, name), image, (*where,))
        )

    def rename(self, name: str, new: str) -> str:
        """Give a marker another name; one that has that name already is forgotten."""
        if why := _bad_name(new):
            return why
        with self._lock:
            markers = {marker.name: marker for marker in self.markers}
            if name not in markers:
                return f"marker '{name}': there is none of this name"
            marker = markers.pop(name)
            return self._look_for({**markers, new: replace(marker, name=new)})

    def undo(self) -> str:
        """Take the last change of a colour back."""
        with self._lock:
            if not self._before:
                return "there is nothing to undo"
            before = self._before.pop()
            why = self._look_for(dict(before.tracked), before.kept)
            self._before.pop()
            return why

    def _change(
        self,
        name: str,
        camera: str,
        index: int,
        change: Callable[[Marker | None, np.ndarray], Marker],
    ) -> str:
        try:
            image = self._cameras[camera].frame(index).image
            with self._lock:
                markers = {marker.name: marker for marker in self.markers}
                return self._look_for({**markers, name: change(markers.get(name), image)})
        except ArmError as error:
            return str(error)

    def _look_for(
        self, markers: dict[str, Marker], once: Mapping[str, Marker] = MappingProxyType({})
    ) -> str:
        """Track these markers from now on, and keep them; those that are not tracked any more go.

        Args:
            once: in the file if they go.
        """
        tracked = {marker.name: marker for marker in self.markers}
        kept: dict[str, Marker] = {}
        trouble = ""
        try:
            kept = read_markers(self._file) if self._file.exists() else {}
            others = {name: marker for name, marker in kept.items() if name not in tracked}
            gone = {name: once[name] for name in tracked if name in once}
            # Of those that stay as they are the file may know better than this camera's scene.
            same = {name for name, marker in markers.items() if tracked.get(name) == marker}
            stay = {name: kept[name] for name in same if name in kept}
            new = {name: marker for name, marker in markers.items() if name not in same}
            write_markers(self._file, {**others, **gone, **stay, **new})
        except BadMarker as error:
            trouble = f"tracked, but not kept: {error}"
        self._before.append(_Change(tracked, kept))
        for eye in self._cameras.values():
            eye.tracker.markers = tuple(markers.values())
        return trouble

    @property
    def markers(self) -> tuple[Marker, ...]:
        """Those that are tracked, in all cameras the same."""
        return next(iter(self._cameras.values())).tracker.markers

    @property
    def undoable(self) -> int:
        """How many changes can be taken back."""
        return len(self._before)


def _bad_name(name: str) -> str:
    """Why a marker cannot be called that, or ""."""
    if re.fullmatch(r"[A-Za-z0-9_-]{1,32}", name):
        return ""
    return f"marker '{name[:40]}': name it with 1 to 32 of A-Z a-z 0-9 _ -"


def _known(marker: Marker | None, name: str) -> Marker:
    if marker is None:
        raise BadMarker(f"{name} has not been picked yet; pick it first")
    return marker
