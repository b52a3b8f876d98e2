"""An emulated arm that does jobs before emulated cameras, in virtual time.

The brick's program is the real one and computes as slowly as the brick.  What the cameras see comes
from the true angles of its links: by a camera's formula, with noise; or from rendered pictures that
the real tracker looks at.
"""

from __future__ import annotations

import contextlib
import io
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

import numpy as np

from laptop.emulator.device.plant_constants import read_plant
from laptop.emulator.host.clocks import UPTIME
from laptop.emulator.rendered_tracker import marker_specs
from laptop.emulator.rig import Rig
from laptop.emulator.scene.poses import ScriptedPoses
from laptop.emulator.scene.scene import Scene
from laptop.emulator.scene.synthetic_camera import SyntheticCamera
from laptop.emulator.simulation_result import SimulationResult
from laptop.measure.run_data import BadMeasurement, RunData, Sights
from laptop.see.markers.markers import read_spec
from laptop.see.markers.tracker import Tracker
from laptop.see.serve.joint_track import marker_place
from laptop.system import platforms
from shared.arm_description import Arm
from shared.job import Job
from shared.job_log import read_log
from shared.messages import EFFECTOR, LEAST_CONFIDENCE

if TYPE_CHECKING:
    from laptop.emulator.device.plant_constants import PlantConstants

JOB_TIMEOUT = 24 * 3600.0
"""Longest time of a job, s of the brick's clock."""


class PointCamera(Protocol):
    """Camera that sees points of the arm's frame; a CameraModel of see.table does, or a Scene."""

    def project(self, points: np.ndarray) -> np.ndarray:
        """Pixels (n, 2) of points (n, 3), cm."""
        ...


class EmulatedRig:
    """An arm before cameras that see its marker by their formula.

    Args:
        arm: as it is described; the brick reads it from its file.
        built: as it is; None: as described.
        plant: text of the plant's constants, or what read_plant has made of it.
        cameras: by name; their points are in the arm's frame.
        height: of the marker over the tip, cm.
        noise_px: standard deviation of each coordinate that is seen, px.
        fps: pictures a second.
        seed: of noise, and of where pictures fall in time.

    Attributes:
        last: the SimulationResult of the last run, the truth.
    """

    last: SimulationResult

    def __init__(
        self,
        arm: Arm,
        built: Arm | None = None,
        plant: str | PlantConstants = "",
        cameras: Mapping[str, PointCamera] | None = None,
        height: float = 0.0,
        noise_px: float = 1.0,
        fps: float = 20.0,
        seed: int = 0,
    ) -> None:
        self.arm = arm
        self.built = built or arm
        self._plant = read_plant(plant) if isinstance(plant, str) else plant
        self._cameras = dict(cameras or {})
        self._height, self._noise, self._fps = height, noise_px, fps
        self._rng = np.random.default_rng(seed)
        self._rest_spans: list[tuple[float, float]] = []  # from when to when at each rest, s

    def measure(self, job: Path, dry: bool = True) -> RunData:
        """Let the arm do a job, and look; see MeasuringRig.

        Raises:
            BadMeasurement: the job did not come to its end; what its program printed stands in it.
            KeyboardInterrupt: Ctrl-C came meanwhile.
        """
        header = Job(str(job)).header
        with tempfile.TemporaryDirectory() as folder:
            log = Path(folder) / "log.csv"
            args = ["job", str(job), "--log", str(log), *(["--dry"] if dry else [])]
            output = io.StringIO()
            with (
                contextlib.redirect_stdout(output),
                contextlib.redirect_stderr(output),
                Rig(self.arm, self.built, self._plant) as rig,
            ):
                self.last = rig.run("driver.py", *args, timeout=JOB_TIMEOUT)
            status = self.last.outcome.status
            logged = [] if status else list(read_log(str(log)))
        platforms.raise_signals(self.last.outcome.signals)
        if status:
            lines = output.getvalue().strip().splitlines()
            raise BadMeasurement(lines[-1] if lines else self.last.outcome.reason)
        # By the clock of the emulated world, as the record of its truth is: that knows nothing of
        # the program's start.
        start = UPTIME + (self.last.outcome.start or 0.0)
        rows = [row._replace(t=row.t - start) for row in logged]
        # (A picture comes a little late or early, and the tracker needs one to find its marker.)
        margin = 1 / self._fps
        self._rest_spans = [
            (row.t - header.rest - margin, row.t + margin) for row in rows if row.rest
        ]
        record = self.last.record
        times = np.array([sample.t for sample in record])
        angles = np.array([sample.q for sample in record])
        sights = {}
        for name in sorted(self._names()):
            first = times[0] + self._rng.random() / self._fps
            t = np.arange(first, times[-1], 1 / self._fps)
            q = np.stack([np.interp(t, times, column) for column in angles.T], axis=1)
            sights[name] = self._see(name, t, q)
        return RunData(rows, header.rest, sights)

    def _names(self) -> Sequence[str]:
        return list(self._cameras)

    def _see(self, name: str, t: np.ndarray, q: np.ndarray) -> Sights:
        """Look at times (n,), s, the joints at q (n, joints), rad."""
        places = np.array([marker_point(self.built, pose, self._height) for pose in q])
        pixels = np.asarray(self._cameras[name].project(places))
        return Sights(t, pixels + self._noise * self._rng.standard_normal(pixels.shape))


class RenderedRig(EmulatedRig):
    """An arm before cameras whose pictures are rendered and really tracked.

    Args:
        arm, built, plant, seed: as for EmulatedRig.
        scenes: by the cameras' names, each of the arm as built.
        only_rests: no picture is taken but those of a rest, by the brick's log.
    """

    def __init__(
        self,
        arm: Arm,
        scenes: Mapping[str, Scene],
        built: Arm | None = None,
        plant: str = "",
        seed: int = 0,
        only_rests: bool = False,
    ) -> None:
        fps = min(scene.constants["fps"] for scene in scenes.values())
        super().__init__(arm, built, plant, fps=fps, seed=seed)
        self._scenes = dict(scenes)
        self._only_rests = only_rests

    def _names(self) -> Sequence[str]:
        return list(self._scenes)

    def _see(self, name: str, t: np.ndarray, q: np.ndarray) -> Sights:
        scene = self._scenes[name]
        record = self.last.record
        times = np.array([sample.t for sample in record])
        angles = np.array([sample.q for sample in record])

        def pose(at: float) -> list[float]:
            return [float(np.interp(at, times, column)) for column in angles.T]

        poses = ScriptedPoses(scene.arm, pose)
        camera = SyntheticCamera(scene, poses, lambda: 0.0, start=float(t[0]))
        tracker = Tracker([read_spec(*marker) for marker in marker_specs(scene.constants).items()])
        times_seen, pixels = t.copy(), np.full((len(t), 2), np.nan)
        for index in range(len(t)):
            at = t[index]
            if self._only_rests and not any(begin < at <= end for begin, end in self._rest_spans):
                continue
            frame = camera.capture(index)
            times_seen[index] = frame.t
            found = tracker.find(frame.image, frame.t).get(EFFECTOR)
            if found and found.confidence >= LEAST_CONFIDENCE:
                pixels[index] = found.u, found.v
        return Sights(times_seen, pixels)


def marker_point(arm: Arm, q: Sequence[float], height: float = 0.0) -> tuple[float, float, float]:
    """Return the marker's place of an arm, (x, y, z), cm, with the joints at q, rad.

    Args:
        arm: whose marker_offset counts.
        q: joint angles, rad.
        height: of the marker over the tip, cm.
    """
    x, y, *up = marker_place(arm, q)
    return x, y, sum(up) + height
