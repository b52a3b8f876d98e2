"""`simulate`: any script on an emulated brick, and what it leaves."""

from __future__ import annotations

import contextlib
import difflib
import os
import sys
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from itertools import pairwise
from pathlib import Path
from typing import Any

import click
from click.core import ParameterSource

from laptop.cli.command import OwnCommand
from laptop.cli.exit_status import ExitStatus
from laptop.cli.options import (
    FiniteRange,
    arm_option,
    examples,
    importing,
    in_one_line,
    json_option,
    leave,
    out_option,
    typed_words,
)
from laptop.cli.plugs import NO_ARM, plugged, wheels_of
from laptop.cli.simulate_record import ending_of, files_of, in_words, log_of, set_up_of
from laptop.emulator import measured_brick
from laptop.emulator.device.buttons import LATEST, read_press
from laptop.emulator.device.leading_hand import read_hand
from laptop.emulator.device.plant_constants import TABLE, read_plant
from laptop.emulator.device.sensor_orders import listing, read_sensors
from laptop.emulator.device.wheels import TABLE as WHEELS
from laptop.emulator.faults import FAULTS, InvalidSimulationOption, read_fault
from laptop.emulator.host import last_line
from laptop.emulator.host.guard import guarded
from laptop.emulator.own_programs import BENCH_BRICK, DRIVER, SERVO, find_script
from laptop.emulator.rig import Plugs, Rig
from laptop.record.figures.arm_numbers import numbers_of
from laptop.record.figures.private_paths import without_folders
from laptop.record.names import TRACE
from laptop.record.run import DRAWING, SCRIPT, Run
from laptop.record.run_folder import (
    ENDED_BY_OTHERS,
    FIGURES,
    FROM_THE_SIDE,
    PICTURE,
    TRUE_PATH,
    run_folder,
)
from shared.arm_description import Arm, ArmError, find_arm, read_arm
from shared.state import CODE

WATCHED = ("visual_servoing.py", "tracking_client.py")
"""Scripts of the brick that listen to a tracker."""

EXAMPLES = examples(
    "simulate robot/driver.py line 10,0 5,10",
    "simulate --plant backlash=3,seed=4 --fault unplug:A@1.5 robot/driver.py home",
    "simulate --arm none --wheels left=B,right=C --plug in2=gyro:robot my_robot.py",
)


class BrickScript(click.Path):
    """A script: a file, or one of our own by its name."""

    def __init__(self) -> None:
        super().__init__(exists=True, dir_okay=False)

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Return its path; fail if there is none."""
        if value.startswith("-"):
            raise click.NoSuchOption(value, ctx=ctx)
        file = find_script(value)
        if not os.path.exists(file):
            own = sorted(os.path.basename(name) for name in (DRIVER, SERVO, BENCH_BRICK))
            near = difflib.get_close_matches(os.path.basename(file), [*own, *_scripts_here()], 1)
            more = f"did you mean {near[0]}?" if near else f"ours are {', '.join(own)}"
            self.fail(f"there is no {file}; {more}", param, ctx)
        return super().convert(file, param, ctx)


def _scripts_here() -> list[str]:
    """Return the names of the scripts in this folder."""
    return [name for name in os.listdir() if name.endswith(".py")]


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


@click.command(
    cls=OwnCommand,
    short_help="Run a script, yours or ours, on an emulated brick.",
    sections=SECTIONS,
    context_settings={"ignore_unknown_options": True, "allow_interspersed_args": False},
    epilog=f"Sensors: {listing()}.\n\nWheels: {WHEELS.listing()}.\n\n"
    f"Plant constants: {TABLE.listing()}.\n\n{EXAMPLES}",
)
@arm_option("Arm on the emulated brick", "; none for a brick without one")
@click.option("--plant", "plant_text", default="", metavar="KEY=VALUE,...", help="See below.")
@click.option(
    "--constants",
    "constants_file",
    metavar="FILE",
    help="The brick that robot/bench_brick.py has measured; --plant overrides.",
)
@click.option(
    "--built",
    "built_file",
    metavar="FILE",
    help="The arm as it was built, where that is not what --arm says: motors the other way round, "
    "swapped ports, no stops.  The script is told --arm.",
)
@out_option
@click.option(
    "--realtime",
    is_flag=True,
    help="Keep pace with the clock on the wall, or slower if this computer is busy.",
)
@click.option(
    "--press",
    "presses",
    multiple=True,
    metavar="BUTTON@S",
    help="Press a brick button (or touch) at a time, e.g. enter@2.0; several times if needed.",
)
@click.option(
    "--hand",
    "hand_text",
    metavar='"X,Y@S ..."',
    help="A hand leads the tip to a place, cm, by a time, and on to the next ones, wherever the "
    "motors coast: for driver.py touch.",
)
@click.option(
    "--fault",
    "faults",
    multiple=True,
    metavar="KIND[:WHAT]@S",
    help="Let something go wrong: "
    + ", ".join(kind + (f":{what}" if what else "") for kind, what in FAULTS.items()),
)
@click.option(
    "--start",
    default="home",
    show_default=True,
    metavar="POSE",
    help="home: parked there, zero known; lost: never homed; unchecked: nor did anybody look which "
    "motor is where; one angle per joint in degrees; or after:DIR, where the run ends that leaves "
    "its files in DIR, which is waited for.",
)
@click.option(
    "--plug",
    multiple=True,
    metavar="PORT=KIND[:VALUES]",
    help="A motor (large or medium) at an output that the arm leaves free, A=large, or with stops, "
    "A=large:-90..40, deg; beside an arm D=large is there where D is free.  Or a sensor at an "
    "input, with its values over time: in2=ultrasonic:12..80/5s goes to and fro, "
    "in3=color:white:black@2 changes at 2 s, in4=gyro:turns.csv follows a file; a touch "
    "sensor is where nothing is said.",
)
@click.option(
    "--wheels",
    "wheels_text",
    metavar="KEY=VALUE,...",
    help="With --arm none: the motors at left=PORT and right=PORT carry a robot; its way is drawn.",
)
@click.option(
    "--timeout",
    type=FiniteRange(0, LATEST, min_open=True),
    default=600.0,
    show_default=True,
    help="Virtual seconds allowed.",
)
@click.option(
    "--scene",
    metavar="KEY=VALUE,...",
    help="Let a synthetic camera watch ('' for the usual one) and a tracker serve what it sees, in "
    "virtual time; the script finds it as one that it remembers.",
)
@click.option(
    "--picture/--no-picture",
    "pictured",
    default=None,
    help="Draw picture.png; it takes longer than all the rest.  [default: if the arm has moved]",
)
@json_option
@click.argument("script", type=BrickScript())
@click.argument("args", nargs=-1, type=click.UNPROCESSED)
def simulate(
    arm_file: str,
    plant_text: str,
    constants_file: str | None,
    built_file: str | None,
    out: Path | None,
    realtime: bool,
    presses: tuple[str, ...],
    hand_text: str | None,
    faults: tuple[str, ...],
    start: str,
    plug: tuple[str, ...],
    wheels_text: str | None,
    timeout: float,
    scene: str | None,
    pictured: bool | None,
    script: str,
    args: tuple[str, ...],
) -> None:
    """Run an ev3dev2 SCRIPT, unmodified, on an emulated brick; its exit status is the script's.

    Leaves run.json, trace.csv and picture.png in a folder of its own.  Options go before SCRIPT.
    Every run is a brick of its own: what one run homes, the next does not know.  It computes as
    slowly as a real one; with --plant cpu=0 in no time.  The status is 3 where the script succeeds
    before a fault, a press or the hand has come.  A script that fails before any motor turns leaves
    the files of an earlier run as they are.
    """
    with importing():  # numpy; --help does without
        from laptop.record.drawing_tables import paths_table
        from laptop.record.figures import line_accuracy

    with in_one_line(), ExitStack() as stack:
        arm = None if arm_file == NO_ARM else read_arm(find_arm(arm_file))
        built = arm if built_file is None else _built(built_file, arm)
        wheels = wheels_of(wheels_text, arm)
        _check_arm_of_script(arm_file, script, args)
        read_plant(plant_text)
        measured = (
            None if constants_file is None else measured_brick.read_constants(constants_file, built)
        )
        plant = read_plant(plant_text, measured)
        if measured:
            click.echo(f"as {constants_file} has it: {measured_brick.in_words(measured)}")
        sensors = tuple(text for text in plug if text.startswith("in"))
        extra, stops = plugged(built, [text for text in plug if text not in sensors], wheels)
        hand = None if hand_text is None else read_hand(hand_text)
        happening = [read_fault(text) for text in faults]
        pressed = [read_press(text) for text in presses]
        sensed = read_sensors(sensors)
        watched = None if scene is None else _watched(scene, built, realtime)
        ordered = [
            *((f"--fault {text}", fault.t) for text, fault in zip(faults, happening, strict=True)),
            *((f"--press {text}", press.t) for text, press in zip(presses, pressed, strict=True)),
            *(
                (f"--hand {place.p[0]:g},{place.p[1]:g}@{place.t:g}", place.t)
                for place in hand or ()
            ),
        ]
        _check_in_time(ordered, timeout)
        names = [TRACE, PICTURE, FROM_THE_SIDE]
        if log := log_of(args):
            names += [*FIGURES, f"{log.stem}.jsonl", TRUE_PATH]
        folder = stack.enter_context(run_folder("simulate", out, *names))
        with (
            guarded(Path(script).name),
            last_line.finished(),
            _paired(realtime),
            Rig(
                *(arm, built, plant, watched, start),
                realtime=realtime,
                plugs=Plugs(extra, stops, sensed, wheels),
            ) as rig,
        ):
            run = rig.run(
                *(script, *args),
                faults=happening,
                presses=pressed,
                person=None if hand is None else lambda brick, devices: brick.lead(hand),
                timeout=timeout,
            )
        # Without a pen motor all of the motion is ink, and none of it belongs to one path.
        wanted = run.wanted if built and built.pen else []
        measures = line_accuracy.measure(run.record, wanted)
        seen = arm is not None or wheels is not None
        to_see = line_accuracy.is_there_to_see(run.record, run.wanted)
        drawn = seen and (to_see if pictured is None else pictured)
        late = [words for words, t in ordered if t > run.outcome.t]
        refused = not run.asked and 0 < run.outcome.status < ENDED_BY_OTHERS
        told = Run(
            kind=DRAWING if wanted else SCRIPT,
            what=" ".join([Path(script).name, *map(without_folders, args)]),
            typed=typed_words(own=len(args) + 1),
            ending=ending_of(run, refused, late),
            arm=arm and numbers_of(arm),
            built=numbers_of(built) if built and built is not arm else None,
            tables=[paths_table(arm.name, measures)] if arm and wanted else [],
        )
        told.on_emulated_brick(plant_text, scene, cpu=plant["cpu"])
        told.set_up |= set_up_of(constants_file, measured, sensors, scene)
        click.echo(in_words(told, run, arm))
        if refused and folder.keeps_earlier_run():
            click.echo(f"no motor was asked to turn: {out} keeps the files of the run before")
        else:
            files = files_of(told.what, arm, run, wanted, measures, sensors, drawn)
            if log and log.is_file() and not refused:
                from laptop.cli.simulate_servo import servo_files

                files |= servo_files(told, log, run, built, scene, drawn)
            mover = "arm" if arm else "robot"
            why = "" if to_see else f"; the {mover} has not moved, so there is no picture"
            why = why if seen else "; without an arm and --wheels there is no picture"
            click.echo(leave(folder, told, files) + ("" if drawn else why))
    if late:
        click.echo(
            f"laptop: never came: {', '.join(late)}; {Path(script).name} ended at "
            f"{run.outcome.t:.2f} s: give earlier times, or a longer script",
            err=True,
        )
    if refused and scene is None and not realtime and os.path.basename(script) in WATCHED:
        click.echo(
            f"laptop: {Path(script).name} wants a tracker: with --scene '' before it a synthetic "
            "camera watches the arm, and one serves what it sees",
            err=True,
        )
    sys.exit(run.outcome.status or (ExitStatus.NEVER_CAME if late else 0))


@contextlib.contextmanager
def _paired(realtime: bool) -> Iterator[None]:
    """Let a program in real time know the code of this computer's tracker, for a `with` block."""
    from laptop.see.serve.pairing_file import known_code

    code = known_code() if realtime and CODE not in os.environ else None
    if code is not None:
        os.environ[CODE] = code
    try:
        yield
    finally:
        if code is not None:
            del os.environ[CODE]


def _built(file: str, arm: Arm | None) -> Arm:
    """Return the arm as it was built."""
    if arm is None:
        raise InvalidSimulationOption(
            f"--built {file} is an arm, and --arm {NO_ARM} has none; leave one of them out"
        )
    return read_arm(find_arm(file))


def _check_in_time(ordered: list[tuple[str, float]], timeout: float) -> None:
    """Refuse what could only come after the end."""
    for words, t in ordered:
        if t > timeout:
            raise InvalidSimulationOption(
                f"{words} comes after the end: the run is stopped at --timeout {timeout:g} s; "
                "give an earlier time or a longer --timeout"
            )


def _check_arm_of_script(arm_file: str, script: str, args: tuple[str, ...]) -> None:
    """Refuse an arm told to the script alone: it would find no zero of that arm on the brick."""
    source = click.get_current_context().get_parameter_source("arm_file")
    apart = [following for word, following in pairwise(args) if word == "--arm"]
    told = apart + [word[len("--arm=") :] for word in args if word.startswith("--arm=")]
    if source is ParameterSource.COMMANDLINE or not told:
        return
    other = told[-1]
    try:
        same = find_arm(other) == find_arm(arm_file)
    except ArmError:
        return  # the script's own affair
    if not same:
        raise InvalidSimulationOption(
            f"--arm {other} stands after {script} and tells that script alone, but the emulated "
            f"brick carries {arm_file}: put --arm {other} before {script}"
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
