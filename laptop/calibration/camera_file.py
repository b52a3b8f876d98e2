"""A calibrated camera as a file: JSON, cm, rad and px, written whole or not at all."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from laptop.calibration.camera_fit import BadCalibration, Calibration
from laptop.calibration.camera_model import CameraModel
from laptop.files import write_whole
from laptop.vision.board import BOARDS
from shared.message_fields import printable
from shared.small_files import SpoiltFile, read_text

SHAPES = {"lens": (8,), "rotation": (3,), "translation": (3,), "covariance": (14, 14)}
NUMBERS = ("rms", "rms_mm", "blur")


def write_camera(file: str | Path, calibration: Calibration) -> None:
    """Keep a calibration.

    Raises:
        BadCalibration: the file cannot be written.
    """
    camera = calibration.camera
    told = {
        "board": calibration.board.paper,
        "bar": calibration.bar,
        "size": list(camera.size),
        "markers": list(calibration.markers),
        **{name: getattr(calibration, name) for name in NUMBERS},
        **{name: getattr(camera, name).tolist() for name in SHAPES},
    }
    try:
        write_json(file, told)
    except OSError as error:
        raise BadCalibration(
            f"cannot write {printable(str(file))}: {error.strerror}; choose another file"
        ) from None


def write_json(file: str | Path, told: Mapping[str, object]) -> None:
    """Write a file of JSON, whole or not at all.

    Raises:
        OSError: it cannot be written.
    """
    write_whole(Path(file), json.dumps(told).encode())


def read_camera(file: str | Path) -> Calibration:
    """Read a calibration from its file.

    Raises:
        BadCalibration: it is not there, or is none.
    """
    name = printable(str(file))
    try:
        told = json.loads(read_text(str(file)))
    except OSError as error:
        raise BadCalibration(
            f"cannot read {name}: {error.strerror}; make it with the command camera"
        ) from None
    except (SpoiltFile, ValueError, RecursionError) as error:
        raise BadCalibration(
            f"{name}: this is no camera's file ({printable(str(error))}); make it anew"
        ) from None
    try:
        return _understand(told)
    except (KeyError, TypeError, ValueError, AttributeError, OverflowError) as error:
        what = f"{error.args[0]}" if error.args else "?"
        raise BadCalibration(
            f"{name}: this is no camera's file ({printable(what)}); make it anew"
        ) from None


def _understand(told: dict[str, object]) -> Calibration:
    arrays = {}
    for key, shape in SHAPES.items():
        array = np.array(told[key], float)
        if array.shape != shape or not np.isfinite(array).all():
            raise ValueError(f"{key} is not {' x '.join(map(str, shape))} numbers")
        arrays[key] = array
    size, bar, markers = told["size"], told["bar"], told["markers"]
    numbers = [told[key] for key in NUMBERS]
    if told["board"] not in BOARDS:
        raise ValueError("board is not one of " + ", ".join(BOARDS))
    for one in [*_list(size, "size"), *_list(markers, "markers")]:
        if not isinstance(one, int) or not 0 < one < 100000:
            raise ValueError("size and markers are whole numbers")
    for number in [*numbers, *([bar] if bar is not None else [])]:
        if not isinstance(number, int | float) or not 0 <= number < 1e6:
            raise ValueError(f"{', '.join(NUMBERS)} and bar are numbers")
    width, height = _list(size, "size")
    if arrays["lens"][0] <= 0 or np.diag(arrays["covariance"]).min() < 0:
        raise ValueError("focal length and variances are above 0")
    camera = CameraModel((width, height), **arrays)
    rms, rms_mm, blur = (float(str(number)) for number in numbers)
    board = BOARDS[str(told["board"])]
    length = None if bar is None else float(str(bar))
    return Calibration(camera, board, length, tuple(_list(markers, "markers")), rms, rms_mm, blur)


def _list(value: object, name: str) -> list[int]:
    if not isinstance(value, list) or not value:
        raise ValueError(f"{name} is not a list")
    return value
