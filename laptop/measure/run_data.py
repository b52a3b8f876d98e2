"""Data of a job's run: where the motors were, by the brick, and the marker, by cameras."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

import numpy as np

from shared.arm_description import Arm, ArmError
from shared.job_log import LogRow

SETTLED_SHARE = 0.5
"""Share of a rest, its last one, in which the arm is measured: before that it may still swing."""
MAD_TO_SIGMA = 1.4826
"""Standard deviation of a normal distribution by its median absolute deviation."""
MEDIAN_NOISE = 1.2533
"""Standard deviation of a median by that of a mean, of many normal values: sqrt(pi / 2)."""


class BadMeasurement(ArmError, ValueError):
    """Error: a run does not determine what it was made for."""


@dataclass(frozen=True, eq=False)
class Sights:
    """Places in the picture at which a camera saw the marker.

    t       of each picture, s, by the clock of the log, (n,)
    pixels  of its centre, (n, 2), px; nan where it was not seen
    """

    t: np.ndarray
    pixels: np.ndarray


@dataclass(frozen=True, eq=False)
class Rests:
    """The arm as it stood after each stroke.

    stroke  its number, (n,)
    q       joint angles by the motors' encoders, rad, (n, joints)
    pixel   of the marker, median of what was seen meanwhile, (n, 2), px; nan where it was not seen
    sigma   standard deviation of that, of a single picture, (n,), px; nan of less than three
    seen    number of pictures in which it was seen, (n,)
    """

    stroke: np.ndarray
    q: np.ndarray
    pixel: np.ndarray
    sigma: np.ndarray
    seen: np.ndarray


@dataclass(frozen=True, eq=False)
class RunData:
    """One run of a job.

    rows    what the brick has logged, in order
    rest    for how long the arm stood after each stroke, s
    sights  by camera
    """

    rows: Sequence[LogRow]
    rest: float
    sights: Mapping[str, Sights]

    def rests(self, camera: str = "A") -> Rests:
        """Return where it stood, and where a camera saw the marker then.

        Raises:
            BadMeasurement: it stood nowhere.
        """
        rows = [row for row in self.rows if row.rest]
        if not rows:
            raise BadMeasurement(
                "the brick has logged no rest of the arm; put today's program on it: "
                "brickservo brick install"
            )
        sights = self.sights[camera]
        pixels, sigmas, counts = [], [], []
        for row in rows:
            in_rest = (sights.t > row.t - SETTLED_SHARE * self.rest) & (sights.t <= row.t)
            seen = sights.pixels[in_rest]
            seen = seen[np.isfinite(seen).all(axis=1)]
            counts.append(len(seen))
            if not len(seen):
                pixels.append(np.full(2, np.nan))
                sigmas.append(np.nan)
                continue
            middle = np.median(seen, axis=0)
            pixels.append(middle)
            spread = MAD_TO_SIGMA * np.median(np.abs(seen - middle), axis=0)
            sigmas.append(float(np.hypot(*spread) / np.sqrt(2)) if len(seen) > 2 else np.nan)
        return Rests(
            np.array([row.stroke for row in rows]),
            np.array([row.q for row in rows]),
            np.array(pixels),
            np.array(sigmas),
            np.array(counts),
        )

    def motors(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return of all that was logged in motion plan (n,), t (n,), s, and q (n, joints), rad."""
        rows = [row for row in self.rows if not row.rest]
        return (
            np.array([row.plan for row in rows]),
            np.array([row.t for row in rows]),
            np.array([row.q for row in rows]).reshape(len(rows), -1),
        )


class MeasuringRig(Protocol):
    """An arm that does jobs before cameras.

    Attributes:
        arm: as it is described.
    """

    arm: Arm

    def measure(self, job: Path, dry: bool = True) -> RunData:
        """Let the arm do a job, and look.

        Args:
            job: file whose header asks for a log, or rests.
            dry: the pen stays up.

        Raises:
            ArmError: the arm or the camera fails; the arm has stopped.
        """
        ...
