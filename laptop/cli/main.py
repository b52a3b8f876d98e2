"""All commands together, and what becomes of a failure: one line on stderr and a status."""

from __future__ import annotations

import os
import sys

import click
from click.shell_completion import add_completion_class

from laptop.cli.bench import bench
from laptop.cli.brick import brick
from laptop.cli.bundle import bundle
from laptop.cli.classes import classes
from laptop.cli.commands import CommandSections, no_option, no_value
from laptop.cli.demo import demo
from laptop.cli.doctor import doctor
from laptop.cli.draw import draw
from laptop.cli.exit_status import ExitStatus
from laptop.cli.guide import guide
from laptop.cli.markers import markers
from laptop.cli.measure import measure
from laptop.cli.page import page
from laptop.cli.powershell import PowerShellComplete
from laptop.cli.report import report
from laptop.cli.simulate import simulate
from laptop.cli.track import track
from laptop.system import platforms
from shared import state
from shared.arm_description import ArmError
from shared.message_fields import printable
from shared.version import VERSION


@click.group(cls=CommandSections, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(VERSION, prog_name="brickservo", message="%(prog)s %(version)s")
def laptop() -> None:
    """Everything that runs beside the brick."""


for command in (
    *(demo, page, doctor, draw, simulate, track, markers),
    *(measure, brick, guide, classes, report, bundle, bench),
):
    laptop.add_command(command)
add_completion_class(PowerShellComplete)


def main(command: click.Command | None = None, program: str = "") -> int:
    """Run a command, `laptop` if none is given; return the status.

    Every failure is one line on stderr and a status of its own.

    Args:
        command: what is run.
        program: how that is typed; as `laptop.cli.start` has it if it is "".
    """
    platforms.let_ctrl_c_interrupt()
    platforms.let_others_end_in_order()
    try:
        program = program or state.laptop_program()
        (command or laptop)(prog_name=program, standalone_mode=False)
    except click.exceptions.NoArgsIsHelpError as error:
        click.echo(error.format_message(), err=True)
        return error.exit_code
    except click.UsageError as error:
        where = error.ctx.command_path if error.ctx else program
        problem = error.format_message()
        if isinstance(error, click.NoSuchOption):
            problem = no_option(error)
        elif isinstance(error, click.BadOptionUsage):
            problem = no_value(error)
        _report(f"{problem}{'' if problem.endswith(('.', '?')) else '.'} See {where} --help.")
        return error.exit_code
    except click.ClickException as error:
        _report(error.format_message())
        return error.exit_code
    except ArmError as error:
        _report(str(error))
        return ExitStatus.FAILED
    except BrokenPipeError:
        # Whoever read along has seen enough; the interpreter must not try to flush the rest.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return ExitStatus.UNREAD
    except OSError as error:
        _report(f"{error.strerror}: {error.filename or 'the output'}")
        return ExitStatus.FAILED
    except click.Abort:
        _report("stopped")
        return ExitStatus.STOPPED
    return ExitStatus.DONE


def _report(problem: str) -> None:
    """Report a problem in one line; untrusted text must not contain control characters."""
    click.echo(f"laptop: {printable(problem)}", err=True)
