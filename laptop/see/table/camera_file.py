"""A calibrated camera as a file: JSON, cm, rad and px, written whole or not at all."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from laptop.see.markers.board import BOARDS
from laptop.see.table.camera_fit import (
    BAR_LIMITS,
    MAX_RMS,
    MAX_TILT,
    MIN_MARKERS,
    BadCalibration,
    Calibration,
)
from laptop.see.table.camera_model import LENS, CameraModel
from laptop.system.files import write_whole
from shared.config_files import InvalidFile, read_text
from shared.message_fields import printable

SHAPES = {"lens": (8,), "rotation": (3,), "translation": (3,), "covariance": (14, 14)}
NUMBERS = {"rms": MAX_RMS, "rms_mm": 100.0, "blur": 100.0}
"""Numbers, and the greatest that is believed: px, mm, px."""

SIDES = (16, 20000)
"""Least and greatest side of a picture, px."""
FOCALS = (0.1, 30.0)
"""Least and greatest focal length, in the picture's longer side: fisheyes to telescopes."""
CENTRES = (-1.0, 2.0)
"""Least and greatest place of the lens's axis, in the picture's sides: outside for a part of a
picture."""
BENDS = (20.0, 20.0, 1.0, 1.0, 20.0)
"""Greatest k1, k2, p1, p2, k3."""
TURNS = 4 * math.pi
"""Greatest length of a rotation vector, rad."""
HEIGHTS = (1.0, 10000.0)
"""Least and greatest height of a camera over its table, cm."""
SIGMAS = (*(3.0, 1.0, 1.0), *BENDS, *3 * [math.pi], *3 * [10.0])
"""Greatest standard deviations: of the focal length in its own, of the axis in the picture's longer
side, of the rotation in rad, of the shift in the distance; nobody knows less than that."""
ASYMMETRY = 1e-3
"""Greatest error of a correlation: by how much it is beyond 1, or not the same both ways."""


def calibration_values(calibration: Calibration) -> dict[str, Any]:
    """Return a calibration as it stands in its file."""
    camera = calibration.camera
    return {
        "board": calibration.board.paper,
        "bar": calibration.bar,
        "size": list(camera.size),
        "markers": list(calibration.markers),
        **{name: getattr(calibration, name) for name in NUMBERS},
        **{name: getattr(camera, name).tolist() for name in SHAPES},
    }


def write_camera(file: str | Path, calibration: Calibration) -> None:
    """Store a calibration.

    Raises:
        BadCalibration: the file cannot be written.
    """
    try:
        write_json(file, calibration_values(calibration))
    except OSError as error:
        raise BadCalibration(
            f"cannot write {printable(str(file))}: {error.strerror}; choose another file"
        ) from None


def write_json(file: str | Path, fields: Mapping[str, object]) -> None:
    """Write a file of JSON, whole or not at all.

    Raises:
        OSError: it cannot be written.
    """
    write_whole(Path(file), json.dumps(fields).encode())


def read_camera(file: str | Path) -> Calibration:
    """Read a calibration from its file.

    Raises:
        BadCalibration: it is not there, or is none.
    """
    name = printable(str(file))
    try:
        fields = json.loads(read_text(str(file)))
    except OSError as error:
        raise BadCalibration(
            f"cannot read {name}: {error.strerror}; make it with measure camera"
        ) from None
    except (InvalidFile, ValueError, RecursionError) as error:
        raise BadCalibration(
            f"{name}: this is no camera's file ({printable(str(error))}); make it anew"
        ) from None
    try:
        return _understand(fields)
    except (KeyError, TypeError, ValueError, AttributeError, OverflowError) as error:
        what = f"{error.args[0]}" if error.args else "?"
        raise BadCalibration(
            f"{name}: this is no camera's file ({printable(what)}); make it anew"
        ) from None


def _understand(fields: dict[str, object]) -> Calibration:
    arrays = {}
    for key, shape in SHAPES.items():
        array = np.array(fields[key], float)
        if array.shape != shape or not np.isfinite(array).all():
            raise ValueError(f"{key} is not {' x '.join(map(str, shape))} numbers")
        arrays[key] = array
    size, markers = _list(fields["size"], "size"), _list(fields["markers"], "markers")
    bar = fields["bar"]
    if fields["board"] not in BOARDS:
        raise ValueError("board is not one of " + ", ".join(BOARDS))
    board = BOARDS[str(fields["board"])]
    if any(type(one) is not int for one in [*size, *markers]):
        raise ValueError("size and markers are whole numbers")
    width, height = size
    _within("size", min(size), *SIDES)
    _within("size", max(size), *SIDES)
    _within("markers", min(markers), MIN_MARKERS, len(board.numbers))
    _within("markers", max(markers), MIN_MARKERS, len(board.numbers))
    rms, rms_mm, blur = (_within(key, fields[key], 0, most) for key, most in NUMBERS.items())
    length = None if bar is None else _within("bar", bar, *BAR_LIMITS)
    camera = CameraModel((width, height), **arrays)
    _check(camera)
    return Calibration(camera, board, length, tuple(markers), rms, rms_mm, blur)


def _within(name: str, value: object, least: float, most: float) -> float:
    """Return the value as a number between these limits; ValueError if it is none."""
    if not isinstance(value, int | float) or isinstance(value, bool):
        raise ValueError(f"{name} is not a number")
    number = float(value)
    if not least <= number <= most:
        raise ValueError(f"{name} is {number:g}; a camera's is from {least:g} to {most:g}")
    return number


def _check(camera: CameraModel) -> None:
    """Refuse (ValueError) what no camera is."""
    longer = max(camera.size)
    focal, *centre = camera.lens[:3]
    _within("focal length", focal / longer, *FOCALS)
    for name, at, side in zip(("cx", "cy"), centre, camera.size, strict=True):
        _within(f"{name} in the picture's sides", at / side, *CENTRES)
    for name, bend, most in zip(LENS[3:], camera.distortion, BENDS, strict=True):
        _within(name, bend, -most, most)
    if not np.abs(camera.rotation).max() <= TURNS:
        raise ValueError(f"rotation is more than {TURNS:.1f} rad")
    if not np.abs(camera.translation).max() <= HEIGHTS[1] / math.cos(MAX_TILT):
        raise ValueError("translation is farther than any camera is from its table")
    _within("height over the table, cm,", camera.position[2], *HEIGHTS)
    _within("angle from straight down", math.degrees(camera.tilt), 0, math.degrees(MAX_TILT))
    units = np.array([focal, *2 * [longer], *8 * [1.0], *3 * [np.linalg.norm(camera.translation)]])
    spread = camera.covariance / np.outer(units, units)
    variances = np.diag(spread)
    if variances.min() < 0 or (variances > np.square(SIGMAS)).any():
        raise ValueError("covariance has variances below 0, or larger than nobody knows them")
    roots = np.sqrt(np.where(variances > 0, variances, 1.0))
    with np.errstate(over="ignore", invalid="ignore"):
        related = spread / np.outer(roots, roots)
        beyond = max(np.abs(related).max() - 1, np.abs(related - related.T).max())
    if not beyond <= ASYMMETRY or np.linalg.eigvalsh(related)[0] < -ASYMMETRY:
        raise ValueError("covariance is none: it is not symmetric, or not positive")


def _list(value: object, name: str) -> list[int]:
    if not isinstance(value, list) or not value:
        raise ValueError(f"{name} is not a list")
    return value
