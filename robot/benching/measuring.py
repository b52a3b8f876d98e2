"""Order in which a brick is measured, what is printed meanwhile, and the file at the end."""

import collections
import contextlib
import gc
import json
import os
import sys

from robot import program
from robot.benching.laps import EMPTY_LAP, Laps, middle, table
from robot.clock import Clock
from robot.ev3.library import what_is_missing
from shared.arm_description import ArmError, find_arm, read_arm

MYPY = False  # which a type checker takes for true
if MYPY:
    from argparse import Namespace  # noqa: F401
    from typing import Callable, Dict, Iterator, List, Optional  # noqa: F401

    from robot.benching.figures import Figures  # noqa: F401
    from robot.benching.moving import Bench  # noqa: F401
    from robot.motion.arm import RobotArm  # noqa: F401
    from shared.arm_description import Arm  # noqa: F401

FORMAT, VERSION = "brickservo brick", 1
"""Kind and version of the file; the version rises when a figure changes its meaning."""

WARNING_TIME = 3.0
"""Time from the announcement of what will move until it does, s."""

UNITS = (
    ("no_load_deg_per_s", "deg/s", "no load"),
    ("friction_duty_percent", "%", "friction"),
    ("brake_from_deg_per_s", "deg/s", "braked at"),
    ("brake_deg", "deg", "stops in"),
    ("brake_time_s", "s", "time const."),
    ("backlash_deg", "deg", "backlash"),
)


class CannotMeasure(ArmError):
    """Something is not there or not as it must be for measuring it."""


def run(args, begun):
    # type: (Namespace, float) -> None
    """Measure all that the command line asks for; print tables, and write a file.

    Args:
        args: of the command line, see bench_brick.main.
        begun: time when the script began, s.

    Raises:
        ArmError, OSError: all motors stand.
    """
    clock, laps = Clock(), Laps()
    _check_room(args.json)
    description = read_arm(find_arm(args.arm)) if args.move or args.bare else None
    if description is not None:
        for port in args.bare:
            _check_bare(port, description)
    try:
        with _lap(laps, "start: import python-ev3dev2"):
            import robot.ev3.motors  # noqa: F401
    except ImportError as error:
        missing = what_is_missing(error)
        if missing is None:
            raise
        raise CannotMeasure(missing) from None
    with _lap(laps, "start: import the arm"):
        import robot.motion.arm  # noqa: F401
    with _lap(laps, "start: import the servo"):
        from robot.benching import computing
    from robot.benching import system

    started = system.age(begun)
    if started is None:
        print("how long Python takes to start: this system does not tell")
    else:
        laps.taken["start: Python"] = [started]
    motors = _move(args, description, clock) if description else {}
    for _ in range(5):
        laps.timed(EMPTY_LAP, lambda: None)()
    computing.measure(args.arms, laps)
    port = system.measure_accesses(laps)
    if port is None:
        print("an access to a motor: none is plugged in")
    system.measure_naps(clock, laps)
    for line in table(laps.taken):
        print(line)
    for line in motor_table(motors):
        print(line)
    figures = {
        "format": FORMAT,
        "version": VERSION,
        "python": sys.version.split()[0],
        "arm": description and description.name,
        "laps_s": laps.taken,
        "access_s": _access(laps.taken) if port else None,
        "motors": motors,
    }
    _write(args.json, figures)
    if args.marks:
        _write(args.marks, laps.marks)
    print("written to {}".format(args.json))


def _write(file, content):
    # type: (str, object) -> None
    with open(file, "w") as written:
        written.write(json.dumps(content) + "\n")


@contextlib.contextmanager
def _lap(laps, name):
    # type: (Laps, str) -> Iterator[None]
    laps.begin()
    yield
    laps.end(name)


def _check_room(file):
    # type: (str) -> None
    """Refuse a file that cannot be written, before the measurement of three minutes."""
    exists = os.path.exists(file)
    try:
        with open(file, "a"):
            pass
        if not exists:
            os.remove(file)
    except OSError as error:
        raise CannotMeasure(
            "cannot write {}: {}; choose another file with --json".format(file, error.strerror)
        ) from None


def _check_bare(port, description):
    # type: (str, Arm) -> None
    for part in description.joints + ((description.pen,) if description.pen else ()):
        if part.port == port:
            raise CannotMeasure(
                "port {} is one of the {} arm's, so its motor is not bare; plug a motor that turns "
                "nothing into another one".format(port, description.name)
            )


def _access(taken):
    # type: (Dict[str, List[float]]) -> float
    """Return the kernel's time for an access to a motor, s, without that of a mere file."""
    return (
        sum(
            middle(taken["motor: " + name]) - middle(taken[name])
            for name in ("read position", "write speed_sp")
        )
        / 2
    )


# The motors


def _volts():
    # type: () -> Callable[[], float]
    """Return a function that reads the battery, V.

    Raises:
        CannotMeasure: there is none.
    """
    from robot.ev3.battery import power_supply  # not above: few arms are turned for it

    try:
        supply = power_supply()
        if supply.measured_volts > 0:
            return lambda: supply.measured_volts
    except Exception as error:  # any error of a driver
        why = str(error)
    else:
        why = "0 V"
    raise CannotMeasure(
        "the battery does not tell its voltage ({}), which motors are measured by".format(why)
    )


def _move(args, description, clock):
    # type: (Namespace, Arm, Clock) -> Dict[str, Figures]
    """Turn what is to be turned; return a dict, port -> figures."""
    from robot.benching import moving, system
    from robot.ev3.brick_lock import BrickLock
    from robot.ev3.motors import motors_folder

    bench = moving.Bench(clock, _volts())
    bare = []
    kinds = dict(system.motors_found())
    for port in args.bare:
        if port not in kinds:
            raise CannotMeasure("no EV3 motor at port {}: check the cable, or --bare".format(port))
        bare.append((port, kinds[port]))
    program.claim(BrickLock(motors_folder()), clock, args.take)
    arm = None
    if args.move:
        arm = program.connect(description, clock)
        arm.load_zero()
        print("the {} arm will move; nothing may be in its way:".format(description.name))
        for k in range(len(description.joints)):
            print("  " + moving.describe(description, k))
    for port, kind in bare:
        print("the {} motor at port {} will turn at full speed".format(kind, port))
    print("in {:.0f} s; Ctrl-C stops it".format(WARNING_TIME))
    clock.sleep(WARNING_TIME)
    motors = collections.OrderedDict()  # type: Dict[str, Figures]
    collecting = gc.isenabled()
    gc.disable()  # a collection takes as long as a motor to speed up
    try:
        if arm:
            _measure_arm(arm, bench, motors)
        for port, kind in bare:
            motors[port] = bench.bare(port, kind)
    finally:
        if collecting:
            gc.enable()
    return motors


def _measure_arm(arm, bench, motors):
    # type: (RobotArm, Bench, Dict[str, Figures]) -> None
    with program.parking(arm):
        arm.go_to([joint.home for joint in arm.description.joints])
        for k, joint in enumerate(arm.description.joints):
            print("measuring the {}".format(joint.name))
            found = bench.joint(arm, k)
            found["joint"], found["gear"] = joint.name, joint.gear
            motors[joint.port] = found
        arm.go_low()
    program.raise_on_signals()


def motor_table(motors):
    # type: (Dict[str, Figures]) -> Iterator[str]
    """Yield lines for people of the motors' figures by port; backlash is at the joint."""
    if not motors:
        return
    yield "{:<22}".format("motor") + "".join(
        "{:>18}".format("{}, {}".format(name, unit)) for _, unit, name in UNITS
    )
    for port, found in motors.items():
        name = "{} {}, {}".format(port, found["kind"], found.get("joint", "bare"))
        yield "{:<22}".format(name) + "".join(
            "{:>18}".format("{:.4g}".format(found[key]) if key in found else "-")
            for key, _, _ in UNITS
        )
    if any("joint" in found and "backlash_deg" not in found for found in motors.values()):
        yield "backlash -: it takes both stops; hold the motor, move the link to and fro by hand"
    if any("joint" in found and "brake_deg" not in found for found in motors.values()):
        yield "stops in -: a joint that gravity loads is held, not braked"
