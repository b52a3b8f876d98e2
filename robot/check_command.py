"""`driver.py check`: which motor is where and in which direction it turns, by a person or a camera.

The answer goes into the arm's file, if that says otherwise, and is stored; until then no other
command moves the arm.
"""

import contextlib
import os

from robot import program
from robot.asking import Person
from robot.ev3 import battery
from robot.motion import mounting
from robot.motion.checked import Checked
from robot.motion.zero import NotHomed
from shared.arm_description import ArmError, is_bundled, read_arm, user_arm_file
from shared.arm_keys import PULLED_DOWN
from shared.config_files import write_whole
from shared.ini import BadIni, with_values

MYPY = False
if MYPY:
    from typing import Dict, List, Optional, Sequence, Tuple  # noqa: F401

    from robot.clock import Clock  # noqa: F401
    from robot.motion.arm import RobotArm  # noqa: F401
    from robot.tracker_address import ServerAddress  # noqa: F401
    from shared.arm_description import Arm  # noqa: F401

AGAIN = "again"


class NotWritten(ArmError, OSError):
    """The arm's file cannot be changed; the message says what to write there."""


def run(description, clock, take_over=False, person=None, tracker=None):
    # type: (Arm, Clock, bool, Optional[Person], Optional[ServerAddress]) -> None
    """Turn each joint a little, find out what moved, correct the arm's file, store the answer.

    Args:
        description: shared.arm_description.Arm.
        clock: has `now()` and `sleep(seconds)`.
        take_over: see program.claim.
        person: asking.Person; whoever started the program if None.
        tracker: tracker_address.ServerAddress of the tracker that sees the arm; None: only the
            person does.

    Raises:
        NotMounted, NobodyAnswers, NotWritten, with a tracker jog_views.NotSeen and Refusal, and
        what RobotArm raises: after stopping.
    """
    person = person or Person(clock)
    arm = program.connect(description, clock, take_over, unchecked=True)
    battery.check(clock)
    with contextlib.suppress(NotHomed):
        arm.load_zero()  # if it is known, it stays so
    seen = [None] * len(arm.joints)  # type: List[Optional[mounting.Observed]]
    with program.parking(arm):
        if tracker:
            seen = _seen_by_camera(arm, tracker, clock)
        if None in seen:
            print(
                "Each motor turns a little, and back. Watch which part moves first, and which way."
            )
            person.confirm("Lift the pen, keep hands and cables out of the way.")
            seen = [one or _seen(arm, k, person) for k, one in enumerate(seen)]
    program.raise_on_signals()
    found = mounting.as_mounted(description, [one for one in seen if one])
    differences, values = mounting.differences(description, found)
    if values:
        description = _corrected(description, differences, values)
    Checked(description, os.path.dirname(arm.zero.file)).save(arm.motors.devices())
    print(
        "checked: {}; next: driver.py home".format(
            ", ".join("{} at port {}".format(j.name, j.port) for j in description.joints)
        )
    )


def _seen_by_camera(arm, tracker, clock):
    # type: (RobotArm, ServerAddress, Clock) -> List[Optional[mounting.Observed]]
    """Return mounting.Observed by the camera for each motor, or None where it cannot tell."""
    # Not above: only a check by camera waits for all this to be loaded.
    from robot.jog_watching import PLACING_ADVICE, JogWatcher
    from robot.motion import jog_views
    from robot.tracking import TrackingClient

    description = arm.description
    straight = "at home" if description.chain in PULLED_DOWN else "straight"
    print(PLACING_ADVICE.format(straight=straight, joint=description.joints[0].name))
    client = TrackingClient(*tracker, clock=clock, say=_say)
    try:
        watcher = JogWatcher(arm, client, clock)
        seen, why_not = jog_views.recognised(description, watcher.jogs())
    finally:
        client.close("the check has ended")
    for joint, one in zip(description.joints, seen):
        if one:
            print(jog_views.in_words(watcher.camera, joint.port, one))
    if why_not:
        print(why_not)
    return seen


def _say(line):
    # type: (str) -> None
    print(line, flush=True)  # late output is of no use


def _seen(arm, k, person):
    # type: (RobotArm, int, Person) -> mounting.Observed
    """Turn the motor that should be joint `k`'s, ask, and return mounting.Observed."""
    description = arm.description
    joint, gears = description.joints[k], mounting.jog_angles(description, k)
    parts = [(one.name, one.name[0]) for one in description.joints]
    if description.pen and description.pen.motor in [one.motor for one in description.joints]:
        parts.append((mounting.PEN, "p"))
    angle = gears[0]
    while True:
        print("{} of {}: the motor at port {}".format(k + 1, len(arm.joints), joint.port))
        mounting.jog(arm, k, angle)
        part = person.choose(
            "Which part moved?", (parts + [(mounting.NOTHING, "n"), (AGAIN, "a")])[:5]
        )
        if part not in (mounting.NOTHING, AGAIN):
            break
        if part == mounting.NOTHING and angle == gears[-1]:
            return mounting.Observed(part, True)
        angle = gears[-1]  # as far as it may
    if description.chain in PULLED_DOWN and part != "base":
        direction = person.choose("Which way first?", [("up", "u"), ("down", "d")])
        return mounting.Observed(part, direction == "up")
    direction = person.choose("Which way first, seen from above?", [("left", "l"), ("right", "r")])
    return mounting.Observed(part, direction == "left")


def _corrected(arm, differences, values):
    # type: (Arm, Sequence[str], Dict[Tuple[str, str], str]) -> Arm
    """Write what was seen into the arm's file, or a copy of one that came along; return the Arm.

    Args:
        arm: Arm as its file says.
        differences: lines for people about the differences.
        values: new texts by (section, key).

    Raises:
        NotWritten: saying what to write there.
    """
    lines = ", ".join(
        "[{}] {} = {}".format(section, key, text) for (section, key), text in sorted(values.items())
    )
    path = user_arm_file(arm.name) if is_bundled(arm) else os.path.realpath(arm.file)
    shown = path.replace(os.path.expanduser("~") + os.sep, "~" + os.sep, 1)

    def refused(why):
        # type: (object) -> NotWritten
        return NotWritten(
            "{}: {} is not changed, {}; write there: {}".format(
                "; ".join(differences), shown, why, lines
            )
        )

    if is_bundled(arm) and os.path.exists(path):
        raise refused("for it is yours, and {} was checked".format(arm.file))
    try:
        with open(arm.file, "rb") as file:
            text = file.read().decode("utf-8")
        mode = os.stat(path).st_mode & 0o777 if os.path.exists(path) else None
        write_whole(path, with_values(text, values), mode)
    except OSError as error:
        raise refused(error.strerror) from None
    except BadIni as error:
        raise refused("[{}] {} {}".format(error.section, error.key, error)) from None
    copied = ", a copy that --arm {} means from now on".format(arm.name) if is_bundled(arm) else ""
    print("{}: {} written to {}{}".format("; ".join(differences), lines, shown, copied))
    return read_arm(path)
