"""The servo law: one decision, from what was measured to where the joints go, and the verdict.

Pure: no clock, no socket, no motor.

    q   joint angles, rad (n)
    s   image features, px (m): u and v of every camera in turn, or those of Rows;  s_star  where
        they shall be
    e   s - s_star
    J   image Jacobian ds/dq, px/rad (m x n)
"""

import math
from operator import sub

from robot.servoing.camera_selection import CameraSelection
from robot.servoing.decision import Decision, end_of_run
from robot.servoing.exploration import LINEAR_ITERATIONS, explore_one, inward, is_seen_moving
from robot.servoing.image_models import ImageModels
from robot.servoing.linear_algebra import distance, length
from robot.servoing.measurement import MedianEstimator, error_of
from robot.servoing.pose_search import at_shares, best_pose, best_posture, descent, within
from robot.servoing.progress import (
    EXPLORE_ANEW,
    FIRST_STEP,
    GIVE_UP,
    START_ELSEWHERE,
    TRY_POSTURE,
    Progress,
    next_region,
    restart_draws,
)
from robot.servoing.rows import Rows
from robot.servoing.stall_diagnosis import ImageKnowledge
from robot.servoing.target_poses import TargetPoses
from robot.servoing.tip_verification import DOES_NOT_MOVE, TipVerification
from shared.verdicts import CONVERGED, SINGULAR, UNREACHABLE

MYPY = False  # which a type checker takes for true
if MYPY:
    from typing import (  # noqa: F401
        Dict,
        Iterable,
        Iterator,
        List,
        Mapping,
        Optional,
        Sequence,
        Tuple,
    )

    from robot.servoing.image_model import Features, LinearImageModel, Pixel, Pose  # noqa: F401
    from robot.servoing.image_models import ModelKind  # noqa: F401
    from robot.servoing.linear_algebra import Matrix  # noqa: F401
    from robot.servoing.measurement import Frames, Measurement  # noqa: F401
    from robot.servoing.pose_search import Target  # noqa: F401
    from robot.servoing.sightings import MarkerFrame  # noqa: F401
    from robot.servoing.stream import Sight  # noqa: F401
    from shared.arm_description import Arm  # noqa: F401

    LastMeasurement = Tuple[List[float], Dict[str, Features]]  # q, rad; s by camera, px

STOP_SIGMAS, MAX_MARGIN = 3.0, 0.3
"""Distance of the error from the tolerance at which it ends, standard deviations of what was
measured, but at most this share of it; what is off by more is corrected once."""

FLAT_VIEW = "seen by {}, the tip may be off along the line of sight; look from another side, too"
"""Reason of a run that ends since its cameras leave the depth untold."""

WAYPOINT_DISTANCE = 150.0
"""Distance of a goal beyond which a local J uses way-points, px."""

MIN_STEP_SIGMAS = 6.0
"""Least motion of the marker by which a step judges the models, standard deviations."""

CHASE_ITERATIONS, AIM_TOLERANCE_SHARE = 5, 0.3
"""Steps of a search in a chase, and the share of the tolerance that its aim may be off: the next
search comes soon, and goes on from there."""


class Servo(object):
    """The servo law: models learn how each camera's image moves, and say where the goal is.

    Args:
        arm: shared.arm_description.Arm.
        kind: ModelKind, as model_kind gives it.
        tolerance: px.
        seed: of the generator that draws restarts.
        known: the models need no exploring, and no surprise makes the servo verify the tip.
        rows: Rows; all if None.

    Attributes:
        using: name of the models that made the last step; None when exploring.
        J: of that model, px/rad, its rows those that count; None before there is one.
        rows: Rows.
        estimator: has `measurements(frames)`.
        models: ImageModels.
        tolerance: px.
        steered: a Stream steers while the arm moves.
    """

    LEARNS = True
    """Whether the next run goes on with what this one has learned."""

    def __init__(self, arm, kind, tolerance, seed=0, known=False, rows=None):
        # type: (Arm, ModelKind, float, int, bool, Optional[Rows]) -> None
        self.using, self.J = None, None  # type: Optional[str], Optional[Matrix]
        self.rows = rows or Rows("stereo", len(arm.joints))
        self.estimator = MedianEstimator(tolerance, self.rows)
        self.models = ImageModels(kind, arm.joints, self.estimator.sigma_of)
        self.tolerance, self._known = tolerance, known
        self.steered = False
        self._targets = TargetPoses(arm, tolerance)
        self._selection = CameraSelection(self.rows, len(arm.joints), known)
        self._progress = Progress(tolerance, known)
        self._verification = TipVerification(math.inf if known else tolerance)
        self._region = FIRST_STEP
        self._restart_shares = restart_draws(seed)
        self._last_measurement = None  # type: Optional[LastMeasurement]

    @property
    def far_models(self):
        # type: () -> Optional[ImageModels]
        """The models, if they predict far: then what they have seen may be recalled, else None."""
        return self.models if self.models.kind.far else None

    @property
    def explores_in_motion(self):
        # type: () -> bool
        """Whether all joints are explored in one motion, by a model that learns from its frames.

        Not to verify the tip: that motion would end at the goal again.
        """
        return self.steered and self.models.kind.far and not self._verification.begun

    @property
    def cameras(self):
        # type: () -> Sequence[str]
        """The cameras in use."""
        return self._selection.used

    @property
    def detour_pose(self):
        # type: () -> Optional[Pose]
        """Posture that the last move leads to, at first perhaps farther off, rad (n); or None."""
        return self._progress.target_pose if self._progress.detours else None

    def suffices(self, cameras):
        # type: (Iterable[str]) -> bool
        """Return whether what these cameras see determines where the joints go."""
        return self.rows.suffice(cameras)

    def observe_in_motion(self, camera, q, s):
        # type: (str, Pose, Pixel) -> None
        """Learn, as ImageModels.observe_in_motion."""
        self.models.observe_in_motion(camera, q, s)

    def prepare(self, q, frames):
        # type: (Pose, Frames) -> Optional[Iterator[None]]
        """Learn ahead of `decide`, by frames of an arm that stands at q (rad).

        Returns:
            an iterator over slices of the work; None if it is too early.
        """
        measurements = self.estimator.glance(frames)
        if not measurements:
            return None
        self._test_recalled(q, measurements)
        return self.models.prepare(q, measurements)

    def _test_recalled(self, q, measurements):
        # type: (Pose, Sequence[Measurement]) -> None
        """Go by what an earlier run has seen if the first Measurements, at q (rad), agree."""
        kept = self.models.test_recalled(q, measurements)
        if self.rows.suffice(kept):
            self._selection.explored_by(kept)
            self.using = self.models.kind.name

    def decide(self, q, measurements, chase=()):
        # type: (Pose, Sequence[Measurement], Sequence[MarkerFrame]) -> Decision
        """Decide what to do now that the arm stands at q.

        Args:
            q: joint angles, rad (n).
            measurements: one for each camera.
            chase: MarkerFrames of the chase that led here, if one did.
        """
        q = list(q)
        seen = {measurement.camera: measurement.s for measurement in measurements}
        before = self._last_measurement
        in_motion = self.models.forgive()
        if in_motion:  # nothing was predicted, so the track has to tell
            self._verification.missed = math.inf
        elif before is not None and self._selection.explored:
            self._judge(q, seen, *before)
        self._test_recalled(q, measurements)
        self.models.update(q, measurements)
        self._choose_cameras(q, sorted(seen))
        J = self.J
        if in_motion:  # that of both its ends: either may move the image by more
            ends = [self.models.jacobians(self.cameras, a) for a in (before[0] if before else q, q)]
            begun, self.J = [tuple(self.rows.values(at_end)) for at_end in ends]
            J = begun + self.J
        unknown = before is None or self._known or not self._selection.explored
        self._last_measurement = q, seen
        used = [measurement for measurement in measurements if measurement.camera in self.cameras]
        goal = self._selection.together({m.camera: m.goal for m in used})
        error = length(error_of(used, self.rows))
        progress = self._progress
        doubt = STOP_SIGMAS * math.sqrt(max([m.variance for m in used]))
        margin = 0.0 if progress.refined else min(doubt, MAX_MARGIN * self.tolerance)
        if error < self.tolerance - margin:
            if not unknown and self.models.see_flat(self.cameras, self.rows):
                if progress.flat:
                    return end_of_run(SINGULAR, FLAT_VIEW.format(" and ".join(self.cameras)))
                progress.flat = True  # false sightings may cause that, too: explore anew
                return self._explore_anew(q, goal, measurements)
            led = self.using is not None or self._known  # by a model
            if before is not None and self._verification.is_needed(used, chase, led, before, J):
                return self._verify_tip(q, goal, measurements)
            self._progress = Progress(self.tolerance, self._known)  # should the goal move on
            return end_of_run(CONVERGED)
        self._verification.record_elsewhere()
        if not unknown and (in_motion or self.using is None):
            image = self.models.together(self._selection)
            if not is_seen_moving(image.jacobian(q), self.estimator.sigma):
                return end_of_run(SINGULAR, DOES_NOT_MOVE)
        progress.refined = progress.refined or error < self.tolerance
        if not self._selection.explored:
            return self._explore(q, goal)
        action = progress.assess(error)
        if action == GIVE_UP:
            return end_of_run(UNREACHABLE, "no nearer than {:.1f} px".format(progress.nearest))
        if action == START_ELSEWHERE:
            return self._start_from(at_shares(self._restart_shares(len(q)), *self._targets.box))
        if action == EXPLORE_ANEW:
            return self._explore_anew(q, goal, measurements)
        return self.move(q, goal, error, measurements)

    def _judge(self, q, seen, q_before, seen_before):
        # type: (Pose, Dict[str, Features], Pose, Dict[str, Features]) -> None
        """Fit the trust region to how well the step that led here was predicted."""
        self._verification.missed = 0.0
        both = [c for c in self.cameras if c in seen_before and c in seen]
        before, now = ({c: s[c] for c in both} for s in (seen_before, seen))
        moved = length([x for c in both for x in map(sub, now[c], before[c])])
        if moved < MIN_STEP_SIGMAS * self.estimator.sigma:
            return
        wrong = self.models.judge(q, before, now)
        if self.using is None:
            return
        self._verification.missed = moved * wrong
        self._region = next_region(self._region, distance(q, q_before), wrong)

    def _choose_cameras(self, q, cameras):
        # type: (Pose, Sequence[str]) -> None
        """Choose rows and cameras by what has been explored; begin a new progress if none stays."""
        known = self._sample(cameras)
        self.rows.choose(self.models.jacobians(known, q))
        if self._selection.choose(cameras, known, self.estimator.sigma_of):
            self._progress = Progress(self.tolerance, self._known)

    def _sample(self, cameras):
        # type: (Sequence[str]) -> List[str]
        """Count a measurement of these cameras; return those that have seen every joint move."""
        motions = 1 if self.explores_in_motion else len(self._targets.box[0])
        return self._selection.sample(cameras, motions)

    def _explore(self, q, goal):
        # type: (List[float], Features) -> Decision
        """Move a joint of which nothing is known, or all of them in one motion."""
        self.using = None
        if self.explores_in_motion:
            self._selection.explored_all()
            self.using = self.models.kind.name
            self.models.explore_in_motion()
            return self._go("explore", inward(q, self._targets.box))
        to = explore_one(q, self._targets.box, goal, self.models, self._selection)
        return self._go("explore", to)

    def _verify_tip(self, q, goal, measurements):
        # type: (List[float], Features, Sequence[Measurement]) -> Decision
        """Turn the joints: what seems to be the tip is at the goal; does it follow them?"""
        if self._verification.begin():
            return self._explore_anew(q, goal, measurements)
        if not self._selection.explored:
            return self._explore(q, goal)
        return end_of_run(SINGULAR, DOES_NOT_MOVE)

    def _explore_anew(self, q, goal, measurements):
        # type: (List[float], Features, Sequence[Measurement]) -> Decision
        """Forget and explore: the models do not lead to the goal, the image may have moved."""
        self.models.inflate_variances()
        self.models.update(q, measurements)
        self._selection.forget()
        self._sample([measurement.camera for measurement in measurements])
        self._progress.begin_exploring()
        return self._explore(q, goal)

    def _start_from(self, q):
        # type: (Pose) -> Decision
        """Go to q (rad), and begin as if nothing were known for certain."""
        self.using, self._region = None, FIRST_STEP
        self._progress.begin_elsewhere()
        self._selection.forget()
        self.models.inflate_variances()
        return self._go("restart", q)

    def _go(self, action, q):
        # type: (str, Pose) -> Decision
        """Return the Decision to go to q (rad), as far as the limits allow."""
        news, self.models.news = self.models.news, ""
        return Decision(action, self._targets.inside(q), "", news)

    def move(self, q, goal, error, measurements):
        # type: (List[float], Features, float, Sequence[Measurement]) -> Decision
        """Take a step from q, rad, by the models, or another law's; `error` is in px."""
        box = self._targets.box
        self.using = self.models.kind.name
        image = self.models.together(self._selection)
        self.J = tuple(self.rows.values(self.models.jacobians(self.cameras, q)))
        penalty = self.models.penalty(self._selection, len(q))
        self._progress.detours = False
        if self.models.kind.far:
            to, left = self._targets.choose(image, goal, q, penalty, error, self._progress)
            if self._progress.stalls(error, left):
                # The penalty keeps it here, or geometry does: what if all were known?
                here = best_pose(image, goal, q, box)
                to, left = best_posture(image, goal, q, box, here, left, self.tolerance)
                action = self._progress.assess_stall(left, self.models.wrong)
                if action == EXPLORE_ANEW:
                    return self._explore_anew(q, goal, measurements)
                if action == TRY_POSTURE:
                    other = self._targets.other_posture(q, self._progress.postures)
                    if other is None:
                        return end_of_run(*self._targets.out_of_reach(to, left))
                    return self._start_from(other)
                if distance(to, q) > FIRST_STEP:
                    self._progress.detour()
                self._progress.target_pose = to
            greatest = distance(to, q)
            if greatest > self._region:
                to = [b + (a - b) * self._region / greatest for a, b in zip(to, q)]
        else:
            tip = self._selection.together({m.camera: m.s for m in measurements})
            nearer = min(1.0, WAYPOINT_DISTANCE / error)
            waypoint = [y + nearer * (g - y) for y, g in zip(tip, goal)]
            near = within([self._region] * len(q), q, box)
            to, _ = best_pose(image, waypoint, q, near, q, penalty, LINEAR_ITERATIONS)
        gain = self._progress.gain
        return self._go("move", [a + gain * (b - a) for a, b in zip(q, to)])

    def known(self, camera):
        # type: (str) -> Optional[ImageKnowledge]
        """Return the ImageKnowledge of a camera; None before the arm has stood before it."""
        if self._last_measurement and camera in self._last_measurement[1]:
            model, sigma = self.models.of(camera), self.estimator.sigma_of(camera)
            return ImageKnowledge(model.shape(), model.covariance(), sigma)
        return None

    def shape(self, camera):
        # type: (str) -> LinearImageModel
        """Return the image model of a camera without its offset, as far as known."""
        return self.models.of(camera).shape()

    def learn_shape(self, camera, q, s):
        # type: (str, Pose, Pixel) -> Iterator[None]
        """Learn from a frame taken in motion: an iterator, each step a slice of the work."""
        self.models.observe_in_motion(camera, q, s)
        yield
        yield from self.models.of(camera).refit()

    def together(self, sights, t):
        # type: (Mapping[str, Sight], float) -> Tuple[LinearImageModel, List[float], List[float]]
        """Return (image model, goal at time t, its velocity), of all that counts.

        Args:
            sights: {camera: Stream's sight}.
            t: s.
        """
        return self._selection.moving(sights, t)

    def uncertainty_penalty(self, q):
        # type: (Pose) -> List[List[float]]
        """Return the uncertainty of J as a penalty for `nearing`, n x n, px^2/rad^2, at q (rad)."""
        return self.models.penalty(self._selection, len(q))

    def nearing(self, image, goal, start, q, penalty):
        # type: (LinearImageModel, Features, Pose, Pose, Matrix) -> Iterator[Target]
        """Iterate over the steps of a search for the joint angles at which the goal is reached.

        Args:
            image: LinearImageModel of all that counts.
            goal: px (m).
            start: where the search begins, rad (n).
            q: where the joints are, rad (n).
            penalty: as uncertainty_penalty gives it.
        """
        sharp = (AIM_TOLERANCE_SHARE * self.tolerance) ** 2
        return descent(image, goal, start, self._targets.box, q, penalty, CHASE_ITERATIONS, sharp)
