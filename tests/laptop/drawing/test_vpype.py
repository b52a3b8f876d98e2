"""What vpype 1.15 wrote is read to the last point, against what vpype itself says it holds.

The files were made by the commands that stand in them, and in said.json beside vpype's own numbers.
"""

import json
from pathlib import Path

import numpy as np
import pytest

from laptop.drawing.svg import read_svg

FOLDER = Path(__file__).parent / "vpype"
SAID = json.loads((FOLDER / "said.json").read_text("utf-8"))
PX = 2.54 / 96
ROUNDED = 1e-4 * PX
"""vpype writes four decimals of a px."""


@pytest.mark.parametrize("name", ["layers", "random", "piped"])
def test_each_line_of_vpype_is_a_stroke_point_by_point(name):
    artwork = read_svg((FOLDER / f"{name}.svg").read_bytes(), name)
    said = SAID[name]
    lines = [(layer, np.array(line)) for layer, lines in said["layers"].items() for line in lines]
    height = artwork.size[1]
    assert artwork.layers == tuple(layer for layer, _ in lines)
    for stroke, (_, line) in zip(artwork.strokes, lines, strict=True):
        wanted = line * [PX, -PX] + [0, height]
        assert stroke.shape == wanted.shape
        assert np.abs(stroke - wanted).max() <= ROUNDED
    assert artwork.left_out == ()
    assert artwork.points() - len(artwork.strokes) == said["segments"]
    assert artwork.length() == pytest.approx(said["length"] * PX, rel=1e-5)


def test_the_sheet_is_that_of_vpype():
    artwork = read_svg((FOLDER / "random.svg").read_bytes())
    assert artwork.size == pytest.approx((21.0, 14.8), abs=1e-4)
    assert np.array(SAID["random"]["page_size"]) * PX == pytest.approx(artwork.size, abs=1e-4)
    assert read_svg((FOLDER / "layers.svg").read_bytes()).size == pytest.approx((12, 9))


def test_it_lies_on_the_sheet_where_vpype_says():
    for name, said in SAID.items():
        artwork = read_svg((FOLDER / f"{name}.svg").read_bytes())
        left, top, right, bottom = np.array(said["bounds"]) * PX
        least, greatest = artwork.bounds()
        height = artwork.size[1]
        assert (*least, *greatest) == pytest.approx(
            (left, height - bottom, right, height - top), abs=ROUNDED
        ), name
