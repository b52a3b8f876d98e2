"""An arm on an emulated brick with the driver above it, and what really happened.

The oracles here are the true angles of the emulated links and the true ink, never what the driver
believes.
"""

import contextlib
import itertools
import json
import math
import os
from collections import namedtuple

from heard_motor import listen
from places import ROBOT

from laptop.emulator import rig as emulated
from laptop.emulator.device.peripherals import Peripherals
from laptop.emulator.host.runner import run_script
from robot.driver import Driver
from robot.motion.arm import RobotArm
from robot.motion.checked import Checked
from robot.motion.zero import Zero
from shared.arm_description import find_arm, read_arm

DRIVER = str(ROBOT / "driver.py")
REPORT_LINES = [((10, 0), (5, 10)), ((15, 0), (0, 15)), ((12, 15), (0, 15))]


def degrees(*angles):
    """The angles given in degrees as a tuple of rad."""
    return tuple(math.radians(angle) for angle in angles)


def far(a, b):
    """Greatest difference of two poses, deg."""
    return max(abs(math.degrees(x - y)) for x, y in zip(a, b))


def described(name, backlash=None, **changes):
    """The arm of that name, with other play (deg) or other fields at every joint."""
    arm = read_arm(find_arm(name))
    if backlash is not None:
        changes["backlash"] = math.radians(backlash)
    return arm._replace(joints=tuple(joint._replace(**changes) for joint in arm.joints))


def zero_of(arm, q):
    """Counts at joint angle 0, by port, of encoders that read 0 with the joints at `q` (rad)."""
    zero = {
        joint.port: -math.degrees(angle) * joint.gear * joint.direction
        for joint, angle in zip(arm.joints, q)
    }
    if arm.pen:
        zero[arm.pen.port] = -math.degrees(arm.pen.up)
    return zero


def from_line(p, line):
    """Distance of a point from the straight line through two others, cm."""
    (ax, ay), (bx, by) = line
    return abs((p[0] - ax) * (by - ay) - (p[1] - ay) * (bx - ax)) / math.hypot(bx - ax, by - ay)


class Rig(emulated.Rig):
    """A brick that wakes up parked, and a Driver on it.

    It is open from the start.  In virtual time, and with its state in a test's folder, it holds
    nothing that one would have to close.

    Programs compute as slowly as on the brick: scripts under run_script, and what is `running` in
    this process.  Only what a test does on the bare sysfs, to one motor, say, takes no time.

    Args:
        folder: of the brick's state.
        arm, plant, start: as for laptop.emulator.rig.Rig.
        homed: whether the zero is on file.
        checked: whether it is on file that somebody has looked which motor is where.
        others: as for laptop.emulator.rig.Rig.

    Attributes:
        state: the Zero on file.
        writes: every write to a motor, as (t, port, attribute, text).
    """

    def __init__(
        self, folder, arm="planar", plant="", start="home", homed=True, checked=True, **others
    ):  # fmt: skip
        super().__init__(arm, plant=plant, start=start, state_folder=str(folder), **others)
        self.__enter__()
        # What is `running` in this process finds no battery, and takes no time to look at one.
        self.brick.sysfs.remove("power_supply", "lego-ev3-battery")
        self.state = Zero(self.arm, self.state_folder)
        self.writes = []
        for motor in self.brick.motors.values():
            self._listen(motor)
        if homed:
            # A last bit other than the emulator's own, on which luck of an arm in space hangs.
            zero = zero_of(self.arm, self.q)
            self.state.save(zero, dict.fromkeys(zero, 0))
        else:
            os.remove(self.state.file)
        if not checked:
            os.remove(Checked(self.arm, self.state_folder).file)

    def _listen(self, motor):
        def heard(attribute, text):
            self.writes.append((self.world.now(), motor.port, attribute, text))

        listen(self.brick.sysfs, motor, heard)

    @contextlib.contextmanager
    def running(self):
        """A program runs on the brick, in this process, for a `with` block.

        What it computes takes as long as it takes there, what the test computes no time.
        """
        with self.program() as self._program:
            yield

    @property
    def clock(self):
        """Of the program that is running."""
        return self._program.clock

    def its(self, kind):
        """The program's own of what is imported here: a class or a function of the brick's side."""
        return getattr(self._program[kind.__module__], kind.__name__)

    def robot(self, awake=True, arm=None, clock=None, **options):
        """A RobotArm of a program that starts now."""
        state = self.its(Zero)(self.arm, self.state_folder)
        robot = self.its(RobotArm)(arm or self.arm, clock or self.clock, state, **options)
        if awake:
            robot.load_zero()
        return robot

    def driver(self, awake=True, **options):
        """A Driver of a program that starts now."""
        return self.its(Driver)(self.robot(awake), **{"say": lambda line: None, **options})

    def ink(self):
        """The TRUE strokes: lists of Samples with the pen down."""
        runs = itertools.groupby(self.record, lambda sample: sample.pen)
        return [list(samples) for pen, samples in runs if pen]

    def on_file(self):
        """What the state file holds."""
        with open(self.state.file) as file:
            return json.loads(file.read())


@contextlib.contextmanager
def switched_on(folder, *args, **options):
    """A Rig on which a program is running, in this process."""
    rig = Rig(folder, *args, **options)
    with rig.running():
        yield rig


class Terminal(Rig):
    """A Rig at which one types what is to run, and reads what it says.

    Args:
        folder: of the brick's state.
        monkeypatch, capsys: pytest's.
        others: as Rig.
    """

    def __init__(self, folder, monkeypatch, capsys, **others):
        super().__init__(folder, **others)
        self._capsys = capsys
        monkeypatch.setenv("BRICKSERVO_STATE", self.state_folder)
        monkeypatch.setenv("BRICKSERVO_ARM", self.arm.file)

    def type(self, script, *words, **options):
        """Run `SCRIPT WORDS`; its Outcome, what it wrote to stdout, and to stderr.

        Nobody asks it for the paths that it wants, as Rig.run does: to say so takes its time.

        Args:
            script: its path.
            words: for it.
            options: as for run_script.
        """
        self._capsys.readouterr()
        outcome = run_script(self.brick, script, words, **options)
        out, err = self._capsys.readouterr()
        return outcome, out, err


Shown = namedtuple("Shown", "status reason t accesses out err")
"""What a shell would see of a run, and when it ended (s)."""


class Shell(Terminal):
    """A Rig on which driver.py runs as a program of its own.

    Args:
        words: as Terminal.
        options: as Terminal.

    Attributes:
        busy: per port, the last time (s) at which the motor was driven.
    """

    def __init__(self, *words, **options):
        super().__init__(*words, **options)
        self.busy = {}
        self.world.bodies.append(self._note_driven)

    def _note_driven(self, t):
        for port in self.brick.driven():
            self.busy[port] = t

    def run(self, *words, **options):
        """Run `driver.py WORDS`, then 2 s more of the world; Shown."""
        volts = self.brick.plant.plant["voltage"]
        devices = Peripherals(self.world, self.brick.sysfs, voltage=lambda: volts)
        options = {"aftermath": 2.0, "peripherals": devices, **options}
        outcome, out, err = self.type(DRIVER, *words, **options)
        return Shown(outcome.status, outcome.reason, outcome.t, outcome.accesses, out, err)

    def when(self, part, share):
        """The time (s) of this very run, once it is over, at a share of one of its parts.

        Args:
            part: "ink" from the pen's touching to its lifting, "way" from the start to there,
                "run" all of it, "drop" 0.2 s before the pen touches.
        """
        ink = self.ink()
        begin, end = {
            "ink": lambda: (ink[0][0].t, ink[0][-1].t),
            "way": lambda: (0.0, ink[0][0].t),
            "drop": lambda: (ink[0][0].t - 0.2, ink[0][0].t),
            "run": lambda: (0.0, self.brick.record[-1].t - 2.0),
        }[part]()
        return begin + share * (end - begin)

    def motion(self, since):
        """The greatest angle (deg) any joint really turned after time `since` (s)."""
        late = [sample.q for sample in self.brick.record if sample.t >= since]
        return max(math.degrees(max(angles) - min(angles)) for angles in zip(*late))
