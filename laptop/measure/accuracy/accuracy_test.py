"""The test as a whole: the arm does its parts, cameras look, and all criteria come of it.

What a camera saw and what truly was (where somebody knows) go through the same formulas.
"""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from laptop.measure.accuracy import criteria
from laptop.measure.accuracy.crossings import Crossings, crossings, stations
from laptop.measure.accuracy.plan import (
    DISTANCE_POSES,
    MULTIDIRECTIONAL_POSES,
    SPEED_SHARES,
    AccuracyPlan,
    PlannedMotion,
)
from laptop.measure.accuracy.sighting import (
    ArmSighting,
    BoardArmPose,
    Places,
    SeenMarker,
    without_common_error,
)
from laptop.measure.run_data import BadMeasurement, MeasuringRig, RunData

PLANE_COUNTS = {"line": 20, "circle": 36}
"""Number of planes across each path."""
MONTE_CARLO_DRAWS = 200
"""Number of Monte Carlo draws of noise and calibration."""
SEED = 1
MIN_SEEN_CYCLES = 0.5
"""Least share of the cycles in which each pose and plane must be seen."""


class HiddenMarker(BadMeasurement):
    """A marker that was not seen where it had to be."""


@dataclass(frozen=True, eq=False)
class Attained:
    """Attained positions of one pose, or of where one path crosses its planes.

    values     (planes, cycles, d), cm; of a pose there is one plane
    noise      covariance of a single value, its mean over the cycles, (planes, d, d), cm^2
    common     derivatives of the barycentre by what all have in common, (planes, d, c), cm
    commanded  (planes, d), cm; of a path 0
    at         where the planes are along the path, (planes,), cm
    """

    values: np.ndarray
    noise: np.ndarray
    common: np.ndarray
    commanded: np.ndarray
    at: np.ndarray = field(default_factory=lambda: np.zeros(1))


Observed = dict[str, Attained]
"""Attained places by name: "P1" to "P5", "P1 from 0" and so on, "line 100 %" and so on."""


@dataclass(frozen=True)
class Criterion:
    """One figure of the report.

    name    such as "AP P1"
    mm      its value
    u_mm    standard uncertainty of that by the camera alone
    """

    name: str
    mm: float
    u_mm: float = 0.0


@dataclass(frozen=True, eq=False)
class AccuracyResult:
    """Result of a test.

    plan      what was done
    observed  as seen, the camera's noise still in it
    criteria  its figures, without that noise
    arm_pose  how the arm stands on the board
    is_fitted whether that was fitted to the poses, so that AP is too good
    sigma     noise of one picture by camera, px
    noise_mm  of one picture's place, and of a rest's, standard deviation along one axis, mm
    seconds   that the arm was at it
    """

    plan: AccuracyPlan
    observed: Observed
    criteria: tuple[Criterion, ...]
    arm_pose: BoardArmPose
    is_fitted: bool
    sigma: Mapping[str, float]
    noise_mm: tuple[float, float]
    seconds: float


def measure(
    rig: MeasuringRig,
    plan: AccuracyPlan,
    sighting: ArmSighting,
    arm_pose: BoardArmPose | None = None,
    on_part: Callable[[str, int, int], None] = lambda part, number, count: None,
    on_run: Callable[[list[PlannedMotion], RunData], None] = lambda motions, run: None,
) -> AccuracyResult:
    """Do the whole test.

    Args:
        rig: the arm and its cameras.
        plan: what is to be done.
        sighting: the cameras, calibrated.
        arm_pose: how the arm stands on the board; None: it is fitted to where the poses were seen.
        on_part: called with each part's name, number and how many there are, before it begins.
        on_run: called with the motions and the run of each part, done.

    Raises:
        HiddenMarker: too little was seen.
        ArmError: of the rig: nothing is measured.
    """
    seconds = plan.seconds()  # before anything moves: all of it can be had
    runs = _done(rig, plan, on_part, on_run)
    pose_motions, pose_run = runs[0]
    sigma = sighting.sigma(pose_run)
    rested = sighting.at_rest(pose_run, sigma)
    _check_rests(pose_motions, rested.places.points)
    is_fitted = arm_pose is None
    if arm_pose is None:
        arm_pose = sighting.arm_pose(rested, np.array([m.points[-1] for m in pose_motions]))
    fitted_at = sighting.tip(rested, arm_pose)
    tips = _Tips(sighting, sigma, arm_pose, fitted_at if is_fitted else None)
    seen_motions = [seen for motions, run in runs for seen in tips.of(motions, run)]
    observed = collect(plan, seen_motions)
    return AccuracyResult(
        plan,
        observed,
        tuple(with_uncertainty(plan, observed)),
        arm_pose,
        is_fitted,
        sigma,
        (
            _axis_mm([p for m, p in seen_motions if m.what == "path"]),
            _axis_mm([fitted_at]),
        ),
        seconds,
    )


def _done(
    rig: MeasuringRig,
    plan: AccuracyPlan,
    on_part: Callable[[str, int, int], None],
    on_run: Callable[[list[PlannedMotion], RunData], None],
) -> list[tuple[list[PlannedMotion], RunData]]:
    """Let the arm do all parts; return the motions and the run of each, the poses first."""
    runs = []
    parts = plan.parts()
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "accuracy.job"
        for number, (name, motions) in enumerate(parts.items(), 1):
            on_part(name, number, len(parts))
            plan.write_job(file, name, motions)
            run = rig.measure(file)
            on_run(motions, run)
            runs.append((motions, run))
    return runs


@dataclass(frozen=True, eq=False)
class _Tips:
    """Finds where the tip was.

    sighting   the cameras
    sigma      noise of one picture by camera, px
    arm_pose   how the arm stands on the board
    fitted_at  where the tip was at the poses to which that was fitted; None: it was given
    """

    sighting: ArmSighting
    sigma: Mapping[str, float]
    arm_pose: BoardArmPose
    fitted_at: Places | None

    def of(
        self, motions: Sequence[PlannedMotion], run: RunData
    ) -> Iterator[tuple[PlannedMotion, Places]]:
        """Yield each motion of a run with the tip's places, see `collect`."""
        if motions[0].what == "path":
            seen = self.sighting.along_strokes(run, self.sigma)
            places = [self._tip(one) for one in seen]
        else:
            rested = self.sighting.at_rest(run, self.sigma)
            _check_rests(motions, rested.places.points)
            tips = self._tip(rested)
            places = [tips.at(slice(k, k + 1)) for k in range(len(motions))]
        yield from zip(motions, places, strict=True)

    def _tip(self, seen: SeenMarker) -> Places:
        places = self.sighting.tip(seen, self.arm_pose)
        return places if self.fitted_at is None else without_common_error(places, self.fitted_at)


def _axis_mm(places: Sequence[Places]) -> float:
    """Return the noise's standard deviation along an axis, in the mean, mm."""
    noise = np.concatenate([one.noise for one in places])
    variances = np.trace(noise, axis1=1, axis2=2) / noise.shape[1]
    return float(criteria.MM * np.sqrt(np.nanmean(variances)))


def _check_rests(motions: Sequence[PlannedMotion], points: np.ndarray) -> None:
    if len(points) != len(motions):
        raise BadMeasurement(
            f"the arm rested {len(points)} times and not {len(motions)} times; do the test again"
        )


def collect(plan: AccuracyPlan, seen_motions: Sequence[tuple[PlannedMotion, Places]]) -> Observed:
    """Put what was seen of each motion in the order of poses, directions and paths.

    Args:
        plan: of the test.
        seen_motions: each motion with the tip's places: one at its end, or many along a path.

    Raises:
        HiddenMarker: too little was seen of one.
    """
    groups: dict[str, list[Places]] = {}
    motions: dict[str, PlannedMotion] = {}
    for motion, places in seen_motions:
        name = _name(plan, motion)
        groups.setdefault(name, []).append(places)
        motions[name] = motion
    # A cycle in which one pose was hidden does not count for the others: their distances would not.
    poses = [_points(groups[f"P{number}"]) for number in range(1, 6)]
    complete = np.all([np.isfinite(points).all(axis=1) for points in poses], axis=0)
    observed = {}
    for name, cycles in groups.items():
        motion = motions[name]
        if motion.what == "path":
            observed[name] = _of_path(plan, name, motion, cycles)
        elif motion.what == "pose":
            observed[name] = _of_pose(name, plan.pose(motion.number), cycles, complete)
        else:
            finite = np.isfinite(_points(cycles)).all(axis=1)
            observed[name] = _of_pose(name, plan.pose(motion.pose), cycles, finite)
    return observed


def _points(cycles: Sequence[Places]) -> np.ndarray:
    return np.concatenate([one.points for one in cycles])


def _name(plan: AccuracyPlan, motion: PlannedMotion) -> str:
    if motion.what == "pose":
        return f"P{motion.number}"
    if motion.what == "direction":
        return f"P{motion.pose} from {motion.number}"
    return f"{list(plan.paths)[motion.number]} {100 * motion.share:.0f} %"


def _of_pose(
    name: str, commanded: np.ndarray, cycles: Sequence[Places], finite: np.ndarray
) -> Attained:
    _check_seen(name, int(finite.sum()), len(finite))
    noise = np.concatenate([one.noise for one in cycles])[finite]
    common = np.concatenate([one.common for one in cycles])[finite]
    return Attained(
        _points(cycles)[finite][None],
        noise.mean(axis=0)[None],
        common.mean(axis=0)[None],
        commanded[None],
    )


def _of_path(
    plan: AccuracyPlan, name: str, motion: PlannedMotion, cycles: Sequence[Places]
) -> Attained:
    kind = list(plan.paths)[motion.number]
    path, planes = plan.paths[kind], PLANE_COUNTS[kind]
    found: list[Crossings] = [crossings(path, planes, *one) for one in cycles]
    values = np.stack([one.values for one in found], axis=1)
    finite = np.isfinite(values).all(axis=2)
    seen = finite.sum(axis=1)
    worst = int(seen.argmin())
    _check_seen(f"plane {worst + 1} of the {name}", int(seen[worst]), len(cycles))
    # As many cycles of each plane: the first ones that were seen there.
    first = np.argsort(~finite, axis=1, kind="stable")[:, : seen[worst]]
    rows = np.arange(planes)[:, None]
    noise, common = (
        np.stack([one[k] for one in found], axis=1)[rows, first].mean(axis=1) for k in (1, 2)
    )
    return Attained(
        values[rows, first],
        noise,
        common,
        np.zeros((planes, values.shape[2])),
        stations(path, planes),
    )


def _check_seen(name: str, seen: int, cycles: int) -> None:
    least = max(criteria.MIN_CYCLES, MIN_SEEN_CYCLES * cycles)
    if seen < least:
        raise HiddenMarker(
            f"{name}: the marker was seen in {seen} of {cycles} cycles; the camera must see all of "
            "the test's cube, and nothing may hide the marker: look at its picture, or give --at "
            "or --size"
        )


# Criteria


def evaluate(plan: AccuracyPlan, observed: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Return all criteria by name, mm, each of the leading shape.

    Args:
        plan: of the test.
        observed: values (..., planes, cycles, d) by name, see Attained.
    """
    out: dict[str, np.ndarray] = {}
    poses = {number: observed[f"P{number}"][..., 0, :, :] for number in range(1, 6)}
    for number, values in poses.items():
        out[f"AP P{number}"] = criteria.pose_accuracy(values, plan.pose(number))
    for number, values in poses.items():
        out[f"RP P{number}"] = criteria.pose_repeatability(values)
    for number in MULTIDIRECTIONAL_POSES:
        means = [
            observed[f"P{number} from {k}"][..., 0, :, :].mean(axis=-2)
            for k in range(len(plan.directions))
        ]
        out[f"vAP P{number}"] = criteria.direction_variation(np.stack(means, axis=-2))
    one, other = DISTANCE_POSES
    distance = float(np.linalg.norm(plan.pose(one) - plan.pose(other)))
    ad, rd = criteria.distance_accuracy(poses[one], poses[other], distance)
    out[f"AD P{one} P{other}"], out[f"RD P{one} P{other}"] = ad, rd
    for kind in plan.paths:
        for share in SPEED_SHARES:
            name = f"{kind} {100 * share:.0f} %"
            out[f"AT {name}"] = criteria.path_accuracy(observed[name])
            out[f"RT {name}"] = criteria.path_repeatability(observed[name])
    return out


def plain(plan: AccuracyPlan, observed: Observed) -> dict[str, float]:
    """Return all criteria of values that are known without noise, mm."""
    values = {name: one.values for name, one in observed.items()}
    return {name: float(mm) for name, mm in evaluate(plan, values).items()}


def with_uncertainty(
    plan: AccuracyPlan, observed: Observed, draws: int = MONTE_CARLO_DRAWS, seed: int = SEED
) -> Iterator[Criterion]:
    """Yield all criteria without the camera's noise, and how unsure that leaves them.

    The test is drawn anew as often: from the positions found, with new noise and new errors of the
    calibration, and goes the same way (JCGM 101, with the positions found for the true ones).
    """
    rng = np.random.default_rng(seed)
    sizes = {one.common.shape[2] for one in observed.values()}
    z = rng.standard_normal((draws, max(sizes, default=0)))
    found, again = {}, {}
    for name, one in observed.items():
        found[name] = criteria.without_noise(one.values, one.noise)
        root = np.linalg.cholesky(one.noise + 1e-18 * np.eye(one.noise.shape[-1]))
        noisy = rng.standard_normal((draws, *one.values.shape)) @ np.swapaxes(root, -1, -2)
        shifted = np.einsum("pdc,kc->kpd", one.common, z[:, : one.common.shape[2]])
        anew = found[name] + noisy + shifted[:, :, None, :]
        again[name] = criteria.without_noise(anew, one.noise)
    values, spread = evaluate(plan, found), evaluate(plan, again)
    for name, mm in values.items():
        # (Of how far a criterion is off, not only of how it scatters.)
        u = float(np.sqrt(((spread[name] - mm) ** 2).mean()))
        yield Criterion(name, float(mm), u)
