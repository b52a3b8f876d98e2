"""Image models of all cameras, and how right they were.  Pure."""

import math
from operator import mul, sub

from robot.servoing.chain_model import ChainModel
from robot.servoing.image_model import stacked
from robot.servoing.linear_algebra import condition, distance, length
from robot.servoing.local_jacobian import LocalJacobian

MYPY = False  # which a type checker takes for true
if MYPY:
    from typing import (  # noqa: F401
        Callable,
        Dict,
        Iterable,
        Iterator,
        List,
        Mapping,
        Optional,
        Sequence,
        Set,
        Tuple,
        Union,
    )

    from robot.servoing.camera_selection import CameraSelection  # noqa: F401
    from robot.servoing.chain_model import KeyFrame  # noqa: F401
    from robot.servoing.image_model import Features, LinearImageModel, Pixel, Pose  # noqa: F401
    from robot.servoing.linear_algebra import Matrix  # noqa: F401
    from robot.servoing.measurement import Measurement  # noqa: F401
    from robot.servoing.rows import Rows  # noqa: F401
    from shared.arm_description import Arm, Joint  # noqa: F401

    CameraModel = Union[ChainModel, LocalJacobian]

MOTION_SIGMA = 2.0
"""Additional standard deviation of a frame taken in motion, px: the shutter, the two clocks."""

MAX_BEND_SHARE = 0.2
"""Greatest distance of the middle of three frames in motion from the line of the others, as a share
of their distance, beside noise: beyond it one of them is an outlier."""

NEAR_GAIN, NEAR_RANGE = 400.0, 40.0
"""Distance from the frame before up to which a frame in motion is believed whatever the model
says: px per radian of the joints' motion between the two, and the most, px."""

MAX_SURPRISE_SHARE = 0.5
"""Greatest distance of a frame in motion from where the model has it after the frame before, as a
share of the distance of the two, beside noise: beyond it it may be an outlier."""

JOINT_ERROR, BACKLASH_ERROR = math.radians(0.35), 0.1
"""Standard deviations: of a motor's angle, rad, and of the joint's backlash, as a share of it."""

FIRST_JOINT_VARIANCE = 4.0
"""Variance of a row by the joints' uncertainty before anything is known of it, px^2."""

UNCERTAINTY_WEIGHT = 0.1
"""Weight of J's uncertainty, beside the error that is to be made small."""

FIRST_WRONG = 0.5
"""Share of a step that may be predicted wrongly before any was."""

NEWEST_STEP_WEIGHT, MAX_STEP_ERROR = 0.6, 2.0
"""Weight of the newest step in how wrong the models were lately, and the most that a step
counts."""

MAX_STEREO_CONDITION = 6.0
"""Condition of the image by space beyond which cameras see the same: most often two less than 15
degrees apart, and none that are 30 degrees apart."""

WORLD_CHANGE_ERROR = 25.0
"""Error of a prediction, px, beside half of the step, beyond which the world has changed."""


NOT_AS_BEFORE = (
    "camera {} does not see the tip where the last run would have: the camera, the marker or the"
    " zero is elsewhere; it learns anew"
)
"""Line for people when what an earlier run has seen is dropped."""


class ModelKind(object):
    """A kind of image model, and what the servo may ask of it.

    Args:
        name: of the method.
        make: makes the model of a camera, given its name.
        far: predicts also far from where the arm stands; its models have `by_space`.
        blames_all: lays what a new joint does to the charge of all that moved.
    """

    def __init__(self, name, make, far=False, blames_all=False):
        # type: (str, Callable[[str], CameraModel], bool, bool) -> None
        self.name, self.make, self.far, self.blames_all = name, make, far, blames_all


def model_kind(method, arm):
    # type: (str, Arm) -> ModelKind
    """Return the ModelKind of a method that goes by a model alone.

    Args:
        method: one of shared.run_options.METHODS whose maker is runs.model_servo.
        arm: shared.arm_description.Arm.

    Raises:
        KeyError: none of them.
    """
    n, links = len(arm.joints), [joint.link for joint in arm.joints]
    if method == "broyden":
        return ModelKind(method, lambda camera: LocalJacobian(2, n, False), blames_all=True)
    if method == "kalman":
        return ModelKind(method, lambda camera: LocalJacobian(2, n))
    if method == "chain":
        return ModelKind(method, lambda camera: ChainModel(arm.chain, links), far=True)
    raise KeyError(method)


class ImageModels(object):
    """The image models of all cameras.

    Args:
        kind: ModelKind.
        joints: of the arm's description.
        sigma_of: gives a camera's noise, px.

    Attributes:
        kind: ModelKind.
        wrong: share of the last steps that was predicted wrongly.
        news: a line for people that has not been said yet; "" if there is none.
    """

    def __init__(self, kind, joints, sigma_of):
        # type: (ModelKind, Iterable[Joint], Callable[[str], float]) -> None
        self.kind = kind
        self._sigma_of = sigma_of
        self._joint_variance = [
            (JOINT_ERROR / joint.gear) ** 2 + (BACKLASH_ERROR * joint.backlash) ** 2
            for joint in joints
        ]
        self.wrong, self._forgiving, self.news = FIRST_WRONG, False, ""
        self._recalled = set()  # type: Set[str]  # cameras of an earlier run, not seen yet
        self._models = {}  # type: Dict[str, CameraModel]  # by camera
        # Camera: what its model knew when the arm stood last.
        self._images = {}  # type: Dict[str, LinearImageModel]
        self._q = ()  # type: Pose  # where it stood, rad
        self._blurs = {}  # type: Dict[str, float]
        # Camera: (q, s) of the last two in motion; and of the last one that was believed.
        self._last_frames = {}  # type: Dict[str, List[Tuple[Pose, Pixel]]]
        self._believed = {}  # type: Dict[str, Tuple[Pose, Features]]

    def of(self, camera):
        # type: (str) -> CameraModel
        """Return the model of a camera, made if it is new."""
        if camera not in self._models:
            self._models[camera] = self.kind.make(camera)
        return self._models[camera]

    def jacobians(self, cameras, q):
        # type: (Iterable[str], Pose) -> Dict[str, Matrix]
        """Return {camera: J at q (rad)} by these image models, px/rad."""
        return {camera: self._images[camera].jacobian(q) for camera in cameras}

    def inflate_variances(self):
        # type: () -> None
        """Inflate the variances of all models: the world has changed, or the arm is elsewhere."""
        for model in self._models.values():
            model.inflate_variances()

    def explore_in_motion(self):
        # type: () -> None
        """Let the next step judge none: it is explored in it."""
        self.wrong, self._forgiving = FIRST_WRONG, True

    def forgive(self):
        # type: () -> bool
        """Return whether the models were explored in the step that has just been made."""
        forgiving, self._forgiving = self._forgiving, False
        return forgiving

    # Learning

    def recall(self, views):
        # type: (Mapping[str, Sequence[KeyFrame]]) -> None
        """Begin with the key-frames of an earlier run, by camera; the kind predicts far."""
        for camera in views:
            self.of(camera).recall(views[camera])  # type: ignore[union-attr]
            self._recalled.add(camera)

    def test_recalled(self, q, measurements):
        # type: (Pose, Iterable[Measurement]) -> List[str]
        """Keep what an earlier run has seen where the first Measurements, at q (rad), agree.

        Returns:
            Cameras of which they agree; none but the first time.
        """
        kept, dropped = [], []  # type: List[str], List[str]
        for m in measurements if self._recalled else ():
            if m.camera in self._recalled:
                agrees = self.of(m.camera).expects(q, m.s)  # type: ignore[union-attr]
                (kept if agrees else dropped).append(m.camera)
        for camera in self._recalled.difference(kept):
            del self._models[camera]
        self._recalled = set()
        if dropped:
            self.news = NOT_AS_BEFORE.format(" and ".join(dropped))
        return kept

    def views(self):
        # type: () -> Dict[str, List[KeyFrame]]
        """Return the key-frames by camera, as `recall` takes them; none if it has no such."""
        models = self._models if self.kind.far else {}
        return {c: models[c].key_frames for c in models}  # type: ignore[union-attr]

    def observe_in_motion(self, camera, q, s):
        # type: (str, Pose, Pixel) -> None
        """Learn from a frame that was taken in motion.

        At once if it follows from the last one that was believed: on a slow brick the next frame
        is 0.2 s away.  Otherwise it waits for that one, and is left out if it does not lie between
        its neighbours.

        Args:
            camera: its name.
            q: joint angles when it was taken, rad (n).
            s: u and v, px.
        """
        sigma = self._sigma_of(camera)
        noise = 4 * sigma + MOTION_SIGMA
        frames, new = self._last_frames.setdefault(camera, []), (q, s)
        frames.append(new)
        good = [new] if self._follows(camera, new, noise) else []
        if len(frames) == 3:
            (_, (u0, v0)), middle, _ = frames
            del frames[0]
            if not good and middle is not self._believed.get(camera):
                (u1, v1), (u2, v2) = middle[1], s
                off = math.hypot(u1 - 0.5 * (u0 + u2), v1 - 0.5 * (v0 + v2))
                if off <= MAX_BEND_SHARE * math.hypot(u2 - u0, v2 - v0) + noise:
                    self._believed[camera] = middle
                    good = [middle, new] if self._follows(camera, new, noise) else [middle]
        variance = sigma * sigma + MOTION_SIGMA**2 + self._blur(camera)
        for frame in good:
            self._believed[camera] = frame
            self.of(camera).observe(frame[0], frame[1], variance, standing=False)

    def _follows(self, camera, frame, noise):
        # type: (str, Tuple[Pose, Pixel], float) -> bool
        """Return whether a frame (q, s) is where the last believed one lets expect, but for noise.

        That is a validation gate (Bar-Shalom and Fortmann 1988): near it after little motion, or
        about where the model says.
        """
        if camera not in self._believed:
            return False
        before, (u0, v0) = self._believed[camera]
        q, (u, v) = frame
        u, v = u - u0, v - v0
        far = math.hypot(u, v)
        if far <= min(NEAR_GAIN * distance(q, before), NEAR_RANGE) + noise:
            return True
        image = self.of(camera).shape()
        (u0, v0), (u1, v1) = image.predict(before), image.predict(q)
        return math.hypot(u - u1 + u0, v - v1 + v0) <= MAX_SURPRISE_SHARE * far + noise

    def prepare(self, q, measurements):
        # type: (Pose, Iterable[Measurement]) -> Iterator[None]
        """Learn ahead of `update` from what is seen so far: an iterator over slices of the work."""
        for measurement in measurements:
            camera = measurement.camera
            variance = measurement.variance + self._blur(camera)
            for _ in self.of(camera).prepare(q, measurement.s, variance):
                yield

    def update(self, q, measurements):
        # type: (Pose, Iterable[Measurement]) -> None
        """Learn from the Measurements of an arm that stands at q (rad)."""
        self._last_frames, self._believed = {}, {}
        for measurement in measurements:
            camera, s = measurement.camera, measurement.s
            self._believed[camera] = q, s
            model = self.of(camera)
            model.observe(q, s, measurement.variance + self._blur(camera))
            self._images[camera] = model.seen_from(q, s)
        self._q, self._blurs = q, {}

    def _blur(self, camera):
        # type: (str) -> float
        """Return the variance that the joints' own uncertainty adds to a row of a camera, px^2."""
        if camera not in self._blurs:
            image = self._images.get(camera)
            if image is None:
                return FIRST_JOINT_VARIANCE
            columns = zip(*image.jacobian(self._q))
            self._blurs[camera] = sum(
                sum(map(mul, c, c)) / len(c) * w for c, w in zip(columns, self._joint_variance)
            )
        return self._blurs[camera]

    def judge(self, q, before, seen):
        # type: (Pose, Mapping[str, Features], Mapping[str, Features]) -> float
        """Compare the prediction of the step that led to q with what is seen.

        If it is far off, the world has changed: all variances are inflated.

        Args:
            q: joint angles, rad (n).
            before: {camera: s} before the step, px.
            seen: {camera: s} at q, px, of the same cameras.

        Returns:
            Share of the step that was predicted wrongly.
        """
        cameras = sorted(seen)
        moved = length([x for c in cameras for x in map(sub, seen[c], before[c])])
        predicted = {c: self._images[c].predict(q) for c in cameras}
        missed = length([x for c in cameras for x in map(sub, predicted[c], seen[c])])
        wrong = missed / moved
        self.wrong += NEWEST_STEP_WEIGHT * (min(wrong, MAX_STEP_ERROR) - self.wrong)
        if missed > max(WORLD_CHANGE_ERROR, 0.5 * moved):
            self.inflate_variances()
        return wrong

    # Telling

    def together(self, selection):
        # type: (CameraSelection) -> LinearImageModel
        """Return one image model of all that counts."""
        return stacked(selection.parts(self._images))

    def see_flat(self, cameras, rows):
        # type: (Sequence[str], Rows) -> bool
        """Return whether several cameras see all but the same, and leave the depth untold.

        Only a model that predicts far knows more than its last few steps have shown.
        """
        if len(cameras) == 1 or not self.kind.far:
            return False
        by_space = {c: self.of(c).by_space() for c in cameras}  # type: ignore[union-attr]
        return condition(rows.values(by_space)) > MAX_STEREO_CONDITION

    def penalty(self, selection, n):
        # type: (CameraSelection, int) -> List[List[float]]
        """Return J's uncertainty as a penalty on joint motion, n x n, px^2/rad^2."""
        total = [[0.0] * n for _ in range(n)]
        for model, rows, weight in selection.parts({c: self.of(c) for c in selection.used}):
            share = (rows.stop - rows.start) * UNCERTAINTY_WEIGHT * weight * weight
            for row, other in zip(total, model.covariance()):
                for j, value in enumerate(other):
                    row[j] += share * value
        return total
