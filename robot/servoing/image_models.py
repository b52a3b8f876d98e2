"""Image models of all cameras: one of each kind for each, and how right each kind was.  Pure."""

import math
from operator import mul, sub

from robot.servoing.chain_model import ChainModel
from robot.servoing.image_model import stacked
from robot.servoing.linear_algebra import condition, length
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
        Tuple,
        Union,
    )

    from robot.servoing.camera_selection import CameraSelection  # noqa: F401
    from robot.servoing.image_model import Features, LinearImageModel, Pixel, Pose  # noqa: F401
    from robot.servoing.linear_algebra import Matrix  # noqa: F401
    from robot.servoing.measurement import Measurement  # noqa: F401
    from robot.servoing.rows import Rows  # noqa: F401
    from shared.arm_description import Arm, Joint  # noqa: F401

    CameraModel = Union[ChainModel, LocalJacobian]
    ModelKinds = Mapping[str, "ModelKind"]  # by name

MOTION_SIGMA = 2.0
"""Additional standard deviation of a frame taken in motion, px: the shutter, the two clocks."""

MAX_BEND_SHARE = 0.2
"""Greatest distance of the middle of three frames in motion from the line of the others, as a share
of their distance, beside noise: beyond it one of them is an outlier."""

JOINT_ERROR, BACKLASH_ERROR = math.radians(0.35), 0.1
"""Standard deviations: of a motor's angle, rad, and of the joint's backlash, as a share of it."""

FIRST_JOINT_VARIANCE = 4.0
"""Variance of a row by the joints' uncertainty before anything is known of it, px^2."""

UNCERTAINTY_WEIGHT = 0.1
"""Weight of J's uncertainty, beside the error that is to be made small."""

NEWEST_STEP_WEIGHT, MAX_STEP_ERROR = 0.6, 2.0
"""Weight of the newest step in how wrong a model was lately, and the most that a step counts."""

MAX_STEREO_CONDITION = 6.0
"""Condition of the image by space beyond which cameras see the same: most often two less than 15
degrees apart, and none that are 30 degrees apart."""

WORLD_CHANGE_ERROR = 25.0
"""Error of all models' predictions, px, beside half of the step, beyond which the world has
changed."""


class ModelKind(object):
    """A kind of image model, and what the servo may ask of it.

    Args:
        make: makes the model of a camera, given its name.
        far: predicts also far from where the arm stands; its models have `by_space`.
        blames_all: lays what a new joint does to the charge of all that moved.
    """

    def __init__(self, make, far=False, blames_all=False):
        # type: (Callable[[str], CameraModel], bool, bool) -> None
        self.make, self.far, self.blames_all = make, far, blames_all


def models_of(method, arm):
    # type: (str, Arm) -> ModelKinds
    """Return the ModelKinds by name of a method that goes by models alone.

    Args:
        method: one of shared.run_options.METHODS whose maker is runs.model_servo.
        arm: shared.arm_description.Arm.

    Raises:
        KeyError: none of them.
    """
    if method not in ("broyden", "kalman", "chain"):
        raise KeyError(method)
    n, links = len(arm.joints), [joint.link for joint in arm.joints]
    if method == "broyden":
        return {method: ModelKind(lambda camera: LocalJacobian(2, n, False), blames_all=True)}
    kinds = {"kalman": ModelKind(lambda camera: LocalJacobian(2, n))}
    if method == "chain":
        kinds[method] = ModelKind(lambda camera: ChainModel(arm.chain, links), far=True)
    return kinds


class ImageModels(object):
    """The image models of all cameras.

    Args:
        kinds: as models_of.
        joints: of the arm's description.
        sigma_of: gives a camera's noise, px.

    Attributes:
        names: of the kinds of models.
        far: the name of the one that predicts far from where the arm stands; None: none does.
        local: the name of the one that knows J of one place alone.
        wrong: {name: share of its last steps that it has predicted wrongly}.
    """

    def __init__(self, kinds, joints, sigma_of):
        # type: (ModelKinds, Iterable[Joint], Callable[[str], float]) -> None
        self.kinds = kinds
        self._sigma_of = sigma_of
        self._joint_variance = [
            (JOINT_ERROR / joint.gear) ** 2 + (BACKLASH_ERROR * joint.backlash) ** 2
            for joint in joints
        ]
        self.names = sorted(kinds)
        self.far = next((name for name in self.names if kinds[name].far), None)
        self.local = next((name for name in self.names if name != self.far), self.names[0])
        self.wrong = dict.fromkeys(kinds, 0.5)
        self._forgiving = False
        self._models = {}  # type: Dict[Tuple[str, str], CameraModel]  # (name, camera): model
        # (name, camera): what it knew when the arm stood last.
        self._images = {}  # type: Dict[Tuple[str, str], LinearImageModel]
        self._q = ()  # type: Pose  # where it stood, rad
        self._blurs = {}  # type: Dict[Tuple[str, str], float]
        # Camera: [(q, s)] of the last three.
        self._last_frames = {}  # type: Dict[str, List[Tuple[Pose, Pixel]]]

    def of(self, name, camera):
        # type: (str, str) -> CameraModel
        """Return the model of that name and camera, made if it is new."""
        if (name, camera) not in self._models:
            self._models[name, camera] = self.kinds[name].make(camera)
        return self._models[name, camera]

    def image(self, name, camera):
        # type: (str, str) -> LinearImageModel
        """Return the image model as it was known when the arm stood last."""
        return self._images[name, camera]

    def inflate_variances(self):
        # type: () -> None
        """Inflate the variances of all models: the world has changed, or the arm is elsewhere."""
        for model in self._models.values():
            model.inflate_variances()

    def best(self):
        # type: () -> str
        """Return the name of the model that was the least wrong lately."""
        return min(self.names, key=self.wrong.__getitem__)

    def prefer(self, name):
        # type: (Optional[str]) -> None
        """Prefer the model of that name; the next step, in which it is explored, judges none."""
        self.wrong = {other: 0.5 if other == name else MAX_STEP_ERROR for other in self.names}
        self._forgiving = True

    def forgive(self):
        # type: () -> bool
        """Return whether the step that has just been made judges none, as `prefer` has it."""
        forgiving, self._forgiving = self._forgiving, False
        return forgiving

    # Learning

    def observe_in_motion(self, camera, q, s, only=None):
        # type: (str, Pose, Pixel, Optional[str]) -> None
        """Learn from a frame that was taken in motion.

        Each frame waits for the next one: one that does not lie between its neighbours is left out.

        Args:
            camera: its name.
            q: joint angles when it was taken, rad (n).
            s: u and v, px.
            only: name of the model that learns; None: all do.
        """
        frames = self._last_frames.setdefault(camera, [])
        frames.append((q, s))
        if len(frames) < 3:
            return
        del frames[:-3]
        (_, (u0, v0)), (q, s), (_, (u2, v2)) = frames
        u, v = s
        off = math.hypot(u - 0.5 * (u0 + u2), v - 0.5 * (v0 + v2))
        sigma = self._sigma_of(camera)
        if off > MAX_BEND_SHARE * math.hypot(u2 - u0, v2 - v0) + 4 * sigma + MOTION_SIGMA:
            return
        for name in (only,) if only else self.names:
            variance = sigma * sigma + MOTION_SIGMA**2 + self._blur(name, camera)
            self.of(name, camera).observe(q, s, variance, standing=False)

    def prepare(self, q, measurements):
        # type: (Pose, Iterable[Measurement]) -> Iterator[None]
        """Learn ahead of `update` from what is seen so far: an iterator over slices of the work."""
        for measurement in measurements:
            camera, s = measurement.camera, measurement.s
            for name in self.names:
                variance = measurement.variance + self._blur(name, camera)
                for _ in self.of(name, camera).prepare(q, s, variance):
                    yield

    def update(self, q, measurements):
        # type: (Pose, Iterable[Measurement]) -> None
        """Learn from the Measurements of an arm that stands at q (rad)."""
        self._last_frames = {}
        for measurement in measurements:
            camera, s = measurement.camera, measurement.s
            for name in self.names:
                model = self.of(name, camera)
                model.observe(q, s, measurement.variance + self._blur(name, camera))
                self._images[name, camera] = model.seen_from(q, s)
        self._q, self._blurs = q, {}

    def _blur(self, name, camera):
        # type: (str, str) -> float
        """Return the variance that the joints' own uncertainty adds to a row of a camera, px^2."""
        if (name, camera) not in self._blurs:
            image = self._images.get((name, camera))
            if image is None:
                return FIRST_JOINT_VARIANCE
            columns = zip(*image.jacobian(self._q))
            self._blurs[name, camera] = sum(
                sum(map(mul, c, c)) / len(c) * w for c, w in zip(columns, self._joint_variance)
            )
        return self._blurs[name, camera]

    def judge(self, q, before, seen):
        # type: (Pose, Mapping[str, Features], Mapping[str, Features]) -> Dict[str, float]
        """Compare the predictions of the step that led to q with what is seen.

        If all of them were surprised, the world has changed: all variances are inflated.

        Args:
            q: joint angles, rad (n).
            before: {camera: s} before the step, px.
            seen: {camera: s} at q, px, of the same cameras.

        Returns:
            {name: share of the step that was predicted wrongly}
        """
        cameras = sorted(seen)
        moved = length([x for c in cameras for x in map(sub, seen[c], before[c])])
        missed = {}
        for name in self.names:
            predicted = {c: self._images[name, c].predict(q) for c in cameras}
            missed[name] = length([x for c in cameras for x in map(sub, predicted[c], seen[c])])
            wrong = min(missed[name] / moved, MAX_STEP_ERROR)
            self.wrong[name] += NEWEST_STEP_WEIGHT * (wrong - self.wrong[name])
        if min(missed.values()) > max(WORLD_CHANGE_ERROR, 0.5 * moved):
            self.inflate_variances()
        return {name: off / moved for name, off in missed.items()}

    # Telling

    def together(self, name, selection):
        # type: (str, CameraSelection) -> LinearImageModel
        """Return one image model of all that counts."""
        cameras = {c: self._images[name, c] for c in selection.used}
        return stacked(selection.parts(cameras))

    def see_flat(self, cameras, rows):
        # type: (Sequence[str], Rows) -> bool
        """Return whether several cameras see all but the same, and leave the depth untold.

        Only a model that predicts far knows more than its last few steps have shown.
        """
        if len(cameras) == 1 or self.far is None:
            return False
        by_space = {c: self.of(self.far, c).by_space() for c in cameras}  # type: ignore[union-attr]
        return condition(rows.values(by_space)) > MAX_STEREO_CONDITION

    def penalty(self, name, selection, n):
        # type: (str, CameraSelection, int) -> List[List[float]]
        """Return J's uncertainty as a penalty on joint motion, n x n, px^2/rad^2."""
        total = [[0.0] * n for _ in range(n)]
        for model, rows, weight in selection.parts({c: self.of(name, c) for c in selection.used}):
            share = (rows.stop - rows.start) * UNCERTAINTY_WEIGHT * weight * weight
            for row, other in zip(total, model.covariance()):
                for j, value in enumerate(other):
                    row[j] += share * value
        return total
