"""Hand guiding of the arm's tip, against motors that coast; `--hand "10,5@2 12,0@5"`.

The tip is at each place at its time and stays until it has to leave.  The hand is far stronger than
a motor that coasts, so it gives the links their speeds, and the rotors follow through gears and
backlash.  It waits where a motor holds, brakes or is driven.  After that it leads as fast as it
may, as a person does before a program that has not released its motors yet.
"""

import math
import re
from typing import Callable, List, NamedTuple, Sequence, Tuple

from robot.motion import kinematics
from shared.arm_description import ArmError
from shared.message_fields import one_line

MYPY = False
if MYPY:
    from typing import Set  # noqa: F401

    from laptop.emulator.device.motor_and_link import DrivenLink  # noqa: F401
    from shared.arm_description import Arm  # noqa: F401

    Angles = Tuple[float, ...]  # of the joints, rad


LEAD_SPEED, MAX_SPEED = math.radians(60), math.radians(240)
"""Usual and greatest speed at which the hand turns a joint, rad/s."""

MAX_ORDER_TIME = 1e6
"""Latest time that may be ordered, s."""


class BadHand(ArmError, ValueError):
    """A path of the hand that cannot be understood, or cannot be followed."""


HandPlace = NamedTuple("HandPlace", [("p", Tuple[float, float]), ("t", float)])
HandPlace.__doc__ = """A place of the tip, (x, y), cm, and the time by which it is there, s."""


def read_hand(text: str) -> List[HandPlace]:
    """Read the places of a hand's path from `X,Y@S X,Y@S ...`.

    Raises:
        BadHand: it is none.
    """
    places = []  # type: List[HandPlace]
    for word in text.split():
        match = re.match(r"^([^,@]+),([^,@]+)@([^,@]+)$", word)
        try:
            x, y, t = (float(part) for part in match.groups()) if match else (math.nan,) * 3
        except ValueError:
            x = y = t = math.nan
        if not all(map(math.isfinite, (x, y, t))):
            raise BadHand(
                "hand '{}': write X,Y@SECONDS, like 10,5@2, in cm from the shoulder".format(
                    one_line(word)
                )
            )
        least = places[-1].t if places else 0.0
        if not least < t <= MAX_ORDER_TIME:
            raise BadHand(
                "hand '{}': its time must be above {:g} and up to {:g} s; times rise".format(
                    one_line(word), least, MAX_ORDER_TIME
                )
            )
        places.append(HandPlace((x, y), t))
    if not places:
        raise BadHand("hand '': no place; write X,Y@SECONDS, like 10,5@2")
    return places


def _eased(share: float) -> float:
    """Return the share of a move at a share of its time, by minimum jerk (Flash, Hogan 1985)."""
    share = min(max(share, 0.0), 1.0)
    return share * share * share * (10 + share * (6 * share - 15))


class HandGuiding(object):
    """The hand that guides one arm.

    Args:
        arm: its description, as it was built.
        links: the joints' DrivenLinks, from the base outwards.
        coasts: whether the motor of a joint coasts, by the joint's number.
        places: from `read_hand`.
        now: time at which the hand begins, s.

    Raises:
        BadHand: the tip cannot get there, or not in that time.
    """

    def __init__(
        self,
        arm: "Arm",
        links: Sequence["DrivenLink"],
        coasts: Callable[[int], bool],
        places: Sequence[HandPlace],
        now: float = 0.0,
    ) -> None:
        if kinematics.coordinates(arm) != 2:
            raise BadHand(
                "a hand leads an arm in the plane; {} is in space, and drops where its motors let "
                "go".format(arm.name)
            )
        self._links = links
        self._coasts = coasts
        self._led = set()  # type: Set[int]
        q = tuple([link.angle for link in self._links])
        # (begin, end, from, to): s and rad
        self._moves = []  # type: List[Tuple[float, float, Angles, Angles]]
        left = now
        for place in places:
            to = self._pose(arm, place, q)
            far = max(abs(b - a) for a, b in zip(q, to))
            least = 1.9 * far / MAX_SPEED  # the greatest speed is 15/8 of the mean one
            if place.t - left < least:
                raise BadHand(
                    "hand {:g},{:g}@{:g}: it cannot be there before {:.1f} s; give a later "
                    "time".format(place.p[0], place.p[1], place.t, left + least + 0.05)
                )
            begin = max(left, place.t - max(1.9 * far / LEAD_SPEED, 0.1))
            self._moves.append((begin, place.t, q, to))
            q, left = to, place.t

    @staticmethod
    def _pose(arm: "Arm", place: HandPlace, near: "Angles") -> "Angles":
        try:
            return kinematics.inverse(arm, place.p, near=near)
        except ArmError as problem:
            raise BadHand("hand {:g},{:g}@{:g}: {}".format(
                place.p[0], place.p[1], place.t, problem
            )) from None  # fmt: skip

    def pose(self, t: float) -> "Angles":
        """Return the joint angles to which the hand leads at the time `t` (s), rad."""
        begin, end, start, goal = self._moves[0]
        for move in self._moves:
            if move[0] > t:
                break
            begin, end, start, goal = move
        share = _eased((t - begin) / (end - begin))
        return tuple([a + share * (b - a) for a, b in zip(start, goal)])

    def guide(self, t: float, h: float) -> None:
        """Set the speeds of the links that it leads, for a step of `h` s that ends at `t`."""
        leads = t > self._moves[0][0]
        for k, (link, wanted) in enumerate(zip(self._links, self.pose(t))):
            if link.jammed:
                continue
            if leads and self._coasts(k):
                link.imposed = min(max((wanted - link.angle) / h, -MAX_SPEED), MAX_SPEED)
                link.speed = link.imposed
                self._led.add(k)
            elif k in self._led:
                link.imposed = None
                self._led.discard(k)

    def release(self) -> None:
        """Stop leading."""
        for k in self._led:
            if not self._links[k].jammed:
                self._links[k].imposed = None
        self._led.clear()
