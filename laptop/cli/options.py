"""Options that several commands have."""

from __future__ import annotations

import contextlib
import json
import math
import os
import signal
import sys
import tempfile
import threading
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click

from laptop.cli.commands import TYPED
from laptop.record.figures.private_paths import without_folders
from laptop.record.run import Run, as_json
from laptop.record.run_folder import RunFolder
from shared import state
from shared.arm_description import ArmError
from shared.state import STATE

if TYPE_CHECKING:
    ParamType = click.ParamType[Any]
else:
    ParamType = click.ParamType  # generic since click 8.5 only
_Command = TypeVar("_Command", bound=Callable[..., Any])

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


class Seeds(ParamType):
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


class Settings(ParamType):
    """KEY=VALUE,... as {key: value}, each of its own type.

    Args:
        kinds: key -> type of its value.
    """

    name = "KEY=VALUE,..."

    def __init__(self, kinds: Mapping[str, ParamType]) -> None:
        self._kinds = kinds

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Return the values; fail if a key is none, or a value is not of its type."""
        if isinstance(value, dict):
            return value
        values = {}
        for part in value.split(","):
            key, equals, text = (word.strip() for word in part.partition("="))
            if not equals or key not in self._kinds:
                forms = ", ".join(f"{name}=VALUE" for name in self._kinds)
                self.fail(f"'{part}' is none of {forms}", param, ctx)
            values[key] = self._kinds[key].convert(text, param, ctx)
        return values


def settings_option(name: str, kinds: Mapping[str, ParamType], text: str) -> Callable[[Any], Any]:
    """Return an option of Settings; given several times, all of them count."""

    def merged(ctx: click.Context, param: click.Parameter, value: Any) -> dict[str, Any]:
        return {key: one for values in value for key, one in values.items()}

    return click.option(
        name, type=Settings(kinds), multiple=True, callback=merged, metavar=Settings.name, help=text
    )


class ListenAt(ParamType):
    """[HOST:]PORT as (host, port); None for what is left out."""

    name = "[HOST:]P"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Return both; fail if they are none."""
        if isinstance(value, tuple):
            return value
        host, colon, port = value.rpartition(":")
        if (port or not colon) and not (port.isdecimal() and int(port) <= 65535):
            self.fail(
                f"'{value}' is no {self.name}, as 7711 or 0.0.0.0:7711; P is at most 65535",
                param,
                ctx,
            )
        return host.strip("[]") or None, int(port) if port else None


def listen_option(name: str, variable: str, text: str) -> Callable[[Any], Any]:
    """Return an option of ListenAt; it gives (host, port), None for what is not said."""

    def merged(ctx: click.Context, param: click.Parameter, value: Any) -> tuple[Any, Any]:
        hosts, ports = zip(*value, strict=True) if value else ((), ())
        return tuple(
            next((one for one in reversed(parts) if one is not None), None)
            for parts in (hosts, ports)
        )  # type: ignore[return-value]  # (of two)

    return click.option(
        name, variable, type=ListenAt(), multiple=True, callback=merged,
        metavar=ListenAt.name, help=text,
    )  # fmt: skip


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


def typed_args(own: int = 0) -> list[str]:
    """Return what was typed, but for where it is left: that is where it lies.

    Args:
        own: so many words at the end are a script's own.
    """
    typed = list(click.get_current_context().meta.get(TYPED, []))
    args, rest = typed[: len(typed) - own], typed[len(typed) - own :]
    for k in range(len(args) - 1, -1, -1):
        if args[k] == "--out":
            del args[k : k + 2]
        elif args[k].startswith("--out="):
            del args[k]
    return [without_folders(word) for word in args + rest]


def _to_stderr(ctx: click.Context, param: click.Parameter, asked: bool) -> None:
    """Redirect messages to stderr, so that stdout has the JSON only."""
    if asked and not ctx.resilient_parsing:
        ctx.meta[STDOUT] = sys.stdout
        ctx.with_resource(contextlib.redirect_stdout(sys.stderr))


STDOUT = "laptop.stdout"
"""Key of a click context's meta for where figures go to, if they are asked for."""

json_option = click.option(
    "--json",
    is_flag=True,
    expose_value=False,
    callback=_to_stderr,
    help="Print the figures as JSON, and all else on standard error.",
)
"""The option for figures that a program reads."""


def print_json(figures: Any) -> None:
    """Print figures as JSON, if --json asks for them.

    Args:
        figures: as json takes them, or a run's bytes.
    """
    out = click.get_current_context().meta.get(STDOUT)
    if out is not None:
        text = figures.decode() if isinstance(figures, bytes) else json.dumps(figures, indent=1)
        print(text.rstrip(), file=out, flush=True)


def write_run(folder: RunFolder, run: Run, files: Mapping[str, Any] | None = None) -> str:
    """Write a run and its files, see RunFolder.write, and print its values as JSON."""
    files_written = folder.write(run, files)
    print_json(as_json(run))
    return files_written


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
"""Argument for the sources alone, which was before --camera."""


def cameras_of(cameras: Sequence[str], sources: Sequence[str]) -> tuple[str, ...]:
    """Return the sources that are typed, also those without --camera, as they were before."""
    if sources:
        args = " ".join(f"--camera {source}" for source in sources)
        click.echo(f"{' '.join(sources)} is now {args}", err=True)
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


def option_group(*options: Any) -> Callable[[_Command], _Command]:
    """Return what gives a command these options and arguments, in their order."""

    def add(command: _Command) -> _Command:
        for option in reversed(options):
            command = option(command)
        return command

    return add


def on_the_page(command: Callable[..., None]) -> Callable[..., None]:
    """Options of a command that serves the page."""
    for option in (
        click.option("--open", "open", is_flag=True, help="Open what is to be seen in a browser."),
        listen_option(
            "--page-port",
            "page_at",
            "Where the page is to be had, P 0 for any; HOST 0.0.0.0: for the whole network.  "
            "[default: 127.0.0.1:7780, or any if that is taken]",
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
