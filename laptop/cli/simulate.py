"""`simulate`: any script on an emulated brick, and what it leaves."""

from __future__ import annotations

import contextlib
import difflib
import os
import sys
from collections.abc import Iterator
from contextlib import ExitStack
from itertools import pairwise
from pathlib import Path
from typing import Any

import click
from click.core import ParameterSource

from laptop.cli.command import OwnCommand
from laptop.cli.exit_status import ExitStatus
from laptop.cli.groups import in_groups
from laptop.cli.options import examples, importing, in_one_line, typed_args, write_run
from laptop.cli.simulate_options import (
    OPTIONS,
    SECTIONS,
    BrickOptions,
    BrickSetup,
    EventOptions,
    ScheduledEvents,
)
from laptop.emulator.bundled_scripts import BENCH_BRICK, DRIVER, SERVO, find_script
from laptop.emulator.device.plant_constants import TABLE
from laptop.emulator.device.sensor_orders import listing
from laptop.emulator.device.wheels import TABLE as WHEELS
from laptop.emulator.faults import InvalidSimulationOption
from laptop.emulator.host import output_lines
from laptop.emulator.host.guard import guarded
from laptop.emulator.rig import Plugs, Rig
from laptop.emulator.simulation_result import SimulationResult
from laptop.record.figures.private_paths import without_folders
from laptop.record.names import TRACE
from laptop.record.run_folder import FIGURES, PICTURE, SIDE_PICTURE, TRUE_PATH, run_folder
from shared.arm_description import ArmError, find_arm
from shared.state import CODE

TRACKED_SCRIPTS = ("visual_servoing.py", "tracking_client.py")
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


@click.command(
    cls=OwnCommand,
    short_help="Run a script, yours or ours, on an emulated brick.",
    sections=SECTIONS,
    context_settings={"ignore_unknown_options": True, "allow_interspersed_args": False},
    epilog=f"Sensors: {listing()}.\n\nWheels: {WHEELS.listing()}.\n\n"
    f"Plant constants: {TABLE.listing()}.\n\n{EXAMPLES}",
)
@OPTIONS
@click.argument("script", type=BrickScript())
@click.argument("args", nargs=-1, type=click.UNPROCESSED)
@in_groups(brick=BrickOptions, events=EventOptions)
def simulate(
    brick: BrickOptions,
    events: EventOptions,
    out: Path | None,
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
        from laptop.cli.simulate_record import ScriptRun

    with in_one_line(), ExitStack() as stack:
        _check_arm_of_script(brick.arm_file, script, args)
        setup = brick.read(click.echo)
        due = events.read(setup.built)
        log = _log_of(args)
        names = [TRACE, PICTURE, SIDE_PICTURE]
        names += [*FIGURES, f"{log.stem}.jsonl", TRUE_PATH] if log else []
        folder = stack.enter_context(run_folder("simulate", out, *names))
        result = _run(setup, events, due, script, args)
        title = " ".join([Path(script).name, *map(without_folders, args)])
        done = ScriptRun(title, result, brick, setup, events.scene, due.late(result.outcome.t))
        drawn = done.is_seen and (done.is_there_to_see if pictured is None else pictured)
        reported = done.record(typed_args(own=len(args) + 1))
        click.echo(done.summary(reported))
        if done.is_refused and folder.keeps_earlier_run():
            click.echo(f"no motor was asked to turn: {out} keeps the files of the run before")
        else:
            files = done.files(drawn)
            if log and log.is_file() and not done.is_refused:
                from laptop.cli.simulate_servo import servo_files

                files |= servo_files(reported, log, result, setup.built, events.scene, drawn)
            click.echo(write_run(folder, reported, files) + ("" if drawn else done.why_no_picture))
    if done.late:
        click.echo(
            f"laptop: never came: {', '.join(done.late)}; {Path(script).name} ended at "
            f"{result.outcome.t:.2f} s: give earlier times, or a longer script",
            err=True,
        )
    is_alone = events.scene is None and not events.realtime
    if done.is_refused and is_alone and os.path.basename(script) in TRACKED_SCRIPTS:
        click.echo(
            f"laptop: {Path(script).name} wants a tracker: with --scene '' before it a synthetic "
            "camera watches the arm, and one serves what it sees",
            err=True,
        )
    sys.exit(result.outcome.status or (ExitStatus.NEVER_CAME if done.late else 0))


def _run(
    setup: BrickSetup,
    events: EventOptions,
    due: ScheduledEvents,
    script: str,
    args: tuple[str, ...],
) -> SimulationResult:
    """Run the script on the emulated brick."""
    hand = due.hand
    with (
        guarded(Path(script).name),
        output_lines.complete(),
        _paired(events.realtime),
        Rig(
            *(setup.arm, setup.built, setup.plant, due.cameras, events.start),
            realtime=events.realtime,
            plugs=Plugs(setup.motors, setup.stops, setup.sensors, setup.wheels),
        ) as rig,
    ):
        return rig.run(
            *(script, *args),
            faults=due.faults,
            presses=due.presses,
            person=None if hand is None else lambda brick, devices: brick.guide(hand),
            timeout=events.timeout,
        )


def _log_of(args: tuple[str, ...]) -> Path | None:
    """Return the path of a script's --log option; None: it has none."""
    pairs = [(word, following) for word, following in pairwise((*args, ""))]
    named = [following for word, following in pairs if word == "--log"]
    named += [word.removeprefix("--log=") for word in args if word.startswith("--log=")]
    return Path(named[-1]) if named else None


@contextlib.contextmanager
def _paired(realtime: bool) -> Iterator[None]:
    """Give a program in real time the pairing code of this computer, for a `with` block."""
    from laptop.see.serve.pairing_file import known_code

    code = known_code() if realtime and CODE not in os.environ else None
    if code is not None:
        os.environ[CODE] = code
    try:
        yield
    finally:
        if code is not None:
            del os.environ[CODE]


def _check_arm_of_script(arm_file: str, script: str, args: tuple[str, ...]) -> None:
    """Refuse an arm told to the script alone: it would find no zero of that arm on the brick."""
    source = click.get_current_context().get_parameter_source("arm_file")
    separate = [following for word, following in pairwise(args) if word == "--arm"]
    reported = separate + [word[len("--arm=") :] for word in args if word.startswith("--arm=")]
    if source is ParameterSource.COMMANDLINE or not reported:
        return
    other = reported[-1]
    try:
        same = find_arm(other) == find_arm(arm_file)
    except ArmError:
        return  # the script's own affair
    if not same:
        raise InvalidSimulationOption(
            f"--arm {other} stands after {script} and tells that script alone, but the emulated "
            f"brick carries {arm_file}: put --arm {other} before {script}"
        )
