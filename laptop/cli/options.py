"""Options that several commands have."""

from __future__ import annotations

import contextlib
import math
import os
import signal
import tempfile
import threading
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import click

from laptop.cli.commands import TYPED
from laptop.record.figures.private_paths import without_folders
from shared import state
from shared.arm_description import ArmError
from shared.state import STATE

SYNTHETIC = "synthetic"
"""The camera before which an emulated brick comes by itself."""


@contextlib.contextmanager
def importing() -> Iterator[None]:
    """While a command imports what takes seconds, Ctrl-C ends it at once: nothing has begun."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.signal(signal.SIGINT, signal.SIG_DFL)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)


class Seeds(click.ParamType):
    """A range of seeds, A:B, from A to below B."""

    name = "A:B"

    def convert(
        self, value: str, param: click.Parameter | None, ctx: click.Context | None
    ) -> range:
        """Return the range; fail if it is none, or empty."""
        try:
            first, last = (int(part) for part in value.split(":"))
        except ValueError:
            self.fail(f"'{value}' is not A:B, two whole numbers like 1000:1020")
        if not 0 <= first < last:
            self.fail(f"'{value}' holds no seed: A must be from 0 and below B")
        return range(first, last)


class FiniteRange(click.FloatRange):
    """A number of a range, which nan is not: it compares with none."""

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> float:
        """Return the number; fail if it is none, or lies outside."""
        number: float = super().convert(value, param, ctx)
        if not math.isfinite(number):
            self.fail(f"{number} is not in the range {self._describe_range()}.", param, ctx)
        return number


def arm_option(what: str, more: str = "") -> Callable[[Any], Any]:
    """Return the option for an arm; `what` and `more` are its help's begin and end."""
    return click.option(
        "--arm",
        "arm_file",
        default="planar",
        envvar=state.ARM,
        show_default=True,
        show_envvar=True,
        metavar="FILE",
        help=f"{what}: planar, geared, spatial or a file{more}.",
    )


out_option = click.option(
    "--out",
    metavar="DIR",
    type=click.Path(path_type=Path),
    help="Leave all files there.  [default: runs/TIME-COMMAND]",
)
"""The option for the folder of what a command makes."""


def typed_words(own: int = 0) -> list[str]:
    """Return what was typed, but for where it is left: that is where it lies.

    Args:
        own: so many words at the end are a script's own.
    """
    typed = list(click.get_current_context().meta.get(TYPED, []))
    words, rest = typed[: len(typed) - own], typed[len(typed) - own :]
    for k in range(len(words) - 1, -1, -1):
        if words[k] == "--out":
            del words[k : k + 2]
        elif words[k].startswith("--out="):
            del words[k]
    return [without_folders(word) for word in words + rest]


replace_option = click.option(
    "--replace", is_flag=True, help="Put what is written in the place of a file that is there."
)
"""The option without which nothing is written over."""


camera_option = click.option(
    "--camera",
    "cameras",
    multiple=True,
    metavar="SOURCE",
    help="A webcam's number, or what else track takes; several times for several.",
)
"""The option for where pictures come from."""

sources_argument = click.argument("sources", metavar="", nargs=-1)
"""What --camera was before: the sources alone."""


def cameras_of(cameras: Sequence[str], sources: Sequence[str]) -> tuple[str, ...]:
    """Return the sources that are typed, also those without --camera, as they were before."""
    if sources:
        words = " ".join(f"--camera {source}" for source in sources)
        click.echo(f"{' '.join(sources)} is now {words}", err=True)
    return (*cameras, *sources)


def calibration_option(text: str, multiple: bool = False) -> Callable[[Any], Any]:
    """Return the option for what `measure camera` wrote."""
    return click.option(
        "--calibration",
        multiple=multiple,
        type=click.Path(dir_okay=False, path_type=Path),
        metavar="FILE.json",
        help=text,
    )


def marker_height_option(text: str) -> Callable[[Any], Any]:
    """Return the option for the height of the arm's marker, mm."""
    return click.option(
        "--marker-height", "height", type=FiniteRange(0, 500), metavar="MM", help=text
    )


listen_port_option = click.option(
    "--listen-port",
    "port",
    type=click.IntRange(0, 65535),
    metavar="P",
    help="Port at which the brick is waited for, 0 for any.  [default: 7711]",
)
"""The option for the link's port."""

call_option = click.option(
    "--brick",
    "call",
    is_flag=False,
    flag_value="",
    metavar="[NAME]",
    help="Start the program on that brick, over ssh; without a name on the last one.",
)
"""The option to have a real brick do its part."""

frame_size_option = click.option(
    "--frame-size", "size", metavar="WxH", help="Asked of a webcam, px.  [default: 640x480]"
)
"""The option for the size of pictures."""


bar_option = click.option(
    "--bar",
    type=float,
    metavar="MM",
    help="Length of the board's bar as measured.  [default: 100, not measured]",
)
"""The option for the length of the board's printed bar."""


def option_group(*options: Any) -> Any:
    """Return what gives a command these options and arguments, in their order."""

    def add(command: Any) -> Any:
        for option in reversed(options):
            command = option(command)
        return command

    return add


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


@contextlib.contextmanager
def in_one_line() -> Iterator[None]:
    """End the command with a line where something goes wrong in an orderly way."""
    try:
        yield
    except ArmError as error:
        failure = click.ClickException(str(error))
        failure.exit_code = getattr(error, "status", 1)  # type: ignore[misc]  # (of click: a number)
        raise failure from None


def examples(*lines: str) -> str:
    """Epilog of the help of a command: examples, each on a line of its own."""
    commands = (f"  {state.laptop_program()} {line}" for line in lines)
    return "\n".join(("\b", "Examples:", *commands))


def bench_examples(*lines: str) -> str:
    """Epilog of the help of a `bench` command, see `examples`."""
    return examples(*(f"bench {line}" for line in lines))


def noise_option(text: str) -> Callable[[Any], Any]:
    """Provide --noise: of a marker before an emulated camera, as the tracker has it, px."""
    return click.option(
        "--noise",
        type=FiniteRange(0, 10),
        default=0.03,
        show_default=True,
        metavar="PX",
        help=text,
    )


@contextlib.contextmanager
def without_own_arms() -> Iterator[None]:
    """Let an arm's name mean the one that comes along, though one's own has the same name."""
    before = {STATE: os.environ[STATE]} if STATE in os.environ else {}
    with tempfile.TemporaryDirectory(prefix="brickservo-bench-") as folder:
        os.environ[STATE] = folder
        try:
            yield
        finally:
            del os.environ[STATE]
            os.environ.update(before)
