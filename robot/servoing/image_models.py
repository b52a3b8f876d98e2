"""All models of the image: of each camera one of each kind, and how right each kind was.  Pure."""

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
    ModelMakers = Mapping[str, Callable[[str], CameraModel]]  # of a camera's name, by their own

MOTION_SIGMA = 2.0
"""A frame that was taken in motion is doubted by so much more, px: the shutter, the two clocks."""

MAX_BEND_SHARE = 0.2
"""Three frames in motion belong together if the middle one is off their line by no more than this
share of the way (and noise)."""

JOINT_ERROR, BACKLASH_ERROR = math.radians(0.35), 0.1
"""Standard deviations: of a motor's angle, rad, and of the joint's backlash, as a share of it."""

FIRST_JOINT_VARIANCE = 4.0
"""What the joints' uncertainty makes of a row before anything is known of it, px^2."""

UNCERTAINTY_WEIGHT = 0.1
"""Weight of what is not known of J, beside the error that is to be made small."""

NEWEST_STEP_WEIGHT, MAX_STEP_ERROR = 0.6, 2.0
"""Weight of the newest step in how wrong a model was lately, and the most that a step counts."""

MAX_STEREO_CONDITION = 6.0
"""Cameras see the same if the condition of the image by space (greatest over least singular value)
is more: two less than 15 degrees apart, most often, and none that are 30 degrees apart."""

WORLD_CHANGE_ERROR = 25.0
"""A step predicted by all models so wrongly, px, and by more than half: the world has changed."""


def models_of(method, arm):
    # type: (str, Arm) -> ModelMakers
    """{name: a function of a camera's name that makes its model}."""

    def local(noise_aware):
        # type: (bool) -> Callable[[str], CameraModel]
        return lambda camera: LocalJacobian(2, len(arm.joints), noise_aware)

    if method == "broyden":
        return {"broyden": local(False)}
    if method == "kalman":
        return {"kalman": local(True)}
    links = [joint.link for joint in arm.joints]
    return {"kalman": local(True), "chain": lambda camera: ChainModel(2, arm.chain, links)}


class ImageModels(object):
    """What is known of the images of all cameras.

    Args:
        make: as models_of.
        joints: of the arm's description.
        sigma_of: gives a camera's noise, px.

    Attributes:
        names: of the kinds of models.
        local: the name of the one that knows J of one place alone.
        wrong: {name: share of its last steps that it has predicted wrongly}.
    """

    def __init__(self, make, joints, sigma_of):
        # type: (ModelMakers, Iterable[Joint], Callable[[str], float]) -> None
        self._make = make
        self._sigma_of = sigma_of
        self._joint_variance = [
            (JOINT_ERROR / joint.gear) ** 2 + (BACKLASH_ERROR * joint.backlash) ** 2
            for joint in joints
        ]
        self.names = sorted(make)
        self.local = next((name for name in self.names if name != "chain"), "chain")
        self.wrong = dict.fromkeys(make, 0.5)
        self._models = {}  # type: Dict[Tuple[str, str], CameraModel]  # (name, camera): model
        # (name, camera): what it knew when the arm stood last.
        self._images = {}  # type: Dict[Tuple[str, str], LinearImageModel]
        self._q = ()  # type: Pose  # there
        self._blurs = {}  # type: Dict[Tuple[str, str], float]
        # Camera: [(q, s)] of the last three.
        self._last_frames = {}  # type: Dict[str, List[Tuple[Pose, Pixel]]]

    def __contains__(self, name):
        # type: (str) -> bool
        return name in self._make

    def of(self, name, camera):
        # type: (str, str) -> CameraModel
        """The model of that name."""
        if (name, camera) not in self._models:
            self._models[name, camera] = self._make[name](camera)
        return self._models[name, camera]

    def image(self, name, camera):
        # type: (str, str) -> LinearImageModel
        """What the model knew when the arm stood last."""
        return self._images[name, camera]

    def doubt_all(self):
        # type: () -> None
        """The world has changed, or the arm goes on elsewhere."""
        for model in self._models.values():
            model.doubt_all()

    def best(self):
        # type: () -> str
        """The name of the model that was the least wrong lately."""
        return min(self.names, key=self.wrong.__getitem__)

    # Learning

    def observe_in_motion(self, camera, q, s, only=None):
        # type: (str, Pose, Pixel, Optional[str]) -> None
        """Learn from a frame that was taken in motion, when the joints were at q.

        All models do, or `only` the one of this name.  Each frame waits for the next one: what does
        not lie between its neighbours is left out.
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
        """Learn from [Measurement] of an arm that stands at q (rad)."""
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
        """What the joints' own uncertainty makes of a row of this camera, px^2."""
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
        """Compare what was predicted of the step that led to q with what is seen.

        A surprise for all of them makes all of them doubt.

        Args:
            before, seen: {camera: s}, px, of the same cameras.

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
            self.doubt_all()
        return {name: off / moved for name, off in missed.items()}

    # Telling

    def together(self, name, selection):
        # type: (str, CameraSelection) -> LinearImageModel
        """One image model of all that counts."""
        cameras = {c: self._images[name, c] for c in selection.used}
        return stacked(selection.parts(cameras))

    def see_flat(self, cameras, rows):
        # type: (Sequence[str], Rows) -> bool
        """Whether several cameras see all but the same, and leave the depth untold.

        Only the chain knows more than its last few steps have told.
        """
        if len(cameras) == 1 or "chain" not in self:
            return False
        models = {camera: self.of("chain", camera) for camera in cameras}
        by_space = {
            c: model.by_space() for c, model in models.items() if isinstance(model, ChainModel)
        }
        return condition(rows.values(by_space)) > MAX_STEREO_CONDITION

    def penalty(self, name, selection, n):
        # type: (str, CameraSelection, int) -> List[List[float]]
        """What is not known of J, as a penalty on the way: n x n, px^2/rad^2."""
        total = [[0.0] * n for _ in range(n)]
        for model, rows, weight in selection.parts({c: self.of(name, c) for c in selection.used}):
            share = (rows.stop - rows.start) * UNCERTAINTY_WEIGHT * weight * weight
            for row, other in zip(total, model.covariance()):
                for j, value in enumerate(other):
                    row[j] += share * value
        return total
