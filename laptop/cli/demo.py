"""`demo`: everything at once, without brick or camera."""

from __future__ import annotations

import sys
import webbrowser
from typing import Any

import click

from laptop.cli.command import OwnCommand
from laptop.cli.exit_status import ExitStatus
from laptop.cli.options import arm_option, examples, importing, on_the_page, out_option, typed_args
from laptop.cli.track import LOCALHOST
from shared.arm_description import ArmError


class TryLater(click.ClickException):
    """This computer is too busy."""

    exit_code = ExitStatus.BUSY


@click.command(
    cls=OwnCommand,
    short_help="Show everything, without a brick or a camera.",
    epilog=examples("demo", "demo --arm spatial --seed 7"),
)
@arm_option("Arm on the emulated brick")
@click.option(
    "--seed",
    type=click.IntRange(0, 2**31 - 1),
    default=0,
    show_default=True,
    help="Draws where the camera stands, what lies about and where the goals are.",
)
@out_option
@click.option(
    "--page/--no-page",
    default=True,
    help="Serve a web page to watch from, and to stop the arm (default); its address is printed.",
)
@on_the_page
def demo(arm_file: str, page_at: tuple[str | None, int | None], **options: Any) -> None:
    """Show everything without brick or camera: draw three lines, then reach three goals by sight.

    The programs of the brick run unmodified and in real time, linked to the tracker by TCP; one
    camera watches, or two where --arm spatial moves in space.  Leaves a report and all raw files in
    a folder of its own.  Its exit status is 0 only if the arm truly got everywhere,
    whatever the brick says.  On a busy computer all of it goes slower, and says so; the status is
    75 where not even that can go on.
    """
    with importing():  # OpenCV and matplotlib
        from rich.console import Console

        from laptop.measure.demo import demo_run, processes

    try:
        status, report = demo_run.run(
            demo_run.DemoOptions(
                arm=arm_file,
                typed=tuple(typed_args()),
                page_host=page_at[0] or LOCALHOST,
                page_port=page_at[1],
                **options,
            ),
            Console(),
        )
    except processes.TooBusy as error:
        raise TryLater(str(error)) from None
    except ArmError as error:
        raise click.ClickException(str(error)) from None
    if options["open"]:
        webbrowser.open(report.as_uri())
    sys.exit(status)
