"""The whole test, by an arm that goes just where it is told to."""

import numpy as np
import pytest
from accuracy_rigs import PuppetRig, camera_above

from laptop.measure.accuracy import accuracy_test, plots, report
from laptop.measure.accuracy.plan import plan_accuracy
from laptop.measure.accuracy.sighting import ArmSighting, BadSighting, BoardArmPose
from shared.arm_description import find_arm, read_arm

ARM = read_arm(find_arm("planar"))._replace(marker_offset=(0.5, -0.3))
PLAN = plan_accuracy(ARM, 4, 6.0, (14.0, 0.0))
CAMERA = camera_above((14.0, 0.0))


def shifted(k, share, d):
    return np.array([0.03, 0.04])


def measured(off, arm_pose=None, **options):
    rig = PuppetRig(ARM, {"A": CAMERA}, off, 2.5, **options)
    return accuracy_test.measure(rig, PLAN, ArmSighting(ARM, {"A": CAMERA}, 2.5), arm_pose)


def test_an_arm_that_is_off_by_half_a_millimetre_everywhere_is_told_so():
    mm = {one.name: one.mm for one in measured(shifted, BoardArmPose()).criteria}
    for name, value in mm.items():
        if name.startswith("AP"):
            assert value == pytest.approx(0.5, abs=1e-3), name
        elif name.startswith(("RP", "vAP", "AD", "RD", "RT")):
            assert value < 5e-3, name
    assert mm["AT circle 10 %"] == pytest.approx(0.5, abs=0.01)


@pytest.mark.claims
def test_a_stand_that_is_fitted_hides_what_all_poses_have_in_common():
    result = measured(shifted)
    assert result.is_fitted
    assert max(one.mm for one in result.criteria) < 0.02
    assert any("fitted to the poses" in note for note in report.notes(result))


@pytest.mark.claims
def test_the_cameras_noise_is_found_and_taken_off(tmp_path):
    result = measured(shifted, BoardArmPose(), noise=0.5, seed=3)
    assert result.sigma["A"] == pytest.approx(0.5, rel=0.1)
    mm = {one.name: one for one in result.criteria}
    assert mm["AP P1"].mm == pytest.approx(0.5, abs=3 * mm["AP P1"].u_mm)
    assert mm["AP P1"].u_mm > 0.01
    plots.write_accuracy_plot(tmp_path / "a.png", result, "title", "notes")
    assert (tmp_path / "a.png").read_bytes()[:4] == b"\x89PNG"
    report.write_csv(tmp_path / "a.csv", result)
    lines = (tmp_path / "a.csv").read_text().splitlines()
    assert len(lines) == 1 + 5 * 4 + 9 * 4 + 3 * (20 + 36) * 3
    run = report.accuracy_run(result)
    assert (run.kind, len(run.rows("criteria"))) == ("accuracy", 27)


def test_a_marker_that_is_hidden_where_a_pose_is_ends_the_test():
    def hidden(place):
        return place[1] > 1.5

    with pytest.raises(
        accuracy_test.HiddenMarker, match=r"P\d: the marker was seen in 0 of 4 cycles"
    ):
        measured(shifted, BoardArmPose(), hidden=hidden)


def test_an_arm_in_the_plane_wants_one_camera():
    with pytest.raises(BadSighting, match="2 cameras: an arm in the plane needs one; give one"):
        ArmSighting(ARM, {"A": CAMERA, "B": CAMERA})
