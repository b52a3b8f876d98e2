"""The arms that come along."""

from shared.arm_description import find_arm, read_arm

PLANAR, GEARED, SPATIAL = (read_arm(find_arm(name)) for name in ("planar", "geared", "spatial"))
ARMS = {arm.name: arm for arm in (PLANAR, GEARED, SPATIAL)}
