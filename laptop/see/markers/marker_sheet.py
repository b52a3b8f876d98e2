"""A page of markers to print, cut out and stick on: true to size, with the white rim they need."""

from __future__ import annotations

from pathlib import Path

import cv2
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle

from laptop.see.markers.markers import ARUCO_IDS
from shared.arm_description import ArmError

PAGE = (210.0, 297.0)
"""Width and height of A4, mm."""
COLORS = {"red": "#d01020", "green": "#109040", "blue": "#1050c0"}
"""Colours of the printed discs: far apart in hue, and from wood, skin and yellow beams."""
LIMITS = (5.0, 60.0)
"""Least and greatest diameter, mm."""


class BadSheet(ArmError, ValueError):
    """A page that cannot be made."""


def write_sheet(file: Path, diameter: float = 20.0) -> None:
    """Write the page, in the format that the file's ending says (pdf, svg, png).

    Args:
        file: where to write it; its ending is the format.
        diameter: of a disc, and side of an ArUco marker, mm.

    Raises:
        BadSheet: a wrong size or ending, or no room.
    """
    if not LIMITS[0] <= diameter <= LIMITS[1]:
        raise BadSheet(
            f"size {diameter:g} mm: choose from {LIMITS[0]:g} to {LIMITS[1]:g}; "
            "20 suits a camera half a metre away"
        )
    check_file(file)
    figure = Figure(figsize=(PAGE[0] / 25.4, PAGE[1] / 25.4))
    page = figure.add_axes((0, 0, 1, 1), xlim=(0, PAGE[0]), ylim=(PAGE[1], 0))
    page.axis("off")
    page.text(
        15,
        14,
        "Print on matte paper at 100 %, cut along the grey circles, stick flat.  "
        "The white rim belongs to the marker.",
        fontsize=9,
    )
    pitch = 1.8 * diameter
    down = 24 + pitch / 2
    for name, color in COLORS.items():
        _row(page, down, pitch, diameter, name, color)
        down += pitch
    number = 0
    while down + pitch / 2 < PAGE[1] - 20 and number < ARUCO_IDS:
        number = _row(page, down, pitch, diameter, "aruco", None, number)
        down += pitch
    page.plot((15, 115), (PAGE[1] - 12,) * 2, color="0", lw=0.8, marker="|")
    page.text(118, PAGE[1] - 11, "100 mm, if it was printed true to size", fontsize=7)
    try:
        figure.savefig(file, dpi=254)
    except OSError as error:
        raise BadSheet(f"cannot write {file}: {error.strerror}; choose another file") from None


def check_file(file: Path) -> None:
    """Raise BadSheet if no page can be written to this file."""
    if not file.parent.is_dir():
        raise BadSheet(f"{file}: there is no folder {file.parent}; make it first")
    if file.suffix.lower() not in (".pdf", ".svg", ".png"):
        raise BadSheet(f"{file}: end its name in .pdf, .svg or .png")


def _row(
    page: Axes,
    down: float,
    pitch: float,
    diameter: float,
    name: str,
    color: str | None,
    first: int = 0,
) -> int:
    """Draw as many of one kind as fit side by side, and return the next number.

    Args:
        page: axes in mm, y down.
        down: of the row's middle, mm from the top of the page.
        pitch: from marker to marker, mm.
        diameter: mm.
        name: of the colour, printed below.
        color: None makes ArUco markers.
        first: the first ArUco number.
    """
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_50)
    numbers = range(first, min(ARUCO_IDS, first + int((PAGE[0] - 30) / pitch)))
    for column, number in enumerate(numbers):
        x, half = 15 + pitch * (column + 0.5), diameter / 2
        # Cut along a circle; a square's corners need a little more.
        page.add_patch(Circle((x, down), 0.85 * diameter, fill=False, color="0.8", lw=0.4))
        if color:
            page.add_patch(Circle((x, down), half, color=color, lw=0))
        else:
            code = cv2.aruco.generateImageMarker(dictionary, number, 6, borderBits=1)
            extent = (x - half, x + half, down + half, down - half)
            page.imshow(code, cmap="gray", interpolation="nearest", extent=extent)
            name = f"aruco:{number}"
        page.text(x, down + 0.74 * diameter, name, ha="center", fontsize=5, color="0.5")
    page.set(xlim=(0, PAGE[0]), ylim=(PAGE[1], 0), aspect="auto")
    return numbers.stop
