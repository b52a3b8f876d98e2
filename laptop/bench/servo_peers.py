"""Laws beside ours: the literature's, and two that know more than any camera tells.

A law of the literature is as its paper has it, one sensible gain, untuned.  It measures as ours
does; its computing is not charged, and it has neither restarts nor a verification of the tip.
"""

from __future__ import annotations

import math
import pkgutil
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np

from laptop.bench.servo_scenarios import PEERS
from laptop.bench.servo_setups import PinholeCamera, PinholeCameras
from laptop.emulator.device.brick import EmulatedBrick
from robot.servoing.decision import Decision, end_of_run
from robot.servoing.exploration import EXPLORING_STEP
from robot.servoing.image_model import LinearImageModel, straight
from robot.servoing.measurement import Measurement, MedianEstimator, error_of
from robot.servoing.report_servo import LookThenMoveServo
from robot.servoing.rows import Rows
from shared.arm_description import Arm
from shared.verdicts import CONVERGED

DAMPING = 0.05
"""Damping of the least-squares step, as a share of J's greatest singular value."""

FORGETTING = 0.9
"""Forgetting factor of recursive least squares: the past's weight after each step."""

FIRST_SIGMA, CHANGE_SIGMA, IMAGE_SIGMA = 100.0, 30.0, 1.0
"""Standard deviations of the Kalman filter: of an element of the explored J and its change in a
step, px/rad; of a measured step, px."""


class TrueJacobian:
    """Model of an oracle: J at the true pose, by the interface of robot.servoing's models.

    Args:
        camera: that sees the tip.
        brick: whose true pose counts.
    """

    def __init__(self, camera: PinholeCamera, brick: EmulatedBrick) -> None:
        self._camera, self._brick = camera, brick

    def observe(self, q: Any, s: Any, variance: float, standing: bool = True) -> None:
        """Learn nothing."""

    def prepare(self, q: Any, s: Any, variance: float) -> Iterator[None]:
        """Learn nothing."""
        return iter(())

    def seen_from(self, q: Sequence[float], s: Sequence[float]) -> LinearImageModel:
        """Return the linear model at the true pose; elsewhere it does not hold."""
        jacobian = self._camera.jacobian(self._brick.plant.q)
        offset = [
            y - sum(a * b for a, b in zip(row, q, strict=True))
            for y, row in zip(s, jacobian, strict=True)
        ]
        return straight(jacobian, offset)

    def refit(self) -> Iterator[None]:
        """Fit nothing."""
        return iter(())

    def shape(self) -> Any:
        """Return the same model without its place in the image."""
        return straight(self._camera.jacobian(self._brick.plant.q))

    def covariance(self) -> list[list[float]]:
        """Return zeros, as there is no uncertainty."""
        n = len(self._brick.plant.q)
        return [[0.0] * n for _ in range(n)]

    def inflate_variances(self) -> None:
        """Do nothing, as there is no uncertainty."""


Array = np.ndarray
Update = Callable[[Array, Array, Array, Array], tuple[Array, Array]]
"""An update: (J, P, dq, ds) -> (J, P), P the covariance of each row of J."""


def broyden(J: Array, P: Array, dq: Array, ds: Array) -> tuple[Array, Array]:
    """Return Broyden's update of J (1965), as Jagersand et al. (1997) servo by it."""
    return J + np.outer(ds - J @ dq, dq) / (dq @ dq), P


def kalman(J: Array, P: Array, dq: Array, ds: Array) -> tuple[Array, Array]:
    """Return the Kalman filter's update of J as a state that walks at random (Qian and Su 2002)."""
    P = P + CHANGE_SIGMA**2 * np.eye(len(P))
    gain = P @ dq / (dq @ P @ dq + 2 * IMAGE_SIGMA**2)
    return J + np.outer(ds - J @ dq, gain), P - np.outer(gain, dq @ P)


def rls(J: Array, P: Array, dq: Array, ds: Array) -> tuple[Array, Array]:
    """Return the update by recursive least squares with forgetting (Piepmeier et al. 2004)."""
    gain = P @ dq / (FORGETTING + dq @ P @ dq)
    return J + np.outer(ds - J @ dq, gain), (P - np.outer(gain, dq @ P)) / FORGETTING


class PeerLaw(NamedTuple):
    """A law of the literature.

    update       how it learns J; None: it knows the true one
    P            variance at first of each direction of the joints, in the update's own units
    largest_step of a joint, rad
    damping      of the step, as a share of J's greatest singular value
    """

    update: Update | None
    P: float
    largest_step: float
    damping: float


BROYDEN = PeerLaw(broyden, 0.0, math.radians(30), DAMPING)
KALMAN = PeerLaw(kalman, FIRST_SIGMA**2, math.radians(30), DAMPING)
RLS = PeerLaw(rls, 1 / EXPLORING_STEP**2, math.radians(30), DAMPING)
IBVS = PeerLaw(None, 0.0, math.radians(60), 0.0)
"""The laws of the literature; their names stand in servo_scenarios.PEERS.  IBVS is the classical
law dq = -pinv(J) e with the true J (Chaumette and Hutchinson 2006)."""


def law_named(name: str) -> PeerLaw:
    """Return the law of this name, one of servo_scenarios.PEERS."""
    law = pkgutil.resolve_name(PEERS[name])
    assert isinstance(law, PeerLaw)
    return law


class PeerServo(LookThenMoveServo):
    """A servo by a law of the literature, by the interface of robot.servoing.servo.Servo.

    Args:
        law: PeerLaw.
        arm: as the brick describes it.
        tolerance: px.
        rows: Rows.
        true_jacobians: cameras -> {camera: J at the true pose, px/rad}.

    Attributes:
        as Servo's.
    """

    def __init__(
        self,
        law: PeerLaw,
        arm: Arm,
        tolerance: float,
        rows: Rows,
        true_jacobians: Callable[[Sequence[str]], dict[str, Any]],
    ) -> None:
        self.using: str | None = "peer"
        self.J: Any = None
        self.rows, self.estimator = rows, MedianEstimator(tolerance, rows)
        self.cameras: Sequence[str] = ()
        self._law, self._tolerance = law, tolerance
        self._true_jacobians = true_jacobians
        self._low = np.array([joint.lower for joint in arm.joints])
        self._high = np.array([joint.upper for joint in arm.joints])
        self._columns: list[dict[str, Array]] = []  # of J as explored, by camera
        self._P = law.P * np.eye(len(arm.joints))
        self._before: tuple[Array, dict[str, Any]] | None = None  # q, s by camera

    def suffices(self, cameras: Iterable[str]) -> bool:
        """Return what Servo.suffices does."""
        return (set(self.cameras) <= set(cameras)) and self.rows.suffice(cameras)

    def decide(
        self, q: Sequence[float], measurements: Sequence[Measurement], chase: Any = ()
    ) -> Decision:
        """Decide as Servo.decide does: explore joint after joint, then step by the law."""
        self.cameras = self.cameras or [m.camera for m in measurements]
        measurements = [m for m in measurements if m.camera in self.cameras]
        here, n = np.array(q), len(q)
        s: dict[str, Any] = {m.camera: np.array(m.s) for m in measurements}
        before, self._before = self._before, (here.copy(), s)
        e = error_of(measurements, self.rows)
        if np.linalg.norm(e) < self._tolerance:
            return end_of_run(CONVERGED)
        if self._law.update is None:
            J = self._chosen(self._true_jacobians(self.cameras))
        elif self.J is None:
            if before is not None:  # the joint before has just been explored
                k = len(self._columns)
                turned = here[k] - before[0][k] or math.inf
                self._columns.append({c: (s[c] - before[1][c]) / turned for c in s})
            if len(self._columns) < n:
                k = len(self._columns)
                middle = (self._low[k] + self._high[k]) / 2
                here[k] += math.copysign(EXPLORING_STEP, middle - here[k])
                return Decision("explore", list(here), "", "")
            J = self._chosen({c: np.column_stack([x[c] for x in self._columns]) for c in s})
        else:
            J = np.array(self.J)
            if before is not None and np.any(here != before[0]):
                ds = np.subtract(self.rows.values(s), self.rows.values(before[1]))
                J, self._P = self._law.update(J, self._P, here - before[0], ds)
        self.J = tuple(map(tuple, J))
        if len(J) < len(e):  # the rows have just been chosen
            e = error_of([m for m in measurements if m.camera in self.cameras], self.rows)
        return self._step(here, np.array(e), J)

    def _chosen(self, J: dict[str, Any]) -> Array:
        """Return the rows of J that count; settle on them, and on their cameras, at first."""
        self.rows.choose({c: tuple(map(tuple, rows)) for c, rows in J.items()})
        self.cameras = [c for c in self.cameras if self.rows.count([c])]
        return np.array(self.rows.values(J))

    def _step(self, q: Array, e: Array, J: Array) -> Decision:
        """Return the Decision to step from q (rad): damped least squares, no joint too far."""
        damping = self._law.damping * np.linalg.norm(J, 2)
        n = len(q)
        if damping:
            dq = -np.linalg.solve(J.T @ J + damping**2 * np.eye(n), J.T @ e)
        else:
            dq = -np.linalg.pinv(J) @ e
        dq *= min(1.0, self._law.largest_step / np.max(np.abs(dq)))
        to = np.clip(q + dq, self._low, self._high)
        return Decision("move", [float(a) for a in to], "", "")


def true_jacobians(
    cameras: PinholeCameras, brick: EmulatedBrick
) -> Callable[[Sequence[str]], dict[str, Array]]:
    """Return a function: names of cameras -> {camera: J at the true pose, px/rad}."""
    return lambda names: {c: np.array(cameras[c].jacobian(brick.plant.q)) for c in names}
