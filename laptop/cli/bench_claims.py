"""Claims of the project that are measured like benches."""

from __future__ import annotations

import json
from dataclasses import asdict, replace

import click

from laptop.cli.bench import CLUSTER_OPTION, CPU_OPTION, executor
from laptop.cli.options import Seeds, bench_examples, importing, in_one_line


@click.command(
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
@CLUSTER_OPTION
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
        with executor(cluster) as shared:
            parts = show.progress(track_confidence.run(todo, shared), len(todo), "tracking")
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


@click.command(
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
@CPU_OPTION
@CLUSTER_OPTION
@click.option("--json", "as_json", is_flag=True, help="Every run instead of the table.")
def bench_disturbances(
    seeds: range, arms: tuple[str, ...], cpu: float, cluster: str | None, as_json: bool
) -> None:
    """Servoing while something goes wrong: false claims, blind motion, limits passed."""
    from laptop.bench import servo_disturbances, show

    todo = servo_disturbances.cases(seeds, arms or ("planar",), cpu)
    with executor(cluster) as shared:
        results = list(show.progress(servo_disturbances.run(todo, shared), len(todo), "disturbing"))
    if as_json:
        click.echo(json.dumps([asdict(result) for result in results], indent=1))
        return
    title = (
        f"seeds {seeds.start}:{seeds.stop}, cpu={cpu:g}, figures from the emulator; "
        f"{servo_disturbances.LEGEND}"
    )
    show.table(title, servo_disturbances.HEADINGS, servo_disturbances.table(results), sections=1)
    click.echo(servo_disturbances.summary(results))


@click.command(
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
@CPU_OPTION
@CLUSTER_OPTION
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

    with executor(cluster) as shared:
        todo = len(faults.named_cases(cpu))
        named = list(show.progress(faults.run_all_named(cpu, shared), todo, "by name"))
        random = {}
        for name, drawn in (("random", seeds), ("pairs", pairs)):
            parts = faults.run(drawn or range(0), cpu, shared, in_pairs=name == "pairs")
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


@click.command(
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
@CPU_OPTION
@CLUSTER_OPTION
@click.option("--json", "as_json", is_flag=True, help="Every arm's figures instead of the table.")
def bench_wrong_arms(seeds: range, cpu: float, cluster: str | None, as_json: bool) -> None:
    """Arms built otherwise than described: whether that is named, and how far they turn till then.

    The status is 1 if one is not as it should be.
    """
    with importing():
        from laptop.bench import show, wrong_arms

    with executor(cluster) as shared:
        parts = wrong_arms.run(seeds, cpu, shared)
        results = list(show.progress(parts, 2 * len(seeds), "arms"))
    if as_json:
        click.echo(json.dumps([asdict(result) for result in results], indent=1))
    else:
        title = f"seeds {seeds.start}:{seeds.stop}, cpu={cpu:g}, figures from the emulator"
        show.table(title, wrong_arms.HEADINGS, wrong_arms.table(results), sections=0)
        click.echo(wrong_arms.summary(results))
    if not all(result.good for result in results):
        raise SystemExit(1)


@click.command(
    "limits",
    epilog=bench_examples("limits", "limits --cpu 2"),
)
@CPU_OPTION
@CLUSTER_OPTION
def bench_limits(cpu: float, cluster: str | None) -> None:
    """Where straightness ends: the planar arm's three lines on plants farther and farther off."""
    with importing():
        from laptop.bench import draw, show

    drawings = draw.limit_cases()
    with executor(cluster) as shared:
        parts = draw.BENCH.run([replace(one, cpu=cpu) for one in drawings], shared)
        results = list(show.progress(parts, len(drawings), "drawing"))
    title = f"planar arm, smooth, cpu={cpu:g}; greatest deviation in floors, from the emulator"
    show.table(title, draw.LIMIT_HEADINGS, draw.limit_table(results), sections=0)


@click.command("brick", epilog=bench_examples("brick", "brick > brick.txt"))
def bench_brick() -> None:
    """What the brick's computing costs: counted on its Python, and as the emulator charges it."""
    with importing():
        from laptop.bench import brick, show

    rows = list(show.progress(brick.run(), brick.count(), "computing"))
    title = "thousand instructions of CPython 3.5.3 on an ARM926; ms at 300 MHz and CPI 6.8"
    show.table(title, brick.HEADINGS, brick.table(rows), sections=0)
