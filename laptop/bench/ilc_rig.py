"""An emulated arm that is not as described, of which the benches of learning by camera draw.

Each seed draws its errors: links, zero, backlash, load.  What disturbs it can be taken away, one
cause at a time.
"""

from __future__ import annotations

import random
import re
import tempfile
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from laptop.emulator.device.plant_constants import CPU
from laptop.emulator.scene.scene import Scene
from laptop.emulator.scene.scene_constants import read_scene
from laptop.measure.emulated_rig import EmulatedRig, RenderedRig
from laptop.measure.ilc.emulated_view import view_of
from laptop.measure.ilc.view import TipView
from laptop.measure.run_data import RunData
from laptop.record.figures.line_accuracy import pen_down_runs, place, refined
from shared.arm_description import Arm, find_arm, read_arm

MAX_LINK_ERROR, MAX_ZERO_ERROR, MAX_BACKLASH, MAX_LOAD = 0.05, 1.5, 3.0, 0.015
"""Greatest errors: share of a link, of the zero, deg, backlash, deg, load, Nm at every joint."""

VOLTAGE_RANGE = 7.85, 7.95
"""Range of the motors' voltage, V, drawn anew for each drawing."""

NOISE_PX, FPS = 0.5, 20.0
"""Sigma of a seen place, px, and rate, Hz, of the ideal camera."""


@dataclass(frozen=True)
class IlcCase:
    """One arm that draws one path.

    seed, arm, path  names of them
    wrong            whether it is built otherwise than described
    rendered         whether the real tracker gets rendered pictures
    cpu              slowness of its brick
    """

    seed: int
    arm: str
    path: str
    wrong: bool = True
    rendered: bool = False
    cpu: float = CPU
    without: str = ""


@dataclass(frozen=True)
class Change:
    """One cause of deviation, taken away in the emulation.

    plant    constants of the plant, in place of the drawn ones
    play     whether the arm neither has backlash nor is described with any
    noise    whether the camera sees without noise
    voltage  of every drawing, V; None: another one for each
    """

    plant: dict[str, str] = field(default_factory=dict)
    play: bool = False
    noise: bool = False
    voltage: float | None = None


FINER = {"encoder": "2"}
"""Encoders of half the step.  With much finer ones the brick, which settles to a share of a count,
would wait for what friction holds."""

WITHOUT = {
    "": Change(),
    "half of the encoders' step": Change(FINER),
    "backlash": Change({"backlash": "0"}, play=True),
    "both": Change({**FINER, "backlash": "0"}, play=True),
    "half of the motors' friction": Change({"rotor_friction": "0.5"}),
    "friction of pen and bearings": Change({"link_friction": "0", "pen_drag": "0"}),
    "the camera's noise": Change(noise=True),
    "computing time": Change({"cpu": "0"}),
    "changes of voltage": Change(voltage=7.9),
}
"""What may be taken away, by its name for people; "": nothing."""


def _without_backlash(arm: Arm, folder: str) -> Arm:
    """Return an arm without backlash; the brick reads its description from a file in a folder."""
    file = Path(folder) / Path(arm.file).name
    text = Path(arm.file).read_text(encoding="utf-8")
    file.write_text(re.sub(r"(?m)^backlash = [0-9.]+", "backlash = 0", text), encoding="utf-8")
    return read_arm(str(file))


class AgeingRig:
    """An emulated arm with another battery voltage for each drawing.

    Args:
        case: which arm.

    Attributes:
        arm: as it is described.
        view: of its camera.
        rig: EmulatedRig of the last drawing.
        rendered: whether pictures are rendered for the real tracker.
        plant: text of its plant's constants, errors included.
    """

    rig: EmulatedRig

    def __init__(self, case: IlcCase) -> None:
        change = WITHOUT[case.without]
        self.arm: Arm = read_arm(find_arm(case.arm))
        self._play = not change.play
        if change.play:
            self.arm = self.arm._replace(
                joints=tuple(joint._replace(backlash=0.0) for joint in self.arm.joints)
            )
        rng = random.Random(f"{case.arm}/{case.seed}")
        plant = {"seed": f"{case.seed}", "cpu": f"{case.cpu:g}"}
        self._built = self.arm
        if case.wrong:
            links = [
                joint.link * (1 + rng.uniform(-1, 1) * MAX_LINK_ERROR) for joint in self.arm.joints
            ]
            joints = zip(self.arm.joints, links, strict=True)
            self._built = self.arm._replace(
                joints=tuple(joint._replace(link=link) for joint, link in joints)
            )
            plant["backlash"] = f"{rng.uniform(0, MAX_BACKLASH):.3f}"
            plant["zero_error"] = f"{rng.uniform(-1, 1) * MAX_ZERO_ERROR:.3f}"
            plant["load"] = f"{rng.uniform(-1, 1) * MAX_LOAD:.4f}"
        plant.update(change.plant)
        self.plant = ",".join(f"{key}={value}" for key, value in plant.items())
        self._voltage = None if change.voltage is None else f"{change.voltage:g}"
        self._noise_px = 0.0 if change.noise else NOISE_PX
        self._battery = random.Random(f"battery/{case.arm}/{case.seed}/{case.path}")
        self.rendered = case.rendered
        self._scene = Scene(self._built, read_scene(f"fps={FPS:g},seed={case.seed}"))
        self.view: TipView = view_of(self._scene, self.arm)

    def measure(self, job: Path, dry: bool = True) -> RunData:
        """Measure a job's run, as MeasuringRig.measure."""
        voltage = f"{self._battery.uniform(*VOLTAGE_RANGE):.3f}"
        plant = f"{self.plant},voltage={self._voltage or voltage}"
        seed = self._battery.randrange(2**31)
        with tempfile.TemporaryDirectory() as folder:
            arm = self.arm if self._play else _without_backlash(self.arm, folder)
            if self.rendered:
                self.rig = RenderedRig(arm, {"A": self._scene}, self._built, plant, seed)
            else:
                height = self._scene.constants["marker_height"]
                camera = {"A": self._scene}
                self.rig = EmulatedRig(
                    arm, self._built, plant, camera, height, self._noise_px, FPS, seed
                )
            return self.rig.measure(job, dry)

    def ink(self) -> np.ndarray:
        """Return the true ink of the last drawing, (n, 2), cm."""
        (strokes,) = pen_down_runs(self.rig.last.record)
        return np.asarray(refined(np.array([place(row) for row in strokes], float))[:, :2])
