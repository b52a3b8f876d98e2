"""Options that several commands have."""

from __future__ import annotations

from collections.abc import Callable

import click

from shared import state

ON_THE_BRICK = click.option(
    "--arm",
    "arm_file",
    default="planar",
    envvar=state.ARM,
    show_default=True,
    show_envvar=True,
    metavar="FILE",
    help="Arm on the emulated brick: planar, geared, spatial or a file.",
)


def on_the_page(command: Callable[..., None]) -> Callable[..., None]:
    """Options of a command that serves the page."""
    for option in (
        click.option("--open", "open", is_flag=True, help="Open what is to be seen in a browser."),
        click.option(
            "--page-host",
            default="127.0.0.1",
            metavar="H",
            show_default=True,
            help="Address at which the page is to be had; 0.0.0.0 for the whole network.",
        ),
        click.option(
            "--page-port",
            type=click.IntRange(0, 65535),
            metavar="P",
            help="Of the page, 0 for any.  [default: 7780, or any if that is taken]",
        ),
    ):
        command = option(command)
    return command
