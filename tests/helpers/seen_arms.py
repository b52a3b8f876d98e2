"""An arm that stands at poses before a camera, worked out without the brick's program."""

import math

import numpy as np

from laptop.measure.arm.arm_fit import RestSights
from laptop.measure.arm.arm_model import ArmModel, CameraPrior, JointStates, MeasuredByHand
from laptop.measure.arm.emulated_table import EmulatedTable, camera_over
from laptop.measure.arm.pose_plan import scouts
from laptop.measure.emulated_rig import marker_point
from shared.arm_description import find_arm, read_arm

ARM = read_arm(find_arm("planar"))
SPATIAL = read_arm(find_arm("spatial"))


def built(arm=ARM, links=(11.6, 9.2), backlash=(3.0, 1.0), offset=(0.3, -0.2)):
    joints = tuple(
        joint._replace(link=link, backlash=math.radians(play))
        for joint, link, play in zip(arm.joints, links, backlash, strict=True)
    )
    return arm._replace(joints=joints, marker_offset=offset)


def table(arm=None, **more):
    camera = camera_over(560.0, (-8.0, 0.0), 46.0, math.radians(20), 1.0, 0.1)
    return EmulatedTable(arm or built(), camera, **more)


def rests(over, count=40, zeros=(0.0, 0.0), noise_px=0.0, phase=0.0, seed=0, moved=None):
    """RestSights of an arm on a table, its poses, and the model of what is described.

    Args:
        over: EmulatedTable, the truth.
        count: of poses.
        zeros: true angles where the zero is believed, rad.
        noise_px: of what is seen.
        phase: error of the encoders, counts to each side.
        seed: of both.
        moved: what becomes of the angles (n, joints) of the links, rad.
    """
    luck = np.random.default_rng(seed)
    poses = scouts(ARM, count)
    q = np.array([pose.q for pose in poses])
    sides = luck.choice([-1.0, 1.0], q.shape)
    backlash = np.array([joint.backlash for joint in over.arm.joints])
    links = q + np.array(zeros) - sides * backlash / 2
    if moved is not None:
        links = moved(links)
    places = np.array([marker_point(over.arm, pose, over.height) for pose in links])
    pixels = over.project(places)
    pixels = pixels + noise_px * luck.standard_normal(pixels.shape)
    e = q + phase * math.radians(1) * luck.uniform(-1, 1, q.shape)
    sigma = np.full(len(q), max(noise_px, 0.05))
    return RestSights(JointStates(e, sides, np.zeros(q.shape)), {"A": pixels}, {"A": sigma})


def model(over, known=None, described=ARM, seed=0, bar=100.0):
    camera = over.calibrated(np.random.default_rng(seed), bar).camera
    known = known or MeasuredByHand(over.height, 0, 0.3)
    return ArmModel(described, {"A": CameraPrior.of(camera)}, known)
