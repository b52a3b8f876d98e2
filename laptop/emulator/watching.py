"""A synthetic camera and a tracker, as one text describes them, before a brick in virtual time."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from laptop.emulator.faults import InvalidSimulationOption
from laptop.emulator.picture_faults import PictureFaults
from laptop.emulator.rendered_tracker import rendered
from laptop.emulator.scene.scene import Scene
from laptop.emulator.scene.scene_constants import read_scene
from laptop.emulator.scene.workcell import cameras
from laptop.emulator.virtual_tracker import FrameChain, VirtualTracker
from shared.arm_description import Arm

if TYPE_CHECKING:
    from laptop.emulator.device.brick import EmulatedBrick


def watching(text: str, arm: Arm) -> Callable[[EmulatedBrick], VirtualTracker]:
    """Return what serves a brick with what the tracker finds in rendered frames.

    Args:
        text: of the scene, as `simulate --scene` takes it.
        arm: Arm that stands in it.

    Raises:
        BadScene, InvalidSimulationOption: the text is wrong.
    """
    scenes = {
        name: Scene(arm, {**read_scene(text, name), "fps_wander": 0.0})
        for name in cameras(arm, text)
    }
    shared = {key: scenes["A"].constants[key] for key in ("fps", "jitter", "delay", "seed")}
    for name, scene in scenes.items():
        for key, value in shared.items():
            if scene.constants[key] != value:
                raise InvalidSimulationOption(
                    f"scene {name}.{key}: cameras in virtual time share it; write {key}=VALUE"
                )
    chain = FrameChain(shared["fps"], shared["delay"], shared["jitter"])

    def watch(brick: EmulatedBrick) -> VirtualTracker:
        pictures = PictureFaults()
        see = rendered(scenes, brick, pictures)
        return VirtualTracker(
            brick.world, see, chain, list(scenes), seed=shared["seed"], pictures=pictures
        )

    return watch
