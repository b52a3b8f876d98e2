from pathlib import Path

import cv2
import numpy as np
import pytest

from laptop.see.markers.learning import learn
from laptop.see.markers.marker_sheet import BadSheet, write_sheet
from laptop.see.markers.markers import Marker, read_spec
from laptop.see.markers.tracker import Tracker

PX_PER_MM = 10


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    file = tmp_path_factory.mktemp("sheet") / "markers.png"
    write_sheet(file, 20)
    return cv2.imread(str(file))


def test_the_page_is_a4(page):
    assert page.shape[:2] == (2970, 2100)


@pytest.mark.parametrize(("row", "color"), [(0, "red"), (1, "green"), (2, "blue")])
def test_a_disc_has_the_size_and_colour_it_says(page, row, color):
    # Rows are 1.8 diameters apart, columns too.
    u, v = 10 * (15 + 18), 10 * (24 + 18 + 36 * row)
    window = page[v - 180 : v + 180, u - 180 : u + 180]
    learned = learn(color, window, (180, 180))
    assert learned.kind == "disc"
    assert learned.radius == pytest.approx(10 * PX_PER_MM, rel=0.02)
    small = cv2.resize(window, (90, 90), interpolation=cv2.INTER_AREA)
    seen = Tracker([read_spec("x", color)]).find(small, 0.0)["x"]
    assert seen.confidence > 0.9
    assert seen.radius == pytest.approx(25, rel=0.02)


def test_its_aruco_markers_are_found_by_number(page):
    small = cv2.resize(page, None, fx=0.25, fy=0.25, interpolation=cv2.INTER_AREA)
    found = Tracker([Marker(str(k), "aruco", id=k) for k in range(10)]).find(small, 0.0)
    assert all(found.values())
    assert found["1"].u - found["0"].u == pytest.approx(36 * PX_PER_MM / 4, abs=1)


@pytest.mark.parametrize(
    ("name", "size", "reported"),
    [
        ("markers.doc", 20, r"markers\.doc: end its name in \.pdf, \.svg or \.png"),
        ("markers.pdf", 2, "size 2 mm: choose from 5 to 60"),
        ("markers.pdf", float("nan"), "size nan mm: choose from 5 to 60"),
        ("none/markers.pdf", 20, r"none/markers\.pdf: there is no folder none; make it first"),
    ],
)
def test_what_cannot_be_made_is_said_in_one_line(name, size, reported, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(BadSheet, match=reported):
        write_sheet(Path(name), size)
    assert list(tmp_path.iterdir()) == []


def test_its_ruler_is_100_mm_long(page):
    row = page[2970 - 120, 100:1160].min(axis=1) < 100
    assert np.flatnonzero(row)[[0, -1]] + 100 == pytest.approx([150, 1150], abs=2)
