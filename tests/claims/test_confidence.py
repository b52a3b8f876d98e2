"""The claim of confidence: what is counted as a lie, what hides a marker, and rays."""

import json
import math

import cv2
import numpy as np
import pytest

from laptop.emulator.scene.optics import Box, coverage
from laptop.see.markers.tracker import Sighting
from tests.claims import confidence_table
from tests.claims.confidence import (
    EDGE,
    GONE,
    MOTION,
    STRESSES,
    RenderCase,
    Stress,
    fingers,
    half_plane,
)
from tests.claims.position_claims import Claim, claim
from tests.claims.rays import RayCase

SEED = 77


def at(u, v, confidence=1.0):
    return Sighting(u, v, confidence, 10.0)


def said(confidence, error, radius=20.0, part="renders", clear=False):
    return Claim(part, "hidden", confidence, error, radius, clear)


def test_a_claim_is_judged_by_the_marker_s_size():
    """A tenth of 20 px and 1 px are 3, half of it 10."""
    judged = [(c.is_off, c.is_wrong) for c in (said(1, 2.9), said(1, 3.1), said(1, 10.1))]
    assert judged == [(False, False), (True, False), (True, True)]
    ghost = claim(at(5, 5, 0.6), None, "renders", "gone", False)
    assert (ghost.is_off, ghost.is_wrong, ghost.confidence) == (True, True, 0.6)
    nothing = claim(None, None, "renders", "gone", False)
    assert (nothing.is_off, nothing.is_wrong, nothing.confidence) == (False, False, 0)
    found = claim(at(103, 96, 0.7), (100, 100, 20), "renders", "hidden", True)
    assert (found.error, found.radius, found.clear) == (5, 20, True)


def test_lies_are_counted_by_hand():
    claims = [
        *(said(0.95, error, clear=True) for error in (0.5, 1.0, 3.5)),
        said(0.6, 11),
        said(0.3, math.inf),
        said(0.0, 0.0, clear=True),
        said(0.92, 1, part="rays"),
    ]
    rows = {row[:2]: row[2:] for row in confidence_table.table(claims)}
    assert rows["renders", "all"] == (
        "6", "4", "3", "33.3 % (1)", "25.0 % (1)", "75.0 % (3)", "1.00", "1.00",
    )  # fmt: skip
    assert rows["rays", "all"][:4] == ("1", "1", "1", "0.0 % (0)")
    lies = {row[:2]: row[2:] for row in confidence_table.lies(claims)}
    assert lies["renders", "0.9 to 1.0"] == ("3", "33.3 % (1)", "0.0 % (0)")
    assert lies["renders", "0.5 to 0.7"] == ("1", "100.0 % (1)", "100.0 % (1)")
    assert lies["renders", "0.2 to 0.5"] == ("1", "100.0 % (1)", "100.0 % (1)")
    assert json.loads(json.dumps(confidence_table.figures(claims)))[4]["error"] is None


def test_what_comes_from_a_side_hides_its_share():
    share = coverage([half_plane(0.3, (50.0, 40.0, 20.0), 0.0)], Box(0, 0, 100, 80))
    assert share[40, 57] == pytest.approx(0, abs=1e-6)
    assert share[40, 59] == pytest.approx(1, abs=1e-6)
    tips = fingers(0.5, (50.0, 40.0, 20.0), 0.0)
    assert tips[0][:, 0].min() == pytest.approx(60, abs=0.1)


@pytest.mark.claims
@pytest.mark.parametrize("kind", ["disc", "ball"])
def test_every_harm_begins_with_a_whole_marker_and_hides_it_more_and_more(kind):
    for stress in (s for s in STRESSES if s.kind == kind and s.harm in (EDGE, GONE)):
        pictures = list(RenderCase(stress, SEED).pictures())
        assert [clear for _, _, clear in pictures][:4] == [True] * 4
        assert not any(clear for _, _, clear in pictures[4:])
        assert all(circle is None for _, circle, _ in pictures[4:]) == (stress.harm == GONE)


@pytest.mark.short(every=3)
@pytest.mark.parametrize(
    ("kind", "harm", "seed"), [("ball", MOTION, 103), ("ball", MOTION, 107), ("disc", GONE, 100)]
)
def test_what_mask_and_limb_or_size_disagree_on_is_doubted(kind, harm, seed):
    claims = RenderCase(Stress(kind, harm), seed).run()
    assert not [c for c in claims if c.is_off and c.confidence >= 0.9]
    assert not [c for c in claims if c.is_wrong and c.confidence >= 0.5]


@pytest.mark.long
def test_another_renderer_s_ball_is_where_it_says():
    """Its colour, told by a threshold, is about a full circle around its centre."""
    (image, (u, v, radius), way), *_ = RayCase(1).pictures()
    assert (image.shape, image.dtype, way) == ((240, 320, 3), np.uint8, 0)
    vivid = cv2.inRange(cv2.cvtColor(image, cv2.COLOR_BGR2HSV)[..., 1], 100, 255)
    m = cv2.moments(vivid, binaryImage=True)
    assert m["m00"] == pytest.approx(math.pi * radius**2, rel=0.1)
    assert (m["m10"] / m["m00"], m["m01"] / m["m00"]) == pytest.approx((u, v), abs=0.02 * radius)


@pytest.mark.claims
def test_smears_of_another_renderer_are_placed_or_doubted():
    claims = [one for seed in range(5000, 5020) for one in RayCase(seed).run()]
    sure = [one for one in claims if one.confidence >= 0.9 and not one.clear]
    assert len(sure) > 40
    assert sum(one.is_off for one in sure) <= 0.02 * len(sure)
    still = [one for one in claims if one.clear]
    assert min(one.confidence for one in still) >= 0.9
    assert max(one.error / one.radius for one in still) < 0.03
