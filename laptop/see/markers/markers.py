"""Description of a marker: from a text, from a picked pixel, from a file that people can read.

A colour is a closed gate in hue, saturation and value, as light changes it least: hue is circular
(red needs no special case), saturation and value have floors.  Angles of hue are degrees, 0 red,
120 green, 240 blue; saturation and value run from 0 to 1.
"""

from __future__ import annotations

import configparser
import io
import math
import os
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import cv2
import numpy as np

from laptop.see.markers.kinds import COLOR_KINDS, KINDS
from laptop.system.files import write_whole
from shared.arm_description import ArmError
from shared.config_files import InvalidFile, read_text
from shared.message_fields import one_line, printable

ARUCO_IDS = 50
"""Number of markers in DICT_4X4_50."""


class BadMarker(ArmError, ValueError):
    """A marker that cannot be understood, learned or read."""


WIDER_SATURATION = 0.8
"""Factor on a marker's saturation down to which its surroundings still count as its colour."""


@dataclass(frozen=True)
class Color:
    """A colour as the camera saw it, and how far from it a pixel may be.

    hue         degrees, 0 <= hue < 360
    saturation  typical, 0 to 1
    value       typical, 0 to 1
    tolerance   of the hue, degrees
    saturation_floor, value_floor
                shares of the typical ones below which a pixel is no longer of the colour
    scene       what the whole picture looked like then: mean red, green, blue (0 to 255), or None;
                against it the tracker measures a change of the light
    """

    hue: float
    saturation: float
    value: float
    tolerance: float = 20.0
    saturation_floor: float = 0.55
    value_floor: float = 0.4
    scene: tuple[float, float, float] | None = None

    def wider(self, value: float = 1.0) -> Color:
        """Return the wider gate that still counts as this colour around a marker: paler, more hue.

        Args:
            value: part of the typical one that it has at the marker's edge.
        """
        return replace(
            self,
            tolerance=min(90.0, 1.3 * self.tolerance),
            saturation=WIDER_SATURATION * self.saturation,
            value=value * self.value,
        )


@dataclass(frozen=True)
class Marker:
    """One marker to look for.

    name   what observations call it, e.g. "effector"
    kind   one of KINDS; a disc is flat and matte, a ball is shaded, aruco is of DICT_4X4_50
    color  of one of COLOR_KINDS
    id     of an aruco marker
    radius as it was picked, px; at first the tracker allows a third to three times as much, and
           then of what it last saw
    """

    name: str
    kind: str
    color: Color | None = None
    id: int | None = None
    radius: float | None = None

    def __str__(self) -> str:
        if self.color is None:
            return f"{self.kind}:{self.id}"
        color = self.color
        return (
            f"{self.kind}, hue {color.hue:.0f} +- {color.tolerance:.0f}, "
            f"saturation {color.saturation:.2f}, value {color.value:.2f}"
        )


NAMED_COLORS = {
    "red": Color(0, 0.85, 0.7),
    "orange": Color(25, 0.85, 0.8, 12),
    "yellow": Color(55, 0.8, 0.85, 15),
    "green": Color(125, 0.7, 0.55, 35),
    "cyan": Color(185, 0.7, 0.7),
    "blue": Color(220, 0.75, 0.6),
    "purple": Color(275, 0.6, 0.55),
    "pink": Color(325, 0.65, 0.8, 25),
}
"""Colours that can be named; a picked pixel is better."""


def hsv_of(bgr: Iterable[float]) -> tuple[float, float, float]:
    """Return the hue (degrees), saturation and value (0 to 1) of a blue, green, red (0 to 255)."""
    b, g, r = bgr
    top, low = max(b, g, r), min(b, g, r)
    if top <= low:
        return 0.0, 0.0, top / 255
    if top == r:
        hue = 60 * (g - b) / (top - low)
    elif top == g:
        hue = 120 + 60 * (b - r) / (top - low)
    else:
        hue = 240 + 60 * (r - g) / (top - low)
    return hue % 360, (top - low) / top, top / 255


def hue_distance(a: float, b: float) -> float:
    """Return the signed hue distance from b to a the short way round, -180 to 180 degrees."""
    return (a - b + 180) % 360 - 180


# Words and files


def read_spec(name: str, text: str) -> Marker:
    """Return the marker of `[KIND:]COLOUR`, `aruco:ID` or a markers file that holds `name`.

    Raises:
        BadMarker: the text means nothing.
    """
    kind, colon, what = text.partition(":")
    if not colon or kind not in KINDS:
        kind, what = "disc", text
    if kind == "aruco":
        if not what.isdecimal() or len(what) > 9 or int(what) >= ARUCO_IDS:
            raise BadMarker(
                f"{name} '{one_line(text)}': an ArUco id is a number from 0 to {ARUCO_IDS - 1}"
            )
        return Marker(name, kind, id=int(what))
    if what in NAMED_COLORS:
        return Marker(name, kind, NAMED_COLORS[what])
    if os.path.isfile(what):  # Path.is_file raises where a name is too long for a file
        markers = read_markers(what)
        if name not in markers:
            held = ", ".join(markers) or "nothing"
            raise BadMarker(
                f"{printable(what)} has no marker [{name}], only {held}; pick it with --pick"
            )
        if colon and markers[name].color is None:
            raise BadMarker(
                f"{name} '{text}': [{name}] is {markers[name]} there; leave out '{kind}:' "
                "or pick it with --pick"
            )
        return replace(markers[name], kind=kind) if colon else markers[name]
    if "." in what or "/" in what:
        raise BadMarker(
            f"{name} '{one_line(text)}': there is no file {printable(what)}; make it with --pick"
        )
    raise BadMarker(
        f"{name} '{one_line(text)}': write {':COLOUR or '.join(COLOR_KINDS)}:COLOUR with one of "
        f"{', '.join(NAMED_COLORS)}, "
        f"aruco:ID, or a markers file{', or a point U,V such as 400,200' * (name == 'goal')}"
    )


_MIN_LIT_VALUE = 60
"""Least value, 0 to 255, in a picture whose colours would be seen."""
_MAX_GREY_CHROMA = 6
"""Greatest difference of two channels, 0 to 255, without colour: as much as a JPEG leaves."""
_FILE_HEADER = """\
# The markers, as the tracker learned them; correct by hand what it got wrong.
# hue, tolerance: degrees (0 red, 120 green, 240 blue); saturation, value: 0 to 1;
# saturation_floor, value_floor: shares of these below which a pixel is of another colour;
# scene: mean red, green, blue (0 to 255) of the picture in which it was picked;
# radius: px as it was picked; without it any size will do.
"""
_LIMITS = {
    "hue": (0, 360),
    "tolerance": (1, 90),
    "saturation": (0.05, 1),
    "value": (0.02, 1),
    "saturation_floor": (0.05, 1),
    "value_floor": (0.05, 1),
    "radius": (1, 2000),
}
_OPTIONAL = ("saturation_floor", "value_floor", "radius")


def read_markers(file: str | Path) -> dict[str, Marker]:
    """Return the markers in a file, by name.

    Raises:
        BadMarker: the file cannot be read, or a value is wrong.
    """
    parser = _parser()
    try:
        parser.read_string(read_text(file))
    except (configparser.DuplicateSectionError, configparser.DuplicateOptionError) as error:
        what = _shown(" ".join([f"[{error.args[0]}]", *error.args[1:-2]]))
        raise BadMarker(
            f"{file}: {what} is there twice (line {error.lineno}); correct or remove it"
        ) from None
    except InvalidFile as error:
        raise BadMarker(
            f"{file}: this is not a markers file ({error}); correct or remove it"
        ) from None
    except configparser.Error as error:
        line = f" (see line {error.lineno})" if hasattr(error, "lineno") else ""
        raise BadMarker(f"{file}: this is not a markers file{line}; correct or remove it") from None
    except OSError as error:
        raise BadMarker(f"cannot read {file}: {error.strerror}; choose another one") from None
    return {name: _read_section(file, name, parser[name]) for name in parser.sections()}


def _parser() -> configparser.ConfigParser:
    return configparser.ConfigParser(interpolation=None, default_section="")


def _shown(text: str) -> str:
    """Return some text of a file, shortened, without control characters."""
    text = " ".join(one_line(text).split())
    return text if len(text) <= 60 else text[:57] + "..."


def _read_section(file: str | Path, name: str, section: Mapping[str, str]) -> Marker:
    def complain(key: str, allowed: str) -> BadMarker:
        given = f"'{_shown(section[key])}' is not" if key in section else "missing;"
        return BadMarker(f"{file}: [{_shown(name)}] {key}: {given} {allowed}")

    def number(key: str) -> float:
        low, high = _LIMITS[key]
        try:
            value = float(section[key])
        except (KeyError, ValueError):
            value = math.nan
        if not low <= value <= high:
            raise complain(key, f"a number from {low:g} to {high:g}")
        return value

    if _shown(name) != name:
        raise BadMarker(f"{file}: [{_shown(name)}] is no name for a marker; give it a short one")
    if unknown := set(section) - {"kind", "id", "scene", *_LIMITS}:
        key = sorted(unknown)[0]
        raise BadMarker(f"{file}: [{_shown(name)}] {_shown(key)}: no such key; there are kind, id, "
                        f"scene, {', '.join(_LIMITS)}")  # fmt: skip
    kind = section.get("kind", "disc")
    if kind not in KINDS:
        raise complain("kind", f"one of {', '.join(KINDS)}")
    if kind == "aruco":
        given = section.get("id", "")
        if not given.isdecimal() or len(given) > 9 or int(given) >= ARUCO_IDS:
            raise complain("id", f"a whole number from 0 to {ARUCO_IDS - 1}")
        return Marker(name, kind, id=int(given))
    scene = None
    if "scene" in section:
        try:
            red, green, blue = (float(part) for part in section["scene"].split(","))
        except ValueError:
            raise complain("scene", "three numbers from 0 to 255: red, green, blue") from None
        if not all(0 <= part <= 255 for part in (red, green, blue)):
            raise complain("scene", "three numbers from 0 to 255: red, green, blue")
        scene = (red, green, blue)
    values = {key: number(key) for key in _LIMITS if key in section or key not in _OPTIONAL}
    radius = values.pop("radius", None)
    return Marker(name, kind, Color(**values, scene=scene), radius=radius)


def write_markers(file: str | Path, markers: Mapping[str, Marker]) -> None:
    """Store markers in a file, completely or not at all.

    Raises:
        BadMarker: the file cannot be written.
    """
    parser = _parser()
    for name, marker in markers.items():
        color = marker.color
        section = {"kind": marker.kind}
        if color is None:
            section["id"] = str(marker.id)
        else:
            values = vars(color) | {"radius": marker.radius}
            section |= {key: f"{values[key]:.4g}" for key in _LIMITS if values[key] is not None}
            if color.scene:
                section["scene"] = ", ".join(f"{part:.1f}" for part in color.scene)
        parser[name] = section
    text = io.StringIO()
    text.write(_FILE_HEADER)
    parser.write(text)
    try:
        Path(file).parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        write_whole(Path(file), text.getvalue().encode())
    except OSError as error:
        raise BadMarker(
            f"cannot write {file}: {error.strerror}; choose another with --markers"
        ) from None


# Pixels


def hsv_mask(hsv: np.ndarray, color: Color) -> np.ndarray:
    """Mask the pixels of a colour: closed in hue, with floors for saturation and value.

    Args:
        hsv: OpenCV's, uint8, shape (h, w, 3); hue 0 to 179, two degrees each.
        color: the gate that the pixels have to pass.

    Returns:
        uint8, shape (h, w), 255 inside.
    """
    low, high = (color.hue - color.tolerance) / 2, (color.hue + color.tolerance) / 2
    floors = (
        color.saturation_floor * color.saturation * 255,
        color.value_floor * color.value * 255,
    )
    mask = cv2.inRange(hsv, (low, *floors), (high, 255, 255))
    if low < 0:  # hue is a circle
        mask = cv2.bitwise_or(mask, cv2.inRange(hsv, (low + 180, *floors), (180, 255, 255)))
    elif high >= 180:
        mask = cv2.bitwise_or(mask, cv2.inRange(hsv, (0, *floors), (high - 180, 255, 255)))
    return mask


def is_grey(image: np.ndarray) -> bool:
    """Return whether a picture (BGR) has no colours, from every 16th pixel.

    The camera or film is in grey, or all that it sees is.  Not where there is hardly any light.
    """
    seen = np.ascontiguousarray(image[8::16, 8::16])
    if not seen.size or cv2.norm(seen, cv2.NORM_INF) < _MIN_LIT_VALUE:
        return False
    blue, green, red = cv2.split(seen)
    chroma = max(cv2.norm(one, green, cv2.NORM_INF) for one in (blue, red))
    return chroma <= _MAX_GREY_CHROMA


def scene_of(image: np.ndarray) -> tuple[float, float, float]:
    """Return the mean red, green, blue (0 to 255) of a picture, from every 8th pixel: its light."""
    blue, green, red, _ = cv2.mean(image[4::8, 4::8])
    return round(red, 1), round(green, 1), round(blue, 1)
