"""`bench`: what is measured, table by table."""

from __future__ import annotations

import json
from collections.abc import Iterator
from concurrent.futures import Executor
from contextlib import contextmanager
from dataclasses import asdict

import click

from laptop.cli.bench_accuracy import bench_accuracy
from laptop.cli.bench_calibrate import bench_calibrate
from laptop.cli.bench_camera import bench_camera
from laptop.cli.bench_interruptions import bench_interruptions
from laptop.cli.bench_jobs import bench_jobs
from laptop.cli.bench_page import bench_page, bench_stop
from laptop.cli.bench_plot import bench_plot
from laptop.cli.bench_sight import bench_sight
from laptop.cli.options import (
    FiniteRange,
    Seeds,
    bench_examples,
    importing,
    in_one_line,
    without_own_arms,
)
from laptop.emulator.device.plant_constants import CPU


@click.group(epilog=bench_examples("draw --seeds 1000:1002", "servo --method chain --json"))
@click.pass_context
def bench(context: click.Context) -> None:
    """Measure against the reference method and the physical limit, on the emulated brick.

    By its name an arm is the one that comes along; give the file of one of your own.
    """
    context.with_resource(without_own_arms())


_cpu = click.option(
    "--cpu",
    type=FiniteRange(0, 20),
    default=CPU,
    show_default=True,
    help="How slowly the brick computes: 1 as it truly does, 2 half as fast, 0 in no time.",
)

_cluster = click.option(
    "--cluster",
    metavar="ADDRESS",
    help="Share the work out on a Dask cluster, tcp://HOST:8786, say, and not on the cores of this "
    "machine.  Start it in this checkout: python -m dask scheduler, and on each machine python -m "
    "dask worker ADDRESS --nthreads 1, with --nworkers as it has cores.",
)


@contextmanager
def _executor(cluster: str | None) -> Iterator[Executor | None]:
    """Provide the executor of a cluster's address; None for the cores of this machine."""
    if cluster is None:
        yield None
        return
    with importing():
        from laptop.bench import workers

    try:
        with workers.cluster(cluster) as executor:
            yield executor
    except workers.NoCluster as error:
        raise click.ClickException(str(error)) from None


@bench.command(
    "draw",
    epilog=bench_examples("draw --seeds 1000:1002", "draw --arm spatial --cpu 2"),
)
@click.option(
    "--seeds",
    type=Seeds(),
    default="1000:1020",
    show_default=True,
    help="Random plants and lines.",
)
@click.option(
    "--arm",
    type=click.Choice(["planar", "spatial"]),
    default="planar",
    show_default=True,
    help="planar: in direct drive and geared; spatial: what gravity does, and the preload.",
)
@_cpu
@_cluster
@click.option("--json", "as_json", is_flag=True, help="Every line's figures instead of the table.")
def bench_draw(seeds: range, arm: str, cpu: float, cluster: str | None, as_json: bool) -> None:
    """Straightness of lines: smooth, steps and timed steps, beside the encoders' floor."""
    with importing():
        from laptop.bench import draw, show  # what else a command needs is slow to import

    in_space = arm == "spatial"
    drawings = draw.space_cases(seeds) if in_space else list(draw.cases(seeds))
    with _executor(cluster) as executor:
        parts = draw.run(drawings, cpu, executor)
        results = list(show.progress(parts, len(drawings), "drawing"))
    if as_json:
        click.echo(json.dumps([asdict(result) for result in results], indent=1))
    else:
        title = f"seeds {seeds.start}:{seeds.stop}, cpu={cpu:g}, figures from the emulator, mm"
        if in_space:
            title += "; greatest deviations"
            show.table(title, draw.SPACE_HEADINGS, draw.space_table(results), sections=1)
            sags = [
                f"{draw.sag(weight, cpu):.2f} mm" for weight in ("not fed forward", "felt", "off")
            ]
            click.echo(
                "the level line hangs through by {}; with the weight fed forward {}; without "
                "gravity {}".format(*sags)
            )
        else:
            show.table(title, draw.HEADINGS, draw.table(results), sections=3)
        for reason, count in draw.failures(results).items():
            click.echo(f"{count} x {reason}")


@bench.command(
    "track",
    epilog=bench_examples("track", "track --seeds 4000:4010 --json"),
)
@click.option(
    "--seeds",
    type=Seeds(),
    default="4000:4002",
    show_default=True,
    help="Noise, places, scenes and motions.",
)
@_cluster
@click.option("--json", "as_json", is_flag=True, help="All figures instead of the tables.")
def bench_track(seeds: range, cluster: str | None, as_json: bool) -> None:
    """The tracker's precision, hold under changing light, and cost, beside the usual recipes."""
    with importing():
        from laptop.bench import show, track, track_cost, track_table

    todo = track.cases(seeds)
    with _executor(cluster) as executor:
        parts = show.progress(track.run(todo, executor), len(todo), "tracking")
        results = track_table.gathered(result for part in parts for result in part)
    timed = track_cost.costs(show.progress(range(track_cost.TURNS), track_cost.TURNS, "timing"))
    link = track_cost.serving()
    if as_json:
        click.echo(json.dumps({**track_table.figures(results, timed), "serving": link}, indent=1))
        return
    title = f"seeds {seeds.start}:{seeds.stop}, figures from the emulator"
    precision, light = track_table.precision_table(results), track_table.light_table(results)
    headings = track_table.precision_headings(results)
    show.table(f"Precision, px rms per axis; {title}", headings, precision, 0)
    rims = track_table.rim_table(results)
    show.table(f"Printed discs, px; {title}", track_table.RIM_HEADINGS, rims, 0)
    show.table(f"Light and scene, px; {title}", track_table.LIGHT_HEADINGS, light, 0)
    show.table(
        "Cost, measured on this machine",
        track_table.COST_HEADINGS,
        track_table.cost_table(timed),
        0,
    )
    click.echo(f"serving the brick 60 times a second: {100 * link:.1f} % of a core")
    for line in track_table.errors(results):
        click.echo(line)


@bench.command(
    "confidence",
    epilog=bench_examples("confidence", "confidence --films FOLDER --plot confidence.png"),
)
@click.option(
    "--seeds",
    type=Seeds(),
    default="7000:7004",
    show_default=True,
    help="Markers, grounds, lamps and what hides them.",
)
@click.option("--films", metavar="FOLDER", help="Films, and truth.json with circles in them.")
@click.option("--plot", metavar="FILE.png", help="Draw error against confidence, all positions.")
@_cluster
@click.option("--json", "as_json", is_flag=True, help="Every position instead of the tables.")
def bench_confidence(
    seeds: range, films: str | None, plot: str | None, cluster: str | None, as_json: bool
) -> None:
    """What confidence says of the error, where a marker is hidden, blurred or gone."""
    from laptop.bench import show, track_confidence, track_confidence_table, track_films, track_rays

    with in_one_line():
        todo: list[track_confidence.Case] = [
            *track_confidence.render_cases(seeds),
            *track_rays.ray_cases(seeds),
            *(track_films.film_cases(films, seeds) if films else ()),
        ]
        with _executor(cluster) as executor:
            parts = show.progress(track_confidence.run(todo, executor), len(todo), "tracking")
            claims = [claim for part in parts for claim in part]
        if plot:
            track_confidence_table.plot(claims, plot)
    if as_json:
        click.echo(json.dumps(track_confidence_table.figures(claims), indent=1))
        return
    title = f"seeds {seeds.start}:{seeds.stop}; {track_confidence_table.LEGEND}"
    rows, lies = track_confidence_table.table(claims), track_confidence_table.lies(claims)
    show.table(f"Confidence against error; {title}", track_confidence_table.HEADINGS, rows, 1)
    show.table("Lies by confidence", track_confidence_table.LIES_HEADINGS, lies, 1)


@bench.command(
    "servo",
    epilog=bench_examples(
        "servo --seeds 1000:1010 --method chain",
        "servo --scene latency --arm geared --cluster tcp://127.0.0.1:8786",
    ),
)
@click.option(
    "--seeds",
    type=Seeds(),
    default="1000:1050",
    show_default=True,
    help="Random arms, cameras, starts and goals; those of a release are 1000:1600.",
)
@click.option(
    "--scene",
    type=click.Choice(("nominal", "outliers", "lego", "precise", "latency", "moving")),
    default="nominal",
    show_default=True,
    help="Or 10 % outliers, the LEGO stress, 2 px, late pictures, a goal that moves.",
)
@click.option(
    "--arm",
    "arms",
    multiple=True,
    type=click.Choice(("planar", "geared", "spatial")),
    help="Several times for several.  [default: planar, geared]",
)
@click.option(
    "--rows",
    type=click.Choice(("stereo", "xyz")),
    default="stereo",
    show_default=True,
    help="Of two cameras: u and v of both, or of the second one row.",
)
@click.option(
    "--method",
    "methods",
    multiple=True,
    type=click.Choice(("report", "report, median", "broyden", "kalman", "chain", "oracle")),
    help="Several times for several.  [default: those that the scene is about]",
)
@click.option("--rendered", is_flag=True, help="Through rendered frames and the tracker.")
@_cpu
@_cluster
@click.option("--json", "as_json", is_flag=True, help="Every run instead of the table.")
def bench_servo(
    seeds: range,
    scene: str,
    arms: tuple[str, ...],
    rows: str,
    methods: tuple[str, ...],
    rendered: bool,
    cpu: float,
    cluster: str | None,
    as_json: bool,
) -> None:
    """Servoing from random starts to random goals, beside the report's method and an oracle."""
    with importing():
        from laptop.bench import servo, servo_cost, servo_setups, servo_table, show

    if scene == "moving" and "spatial" in arms:
        raise click.ClickException(
            "--scene moving: its goals run round in the plane; take another with --arm spatial"
        )
    if rendered and scene not in servo_setups.RENDERED:
        raise click.ClickException(
            f"--scene {scene} is made of points with noise; with --rendered take one of "
            f"{', '.join(servo_setups.RENDERED)}"
        )
    arms = arms or servo_setups.ARMS
    todo = servo.cases(seeds, scene, arms, methods, rendered, rows, cpu)
    with _executor(cluster) as executor:
        parts = show.progress(servo.run(todo, executor), len(todo), "servoing")
        results = [result for part in parts for result in part]
    if as_json:
        click.echo(json.dumps([asdict(result) for result in results], indent=1))
        return
    headings = servo_table.MOVING_HEADINGS if scene == "moving" else servo_table.HEADINGS
    what = f"seeds {seeds.start}:{seeds.stop}, cpu={cpu:g}"
    title = f"{what}, figures from the emulator; {servo_table.LEGEND}"
    show.table(title, headings, servo_table.table(results), sections=2)
    for line in [*servo_table.failures(results), servo_cost.step_cost(arms[0])]:
        click.echo(line)


@bench.command(
    "disturbances",
    epilog=bench_examples("disturbances", "disturbances --seeds 1000:1001 --arm geared --json"),
)
@click.option(
    "--seeds",
    type=Seeds(),
    default="1000:1003",
    show_default=True,
    help="Random arms, cameras, starts, goals and moments.",
)
@click.option(
    "--arm",
    "arms",
    multiple=True,
    type=click.Choice(("planar", "geared", "spatial")),
    help="Several times for several.  [default: planar]",
)
@_cpu
@_cluster
@click.option("--json", "as_json", is_flag=True, help="Every run instead of the table.")
def bench_disturbances(
    seeds: range, arms: tuple[str, ...], cpu: float, cluster: str | None, as_json: bool
) -> None:
    """Servoing while something goes wrong: false claims, blind motion, limits passed."""
    from laptop.bench import servo_disturbances, show

    todo = servo_disturbances.cases(seeds, arms or ("planar",), cpu)
    with _executor(cluster) as executor:
        results = list(
            show.progress(servo_disturbances.run(todo, executor), len(todo), "disturbing")
        )
    if as_json:
        click.echo(json.dumps([asdict(result) for result in results], indent=1))
        return
    title = (
        f"seeds {seeds.start}:{seeds.stop}, cpu={cpu:g}, figures from the emulator; "
        f"{servo_disturbances.LEGEND}"
    )
    show.table(title, servo_disturbances.HEADINGS, servo_disturbances.table(results), sections=1)
    click.echo(servo_disturbances.summary(results))


@bench.command(
    "faults",
    epilog=bench_examples("faults", "faults --seeds 20000:20009 --json"),
)
@click.option(
    "--seeds",
    type=Seeds(),
    help="Random tasks, five faults in each, beside those by name; 200 make a thousand.",
)
@click.option(
    "--pairs", type=Seeds(), help="The same with five pairs of faults in each; 60 make 300."
)
@click.option(
    "--page/--no-page",
    "with_page",
    default=True,
    show_default=True,
    help="Whether those of the page are among them; they need a browser and minutes.",
)
@_cpu
@_cluster
@click.option("--json", "as_json", is_flag=True, help="Every fault instead of the tables.")
def bench_faults(
    seeds: range | None,
    pairs: range | None,
    with_page: bool,
    cpu: float,
    cluster: str | None,
    as_json: bool,
) -> None:
    """Faults of arm, brick, program, page: when the arm stands, how far it goes, what is said."""
    with importing():
        from laptop.bench import faults, page, page_faults, show

    with _executor(cluster) as executor:
        todo = len(faults.named_cases(cpu))
        named = list(show.progress(faults.run_all_named(cpu, executor), todo, "by name"))
        random = {}
        for name, drawn in (("random", seeds), ("pairs", pairs)):
            parts = faults.run(drawn or range(0), cpu, executor, in_pairs=name == "pairs")
            shown = show.progress(parts, len(drawn or ()), name)
            random[name] = [result for part in shown for result in part]
    of_page: list[page_faults.PageFaultResult] = []
    if with_page:
        with in_one_line():
            try:
                struck = page_faults.run()
                of_page = list(show.progress(struck, len(page_faults.FAULTS), "of the page"))
            except page.NoBrowser as error:
                click.echo(f"faults of the page left out: {error}", err=True)
    if as_json:
        others = {name: [asdict(r) for r in results] for name, results in random.items()}
        told = {
            "named": [r._asdict() for r in named],
            **others,
            "page": list(map(asdict, of_page)),
        }
        click.echo(json.dumps(told, indent=1))
        return
    title = f"planar arm, cpu={cpu:g}, in the middle of its motion; figures from the emulator"
    show.table(title, faults.NAMED_HEADINGS, faults.named_table(named), sections=1)
    if of_page:
        rows = page_faults.table(of_page)
        show.table(page_faults.TITLE, page_faults.HEADINGS, rows, sections=1)
        click.echo(f"{page_faults.LEGEND}\n{page_faults.summary(of_page)}")
    for drawn, results in zip((seeds, pairs), random.values(), strict=True):
        if drawn and results:
            title = f"seeds {drawn.start}:{drawn.stop}, cpu={cpu:g}; {faults.LEGEND}"
            show.table(title, faults.HEADINGS, faults.table(results), sections=2)
            click.echo(faults.summary(results))


@bench.command(
    "wrong-arms",
    epilog=bench_examples("wrong-arms --seeds 1:5", "wrong-arms --json"),
)
@click.option(
    "--seeds",
    type=Seeds(),
    default="1:21",
    show_default=True,
    help="Random wrong arms, and as many right ones.",
)
@_cpu
@_cluster
@click.option("--json", "as_json", is_flag=True, help="Every arm's figures instead of the table.")
def bench_wrong_arms(seeds: range, cpu: float, cluster: str | None, as_json: bool) -> None:
    """Arms built otherwise than described: whether that is named, and how far they turn till then.

    The status is 1 if one is not as it should be.
    """
    with importing():
        from laptop.bench import show, wrong_arms

    with _executor(cluster) as executor:
        parts = wrong_arms.run(seeds, cpu, executor)
        results = list(show.progress(parts, 2 * len(seeds), "arms"))
    if as_json:
        click.echo(json.dumps([asdict(result) for result in results], indent=1))
    else:
        title = f"seeds {seeds.start}:{seeds.stop}, cpu={cpu:g}, figures from the emulator"
        show.table(title, wrong_arms.HEADINGS, wrong_arms.table(results), sections=0)
        click.echo(wrong_arms.summary(results))
    if not all(result.good for result in results):
        raise SystemExit(1)


@bench.command(
    "limits",
    epilog=bench_examples("limits", "limits --cpu 2"),
)
@_cpu
@_cluster
def bench_limits(cpu: float, cluster: str | None) -> None:
    """Where straightness ends: the planar arm's three lines on plants farther and farther off."""
    with importing():
        from laptop.bench import draw, show

    drawings = draw.limit_cases()
    with _executor(cluster) as executor:
        parts = draw.run(drawings, cpu, executor)
        results = list(show.progress(parts, len(drawings), "drawing"))
    title = f"planar arm, smooth, cpu={cpu:g}; greatest deviation in floors, from the emulator"
    show.table(title, draw.LIMIT_HEADINGS, draw.limit_table(results), sections=0)


@bench.command("brick", epilog=bench_examples("brick", "brick > brick.txt"))
def bench_brick() -> None:
    """What the brick's computing costs: counted on its Python, and as the emulator charges it."""
    with importing():
        from laptop.bench import brick, show

    rows = list(show.progress(brick.run(), brick.count(), "computing"))
    title = "thousand instructions of CPython 3.5.3 on an ARM926; ms at 300 MHz and CPI 6.8"
    show.table(title, brick.HEADINGS, brick.table(rows), sections=0)


for command in (
    *(bench_accuracy, bench_calibrate, bench_camera, bench_interruptions, bench_jobs),
    *(bench_page, bench_plot, bench_sight, bench_stop),
):
    bench.add_command(command)
