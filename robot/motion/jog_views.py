"""Which motor turns what, and which way, by how a camera sees the tip move at each jog.  Pure.

The camera looks from above. It sees the tip, and beside the axle of the first joint that turns
about an upright axis (the shoulder, in space the base) a marker that lies to the left of the arm.

    place   a point of the image as a complex number, px: right, and upwards
    lever   by what the way from that marker to the tip must be multiplied to be the way from the
            axle that the tip was seen to go round: its size tells which joint turned, its sign
            which way. The marker turns it to the left; in a mirrored picture, to the right.
"""

import cmath
import itertools
import math

from robot.motion.mounting import Observed, jog_angles, nothing_moved
from shared.arm_description import ArmError
from shared.arm_keys import PULLED_DOWN
from shared.record import record

MYPY = False
if MYPY:
    from typing import List, NamedTuple, Optional, Sequence, Tuple  # noqa: F401

    from shared.arm_description import Arm, Joint  # noqa: F401

    Recognised = Tuple[List[Optional[Observed]], str]  # see `recognised`

MIN_SIGNAL_TO_NOISE = 3.0
"""Each jog is to move the tip in the picture by so many times what may be chance."""

MAX_SHAKE = 1.0
"""A marker that lies may seem to move by so much more when the arm beside it does, px."""

MAX_SLIP = 0.5
"""Share of a jog that the tip may fail to come back by, beside what the play takes."""

MIN_TURN = math.radians(2)
"""What the play leaves of a jog is enough from here on, rad."""

MIN_MARKER_BEARING, MAX_MARKER_BEARING = math.radians(7), math.radians(55)
"""From here to there the marker lies to the left of the arm, as seen from the tip, rad. Nearer to
its line it might be a slanting camera that shows it there."""

MAX_SCALE = 2.0
"""So many times too far, or too little, the tip may be seen to go: a camera slants, lengths are
guessed, the marker lies somewhat before or behind the axle."""

MAX_FIT_ERROR, MIN_FIT_MARGIN = math.log(1.6), math.log(1.5)
"""The jogs fit the joints if their sizes are to one another as described up to this factor, and if
in another order the joints fit worse by that one."""

MAX_BEND = math.radians(35)
"""The tip goes different ways round shoulder and elbow by so much: the arm is bent, rad."""

CHECK_AGAIN = "; then check again"
PLACE_MARKER = "put the marker goal to the left of the {}'s axle, a hand's width away"

if MYPY:
    View = NamedTuple("View", [("tip", complex), ("base", complex), ("doubt", float)])
    Jog = NamedTuple("Jog", [("before", View), ("there", View), ("back", View), ("turn", float)])
else:
    View = record("View", "tip base doubt")
    Jog = record("Jog", "before there back turn")
View.__doc__ = """What a look at an arm that stands has shown.

tip, base  places of the markers effector and goal
doubt      by which each may be off by chance, px
"""

Jog.__doc__ = """One motor's jog: Views before, between and after; the angle by which it came back.

turn  as the joint would have turned that should be the motor's, rad
"""


class NotSeen(ArmError):
    """What the camera shows does not tell what moved; the message says why not."""


def place(pixel):
    # type: (Sequence[float]) -> complex
    """The place of (u, v), px, v pointing down."""
    return complex(pixel[0], -pixel[1])


def check_size(arm, view):
    # type: (Arm, View) -> None
    """Refuse (NotSeen) a picture in which the least jog would drown in the noise."""
    reach = abs(view.tip - view.base)
    for k, (joint, share) in enumerate(zip(arm.joints, _shares(arm))):
        turn = jog_angles(arm, k)[-1] - joint.backlash
        if share and turn < MIN_TURN:
            raise NotSeen(
                "the play of the {}, backlash = {:g} in {}, takes a jog of {:g} deg nearly whole; "
                "look yourself, without --camera".format(
                    joint.name,
                    math.degrees(joint.backlash),
                    arm.file,
                    math.degrees(jog_angles(arm, k)[-1]),
                )
            )
        least, moves = MIN_SIGNAL_TO_NOISE * 2 * view.doubt, turn * share * reach
        if share and moves < least:
            raise NotSeen(
                "in the picture tip and marker goal are only {:.0f} px apart: the {} would move the"
                " tip by {:.1f} px, and {:.1f} are needed beside the noise; bring the camera nearer"
                ", or give it more light".format(reach, joint.name, moves, least)
            )


def has_moved(jog):
    # type: (Jog) -> bool
    """Whether the tip was seen to move more than by chance.

    Raises:
        NotSeen: something else moved, too, or the tip does not come back.
    """
    doubt = jog.there.doubt + jog.back.doubt
    moved = abs(jog.back.tip - jog.there.tip) > doubt
    bases = [view.base for view in (jog.before, jog.there, jog.back)]
    shift = max([abs(a - b) for a, b in itertools.combinations(bases, 2)])
    if shift > doubt + MAX_SHAKE:
        if not moved:
            raise NotSeen(
                "the motor moved the marker goal, and the marker effector stood: they are "
                "exchanged; put effector on the tip, and goal beside the arm" + CHECK_AGAIN
            )
        raise NotSeen(
            "the marker goal moved by {:.1f} px, too: camera, table or marker were touched, or it "
            "does not lie on the table; leave them alone{}".format(shift, CHECK_AGAIN)
        )
    return moved


def check_return(jog, joint):
    # type: (Jog, Joint) -> None
    """Refuse (NotSeen) a tip that has not come back as far as the `joint`'s play lets it."""
    went, came = jog.there.tip - jog.before.tip, jog.back.tip - jog.there.tip
    play = min(joint.backlash / max(abs(jog.turn) - joint.backlash, MIN_TURN), 1.0)
    missing = abs(went + came)
    if missing > (play + MAX_SLIP) * abs(came) + jog.before.doubt + jog.back.doubt:
        raise NotSeen(
            "at the motor at port {} the tip went by {:.0f} px and came back by {:.0f}: somebody "
            "touched it, it slips, or its play is far beyond backlash = {:g} of [{}]; see to that{}"
            "".format(
                joint.port, abs(went), abs(came), math.degrees(joint.backlash), joint.name,
                CHECK_AGAIN
            )
        )  # fmt: skip


def lever(jog, play):
    # type: (Jog, float) -> Optional[complex]
    """The lever that the way back shows, whose play is crossed for certain; None: nothing moved.

    Args:
        play: of the joint, rad.
    """
    if not has_moved(jog):
        return None
    turn = jog.turn - math.copysign(min(play, abs(jog.turn) - MIN_TURN), jog.turn)
    chord = jog.back.tip - jog.there.tip
    middle = (jog.back.tip + jog.there.tip) / 2  # the way to it turns by half of the whole turn
    return chord / (2j * math.sin(turn / 2)) / (middle - jog.back.base)


def recognised(arm, jogs):
    # type: (Arm, Sequence[Jog]) -> Recognised
    """What each motor moved.

    Args:
        jogs: a Jog per joint of the arm's description.

    Returns:
        (a mounting.Observed per motor, None where the camera cannot tell; why not, a sentence or
        "")

    Raises:
        NotSeen, NotMounted: it could tell, were it not for what the message says.
    """
    levers = [lever(jog, joint.backlash) for jog, joint in zip(jogs, arm.joints)]
    if not any(levers):
        raise NotSeen(
            "each motor turned, and what the tracker takes for the marker effector stood: put that "
            "on the tip, and look at what the tracker shows" + CHECK_AGAIN
        )
    for jog, joint, seen in zip(jogs, arm.joints, levers):
        if seen is not None:
            check_return(jog, joint)
    if arm.chain in PULLED_DOWN:
        return _base_of(arm, levers)
    for joint, seen in zip(arm.joints, levers):
        if seen is None:
            if arm.pen and arm.pen.motor in [one.motor for one in arm.joints]:
                return [None] * len(levers), (
                    "the tip stood when the motor at port {} turned: it may be the pen's, which "
                    "moves it up and down, and the camera looks from above".format(joint.port)
                )
            raise nothing_moved(arm, joint)
    return _pair_of(arm, [seen for seen in levers if seen is not None])


def _shares(arm):
    # type: (Arm) -> List[float]
    """How far each joint moves the tip, stretched, as a share of what the first one does."""
    if arm.chain in PULLED_DOWN:
        return [1.0] + [0.0] * (len(arm.joints) - 1)
    lengths = [joint.link for joint in arm.joints]
    return [sum(lengths[k:]) / sum(lengths) for k in range(len(lengths))]


def _pair_of(arm, levers):
    # type: (Arm, Sequence[complex]) -> Recognised
    """Shoulder and elbow, told apart by how far each moves the tip."""
    bent = abs(_folded(levers[1] / levers[0]))
    if bent > MAX_BEND:
        raise NotSeen(
            "the two motors moved the tip in ways {:.0f} deg apart: the arm is bent, or the camera "
            "looks from aside; lay the arm straight under it{}".format(
                math.degrees(bent), CHECK_AGAIN
            )
        )
    shares, gears = _shares(arm), [joint.gear for joint in arm.joints]
    sizes = [abs(one) for one in levers]
    spreads, ratios = [], []
    for order in ((0, 1), (1, 0)):
        wanted = [gears[k] / gears[j] * shares[j] for k, j in enumerate(order)]
        ratios.append(wanted[0] / wanted[1])
        spreads.append(abs(math.log(sizes[0] / sizes[1] / ratios[-1])))
    if min(spreads) > MAX_FIT_ERROR or abs(spreads[0] - spreads[1]) < MIN_FIT_MARGIN:
        why = (
            "the motor at port {} moved the tip {:.2f} times as far as the one at {}; by the links "
            "and gears of {} it is {:.2f} times as they are, and {:.2f} times swapped: the camera "
            "cannot tell which it is"
        )
        ports = [joint.port for joint in arm.joints]
        return [None, None], why.format(
            ports[0], sizes[0] / sizes[1], ports[1], arm.file, *ratios
        )  # fmt: skip
    order = (0, 1) if spreads[0] < spreads[1] else (1, 0)
    first = order.index(0)
    first_lever = levers[first] * gears[0] / gears[first]
    off = _folded(first_lever)
    _check_side(arm, off)
    scale = abs(first_lever) / math.cos(off)
    if not 1 / MAX_SCALE < scale < MAX_SCALE:
        raise NotSeen(
            "the {} moved the tip {:.1f} times as far as it should round an axle beside the marker "
            "goal: that lies elsewhere, or gear or link are other than {} says; {}{}".format(
                arm.joints[0].name,
                scale,
                arm.file,
                PLACE_MARKER.format(arm.joints[0].name),
                CHECK_AGAIN,
            )
        )
    ahead = cmath.rect(1.0, off)
    return [
        Observed(arm.joints[j].name, (seen / ahead).real > 0) for j, seen in zip(order, levers)
    ], ""


def _base_of(arm, levers):
    # type: (Arm, Sequence[Optional[complex]]) -> Recognised
    """The base of an arm in space, which alone moves the tip round the marker.

    Shoulder and elbow move it to and fro in the same upright plane, and how far depends on the
    pose: one camera does not tell one from the other.
    """
    base = arm.joints[0]
    found = []
    for k, seen in enumerate(levers):
        if seen is None:
            continue
        turned = seen * base.gear / arm.joints[k].gear
        off = _folded(turned)
        if (
            abs(off) < MAX_MARKER_BEARING
            and 1 / MAX_SCALE < abs(turned) / math.cos(off) < MAX_SCALE
        ):
            found.append((k, turned, off))
    others = " and ".join(joint.name for joint in arm.joints[1:])
    observed = [None] * len(levers)  # type: List[Optional[Observed]]
    if len(found) != 1:
        return observed, (
            "the camera does not tell the {} from {}: {} motors moved the tip round the marker "
            "goal".format(base.name, others, len(found) or "none of the")
        )
    ((k, turned, off),) = found
    _check_side(arm, off)
    observed[k] = Observed(base.name, (turned / cmath.rect(1.0, off)).real > 0)
    return observed, (
        "{} move the tip in one upright plane, and a camera above it does not tell which of them "
        "does, nor whether up or down".format(others)
    )


def _check_side(arm, off):
    # type: (Arm, float) -> None
    """Refuse a marker that does not show, by the `lever`'s angle (rad), whether all is mirrored."""
    name = arm.joints[0].name
    if abs(off) > MAX_MARKER_BEARING:
        raise NotSeen(
            "the {} moved the tip, as seen, {:.0f} deg aside of the way round the marker goal: that"
            " lies elsewhere, or the camera looks from the side; {}, and let it look from above{}"
            "".format(name, math.degrees(abs(off)), PLACE_MARKER.format(name), CHECK_AGAIN)
        )
    if abs(off) < MIN_MARKER_BEARING:
        raise NotSeen(
            "the marker goal lies in one line with the arm, so it would not show if the picture was"
            " mirrored; {}, as one looks along the arm{}".format(
                PLACE_MARKER.format(name), CHECK_AGAIN
            )
        )
    if off < 0:
        raise NotSeen(
            "the marker goal is seen to the right of the arm: either the picture is mirrored, or "
            "the camera looks from below, or the marker lies there; let the picture be as one sees "
            "it from above, or {}{}".format(PLACE_MARKER.format(name), CHECK_AGAIN)
        )


def _folded(lever):
    # type: (complex) -> float
    """The angle of a lever whichever way the motor turned, rad: from -90 to 90 deg."""
    off = cmath.phase(lever)
    return off - math.copysign(math.pi, off) if abs(off) > math.pi / 2 else off


def in_words(camera, port, seen):
    # type: (str, str, Observed) -> str
    """One line of what a motor was seen to move."""
    return "camera {}: the motor at port {} moved the {}, {} first".format(
        camera, port, seen.part, "left" if seen.positive else "right"
    )
