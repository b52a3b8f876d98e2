"""Edits of the markers' colours: pick, widen, narrow, rename, undo; each is stored in the file."""

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
from laptop.see.markers.learning import learn
from laptop.see.markers.markers import BadMarker, Marker, read_markers, write_markers
from laptop.see.markers.picked_colors import exclude, include
from shared.arm_description import ArmError
from shared.messages import MAX_MARKERS

MAX_UNDO = 50
"""Number of edits that can be undone."""


class _UndoStep(NamedTuple):
    """Markers before an edit, by name: those that were tracked, and those in the file."""

    tracked: Mapping[str, Marker]
    stored: Mapping[str, Marker]


class ColourEdits:
    """Edits of the markers that all cameras track.

    Every edit answers with "", or in one line with the reason why not.  To learn a colour takes a
    while; nothing else waits for it.

    Args:
        cameras: feeds by camera name.
        file: where learned colours are kept.
    """

    def __init__(self, cameras: Mapping[str, CameraFeed], file: Path) -> None:
        self._cameras = cameras
        self._file = file
        self._before: deque[_UndoStep] = deque(maxlen=MAX_UNDO)
        self._lock = threading.RLock()

    def pick(self, name: str, camera: str, index: int, where: Sequence[float]) -> str:
        """Learn a marker's colour from a frame that was given out.

        Args:
            name: of the marker, an old or a new one.
            camera: name of the camera.
            index: of the frame.
            where: a pixel (u, v) or a rectangle (u0, v0, u1, v1), px.
        """
        if why := _bad_name(name):
            return why
        names = [marker.name for marker in self.markers]
        if name not in names and len(names) >= MAX_MARKERS - 1:
            return f"{len(names)} markers are all that can be tracked; pick one of them anew"
        return self._edit(name, camera, index, lambda old, image: learn(name, image, (*where,)))

    def add(self, name: str, camera: str, index: int, where: Sequence[float]) -> str:
        """Add a pixel's or a rectangle's colour to a marker's; arguments as for `pick`."""
        return self._edit(
            name, camera, index, lambda old, image: include(_known(old, name), image, (*where,))
        )

    def remove(self, name: str, camera: str, index: int, where: Sequence[float]) -> str:
        """Remove a pixel's or a rectangle's colour from a marker's; arguments as for `pick`."""
        return self._edit(
            name, camera, index, lambda old, image: exclude(_known(old, name), image, (*where,))
        )

    def rename(self, name: str, new: str) -> str:
        """Rename a marker; another one that has the new name already is forgotten."""
        if why := _bad_name(new):
            return why
        with self._lock:
            markers = {marker.name: marker for marker in self.markers}
            if name not in markers:
                return f"marker '{name}': there is none of this name"
            marker = markers.pop(name)
            return self._track({**markers, new: replace(marker, name=new)})

    def undo(self) -> str:
        """Undo the last edit."""
        with self._lock:
            if not self._before:
                return "there is nothing to undo"
            before = self._before.pop()
            why = self._track(dict(before.tracked), before.stored)
            self._before.pop()
            return why

    def _edit(
        self,
        name: str,
        camera: str,
        index: int,
        edit: Callable[[Marker | None, np.ndarray], Marker],
    ) -> str:
        """Replace a marker by what `edit` makes of it and of a frame's image (BGR)."""
        try:
            image = self._cameras[camera].frame(index).image
            with self._lock:
                markers = {marker.name: marker for marker in self.markers}
                return self._track({**markers, name: edit(markers.get(name), image)})
        except ArmError as error:
            return str(error)

    def _track(
        self, markers: dict[str, Marker], restored: Mapping[str, Marker] = MappingProxyType({})
    ) -> str:
        """Track these markers from now on, and store them; the file drops those that are removed.

        Args:
            markers: by name.
            restored: markers that the file gets instead of the removed ones, by name.
        """
        tracked = {marker.name: marker for marker in self.markers}
        stored: dict[str, Marker] = {}
        trouble = ""
        try:
            stored = read_markers(self._file) if self._file.exists() else {}
            others = {name: marker for name, marker in stored.items() if name not in tracked}
            gone = {name: restored[name] for name in tracked if name in restored}
            # Unchanged markers: the file's version may be better than that of this camera's scene.
            same = {name for name, marker in markers.items() if tracked.get(name) == marker}
            stay = {name: stored[name] for name in same if name in stored}
            new = {name: marker for name, marker in markers.items() if name not in same}
            write_markers(self._file, {**others, **gone, **stay, **new})
        except BadMarker as error:
            trouble = f"tracked, but not kept: {error}"
        self._before.append(_UndoStep(tracked, stored))
        for feed in self._cameras.values():
            feed.tracker.markers = tuple(markers.values())
        return trouble

    @property
    def markers(self) -> tuple[Marker, ...]:
        """Markers that are tracked, the same in all cameras."""
        return next(iter(self._cameras.values())).tracker.markers

    @property
    def undoable(self) -> int:
        """Number of edits that can be undone."""
        return len(self._before)


def _bad_name(name: str) -> str:
    """Return why a marker cannot have this name, or ""."""
    if re.fullmatch(r"[A-Za-z0-9_-]{1,32}", name):
        return ""
    return f"marker '{name[:40]}': name it with 1 to 32 of A-Z a-z 0-9 _ -"


def _known(marker: Marker | None, name: str) -> Marker:
    if marker is None:
        raise BadMarker(f"{name} has not been picked yet; pick it first")
    return marker
