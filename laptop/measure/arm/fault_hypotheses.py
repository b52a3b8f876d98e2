"""Fault hypotheses for what no numbers explain.

Each hypothesis is a change that would show in the residuals in a way of its own: a joint whose zero
jumps at some time (a gear has slipped, a link was pushed on its axle), a camera that was moved at
some time, a joint whose link stands anywhere (it is loose).  How much of the misfit each explains,
with all numbers fitted anew, follows from the fit's derivatives (a score test, C. R. Rao, 1948).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from laptop.measure.arm.arm_fit import ArmFit

MAX_NOISE_RATIO = 1.7
"""Greatest ratio of noise to its expectation at which an arm is believed."""
MIN_RESTS_BEFORE, MIN_RESTS_AFTER = 4, 2
"""Fewest rests before and after a jump."""
JUMP_SIGMAS = 6.0
"""Deviation of the last rests where something has just happened, standard deviations."""
MIN_EXPLAINED_SHARE = 0.6
"""Least share of the misfit that a cause must explain to be named."""
MIN_LEAD = 1.5
"""Least lead of a loose link over the next cause of another kind, a factor of what they explain."""


@dataclass(frozen=True)
class FaultHypothesis:
    """A change that would explain a misfit.

    kind       "jump" of a joint or "camera"
    name       of the joint or camera
    after      rests before it
    explained  share of the misfit
    size       of the jump, rad, or px
    """

    kind: str
    name: str
    after: int
    explained: float
    size: float


def explain(fit: ArmFit, rests: int, times: Sequence[float]) -> str:
    """Return what is to blame for a misfit, for people; "" if all fits.

    Args:
        fit: of all rests.
        rests: how many they are.
        times: of the rests, s.
    """
    if fit.noise <= MAX_NOISE_RATIO and not _ends_off(fit):
        return ""
    found = fault_hypotheses(fit)
    best = max(found, key=lambda hypothesis: hypothesis.explained, default=None)
    how = f"what is left over is {fit.noise:.1f} times what it should be ({fit.rms:.1f} px)"
    if best and best.explained >= MIN_EXPLAINED_SHARE:
        when = f"after pose {best.after} of {rests}, {times[best.after - 1]:.0f} s after the start"
        if best.kind == "camera":
            return (
                f"camera {best.name} or the board was moved {when}, by {best.size:.0f} px in the "
                "picture; fasten both and calibrate again; nothing was written"
            )
        return (
            f"the {best.name} slipped {when}, by {math.degrees(best.size):.1f} deg: a gear or the "
            "link on its axle; mend it, home the arm and calibrate again; nothing was written"
        )
    loose = loose_joint(fit)
    if loose:
        name, degrees = loose
        return (
            f"the {name} stands now here, now there, by {degrees:.1f} deg at the same angle of its "
            f"motor: its link is loose, or its play is much greater than is allowed; {how}; mend "
            "it and calibrate again; nothing was written"
        )
    return (
        f"no arm of this kind moves like that: {how}; see that the marker is the arm's, that "
        "camera and board stand still, and that the link of each joint is fast; nothing was written"
    )


def _ends_off(fit: ArmFit) -> bool:
    """Return whether the last rests are off, which a robust loss takes for slips of the tracker."""
    for residuals in fit.residuals.values():
        deviations = np.linalg.norm(residuals, axis=1)
        deviations = deviations[np.isfinite(deviations)][-MIN_RESTS_AFTER:]
        if len(deviations) == MIN_RESTS_AFTER and (deviations > JUMP_SIGMAS).all():
            return True
    return False


def fault_hypotheses(fit: ArmFit) -> list[FaultHypothesis]:
    """Return of each joint and camera the jump that explains most."""
    names = list(fit.residuals)
    residuals = np.concatenate([fit.residuals[name] for name in names])  # (cameras n, 2)
    derivatives = np.concatenate([fit.slopes[name] for name in names])
    seen = np.isfinite(residuals).all(axis=1)
    flat, matrix = residuals[seen].ravel(), derivatives[seen].reshape(-1, derivatives.shape[2])
    inner = np.linalg.inv(matrix.T @ matrix + np.eye(matrix.shape[1]))

    def unfitted(columns: np.ndarray) -> np.ndarray:
        """Return what of columns (n, k) no change of the fitted numbers could be."""
        return columns - matrix @ (inner @ (matrix.T @ columns))

    deviations = unfitted(flat[:, None])[:, 0]
    misfit = max(float(flat @ deviations) - len(flat), 1e-9)
    n = len(fit.residuals[names[0]])
    index = np.tile(np.arange(n), len(names))
    whose = np.repeat(np.arange(len(names)), n)

    def best_jump(kind: str, name: str, columns: np.ndarray) -> FaultHypothesis:
        """Try every time at which columns (cameras n, 2, k) could begin to count."""
        best = FaultHypothesis(kind, name, 0, 0.0, 0.0)
        for after in range(MIN_RESTS_BEFORE, n - MIN_RESTS_AFTER + 1):
            late = np.where((index >= after)[:, None, None], columns, 0.0)
            own = late[seen].reshape(len(flat), -1)
            clean = unfitted(own)
            size, *_ = np.linalg.lstsq(clean.T @ own, clean.T @ flat, rcond=None)
            explained = float(size @ (clean.T @ flat)) / misfit
            if explained > best.explained:
                best = FaultHypothesis(kind, name, after, explained, float(np.linalg.norm(size)))
        return best

    found = []
    by_joints = np.concatenate([fit.by_joints[name] for name in names])
    for k, joint in enumerate(fit.model.arm.joints):
        found.append(best_jump("jump", joint.name, by_joints[:, :, k : k + 1]))
    for k, name in enumerate(names):
        columns = np.where((whose == k)[:, None, None], fit.whiteners[name], 0.0)
        found.append(best_jump("camera", name, columns))
    return found


def loose_joint(fit: ArmFit) -> tuple[str, float] | None:
    """Return the joint whose link scatters, and by how much, deg; None if none stands out.

    The scatter that is left over is shared out to the joints by what each would look like.
    """
    residuals = np.concatenate(list(fit.residuals.values()))
    by_joints = np.concatenate(list(fit.by_joints.values()))
    seen = np.isfinite(residuals).all(axis=1)
    residuals, by_joints = residuals[seen], by_joints[seen]
    # E[r r'] = I + sum of v_j b_j b_j': linear in the variances v_j.
    outer = np.einsum("nij,nkj->nikj", by_joints, by_joints).reshape(-1, by_joints.shape[2])
    excess_covariance = (np.einsum("ni,nk->nik", residuals, residuals) - np.eye(2)).ravel()
    variances, *_ = np.linalg.lstsq(outer, excess_covariance, rcond=None)
    gain = variances * (outer**2).sum(axis=0)
    order = np.argsort(gain)[::-1]
    worst, next_one = order[0], order[1]
    if variances[worst] <= 0 or gain[worst] < MIN_LEAD * max(gain[next_one], 0.0):
        return None
    name = fit.model.arm.joints[worst].name
    return name, math.degrees(math.sqrt(variances[worst]))
