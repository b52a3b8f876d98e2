"""Setup of a run: all options are checked, then the cameras opened and colours learned."""

from __future__ import annotations

import re
import time
from collections.abc import Callable, Mapping
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

from laptop.see.camera.cameras import WEBCAM, is_live, name_of, open_camera
from laptop.see.camera.frames import Frame
from laptop.see.markers.learning import learn
from laptop.see.markers.markers import BadMarker, Marker, read_markers
from laptop.see.markers.tracker import Tracker
from laptop.see.serve.marker_selection import DEFAULT_SPECS, MarkerSelection, check_names
from laptop.see.serve.options import (
    CAMERA_NAMES,
    InvalidTrackOption,
    Pick,
    TrackOptions,
    read_goals,
    read_pick,
    read_picture,
    read_size,
)
from laptop.see.serve.pipeline import FrameSource, Point
from shared.messages import EFFECTOR, GOAL
from shared.state import MARKERS_FILE, state_folder

FIRST_FRAME_TIMEOUT = 5.0
"""Longest wait for a live camera's first frame, s."""
READ_TIMEOUT = 0.2
"""Time between two checks of that, s."""
NEXT_FRAMES = 5
"""Number of frames after a pick in one of which what was learned must be found."""

SYNTHETIC = "synthetic"
"""Source of a camera that sees the emulated arm."""

OpenSynthetic = Callable[[str, str, float | None], tuple[FrameSource, dict[str, str]]]
"""Opens a synthetic camera, given its name, the scene's text and frames per second (None: its own);
returns the camera, and its markers' SPEC by name."""


class TrackingSetup(NamedTuple):
    """Everything that a run needs, checked and opened.

    cameras  open, in the order of their names
    live     True: they go on whether or not their frames are taken
    markers  to look for
    points   a fixed goal (u, v), px, or None, per camera
    picture  file, and the index of the frame to keep (None: the last); or None
    file     of the markers
    known    markers by name that are in that file
    learned  markers by name that were learned for this run
    """

    cameras: list[FrameSource]
    live: bool
    markers: list[Marker]
    points: list[Point | None]
    picture: tuple[Path, int | None] | None
    file: Path
    known: Mapping[str, Marker]
    learned: dict[str, Marker]


def markers_file() -> Path:
    """Return the path of the file of learned markers: in $BRICKSERVO_STATE or ~/.brickservo."""
    return Path(state_folder()) / MARKERS_FILE


def prepare(
    options: TrackOptions, open_synthetic: OpenSynthetic, stack: ExitStack
) -> TrackingSetup:
    """Check all options and open the cameras.

    Args:
        options: as typed.
        open_synthetic: opens a synthetic camera.
        stack: closes the cameras.

    Raises:
        ArmError: one line that says what cannot be done.
    """
    _check_sources(options)
    goal = read_goals(options.goal, len(options.camera))
    points: list[Point | None] = [None] * len(options.camera)
    specs = {EFFECTOR: options.effector}
    if isinstance(goal, list):
        points = list(goal)
    else:
        specs[GOAL] = goal
    picture = read_picture(options.picture) if options.picture else None
    size = read_size(options.size) if options.size else None
    if size and not _webcams(options) and SYNTHETIC in options.camera:
        raise InvalidTrackOption(
            f"size {options.size}: write --scene width={size[0]},height={size[1]}"
        )
    selection, file = _select(options, specs)
    known = selection.known
    selection.check()
    live = options.serve or any(map(_gives_live_frames, options.camera))
    cameras, rendered = _open_cameras(options, size, live, open_synthetic, stack)
    if SYNTHETIC in options.camera:
        # What was learned from another camera is not known to be in the scene.
        selection = replace(selection, default=rendered, known=known if options.markers else {})
    learned = _learn(options.camera[0], cameras[0], selection)
    for name, source, camera, point in zip(
        CAMERA_NAMES, options.camera, cameras, points, strict=False
    ):
        if _gives_live_frames(source):
            height, width = _frame_of(camera, 0).image.shape[:2]
        else:
            width, height = getattr(camera, "size", (0, 0))
        _check_point(point, f"camera {name}'s" if len(cameras) > 1 else "the", width, height)
        _check_frame("picture", picture[1] if picture and picture[1] else 0, camera)
    markers = selection.markers(lambda pick: learned[pick.name])
    check_names(markers, file)
    return TrackingSetup(cameras, live, markers, points, picture, file, known, learned)


def _check_sources(options: TrackOptions) -> None:
    """Refuse sources that are too many or alike, and a scene for which there is no camera."""
    if len(options.camera) > len(CAMERA_NAMES):
        raise InvalidTrackOption(
            f"{len(options.camera)} cameras: give --camera at most {len(CAMERA_NAMES)} times"
        )
    devices = [name_of(source) for source in options.camera if is_live(source)]
    for device in devices:
        if devices.count(device) > 1:
            raise InvalidTrackOption(
                f"{device} is given twice; another --camera sees from another place"
            )
    if options.scene and SYNTHETIC not in options.camera:
        raise InvalidTrackOption(f"scene '{options.scene}': only --camera synthetic has a scene")
    shown_to = [
        name for name, s in zip(CAMERA_NAMES, options.camera, strict=False) if s == SYNTHETIC
    ]
    for name in re.findall(r"(?:^|,)\s*([A-Z])\.", options.scene):
        if name not in shown_to:
            raise InvalidTrackOption(
                f"scene '{options.scene}': no synthetic camera is {name}; "
                f"there is {', '.join(shown_to)}"
            )


def _select(options: TrackOptions, specs: dict[str, str | None]) -> tuple[MarkerSelection, Path]:
    """Return the selection of markers, and the file for learned ones."""
    picks = [read_pick(text) for text in options.pick]
    file = options.markers or markers_file()
    if options.markers and not file.exists() and not picks:
        raise InvalidTrackOption(f"markers {file}: there is no such file; make it with --pick")
    known = read_markers(file) if file.exists() else {}
    return MarkerSelection(specs, picks, known, options.markers is not None, DEFAULT_SPECS), file


def _webcams(options: TrackOptions) -> list[str]:
    return [source for source in options.camera if WEBCAM.fullmatch(source)]


def _open_cameras(
    options: TrackOptions,
    size: tuple[int, int] | None,
    live: bool,
    open_synthetic: OpenSynthetic,
    stack: ExitStack,
) -> tuple[list[FrameSource], dict[str, str]]:
    """Open all cameras; return them, and SPEC by name of the markers that are rendered.

    Args:
        options: as typed.
        size: (width, height), px, for webcams, or None.
        live: see open_camera.
        open_synthetic: opens a synthetic camera.
        stack: closes the cameras at its end.
    """
    webcams = _webcams(options)
    cameras: list[FrameSource] = []
    rendered: dict[str, str] = {}
    for name, source in zip(CAMERA_NAMES, options.camera, strict=False):
        if source == SYNTHETIC:
            camera, specs = open_synthetic(name, options.scene, options.fps)
            rendered = {**specs, **rendered}
        else:
            asked = size if source in webcams or not webcams else None
            camera = open_camera(source, live, options.fps, asked)
        cameras.append(camera)
        stack.callback(camera.close)
    return cameras, rendered


def _gives_live_frames(source: str) -> bool:
    """Return True if a source gives frames whether or not they are taken."""
    return source == SYNTHETIC or is_live(source)


def _learn(source: str, camera: FrameSource, selection: MarkerSelection) -> dict[str, Marker]:
    """Learn the picked markers; a file is opened for it beforehand, and tracked from its start."""
    learned = {}
    for pick in sorted(selection.picks, key=lambda pick: pick.frame):
        _check_frame("pick", pick.frame, camera)
        kind = selection.specs.get(pick.name)
        if _gives_live_frames(source):
            learned[pick.name] = _learn_one(pick, kind, camera)
        else:
            with open_camera(source) as again:
                learned[pick.name] = _learn_one(pick, kind, again)
    return learned


def _learn_one(pick: Pick, kind: str | None, camera: FrameSource) -> Marker:
    """Learn a marker, and look for it in the frames that come next.

    Raises:
        BadMarker: it cannot be learned, or is in none of these.
    """
    frame = _frame_of(camera, pick.frame)
    marker = learn(pick.name, frame.image, pick.where, kind)
    tracker = Tracker([marker])
    tracker.find(frame.image, frame.t)
    count = 0
    while count < NEXT_FRAMES and (after := camera.read(READ_TIMEOUT)) is not None:
        if tracker.find(after.image, after.t)[pick.name] is not None:
            return marker
        count += 1
    if not count:  # the last frame
        return marker
    where = ",".join(f"{part:g}" for part in pick.where)
    raise BadMarker(
        f"{pick.name}: what is at {where} of frame {frame.index} is not found in the {count} "
        f"after it ({tracker.why[pick.name]}); pick it where it stays in the picture"
    )


def _frame_of(camera: FrameSource, index: int) -> Frame:
    """Read the frame with this index, or the next one after it."""
    deadline = time.monotonic() + FIRST_FRAME_TIMEOUT
    while time.monotonic() < deadline and not camera.ended:
        frame = camera.read(READ_TIMEOUT)
        if frame and frame.index >= index:
            return frame
        if frame:
            deadline = time.monotonic() + FIRST_FRAME_TIMEOUT
    if camera.ended:
        raise InvalidTrackOption(
            f"frame {index} is beyond the end of {camera.name}; choose an earlier one"
        )
    raise InvalidTrackOption(
        f"{camera.name} gives no picture within {FIRST_FRAME_TIMEOUT:g} s; "
        "end other programs that use it, or plug it in anew"
    )


def _check_frame(what: str, index: int, camera: FrameSource) -> None:
    count = getattr(camera, "count", None)
    if count and index >= count:
        raise InvalidTrackOption(
            f"{what}: frame {index} is beyond the end; {camera.name} has frames 0 to {count - 1}"
        )


def _check_point(point: Point | None, whose: str, width: int, height: int) -> None:
    if point and width and not (0 <= point[0] <= width - 1 and 0 <= point[1] <= height - 1):
        raise InvalidTrackOption(
            f"goal {point[0]:g},{point[1]:g} is outside {whose} picture; u from 0 to {width - 1}, "
            f"v from 0 to {height - 1}"
        )
