"""Rig with an emulated arm: programs run on it, cameras watch, the ground truth is known.

    with Rig("planar", plant="backlash=3,seed=4", cameras="tilt=20") as rig:
        run = rig.run("driver.py", "line", "10,0", "5,10")
        print(run.outcome.status, rig.tip)
        image = rig.see()["A"].image

In virtual time the results depend on the arguments alone, not on the load of the computer.
"""

import contextlib
import os
import sys
from typing import (
    Any,
    Callable,
    Dict,
    Iterable,
    Iterator,
    List,
    NamedTuple,
    Optional,
    Tuple,
    Union,
)

from laptop.emulator import temporary_folders
from laptop.emulator.brick_environment import brick_folders
from laptop.emulator.brick_home import at_home, prepare_home, read_start, wanted_paths
from laptop.emulator.bundled_scripts import find_script
from laptop.emulator.device.brick import EmulatedBrick
from laptop.emulator.device.motion_record import MotionRecord
from laptop.emulator.device.peripherals import Peripherals, let_joints_touch
from laptop.emulator.device.plant_constants import read_plant
from laptop.emulator.device.sensor_environment import environment_of
from laptop.emulator.faults import (
    Fault,
    InvalidSimulationOption,
    read_fault,
    schedule_faults,
    schedule_pictures,
)
from laptop.emulator.host import program
from laptop.emulator.host.runner import Outcome, run_script
from laptop.emulator.host.world import World
from laptop.emulator.live import PoseWriter
from laptop.emulator.pace import PacedClock
from laptop.emulator.simulation_result import SimulationResult
from robot.motion import chains, kinematics
from shared.arm_description import find_arm, read_arm

MYPY = False
if MYPY:
    from typing import ContextManager, Sequence  # noqa: F401

    from laptop.emulator.brick_home import Start  # noqa: F401
    from laptop.emulator.device.buttons import Press  # noqa: F401
    from laptop.emulator.device.plant_constants import PlantConstants  # noqa: F401
    from laptop.emulator.device.sensor_orders import SensorOrder  # noqa: F401
    from laptop.emulator.device.wheels import Wheels  # noqa: F401
    from laptop.emulator.faults import WatchingTracker  # noqa: F401
    from laptop.see.camera.frames import Frame  # noqa: F401
    from shared.arm_description import Arm  # noqa: F401

    Watch = Callable[[EmulatedBrick], ContextManager[Optional[WatchingTracker]]]
    Meanwhile = Iterable[Tuple[float, Callable[[], object]]]  # s, and what is called then
    Person = Callable[[EmulatedBrick, Peripherals], object]
    Keyboard = Callable[[EmulatedBrick], Any]
    Faults = Union[str, Fault, Iterable[Union[str, Fault]]]


class Plugs(
    NamedTuple(
        "Plugs",
        [
            ("motors", Optional[Dict[str, str]]),
            ("stops", Optional[Dict[str, Tuple[float, float]]]),
            ("sensors", Optional[Dict[str, "SensorOrder"]]),
            ("wheels", Optional["Wheels"]),
        ],
    )
):
    """Devices plugged in beside the arm.

    Args:
        motors: port -> kind of a motor, "large" or "medium".
        stops: port of such a motor -> lower and upper angle that it can turn to, rad.
        sensors: port -> what laptop.emulator.device.sensor_orders reads; None: a touch sensor at
            each.
        wheels: of a brick without an arm, from laptop.emulator.device.wheels.read_wheels.
    """

    __slots__ = ()

    def __new__(
        cls,
        motors: Optional[Dict[str, str]] = None,
        stops: Optional[Dict[str, Tuple[float, float]]] = None,
        sensors: Optional[Dict[str, "SensorOrder"]] = None,
        wheels: Optional["Wheels"] = None,
    ) -> "Plugs":
        """Return the Plugs."""
        return super(Plugs, cls).__new__(cls, motors, stops, sensors, wheels)


_Parts = NamedTuple(
    "_Parts",
    [
        ("stack", contextlib.ExitStack),
        ("world", World),
        ("brick", EmulatedBrick),
        ("devices", Peripherals),
        ("state_folder", str),
    ],
)
"""Parts of an open rig."""


class Rig(object):
    """An arm on an emulated brick, for a `with` block.

    Its runs follow one another on the same brick: the zero that one finds is stored for the next,
    and the arm stays where a run has left it.

    Args:
        arm: nominal arm, which programs get: a name ("planar", "geared", "spatial"), a file or a
            shared.arm_description.Arm, of which programs read the file; None for a brick without.
        built: true arm, where motors, ports, stops or links differ; like `arm`.
        plant: the plant's constants, a text as `simulate --plant` takes it, such as
            "cpu=0,backlash=3" (`brickservo simulate --help` lists them), or what
            laptop.emulator.device.plant_constants.read_plant gives.  A `seed` in it draws the
            scattered constants.
        cameras: the scene, a text as `simulate --scene` takes it, such as "tilt=20" ("" for the
            default one; laptop.emulator.scene.scene_constants lists the keys): cameras that watch
            the true arm, and a tracker that the programs find.  None: no camera.
            Or `cameras(brick)`, which gives a context manager for a tracker: its `port`
            on this machine, `code`, `key`, and `pictures` (PictureFaults) by camera in `frames`.
        start: "home", "lost", "unchecked", "after:FOLDER" or one angle in degrees a joint, see
            `simulate --start`; or joint angles, rad, of an arm whose zero is known.
        state_folder: persistent state of the brick (zero, tracker, jobs), which may be that of an
            earlier rig; a temporary one if None.
        realtime: run in real time; cameras in other processes see the arm then.
        plugs: Plugs, the devices beside the arm.

    Attributes:
        arm: nominal Arm, or None.
        built: true Arm, or None.

    Raises:
        ArmError: there is no such arm.
        BadPlant: a text of the plant that cannot be understood.
        InvalidSimulationOption: an impossible start, or an arm built of other joints; from its
            properties and methods, that it is not open.
    """

    def __init__(
        self,
        arm: Union[str, "Arm", None] = "planar",
        built: Union[str, "Arm", None] = None,
        plant: Union[str, "PlantConstants", None] = "",
        cameras: Union[str, "Watch", None] = None,
        start: "Start" = "home",
        state_folder: Optional[str] = None,
        realtime: bool = False,
        plugs: Plugs = Plugs(),  # noqa: B008 (it does not change)
    ) -> None:
        self.arm = _arm_of(arm)
        self.built = self.arm if built is None else _arm_of(built)
        if self.built is not None:
            _check_chain(self.built, self.arm)
        if plant is None or isinstance(plant, str):
            plant = read_plant(plant or "")
        self._start = start
        self._q, self._homed = read_start(start, self.arm)
        self._plant, self._realtime, self._plugs = plant, realtime, plugs
        self._cameras = cameras
        self._given_folder = state_folder
        self._parts = None  # type: Optional[_Parts]
        self._tracker = None  # type: Optional[WatchingTracker]
        self._writer = None  # type: Optional[PoseWriter]
        self._begun = 0  # number of samples of earlier runs in the record

    def __enter__(self) -> "Rig":
        stack, plugs = contextlib.ExitStack(), self._plugs
        with contextlib.ExitStack() as undone:
            undone.callback(stack.close)
            clock = PacedClock() if self._realtime else None
            if clock:
                stack.callback(clock.close)
            world = World(clock)
            world.report = _report
            brick = EmulatedBrick(
                world, self.built, self._plant, self._q, plugs.motors, plugs.wheels, plugs.stops
            )
            if not self._homed:
                brick.reset_motors()  # just switched on: an arm that gravity pulls drops
            devices = Peripherals(
                world,
                brick.sysfs,
                voltage=lambda: brick.plant.plant["voltage"],
                sensors=plugs.sensors,
                environment=environment_of(brick),
            )
            let_joints_touch(brick, devices)
            folder = self._given_folder or stack.enter_context(temporary_folders.made("home"))
            prepare_home(
                folder, self.arm, self._q, self._start, self._homed, self._plant["encoder"]
            )
            undone.pop_all()
        self._parts = _Parts(stack, world, brick, devices, folder)
        return self

    def __exit__(self, *error: object) -> None:
        self._open.stack.close()

    @property
    def _open(self) -> _Parts:
        """Its _Parts.

        Raises:
            InvalidSimulationOption: it has never been open.
        """
        if self._parts is None:
            raise InvalidSimulationOption("the rig is not open; write: with Rig(...) as rig:")
        return self._parts

    @property
    def world(self) -> World:
        """The World, whose `now()` is the time since the rig was opened, s."""
        return self._open.world

    @property
    def brick(self) -> EmulatedBrick:
        """The EmulatedBrick."""
        return self._open.brick

    @property
    def devices(self) -> Peripherals:
        """The Peripherals, which are buttons, screen and sensors."""
        return self._open.devices

    @property
    def state_folder(self) -> str:
        """Folder of the brick's persistent state."""
        return self._open.state_folder

    def run(
        self, script: Any, *args: Any, faults: "Faults" = (), presses: Iterable["Press"] = (),
        meanwhile: "Meanwhile" = (), person: Optional["Person"] = None,
        keyboard: Optional["Keyboard"] = None, timeout: float = 600.0, patience: float = 10.0
    ) -> SimulationResult:  # fmt: skip
        """Run a script on the brick until it ends, and simulate a little longer.

        What it prints goes to this process's standard output and error.

        Args:
            script: path of a Python file, or the name of a bundled script
                (driver.py, visual_servoing.py, tracking_client.py, bench_brick.py).
            *args: arguments of the script, each made a text by str.
            faults: texts as `simulate --fault` takes them, such as "stall:B@1.5", or
                laptop.emulator.faults.Fault values.  Their times, and all others here, count from
                now, s.  Faults last through the runs that follow.
            presses: laptop.emulator.device.buttons.Press values.
            meanwhile: pairs of a time, s, and a function without arguments, called then.
            person: `person(brick, devices)` is called before the script starts; it models a user,
                who presses buttons and guides the arm by hand.
            keyboard: `keyboard(brick)` gives the text file that the script has for standard input;
                this process's if None.
            timeout: greatest duration of the run, virtual s; a longer one ends with status 124.
            patience: greatest time of this computer without a read of the clock, s; likewise.

        Returns:
            SimulationResult; a program that fails is one, too.

        Raises:
            InvalidSimulationOption: there is no such script, or a fault is invalid, or its port or
                camera does not exist.
            BadPress: no touch sensor to press.
            BadScene: the text of the cameras cannot be understood.
        """
        brick, world, path = self.brick, self.world, _existing(str(script))
        world.name = os.path.basename(path)
        begun = world.now()
        read_faults = [read_fault(one) if isinstance(one, str) else one for one in _listed(faults)]
        ordered = schedule_faults(brick, self.devices, read_faults)
        for t, act in meanwhile:
            world.at(begun + t, act)
        plan = os.path.join(self.state_folder, "plan")
        before = len(wanted_paths(plan, self.arm))  # of earlier runs
        self._publish(world.name)
        tracker = self._watch()
        schedule_pictures(world, tracker, read_faults)
        home = at_home(self.state_folder, world, self.arm, tracker)
        with home, self._with_user(person, keyboard):
            outcome = run_script(
                brick,
                path,
                [str(word) for word in args],
                self.devices,
                [press._replace(t=press.t + begun) for press in presses],
                timeout=timeout,
                patience=patience,
                folders=brick_folders(self.state_folder),
                **ordered,
            )
            wanted = wanted_paths(plan, self.arm)[before:]
        return self._result(outcome, wanted, begun)

    def job(self, file: Any, *args: Any, **options: Any) -> SimulationResult:
        """Draw a job by driver.py.

        Args:
            file: path of the job file, as `brickservo draw --to FILE.job` makes it.
            *args: more arguments of `driver.py job`, such as "--dry".
            **options: as for `run`.

        Returns:
            SimulationResult.

        Raises:
            InvalidSimulationOption, BadPress, BadScene: as `run` does.
        """
        return self.run("driver.py", "job", str(file), *args, **options)

    def program(self) -> "ContextManager[program.Program]":
        """Compute in this process at the brick's speed, for a `with` block.

        Gives a laptop.emulator.host.program.Program: its modules by name, and its `clock`, whose
        `now()` and `sleep(seconds)` are s of the rig's world.  Its state is in `state_folder`.
        """
        return program.on(self.brick)

    def see(self) -> Dict[str, "Frame"]:
        """Return the newest pictures of the cameras, by name ("A", ...).

        Each is a laptop.see.camera.frames.Frame: `image`, BGR, uint8, shape (height, width, 3), and
        `t`, when it was taken, s.

        Raises:
            InvalidSimulationOption: there is no camera, or no text describes it.
            BadScene: that text cannot be understood.
        """
        brick, watched = self.brick, self._cameras
        if not isinstance(watched, str):
            raise InvalidSimulationOption("no camera watches; give cameras, such as tilt=20")
        from laptop.emulator.scene.synthetic_camera import film  # OpenCV is slow to import
        from laptop.emulator.scene.workcell import cameras

        names = cameras(self._true_arm, watched)
        films = {name: film(brick, watched, name) for name in names}
        return {name: one.capture(one.newest(self.world.now())) for name, one in films.items()}

    @property
    def q(self) -> Tuple[float, ...]:
        """The true joint angles, rad; without an arm those of its motors."""
        return self.brick.plant.q

    @property
    def tip(self) -> Tuple[float, ...]:
        """The true tip, (x, y) or in space (x, y, z), cm from the arm's base.

        Raises:
            InvalidSimulationOption: there is no arm.
        """
        return kinematics.forward(self._true_arm, self.q)

    @property
    def record(self) -> MotionRecord:
        """MotionRecord of all runs, the true links and tip, one sample per 5 ms."""
        return self.brick.record

    @property
    def _true_arm(self) -> "Arm":
        """The true arm.

        Raises:
            InvalidSimulationOption: there is none.
        """
        if self.built is None:
            raise InvalidSimulationOption("there is no arm on this brick; name one: Rig(arm)")
        return self.built

    @contextlib.contextmanager
    def _with_user(
        self, person: Optional["Person"], keyboard: Optional["Keyboard"]
    ) -> Iterator[None]:
        """Model a user at the brick and at its script's keyboard, for a `with` block."""
        if person:
            person(self.brick, self.devices)
        before = sys.stdin
        if keyboard:
            sys.stdin = keyboard(self.brick)
        try:
            yield
        finally:
            sys.stdin = before

    def _watch(self) -> Optional["WatchingTracker"]:
        """Return the tracker of the cameras, which starts with the first run."""
        if self._tracker is None and self._cameras is not None:
            watched = self._cameras
            if isinstance(watched, str):
                from laptop.emulator.watching import watching

                watched = watching(watched, self._true_arm)
            self._tracker = self._open.stack.enter_context(watched(self.brick))
        return self._tracker

    def _publish(self, name: str) -> None:
        """Let cameras in other processes see the arm, in real time."""
        if self._writer is None and self.world.realtime and self.brick.arm is not None:
            self._writer = writer = PoseWriter(self.brick, name)
            self._open.stack.callback(writer.close)
            self.world.bodies.append(writer.advance)

    def _result(
        self, outcome: Outcome, wanted: List[List[Tuple[float, ...]]], begun: float
    ) -> SimulationResult:
        brick, built = self.brick, self.built
        record = brick.record.since(self._begun)
        self._begun = len(brick.record)
        motors = {
            port: {"mode": motor.mode, "driven": motor.driven, "position": motor.position}
            for port, motor in brick.motors.items()
        }
        skeleton = ()  # type: Sequence[Tuple[float, ...]]
        reach = None
        if built is not None:
            skeleton = kinematics.joint_positions(built, brick.plant.q)
            reach = chains.reach(built)
        pace = self.world.pace.mean if self.world.pace else None
        return SimulationResult(
            outcome,
            record,
            wanted,
            motors,
            brick.names,
            skeleton,
            reach,
            pace,
            brick.asked(),
            begun,
        )


def _listed(faults: "Faults") -> Iterable[Union[str, Fault]]:
    return [faults] if isinstance(faults, (str, Fault)) else faults


def _check_chain(built: "Arm", arm: Optional["Arm"]) -> None:
    """Refuse a true arm whose joints differ in kind from the nominal ones."""
    if arm is None:
        raise InvalidSimulationOption(
            "{} is built, but programs are told of no arm; give that, too".format(built.name)
        )
    if built.chain != arm.chain:
        raise InvalidSimulationOption(
            "{} is built as a {} arm, but {} describes a {} one; give two of one chain".format(
                built.name, built.chain, arm.name, arm.chain
            )
        )


def _existing(script: str) -> str:
    """Return the path of a script as typed.

    Raises:
        InvalidSimulationOption: there is none.
    """
    path = find_script(script)
    if not os.path.exists(path):
        raise InvalidSimulationOption(
            "{}: there is no such script; give its path, or one of the brick's own: "
            "driver.py, visual_servoing.py, tracking_client.py, bench_brick.py".format(path)
        )
    return path


def _arm_of(arm: Union[str, "Arm", None]) -> Optional["Arm"]:
    return read_arm(find_arm(arm)) if isinstance(arm, str) else arm


def _report(line: str) -> None:
    sys.stderr.write(line + "\n")
