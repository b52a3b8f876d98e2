import math

import numpy as np
import pytest
from board_views import pixels, stand, turned, view

from laptop.see.markers.board import CROSSES
from laptop.see.table.camera_fit import calibrate
from laptop.see.table.marker_offset import BadTouches, Touch, fit_marker

CAMERA = stand(58, 25, 200, 3)
OFFSET, HEIGHT, TURN, BASE = np.array([0.45, -0.3]), 2.2, 0.1, np.array([-12.3, 0.8])
LINKS = 11.3, 9.5
SIX = (0, 2, 3, 5, 6, 8)


@pytest.fixture(scope="module")
def camera():
    return calibrate([view(CAMERA, np.random.default_rng(0), 0.02)]).camera


def posed(pen):
    """Tip and heading of a two-link arm with the pen there, and the marker's pixel: cosine rule."""
    x, y = turned(-TURN, pen - BASE)
    a, b = LINKS
    elbow = math.acos((x * x + y * y - a * a - b * b) / (2 * a * b))
    shoulder = math.atan2(y, x) - math.atan2(b * math.sin(elbow), a + b * math.cos(elbow))
    heading = shoulder + elbow
    marker = pen + turned(TURN + heading, OFFSET)
    return (x, y), heading, pixels(CAMERA, [[*marker, HEIGHT]])[0]


def touched(chosen, rng=None, placing=0.03, joints=0.02, scale=1.0, slip=None):
    """The touches of some crosses; of a print that is `scale` times as large as it says."""
    touches = []
    for k in chosen:
        at = scale * CROSSES[k] + (0 if rng is None else placing * rng.standard_normal(2))
        if k == slip:
            at = at + (0.0, -0.8)
        tip, heading, pixel = posed(at)
        if rng is not None:
            tip = tip + joints * rng.standard_normal(2)
        touches.append(Touch(tuple(CROSSES[k]), tuple(tip), heading, tuple(pixel)))
    return touches


def test_without_errors_all_is_found(camera):
    fit = fit_marker(camera, touched(range(9)))
    assert fit.offset == pytest.approx(OFFSET, abs=0.01)
    assert fit.height == pytest.approx(HEIGHT, abs=0.03)
    assert fit.turn == pytest.approx(TURN, abs=1e-3)
    assert fit.base == pytest.approx(BASE, abs=0.02)
    assert fit.scale == pytest.approx(1, abs=1e-3)
    assert fit.rms_mm < 0.1
    assert fit.on_board(np.array([posed(CROSSES[4])[0]]))[0] == pytest.approx((0, 0), abs=0.02)


def test_six_crosses_touched_to_03_mm_place_the_pen_to_half_a_millimetre(camera):
    off, claims = [], []
    for seed in range(15):
        rng = np.random.default_rng(seed)
        fit = fit_marker(camera, touched(SIX, rng))
        pens = rng.uniform((-5, -7), (5, 7), (20, 2))
        poses = [posed(pen) for pen in pens]
        seen, headings = np.array([p[2] for p in poses]), np.array([p[1] for p in poses])
        off += list(10 * np.linalg.norm(fit.pen(camera, seen, headings) - pens, axis=1))
        claims.append((fit.offset - OFFSET) @ np.linalg.inv(fit.covariance[4:6, 4:6]) @
                      (fit.offset - OFFSET) / 2)  # fmt: skip
        bare = 10 * np.linalg.norm(camera.to_table(seen) - pens, axis=1)
        assert np.median(bare) > 7  # of the marker itself, as if it lay on the paper
    assert np.quantile(off, 0.95) < 0.5
    assert 0.2 < np.mean(claims) < 2  # what it says of itself is true


def test_the_joints_measure_is_turned_into_the_boards():
    """Of a print that is too small, and not told to be, the board's centimetres are small."""
    untold = calibrate([view(CAMERA, np.random.default_rng(3), 0.02, scale=0.97)]).camera
    touches = touched(range(9), np.random.default_rng(3), 0.001, 0.001, scale=0.97)
    fit = fit_marker(untold, touches)
    assert fit.scale == pytest.approx(1 / 0.97, abs=0.004)
    tips = np.array([touch.tip for touch in touches])
    assert fit.on_board(tips) == pytest.approx(CROSSES, abs=0.05)


def test_a_height_that_was_measured_is_kept(camera):
    rng = np.random.default_rng(1)
    fit = fit_marker(camera, touched(SIX, rng), height=HEIGHT)
    assert fit.height == pytest.approx(HEIGHT, abs=0.05)
    assert fit.height_sigma <= 0.05


def test_more_crosses_are_surer(camera):
    six, nine = (fit_marker(camera, touched(k, np.random.default_rng(2))) for k in (SIX, range(9)))
    assert nine.offset_sigma < six.offset_sigma < 0.03


def test_it_tells_what_to_write_into_the_arms_file(camera):
    first, second, *rest = fit_marker(camera, touched(range(9))).notes()
    assert "marker_offset = 0.4" in first
    assert "4.5 mm along the last link from the pen and -3.0 mm to its left" in first
    assert second.startswith("it rides 2")
    assert rest == []


def test_the_arm_tells_of_a_print_that_is_too_small():
    """Of the camera alone nobody could: that the board is small looks like a camera far away."""
    rng = np.random.default_rng(3)
    untold = calibrate([view(CAMERA, rng, 0.02, scale=0.97)]).camera
    fit = fit_marker(untold, touched(range(9), rng, scale=0.97))
    (note,) = [line for line in fit.notes() if "the arm's measure" in line]
    assert "crosses are 3." in note or "crosses are 2.9" in note
    assert "nearer together than the board says: a bar of 97." in note or "a bar of 96.9" in note


@pytest.mark.parametrize("slip", [0, 4])
def test_a_touch_beside_its_cross_is_named(camera, slip):
    x, y = CROSSES[slip]
    with pytest.raises(BadTouches, match=f"the touch of the cross at {x:g}, {y:g} cm does not fit"):
        fit_marker(camera, touched(range(9), np.random.default_rng(4), slip=slip))


def test_touches_that_fit_nothing_are_refused_without_a_culprit(camera):
    touches = touched(range(9), np.random.default_rng(5), placing=0.8)
    with pytest.raises(BadTouches, match="do not fit one another, .* times worse"):
        fit_marker(camera, touches)


def test_a_link_that_always_points_the_same_way_makes_it_unsure(camera):
    same = [touch._replace(heading=0.3) for touch in touched(range(9))]
    for k, touch in enumerate(same):
        marker = np.array(touch.cross) + turned(TURN + 0.3, OFFSET)
        same[k] = touch._replace(pixel=tuple(pixels(CAMERA, [[*marker, HEIGHT]])[0]))
    spread = fit_marker(camera, touched(range(9)))
    fit = fit_marker(camera, same)
    assert fit.offset_sigma > spread.offset_sigma


@pytest.mark.parametrize(
    ("change", "reported"),
    [
        (lambda t: t[:5], "5 crosses were touched; 6 are the least, 9 are better"),
        (lambda t: [], "0 crosses were touched"),
        (lambda t: [t[0]] * 9, "touch 6 different crosses, not the same ones again"),
        (lambda t: [t[0]._replace(heading=math.nan), *t[1:]], "holds what is no number"),
        (lambda t: [t[0]._replace(pixel=(1e5, -1e5)), *t[1:]], "seen where no table is"),
    ],
)
def test_what_tells_too_little_is_refused(camera, change, reported):
    with pytest.raises(BadTouches, match=reported):
        fit_marker(camera, change(touched(range(9))))
