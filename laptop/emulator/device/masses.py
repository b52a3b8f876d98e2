"""Masses that an arm in space carries, which its joints lift and accelerate.

The links' inertias are constants: the torques that one joint's acceleration puts on the other are
left out.  Those of an arm in space are of its masses with the arm stretched out level.
"""

from typing import List, Tuple

from laptop.emulator.device.plant_constants import at_port
from shared.arm_keys import PULLED_DOWN

MYPY = False
if MYPY:
    from laptop.emulator.device.plant_constants import PlantConstants  # noqa: F401
    from shared.arm_description import Arm  # noqa: F401

    Masses = List[Tuple[float, float]]  # g, and cm from the joint's axis


MOTOR_MASS = {"large": 76.0, "medium": 36.0}
"""Mass of a motor, g, as weighed by LEGO's builders."""

ELBOW_MOTOR_CENTRE, TIP_MOTOR_CENTRE = 5.5, 5.0
"""Centre of mass of the carried motors, cm from the axis of shoulder and elbow: each lies along its
link, its shaft at the far end."""


def _masses_on_joints(arm: "Arm", plant: "PlantConstants") -> Tuple["Masses", "Masses", "Masses"]:
    """List the masses that hang on each joint of an arm in space.

    Returns:
        Per joint, the pairs (mass g, cm from its axis) of what its link carries.
    """
    _, upper, fore = arm.joints
    motors = plant["motor_mass"]
    on_upper = [
        (plant["upper_arm_mass"], upper.link / 2),
        (motors * MOTOR_MASS[fore.motor], ELBOW_MOTOR_CENTRE),
    ]
    on_fore = [(plant["forearm_mass"], fore.link / 2), (plant["tip_mass"], fore.link)]
    if arm.pen:
        on_fore.append((motors * MOTOR_MASS[arm.pen.motor], TIP_MOTOR_CENTRE))
    return [], on_upper, on_fore


def weighed(arm: "Arm", plant: "PlantConstants") -> "Arm":
    """Return the Arm with the plant's masses, kg, centres, cm, and frictions, Nm, of its links.

    An arm in the plane is left as it is.
    """
    if arm.chain not in PULLED_DOWN:
        return arm
    joints = []
    for joint, parts in zip(arm.joints, _masses_on_joints(arm, plant)):
        mass = sum(grams for grams, _ in parts)
        centre = sum(grams * at for grams, at in parts) / mass if mass else 0.0
        friction = at_port(plant, joint.port)["link_friction"]
        joints.append(joint._replace(mass=0.001 * mass, centre=centre, friction=friction))
    return arm._replace(joints=tuple(joints))


def inertias(arm: "Arm", plant: "PlantConstants") -> List[float]:
    """Return the inertia that each joint moves, kg m2; of an arm in space, stretched out level."""
    if arm.chain not in PULLED_DOWN:
        return [plant["shoulder_inertia"], plant["elbow_inertia"]]
    _, on_upper, on_fore = _masses_on_joints(arm, plant)
    reach = arm.joints[1].link
    elbow, shoulder = (
        1e-7 * sum(grams * at * at for grams, at in parts)
        for parts in (on_fore, on_upper + [(grams, reach + at) for grams, at in on_fore])
    )
    return [plant["base_inertia"] + shoulder, shoulder, elbow]
