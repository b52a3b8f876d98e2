"""Options of `track`: what is typed becomes numbers, points and files, or is refused."""

from __future__ import annotations

import math
import re
import string
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from shared.arm_description import ArmError

if TYPE_CHECKING:
    from laptop.see.serve.pipeline import Point

CAMERA_NAMES = string.ascii_uppercase[:8]
"""Names of cameras in observations, as many as a brick listens to."""


class InvalidTrackOption(ArmError, ValueError):
    """An option of `track` that cannot be followed."""


@dataclass(frozen=True, kw_only=True)
class TrackCameraOptions:
    """Cameras and markers, as they are typed; see `python -m laptop track --help`."""

    camera: tuple[str, ...]
    effector: str | None
    goal: tuple[str, ...]
    pick: tuple[str, ...]
    markers: Path | None
    scene: str
    fps: float | None
    size: str | None
    board: bool = False
    bar: float | None = None
    height: float | None = None
    touched: Path | None = None


@dataclass(frozen=True, kw_only=True)
class TrackOptions(TrackCameraOptions):
    """What is seen, who is served with it, and what is written.

    csv      file of what was seen, or None
    serve    whether a brick is served
    host, port  where it is waited for; "": all addresses, None: the usual port
    picture  FILE.png[@FRAME], or None
    open     what is to be seen is opened in a browser
    """

    csv: Path | None
    serve: bool
    host: str
    port: int | None
    picture: str | None
    open: bool = False


class Pick(NamedTuple):
    """A marker to learn from a frame of the first camera.

    name   of the marker
    where  u, v or u0, v0, u1, v1, px
    frame  index of the frame
    """

    name: str
    where: tuple[float, ...]
    frame: int


def read_numbers(text: str) -> tuple[float, ...] | None:
    """Read numbers with commas between them; None if the text is something else."""
    try:
        numbers = tuple(float(part) for part in text.split(","))
    except ValueError:
        return None
    return numbers if all(map(math.isfinite, numbers)) else None


def read_pick(text: str) -> Pick:
    """Read `NAME=U,V@FRAME` or `NAME=U0,V0,U1,V1@FRAME`; without @FRAME the first one.

    Raises:
        InvalidTrackOption: it is neither.
    """
    name, _, rest = text.partition("=")
    where, at, frame = rest.partition("@")
    numbers = read_numbers(where)
    if not name or numbers is None or len(numbers) not in (2, 4):
        raise InvalidTrackOption(
            f"pick '{text}': write NAME=U,V@FRAME (px), e.g. effector=320,240@0"
        )
    if at and not frame.isdecimal():
        raise InvalidTrackOption(
            f"pick '{text}': frame '{frame}' is not a whole number; the first one is 0"
        )
    return Pick(name, numbers, int(frame or 0))


def read_goals(texts: Sequence[str], cameras: int) -> str | list[Point] | None:
    """Read a marker's SPEC, or one fixed point per camera; None if none is given.

    Args:
        texts: a SPEC; or U,V for every camera in turn; or A:U,V, B:U,V, ... in any order.
        cameras: number of cameras.

    Raises:
        InvalidTrackOption: points and cameras do not match.
    """
    fixed: dict[str, Point] = {}
    for name, text in zip(CAMERA_NAMES, texts, strict=False):
        camera, colon, where = text.rpartition(":")
        point = read_numbers(where)
        if point and len(point) == 2:
            fixed[camera if colon else name] = (point[0], point[1])
    if not fixed:
        if len(texts) > 1:
            raise InvalidTrackOption(f"goal '{texts[1]}': one marker is the goal; give --goal once")
        return texts[0] if texts else None
    names = CAMERA_NAMES[:cameras]
    if len(texts) != cameras or set(fixed) != set(names):
        each = " ".join(f"--goal {name}:U,V" for name in names)
        raise InvalidTrackOption(
            f"goal '{' '.join(texts)}': give one point for each of the {cameras} cameras: {each}"
            if cameras > 1
            else f"goal '{' '.join(texts)}': give one point U,V, or one marker"
        )
    return [fixed[name] for name in names]


def read_size(text: str) -> tuple[int, int]:
    """Read `WxH`, px.

    Raises:
        InvalidTrackOption: it is not.
    """
    size = re.fullmatch(r"(\d{2,5})x(\d{2,5})", text)
    if not size:
        raise InvalidTrackOption(f"size '{text}': write WIDTHxHEIGHT in px, e.g. 640x480")
    return int(size[1]), int(size[2])


def read_picture(text: str) -> tuple[Path, int | None]:
    """Read `FILE.png` or `FILE.png@FRAME`; without @FRAME the last one (None).

    Raises:
        InvalidTrackOption: no picture can be written there.
    """
    name, at, frame = text.rpartition("@")
    if not at or not frame.isdecimal():
        name, frame = text, ""
    file = Path(name)
    if file.suffix.lower() not in (".png", ".jpg"):
        raise InvalidTrackOption(f"picture '{name}': let its name end in .png or .jpg")
    if not file.parent.is_dir():
        raise InvalidTrackOption(f"picture {file}: there is no folder {file.parent}; make it first")
    return file, int(frame) if frame else None
