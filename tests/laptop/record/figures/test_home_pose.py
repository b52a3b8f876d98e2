"""The picture of the home pose: drawn from the arm's numbers, as the README shows it."""

import matplotlib.image
import numpy as np
import pytest
from places import ROOT

from laptop.record.figures.home_pose import write_home_pose
from robot.motion import kinematics
from shared.arm_description import find_arm, read_arm


def picture(tmp_path, arm):
    skeleton = kinematics.joint_positions(arm, [joint.home for joint in arm.joints])
    write_home_pose(tmp_path / "home.png", arm, skeleton)
    return matplotlib.image.imread(tmp_path / "home.png")


@pytest.mark.long
@pytest.mark.parametrize("name", ["planar", "spatial"])
def test_the_readme_shows_the_arms_as_they_are(tmp_path, name):
    drawn = picture(tmp_path, read_arm(find_arm(name)))
    shown = matplotlib.image.imread(ROOT / "laptop" / "docs" / "pictures" / f"home-{name}.png")
    assert drawn.shape == shown.shape
    assert np.mean(np.abs(drawn - shown) > 0.3) < 0.01  # fonts may differ


@pytest.mark.long
def test_another_home_is_another_picture(tmp_path):
    arm = read_arm(find_arm("planar"))
    other = arm._replace(joints=(arm.joints[0], arm.joints[1]._replace(home=0.5)))
    assert np.mean(np.abs(picture(tmp_path, arm) - picture(tmp_path, other)) > 0.3) > 0.01
