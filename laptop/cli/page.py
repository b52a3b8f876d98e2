"""`page`: the tracker's web page, before an emulated arm unless a camera is said."""

import click

from laptop.cli.options import SYNTHETIC, examples
from laptop.cli.track import track


@click.command(
    context_settings={"ignore_unknown_options": True},
    short_help="Watch, aim and draw in a browser; without a camera, an emulated arm.",
    epilog=examples("page", "page --arm spatial", "page --camera 0"),
)
@click.argument("args", metavar="[OPTIONS OF TRACK]...", nargs=-1, type=click.UNPROCESSED)
def page(args: tuple[str, ...]) -> None:
    """Open a web page on which you watch, aim, draw and stop.

    It is `track --page --open`, with all of track's options.  Without --camera it shows an emulated
    arm before a synthetic camera, and the emulated brick comes by itself.
    """
    track_args = ["--page", "--open", *args]
    if not any(word.split("=")[0] == "--camera" for word in args):
        track_args += ["--camera", SYNTHETIC]
    with track.make_context("track", track_args, click.get_current_context().parent) as context:
        track.invoke(context)
