"""An arm's pose on the board, and its marker's offset, as a file: JSON, cm and rad.

It holds what touching the board's crosses gave; it is written whole or not at all.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from laptop.see.markers.board import BOARDS
from laptop.see.table.camera_file import write_json
from laptop.see.table.marker_offset import BadTouches, MarkerFit
from shared.config_files import InvalidFile, number, read_json
from shared.message_fields import printable
from shared.state import TOUCHED_FOLDER, state_folder

SHAPES = {"offset": (2,), "base": (2,), "covariance": (7, 7)}
LIMITS = {
    "height": (-5.0, 50.0),
    "turn": (-100.0, 100.0),
    "scale": (0.5, 2.0),
    "rms_mm": (0.0, 1000.0),
}
"""Least and greatest values that are believed, cm and rad."""
MAX_DISTANCE = 500.0
"""Greatest distance from the board's origin to the arm, and from the pen to the marker, cm."""


@dataclass(frozen=True, eq=False)
class TouchedArm:
    """Results of touching the crosses.

    arm    its name
    paper  name of the board's paper, see `laptop.see.markers.board.BOARDS`
    bar    length of its bar that was reckoned with, mm; None: as printed, not measured
    fit    where the marker sits, and how the arm stands on the board
    """

    arm: str
    paper: str
    bar: float | None
    fit: MarkerFit


def touched_file(arm: str) -> Path:
    """Return the path of an arm's file, by the arm's name; it need not be there."""
    return Path(state_folder()) / TOUCHED_FOLDER / f"{arm}.json"


def write_touched(file: str | Path, found: TouchedArm) -> None:
    """Store a fit.

    Raises:
        BadTouches: the file cannot be written.
    """
    fields: dict[str, object] = {"arm": found.arm, "board": found.paper, "bar": found.bar}
    fields.update({name: float(getattr(found.fit, name)) for name in LIMITS})
    fields.update({name: np.asarray(getattr(found.fit, name), float).tolist() for name in SHAPES})
    try:
        Path(file).parent.mkdir(parents=True, exist_ok=True)
        write_json(file, fields)
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
    except InvalidFile as error:
        raise BadTouches(
            f"{name}: this is no file of touched crosses ({printable(str(error))}); touch them anew"
        ) from None


def _understand(fields: dict[str, object]) -> TouchedArm:
    """Return the touched arm of a JSON object; InvalidFile: it is something else."""
    keys = "arm", "board", "bar", *LIMITS, *SHAPES
    if missing := [name for name in keys if name not in fields]:
        raise InvalidFile(f"without {missing[0]}")
    arrays = {}
    for key, shape in SHAPES.items():
        try:
            array = np.array(fields[key], float)
        except (TypeError, ValueError):
            array = np.array(np.nan)
        if array.shape != shape or not np.isfinite(array).all():
            raise InvalidFile(f"{key} is not {' x '.join(map(str, shape))} numbers")
        arrays[key] = array
    numbers = {}
    for key, (low, high) in LIMITS.items():
        numbers[key] = number(fields[key])
        if not low <= numbers[key] <= high:
            raise InvalidFile(f"{key} {numbers[key]:g} is not from {low:g} to {high:g}")
    if np.abs([*arrays["offset"], *arrays["base"]]).max() > MAX_DISTANCE:
        raise InvalidFile(f"offset or base is farther than {MAX_DISTANCE:g} cm")
    if np.diag(arrays["covariance"]).min() < 0:
        raise InvalidFile("variances are above 0")
    if fields["board"] not in BOARDS:
        raise InvalidFile("board is not one of " + ", ".join(BOARDS))
    if not isinstance(fields["arm"], str):
        raise InvalidFile("arm is not a name")
    bar = None if fields["bar"] is None else number(fields["bar"])
    fit = MarkerFit(
        arrays["offset"],
        numbers["height"],
        numbers["turn"],
        arrays["base"],
        numbers["scale"],
        arrays["covariance"],
        numbers["rms_mm"],
    )
    return TouchedArm(fields["arm"], str(fields["board"]), bar, fit)
