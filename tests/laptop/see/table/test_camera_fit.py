from dataclasses import replace

import numpy as np
import pytest
from board_views import LENS, pixels, stand, view

from laptop.see.table.camera_fit import BadCalibration, calibrate

TILTED = stand(52, 25, 200, 3)
STRAIGHT = stand(52, 2, 0, 90)
MANY = [stand(50, 30, 80), stand(48, 35, -40, 10, (0, -2)), stand(55, 20, 170), TILTED]
RNG = np.random.default_rng


def places(height=0.0, count=40, seed=0):
    rng = RNG(seed)
    xy = rng.uniform((-6, -10), (6, 10), (count, 2))
    return np.column_stack([xy, np.full(count, height)])


def errors_mm(camera, where, height=0.0, scale=1.0):
    points = places(height)
    return 10 * np.linalg.norm(
        camera.to_table(pixels(where, points), height) - points[:, :2], axis=1
    )


def test_four_views_without_noise_give_lens_and_place_exactly():
    """But for the priors, which weigh little against 800 numbers."""
    camera = calibrate([view(where) for where in MANY]).camera
    assert camera.lens[0] == pytest.approx(LENS[0], rel=1e-3)
    assert camera.lens[1:3] == pytest.approx(LENS[1:3], abs=0.5)
    assert camera.lens[3] == pytest.approx(LENS[3], abs=0.01)
    turned, shift = TILTED
    assert camera.position == pytest.approx(-turned.T @ shift, abs=0.05)
    assert np.degrees(camera.tilt) == pytest.approx(25, abs=0.1)
    for height in (0.0, 3.0):
        assert errors_mm(camera, TILTED, height).max() < 0.05


@pytest.mark.parametrize("tilt", [0, 10, 30, 60])
def test_one_picture_is_enough_for_the_table(tilt):
    where = stand(55, tilt, 120)
    found = calibrate([view(where, RNG(tilt))])
    assert errors_mm(found.camera, where).max() < 0.3
    assert found.rms == pytest.approx(0.03 * np.sqrt(2), rel=0.25)
    assert 0.01 < found.rms_mm < 0.2


@pytest.mark.long
def test_what_it_says_of_itself_is_true():
    """Over many draws the errors, in units of their own standard deviation, have size one."""
    for height in (0.0, 3.0):
        ratios = []
        for seed in range(12):
            found = calibrate([view(where, RNG([seed, 3]), 0.05) for where in MANY])
            points = places(height, 10, seed)
            placed = found.camera.placed(pixels(TILTED, points), height)
            off = placed.xy - points[:, :2]
            ratios.append(np.einsum("ni,nij,nj->n", off, np.linalg.inv(placed.covariance), off) / 2)
        assert 0.3 < np.mean(ratios) < 1.8


def test_a_view_from_straight_above_knows_that_it_does_not_know_the_focal_length():
    straight, tilted = (calibrate([view(w, RNG(1))]) for w in (STRAIGHT, TILTED))
    assert straight.focal_sigma > 0.3
    assert tilted.focal_sigma < 0.05
    assert straight.point_sigma(0.0) < 0.02
    assert straight.point_sigma(3.0) > 3 * tilted.point_sigma(3.0)
    off = abs(straight.camera.lens[0] / LENS[0] - 1)
    assert off < 3 * straight.focal_sigma
    both = calibrate([view(TILTED, RNG(1)), view(STRAIGHT, RNG(2))])
    assert both.focal_sigma < 0.03
    assert errors_mm(both.camera, STRAIGHT, 3.0).max() < 0.3


@pytest.mark.parametrize("where", [STRAIGHT, TILTED])
def test_copies_of_a_view_make_nothing_surer(where):
    alone = calibrate([view(where, RNG(7), 0.1)])
    many = calibrate([view(where, RNG(seed), 0.1) for seed in range(8)])
    assert (len(many.markers), many.alike, alone.alike) == (1, 7, 0)
    assert (many.camera.lens == alone.camera.lens).all()
    assert many.focal_sigma == alone.focal_sigma


def test_of_copies_the_last_picture_says_where_the_table_is():
    seen = [view(where, RNG(k)) for k, where in enumerate([TILTED, STRAIGHT, MANY[0], STRAIGHT])]
    found = calibrate(seen)
    assert (len(found.markers), found.alike) == (3, 1)
    assert (found.camera.lens == calibrate([seen[0], *seen[2:]]).camera.lens).all()
    turned, shift = STRAIGHT
    assert found.camera.position == pytest.approx(-turned.T @ shift, abs=0.2)


def test_a_view_that_is_moved_by_a_little_is_another_one():
    turned, shift = TILTED
    assert calibrate([view(TILTED), view((turned, shift + (0.3, 0, 0)))]).alike == 0
    left, right = (view(TILTED, keep=keep) for keep in (lambda x, y: x < 0, lambda x, y: x > 0))
    assert calibrate([left, right]).markers == (13, 13)


@pytest.mark.short(every=4)
@pytest.mark.parametrize("focals", [(610, 870), (610, 610, 870), (610, 630, 650), (500, 900, 610)])
def test_a_zoom_that_was_changed_between_pictures_is_found(focals):
    seen = [
        view(where, RNG(k), 0.1, (focal, *LENS[1:]))
        for k, (where, focal) in enumerate(zip(MANY, focals, strict=False))
    ]
    reported = (
        r"a focal length each, from (4|5|6)\d\d to (6|8|9)\d\d px, .* the zoom or the focus was"
    )
    with pytest.raises(BadCalibration, match=reported) as error:
        calibrate(seen)
    assert "\n" not in str(error.value)


@pytest.mark.short(every=3)
@pytest.mark.parametrize("noise", [0.0, 0.03, 0.3])
@pytest.mark.parametrize("sag", [0.0, 0.2])
def test_one_zoom_is_believed_whatever_the_noise_and_the_paper(noise, sag):
    seen = []
    for k, where in enumerate([*MANY, STRAIGHT]):
        flat = view(where)
        bent = flat.points + sag * np.outer((flat.points[:, 0] / 10) ** 2, (0, 0, 1))
        shown = pixels(where, bent) + noise * RNG([k, 5]).standard_normal(flat.pixels.shape)
        seen.append(replace(flat, pixels=shown))
    for views in (seen, seen[:2], seen[3:]):
        assert calibrate(views).camera.lens[0] == pytest.approx(LENS[0], rel=0.1)


@pytest.mark.parametrize(
    "keep",
    [
        lambda x, y: x < 0,
        lambda x, y: y > 0,
        lambda x, y: x < 0 < y,
        lambda x, y: (round(x * 7) + round(y)) % 3 == 0,
    ],
)
def test_a_board_half_covered_is_enough(keep):
    found = calibrate([view(TILTED, RNG(4), keep=keep)])
    assert found.markers[0] <= 14
    off = errors_mm(found.camera, TILTED)
    assert np.median(off) < 0.5


def test_a_print_of_another_size_is_put_right_by_its_bar():
    seen = view(TILTED, RNG(5), scale=0.97)
    reported = calibrate([seen], bar=97)
    assert errors_mm(reported.camera, TILTED).max() < 0.3
    assert reported.scale == 0.97
    # Nothing in the picture says so: all is 100 / 97 too large, and fits as well.
    untold = calibrate([seen])
    points = places()
    placed = untold.camera.to_table(pixels(TILTED, points))
    assert placed * 0.97 == pytest.approx(points[:, :2], abs=0.03)
    assert untold.rms == pytest.approx(reported.rms, rel=0.01)
    assert untold.bar is None


@pytest.mark.parametrize("shift", [(40, -25), (2, 1)])
def test_a_marker_that_is_not_where_it_should_be_is_left_out(shift):
    seen = view(TILTED, RNG(6))
    seen.pixels[8:12] += shift
    found = calibrate([seen])
    assert found.left_out == 1
    assert found.markers == (25,)
    assert found.rms < 0.06
    assert errors_mm(found.camera, TILTED).max() < 0.3


def test_where_many_markers_are_elsewhere_nothing_is_believed():
    seen = view(TILTED, RNG(6))
    seen.pixels[: 4 * 8] += (9, 5)
    with pytest.raises(
        BadCalibration, match="does not fit a flat board: .* markers are far off, .* px RMS"
    ):
        calibrate([seen])


def test_letter_paper_works_as_well():
    found = calibrate([view(TILTED, RNG(7), paper="letter")])
    assert errors_mm(found.camera, TILTED).max() < 0.3
    assert found.board.paper == "letter"


def test_a_wide_lens_and_a_long_one_are_fitted():
    for lens in ((330.0, 318, 242, -0.25, 0.06, 0, 0), (1400.0, 322, 239, 0.12, -0.3, 0, 0)):
        away = 30 * lens[0] / 330
        where = stand(away, 30, 45)
        found = calibrate([view(where, RNG(8), lens=lens), view(where, RNG(9), lens=lens)])
        points = places()
        off = found.camera.to_table(pixels(where, points, lens)) - points[:, :2]
        assert 10 * np.abs(off).max() < 0.3


@pytest.mark.parametrize(
    ("views", "bar", "reported"),
    [
        ([], None, "no marker of the board is seen; show it whole, sharp and lit"),
        (
            [view(TILTED, keep=lambda x, y: x < -8 and y > 9)],
            None,
            "only 2 of the board's 26 markers are seen; 4 are the least: "
            "show more of it, sharp and lit",
        ),
        (
            [view(TILTED, keep=lambda x, y: x < -8 and y > 9, blur=2.44)],
            None,
            "only 2 of the board's 26 markers are seen and blurred, by 2.4 px; 4 are the least",
        ),
        ([view(TILTED, side=11.0)], None, "the board is too small in the picture: .* 11 px wide"),
        ([view(TILTED, keep=lambda x, y: x < -8)], None, "the 9 markers .* lie in one row"),
        ([view(TILTED)], 9.7, "bar 9.7 mm: it is 100 mm long on paper; give .* from 50 to 200"),
        ([view(TILTED)], float("nan"), "bar nan mm: it is 100 mm long on paper"),
        ([view(TILTED), view(TILTED, size=(1280, 720))], None, "pictures of 1280x720, 640x480: "),
        ([view(stand(60, 80))], None, "looks at the board too flatly, 80 degrees .* up to 75"),
    ],
)  # fmt: skip
def test_what_cannot_be_used_is_refused_with_its_cause(views, bar, reported):
    with pytest.raises(BadCalibration, match=reported):
        calibrate(views, bar)


def test_noise_instead_of_a_board_is_refused():
    seen = view(TILTED)
    seen.pixels[:] = RNG(3).uniform(0, 480, seen.pixels.shape)
    with pytest.raises(BadCalibration, match="does not fit a flat board"):
        calibrate([seen])
    seen.pixels[:] = 200.0
    with pytest.raises(BadCalibration, match="all of it in one place|does not fit a flat board"):
        calibrate([seen])


def test_that_few_markers_fit_is_not_called_that_few_are_seen():
    seen = view(TILTED, keep=lambda x, y: x < 0 < y)
    seen.pixels[:] += np.repeat(RNG(4).normal(0, 30, (len(seen.numbers), 2)), 4, axis=0)
    with pytest.raises(BadCalibration, match="does not fit a flat board"):
        calibrate([seen])
