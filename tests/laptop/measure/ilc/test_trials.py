"""Trials of an emulated arm before an emulated camera: it draws better, or nothing is stored."""

from dataclasses import replace

import numpy as np
import pytest
from arms import PLANAR as ARM

from laptop.bench.ilc import plan_of, run_case
from laptop.bench.ilc_rig import AgeingRig, IlcCase
from laptop.drawing.artwork import Artwork
from laptop.drawing.lines import in_place, line_through
from laptop.drawing.options import DrawingOptions
from laptop.drawing.preparing import prepare
from laptop.emulator.scene.scene import Scene
from laptop.emulator.scene.scene_constants import read_scene
from laptop.measure.emulated_rig import EmulatedRig
from laptop.measure.ilc.emulated_view import view_of
from laptop.measure.ilc.learning import Offsets
from laptop.measure.ilc.trials import DrawingLearner, run_trials
from laptop.measure.run_data import BadMeasurement
from shared.job import Job

BUILT = ARM._replace(joints=(ARM.joints[0]._replace(link=11.6), ARM.joints[1]))


def short_line():
    artwork = line_through([(10, 1), (8, 5)])
    return prepare(artwork, ARM, in_place(artwork, DrawingOptions()))


def rig_of(noise=0.5, **scene):
    text = ",".join(f"{key}={value}" for key, value in scene.items())
    seen = Scene(BUILT, read_scene(text))
    height = seen.constants["marker_height"]
    return EmulatedRig(ARM, BUILT, "cpu=0", {"A": seen}, height, noise), view_of(seen, ARM)


def test_one_trial_takes_most_of_it_off():
    rig, view = rig_of()
    steps = []
    learned = run_trials(short_line(), rig, view, 2, on_trial=steps.append)
    assert [step.number for step in steps] == [1, 2]
    assert steps[0].greatest_mm > 3
    assert steps[1].greatest_mm < 1.8
    assert not learned.no_gain
    assert max(own.greatest for own in learned.offsets[0]) > np.radians(1)


def test_on_scrap_one_pen_draws_all():
    rig, view = rig_of()
    line = short_line()
    two = replace(line, options=replace(line.options, pens="colours", touch_up=True))
    headers = []
    measure = rig.measure

    def measured(file, dry):
        headers.append(Job(str(file), ARM).header)
        return measure(file, dry)

    rig.measure = measured
    run_trials(two, rig, view, 1)
    assert [header.pens for header in headers] == [""]


def test_a_camera_that_sees_nothing_is_told():
    rig, view = rig_of()
    rig._see = lambda name, t, q: type(rig)._see(rig, name, t[:2], q[:2])
    with pytest.raises(BadMeasurement, match="saw next to nothing of stroke 1"):
        run_trials(short_line(), rig, view, 1)


def test_what_is_far_off_is_not_learned():
    rig, view = rig_of()
    elsewhere = replace(view, base=(6.0, 2.0))  # the arm does not stand where it is said to
    with pytest.raises(BadMeasurement, match=r"was seen \d\d mm beside its path, and 30 are the"):
        run_trials(short_line(), rig, elsewhere, 1)


def test_what_the_arm_may_not_do_is_learned_in_part():
    plan = short_line()
    ((path,),) = DrawingLearner(plan).paths
    s = np.linspace(0, path.length, 20)
    far = Offsets(s, np.full((20, 2), np.radians(30)))  # beyond what the brick takes
    learner = DrawingLearner(plan)
    ((scaled,),) = learner._drawable([0], [[far]])
    assert np.degrees(scaled.greatest) == pytest.approx(15)


def test_what_is_learned_stays_within_the_limits_of_the_joints():
    plan = short_line()
    ((path,),) = DrawingLearner(plan).paths
    shoulder, elbow = ARM.joints
    upper = path.q[:, 0].max() + np.radians(2)
    tight = replace(plan, arm=ARM._replace(joints=(shoulder._replace(upper=upper), elbow)))
    s = np.linspace(0, path.length, 20)
    ((scaled,),) = DrawingLearner(tight)._drawable(
        [0], [[Offsets(s, np.full((20, 2), np.radians(3)))]]
    )
    assert (path.at(s, path.q)[:, 0] + scaled.q[:, 0]).max() == pytest.approx(upper, abs=0.01)
    assert scaled.q[:, 1] == pytest.approx(np.radians(3))


def test_where_nothing_is_learned_a_path_beside_a_limit_stays_where_it_is():
    plan = short_line()
    ((path,),) = DrawingLearner(plan).paths
    shoulder, elbow = ARM.joints
    limit = shoulder._replace(upper=path.q[:, 0].max() + np.radians(0.01))
    ((scaled,),) = DrawingLearner(replace(plan, arm=ARM._replace(joints=(limit, elbow)))).offsets
    assert scaled.greatest == 0


def test_of_strokes_that_are_joined_as_much_is_learned_of_each():
    lines = (np.array([(10.0, 1.0), (9.0, 3.0)]), np.array([(9.0, 3.0), (10.0, 5.0)]))
    artwork = Artwork("hook", lines, ("", ""))
    plan = prepare(artwork, ARM, in_place(artwork, DrawingOptions()))
    first, second = (stroke for (stroke,) in DrawingLearner(plan).paths)
    begin = np.radians(18)
    ends = ((first, begin), (second, np.radians(30)))  # the brick takes 20
    desired = [
        [Offsets(s, np.linspace((begin, 0), (end, 0), 20))]
        for path, end in ends
        for s in [np.linspace(0, path.length, 20)]
    ]
    (before,), (after,) = DrawingLearner(plan, desired).offsets
    assert np.degrees(after.greatest) == pytest.approx(15)
    assert before.q[-1] == pytest.approx(after.q[0])


@pytest.mark.claims
@pytest.mark.parametrize(("arm", "most"), [("planar", 2.6), ("geared", 1.2)])
def test_three_trials_of_an_unknown_arm(arm, most):
    done = run_case(IlcCase(8002, arm, "line 2"))
    assert not done.failed, done.why
    assert done.greatest_mm[0] > 2 * most
    assert done.greatest_mm[-1] < most


@pytest.mark.claims
def test_with_slow_ticks_it_does_not_diverge():
    done = run_case(IlcCase(8002, "planar", "line 1", cpu=2.2))
    assert not done.failed, done.why
    assert done.greatest_mm[-1] < 0.6 * done.greatest_mm[0]


@pytest.mark.long
def test_an_elbow_that_turns_round_against_an_unknown_load_is_not_called_blocked():
    for path in ("line 1", "line 2"):
        done = run_case(IlcCase(8001, "planar", path))
        assert not done.failed, done.why


@pytest.mark.claims
def test_the_real_tracker_teaches_as_well():
    done = run_case(IlcCase(8000, "planar", "line 1", rendered=True))
    assert not done.failed, done.why
    assert done.greatest_mm[-1] < 3 < done.greatest_mm[0]


def test_the_bench_plans_its_paths_where_they_are():
    rig = AgeingRig(IlcCase(1, "planar", "circle"))
    ((path, *_), *_) = DrawingLearner(plan_of(rig.arm, "circle")).paths
    assert np.linalg.norm(path.p - [11, 4], axis=1) == pytest.approx(
        np.full(len(path.p), 3), abs=0.1
    )
