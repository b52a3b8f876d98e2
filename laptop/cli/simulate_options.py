"""The options of `simulate`, and what they say: the emulated brick, and what happens to it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import click

from laptop.cli.options import FiniteRange, arm_option, json_option, option_group, out_option
from laptop.cli.plugs import NO_ARM, plugged, wheels_of
from laptop.emulator import measured_brick
from laptop.emulator.device.buttons import MAX_ORDER_TIME, Press, read_press
from laptop.emulator.device.hand_guiding import HandPlace, read_hand
from laptop.emulator.device.plant_constants import read_plant
from laptop.emulator.device.sensor_orders import SensorOrder, read_sensors
from laptop.emulator.faults import FAULTS, Fault, InvalidSimulationOption, read_fault
from shared.arm_description import Arm, find_arm, read_arm

if TYPE_CHECKING:
    from laptop.emulator.device.plant_constants import PlantConstants
    from laptop.emulator.device.wheels import Wheels

SECTIONS = {
    "The brick": ("--arm", "--built", "--plug", "--wheels", "--plant", "--constants"),
    "What happens": (
        "--start",
        "--press",
        "--hand",
        "--fault",
        "--scene",
        "--realtime",
        "--timeout",
    ),
    "What is written": ("--out", "--picture", "--json"),
}

OPTIONS = option_group(
    arm_option("Arm on the emulated brick", "; none for a brick without one"),
    click.option("--plant", "plant_text", default="", metavar="KEY=VALUE,...", help="See below."),
    click.option(
        "--constants",
        "constants_file",
        metavar="FILE",
        help="The brick that robot/bench_brick.py has measured; --plant overrides.",
    ),
    click.option(
        "--built",
        "built_file",
        metavar="FILE",
        help="The arm as it was built, where that is not what --arm says: motors the other way "
        "round, swapped ports, no stops.  The script is told --arm.",
    ),
    out_option,
    click.option(
        "--realtime",
        is_flag=True,
        help="Keep pace with the clock on the wall, or slower if this computer is busy.",
    ),
    click.option(
        "--press",
        "presses",
        multiple=True,
        metavar="BUTTON@S",
        help="Press a brick button (or touch) at a time, e.g. enter@2.0; several times if needed.",
    ),
    click.option(
        "--hand",
        "hand_text",
        metavar='"X,Y@S ..."',
        help="A hand leads the tip to a place, cm, by a time, and on to the next ones, wherever "
        "the motors coast: for driver.py touch.",
    ),
    click.option(
        "--fault",
        "faults",
        multiple=True,
        metavar="KIND[:WHAT]@S",
        help="Let something go wrong: "
        + ", ".join(kind + (f":{what}" if what else "") for kind, what in FAULTS.items()),
    ),
    click.option(
        "--start",
        default="home",
        show_default=True,
        metavar="POSE",
        help="home: parked there, zero known; lost: never homed; unchecked: nor did anybody look "
        "which motor is where; one angle per joint in degrees; or after:DIR, where the run ends "
        "that leaves its files in DIR, which is waited for.",
    ),
    click.option(
        "--plug",
        multiple=True,
        metavar="PORT=KIND[:VALUES]",
        help="A motor (large or medium) at an output that the arm leaves free, A=large, or with "
        "stops, A=large:-90..40, deg; beside an arm D=large is there where D is free.  Or a sensor "
        "at an input, with its values over time: in2=ultrasonic:12..80/5s goes to and fro, "
        "in3=color:white:black@2 changes at 2 s, in4=gyro:turns.csv follows a file; a touch "
        "sensor is where nothing is said.",
    ),
    click.option(
        "--wheels",
        "wheels_text",
        metavar="KEY=VALUE,...",
        help="With --arm none: the motors at left=PORT and right=PORT carry a robot; its way is "
        "drawn.",
    ),
    click.option(
        "--timeout",
        type=FiniteRange(0, MAX_ORDER_TIME, min_open=True),
        default=600.0,
        show_default=True,
        help="Virtual seconds allowed.",
    ),
    click.option(
        "--scene",
        metavar="KEY=VALUE,...",
        help="Let a synthetic camera watch ('' for the usual one) and a tracker serve what it "
        "sees, in virtual time; the script finds it as one that it remembers.",
    ),
    click.option(
        "--picture/--no-picture",
        "pictured",
        default=None,
        help="Draw picture.png; it takes longer than all the rest.  [default: if the arm has "
        "moved]",
    ),
    json_option,
)


@dataclass(frozen=True, eq=False)
class BrickSetup:
    """Set-up of an emulated brick.

    arm       that programs are told; None: it has none
    built     the same as it truly is
    plant     its constants
    measured  those of them that a file has, see measured_brick; None: there is no file
    wheels    of a robot without an arm; None: it has none
    motors    port -> kind of those beside the arm's
    stops     port -> stops of some of them, rad
    sensors   port -> what is plugged in there
    """

    arm: Arm | None
    built: Arm | None
    plant: PlantConstants
    measured: dict[str, Any] | None
    wheels: Wheels | None
    motors: dict[str, str]
    stops: dict[str, tuple[float, float]]
    sensors: dict[str, SensorOrder]


@dataclass(frozen=True)
class BrickOptions:
    """An emulated brick, as it is typed.

    arm_file        the arm's name or file, or "none"
    plant_text      constants
    constants_file  that bench_brick.py has written; None: there is none
    built_file      of the arm as it truly is; None: as it is described
    plug            what is plugged in beside the arm
    wheels_text     of a robot without an arm; None: it has none
    """

    arm_file: str
    plant_text: str
    constants_file: str | None
    built_file: str | None
    plug: tuple[str, ...]
    wheels_text: str | None

    @property
    def sensors(self) -> tuple[str, ...]:
        """Sensors that are plugged into an input."""
        return tuple(text for text in self.plug if text.startswith("in"))

    def read(self, report: Callable[[str], None]) -> BrickSetup:
        """Return the brick; `report` is called with a line about measured constants.

        Raises:
            ArmError: something in it cannot be.
        """
        arm = None if self.arm_file == NO_ARM else read_arm(find_arm(self.arm_file))
        built = arm if self.built_file is None else _built(self.built_file, arm)
        wheels = wheels_of(self.wheels_text, arm)
        read_plant(self.plant_text)
        measured = None
        if self.constants_file is not None:
            measured = measured_brick.read_constants(self.constants_file, built)
        plant = read_plant(self.plant_text, measured)
        if measured:
            report(f"as {self.constants_file} has it: {measured_brick.in_words(measured)}")
        sensors = self.sensors
        motors, stops = plugged(built, [text for text in self.plug if text not in sensors], wheels)
        return BrickSetup(arm, built, plant, measured, wheels, motors, stops, read_sensors(sensors))


def _built(file: str, arm: Arm | None) -> Arm:
    """Return the arm as it was built."""
    if arm is None:
        raise InvalidSimulationOption(
            f"--built {file} is an arm, and --arm {NO_ARM} has none; leave one of them out"
        )
    return read_arm(find_arm(file))


@dataclass(frozen=True, eq=False)
class ScheduledEvents:
    """Events while a script runs.

    faults   what goes wrong
    presses  of buttons
    hand     where a hand leads the tip; None: there is none
    cameras  what watches, see Rig; None: nobody does
    ordered  what of this is ordered, as it is typed, and for when, s
    """

    faults: list[Fault]
    presses: list[Press]
    hand: list[HandPlace] | None
    cameras: Callable[[Any], Any] | None
    ordered: list[tuple[str, float]]

    def late(self, end: float) -> list[str]:
        """Return what would have come after the end, s."""
        return [words for words, t in self.ordered if t > end]


@dataclass(frozen=True)
class EventOptions:
    """Events while a script runs, as they are typed.

    start      where the arm stands, see Rig
    presses    of buttons
    hand_text  where a hand leads the tip; None: there is none
    faults     what goes wrong
    scene      before the camera that watches; None: nobody does
    realtime   it keeps pace with the clock on the wall
    timeout    virtual time that it may take, s
    """

    start: str
    presses: tuple[str, ...]
    hand_text: str | None
    faults: tuple[str, ...]
    scene: str | None
    realtime: bool
    timeout: float

    def read(self, built: Arm | None) -> ScheduledEvents:
        """Return what happens to an arm.

        Raises:
            ArmError: something in it cannot be, or it comes after the end.
        """
        hand = None if self.hand_text is None else read_hand(self.hand_text)
        faults = [read_fault(text) for text in self.faults]
        presses = [read_press(text) for text in self.presses]
        cameras = None if self.scene is None else _watched(self.scene, built, self.realtime)
        ordered = [
            *((f"--fault {text}", one.t) for text, one in zip(self.faults, faults, strict=True)),
            *((f"--press {text}", one.t) for text, one in zip(self.presses, presses, strict=True)),
            *((f"--hand {one.p[0]:g},{one.p[1]:g}@{one.t:g}", one.t) for one in hand or ()),
        ]
        self._check_in_time(ordered)
        return ScheduledEvents(faults, presses, hand, cameras, ordered)

    def _check_in_time(self, ordered: list[tuple[str, float]]) -> None:
        """Refuse what could only come after the end."""
        for words, t in ordered:
            if t > self.timeout:
                raise InvalidSimulationOption(
                    f"{words} comes after the end: the run is stopped at --timeout "
                    f"{self.timeout:g} s; give an earlier time or a longer --timeout"
                )


def _watched(text: str, arm: Arm | None, realtime: bool) -> Callable[[Any], Any]:
    """Return what serves a brick in virtual time with what the tracker finds in rendered frames."""
    if realtime:
        raise InvalidSimulationOption(
            "a scene is for virtual time; with --realtime, run track --camera synthetic beside it"
        )
    if arm is None:
        raise InvalidSimulationOption(
            f"--scene shows an arm, and --arm {NO_ARM} has none; leave one of them out"
        )
    from laptop.emulator.watching import watching  # OpenCV is slow to import

    return watching(text, arm)
