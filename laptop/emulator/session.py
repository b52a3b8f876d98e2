"""One script on one emulated brick, from the words of a command line to what came out.

The brick wakes up as its user left it: the arm parked, its zero on file; or lost, never homed.
"""

import contextlib
import csv
import json
import math
import os
import random
import re
import shutil
import sys
import time
from collections import namedtuple

from laptop.emulator import temporary_folders
from laptop.emulator.brick_environment import BRICK_STATE, brick_environment, brick_folders
from laptop.emulator.device.brick import EmulatedBrick
from laptop.emulator.device.buttons import INPUTS, LATEST
from laptop.emulator.device.peripherals import Peripherals
from laptop.emulator.device.sensor_scene import scene_of
from laptop.emulator.host.linux import Signals
from laptop.emulator.host.pace import PacedClock
from laptop.emulator.host.runner import run_script
from laptop.emulator.host.world import World
from laptop.emulator.live import PoseWriter
from robot.motion import kinematics
from robot.motion.checked import Checked
from robot.motion.zero import Zero
from robot.tracking_client import Memory, ServerAddress
from shared.arm_description import ArmError
from shared.message_fields import one_line
from shared.messages import PORT
from shared.state import ARM, LOCK, MOTORS_FILE, OWN_ARMS_FOLDER, PLAN, STATE, state_folder

Fault = namedtuple("Fault", "kind what t")
"""Something that goes wrong: its kind, a port or value (or None), and when (s)."""

CAMERA_NAMES = "ABCDEFGH"
"""Names that a camera may have."""

FAULTS = {
    "unplug": "PORT",
    "stall": "PORT",
    "dead-encoder": "PORT",
    "push": "PORT",
    "slow-sysfs": "SECONDS",
    "frozen-picture": "CAMERA",
    "freeze": None,
    "kill": None,
    "int": None,
    "term": None,
    "hup": None,
}
"""Kind of a fault -> placeholder of what stands behind its colon; CAMERA may be left out."""

_PORTS = {"unplug": tuple("ABCD") + INPUTS}
"""Ports of what can happen to sensors, too."""

SimulationResult = namedtuple(
    "SimulationResult", "outcome record wanted motors names skeleton reach pace asked"
)
"""The result of a run.

outcome   runner.Outcome
record    the brick's MotionSamples
wanted    the paths (cm) that the script told it wanted
motors    per port what its motor does at the end: dict(mode, driven, position)
names     what the angles in the record are of; None: of the arm's joints
skeleton  where the arm's joints and its tip ended, cm; empty without an arm
reach     least and greatest distance of the tip from the base, cm; None without an arm
pace      emulated seconds per second of this computer's clock; None in virtual time
asked     ports of the motors that were asked to turn
"""


LONGEST_ACCESS = 10.0
"""Greatest cost of a sysfs access, s."""

AFTER = "after:"
"""Prefix of a start that another run leaves."""

UNCHECKED = "unchecked"
"""The start of an arm, at home, of which nobody has looked yet which motor is where."""

SUMMARY_POLL_PERIOD = 0.02
"""Period at which one looks whether that run is over, s."""

LAPTOP = "127.0.0.1"
"""Host of a tracker beside the brick."""


class InvalidSimulationOption(ArmError, ValueError):
    """A fault, pose or plug that cannot be understood."""


def read_fault(text):
    """Read a Fault from `KIND[:WHAT]@SECONDS`, e.g. `unplug:A@1.5` or `term@2`."""
    match = re.match(r"([a-z-]+)(?::([^@]+))?@([0-9.]+)$", text)
    if not match or match.group(1) not in FAULTS:
        raise InvalidSimulationOption(
            "'{}' is not a fault; write one of {} with a time, like unplug:A@1.5".format(
                one_line(text),
                ", ".join(
                    kind + (":" + FAULTS[kind] if FAULTS[kind] else "") for kind in sorted(FAULTS)
                ),
            )
        )
    kind, what = match.group(1), match.group(2)
    try:
        t = float(match.group(3))
        if FAULTS[kind] == "SECONDS":
            what = float(what)
            if not 0 <= what <= LONGEST_ACCESS:
                raise ValueError(what)
        elif FAULTS[kind] == "CAMERA":
            if what not in (None,) + tuple(CAMERA_NAMES):
                raise ValueError(what)
        elif what not in (_PORTS.get(kind, tuple("ABCD")) if FAULTS[kind] == "PORT" else (None,)):
            raise ValueError(what)
    except (TypeError, ValueError):
        raise InvalidSimulationOption(
            "fault '{}': {} takes {}, then @SECONDS".format(
                one_line(text),
                kind,
                {
                    "PORT": "a port from A to D" + (", or in1 to in4" if kind in _PORTS else ""),
                    "CAMERA": "a camera from A to H, or nothing for all of them",
                    None: "nothing",
                }.get(FAULTS[kind], "SECONDS from 0 to {:g}".format(LONGEST_ACCESS)),
            )
        ) from None
    if t > LATEST:
        raise InvalidSimulationOption(
            "fault '{}': it would come at {:g} s; give a time up to {:g} s".format(
                one_line(text), t, LATEST
            )
        )
    return Fault(kind, what, t)


def read_start(text, arm):
    """Read joint angles (rad), and whether the zero is known.

    Args:
        text: `home`, `lost`, `unchecked`, `DEG,DEG,...`, or `after:FOLDER`: where the run ends that
            leaves its files there, which is waited for.

    Raises:
        InvalidSimulationOption: it is none of these.
    """
    if arm is None:
        if text != "home":
            raise InvalidSimulationOption(
                "start '{}': there is no arm to be there; leave --start out".format(one_line(text))
            )
        return None, False
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


def _end_of(folder, arm):
    """The joint angles where a run ended, rad, within the limits; waits for its summary."""
    while not os.path.exists(os.path.join(folder, "summary.json")):
        time.sleep(SUMMARY_POLL_PERIOD)
    try:
        with open(os.path.join(folder, "trace.csv"), newline="") as file:
            *_, last = csv.DictReader(file)
        angles = [float(last["q{}".format(k)]) for k in range(1, len(arm.joints) + 1)]
    except (OSError, ValueError, KeyError, TypeError):
        raise InvalidSimulationOption(
            "start '{}{}': there is no trace of this arm; give the --out of another run".format(
                AFTER, folder
            )
        ) from None
    return tuple(min(max(a, j.lower), j.upper) for a, j in zip(angles, arm.joints))


def run(
    arm,
    script,
    args,
    plant=None,
    start="home",
    faults=(),
    presses=(),
    extra=None,
    realtime=False,
    timeout=600.0,
    patience=10.0,
    watched=None,
    sensors=None,
    wheels=None,
    built=None,
    keyboard=None,
    home=None,
    meanwhile=(),
    person=None,
    stops=None,
):
    """Run `script` on an emulated brick that carries `arm`.

    Args:
        arm: shared.arm_description.Arm; None for a brick without one.
        plant: constants from plant_constants.read_plant.
        start: see read_start.
        faults: Faults.
        presses: buttons.Press values.
        extra: port -> motor kind, motors beside the arm's.
        stops: port -> the stops of such a motor, rad; see EmulatedBrick.
        realtime, timeout, patience: see World and run_script.
        watched: `watched(brick)` gives a context manager for a tracker's `port` on this machine
            its `code` and `key`, and its `pictures` (PictureFaults) by camera in `frames`; the
            script finds it as one that it remembers.
        sensors: port -> SensorOrder; None: a touch sensor at each.
        wheels: of a brick without an arm, from wheels.read_wheels.
        built: the arm as it was built, where that differs from `arm`, which is all that the script
            is told: the truth of motors, ports, stops and links.
        keyboard: `keyboard(brick)` gives the text file that the script has for standard input; the
            laptop's if None.
        home: folder of the brick's state, which stays, and may be that of an earlier run; one for
            this run alone if None.
        meanwhile: pairs of a time (s) and a function without arguments, called then.
        person: `person(brick, devices)` is called before the script starts: somebody at the brick,
            who presses and leads when the time comes.

    Returns:
        SimulationResult.

    Raises:
        InvalidSimulationOption: a fault for a port without a motor, an impossible start, or an arm
            built of other joints.
        BadSensor, BadPress: a sensor that sees what is not there, no touch sensor to press.
    """
    q, homed = read_start(start, arm)
    built = built or arm
    if built is not None and built.chain != arm.chain:
        raise InvalidSimulationOption(
            "{} is built as a {} arm, but {} describes a {} one; give two of one chain".format(
                built.name, built.chain, arm.name, arm.chain
            )
        )
    with contextlib.ExitStack() as stack:
        clock = PacedClock() if realtime else None
        if clock:
            stack.callback(clock.close)
        world = World(clock, os.path.basename(script))
        world.tell = _tell
        brick = EmulatedBrick(world, built, plant, q, extra, wheels, stops)
        if not homed:
            brick.reset_motors()  # it has just been switched on: an arm that gravity pulls drops
        devices = Peripherals(
            world,
            brick.sysfs,
            voltage=lambda: brick.plant.plant["voltage"],
            sensors=sensors,
            scene=scene_of(brick),
        )
        ordered = _schedule_faults(brick, devices, faults)
        for t, act in meanwhile:
            world.at(t, act)
        stack.enter_context(_published(brick, script))
        tracker = stack.enter_context(watched(brick)) if watched else None
        _schedule_pictures(world, tracker, faults)
        folder = stack.enter_context(_home_folder(brick, arm, q, homed, tracker, home))
        if start != UNCHECKED and arm is not None:
            Checked(arm, folder).save({})
        if person:
            person(brick, devices)
        if keyboard:
            stack.enter_context(_typed_at(keyboard(brick)))
        _let_joints_touch(brick, devices)
        outcome = run_script(
            brick,
            script,
            args,
            devices,
            presses,
            timeout=timeout,
            patience=patience,
            folders=brick_folders(folder),
            **ordered,
        )
        wanted = _wanted(os.path.join(folder, "plan"))
    motors = {
        port: {"mode": motor.mode, "driven": motor.driven, "position": motor.position}
        for port, motor in brick.motors.items()
    }
    skeleton, reach = (), None
    if built is not None:
        skeleton = kinematics.joint_positions(built, brick.plant.q)
        reach = kinematics.reach(built)
    pace = world.pace.mean if world.pace else None
    return SimulationResult(
        outcome, brick.record, wanted, motors, brick.names, skeleton, reach, pace, brick.asked()
    )


def _let_joints_touch(brick, peripherals):
    """Let the joints of the arm, as it was built, close and open their touch sensors."""
    if brick.arm is None:
        return
    touching = [
        (drive.link, joint, peripherals.inputs[joint.touch_port].measuring)
        for drive, joint in zip(brick.plant.joints, brick.arm.joints)
        if joint.touch_port and peripherals.inputs[joint.touch_port].measuring
    ]

    def look(t):
        for link, joint, sensor in touching:
            at = joint.touch_at
            sensor.pressed = link.angle >= at if at >= joint.upper else link.angle <= at

    if touching:
        brick.world.bodies.append(look)


@contextlib.contextmanager
def _typed_at(keyboard):
    """Let a script read this file as its standard input."""
    before, sys.stdin = sys.stdin, keyboard
    try:
        yield
    finally:
        sys.stdin = before


def _tell(line):
    sys.stderr.write(line + "\n")


def _schedule_faults(brick, devices, faults):
    """Let the faults happen on the brick; those of the program are returned, for run_script."""
    ordered = {"signals": []}
    for fault in faults:
        if FAULTS[fault.kind] == "CAMERA":
            continue
        if fault.what in INPUTS:
            brick.world.at(fault.t, devices.inputs[fault.what].unplug)
            continue
        if FAULTS[fault.kind] == "PORT" and fault.what not in brick.motors:
            raise InvalidSimulationOption(
                "fault {}: no motor at port {}; there are {}".format(
                    fault.kind, fault.what, ", ".join(sorted(brick.motors)) or "none; give --plug"
                )
            )
        _schedule(brick, fault, ordered)
    return ordered


def _schedule(brick, fault, ordered):
    at = brick.world.at
    if fault.kind == "unplug":
        at(fault.t, lambda: brick.unplug(fault.what))
    elif fault.kind == "stall":
        at(fault.t, lambda: brick.jam(fault.what))
    elif fault.kind == "dead-encoder":
        at(fault.t, lambda: brick.kill_encoder(fault.what))
    elif fault.kind == "push":
        at(fault.t, lambda: brick.push(fault.what))
    elif fault.kind == "slow-sysfs":
        at(fault.t, lambda: setattr(brick.sysfs, "access_cost", fault.what))
    elif fault.kind in ("freeze", "kill"):
        ordered[fault.kind + "_at"] = fault.t
    else:
        ordered["signals"].append((fault.t, Signals["SIG" + fault.kind.upper()]))


def _schedule_pictures(world, tracker, faults):
    """Let the faults happen that are the cameras'."""
    for fault in faults:
        if FAULTS[fault.kind] != "CAMERA":
            continue
        cameras = sorted(tracker.frames) if tracker else []
        if not cameras:
            raise InvalidSimulationOption(
                "fault {}: no camera watches; give --scene, too".format(fault.kind)
            )
        if fault.what not in [None] + cameras:
            raise InvalidSimulationOption(
                "fault {}: no camera {}; there are {}".format(
                    fault.kind, fault.what, ", ".join(cameras)
                )
            )
        world.at(fault.t, lambda camera=fault.what: tracker.pictures.freeze(camera))


def park_on_file(arm, q, folder):
    """Leave the state in `folder` of an arm parked at `q` (rad), pen up, where its encoders read 0.

    Somebody has looked which motor is where.

    Returns:
        The robot.motion.zero.Zero.
    """
    turns = {j.port: -a * j.gear * j.direction for j, a in zip(arm.joints, q)}
    if arm.pen:
        turns[arm.pen.port] = -arm.pen.up
    state = Zero(arm, folder)
    state.save({p: math.degrees(turn) for p, turn in turns.items()}, dict.fromkeys(turns, 0))
    Checked(arm, folder).save({})
    return state


@contextlib.contextmanager
def _published(brick, script):
    """Let cameras in other processes see the arm meanwhile, in real time."""
    if not brick.world.realtime or brick.arm is None:
        yield
        return
    writer = PoseWriter(brick, os.path.basename(script))
    brick.world.bodies.append(writer.advance)
    try:
        yield
    finally:
        writer.close()


@contextlib.contextmanager
def _home_folder(brick, arm, q, homed, tracker, home):
    """The brick's home for one run: its state, its arm, and room for the wanted paths."""
    folder = home or temporary_folders.make("home")
    environment = {STATE: BRICK_STATE, PLAN: BRICK_STATE + "/plan"}
    if arm is not None:
        environment[ARM] = os.path.abspath(arm.file)
    if tracker:
        # Ahead of what is remembered goes where ssh came from: the laptop, that is.
        environment["SSH_CLIENT"] = "{} 0 22".format(LAPTOP)
    if brick.world.realtime and arm is not None:
        # All programs that run in real time want the one arm that the cameras see.
        environment[LOCK] = os.path.join(os.path.abspath(state_folder()), MOTORS_FILE)
    try:
        _copy_own_arms(folder)
        if homed:
            park_on_file(arm, q, folder)
        if tracker:
            # Whichever port is free here, the brick calls the one that it would call.
            brick.world.addresses[LAPTOP, PORT] = LAPTOP, tracker.port
            Memory(folder).save(ServerAddress(LAPTOP, PORT, tracker.code), tracker.key)
        with brick_environment(environment):
            yield folder
    finally:
        if home is None:
            temporary_folders.remove(folder)


def _copy_own_arms(folder):
    """Let the brick with its state in `folder` know the arms of one's own; it keeps no others."""
    here, there = (os.path.join(place, OWN_ARMS_FOLDER) for place in (state_folder(), folder))
    os.makedirs(there, 0o700, exist_ok=True)
    if not os.path.isdir(here):
        return
    for name in os.listdir(here):
        file = os.path.join(here, name)
        if name.endswith(".ini") and os.path.isfile(file) and os.access(file, os.R_OK):
            shutil.copyfile(file, os.path.join(there, name))


def _wanted(file):
    """The paths in the file that a script appended to, one JSON line each; [] if there is none."""
    if not os.path.exists(file):
        return []
    with open(file) as lines:
        paths = []
        for number, line in enumerate(lines, 1):
            try:
                points = json.loads(line)["path"]
                paths.append([(float(x), float(y), *map(float, rest)) for x, y, *rest in points])
            except (ValueError, KeyError, TypeError):
                raise InvalidSimulationOption(
                    'line {} of $BRICKSERVO_PLAN is not {{"path": [[x, y], ...]}}; '
                    "correct the script that wrote it".format(number)
                ) from None
    return paths
