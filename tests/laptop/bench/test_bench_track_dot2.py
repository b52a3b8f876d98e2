"""ViSP's vpDot2 beside our tracker: where it can be compiled, and where it cannot."""

import math
import shutil
from dataclasses import replace

import cv2
import numpy as np
import pytest
from click.testing import CliRunner

from laptop.bench import track, track_cost, track_dot2, track_table
from laptop.bench.track_dot2 import NoDot2
from laptop.bench.track_precision import APPEARANCES, PrecisionCase
from laptop.bench.track_score import Score, TrackResult
from laptop.cli.main import laptop

SEED = 77
HINT = "on Debian: apt install g++ libvisp-blob-dev"


@pytest.fixture
def visp():
    try:
        track_dot2.program()
    except NoDot2 as problem:
        pytest.skip(str(problem))


@pytest.fixture
def unknown():
    """Nothing is compiled yet, nor afterwards."""
    track_dot2.program.cache_clear()
    yield
    track_dot2.program.cache_clear()


def spots(*centres):
    """Soft white spots (90 x 120) of 10 px."""
    y, x = np.mgrid[0:90, 0:120]
    share = sum(np.clip(10.5 - np.hypot(x - u, y - v), 0, 1) for u, v in centres)
    return np.round(255 * (share + np.zeros(x.shape))).astype(np.uint8)


def test_it_goes_by_itself_until_it_loses_its_spot_and_then_takes_up_the_one_it_is_told(visp):
    one, other = (40.3, 40.2), (80.6, 50.4)
    moved = (41.7, 41.1)
    shares = [spots(one), spots(moved, other), spots(), spots(moved, other)]
    found = track_dot2.follow(shares, [one, other, one, other])
    assert found[2] is None
    for place, centre in zip([found[0], found[1], found[3]], [one, moved, other]):
        assert math.dist(place, centre) < 0.15


def test_it_is_beside_the_others_in_as_many_frames(visp):
    results = {r.method: r for r in PrecisionCase(APPEARANCES[1], SEED, 8).run()}
    dot2 = results["vpDot2"]
    assert (dot2.score.frames, dot2.score.measured, dot2.error) == (8, 8, "")
    assert results["ours"].score.rms < dot2.score.rms < 0.1
    headings = track_table.precision_headings(results.values())
    (row,) = track_table.precision_table(list(results.values()))
    assert row[headings.index("vpDot2")] == f"{dot2.score.rms:.3f}"
    assert row[headings.index("HoughCircles")] == f"{results['HoughCircles'].score.rms:.3f}"
    assert len(row) == len(headings)


@pytest.mark.parametrize(
    "look", ["disc r 12, JPEG 90", "disc r 12, smeared by 30 px", "ball r 12, grey background"]
)
def test_what_it_gets_is_the_share_of_disc(look, monkeypatch):
    case = PrecisionCase(next(one for one in APPEARANCES if one.name == look), SEED, 2)
    given = []

    def follow(shares, places):
        given.extend(zip(shares, places, strict=True))
        return places

    monkeypatch.setattr(track_dot2, "follow", follow)
    (dot2,) = (r for r in case.run() if r.method == "vpDot2")
    assert (dot2.score.measured, dot2.score.rms) == (2, 0)
    for share, (u, v) in given:
        assert (share.dtype, share.shape) == (np.uint8, (240, 320))
        assert share[round(v), round(u)] > 150
        moments = cv2.moments(share[round(v) - 40 : round(v) + 41, round(u) - 40 : round(u) + 41])
        place = [moments[key] / moments["m00"] - 40 for key in ("m10", "m01")]
        assert place == pytest.approx((u - round(u), v - round(v)), abs=0.5)
        assert np.median(share) < 20


def test_a_marker_without_a_colour_has_no_share():
    assert "vpDot2" not in {r.method for r in PrecisionCase(APPEARANCES[-1], SEED, 1).run()}


@pytest.mark.parametrize(
    ("name", "value", "why"),
    [
        ("COMPILER", "no-such-compiler", "no-such-compiler: No such file or directory"),
        ("COMPILER", "false", "false: status 1"),
        ("LIBRARIES", ("-include", "no_such_visp.h"), "error: no_such_visp.h: No such file"),
    ],
)
def test_the_bench_goes_on_without_it_and_says_so_once(name, value, why, monkeypatch, unknown):
    if name == "LIBRARIES" and not shutil.which(track_dot2.COMPILER):
        pytest.skip("there is no g++")
    monkeypatch.setattr(track_dot2, name, value)
    cases = [PrecisionCase(look, SEED, 1) for look in APPEARANCES[:2]]
    monkeypatch.setattr(track, "cases", lambda seeds: cases)
    here = replace(track.BENCH, in_turn=lambda todo: (case.run() for case in todo))
    monkeypatch.setattr(track, "BENCH", here)
    monkeypatch.setattr(track_cost, "costs", lambda turns: [])
    monkeypatch.setattr(track_cost, "serving", lambda: 0.01)
    monkeypatch.setattr(track_table, "cost_table", lambda timed: [])
    result = CliRunner().invoke(laptop, ["bench", "track"])
    assert result.exit_code == 0, result.output
    (line,) = (line for line in result.output.splitlines() if "vpDot2" in line)
    assert line.startswith("vpDot2 is left out, ")
    assert why in line
    assert line.endswith(HINT)
    assert "HoughCircles" in result.output


def test_a_program_that_ends_early_is_no_measurement(monkeypatch):
    monkeypatch.setattr(track_dot2, "program", lambda: b"#!/bin/sh\ncat > /dev/null; echo 1 2\n")
    with pytest.raises(NoDot2, match="told 1 places in 2 pictures"):
        track_dot2.follow([spots((50, 40))] * 2, [(50.0, 40.0)] * 2)
    monkeypatch.setattr(track_dot2, "program", lambda: b"#!/bin/sh\ncat > /dev/null; exit 3\n")
    with pytest.raises(NoDot2, match="vp_dot2: status 3"):
        track_dot2.follow([spots((50, 40))], [(50.0, 40.0)])


def test_a_seed_without_it_does_not_count():
    """On a cluster only some machines may have it."""
    one = TrackResult("precision", "dusk", "goal", "vpDot2", Score(2, 2, measured=2, squares=0.04))
    other = replace(one, score=Score(), error="no g++")
    for order in ([one, other], [other, one]):
        (both,) = track_table.gathered(order)
        assert (both.score, both.error) == (one.score, "no g++")
