"""A rig for tests of accuracy: an arm that goes just where a test says, before exact cameras."""

import numpy as np

from laptop.measure.emulated_rig import marker_point
from laptop.measure.run_data import RunData, Sights
from laptop.see.table.camera_model import CameraModel
from robot.motion import kinematics
from robot.motion.trajectory import Trajectory
from shared.job import Job
from shared.job_log import LogRow

FPS = 100.0


def camera_above(at=(12.0, 0.0), height=50.0, tilt=0.3, spread=0.0):
    """A CameraModel that looks at a place of the table, tilted about the table's y, rad."""
    c, s = np.cos(tilt), np.sin(tilt)
    rotation = np.array([[0.0, -1.0, 0.0], [-c, 0.0, -s], [s, 0.0, -c]])
    position = np.array([*at, 0.0]) - height * rotation[2]
    angle = np.arccos((np.trace(rotation) - 1) / 2)
    axis = np.array(
        [
            rotation[2, 1] - rotation[1, 2],
            rotation[0, 2] - rotation[2, 0],
            rotation[1, 0] - rotation[0, 1],
        ]
    )
    vector = axis / np.linalg.norm(axis) * angle
    covariance = np.zeros((14, 14))
    covariance[11:, 11:] = spread**2 * np.eye(3)
    lens = np.array([700.0, 319.5, 239.5, 0, 0, 0, 0, 0])
    return CameraModel((640, 480), lens, vector, -rotation @ position, covariance)


class PuppetRig:
    """Goes where it is sent, plus what `off(stroke number, share of the way, d)` says, cm.

    Args:
        arm: as described.
        cameras: by name, in the arm's frame.
        off: see above.
        height: of the marker over the tip, cm.
        noise: px.
        hidden: `hidden(place)` says whether the marker cannot be seen there.
    """

    def __init__(
        self, arm, cameras, off, height=0.0, noise=0.0, seed=0, hidden=lambda place: False
    ):
        self.arm, self._cameras, self._off = arm, cameras, off
        self._height, self._noise, self._hidden = height, noise, hidden
        self._luck = np.random.default_rng(seed)
        self.jobs = []

    def measure(self, job, dry=True):
        job = Job(str(job), self.arm)
        self.jobs.append(job.header)
        assert dry
        rows, times, places = [], [], []
        t = 0.0
        for k in range(1, job.header.strokes + 1):
            motions = [Trajectory(*piece) for piece in job.stroke(k).pieces]
            whole = sum(motion.duration for motion in motions)
            before = t
            for motion in motions:
                for tau in np.arange(0.0, motion.duration, 1 / FPS):
                    q = motion.at(tau)[0]
                    rows.append(LogRow(k, 0.0, t + tau, False, tuple(q)))
                    times.append(t + tau)
                    places.append(self._place(k, (t + tau - before) / whole, q))
                t += motion.duration
            end = motions[-1].end
            for tau in np.arange(0.0, job.header.rest, 0.05):
                times.append(t + tau)
                places.append(self._place(k, 1.0, end))
            t += job.header.rest
            rows.append(LogRow(k, 0.0, t, True, tuple(end)))
            t += 1 / FPS
        places = np.array(places)
        gone = np.array([self._hidden(place) for place in places])
        sights = {}
        for name, camera in self._cameras.items():
            pixels = camera.project(places)
            pixels = pixels + self._noise * self._luck.standard_normal(pixels.shape)
            pixels[gone] = np.nan
            sights[name] = Sights(np.array(times), pixels)
        return RunData(rows, job.header.rest, sights)

    def _place(self, k, share, q):
        tip = np.array(kinematics.forward(self.arm, q))
        off = np.zeros(3)
        off[: len(tip)] = self._off(k, share, len(tip))
        return np.array(marker_point(self.arm, q, self._height)) + off
