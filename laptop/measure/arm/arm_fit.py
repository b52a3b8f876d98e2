"""From rests of an arm before calibrated cameras to its numbers, and how sure each is.

Least squares with the soft L1 loss, by scipy, over everything at once: the arm's numbers, its place
on the board and the cameras, each with its prior.  What a rest tells is whitened by the noise of
the picture and by what an encoder leaves open, half a count to each side, seen through the arm.
The covariance is that of an M-estimator (P. J. Huber, Robust Statistics, 1981, section 7.6).
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.optimize import least_squares

from laptop.measure.arm.arm_model import (
    SIGNS,
    ArmModel,
    JointStates,
    encoder_sigma,
    running_on,
    slopes,
)
from shared.arm_description import ArmError

LOSS_SCALE = 2.0
"""Scale of the robust loss: residuals beyond it count less, standard deviations."""
DERIVATIVE_STEP = 1e-4
"""Step of numerical derivatives, in standard deviations of the prior."""
BOUND_MARGIN = 1e-6
"""Distance from the bounds at which a fit begins, standard deviations of the prior."""
NOISE_PASSES = 3
"""Number of times that the noise is mapped through the fitted arm anew."""
PLACING_ERROR = 0.03
"""Error with which a hand sets a pen on a cross, cm (standard deviation)."""
MIN_PIXEL_ERROR = 0.1
"""Least error of a marker's place, px."""
MIN_GEAR_SIGMAS = 3.0
"""Least deviation of a gear from its description that is reported, standard deviations, ..."""
MIN_GEAR_CHANGE = 0.004
"""... and as a share of it."""


class BadIdentification(ArmError, ValueError):
    """Error: the arm's numbers cannot be identified from what was seen."""


@dataclass(frozen=True, eq=False)
class RestSights:
    """Rests of the arm, in the order of time.

    joint_states  how the joints stood
    pixels        of the marker by camera, (n, 2); nan where it was not seen
    sigma         of each of these numbers by camera, px, (n,)
    """

    joint_states: JointStates
    pixels: Mapping[str, np.ndarray]
    sigma: Mapping[str, np.ndarray]

    def __add__(self, other: RestSights) -> RestSights:
        """Return all rests of both."""
        return RestSights(
            JointStates(
                *map(np.concatenate, zip(self.joint_states, other.joint_states, strict=True))
            ),
            {name: np.concatenate([self.pixels[name], other.pixels[name]]) for name in self.pixels},
            {name: np.concatenate([self.sigma[name], other.sigma[name]]) for name in self.sigma},
        )


@dataclass(frozen=True)
class TouchSight:
    """The pen stood on a cross, held by hand, while a camera looked.

    cross  on the board, (x, y), cm
    pixel  of the marker
    sigma  of that, px
    """

    cross: tuple[float, float]
    pixel: tuple[float, float]
    sigma: float = 0.3
    camera: str = "A"


@dataclass(frozen=True, eq=False)
class ArmFit:
    """An arm's numbers.

    model       that was fitted
    state       all numbers, (m,)
    covariance  (m, m); 0 of what was not fitted
    residuals   whitened, by camera, (n, 2), nan where nothing was seen
    noise       what is left over, in standard deviations of what was expected: 1 if all fits
    slopes      derivatives of the whitened residuals by the numbers, by camera, (n, 2, m)
    by_joints   derivatives of the pixels by the encoders' angles, whitened, (n, 2, joints)
    whiteners   by which a camera's px become standard deviations, (n, 2, 2)
    rms         of what is left over, px
    """

    model: ArmModel
    state: np.ndarray
    covariance: np.ndarray
    residuals: dict[str, np.ndarray]
    noise: float
    slopes: dict[str, np.ndarray]
    by_joints: dict[str, np.ndarray]
    whiteners: dict[str, np.ndarray]
    rms: float

    def value(self, name: str) -> float:
        """Return a number, cm or rad."""
        return float(self.state[self.model.index(name)])

    def sigma(self, name: str) -> float:
        """Return its standard uncertainty, cm or rad."""
        k = self.model.index(name)
        return float(math.sqrt(max(self.covariance[k, k], 0.0)))


@dataclass(frozen=True, eq=False)
class _ArmProblem:
    """The residuals of one model, in standard deviations."""

    model: ArmModel
    rests: RestSights
    touches: Sequence[TouchSight]
    free: np.ndarray
    elbows: Sequence[int] = ()
    whiteners: dict[str, np.ndarray] = field(default_factory=dict)

    def full(self, x: np.ndarray) -> np.ndarray:
        """Return all numbers from the free ones in standard deviations of their priors."""
        state = self.model.mean.copy()
        state[self.free] += x * self.model.spread[self.free]
        return state

    def pixels(self, state: np.ndarray) -> dict[str, np.ndarray]:
        """Return what the cameras should see, rests and then touches, by camera."""
        found = {}
        for name in self.model.cameras:
            seen = self.model.pixels(state, name, self.rests.joint_states)
            crosses, elbows = self.touching(name)
            if len(crosses):
                touched = self.model.touched(state, name, crosses, elbows)
                seen = np.concatenate([seen, touched])
            found[name] = seen
        return found

    def touching(self, name: str) -> tuple[np.ndarray, np.ndarray]:
        """Return the crosses that one camera saw touched, (n, 2), cm, and how the elbow bent."""
        touched = [k for k, touch in enumerate(self.touches) if touch.camera == name]
        crosses = np.array([self.touches[k].cross for k in touched]).reshape(-1, 2)
        return crosses, np.array([self.elbows[k] for k in touched])

    def seen(self, name: str) -> np.ndarray:
        """Return what a camera saw, rests and then touches, (n, 2)."""
        touched = [touch.pixel for touch in self.touches if touch.camera == name]
        return np.concatenate([self.rests.pixels[name], np.array(touched).reshape(-1, 2)])

    def residuals(self, x: np.ndarray) -> np.ndarray:
        """Return the whitened residuals, then the priors' own."""
        state = self.full(x)
        parts = [x]
        for name, pixels in self.pixels(state).items():
            errors = pixels - self.seen(name)
            finite = np.isfinite(errors).all(axis=1)
            white = np.einsum("nij,nj->ni", self.whiteners[name][finite], errors[finite])
            parts.append(white.ravel())
        return np.concatenate(parts)

    def whitened(self, x: np.ndarray) -> _ArmProblem:
        """Return it with the noise as it is seen through the arm there."""
        state = self.full(x)
        sigma_e = encoder_sigma(self.model.arm)
        whiteners = {}
        for name in self.model.cameras:
            seen_by_e = self.model.by_encoders(state, name, self.rests.joint_states) * sigma_e
            sigma = np.maximum(self.rests.sigma[name], MIN_PIXEL_ERROR)
            noise = seen_by_e @ seen_by_e.transpose(0, 2, 1)
            noise += sigma[:, None, None] ** 2 * np.eye(2)
            touched = [touch for touch in self.touches if touch.camera == name]
            if touched:
                placing = self._placing(state, name)
                own = np.array([touch.sigma for touch in touched])[:, None, None] ** 2 * np.eye(2)
                noise = np.concatenate([noise, own + placing @ placing.transpose(0, 2, 1)])
            whiteners[name] = np.linalg.inv(np.linalg.cholesky(noise))
        return replace(self, whiteners=whiteners)

    def _placing(self, state: np.ndarray, name: str) -> np.ndarray:
        """Return by how many px the marker is beside where it is if the pen were on the cross."""
        crosses, elbows = self.touching(name)
        columns = []
        for unit in PLACING_ERROR * np.eye(2):
            ends = [
                self.model.touched(state, name, crosses + sign * unit, elbows) for sign in SIGNS
            ]
            columns.append((ends[0] - ends[1]) / 2)
        return np.stack(columns, axis=-1)


def first_guess(model: ArmModel, rests: RestSights) -> tuple[ArmModel, np.ndarray]:
    """Return the model with its joints' signs, and its numbers to begin with.

    Seen from above the marker is linear in three complex numbers: the base, and the two links
    turned by board and zeros.  So nothing needs to be known of where the arm stands.

    Raises:
        BadIdentification: too little was seen.
    """
    name = min(model.cameras)
    pixels = rests.pixels[name]
    seen = np.isfinite(pixels).all(axis=1)
    if seen.sum() < 6:
        raise BadIdentification(
            f"the marker was seen in {seen.sum()} of {len(seen)} poses, and 6 are the least: "
            "let the camera see all that the arm can reach, sharp and lit"
        )
    if model.spatial:
        return _first_in_space(model, rests)
    camera = model.cameras[name].model(np.zeros(14))
    height = model.mean[model.index("marker.height")]
    places = camera.to_table(pixels[seen], height) @ np.array([1, 1j])
    finite = np.isfinite(places)
    e, places = rests.joint_states.e[seen][finite], places[finite]
    best, least = None, math.inf
    for signs in itertools.product(SIGNS, repeat=e.shape[1]):
        turned = np.cumsum(e * signs, axis=1)
        design = np.column_stack([np.ones(len(e)), np.exp(1j * turned)])
        found, *_ = np.linalg.lstsq(design, places, rcond=None)
        rms = float(np.sqrt(np.mean(np.abs(design @ found - places) ** 2)))
        if rms < least:
            best, least = (signs, found), rms
    assert best is not None
    signs, (base, upper, fore) = best
    state = model.mean.copy()
    turn = model.mean[model.index("board.turn")] if model.known.square is not None else None
    first = float(np.angle(upper))
    zero = 0.0 if turn is None else math.remainder(first - turn, 2 * math.pi)
    for key, value in (
        ("board.x", base.real), ("board.y", base.imag), ("board.turn", first - zero),
        (f"{model.arm.joints[0].name}.link", abs(upper)),
        (f"{model.arm.joints[0].name}.zero", zero),
        (f"{model.arm.joints[1].name}.link", abs(fore) - state[model.index("marker.along")]),
        (f"{model.arm.joints[1].name}.zero", float(np.angle(fore / upper))),
    ):  # fmt: skip
        state[model.index(key)] = value
    return replace(model, signs=signs), state


def _first_in_space(model: ArmModel, rests: RestSights) -> tuple[ArmModel, np.ndarray]:
    """Try how the arm is turned on the board; its place follows by a few steps of the fit."""
    best, least = None, math.inf
    place = [model.index(f"board.{key}") for key in ("turn", "x", "y")]
    for quarter in range(8):
        start = model.mean.copy()
        start[place[0]] = math.pi / 4 * quarter

        def errors(x: np.ndarray, start: np.ndarray = start) -> np.ndarray:
            state = start.copy()
            state[place] = x
            parts = [
                model.pixels(state, name, rests.joint_states) - rests.pixels[name]
                for name in model.cameras
            ]
            flat = np.concatenate(parts).ravel()
            return flat[np.isfinite(flat)]

        found = least_squares(
            errors, start[place], loss="soft_l1", f_scale=20.0, x_scale=[0.1, 1, 1]
        )
        rms = float(np.sqrt(np.mean(found.fun**2)))
        if rms < least:
            state = start.copy()
            state[place] = found.x
            # A turn more is the same place, and far from what is known of it.
            middle = model.mean[place[0]]
            state[place[0]] = middle + math.remainder(found.x[0] - middle, 2 * math.pi)
            best, least = state, rms
    assert best is not None
    return model, best


def fit_arm(model: ArmModel, rests: RestSights, touches: Sequence[TouchSight] = ()) -> ArmFit:
    """Fit an arm's numbers; a gear that is as described is taken for that.

    Raises:
        BadIdentification: too little was seen.
    """
    model = replace(model, run_on=running_on(model.arm, rests.joint_states))
    model, state = first_guess(model, rests)
    fit = _fitted(model, state, rests)
    elbows = bent_at(fit, touches)
    for _ in range(NOISE_PASSES if touches else 0):
        fit = _fitted(model, fit.state, rests, touches, elbows)
        before, elbows = elbows, nearer_elbows(fit, touches)
        if elbows == before:
            break
    keys = [f"{joint.name}.gear" for joint in model.arm.joints]
    as_described = [
        key
        for key in keys
        if abs(fit.value(key) - 1) < max(MIN_GEAR_SIGMAS * fit.sigma(key), MIN_GEAR_CHANGE)
    ]
    if not as_described:
        return fit
    state = fit.state.copy()
    for key in as_described:
        state[model.index(key)] = 1.0
    return _fitted(model, state, rests, touches, elbows, as_described)


def bent_at(fit: ArmFit, touches: Sequence[TouchSight]) -> list[int]:
    """Return the sign of the elbow's angle at each touch.

    Where the marker is, it can be by an elbow bent either way, and each has the pen on another
    side of it.  On the last link it is at one place: those signs are right by which all touches
    agree most on it.

    Raises:
        BadIdentification: a marker was seen where no arm can have it.
    """
    if not touches:
        return []
    model, state = fit.model, fit.state
    upper, fore = model.of_joints(state, "link")
    last = complex(fore + fit.value("marker.along"), fit.value("marker.aside"))
    base, turn = complex(fit.value("board.x"), fit.value("board.y")), fit.value("board.turn")
    offsets = []
    for touch in touches:
        camera = model.cameras[touch.camera].model(model.camera_numbers(state, touch.camera))
        seen = camera.to_table(np.array([touch.pixel]), fit.value("marker.height"))[0]
        if not np.isfinite(seen).all():
            raise BadIdentification(
                "at the cross {:g}, {:g} cm the marker was seen where no table is; touch it "
                "anew".format(*touch.cross)
            )
        place = (complex(*seen) - base) * np.exp(-1j * turn)
        away = (complex(*touch.cross) - base) * np.exp(-1j * turn) - place
        cosine = (abs(place) ** 2 - upper**2 - abs(last) ** 2) / (2 * upper * abs(last))
        bend = math.acos(min(max(cosine, -1.0), 1.0))
        both = []
        for sign in SIGNS:
            inside = math.atan2(
                abs(last) * math.sin(sign * bend), upper + abs(last) * math.cos(bend)
            )
            heading = np.angle(place) - inside + sign * bend - np.angle(last)
            both.append(-away * np.exp(-1j * heading))
        offsets.append(both)
    combos = list(itertools.product(range(2), repeat=len(touches)))
    chosen = np.array(
        [[both[k] for both, k in zip(offsets, combo, strict=True)] for combo in combos]
    )
    spread = np.abs(
        chosen
        - np.median(chosen.real, axis=1, keepdims=True)
        - 1j * np.median(chosen.imag, axis=1, keepdims=True)
    ).sum(axis=1)
    return [SIGNS[k] for k in combos[int(np.argmin(spread))]]


def nearer_elbows(fit: ArmFit, touches: Sequence[TouchSight]) -> list[int]:
    """Return the sign of the elbow's angle at each touch by which a fit is nearer to its sight."""
    found = []
    for touch in touches:
        errors = [
            fit.model.touched(fit.state, touch.camera, np.array([touch.cross]), np.array([sign]))[0]
            - touch.pixel
            for sign in SIGNS
        ]
        found.append(SIGNS[int(np.argmin(np.linalg.norm(errors, axis=1)))])
    return found


def _fitted(
    model: ArmModel,
    state: np.ndarray,
    rests: RestSights,
    touches: Sequence[TouchSight] = (),
    elbows: Sequence[int] = (),
    fixed: Sequence[str] = (),
) -> ArmFit:
    free = model.spread > 0
    free[[model.index(name) for name in fixed]] = False
    problem = _ArmProblem(model, rests, touches, free, elbows)
    x = ((state - model.mean) / np.where(free, model.spread, 1.0))[free]
    least = model.least()[free]
    x = np.maximum(x, least + BOUND_MARGIN)
    for _ in range(NOISE_PASSES):
        problem = problem.whitened(x)
        found = least_squares(
            problem.residuals,
            x,
            bounds=(least, np.inf),
            loss="soft_l1",
            f_scale=LOSS_SCALE,
            x_scale="jac",
            max_nfev=60,
        )
        x = found.x
    return _fit_result(problem, x)


def _fit_result(problem: _ArmProblem, x: np.ndarray) -> ArmFit:
    """Return the fit with its covariance and residuals."""
    model, free = problem.model, problem.free
    m = len(x)
    all_residuals = problem.residuals(x)
    jacobian = slopes(problem.residuals, x, np.full(m, DERIVATIVE_STEP) / _stiffness(model, free))
    data, own = all_residuals[m:], jacobian[m:]
    # psi and its derivative of the soft L1 loss.
    bent = 1 + (data / LOSS_SCALE) ** 2
    psi, slope = data / np.sqrt(bent), bent**-1.5
    # What the priors do not tell, the data must: so many numbers were fitted to them.
    information = own.T @ own
    used = float(np.trace(np.linalg.solve(information + np.eye(m), information)))
    noise2 = float((psi**2).sum() / max(len(data) - used, 1.0) / slope.mean() ** 2)
    # What fits better than it should was lucky, no surer.
    covariance = np.linalg.inv(information / max(noise2, 1.0) + np.eye(m))
    scales = model.spread[free]
    full = np.zeros((len(model.names),) * 2)
    full[np.ix_(free, free)] = covariance * np.outer(scales, scales)
    state = problem.full(x)
    residuals, derivatives, by_joints, squares = {}, {}, {}, []
    whiteners, at = {}, 0
    for name, pixels in problem.pixels(state).items():
        errors = pixels - problem.seen(name)
        finite = np.isfinite(errors).all(axis=1)
        squares.append(errors[finite][: finite[: len(problem.rests.joint_states.e)].sum()] ** 2)
        count = 2 * int(finite.sum())
        white = np.full(errors.shape, np.nan)
        white[finite] = data[at : at + count].reshape(-1, 2)
        row = np.zeros((*errors.shape, m))
        row[finite] = own[at : at + count].reshape(-1, 2, m)
        n = len(problem.rests.joint_states.e)
        residuals[name], derivatives[name] = white[:n], row[:n]
        by_joints[name] = problem.whiteners[name][:n] @ model.by_encoders(
            state, name, problem.rests.joint_states
        )
        whiteners[name] = problem.whiteners[name][:n]
        at += count
    rms = float(np.sqrt(np.mean(np.concatenate(squares)) * 2))
    return ArmFit(
        model,
        state,
        full,
        residuals,
        math.sqrt(noise2),
        derivatives,
        by_joints,
        whiteners,
        rms,
    )


def _stiffness(model: ArmModel, free: np.ndarray) -> np.ndarray:
    """Divisors of the step by which nothing is moved too far: of wide priors, many."""
    return np.maximum(1.0, model.spread[free] / 0.05)
