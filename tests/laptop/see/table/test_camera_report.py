import re

import numpy as np
import pytest
from board_views import stand, view

from laptop.see.table.camera_fit import BadCalibration, calibrate
from laptop.see.table.camera_report import describe, parallax, shift_since

TILTED = stand(52, 25, 200, 3)


def found(*where, bar=None, seed=0, **options):
    rng = np.random.default_rng(seed)
    return calibrate([view(one, rng, **options) for one in where], bar)


def test_all_that_matters_is_told():
    text = "\n".join(describe(found(TILTED)))
    assert "board a4: 26 of 26 markers in 1 view; the model misses them by 0.0" in text
    assert re.search(r"camera: 4[67]\.\d cm above the table, 25 degrees from straight down", text)
    assert "lens: focal length 6" in text
    assert "a point on the table is sure to 0.3" in text
    assert "parallax: what is 1 cm above the table seems up to 7." in text
    assert "are covered" not in text
    assert "blurred" not in text


def test_a_print_that_nobody_measured_is_not_called_true():
    assert any(
        "The picture cannot tell whether the print is true: measure the bar" in line
        for line in describe(found(TILTED))
    )
    assert any(line.endswith("mm, if the print is true") for line in describe(found(TILTED)))
    measured = describe(found(TILTED, bar=97))
    assert "scale: the bar is 97 mm long, as measured" in measured
    assert not any("if the print is true" in line for line in measured)


def test_what_could_be_better_is_told():
    half = found(TILTED, keep=lambda x, y: x < 0)
    assert "13 of 26 markers are covered, blurred or outside: the 13 that are seen are enough" in (
        describe(half)
    )
    straight = describe(found(stand(52, 2)))
    assert any("the focal length is little more than a guess" in line for line in straight)
    blurred = describe(found(TILTED, blur=2.2))
    assert any("blurred: edges are spread by 2.2 px" in line for line in blurred)


@pytest.mark.parametrize("tilts", [(30,), (30, 40)])
def test_of_fewer_than_three_views_the_focal_length_is_called_a_guess(tilts):
    """What was cropped or squeezed fits one view or two as well, by a focal length of its own."""
    lines = describe(found(*(stand(52, tilt, 10 * tilt) for tilt in tilts)))
    (line,) = (line for line in lines if "little more than a guess" in line)
    assert "holds for whole, unscaled pictures only: take 3 views or more, the board tilted" in line


def test_of_three_views_that_tell_it_the_focal_length_is_called_known():
    lines = describe(found(TILTED, stand(50, 30, 60), stand(50, 0)))
    assert not any("guess" in line for line in lines)
    alike = describe(found(*(stand(52, tilt, 120 * tilt) for tilt in (0, 1, 2))))
    assert any("guess, which matters above the table: add a picture" in line for line in alike)


def test_pictures_of_one_view_are_told():
    lines = describe(found(*[TILTED] * 12))
    assert "markers in 1 view;" in lines[0]
    assert (
        "12 pictures show 1 view: those that show the same count once; "
        "move the camera or the board between pictures" in lines
    )
    assert not any("pictures show" in line for line in describe(found(TILTED, stand(50, 30))))


def test_the_parallax_is_what_geometry_has_it():
    """From 50 cm straight above, 1 cm up: what is r from the middle seems r / 49 farther out."""
    camera = found(TILTED, stand(50, 30, 60), stand(50, 0))
    reach = np.hypot(*camera.board.middle) / 2
    assert parallax(camera) == pytest.approx(reach / 49, rel=0.02)


def test_a_camera_that_has_moved_is_told_by_how_much():
    before = found(TILTED)
    stays = shift_since(before, view(TILTED, np.random.default_rng(9)))
    assert not stays.moved
    assert str(stays).startswith("camera and board are where they were, to 0.0")
    turned, shift = TILTED
    # Pushed sideways by 3 mm, 52 cm away at 610 px: 3.5 px in the middle.
    moved = shift_since(before, view((turned, shift + (0.3, 0, 0)), np.random.default_rng(9)))
    assert moved.moved
    assert moved.px == pytest.approx(610 * 0.3 / 52, rel=0.1)
    assert moved.mm == pytest.approx(3, rel=0.15)
    assert "the camera or the board has moved since by 3." in str(moved)
    half = shift_since(before, view(TILTED, np.random.default_rng(9), keep=lambda x, y: x > 0))
    assert not half.moved


@pytest.mark.parametrize("other", [{"size": (1280, 720)}, {"paper": "letter"}])
def test_another_board_or_size_is_no_motion_but_its_own_cause(other):
    with pytest.raises(BadCalibration, match="calibrated with board a4 at 640x480"):
        shift_since(found(TILTED), view(TILTED, **other))


def test_how_sure_a_point_is_holds_for_the_worst_of_the_middle():
    """From straight above a point is as unsure as it is far out: in the corners most."""
    camera = found(stand(52, 1))
    corner = np.array([[half / 2 for half in camera.board.middle]])
    pixel = camera.camera.project(np.array([[*corner[0], 3.0]]))
    sigma = np.sqrt(np.trace(camera.camera.placed(pixel, 3.0).covariance[0]))
    assert camera.point_sigma(3.0) == pytest.approx(sigma, rel=0.1)
    assert f"3 cm above it to {10 * camera.point_sigma(3.0):.2f} mm" in "\n".join(describe(camera))
