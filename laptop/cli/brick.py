"""`brick`: the brick by one command each, over ssh."""

from __future__ import annotations

import asyncio
import sys
from collections.abc import Callable, Coroutine
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click

from laptop.cli.command import OwnCommand
from laptop.cli.commands import FullHelpGroup
from laptop.cli.options import arm_option, importing, in_one_line, replace_option
from laptop.see.serve.pairing_file import known_code
from laptop.system.files import check_new
from shared.arm_description import find_arm, read_arm
from shared.message_fields import printable

if TYPE_CHECKING:
    from laptop.brick.connection import Dialogue

T = TypeVar("T")

THE_BRICK = click.option(
    "--brick",
    "name",
    metavar="NAME",
    help="Its name, or [USER@]HOST[:PORT].  [default: the last one]",
)


@click.group(cls=FullHelpGroup, short_help="Reach the real brick, over ssh.")
def brick() -> None:
    """Reach the real brick by one command each, over ssh."""


@brick.command()
def find() -> None:
    """Look for bricks: by what they announce, and on cables; the status is 1 if there is none."""
    with importing():
        from laptop.brick import choosing, finding

    with in_one_line():
        found = asyncio.run(finding.find())
        finding.report(
            found, choosing.last_brick(), lambda line: click.echo(printable(line))
        )  # others give themselves their names
    if not found:
        raise click.ClickException(finding.NO_BRICK)


@brick.command()
@THE_BRICK
def install(name: str | None) -> None:
    """Put the program on the brick: what has changed, and all of it or nothing."""
    with importing():
        from laptop.brick import install as installing

    talk(name, installing.install)


@brick.command(context_settings={"ignore_unknown_options": True, "allow_interspersed_args": False})
@THE_BRICK
@click.argument("script")
@click.argument("args", nargs=-1, type=click.UNPROCESSED)
def run(name: str | None, script: str, args: tuple[str, ...]) -> None:
    """Run a SCRIPT of the program, or a file of yours, on the brick; install what is stale before.

    Its exit status is the script's.  Ctrl-C stops the arm and waits for the script's end; the third
    one leaves it to itself.  Options of this command go before SCRIPT.
    """
    with importing():
        from laptop.brick import running

    with in_one_line():
        running.find_script(script)  # before the brick is asked for anything
    sys.exit(talk(name, running.run, script, args, known_code()))


@brick.command()
@THE_BRICK
@click.option("--remove", metavar="JOB", help="Remove this one from the brick.")
def jobs(name: str | None, remove: str | None) -> None:
    """List the jobs on the brick: what it draws, and what waits."""
    with importing():
        from laptop.brick import jobs

    click.echo(talk(name, jobs.jobs) if remove is None else talk(name, jobs.cancel, remove))


@brick.command()
@THE_BRICK
def watch(name: str | None) -> None:
    """Show the drawing that is on, and give it orders: Ctrl-C pauses, a second one aborts."""
    with importing():
        from rich.console import Console

        from laptop.brick import jobs
        from laptop.cli.job_display import JobDisplay

    display = JobDisplay(Console())
    with display.shown():
        sys.exit(talk(name, jobs.watch, display.show))


@brick.command()
@THE_BRICK
@arm_option("Arm that should be plugged in")
@click.option("--motors", is_flag=True, help="Watch the counts while you turn joints by hand.")
def doctor(name: str | None, arm_file: str, motors: bool) -> None:
    """Tell how the brick is: each line is fine, or says what to do; the status is 1 then.

    Nothing is installed or moved.
    """
    with importing():
        from laptop.brick import diagnosis

    with in_one_line():
        plugged = read_arm(find_arm(arm_file))
    sys.exit(0 if talk(name, diagnosis.doctor, plugged, motors, _show) else 1)


@brick.command(cls=OwnCommand)
@THE_BRICK
@click.argument(
    "folder", default="logs", metavar="[DIR]", type=click.Path(file_okay=False, path_type=Path)
)
def log(name: str | None, folder: Path) -> None:
    """Fetch the logs of the last runs into DIR (logs): of `brick run` here, and those it keeps."""
    with importing():
        from laptop.brick import transfers

    talk(name, transfers.fetch_logs, folder)


@brick.command(cls=OwnCommand, context_settings={"ignore_unknown_options": True})
@THE_BRICK
@click.option(
    "--to",
    "file",
    default="brick.json",
    show_default=True,
    metavar="FILE",
    type=click.Path(dir_okay=False, path_type=Path),
    help="Keep the figures there.",
)
@replace_option
@click.argument("args", nargs=-1, type=click.UNPROCESSED)
def bench(name: str | None, file: Path, replace: bool, args: tuple[str, ...]) -> None:
    """Measure the brick with bench_brick.py ARGS, and fetch the figures."""
    with importing():
        from laptop.brick import transfers

    with in_one_line():
        check_new(file, (".json",), replace)  # measuring takes a brick minutes
    sys.exit(talk(name, transfers.bench, args, file))


@brick.command(cls=OwnCommand)
@THE_BRICK
@click.option("--fetch", "wanted", metavar="ARM", help="Fetch the brick's own file of an arm.")
@click.option("--replace", is_flag=True, help="Put the file in the place of another one.")
@click.argument(
    "file", required=False, type=click.Path(exists=True, dir_okay=False, path_type=Path)
)
def arm(name: str | None, wanted: str | None, replace: bool, file: Path | None) -> None:
    """Put an arm FILE on the brick, or fetch one; without either, list them."""
    with importing():
        from laptop.brick import transfers

    if file:
        with in_one_line():
            read_arm(file)  # before the brick is asked for anything
        talk(name, transfers.put_arm, file, replace)
    elif wanted:
        talk(name, transfers.fetch_arm, wanted, replace)
    else:
        talk(name, transfers.list_arms)


@brick.command()
@THE_BRICK
def shell(name: str | None) -> None:
    """Type commands on the brick, until `exit`."""
    with importing():
        from laptop.brick import running

    sys.exit(talk(name, running.shell))


@brick.command()
@THE_BRICK
def key(name: str | None) -> None:
    """Let the brick let this computer in without a password from now on."""
    with importing():
        from laptop.brick import login_key

    talk(name, login_key.trust)


@brick.command()
@THE_BRICK
def forget(name: str | None) -> None:
    """Remove what is remembered of a brick: its key, and that it was the last one."""
    with importing():
        from laptop.brick import choosing

    with in_one_line():
        choosing.forget(name, _dialogue())


def talk(name: str | None, command: Callable[..., Coroutine[Any, Any, T]], *args: Any) -> T:
    """Let a command talk with the brick that is meant: `command(brick, address, dialogue, *words)`.

    A problem is told in one line.

    Raises:
        BrokenPipeError: nobody reads what is shown any more.
    """
    from laptop.brick import choosing, connection

    dialogue = _dialogue()

    async def talk() -> T:
        address = await choosing.choose(name, dialogue)
        async with connection.connected(address, dialogue) as brick:
            choosing.remember(address, dialogue)
            return await command(brick, address, dialogue, *args)

    try:
        with in_one_line():
            return asyncio.run(talk())
    except connection.NobodyReads:
        raise BrokenPipeError from None


def _show(line: str) -> None:
    """Show a line while a brick is connected."""
    from laptop.brick.connection import shown_here

    with shown_here():
        click.echo(line)


def _dialogue() -> Dialogue:
    """Return the dialogue with who has typed the command."""
    from laptop.brick.connection import Dialogue

    def ask(prompt: str) -> str | None:
        try:
            password: str = click.prompt(prompt, hide_input=True, err=True)
        except click.Abort:
            return None
        return password

    def show(line: str) -> None:
        click.echo(line, err=True)

    return Dialogue(show, ask if sys.stdin.isatty() else None)
