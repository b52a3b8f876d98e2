"""The real tracker, on rendered frames of an emulated brick at work."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from laptop.emulator.picture_faults import PictureFaults
from laptop.emulator.scene.marker_items import ARUCO_IDS, shown_markers
from laptop.emulator.scene.poses import ScriptedPoses
from laptop.emulator.scene.scene import Scene
from laptop.emulator.scene.synthetic_camera import SyntheticCamera
from laptop.see.markers.markers import read_spec
from laptop.see.markers.tracker import Tracker

if TYPE_CHECKING:
    from laptop.emulator.device.brick import EmulatedBrick
    from laptop.emulator.virtual_tracker import Markers, See


def marker_specs(constants: dict[str, Any]) -> dict[str, str]:
    """Return the markers of a scene as the tracker is told of them: name -> SPEC."""
    kind = constants["marker"]
    looks = ARUCO_IDS if kind == "aruco" else constants
    return {name: f"{kind}:{looks[name]}" for name in shown_markers(constants)}


def rendered(
    scenes: Mapping[str, Scene], brick: EmulatedBrick, pictures: PictureFaults | None = None
) -> See:
    """Return a VirtualTracker's `see`: every frame is rendered as the brick stands, and tracked.

    Args:
        scenes: what each camera sees, by its name.
        brick: the arm is its.
        pictures: shows other pictures than the rendered ones; to be given to the VirtualTracker.
    """
    pictures = pictures or PictureFaults()
    trackers = {
        name: Tracker([read_spec(*spec) for spec in marker_specs(scene.constants).items()])
        for name, scene in scenes.items()
    }
    cameras: dict[str, SyntheticCamera] = {}

    def see(name: str, index: int, t: float) -> Markers | None:
        if name not in cameras:
            scene = scenes[name]
            poses = ScriptedPoses(scene.arm, lambda t: brick.plant.q)
            start = t - index / scene.constants["fps"]
            cameras[name] = SyntheticCamera(scene, poses, brick.world.now, start=start)
        image = pictures.shown(name, lambda: cameras[name].capture(index).image)
        found = trackers[name].find(image, t).items()
        return {name: seen and (seen.u, seen.v, seen.confidence) for name, seen in found}

    return see
