"""State of a brick when a program starts: its files, its arms, the arm's pose."""

import contextlib
import csv
import json
import math
import os
import random
import shutil
import time
from typing import Iterator, List, Optional, Sequence, Tuple, Union

from laptop.emulator.brick_environment import BRICK_STATE, brick_environment
from laptop.emulator.faults import InvalidSimulationOption
from laptop.record.names import RUN, TRACE
from robot.motion import kinematics
from robot.motion.checked import Checked
from robot.motion.zero import Zero
from robot.tracker_address import Memory, ServerAddress
from shared.message_fields import one_line
from shared.messages import PORT
from shared.state import ARM, LOCK, MOTORS_FILE, OWN_ARMS_FOLDER, PLAN, STATE, state_folder

MYPY = False
if MYPY:
    from laptop.emulator.faults import WatchingTracker  # noqa: F401
    from laptop.emulator.host.world import World  # noqa: F401
    from robot.motion.chains import FixedPoint  # noqa: F401
    from shared.arm_description import Arm  # noqa: F401
    from shared.job_pieces import Piece  # noqa: F401

    Start = Union[str, Sequence[float]]
    Angles = Tuple[float, ...]  # of the joints, rad


AFTER = "after:"
"""Prefix of a start that another run leaves."""

UNCHECKED = "unchecked"
"""Start of an arm at home whose motors nobody has checked yet."""

RECORD_POLL_PERIOD = 0.02
"""Period of the checks whether that run is over, s."""

LAPTOP = "127.0.0.1"
"""Host of a tracker beside the brick."""

POINTS_PER_SEGMENT = 2
"""Number of straight parts, between two knots, of the wanted path as it is shown."""


def read_start(text: "Start", arm: Optional["Arm"]) -> Tuple[Optional["Angles"], bool]:
    """Read a start: joint angles (rad), and whether the zero is known.

    Args:
        text: `home`, `lost`, `unchecked`, `DEG,DEG,...`, or `after:FOLDER`: where the run ends that
            leaves its files there, which is waited for.  Or the angles themselves, rad.
        arm: Arm; None for a brick without one.

    Raises:
        InvalidSimulationOption: it is none of these.
    """
    if arm is None:
        if text != "home":
            raise InvalidSimulationOption(
                "start '{}': there is no arm to be there; leave --start out".format(
                    one_line(str(text))
                )
            )
        return None, False
    if not isinstance(text, str):
        return tuple(text), True
    if text.startswith(AFTER):
        return _end_of(text[len(AFTER) :], arm), True
    if text in ("home", UNCHECKED):
        return tuple(joint.home for joint in arm.joints), text == "home"
    if text == "lost":
        draw = random.Random(1)
        return tuple(draw.uniform(joint.lower, joint.upper) / 2 for joint in arm.joints), False
    try:
        angles = tuple(math.radians(float(part)) for part in text.split(","))
    except ValueError:
        angles = ()
    if len(angles) != len(arm.joints) or not all(
        joint.lower <= angle <= joint.upper for joint, angle in zip(arm.joints, angles)
    ):
        raise InvalidSimulationOption(
            "start '{}': write home, lost, unchecked, after:FOLDER, or one angle in deg per joint "
            "within {}".format(
                text,
                " and ".join(
                    "{:g}..{:g}".format(math.degrees(j.lower), math.degrees(j.upper))
                    for j in arm.joints
                ),
            )
        )
    return angles, True


def _end_of(folder: str, arm: "Arm") -> "Angles":
    """Wait for a run's record; return its last joint angles, rad, within the limits."""
    while not os.path.exists(os.path.join(folder, RUN)):
        time.sleep(RECORD_POLL_PERIOD)
    try:
        with open(os.path.join(folder, TRACE), newline="") as file:
            *_, last = csv.DictReader(file)
        angles = [float(last["q{}".format(k)]) for k in range(1, len(arm.joints) + 1)]
    except (OSError, ValueError, KeyError, TypeError):
        raise InvalidSimulationOption(
            "start '{}{}': there is no trace of this arm; give the --out of another run".format(
                AFTER, folder
            )
        ) from None
    return tuple(min(max(a, j.lower), j.upper) for a, j in zip(angles, arm.joints))


def park_on_file(arm: "Arm", q: Sequence[float], folder: str, fineness: float = 1) -> Zero:
    """Leave the state in `folder` of an arm parked at `q` (rad), pen up, where its encoders read 0.

    Somebody has looked which motor is where.

    Args:
        arm: that is parked.
        q: its joint angles, rad.
        folder: of the state.
        fineness: counts per degree of the motors' encoders.

    Returns:
        The robot.motion.zero.Zero.
    """
    turns = {j.port: -a * j.gear * j.direction for j, a in zip(arm.joints, q)}
    if arm.pen:
        turns[arm.pen.port] = -arm.pen.up
    state = Zero(arm, folder)
    state.save(
        {p: fineness * math.degrees(turn) for p, turn in turns.items()}, dict.fromkeys(turns, 0)
    )
    Checked(arm, folder).save({})
    return state


def prepare_home(
    folder: str,
    arm: Optional["Arm"],
    q: Optional["Angles"],
    start: "Start",
    homed: bool,
    fineness: float = 1,
) -> None:
    """Write the state of a brick that is switched on.

    Args:
        folder: its state folder.
        arm: Arm that programs are to drive; None for a brick without one.
        q: where it stands, rad.
        start: as for `read_start`.
        homed: whether its zero is known.
        fineness: counts per degree of the motors' encoders.
    """
    _copy_own_arms(folder)
    if arm is None or q is None:
        return
    if homed:
        park_on_file(arm, q, folder, fineness)
    elif start != UNCHECKED:
        Checked(arm, folder).save({})


@contextlib.contextmanager
def at_home(
    folder: str, world: "World", arm: Optional["Arm"], tracker: Optional["WatchingTracker"]
) -> Iterator[None]:
    """Have the environment of a program on the brick, for a `with` block.

    Args:
        folder: the brick's state, see `prepare_home`.
        world: of the brick.
        arm: as the brick is told, or None.
        tracker: one on this machine, which the brick remembers, or None.
    """
    environment = {STATE: BRICK_STATE, PLAN: BRICK_STATE + "/plan"}
    if arm is not None:
        environment[ARM] = os.path.abspath(arm.file)
    if tracker:
        # Ahead of what is remembered goes where ssh came from: the laptop, that is.
        environment["SSH_CLIENT"] = "{} 0 22".format(LAPTOP)
        # Whichever port is free here, the brick calls the one that it would call.
        world.addresses[LAPTOP, PORT] = LAPTOP, tracker.port
        Memory(folder).save(ServerAddress(LAPTOP, PORT, tracker.code), tracker.key)
    if world.realtime and arm is not None:
        # All programs that run in real time want the one arm that the cameras see.
        environment[LOCK] = os.path.join(os.path.abspath(state_folder()), MOTORS_FILE)
    with brick_environment(environment):
        yield


def _copy_own_arms(folder: str) -> None:
    """Let the brick with its state in `folder` know the arms of one's own; it keeps no others."""
    source, target = (os.path.join(place, OWN_ARMS_FOLDER) for place in (state_folder(), folder))
    os.makedirs(target, 0o700, exist_ok=True)
    if not os.path.isdir(source):
        return
    for name in os.listdir(source):
        file = os.path.join(source, name)
        if name.endswith(".ini") and os.path.isfile(file) and os.access(file, os.R_OK):
            shutil.copyfile(file, os.path.join(target, name))


def wanted_paths(file: str, arm: Optional["Arm"]) -> List[List[Tuple[float, ...]]]:
    """Read the paths of an arm's tip in a file, one JSON line each; return [] if there is none.

    A line holds points, cm, or is a stroke's of a job.  That is followed here, for a brick that
    nobody watches need not do it.
    """
    if not os.path.exists(file):
        return []
    with open(file) as lines:
        paths = []  # type: List[List[Tuple[float, ...]]]
        for number, line in enumerate(lines, 1):
            try:
                said = json.loads(line)
                points = _points_along(said["pieces"], arm) if "pieces" in said else said["path"]
                paths.append([(float(x), float(y), *map(float, rest)) for x, y, *rest in points])
            except (ValueError, KeyError, TypeError, AttributeError):
                raise InvalidSimulationOption(
                    'line {} of $BRICKSERVO_PLAN is not {{"path": [[x, y], ...]}}; '
                    "correct the script that wrote it".format(number)
                ) from None
    return paths


def _points_along(pieces: Sequence["Piece"], arm: Optional["Arm"]) -> List["FixedPoint"]:
    """Return points (x, y) or (x, y, z) along pieces, cm."""
    assert arm  # no other draws jobs
    out = []
    for times, segments, _ in pieces:
        for t, t_end, (v, a, cubics, _) in zip(times, times[1:], segments):
            length = (t_end - t) * (v + 0.5 * a * (t_end - t))
            for n in range(POINTS_PER_SEGMENT):
                s = length * n / POINTS_PER_SEGMENT
                q = [c0 + s * (c1 + s * (c2 + s * c3)) for c0, c1, c2, c3 in cubics]
                out.append(kinematics.forward(arm, q))
    return out + [kinematics.forward(arm, pieces[-1][2])]
