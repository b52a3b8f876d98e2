"""`bench`: what is measured, table by table; each bench is a record, of which a command is made."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Executor
from contextlib import contextmanager
from importlib import import_module
from types import SimpleNamespace
from typing import Any, NamedTuple

import click

from laptop.bench import servo_scenarios
from laptop.cli.command import OwnCommand
from laptop.cli.commands import FullHelpGroup
from laptop.cli.options import (
    FiniteRange,
    Seeds,
    Settings,
    bench_examples,
    importing,
    in_one_line,
    noise_option,
    option_group,
    without_own_arms,
)
from laptop.emulator.device.plant_constants import CPU
from shared.run_options import MODES, ROWS

Option = Callable[[Any], Any]


def cpu_option() -> Option:
    """Return --plant, as far as a bench hears it: it is handed the cpu."""

    def cpu(ctx: click.Context, param: click.Parameter, value: dict[str, float] | None) -> float:
        return value["cpu"] if value else CPU

    return click.option(
        "--plant",
        "cpu",
        type=Settings({"cpu": FiniteRange(0, 20)}),
        callback=cpu,
        metavar="cpu=FACTOR",
        help="How slowly the brick computes: 1 as it truly does (default), 2 half as fast, 0 in no "
        "time.",
    )


CLUSTER_OPTION = click.option(
    "--cluster",
    metavar="ADDRESS",
    help="Share the work out on a Dask cluster, tcp://HOST:8786, say, and not on the cores of this "
    "machine.  Start it in this checkout: python -m dask scheduler, and on each machine python -m "
    "dask worker ADDRESS --nthreads 1, with --nworkers as it has cores.",
)

JSON_OPTION = click.option(
    "--json", "as_json", is_flag=True, help="All figures instead of the tables."
)


class BenchCommand(NamedTuple):
    """What is typed for a bench; what it does is the BenchRecord that its module has as BENCH.

    module: its full name; it is slow to import, and waits until it runs.
    """

    name: str
    module: str
    help: str
    options: tuple[Option, ...]
    examples: tuple[str, ...] = ()


def seeds_option(seeds: str | None, text: str, name: str = "--seeds") -> Option:
    """Return --seeds, or what is of its kind, with its default and its help."""
    return click.option(name, type=Seeds(), default=seeds, show_default=True, help=text)


def choices(name: str, values: tuple[str, ...], text: str) -> Option:
    """Return an option that takes several of these words, named in the plural to the bench."""
    kind = click.Choice(values) if values else None
    metavar = None if values else name[2:].upper()
    return click.option(name, name[2:] + "s", multiple=True, type=kind, metavar=metavar, help=text)


def command_of(record: BenchCommand) -> click.Command:
    """Make a bench's command: cases with a bar, then tables or JSON."""

    def run(cluster: str | None, as_json: bool, **typed: Any) -> None:
        it = SimpleNamespace(**typed)
        with in_one_line(), executor(cluster) as shared:
            bench, results = measure(record, it, shared)
            if as_json:
                click.echo(json.dumps(bench.figures(results), indent=1))
            else:
                display(bench.shown(results, it))
        if not bench.holds(results):
            raise SystemExit(1)

    command = option_group(*record.options, CLUSTER_OPTION, JSON_OPTION)(run)
    epilog = bench_examples(*record.examples) if record.examples else None
    return click.command(record.name, cls=OwnCommand, help=record.help, epilog=epilog)(command)


def display(parts: Iterable[Any]) -> None:
    """Print tables, and lines between them."""
    from laptop.bench import show

    for part in parts:
        click.echo(part) if isinstance(part, str) else show.table(part)


def measure(record: BenchCommand, it: Any, executor: Executor | None = None) -> tuple[Any, Any]:
    """Do a bench's work, with a bar; return its BenchRecord and the gathered results.

    Args:
        record: what is typed for it.
        it: the options, by their names.
        executor: does the work; None for the cores of this machine.

    Raises:
        ArmError: the options do not go together, or it cannot be done.
    """
    with importing():
        from laptop.bench import show

        bench = import_module(record.module).BENCH
    cases = bench.cases(it)
    parts = show.progress(bench.run(cases, executor), len(cases), bench.doing)
    return bench, bench.gather(list(parts), it)


@contextmanager
def executor(cluster: str | None) -> Iterator[Executor | None]:
    """Provide the executor of a cluster's address; None for the cores of this machine."""
    if cluster is None:
        yield None
        return
    from laptop.bench import workers

    with workers.cluster(cluster) as shared:
        yield shared


BENCHES = (
    BenchCommand(
        "draw",
        "laptop.bench.draw",
        "Straightness of lines: smooth, steps and timed steps, beside the encoders' floor.",
        (
            seeds_option("1000:1020", "Random plants and lines."),
            click.option(
                "--arm",
                type=click.Choice(["planar", "spatial"]),
                default="planar",
                show_default=True,
                help="planar: in direct drive and geared; spatial: what gravity does, and the "
                "preload.",
            ),
            cpu_option(),
        ),
        ("draw --seeds 1000:1002", "draw --arm spatial --plant cpu=2"),
    ),
    BenchCommand(
        "plot",
        "laptop.bench.plot",
        """Draw ten drawings, or these, by three arms at the brick's pace, and measure the ink.

        Five come along, five are drawn anew from rules that are everybody's: hilbert, snowflake,
        maze, tiles, stars.  Where vpype is installed, its order of strokes stands beside ours.
        """,
        (
            choices("--arm", (), "Only this one; all three."),
            click.option(
                "--out",
                "pictures",
                type=click.Path(exists=True, file_okay=False),
                metavar="DIR",
                help="Leave a picture of each there: wish and truth.",
            ),
            click.argument("files", nargs=-1, metavar="[FILE]..."),
        ),
        ("plot", "plot --arm planar mine.svg --out ."),
    ),
    BenchCommand(
        "planning",
        "laptop.bench.plot_speed",
        "How long large drawings take to be read and ordered, and vpype for the same.",
        (),
    ),
    BenchCommand(
        "servo",
        "laptop.bench.servo_table",
        f"""Servoing from random starts to random goals, beside the report's method and an oracle.

        SETUP is {", ".join(servo_scenarios.SCENARIOS)}: as it should be, or 10 % outliers, the LEGO
        stress, 2 px, three goals in a run, late pictures, a goal that moves.

        The clairvoyant is told the goal's joint angles, goes there, and looks once; the laws of
        the literature run if --method names them: {", ".join(servo_scenarios.PEERS)}.
        """,
        (
            seeds_option(
                "1000:1050",
                "Random arms, cameras, starts and goals; those of a release are 1000:1600.",
            ),
            click.argument(
                "scene",
                type=click.Choice(tuple(servo_scenarios.SCENARIOS)),
                default="nominal",
                metavar="[SETUP]",
            ),
            choices(
                "--arm",
                (*servo_scenarios.ARMS, "spatial"),
                "Several times for several.  [default: planar, geared]",
            ),
            click.option(
                "--rows",
                type=click.Choice(ROWS),
                default="stereo",
                show_default=True,
                help="Of two cameras: u and v of both, or of the second one row.",
            ),
            choices(
                "--method",
                servo_scenarios.METHODS,
                "Several times for several.  [default: those that the scene is about]",
            ),
            click.option(
                "--mode",
                type=click.Choice(MODES),
                help="look: look, then move; stream: move while pictures stream in, by methods "
                f"that can.  [default: {servo_scenarios.DEFAULT_MODE}; of latency and moving: "
                "stream]",
            ),
            click.option(
                "--rendered", is_flag=True, help="Through rendered frames and the tracker."
            ),
            cpu_option(),
        ),
        (
            "servo --seeds 1000:1010 --method chain",
            "servo goals --method chain --mode stream",
            "servo latency --arm geared --cluster tcp://127.0.0.1:8786",
        ),
    ),
    BenchCommand(
        "track",
        "laptop.bench.track",
        "The tracker's precision, hold under changing light, and cost, beside the usual recipes.",
        (seeds_option("4000:4002", "Noise, places, scenes and motions."),),
        ("track", "track --seeds 4000:4010 --json"),
    ),
    BenchCommand(
        "calibrate",
        "laptop.bench.calibrate",
        "Calibrate arms that are not as described, and compare what is found with the truth.",
        (seeds_option("0:10", "One arm each."),),
        ("calibrate --seeds 0:10",),
    ),
    BenchCommand(
        "ilc",
        "laptop.bench.ilc",
        """Three lines and two curves by arms that are not as described, after 0 to 3 rehearsals.

        Each seed's arm draws them as it is built and once as it is described.  The first five as
        built are seen in rendered pictures by the real tracker.

        TABLE is paths, as above; bounds: what is left, with each of its causes taken away; or
        drawings: one of thirty strokes, of which none, some or all are rehearsed.
        """,
        (
            click.argument(
                "about",
                type=click.Choice(("paths", "bounds", "drawings")),
                default="paths",
                metavar="[TABLE]",
            ),
            seeds_option("1:5", "One arm each."),
            cpu_option(),
        ),
        ("ilc --seeds 1:5", "ilc bounds", "ilc --json"),
    ),
    BenchCommand(
        "accuracy",
        "laptop.bench.accuracy",
        """Measure accuracy and repeatability by camera, and set the truth beside it.

        The emulated arm does the whole test of `accuracy` at the brick's pace.  Its cameras have
        lenses that bend, and are calibrated by photographs of the printed board.
        """,
        (
            choices("--arm", (), "Only this one; all three."),
            click.option(
                "--cycles",
                type=click.IntRange(3, 100),
                default=30,
                show_default=True,
                help="Of each pose.",
            ),
            noise_option("Of the marker in one picture, standard deviation."),
            seeds_option("1000:1001", "Of plants, cameras and noise."),
        ),
        ("accuracy", "accuracy --arm planar --cycles 10"),
    ),
)


@click.group(
    cls=FullHelpGroup,
    short_help="Measure beside the reference method and the physical limit.",
    commands=list(map(command_of, BENCHES)),
    epilog=bench_examples("draw --seeds 1000:1002", "servo --method chain --json"),
)
@click.pass_context
def bench(context: click.Context) -> None:
    """Measure against the reference method and the physical limit, on the emulated brick.

    By its name an arm is the one that comes along; give the file of one of your own.
    """
    context.with_resource(without_own_arms())
