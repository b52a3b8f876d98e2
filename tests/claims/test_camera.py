import cv2
import numpy as np
import pytest

from laptop.emulator.scene import board_photographs as camera_renders
from laptop.emulator.scene.sensor import Development
from laptop.see.markers.board import BOARDS, MARKER
from laptop.see.markers.finders.board import find_board
from tests.claims import camera, camera_table, camera_touch
from tests.claims.camera import CONDITIONS, CameraCase, CameraResult, Condition


@pytest.fixture(scope="module")
def straight():
    """A picture from straight above through a plain lens: 12 px/cm."""
    lens = camera_renders.Lens(600.0, (319.5, 239.5), (0, 0, 0, 0, 0))
    where = camera_renders.CameraPose.looking(50, 0.0, 0.0, 0.0, (0, 0))
    return lens, where, camera_renders.photograph(lens, where, development=Development(noise=0))


@pytest.mark.claims
def test_a_photograph_shows_each_marker_where_geometry_has_it(straight):
    """The oracle is OpenCV's detector as it comes, and 12 px/cm."""
    lens, where, image = straight
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_100)
    quads, numbers, _ = cv2.aruco.ArucoDetector(dictionary).detectMarkers(image)
    board = BOARDS["a4"]
    assert len(numbers) >= 20
    for quad, number in zip(quads, numbers.ravel(), strict=True):
        x, y = board.centres[number - board.first]
        # Azimuth 0 has the picture's right along the board's y.
        assert quad[0].mean(axis=0) == pytest.approx((319.5 + 12 * y, 239.5 + 12 * x), abs=1)
    sides = [np.sqrt(cv2.contourArea(quad)) for quad in quads]
    assert np.median(sides) == pytest.approx(12 * MARKER, abs=1.5)
    centre = where.pixels(lens, np.array([[*board.centres[0], 0.0]]))[0]
    assert centre == pytest.approx(
        (319.5 + 12 * board.centres[0][1], 239.5 + 12 * board.centres[0][0]), abs=1e-6
    )


@pytest.mark.long
def test_a_photograph_shows_a_sheet_that_is_stretched_and_bent_where_it_is():
    lens = camera_renders.Lens(600.0, (319.5, 239.5), (0, 0, 0, 0, 0))
    where = camera_renders.CameraPose.looking(45, 0.5, 0.3, 0.0, (0, 0))
    sheet = camera_renders.PrintedSheet(stretch=0.01, bend=0.2)
    image = camera_renders.photograph(lens, where, sheet, Development(noise=0))
    seen = find_board(image)
    x, y, _ = seen.points.T
    shown = where.pixels(lens, np.column_stack([x, 1.01 * y, 0.2 * (x / 10) ** 2]))
    flat = where.pixels(lens, np.column_stack([x, 1.01 * y, 0 * x]))
    assert np.linalg.norm(seen.pixels - shown, axis=1).max() < 0.1
    assert np.linalg.norm(seen.pixels - flat, axis=1).max() > 0.5


def test_a_lens_bends_the_picture_as_opencv_says():
    lens = camera_renders.draw_lens(5003)
    where = camera.draw_stand(lens, 30.0, 0.7, np.random.default_rng(0))
    points = np.random.default_rng(1).uniform((-9, -13, 0), (9, 13, 4), (20, 3))
    turned = cv2.Rodrigues(where.rotation)[0]
    seen, _ = cv2.projectPoints(
        points, turned, where.translation, lens.matrix, np.array(lens.distortion)
    )
    assert where.pixels(lens, points) == pytest.approx(seen[:, 0], abs=1e-6)


@pytest.mark.claims
def test_a_calibration_is_judged_against_the_truth():
    result = CameraCase(Condition("tilted", (30.0,)), 777).run()
    assert result.refused == ""
    assert result.markers >= 20
    assert 0 < result.rms < 0.1
    assert result.mm[0][0] < result.mm[0][1] < 0.1
    assert result.mm[1][1] < 1
    assert max(result.in_sigmas) < 2
    assert abs(result.focal) < 4 * result.focal_sigma
    assert any("scale: as printed" in line for line in result.said)


@pytest.mark.long
def test_what_cannot_be_calibrated_is_a_result_too():
    sheet = camera_renders.PrintedSheet(free=(-20, 9.0, -6.5, 20))
    result = CameraCase(Condition("corner", sheet=sheet), 777).run()
    assert "markers are seen" in result.refused or "no marker" in result.refused


def test_the_default_lenses_differ_and_none_folds():
    lenses = [camera_renders.draw_lens(seed) for seed in range(5000, 5005)]
    assert len({round(lens.focal) for lens in lenses}) == 5
    for lens in lenses:
        k1, k2, _, _, k3 = lens.distortion
        r = np.linspace(0, np.hypot(345, 265) / lens.focal, 200)
        bent = r * (1 + k1 * r**2 + k2 * r**4 + k3 * r**6)
        assert (np.diff(bent) > 0).all()


def test_what_is_said_is_told_where_something_is_wrong_and_what_is_not_known_is_null():
    lines = ("scale: as printed.", "3 of 26 markers are covered, blurred")
    figures = (26, 0.02, ((0.01, 0.02), (0.03, 0.04)), (0.01, 0.02), (0.7, 0.8), 1, 0.01, 0.02)
    results = [CameraResult(c.name, 1, "", *figures, lines) for c in CONDITIONS[:-1]]
    results.append(CameraResult(CONDITIONS[-1].name, 1, "looks too flatly", 3))
    first, *_, last = camera_table.table(results)
    assert first[4] == "0.010 / 0.020"
    assert first[6:8] == ["0.020 / 0.040", "0.70 / 0.80"]  # two sigmas, beside the p95
    assert last[1:4] == ["3", "1 of 1", "-"]
    said = camera_table.said(results)
    assert said[-1] == f"{CONDITIONS[-1].name}: looks too flatly"
    assert sum("scale: as printed." in line for line in said) == 2  # where the print is wrong
    seen = camera_table.Seen(results, [], [("nothing", False, "as it was")])
    told = camera_table.BENCH.figures(seen)
    assert told["board"][-1]["rms"] is None
    assert told["moved"] == [{"by": "nothing", "noticed": False, "said": "as it was"}]


@pytest.mark.claims
def test_touching_six_crosses_places_the_pen_to_half_a_millimetre():
    results = {r.touches: r for r in camera_touch.measure(range(777, 778))}
    assert results["9"].p95 < results["6"].p95 * 1.2
    assert results["6"].p95 < 0.7
    assert results["none: the paper alone"].median > 5


@pytest.mark.long
def test_a_camera_that_was_moved_by_a_millimetre_is_noticed():
    assert [noticed for _, noticed, _ in camera.moves(777)] == [False, False, True, True]
