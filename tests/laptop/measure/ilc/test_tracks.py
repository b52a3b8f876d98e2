"""What a camera saw is shared out among the pieces of strokes, by the brick's log."""

import numpy as np
import pytest
from arms import PLANAR as ARM

from laptop.measure.ilc.piece_path import paths_of
from laptop.measure.ilc.tracks import aligned, tracks
from laptop.measure.ilc.view import TipView
from laptop.measure.run_data import BadMeasurement, RunData, Sights
from robot.motion import paths, trajectory
from shared.job_log import LogRow

START = 3.0  # of the stroke in its job, s
LATE = 100.0  # the clock of the log, s


class Plain:
    """A camera whose pixels are cm."""

    def to_table(self, pixels, height=0.0):
        return pixels


@pytest.fixture(scope="module")
def pieces():
    corner = paths.pieces_of([(10.0, 0.0), (7.0, 6.0), (12.0, 8.0)])
    return paths_of(ARM, trajectory.plan(ARM, corner))


def run_of(pieces, unseen=()):
    """A run in which the tip does as it is to, stands before, and settles after each piece."""
    t, plan, places = [], [], []
    begun, now = 0.0, LATE
    for piece in pieces:
        for tau in np.arange(0.0 if t else -0.4, piece.duration + 0.2, 0.05):
            t.append(now + tau)
            plan.append(START + begun + max(tau, 0.0))  # its time goes on while it settles
            own = min(max(tau, 0.0), piece.duration)
            places.append([np.interp(own, piece.t, column) for column in piece.p.T])
        begun += piece.duration
        now = t[-1] + 0.05
    rows = [LogRow(1, p, when, False, (0.2, 0.5)) for p, when in zip(plan, t, strict=True)]
    pixels = np.array(places)
    pixels[list(unseen)] = np.nan
    return RunData(rows, 0.0, {"A": Sights(np.array(t), pixels)})


def test_every_piece_gets_its_own_sights(pieces):
    assert len(pieces) == 2
    (found,) = tracks(run_of(pieces), TipView(Plain()), [pieces], [START])
    for piece, track in zip(pieces, found, strict=True):
        assert len(track.s) > 15
        assert track.s.min() == 0
        assert track.s.max() == pytest.approx(piece.length)
        off = np.linalg.norm(track.p - piece.at(track.s, piece.p), axis=1)
        assert off.max() < 0.02


def test_what_was_not_seen_is_left_out(pieces):
    (every,) = tracks(run_of(pieces), TipView(Plain()), [pieces], [START])
    (fewer,) = tracks(run_of(pieces, range(5, 15)), TipView(Plain()), [pieces], [START])
    assert len(every[0].s) - len(fewer[0].s) == 10
    assert len(every[1].s) == len(fewer[1].s)


def test_a_stroke_that_was_not_logged_is_told(pieces):
    run = run_of(pieces)
    with pytest.raises(BadMeasurement, match="logged nothing of stroke 2.*brick install"):
        tracks(run, TipView(Plain()), [pieces, pieces], [START, 20.0])


def test_of_too_few_sights_nobody_tells_how_the_arm_stands(pieces):
    run = run_of(pieces)
    view = TipView(Plain(), to_align=True)
    assert aligned(run, view, [pieces], [START]).base == pytest.approx((0.0, 0.0), abs=0.08)
    run.sights["A"].pixels[4:] = np.nan
    with pytest.raises(BadMeasurement, match="the camera saw the marker 4 times: light the table"):
        aligned(run, view, [pieces], [START])
