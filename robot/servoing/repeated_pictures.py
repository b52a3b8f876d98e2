"""Repeated pictures, with new times, told apart from those of a still scene.  Pure.

A picture is identified by where its markers are.  If these are the same to the last digit twice,
they are seen in one and the same picture, or the camera has no noise and nothing moves.  So a
picture that was seen with the joints elsewhere says nothing of where they are now.
"""

import math
from collections import OrderedDict

from robot.servoing.linear_algebra import distance
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
"""Pictures of a camera that are stored: a loop may be as long, and come whenever it will."""

MIN_TURN = math.radians(0.2)
"""Turn beyond which joints have moved, before a camera with noise, rad."""

QUIET_TURN = math.radians(1.0)
"""Turn beyond which, and the greatest backlash, joints have moved before a camera without noise,
rad: so far a joint may seem to turn while the tip stands."""

QUIET_RATIO = 2
"""Least ratio of repeated to different pictures of a still arm before a camera without noise."""

MAX_PAIRS = 200
"""Pairs of pictures of a still arm, by which that is decided; beyond it the old ones count half."""

FROZEN_TURN, FROZEN_AGE = math.radians(5), 0.12
"""Turn of a joint, rad, and age, s, at which a single repeated picture shows that the camera is
frozen: three pictures of a usual camera come in that time."""

FROZEN_SCORE, FROZEN_TIME, NEW_WEIGHT = 2, 0.06, 2
"""Score of repeated pictures at which a camera is frozen, the time over which it must last, s, and
what each new picture takes away. Pictures that are shown two or three times each stay below."""
MAX_SCORE = 6
"""Cap of the score."""

THAW_TIME, THAW_PICTURES = 0.3, 3
"""Time without a repeated picture, s, and number of new ones in it, after which a frozen camera is
not any more: of a loop, some may not have been seen before."""


# The test is sequential.  Its hypotheses: the camera is live, or frozen (stuck, or showing a loop).
# Live, with noise: two pictures agree to the last digit of every place hardly ever, so a repeat
# though the joints have turned by MIN_TURN is evidence.  Live, without noise: repeats are usual
# before an arm that stands.  Pairs of pictures at equal q tell the two apart: `same` against
# `different`, QUIET_RATIO to 1; without noise a repeat must span QUIET_TURN and the backlash.
#
# The score is a one-sided cumulative sum (Page 1954): 1 more for each repeat, NEW_WEIGHT less for
# each new picture, never below 0.  A camera is frozen at FROZEN_SCORE, if that lasts FROZEN_TIME;
# at once if a single repeat spans FROZEN_TURN or FROZEN_AGE.  Repeats in a row would miss a loop
# with pictures that were never sampled; a share of a window would be known only when it is over.


class _Camera(object):
    """The pictures and the score of one camera."""

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
        """Return by how much a joint has turned, at most, while the picture was the same, rad."""
        return self._cameras[camera].turn

    def is_new(self, seen, q):
        # type: (Observation, Optional[Pose]) -> bool
        """Add an Observation of joints at q (rad, or None: not known); return whether to go by it.

        One in which the tip is not seen says nothing, and is let pass.
        """
        tip, goal = seen.markers.get(EFFECTOR), seen.markers.get(GOAL)
        if tip is None or q is None:
            return True
        places = tip[:2], goal and goal[:2]
        camera = self._cameras.get(seen.camera)
        if camera is None:
            camera = self._cameras[seen.camera] = _Camera()
        if q == camera.last_q and not camera.score:  # as it is reported of an arm that stands
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
        """Count two pictures of a still arm, in turn, as same or different."""
        if places == camera.last:
            camera.same += 1
        else:
            camera.different += 1
        if camera.same + camera.different > MAX_PAIRS:
            camera.same //= 2
            camera.different //= 2

    def _moved(self, camera, places, q, before):
        # type: (_Camera, _Places, Pose, Pose) -> float
        """Return the turn of the joints since they were `before`, rad; 0 if that is none."""
        camera.pictures.move_to_end(places)
        quiet = camera.same >= QUIET_RATIO * camera.different
        turn = distance(q, before)
        return turn if turn > (self._quiet_turn if quiet else MIN_TURN) else 0.0

    def _judge(self, name, camera, t, moved, right_at):
        # type: (str, _Camera, float, float, float) -> None
        """Update a camera's score, and whether it is frozen, by its newest picture.

        Args:
            name: of the camera.
            camera: its pictures and score.
            t: time of the picture, s.
            moved: by how much a joint has turned since it was right, rad; 0 if that is none.
            right_at: when it was right, s; t if it is new.
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
