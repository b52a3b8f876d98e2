"""Measurements: from many frames of an arm that stands to one place of the tip.  Pure.

s   image features, px: u and v of a camera
"""

import math
from operator import sub

from robot.servoing.linear_algebra import length, median
from shared.record import record

MYPY = False  # which a type checker takes for true
if MYPY:
    from typing import Dict, List, Mapping, NamedTuple, Optional, Sequence, Tuple  # noqa: F401

    from robot.servoing.image_model import Features  # noqa: F401
    from robot.servoing.rows import Rows  # noqa: F401

    Frames = Mapping[str, Sequence[Tuple[float, Features, Features]]]
    # By camera, in order of time, of an arm that stands: when it was taken (s); tip and goal (px).

MIN_FRAMES, MAX_FRAMES = 6, 12
"""Frames of a measurement, the least number and, where noise might decide whether it has arrived,
the greatest."""

GLANCE_FRAMES = 3
"""Frames after which it is worth preparing for what they show."""

MEDIAN_VARIANCE = math.pi / 2
"""Variance of a median of normal noise, over that of a mean."""

FIRST_SIGMA, MIN_SIGMA = 1.0, 0.2
"""Noise of a frame before it is known, and the least that is believed, px."""

MAX_SCATTER = 3.0
"""Scatter of frames beyond which they are not enough yet, as a multiple of the usual one."""

if MYPY:
    Measurement = NamedTuple(
        "Measurement",
        [
            ("camera", str),
            ("s", Features),
            ("goal", Features),
            ("variance", float),
            ("frames", int),
        ],
    )
else:
    Measurement = record("Measurement", "camera s goal variance frames")
Measurement.__doc__ = """Measurement by one camera while the arm stood.

s, goal    px;  variance  of each element of s, px^2;  frames  that it took
"""


def robust_mean(frames):
    # type: (Sequence[Features]) -> Tuple[Tuple[float, ...], float, int]
    """Return the median of what was seen, after outliers were left out.

    Args:
        frames: list of s, px.

    Returns:
        (s, standard deviation of a frame by the median absolute deviation, number of inliers)
    """
    columns = list(zip(*frames))
    middle = [median(column) for column in columns]
    off = [[abs(x - m) for x in column] for column, m in zip(columns, middle)]
    # 1.4826: standard deviation of normal noise by its median absolute deviation (Huber 1981)
    sigma = 1.4826 * sum([median(column) for column in off]) / len(off)
    limit = max(3 * sigma, 3.0)
    inliers = [frame for frame, far in zip(frames, zip(*off)) if max(far) <= limit] or frames
    if len(inliers) < len(frames):
        middle = [median(column) for column in zip(*inliers)]
    return tuple(middle), sigma, len(inliers)


def error_of(measurements, rows):
    # type: (Sequence[Measurement], Rows) -> List[float]
    """Return e = s - s_star, the Rows that count of all cameras in turn, px."""
    return rows.values(
        {
            measurement.camera: tuple(map(sub, measurement.s, measurement.goal))
            for measurement in measurements
        }
    )


class MedianEstimator(object):
    """Estimator of measurements: frames of an arm that stands until they are enough; their median.

    Args:
        tolerance: px.
        rows: Rows that count.
    """

    def __init__(self, tolerance, rows):
        # type: (float, Rows) -> None
        self._sigmas = {}  # type: Dict[str, float]
        self._tolerance = tolerance
        self._rows = rows

    def sigma_of(self, camera):
        # type: (str) -> float
        """Return the noise of a frame of a camera, px."""
        return self._sigmas.get(camera, FIRST_SIGMA)

    @property
    def sigma(self):
        # type: () -> float
        """Noise of a frame of the noisiest camera, px."""
        return max(self._sigmas.values()) if self._sigmas else FIRST_SIGMA

    def glance(self, frames):
        # type: (Frames) -> Optional[List[Measurement]]
        """Return [Measurement] by the first frames; None while they are too few.

        Args:
            frames: as for `measurements`.
        """
        if min(map(len, frames.values())) < GLANCE_FRAMES:
            return None
        glances = []
        for camera in sorted(frames):
            seen = frames[camera]
            s = tuple([median(column) for column in zip(*[s for _, s, _ in seen])])
            variance = MEDIAN_VARIANCE * max(self.sigma_of(camera), MIN_SIGMA) ** 2 / len(seen)
            glances.append(Measurement(camera, s, seen[-1][2], variance, len(seen)))
        return glances

    def measurements(self, frames):
        # type: (Frames) -> Optional[List[Measurement]]
        """Return [Measurement], or None while more frames are needed.

        Args:
            frames: {camera: [(t, s, goal)]} in order of time, all since the arm stands.
        """
        if not frames or min(len(seen) for seen in frames.values()) < MIN_FRAMES:
            return None
        measurements, spreads = [], {}  # type: List[Measurement], Dict[str, float]
        scattered = False
        for camera in sorted(frames):
            s, spread, inliers = robust_mean([s for _, s, _ in frames[camera]])
            usual = self.sigma_of(camera)
            variance = MEDIAN_VARIANCE * max(usual, MIN_SIGMA) ** 2 / inliers
            measurements.append(
                Measurement(camera, s, frames[camera][-1][2], variance, len(frames[camera]))
            )
            spreads[camera] = min(max(spread, MIN_SIGMA), MAX_SCATTER * usual)
            scattered = scattered or spread > MAX_SCATTER * usual
        off = length(error_of(measurements, self._rows))
        enough = min(measurement.frames for measurement in measurements) >= MAX_FRAMES
        doubtful = abs(off - self._tolerance) < 2 * math.sqrt(sum(v.variance for v in measurements))
        if (doubtful or scattered) and not enough:
            return None
        for camera in spreads:
            usual = self.sigma_of(camera)
            self._sigmas[camera] = usual + 0.3 * (spreads[camera] - usual)
        return measurements


class ReportEstimator(object):
    """The report's estimator: 20 points over 2 s, their mean; with `robust` their median.

    Args:
        robust: take the median.
    """

    POINTS, PERIOD = 20, 0.1
    """Number of points of a measurement, and the period between two, s."""

    def __init__(self, robust=False):
        # type: (bool) -> None
        self.sigma = FIRST_SIGMA
        self._robust = robust

    def measurements(self, frames):
        # type: (Frames) -> Optional[List[Measurement]]
        """Return what MedianEstimator.measurements does."""
        measurements = []
        for camera in sorted(frames):
            points, due = [], None  # type: List[Features], Optional[float]
            for t, s, _ in frames[camera]:
                if due is None or t >= due - 1e-6:
                    points.append(s)
                    due = t + self.PERIOD if due is None else due + self.PERIOD
            if len(points) < self.POINTS:
                return None
            columns = list(zip(*points))
            s = [median(c) if self._robust else sum(c) / len(c) for c in columns]
            measurements.append(
                Measurement(camera, tuple(s), frames[camera][-1][2], 0.1, len(points))
            )
        return measurements or None
