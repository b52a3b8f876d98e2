"""The bench of the tracker: what it counts, its limit and its clips, against figures by hand."""

import json
import math
from dataclasses import replace

import cv2
import numpy as np
import pytest
from click.testing import CliRunner
from marker_views import marker_frame

from laptop.bench import track, track_cost, track_light, track_methods, track_precision, track_table
from laptop.bench.track_cost import Cost
from laptop.bench.track_light import LightCase
from laptop.bench.track_precision import APPEARANCES, PrecisionCase
from laptop.bench.track_rims import RimCase
from laptop.bench.track_score import Score, TrackResult, judge
from laptop.cli.main import laptop
from laptop.see.markers.markers import BadMarker, Color, Marker
from laptop.see.markers.tracker import Sighting

SEED = 77
DISC = APPEARANCES[1]
RED = Color(356, 0.9, 0.78, 30)


def at(u, v, confidence=1.0):
    return Sighting(u, v, confidence, 10.0)


# ---- what counts


@pytest.mark.parametrize(
    ("found", "shown", "score"),
    [
        (at(103, 96), 1.0, Score(1, 1, measured=1, squares=25, du=3, dv=-4)),
        (at(103, 96), 0.9, Score(1, 1, measured=1, squares=25, du=3, dv=-4)),
        (at(103, 96, 0.5), 1.0, Score(1, 1, measured=1, squares=25, du=3, dv=-4)),
        (at(103, 96, 0.49), 1.0, Score(1, 1, lost=1)),
        (None, 1.0, Score(1, 1, lost=1)),
        (None, 0.89, Score(1)),
        (None, 0.0, Score(1)),
        (at(103, 96), 0.5, Score(1)),
        (at(103, 96), 0.0, Score(1, false=1)),
        (at(103, 96, 0.4), 0.0, Score(1)),
        (at(100, 120.1), 1.0, Score(1, 1, false=1)),
        (at(100, 119.9), 1.0, Score(1, 1, measured=1, squares=19.9**2, dv=19.9)),
        (at(100, 120.1), 0.5, Score(1, false=1)),
    ],
)
def test_a_frame_is_judged(found, shown, score):
    judged = judge(found, (100, 100), shown, 10.0)
    assert vars(judged) == pytest.approx(vars(score))


def test_scores_of_frames_add_up():
    frames = [(at(1, 0), 1.0), (at(3, 2), 1.0), (None, 1.0), (at(0, 0), 0.0), (None, 0.5)]
    score = sum((judge(found, (0, 0), shown, 10.0) for found, shown in frames), Score())
    assert (score.frames, score.clear, score.lost, score.false) == (5, 3, 1, 1)
    assert score.rms == pytest.approx(math.sqrt((1 + 9 + 4) / 4))
    assert score.bias == (2, 1)
    assert score.lost_percent == pytest.approx(100 / 3)
    assert score.false_percent == pytest.approx(20)


def test_nothing_measured_is_no_figure():
    for value in (Score().rms, *Score().bias, Score().lost_percent, Score().false_percent):
        assert math.isnan(value)


# ---- the limit


def test_the_limit_of_two_ramps_is_that_of_lines_through_points():
    """One channel says u, 3 DN/px, the other v, 5 DN/px, in 20 x 30 pixels each."""
    y, x = np.mgrid[0:20, 0:30].astype(float)
    bound = track_precision.bound(
        lambda u, v: np.dstack([3 * (x - u), 5 * (y - v)]), 10.2, 7.7, 2.0
    )
    noise = 4 + 1 / 12
    assert bound == pytest.approx((noise / (600 * 9), noise / (600 * 25)))


def test_no_least_squares_beats_the_limit_and_one_reaches_it():
    """Many noisy pictures, 8 bits each, of a smooth spot; rounding is a third of the noise here."""
    y, x = np.mgrid[0:24, 0:24].astype(float)

    def render(u, v):
        return 40 + 150 * np.exp(-((x - u) ** 2 + (y - v) ** 2) / 18)

    u, v, noise = 11.3, 12.6, 0.4
    clean, step = render(u, v), 1e-3
    slopes = np.stack(
        [
            (render(u + step, v) - clean).ravel() / step,
            (render(u, v + step) - clean).ravel() / step,
        ],
        axis=1,
    )
    luck = np.random.default_rng(1)
    seen = np.round(clean + noise * luck.standard_normal((1500, *clean.shape)))
    off = np.linalg.lstsq(slopes, (seen - clean).reshape(1500, -1).T, rcond=None)[0]
    rms = math.sqrt((off**2).mean())
    assert rms == pytest.approx(
        math.sqrt(sum(track_precision.bound(render, u, v, noise)) / 2), rel=0.07
    )


@pytest.mark.parametrize(
    "look",
    [
        APPEARANCES[0],
        APPEARANCES[6],
        APPEARANCES[7],
        APPEARANCES[8],
        APPEARANCES[10],
        APPEARANCES[11],
    ],
)
def test_the_limit_is_that_of_the_pictures_that_are_tracked(look):
    behind = track_precision.ground(look, SEED)
    image = marker_frame(
        look.kind, 150.3, 99.8, look.radius, background=behind, size=track_precision.SIZE,
        motion=look.motion, noise=0,
    )  # fmt: skip
    assert np.abs(track_precision.values(look, 150.3, 99.8, behind) - image).max() <= 0.5001


# ---- precision


def test_places_are_anywhere_within_a_pixel_and_well_inside():
    places = np.array(track_precision.places(SEED, 600))
    assert (places > 60).all()
    assert (places < np.array(track_precision.SIZE) - 60).all()
    for share in (places % 1).T:
        assert np.histogram(share, 4, (0, 1))[0] == pytest.approx([150] * 4, abs=50)


def test_known_errors_come_out_as_they_went_in(monkeypatch):
    truths = track_precision.places(SEED, 9)

    def astray(image, t):
        k = round(t * track_precision.FPS)
        u, v = truths[k]
        assert image[round(v), round(u), 2] > 150, "the marker is where truth says"
        if not k:
            return at(0, 0)  # where it is learned does not count
        return None if k == 5 else at(u + 0.3, v + 0.4 * (-1) ** k)

    monkeypatch.setattr(track_precision, "methods", lambda marker, radius: {"astray": astray})
    wrong, _, limit = PrecisionCase(DISC, SEED, 8).run()
    assert (wrong.score.clear, wrong.score.lost, wrong.score.measured) == (8, 1, 7)
    assert wrong.score.rms == pytest.approx(math.sqrt((0.09 + 0.16) / 2))
    assert wrong.score.bias == pytest.approx((0.3, 0.4 / 7))
    best = track_precision.bound(
        lambda u, v: track_precision.values(DISC, u, v, DISC.background), *truths[1], 3.0
    )
    assert (limit.method, limit.score.rms) == ("limit", pytest.approx(math.sqrt(sum(best) / 2)))


def test_a_flat_disc_through_jpeg():
    results = {r.method: r.score for r in PrecisionCase(DISC, SEED, 20).run()}
    others = {"HSV moments", "SimpleBlob", "vpDot2", "PyImageSearch", "HoughCircles"}
    assert set(results) == {"ours", "limit"} | others
    assert results["limit"].rms < results["ours"].rms <= 0.03 < results["HSV moments"].rms
    assert results["HSV moments"].rms < results["HoughCircles"].rms < 0.6
    assert results["ours"].measured == 20


def test_what_cannot_be_learned_is_said():
    """It counts as lost, beside what another seed brings."""
    (result,) = PrecisionCase(replace(DISC, radius=0.4), SEED, 3).run()
    assert "pick the" in result.error
    assert track_table.errors([result]) == [f"{DISC.name}: {result.error}"]
    luckier = replace(result, score=Score(3, 3, measured=3), error="")
    for order in ([result, luckier], [luckier, result]):
        (both,) = track_table.gathered(order)
        assert (both.score.lost_percent, both.error) == (50, result.error)


@pytest.mark.parametrize(
    ("recipe", "what", "worst"),
    [
        (track_methods.hsv_moments, RED, 0.1),
        (track_methods.hsv_contours, RED, 0.15),
        (track_methods.blur_and_enclose, RED, 0.2),
        (track_methods.hough, 12.0, 0.8),
    ],
)
def test_the_usual_recipes_work(recipe, what, worst):
    image = marker_frame("disc", 150.3, 99.8, 12, size=track_precision.SIZE)
    found = recipe(image, what)
    assert (found.u, found.v) == pytest.approx((150.3, 99.8), abs=worst)
    assert found.radius == pytest.approx(12, abs=1)
    assert recipe(np.full_like(image, 128), what) is None


# ---- light and scenes


@pytest.mark.parametrize(
    ("light", "begin", "end"),
    [
        ("none", (1, 1, 1), (1, 1, 1)),
        ("exposure 1 to 0.3", (1, 1, 1), (0.3, 0.3, 0.3)),
        ("exposure 1 to 1.8", (1, 1, 1), (1.8, 1.8, 1.8)),
        ("white balance 40 % warm", (1, 1, 1), (0.6, 1, 1.4)),
        ("white balance 40 % cool", (1, 1, 1), (1.4, 1, 0.6)),
        ("step to 0.4", (1, 1, 1), (0.4, 0.4, 0.4)),
    ],
)
def test_lights(light, begin, end):
    assert track_light.LIGHTS[light](0, 0.0) == pytest.approx(begin)
    assert track_light.LIGHTS[light](1, 5.0) == pytest.approx(end)


def test_flicker_is_as_deep_as_it_says():
    gains = [track_light.LIGHTS["flicker +-35 %"](0, k / 7919)[0] for k in range(1000)]
    assert (min(gains), max(gains)) == pytest.approx((0.65, 1.35), abs=1e-3)


def test_the_sensor_applies_gains_then_noise(monkeypatch):
    monkeypatch.setattr(track_light, "through_jpeg", lambda image, quality: image)
    image = np.full((120, 160, 3), (40, 80, 120), np.uint8)
    seen = track_light.ClipSensor(SEED, (160, 120)).read_out(image, (2.0, 1.0, 0.5)).reshape(-1, 3)
    assert seen.mean(axis=0) == pytest.approx([80, 80, 60], abs=0.1)
    assert seen.std(axis=0) == pytest.approx([math.sqrt(4 + 1 / 12)] * 3, rel=0.03)


@pytest.mark.claims
def test_a_dimming_light_is_counted():
    case = LightCase("", (("dusk", "exposure 1 to 0.3"),), SEED, 8)
    results = {(r.marker, r.method): r.score for r in case.run()}
    assert {name for name, _ in results} == {"effector", "goal"}
    assert all(score.frames == 7 for score in results.values())
    assert results["effector", "HSV contour"].lost >= 1
    assert results["effector", "ours"].lost_percent == 0
    assert results["effector", "outline"].rms < 0.3


def test_the_fixed_gate_claims_nothing_less_than_half_as_wide():
    find = track_light._fixed(Marker("marker", "disc", RED))
    wide, half, narrow = (marker_frame("disc", 60.0, 60.0, r) for r in (12.0, 7.0, 5.0))
    assert [find(image, 0.0) is not None for image in (wide, half, narrow)] == [True, True, False]


def test_a_clip_whose_markers_cannot_be_learned_is_lost(monkeypatch):
    def refuse(*args):
        raise BadMarker("no colour here")

    monkeypatch.setattr(track_light, "learn", refuse)
    results = LightCase("", (("night", "none"),), SEED, 3).run()
    assert len(results) == 4
    assert {(r.score.lost, r.score.clear, r.error) for r in results} == {(2, 2, "no colour here")}
    assert track_table.errors(results) == ["night: no colour here"] * 2


@pytest.mark.short("5")
@pytest.mark.parametrize("seed", [SEED, 5, 11])  # under the latter two's first swings lies the goal
def test_a_hand_hides_what_could_be_seen_at_first(seed):
    camera, angles = track_light.filmed("occlusion=2.5", seed)
    assert min(camera.scene.visible(angles(0.0), 0.0).values()) > 0.99
    assert camera.scene.visible(angles(1.5), 1.5)["goal"] == 0


def test_the_outline_of_a_tilted_disc_has_the_centre_of_its_ellipse():
    camera, angles = track_light.filmed("tilt=60,k1=0,distance=40", SEED)
    scene, q = camera.scene, angles(0.0)
    centre = scene.centres(q)["goal"]
    angle = np.linspace(0, 2 * math.pi, 100, endpoint=False)
    rim = 1.1 * np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    (u, v), axes, _ = cv2.fitEllipse(scene.project(centre + rim).astype(np.float32))
    outline, radius = track_light.outline_of(scene, q, "goal")
    assert (outline.u, outline.v) == pytest.approx((u, v), abs=0.01)
    assert radius == pytest.approx(max(axes) / 2, rel=0.1)
    assert math.dist((u, v), scene.truth(q)["goal"]) > 0.2


# ---- cost


def test_costs_are_medians_of_every_second_lap(monkeypatch):
    """By a clock that work itself advances."""
    now = [0]

    def working(*microseconds):
        left = list(microseconds)

        def work(image, t):
            now[0] += 1000 * left.pop(0)
            return True if left else None

        return work

    timed = {
        "quick": ([None, None], working(900, 900, 5, 7, 900, 900, 5, 30)),
        "slow": ([None, None], working(900, 900, 60, 70, 900, 900, 70, 80)),
    }
    monkeypatch.setattr(track_cost, "contenders", lambda: timed)
    quick, slow = track_cost.costs(range(2), lambda: now[0])
    assert (quick.method, quick.median, quick.seen) == ("quick", 6, 0.75)
    assert (slow.method, slow.median, slow.seen) == ("slow", 70, 0.75)
    assert quick.p95 == pytest.approx(7 + 0.85 * 23)


@pytest.mark.claims
def test_what_is_timed_is_found_or_absent_as_it_should_be():
    threads = cv2.getNumThreads()
    try:
        cv2.setNumThreads(2)
        seen = {cost.method: cost.seen for cost in track_cost.costs(range(1))}
        assert cv2.getNumThreads() == 2
    finally:
        cv2.setNumThreads(threads)
    assert seen.pop(track_cost.ABSENT) == 0
    assert seen.pop("ours, one ArUco marker") > 0  # a hard one
    assert set(seen.values()) == {1.0}


# ---- the whole


def test_the_usual_recipe_is_the_quicker_of_its_two():
    timed = [
        Cost("ours", 40, 50, 1),
        *(Cost(name, us, us, 1) for name, us in zip(track_cost.FULL_FRAME_RECIPES, (800, 600))),
    ]
    assert track_cost.full_frame_cost(timed) == 600
    assert [row[3] for row in track_table.cost_table(timed)] == ["1/15.0", "1.3", "1.0"]


def test_a_spot_is_found_among_others_by_its_size():
    image = np.full((120, 160, 3), 200, np.uint8)
    for u, v, radius in ((40, 60, 4), (80, 61, 12), (125, 60, 20)):
        cv2.circle(image, (u, v), radius, (30, 30, 30), -1)
    found = track_methods.spots(12)(image, 0.0)
    assert (found.u, found.v) == pytest.approx((80, 61), abs=0.1)
    assert track_methods.spots(12)(np.full_like(image, 200), 0.0) is None


def test_tables_by_hand():
    def result(part, method, score):
        return TrackResult(part, "dusk", "goal", method, score)

    one, two = Score(2, 2, measured=2, squares=0.04), Score(2, 2, lost=1, measured=1, squares=0.08)
    never = Score(3, 3, lost=3)
    results = track_table.gathered(
        [
            *(result("precision", "ours", score) for score in (one, two)),
            result("precision", "limit", Score(measured=1, squares=0.0002)),
            result("precision", "HSV moments", never),
            result("light", "ours", Score(4, 2, lost=1, false=1, measured=1, squares=0.5)),
        ]
    )
    (row,) = track_table.precision_table(results)
    assert row[:4] == ("dusk", "0.0100", "0.141 (25 % missed)", "14.1")
    assert row[6:] == ("never found", "-", "-", "-")
    sums = ("ours", one), ("ours", Score(2, 2, lost=1, measured=1, squares=0.0002))
    discs = [
        TrackResult("rims", "disc r 8", f"red on {k}", *method) for k, method in enumerate(sums)
    ]
    (row,) = track_table.rim_table(discs)
    assert row == ("disc r 8", "2", "1", "0", "0.055", "0.100")
    (row,) = track_table.light_table(results)
    assert row == ("dusk", "goal", "50.0", "25.0", "0.500", "nan", "nan", "-", "-")


def test_what_was_not_measured_is_null():
    ((never,), costs) = track_table.figures(
        [TrackResult("light", "dusk", "goal", "ours")], []
    ).values()
    assert costs == []
    for key in ("rms", "lost_percent", "false_percent"):
        assert never[key] is None
    assert never["bias"] == [None, None]


def test_every_condition_is_tried_with_every_seed():
    cases = track.cases(range(5, 7))

    def conditions(case):
        if isinstance(case, RimCase):
            return [(case.radius, case.rim)]
        return [case.appearance.name] if isinstance(case, PrecisionCase) else dict(case.lights)

    tried = [(name, case.seed) for case in cases for name in conditions(case)]
    names = (
        [look.name for look in APPEARANCES] + list(track_light.LIGHTS) + list(track_light.SCENES)
    )
    names += [(radius, rim) for radius in (8, 16, 32) for rim in (1.3, 1.5, 1.7, 2.2)]
    assert sorted(tried, key=str) == sorted(
        ((name, seed) for name in names for seed in (5, 6)), key=str
    )


@pytest.fixture
def few(monkeypatch):
    """Hardly any frames, in this process."""
    monkeypatch.setattr(
        track,
        "cases",
        lambda seeds: [
            *(PrecisionCase(look, seeds.start, 2) for look in (DISC, APPEARANCES[-1])),
            LightCase("", (("none", "none"),), seeds.start, 3),
            RimCase(8, 1.7, seeds.start),
        ],
    )
    here = replace(track.BENCH, in_turn=lambda todo: (case.run() for case in todo))
    monkeypatch.setattr(track, "BENCH", here)
    monkeypatch.setattr(track_cost, "TURNS", 1)
    monkeypatch.setattr(track_cost, "serving", lambda: 0.0123)


@pytest.mark.claims
def test_bench_track_as_json(few):
    result = CliRunner().invoke(laptop, ["bench", "track", "--seeds", "77:78", "--json"])
    assert result.exit_code == 0, result.output
    figures = json.loads(result.stdout)
    own = [r for r in figures["results"] if r["method"] == "ours"]
    ours = [r for r in own if r["part"] != "rims"]
    assert len(own) - len(ours) == 49
    assert [r["condition"] for r in ours] == [DISC.name, APPEARANCES[-1].name, "none", "none"]
    assert 0 < ours[0]["rms"] < 0.1
    assert len(figures["costs"]) == 10
    assert figures["serving"] == 0.0123


def test_serving_costs_something_and_ends_its_client():
    # (How much is the machine's affair.)
    assert -0.05 < track_cost.serving(fps=60, seconds=0.2) < 1
