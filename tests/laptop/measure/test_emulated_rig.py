"""An emulated rig: what it tells is what its arm truly did."""

import cmath
import math
import signal
from pathlib import Path
from types import SimpleNamespace

import jobs
import numpy as np
import pytest
from arms import PLANAR as ARM
from arms import SPATIAL

from laptop.emulator.rig import Rig
from laptop.emulator.scene.scene import Scene
from laptop.emulator.scene.scene_constants import read_scene
from laptop.measure.emulated_rig import EmulatedRig, RenderedRig, marker_point
from laptop.measure.run_data import BadMeasurement
from robot.motion import kinematics

WAYS = [[(9.0, 2.0), (12.0, 4.0)], [(12.0, 4.0), (14.0, -2.0)]]


class FromAbove:
    """A camera straight above, 20 px to the cm; what is higher is nearer to it."""

    def project(self, points):
        """Pixels of points."""
        x, y, z = points.T
        return np.stack([320 - 20 * y * (1 + z / 50), 400 - 20 * x * (1 + z / 50)], axis=1)


@pytest.fixture
def job(tmp_path):
    return Path(jobs.write(tmp_path, WAYS, log=0.05, rest=0.8))


def true_angles(rig, t):
    record = rig.last.record
    times = [sample.t for sample in record]
    return [np.interp(t, times, [sample.q[k] for sample in record]) for k in range(2)]


def test_the_log_of_a_slow_brick_is_told_by_the_clock_of_the_truth(job):
    rig = EmulatedRig(ARM, None, "cpu=1", {"A": FromAbove()}, noise_px=0.0)
    for row in (row for row in rig.measure(job).rows if row.rest):
        # It has been standing for its rest, to within what an encoder shows and backlash leaves.
        for ago in (0.0, 0.7):
            assert true_angles(rig, row.t - ago) == pytest.approx(row.q, abs=math.radians(2))


def test_the_camera_sees_the_marker_of_the_arm_as_it_was_built(job):
    built = ARM._replace(
        marker_offset=(0.6, -0.4), joints=(ARM.joints[0]._replace(link=11.8), ARM.joints[1])
    )
    rig = EmulatedRig(ARM, built, "cpu=0", {"A": FromAbove()}, height=2.0, noise_px=0.0)
    run = rig.measure(job)
    rests = run.rests()
    assert rests.stroke.tolist() == [1, 2]
    assert (rests.seen >= 7).all()
    assert (rests.sigma < 0.1).all()
    stood = [row.t for row in run.rows if row.rest]
    for t, pixel in zip(stood, rests.pixel, strict=True):
        a, b = true_angles(rig, t - 0.2)
        marker = cmath.rect(11.8, a) + (9.5 + 0.6 - 0.4j) * cmath.rect(1, a + b)
        seen = 320 - 20.8 * marker.imag, 400 - 20.8 * marker.real
        assert pixel == pytest.approx(seen, abs=0.3)
    plan, t, q = run.motors()
    assert len(plan) > 30
    assert (np.diff(t) > 0).all()
    truth = np.array([true_angles(rig, at) for at in t])
    assert np.abs(q - truth).max() < math.radians(2.5), "two degrees of play, half to each side"
    assert not any(sample.pen for sample in rig.last.record)


@pytest.mark.long
def test_noise_and_the_times_of_pictures_are_drawn_anew_by_seed(job):
    def sights(seed):
        rig = EmulatedRig(ARM, None, "cpu=0", {"A": FromAbove()}, seed=seed)
        return rig.measure(job).sights["A"]

    one, again, other = sights(1), sights(1), sights(2)
    assert (one.pixels == again.pixels).all()
    assert one.t[0] != other.t[0]
    resting = one.pixels[:6]
    assert 0.4 < np.std(resting - resting.mean(axis=0)) < 1.8, "px: one is asked for"


def test_the_log_goes_by_the_clock_of_the_pictures_also_where_the_program_takes_long_to_start(job):
    rig = EmulatedRig(ARM, None, "cpu=1", {"A": FromAbove()})
    run = rig.measure(job, dry=False)
    inked = [sample.t for sample in rig.last.record if sample.pen]
    drawn = [row.t for row in run.rows if not row.rest]
    assert inked[0] < drawn[0] < inked[0] + 0.5
    assert inked[-1] - 0.5 < drawn[-1] < inked[-1]


def test_with_the_pen_down_it_draws(job):
    rig = EmulatedRig(ARM, None, "cpu=0", {"A": FromAbove()})
    rig.measure(job, dry=False)
    assert any(sample.pen for sample in rig.last.record)


def test_a_job_that_fails_says_what_the_brick_said(tmp_path):
    other = ARM._replace(joints=(ARM.joints[0]._replace(link=8.0), ARM.joints[1]))
    job = Path(jobs.write(tmp_path, [[(8.0, 2.0), (10.0, 4.0)]], other, rest=0.5))
    with pytest.raises(BadMeasurement, match="was planned for planar .*links 8, 9.5 cm"):
        EmulatedRig(ARM, None, "cpu=0", {"A": FromAbove()}).measure(job)


@pytest.fixture
def hears_ctrl_c():
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


def interrupted_at(t, monkeypatch):
    """Let Ctrl-C be heard at `t` of each run, s, by the clock of the brick.

    The main thread would hear a real one by the wall's, when the run may be over.
    """
    run = Rig.run

    def hear_ctrl_c():
        signal.getsignal(signal.SIGINT)(signal.SIGINT, None)

    ctrl_c = [(t, hear_ctrl_c)]
    monkeypatch.setattr(Rig, "run", lambda *a, **more: run(*a, **more, meanwhile=ctrl_c))


@pytest.mark.short(every=3)
@pytest.mark.parametrize("after", [-7.0, -2.0, 0.5], ids=["at work", "at its end", "after it"])
def test_ctrl_c_stops_who_measures_though_the_job_may_be_done(
    job, monkeypatch, hears_ctrl_c, after
):
    rig = EmulatedRig(ARM, None, "cpu=0", {"A": FromAbove()})
    rig.measure(job)
    interrupted_at(rig.last.outcome.t + after, monkeypatch)
    with pytest.raises(KeyboardInterrupt):
        rig.measure(job)
    assert rig.last.outcome.signals == (signal.SIGINT,)


def test_where_ctrl_c_is_ignored_a_job_that_it_ended_says_so(job, monkeypatch, hears_ctrl_c):
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    interrupted_at(1.0, monkeypatch)
    with pytest.raises(BadMeasurement, match="stopped by SIGINT"):
        EmulatedRig(ARM, None, "cpu=0", {"A": FromAbove()}).measure(job)


def test_rendered_pictures_are_really_tracked(job):
    scene = Scene(ARM, read_scene("fps=5,jpeg=0"))
    rig = RenderedRig(ARM, {"A": scene}, plant="cpu=0", only_rests=True)
    run = rig.measure(job)
    rests = run.rests()
    assert (rests.seen >= 1).all()
    stood = [row.t for row in run.rows if row.rest]
    for t, pixel in zip(stood, rests.pixel, strict=True):
        truth = scene.truth(true_angles(rig, t - 0.2))["effector"]
        assert pixel == pytest.approx(truth, abs=0.5)


def test_an_arm_that_shakes_at_its_rest_is_seen_to(job):
    rig = RenderedRig(ARM, {"A": Scene(ARM, read_scene("fps=5,jpeg=0"))}, plant="cpu=0",
                      only_rests=True)  # fmt: skip
    (end, *_) = [row.t for row in rig.measure(job).rows if row.rest]
    t, q = end - np.array([1.3, 0.7, 0.5]), np.array([(0.5, 1.0), (0.55, 1.0), (0.5, 1.0)])
    samples = zip(t, q, strict=True)
    rig.last = SimpleNamespace(record=[SimpleNamespace(t=at, q=pose) for at, pose in samples])
    seen = np.isfinite(rig._see("A", t, q).pixels).all(axis=1)
    assert seen.tolist() == [False, True, True], "only before it rests it is not looked at"


def test_in_space_the_marker_sits_along_and_above_the_last_link():
    arm = SPATIAL._replace(marker_offset=(0.5, 0.3))
    q = (0.7, 0.4, -0.9)
    x, y, z = marker_point(arm, q)
    tip = np.array(kinematics.forward(arm, q))
    *_, elbow, _ = (np.array(p) for p in kinematics.joint_positions(arm, q))
    along = (tip - elbow) / np.linalg.norm(tip - elbow)
    side = np.array([-math.sin(0.7), math.cos(0.7), 0.0])
    up = np.cross(along, side)
    up *= math.copysign(1, up[2])
    assert (x, y, z) == pytest.approx(tuple(tip + 0.5 * along + 0.3 * up))
