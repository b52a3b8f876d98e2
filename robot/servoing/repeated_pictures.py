"""Tells pictures that come again with new times from those of a still scene.  Pure.

A picture is known by where its markers are: to the last digit, the same twice, they are seen in one
and the same picture, or the camera has no noise and nothing moves. So a picture that was seen with
the joints elsewhere says nothing of where they are now.
"""

import math
from collections import OrderedDict

from robot.servoing.linear_algebra import apart
from shared.messages import EFFECTOR, GOAL

MYPY = False  # which a type checker takes for true
if MYPY:
    from typing import Dict, FrozenSet, Iterable, Optional, Tuple  # noqa: F401

    from robot.servoing.image_model import Pixel, Pose  # noqa: F401
    from shared.arm_description import Joint  # noqa: F401
    from shared.messages import Observation  # noqa: F401

    _Places = Tuple[Pixel, Optional[Pixel]]  # of the tip and of the goal
    _Right = Tuple[float, Pose]  # when a picture was right, s, and where the joints were

MAX_PICTURES = 128
"""Pictures of a camera that are kept in mind: a loop may be as long, and come whenever it will."""

MIN_TURN = math.radians(0.2)
"""Before a camera with noise, joints that have turned by more have moved, rad."""

QUIET_TURN = math.radians(1.0)
"""Before one without noise, by more than this and the greatest backlash: so far a joint may seem to
turn while the tip stands, rad."""

QUIET_RATIO = 2
"""A camera has no noise if, before a still arm, so many times more pictures repeat than differ."""

MAX_PAIRS = 200
"""Pairs of pictures of a still arm, by which that is told; then the old ones count half."""

FROZEN_TURN, FROZEN_AGE = math.radians(5), 0.12
"""A repeated picture is as old as three of a usual camera if a joint has turned by more, rad, or
it was right so long ago, s: no camera shows one picture for so long, and this one is frozen."""

FROZEN_SCORE, FROZEN_TIME, NEW_WEIGHT = 2, 0.06, 2
"""So it is where repeated pictures come to such a score over so long a time, s, each new one taking
away so many.  A picture that is shown two or three times each does not come so far."""
MAX_SCORE = 6

THAW_TIME, THAW_PICTURES = 0.3, 3
"""Its picture changes again after so long without a repeated one, s, and so many new ones: of a
loop, some may not have been seen before."""


class _Camera(object):
    """What is known of one camera."""

    def __init__(self):
        # type: () -> None
        # The markers' places, px: (when it was right, where the joints were, rad).
        self.pictures = OrderedDict()  # type: OrderedDict[_Places, _Right]
        self.last, self.last_q = None, None  # type: Optional[_Places], Optional[Pose]
        self.same = self.different = 0  # pairs of pictures of a still arm
        self.score, self.since = 0, 0.0  # of repeated ones; the time of the first, s
        self.frozen = False
        self.new, self.repeated_at = 0, 0.0  # since and when the last repeated one was taken
        self.turn = 0.0  # of the joints while the picture was the same, at most, rad


class RepeatedPictures(object):
    """The last pictures of each camera, and which cameras are frozen.

    Args:
        joints: of the arm's description.

    Attributes:
        frozen: the cameras whose pictures repeat though the joints move.
    """

    def __init__(self, joints):
        # type: (Iterable[Joint]) -> None
        self.frozen = frozenset()  # type: FrozenSet[str]
        self._quiet_turn = QUIET_TURN + max([joint.backlash for joint in joints])
        self._cameras = {}  # type: Dict[str, _Camera]

    def turn(self, camera):
        # type: (str) -> float
        """By how much a joint has turned, at most, while the picture was the same, rad."""
        return self._cameras[camera].turn

    def is_new(self, seen, q):
        # type: (Observation, Optional[Pose]) -> bool
        """Take in an Observation of joints at q (rad; None: not known); whether to go by it.

        One in which the tip is not seen says nothing, and is let pass.
        """
        tip, goal = seen.markers.get(EFFECTOR), seen.markers.get(GOAL)
        if tip is None or q is None:
            return True
        places = tip[:2], goal and goal[:2]
        camera = self._cameras.get(seen.camera)
        if camera is None:
            camera = self._cameras[seen.camera] = _Camera()
        if q == camera.last_q and not camera.score:  # as it is told of an arm that stands
            self._note_noise(camera, places)
        camera.last, camera.last_q = places, q
        before = camera.pictures.get(places)
        if before is None:
            camera.pictures[places] = seen.t, q
            if len(camera.pictures) > MAX_PICTURES:
                camera.pictures.popitem(last=False)
        moved = 0.0 if before is None else self._moved(camera, places, q, before[1])
        if before and not moved:
            camera.pictures[places] = seen.t, before[1]
        if not (moved or camera.score):  # most often by far
            return True
        self._judge(seen.camera, camera, seen.t, moved, before[0] if before else seen.t)
        return not (moved or camera.frozen)

    def _note_noise(self, camera, places):
        # type: (_Camera, _Places) -> None
        """Take in two pictures of a still arm, in turn."""
        if places == camera.last:
            camera.same += 1
        else:
            camera.different += 1
        if camera.same + camera.different > MAX_PAIRS:
            camera.same //= 2
            camera.different //= 2

    def _moved(self, camera, places, q, before):
        # type: (_Camera, _Places, Pose, Pose) -> float
        """By how much the joints have turned since they were `before`, rad; 0 if that is none."""
        camera.pictures.move_to_end(places)
        quiet = camera.same >= QUIET_RATIO * camera.different
        turn = apart(q, before)
        return turn if turn > (self._quiet_turn if quiet else MIN_TURN) else 0.0

    def _judge(self, name, camera, t, moved, right_at):
        # type: (str, _Camera, float, float, float) -> None
        """Whether it is frozen, by its picture of the time t.

        Args:
            moved: by how much a joint has turned since it was right, rad; 0 if that is none.
            right_at: the time of then; t if it is new.
        """
        if moved:
            if not camera.score:
                camera.since = t
            camera.score = min(camera.score + 1, MAX_SCORE)
            camera.new, camera.repeated_at = 0, t
            camera.turn = max(camera.turn, moved)
        else:
            camera.new += 1
            if not camera.frozen:
                camera.score = max(camera.score - NEW_WEIGHT, 0)
        if camera.frozen:
            if t - camera.repeated_at > THAW_TIME and camera.new >= THAW_PICTURES:
                camera.frozen, camera.score, camera.turn = False, 0, 0.0
                self.frozen -= {name}
        elif (
            moved
            and (moved > FROZEN_TURN or t - right_at > FROZEN_AGE)
            or (camera.score >= FROZEN_SCORE and t - camera.since >= FROZEN_TIME)
        ):
            camera.frozen = True
            self.frozen |= {name}
