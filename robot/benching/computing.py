"""Time that control ticks, decisions, messages and a garbage collection take, piece by piece.

The code is the same that draws and servoes.  But its motors are files in a temporary folder, with a
model of a motor behind; its cameras are computed; and its clock jumps over all waiting.
"""

import collections
import contextlib
import gc
import math
import os
import random
import shutil
import tempfile

from robot.ev3.library import motors_shown_in
from robot.ev3.motors import JointMotor
from robot.motion import kinematics, paths, trajectory
from robot.motion.arm import RobotArm
from robot.motion.arm_motors import ArmMotors
from robot.motion.joint_controller import GAINS
from robot.motion.zero import Zero
from robot.servoing.loop import VisualServoing
from robot.servoing.run_reporter import RunReporter
from robot.servoing.runs import make_servo
from robot.servoing.servo import Servo
from shared.arm_description import find_arm, read_arm
from shared.messages import Observation, decode
from shared.signing import LineSigner

MYPY = False  # which a type checker takes for true
if MYPY:
    from typing import (  # noqa: F401
        Any,
        Callable,
        Dict,
        Iterator,
        List,
        Mapping,
        NamedTuple,
        Optional,
        Sequence,
        Tuple,
        Union,
    )

    from robot.benching.laps import Laps  # noqa: F401
    from robot.motion.joint_controller import JointController  # noqa: F401
    from shared.arm_description import Arm, Joint  # noqa: F401

ARMS = ("planar", "spatial")

LINES = {2: ((10, 0), (5, 10)), 3: ((12, -6, 8), (12, 6, 8))}
"""Ends of the line that is drawn, cm, by the number of coordinates."""

GOALS = {2: (3.0, 17.0), 3: (9.0, 8.0, 12.0)}
"""Goals of the tip in visual servoing, cm, by the number of coordinates."""

FRAME_PERIOD = 1 / 30.0
"""Period of a camera's frames, s."""

MARKER_NOISE = 0.5
"""Standard deviation of a marker's u and v in a frame, px."""

OBSERVATION = (
    b'{"kind":"observation","camera":"A","seq":1234,"t":1234.567891,'
    b'"markers":{"effector":[320.123,240.456,0.98],"goal":[400.123,200.456,0.97]}}'
)


class JumpingClock(object):
    """A clock that jumps over all waiting; each jump is the end of a tick.

    Args:
        laps: Laps, which takes the time of each tick.

    Attributes:
        on_jump: called with the seconds jumped over.
        tick: name of the laps that ticks are; None: they are none.
    """

    def __init__(self, laps):
        # type: (Laps) -> None
        self._laps = laps
        self._t = 100.0
        self.tick = None  # type: Optional[str]
        self.on_jump = lambda seconds: None  # type: Callable[[float], object]

    def now(self):
        # type: () -> float
        """Return the time, s; asking takes a moment of it."""
        self._t += 1e-5
        return self._t

    def sleep(self, seconds):
        # type: (float) -> None
        """Jump over that time, s, which ends a tick."""
        if self.tick:
            self._laps.end(self.tick)
        if seconds > 0:
            self._t += seconds
            self.on_jump(seconds)
        if self.tick:
            self._laps.begin()


class ModelMotor(JointMotor):
    """A motor that turns as the observer of a JointController models it; no real one does.

    Attributes:
        counted: counts of its encoder, with fraction.
        driven: speed that is set, rad/s at the joint; None: it is braked.
    """

    def __init__(self, *args):
        # type: (*Any) -> None
        JointMotor.__init__(self, *args)
        self.counted = 0.0
        self.driven = None  # type: Optional[float]
        self._turns = 0.0

    def counts(self):
        # type: () -> int
        """Return the model's counts; the attribute is read all the same."""
        JointMotor.counts(self)
        return int(self.counted)

    def drive(self, speed):
        # type: (float) -> None
        """Set the speed, rad/s at the joint."""
        self.driven = speed
        JointMotor.drive(self, speed)

    def brake(self):
        # type: () -> None
        """Stop here."""
        self.driven = None
        JointMotor.brake(self)

    def advance(self, seconds, follower):
        # type: (float, JointController) -> None
        """Go on turning for some seconds, as the model of `follower` does."""
        if self.driven is None:
            self._turns = 0.0
            return
        friction = follower._friction
        for _ in range(10):
            push = self.driven - follower._weight
            if abs(self._turns) > 1e-3:
                push -= math.copysign(friction, self._turns)
            else:
                push = math.copysign(max(0.0, abs(push) - friction), push)
            lag = min(1.0, seconds / 10 / follower.model.lag)
            self._turns += (follower.model.share * push - self._turns) * lag
            self.counted += self.in_counts(self._turns * seconds / 10)


class _KnownZero(Zero):
    """A zero where the motors are at first; nothing is read or written."""

    file = ""  # nothing is stored

    def __init__(self):
        # type: () -> None
        """Read nothing."""

    def confirmed(self, counts):
        # type: (Mapping[str, float]) -> Dict[str, float]
        return dict.fromkeys(counts, 0.0)

    def check_angles(self, angles, pen=None):
        # type: (Sequence[float], Optional[float]) -> None
        """Accept all angles."""

    def save(self, zero, parked):
        # type: (object, object) -> None
        """Save nothing."""

    def forget(self):
        # type: () -> None
        """Forget nothing: nothing is stored."""


class SyntheticCameras(object):
    """A tracking client with synthetic pictures: A looks down, in space B looks from the side.

    Args:
        arm: RobotArm that arm_of_files has made.
        clock: JumpingClock.
        goal: place of the goal's marker, cm.
    """

    linked, refused, why = True, False, ""
    late = {}  # type: Dict[str, float]

    def __init__(self, arm, clock, goal):
        # type: (RobotArm, JumpingClock, Sequence[float]) -> None
        self._arm, self._clock, self._goal = arm, clock, goal
        self._motors = models(arm)
        self._rng = random.Random(3)
        self._seq = 0
        names = "A" if len(goal) == 2 else "AB"
        now = clock.now()
        self._due = {name: now + 0.01 * k for k, name in enumerate(names)}

    def poll(self, timeout):
        # type: (float) -> Dict[str, Observation]
        """Return {camera: Observation} that are due, after at most `timeout` seconds."""
        first = min(self._due.values()) - self._clock.now()
        if first > 0 and timeout > 0:
            self._clock.sleep(min(first, timeout))
        now = self._clock.now()
        return {name: self._frame(name, now) for name, due in self._due.items() if due <= now}

    def _frame(self, name, now):
        # type: (str, float) -> Observation
        self._due[name] += FRAME_PERIOD
        self._seq += 1
        arm = self._arm
        q = [motor.counted / motor.in_counts(1.0) for motor in self._motors]
        markers = {
            "effector": self._pixel(name, kinematics.forward(arm.description, q)),
            "goal": self._pixel(name, self._goal),
        }
        return Observation(self._seq, name, now - 0.005, markers)

    def _pixel(self, name, point):
        # type: (str, Sequence[float]) -> Tuple[float, float, float]
        x, y, z = (tuple(point) + (0.0,))[:3]
        along, depth = (y - 4, 55 + 0.15 * y - z) if name == "A" else (z - 8, 60 + y)
        noise = self._rng.gauss
        return (
            320 + 600 * (x - 8) / depth + noise(0, MARKER_NOISE),
            240 - 600 * along / depth + noise(0, MARKER_NOISE),
            1.0,
        )

    def commands(self):
        # type: () -> List[object]
        """Return no commands."""
        return []

    def report(self, *args, **more):
        # type: (*object, **object) -> None
        """Do nothing."""


def models(arm):
    # type: (RobotArm) -> List[ModelMotor]
    """Return the motors of an arm that arm_of_files has made."""
    return [motor for motor in arm.joints if isinstance(motor, ModelMotor)]


@contextlib.contextmanager
def folder_of_motors(joints):
    # type: (Sequence[Joint]) -> Iterator[None]
    """Let python-ev3dev2 find these joints' motors in a temporary folder, for a `with` block."""
    root = tempfile.mkdtemp()
    try:
        for k, joint in enumerate(joints):
            folder = os.path.join(root, "tacho-motor", "motor{}".format(k))
            os.makedirs(os.path.join(folder, "speed_pid"))
            large = joint.motor == "large"
            attributes = {
                "address": "ev3-ports:out" + joint.port,
                "driver_name": "lego-ev3-{}-motor".format("l" if large else "m"),
                "count_per_rot": 360,
                "max_speed": 1050 if large else 1560,
                "stop_action": "hold",
                "polarity": "normal",
            }
            for name in ("position", "speed_sp", "position_sp", "time_sp", "command", "state",
                         "ramp_up_sp", "ramp_down_sp", "speed_pid/Kp", "speed_pid/Ki",
                         "speed_pid/Kd"):  # fmt: skip
                attributes[name] = 0
            for name, value in attributes.items():
                path = os.path.join(folder, name)
                with open(path, "w") as file:
                    file.write("{}\n".format(value))
                os.chmod(path, 0o664)
        with motors_shown_in(root):
            yield
    finally:
        shutil.rmtree(root)


def arm_of_files(description, clock):
    # type: (Arm, JumpingClock) -> RobotArm
    """Return a RobotArm on model motors, parked in its home pose, its zero known."""
    motors = ArmMotors(description, clock, GAINS, lambda line: None, ModelMotor)
    arm = RobotArm(description, clock, zero=_KnownZero(), motors=motors)
    arm.checked.needed = False  # of motors that are a model
    arm.load_zero()
    for motor, joint in zip(models(arm), description.joints):
        motor.counted = motor.in_counts(joint.home)

    def advance(seconds):
        # type: (float) -> None
        for motor in models(arm):
            motor.advance(seconds, motors.controllers[motor])

    clock.on_jump = advance
    return arm


def measure_drawing(description, laps):
    # type: (Arm, Laps) -> None
    """Time the planning of a line, the ticks of moves and lines, an inverse, single accesses."""
    name = description.name
    ends = LINES[kinematics.coordinates(description)]
    clock = JumpingClock(laps)
    arm = arm_of_files(description, clock)
    plan = laps.timed(name + ": planning a line", trajectory.plan)(
        description, [paths.polyline(list(ends))[0]]
    )
    laps.timed(name + ": inverse", kinematics.inverse)(description, ends[0])
    clock.tick = name + ": tick, moving"
    laps.begin()
    arm.go_to(plan[0].start)
    clock.tick = name + ": tick, line"
    arm.follow(plan)
    laps.end("")
    motor = models(arm)[0]._motor
    for _ in range(3):
        laps.timed("read position", lambda: motor.position)()
        laps.timed("write speed_sp", lambda: setattr(motor, "speed_sp", 100))()
        laps.timed("write command", lambda: setattr(motor, "command", "stop"))()
    arm.park()


def measure_servoing(description, mode, laps, pieces):
    # type: (Arm, str, Laps, bool) -> None
    """Time a run to a goal.

    Args:
        description: shared.arm_description.Arm.
        mode: "look" | "stream".
        laps: Laps.
        pieces: whether to time what is computed in the ticks and between, instead of the ticks.
    """
    name = "{}, {}".format(description.name, mode)
    clock = JumpingClock(laps)
    arm = arm_of_files(description, clock)
    goal = GOALS[kinematics.coordinates(description)]
    servo, stream = make_servo(description, "chain", mode, tolerance=5)
    assert isinstance(servo, Servo)
    if pieces:
        _time(laps, servo, "decide", lambda one: "{}: decision, {}".format(name, one.action))
        _time(laps, servo.models, "observe_in_motion", name + ": learning from a frame")
        if stream:
            _time(laps, stream, "see", name + ": steering by a frame")
    cameras = SyntheticCameras(arm, clock, goal)
    reporter = RunReporter(say=lambda line: None)
    loop = VisualServoing(arm, cameras, clock, servo, stream=stream, reporter=reporter)
    if not pieces:
        clock.tick = name + ": tick"
        laps.begin()
    verdict = loop.run()
    if not pieces:
        laps.end("")
    arm.park()
    if verdict.word != "converged":
        raise AssertionError("{}: {}".format(name, verdict))


def _time(laps, owner, method, name):
    # type: (Laps, object, str, Union[str, Callable[[Any], str]]) -> None
    """Let each call of a method be a lap; its name as Laps.timed takes it."""
    setattr(owner, method, laps.timed(name, getattr(owner, method)))


def measure_link(laps):
    # type: (Laps) -> None
    """Time the check and decoding of an observation whose names are known."""
    laptop, brick = LineSigner(b"key"), LineSigner(b"key")

    def receive():
        # type: () -> List[object]
        return [decode(line, ("A", "effector", "goal")) for line, _ in brick.checked(lines)]

    for _ in range(5):
        lines = collections.deque([(laptop.sign(OBSERVATION + b"\n")[:-1], 0.0)])
        laps.timed("check and decode an observation", receive)()


def measure(names, laps):
    # type: (Sequence[str], Laps) -> None
    """Measure all of it, on the arms of these names."""
    measure_link(laps)
    for name in names:
        description = read_arm(find_arm(name))._replace(pen=None)
        with folder_of_motors(description.joints):
            measure_drawing(description, laps)
            for mode in ("look", "stream"):
                for pieces in (False, True):
                    measure_servoing(description, mode, laps, pieces)
    laps.timed("a full collection", lambda: gc.collect())()
