"""Identification of the motors by the tip's motion in a camera's image at each jog.  Pure.

The camera looks from above.  It sees the tip, and a marker to the left of the arm.  That lies
beside the axle of the first joint with an upright axis: the shoulder, in space the base.

    place   a point of the image as a complex number, px: right, and upwards
    lever   lambda with (tip - axle) = lambda (tip - marker), complex, without unit

A turn by the angle a about the axle moves the tip along a chord c = 2 i sin(a/2) r.  Here r goes
from the axle to the middle of the arc.  So lambda = c / (2 i sin(a/2)) / (m - marker), with m the
middle of the chord.  Its size shows which joint has turned, the sign of its real part which way.
The marker's bearing gives it an angle to the left, in a mirrored picture to the right.
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
"""Minimum motion of the tip in the picture at a jog, as a multiple of the noise."""

MAX_SHAKE = 1.0
"""Tolerance of the motion of the marker on the table, beyond the noise, px."""

MAX_SLIP = 0.5
"""Share of a jog that the tip may be missing after the return, beyond the backlash."""

MIN_TURN = math.radians(2)
"""Minimum turn of the link at a jog, without its backlash, rad."""

MIN_MARKER_BEARING, MAX_MARKER_BEARING = math.radians(7), math.radians(55)
"""Bounds of the marker's bearing to the left of the arm, rad.  Below, a slanting camera may be the
cause."""

MAX_SCALE = 2.0
"""Tolerance of the tip's motion, a factor either way: the camera slants, lengths are guessed, the
marker lies before or behind the axle."""

MAX_FIT_ERROR, MIN_FIT_MARGIN = math.log(1.6), math.log(1.5)
"""Bounds of the fit of the jogs to the joints, logarithms of a ratio: its maximum error, and the
least by which the other order of joints must fit worse."""

MAX_BEND = math.radians(35)
"""Maximum angle between the tip's motions by shoulder and elbow, rad: beyond, the arm is bent."""

CHECK_AGAIN = "; then check again"
"""End of the messages that ask for another check."""

PLACE_MARKER = "put the marker goal to the left of the {}'s axle, a hand's width away"
"""Advice on the marker, with the joint's name."""

if MYPY:
    View = NamedTuple("View", [("tip", complex), ("base", complex), ("noise", float)])
    Jog = NamedTuple("Jog", [("before", View), ("away", View), ("back", View), ("turn", float)])
else:
    View = record("View", "tip base noise")
    Jog = record("Jog", "before away back turn")
View.__doc__ = """An arm at rest, as seen by the camera.

tip, base  places of the markers effector and goal, px
noise      of each, px
"""

Jog.__doc__ = """One motor's jog: Views before, away and back; the angle of its return.

turn  angle of the return of the joint that the motor should turn, rad
"""


class NotSeen(ArmError):
    """A picture that does not show what has moved; the message has the reason."""


def place(pixel):
    # type: (Sequence[float]) -> complex
    """Return (u, v), px, v downwards, as a complex number, upwards."""
    return complex(pixel[0], -pixel[1])


def check_size(arm, view):
    # type: (Arm, View) -> None
    """Raise NotSeen for a picture in which the smallest jog would not exceed the noise."""
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
        needed, motion = MIN_SIGNAL_TO_NOISE * 2 * view.noise, turn * share * reach
        if share and motion < needed:
            raise NotSeen(
                "in the picture tip and marker goal are only {:.0f} px apart: the {} would move the"
                " tip by {:.1f} px, and {:.1f} are needed beside the noise; bring the camera nearer"
                ", or give it more light".format(reach, joint.name, motion, needed)
            )


def has_moved(jog):
    # type: (Jog) -> bool
    """Return whether the tip moved by more than the noise.

    Raises:
        NotSeen: the marker on the table moved, too.
    """
    noise = jog.away.noise + jog.back.noise
    moved = abs(jog.back.tip - jog.away.tip) > noise
    bases = [view.base for view in (jog.before, jog.away, jog.back)]
    shift = max([abs(a - b) for a, b in itertools.combinations(bases, 2)])
    if shift > noise + MAX_SHAKE:
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
    """Raise NotSeen for a tip that has not come back, apart from the `joint`'s backlash."""
    went, came = jog.away.tip - jog.before.tip, jog.back.tip - jog.away.tip
    backlash = min(joint.backlash / max(abs(jog.turn) - joint.backlash, MIN_TURN), 1.0)
    missing = abs(went + came)
    if missing > (backlash + MAX_SLIP) * abs(came) + jog.before.noise + jog.back.noise:
        raise NotSeen(
            "at the motor at port {} the tip went by {:.0f} px and came back by {:.0f}: somebody "
            "touched it, it slips, or its play is far beyond backlash = {:g} of [{}]; see to that{}"
            "".format(
                joint.port, abs(went), abs(came), math.degrees(joint.backlash), joint.name,
                CHECK_AGAIN
            )
        )  # fmt: skip


def lever(jog, backlash):
    # type: (Jog, float) -> Optional[complex]
    """Return the lever of the return, which crosses the backlash; None: nothing moved.

    Args:
        jog: Jog.
        backlash: of the joint, rad.
    """
    if not has_moved(jog):
        return None
    turn = jog.turn - math.copysign(min(backlash, abs(jog.turn) - MIN_TURN), jog.turn)
    chord = jog.back.tip - jog.away.tip
    middle = (jog.back.tip + jog.away.tip) / 2
    return chord / (2j * math.sin(turn / 2)) / (middle - jog.back.base)


def recognised(arm, jogs):
    # type: (Arm, Sequence[Jog]) -> Recognised
    """Identify the part that each motor moved.

    Args:
        arm: shared.arm_description.Arm.
        jogs: a Jog per joint of the arm's description.

    Returns:
        (a mounting.Observed per motor, None where one camera cannot identify it; the reason, a
        sentence or "")

    Raises:
        NotSeen, NotMounted: the jogs do not fit the arm, for the reason in the message.
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
    """Return the lever arm of each joint, stretched, as a share of the first one's."""
    if arm.chain in PULLED_DOWN:
        return [1.0] + [0.0] * (len(arm.joints) - 1)
    lengths = [joint.link for joint in arm.joints]
    return [sum(lengths[k:]) / sum(lengths) for k in range(len(lengths))]


def _pair_of(arm, levers):
    # type: (Arm, Sequence[complex]) -> Recognised
    """Identify shoulder and elbow by the ratio of their lever arms."""
    bend = abs(_folded(levers[1] / levers[0]))
    if bend > MAX_BEND:
        raise NotSeen(
            "the two motors moved the tip in ways {:.0f} deg apart: the arm is bent, or the camera "
            "looks from aside; lay the arm straight under it{}".format(
                math.degrees(bend), CHECK_AGAIN
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
    """Identify the base of an arm in space, which alone moves the tip round the marker.

    Shoulder and elbow move the tip to and fro in the same upright plane, by a distance that depends
    on the pose: one camera cannot distinguish them.
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
    """Raise NotSeen for a marker whose bearing `off` (rad) does not exclude a mirrored picture."""
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
    """Return the angle of a lever irrespective of the motor's direction, rad: -pi/2 .. pi/2."""
    off = cmath.phase(lever)
    return off - math.copysign(math.pi, off) if abs(off) > math.pi / 2 else off


def in_words(camera, port, seen):
    # type: (str, str, Observed) -> str
    """Return a line for people on the part that a motor moved."""
    return "camera {}: the motor at port {} moved the {}, {} first".format(
        camera, port, seen.part, "left" if seen.positive else "right"
    )
