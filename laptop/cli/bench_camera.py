"""`bench camera`: what a printed board tells of a camera."""

from __future__ import annotations

import json
from dataclasses import asdict

import click

from laptop.cli.options import Seeds, bench_examples, importing


@click.command(
    "camera",
    epilog=bench_examples("camera", "camera --seeds 5000:5002 --json"),
)
@click.option(
    "--seeds",
    type=Seeds(),
    default="5000:5005",
    show_default=True,
    help="Lenses, places of the camera and noise.",
)
@click.option("--json", "as_json", is_flag=True, help="All figures instead of the tables.")
def bench_camera(seeds: range, as_json: bool) -> None:
    """Millimetres from the picture: by the board, of a code's middle, of the pen by its marker."""
    with importing():
        from laptop.bench import camera, camera_codes, camera_table, camera_touch, show

    todo = camera.cases(seeds)
    results = list(show.progress(camera.run(todo), len(todo), "photographing"))
    sides = camera_codes.SIDES
    codes = [
        camera_codes.measure(side, seeds)
        for side in show.progress(sides, len(sides), "ArUco markers")
    ]
    touches = camera_touch.measure(seeds)
    moved = camera.moves(seeds.start)
    if as_json:
        told = {
            "board": list(map(asdict, results)),
            "aruco": list(map(asdict, codes)),
            "touches": list(map(asdict, touches)),
            "moved": [
                {"by": by, "noticed": noticed, "said": words} for by, noticed, words in moved
            ],
        }
        click.echo(json.dumps(camera_table.without_nan(told), indent=1))
        return
    title = f"seeds {seeds.start}:{seeds.stop}, {len(seeds)} lenses, rendered"
    rows = camera_table.table(results)
    show.table(f"The board; {title}; {camera_table.LEGEND}", camera_table.HEADINGS, rows, 0)
    show.table(
        f"ArUco's middle, px RMS per axis; {title}",
        camera_codes.HEADINGS,
        camera_codes.table(codes),
        0,
    )
    show.table(
        f"The pen's place by its marker, mm; {title}",
        camera_touch.HEADINGS,
        camera_touch.table(touches),
        0,
    )
    click.echo("What is said:")
    for line in camera_table.said(results):
        click.echo(f"  {line}")
    for by, _, words in moved:
        click.echo(f"  moved: {by}: {words}")
