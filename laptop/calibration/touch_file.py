"""How an arm stands on the board and where its marker sits, as a file: JSON, cm and rad."""

from __future__ import annotations

import json
import math
import os
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from laptop.calibration.marker_offset import BadTouches, MarkerFit
from laptop.vision.board import BOARDS
from shared.message_fields import printable
from shared.small_files import SpoiltFile, open_to_write, read_json
from shared.state import TOUCHED_FOLDER, state_folder

SHAPES = {"offset": (2,), "base": (2,), "covariance": (7, 7)}
NUMBERS = ("height", "turn", "scale", "rms_mm")


@dataclass(frozen=True, eq=False)
class TouchedArm:
    """What was found by touching crosses.

    arm    its name
    paper  name of the board's paper, see `laptop.vision.board.BOARDS`
    bar    length of its bar that was reckoned with, mm; None: as printed, not measured
    fit    where the marker sits, and how the arm stands on the board
    """

    arm: str
    paper: str
    bar: float | None
    fit: MarkerFit


def touched_file(arm: str) -> Path:
    """Path of the file of the arm of this name; it need not be there."""
    return Path(state_folder()) / TOUCHED_FOLDER / f"{arm}.json"


def write_touched(file: str | Path, found: TouchedArm) -> None:
    """Keep what was found, whole or not at all.

    Raises:
        BadTouches: the file cannot be written.
    """
    told = {
        "arm": found.arm,
        "board": found.paper,
        "bar": found.bar,
        **{name: float(getattr(found.fit, name)) for name in NUMBERS},
        **{name: getattr(found.fit, name).tolist() for name in SHAPES},
    }
    target = Path(os.path.abspath(file))
    draft = target.parent / f".{target.name}.part"
    try:
        try:
            target.parent.mkdir(parents=True, exist_ok=True)
            with open(open_to_write(str(draft)), "w", encoding="utf-8") as out:
                json.dump(told, out)
            draft.replace(target)
        finally:
            draft.unlink(missing_ok=True)
    except OSError as error:
        raise BadTouches(
            f"cannot write {printable(str(file))}: {error.strerror}; choose another file"
        ) from None


def read_touched(file: str | Path) -> TouchedArm:
    """Read what was found from its file.

    Raises:
        BadTouches: it is not there, or is none.
    """
    name = printable(str(file))
    try:
        return _understand(read_json(str(file)))
    except OSError as error:
        raise BadTouches(
            f"cannot read {name}: {error.strerror}; make it with the command touch"
        ) from None
    except KeyError as error:
        why = f"it has no {error.args[0]}"
    except (SpoiltFile, TypeError, ValueError, OverflowError) as error:
        why = printable(str(error))
    raise BadTouches(f"{name}: this is no file of touches ({why}); make it anew")


def _understand(told: dict[str, object]) -> TouchedArm:
    arrays = {}
    for key, shape in SHAPES.items():
        array = np.array(told[key], float)
        if array.shape != shape or not np.isfinite(array).all():
            raise ValueError(f"{key} is not {' x '.join(map(str, shape))} numbers")
        arrays[key] = array
    numbers = {key: _number(told[key], key) for key in NUMBERS}
    if np.diag(arrays["covariance"]).min() < 0 or numbers["scale"] <= 0:
        raise ValueError("variances and scale are above 0")
    if told["board"] not in BOARDS:
        raise ValueError("board is not one of " + ", ".join(BOARDS))
    if not isinstance(told["arm"], str):
        raise ValueError("arm is not a name")
    bar = None if told["bar"] is None else _number(told["bar"], "bar")
    fit = MarkerFit(
        arrays["offset"],
        numbers["height"],
        numbers["turn"],
        arrays["base"],
        numbers["scale"],
        arrays["covariance"],
        numbers["rms_mm"],
    )
    return TouchedArm(told["arm"], str(told["board"]), bar, fit)


def _number(value: object, key: str) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise ValueError(f"{key} is not a number")
    return float(value)
