"""Diagnosis of a stall by cameras: is the joint blocked, or is its encoder dead?

Of what a camera saw since the joint's last count, the counts of all joints explain a part.  If the
rest is what this joint would do to the image, its encoder is dead; if it is less than that, the
joint is blocked.
"""

import math
from operator import mul, sub

from robot.servoing.linear_algebra import dot, length, median
from shared.arm_description import ArmError
from shared.record import record

MYPY = False  # which a type checker takes for true
if MYPY:
    from typing import Callable, Dict, Iterable, List, NamedTuple, Optional, Sequence, Tuple  # noqa: F401

    from robot.motion.arm import RobotArm  # noqa: F401
    from robot.motion.control_loop import Stalled  # noqa: F401
    from robot.servoing.decision import AnyServo  # noqa: F401
    from robot.servoing.image_model import Features, LinearImageModel, Pixel, Pose  # noqa: F401
    from robot.servoing.joint_history import JointHistory  # noqa: F401
    from robot.servoing.linear_algebra import Matrix, Vector  # noqa: F401
    from robot.servoing.sightings import Sightings  # noqa: F401

    _Seen = List[Tuple[Pose, Features]]  # of one camera: where the joints were, and the tip
    _Anchor = Tuple[bool, _Seen]

SAMPLE_TIME, SAMPLE_PAUSE, REST_TIME, MIN_FRAMES = 0.6, 0.1, 0.15, 3
"""Time for which a stopped arm is watched, and pause between two samples, s; delay after which it
rests, s; least number of frames at rest."""

ANCHOR_FRAMES = 4
"""Number of last frames from before that the frames at rest are compared with."""

STANDSTILL_COUNTS = 1.2
"""Range within which a joint has not counted, counts."""

NOISE_SIGMAS, MODEL_ERROR_SHARE, MOTION_ERROR, BACKLASH_ERROR_SHARE = 5.0, 0.35, 4.0, 0.4
"""Bounds of what may be chance: standard deviations of a frame, the share of what is explained, px
where it is compared with frames in motion, and the share of what the joints' backlash would do."""

MAX_DETECTION_ANGLE, MIN_TURN_RATIO = math.radians(3), 2.0
"""Greatest detection angle that is believed, rad; least turn of a joint that turns, when it rests,
as a multiple of that."""

MAX_MISFIT_SHARE = 0.5
"""Share of the turn's effect by which the residual may be another than that: a circle is bent."""

TURNS_TEXT = (
    "the {} (port {}) does not count, though {} it turn by about {:.0f} deg: its "
    "encoder is dead; check the cable, or change the motor, then home"
)
"""Message of a joint that turns and does not count."""
STANDS_TEXT = "{}, and {} it stand: it is blocked or overloaded; free it, then home"
"""Message of a joint that stands."""

if MYPY:
    ImageKnowledge = NamedTuple(
        "ImageKnowledge", [("image", LinearImageModel), ("covariance", Matrix), ("sigma", float)]
    )
else:
    ImageKnowledge = record("ImageKnowledge", "image covariance sigma")
ImageKnowledge.__doc__ = """Knowledge of one camera's image.

image       LinearImageModel, wherever in the image
covariance  of each row of its J, n x n, (px/rad)^2
sigma       noise of a frame, px
"""

if MYPY:
    Residual = NamedTuple(
        "Residual", [("off", Vector), ("uncertainty", float), ("column", Optional[Vector])]
    )
else:
    Residual = record("Residual", "off uncertainty column")
Residual.__doc__ = """Residual of what a camera saw, px: what the counts do not explain.

off     u and v;  uncertainty  how much of it may be chance
column  of J, what the joint does to the image, px/rad; None where that is not known
"""


def residual_motion(known, frames, moving, q, s, k, backlash):
    # type: (ImageKnowledge, Sequence[Tuple[Pose, Features]], bool, Pose, Features, int, Vector) -> Residual
    """Return the residual of what was seen since `frames` when the arm rests.

    Args:
        known: knowledge of the camera.
        frames: [(q, s)], rad by the counts and px.
        moving: whether they were taken in motion.
        q: joint angles at rest, rad (n).
        s: u and v at rest, px.
        k: index of the joint that does not count.
        backlash: per joint, rad.
    """
    image, P = known.image, known.covariance
    predicted = image.predict(q)
    errors = [list(map(sub, seen, image.predict(list(before)))) for before, seen in frames]
    off = [a - b - median(c) for a, b, c in zip(s, predicted, zip(*errors))]
    before = list(frames[-1][0])
    turned = list(map(sub, q, before))
    columns = list(zip(*image.jacobian(q)))
    uncertainty = NOISE_SIGMAS * known.sigma + MOTION_ERROR * moving
    uncertainty += MODEL_ERROR_SHARE * length(list(map(sub, predicted, image.predict(before))))
    uncertainty += math.sqrt(max(0.0, dot(turned, [sum(map(mul, row, turned)) for row in P])))
    uncertainty += BACKLASH_ERROR_SHARE * length([length(c) * b for c, b in zip(columns, backlash)])
    is_known = length(columns[k]) > math.sqrt(P[k][k])
    return Residual(off, uncertainty, columns[k] if is_known else None)


def observed_turn(residuals, least):
    # type: (Sequence[Residual], float) -> Optional[float]
    """Return the turn of a joint that does not count, as the cameras agree on it.

    Args:
        residuals: one of each camera, px.
        least: angle that it would have turned by, could it turn, rad.

    Returns:
        its turn, rad; 0.0: it stands; None: they do not agree
    """
    informative = [
        (residual, residual.column) for residual in residuals if residual.column is not None
    ]
    if not informative:
        return None
    weight = sum(
        [dot(column, column) / residual.uncertainty**2 for residual, column in informative]
    )
    turn = (
        sum(
            [
                dot(residual.off, column) / residual.uncertainty**2
                for residual, column in informative
            ]
        )
        / weight
    )
    uncertainty = 1 / math.sqrt(weight)
    for residual, column in informative:
        misfit = length([o - turn * c for o, c in zip(residual.off, column)])
        if misfit > residual.uncertainty * max(1.0, MAX_MISFIT_SHARE * abs(turn) / uncertainty):
            return None
    if abs(turn) > max(uncertainty, least):
        return turn
    return 0.0 if MIN_TURN_RATIO * least - abs(turn) > uncertainty else None


def explain_stall(
    error,  # type: ArmError
    arm,  # type: RobotArm
    servo,  # type: AnyServo
    sightings,  # type: Sightings
    now,  # type: Callable[[], float]
    receive,  # type: Callable[[float], object]
):
    # type: (...) -> str
    """Return the text of an ArmError; of a joint that does not count, the cause by the cameras.

    Args:
        error: ArmError.
        arm: robot.motion.arm.RobotArm, which has stopped.
        servo: has `known(camera)`.
        sightings: Sightings of the run.
        now: gives the time, s.
        receive: takes in what the cameras see, waiting for so many s at most.
    """
    # Not above: the laptop, which has no motors, must report that in one line.
    from robot.motion.control_loop import Stalled

    joints = arm.description.joints
    names = [joint.name for joint in joints]
    history, seen = sightings.history, list(sightings.seen)
    if not (isinstance(error, Stalled) and error.motor.name in names and history.last):
        return str(error)
    motor, k = error.motor, names.index(error.motor.name)
    counted_at = history.joint_still_since(k, STANDSTILL_COUNTS * motor.resolution)
    try:
        q = list(arm.angles())
    except ArmError:  # its cable has been pulled since
        return str(error)
    q[k] = history.last[1][k]  # as stopped, its side of the backlash may be reported otherwise
    stopped_at = now()
    history.add(stopped_at, q)
    while now() < stopped_at + SAMPLE_TIME:
        receive(SAMPLE_PAUSE)
    backlash = [joint.backlash for joint in joints]
    by_camera = {}  # type: Dict[str, Residual]
    for camera in sorted({place[0] for place in seen}):
        known = servo.known(camera)
        ends = [s for c, t, s, _ in sightings.seen if c == camera and t > stopped_at + REST_TIME]
        if known is None or len(ends) < MIN_FRAMES:
            continue
        s = [median(column) for column in zip(*ends)]
        residuals = [
            residual_motion(known, frames, moving, q, s, k, backlash)
            for moving, frames in _anchors(seen, camera, history, counted_at)
        ]
        if residuals:
            by_camera[camera] = min(residuals, key=lambda residual: residual.uncertainty)
    turn = observed_turn(list(by_camera.values()), min(error.angle, MAX_DETECTION_ANGLE))
    return str(error) if turn is None else _stall_text(error, turn, sorted(by_camera))


def _anchors(seen, camera, history, counted_at):
    # type: (Iterable[Tuple[str, float, Pixel, bool]], str, JointHistory, float) -> Iterable[_Anchor]
    """Return a camera's frames to compare with: the last at rest, and those while it still counted.

    Args:
        seen: as Sightings.seen.
        camera: its name.
        history: JointHistory.
        counted_at: when the joint last counted, s.

    Returns:
        pairs: whether they were taken in motion; [(q, s)] of those frames.
    """
    befores = {}  # type: Dict[bool, _Seen]
    for c, t, place, moving in seen:
        before = history.at(t)
        if c == camera and (not moving or t <= counted_at) and before:
            befores.setdefault(moving, []).append((before, place))
    return [(moving, frames[-ANCHOR_FRAMES:]) for moving, frames in befores.items()]


def _stall_text(error, turn, cameras):
    # type: (Stalled, float, Sequence[str]) -> str
    """Return the message of a joint that does not count and that cameras saw turn, rad."""
    seeing = "cameras {} see" if len(cameras) > 1 else "camera {} sees"
    seeing = seeing.format(" and ".join(cameras))
    if turn == 0.0:
        return STANDS_TEXT.format(error.fact, seeing)
    motor = error.motor
    return TURNS_TEXT.format(motor.name, motor.port, seeing, abs(math.degrees(turn)))
