"""A real brick over ssh: found, given the program, run and diagnosed, by one command each.

In go a brick's name or address, and files; out come what its programs print, and their exit status.
Rule: only here is ssh known, and only `finding` looks for bricks on the network. Begin with
`connection`, then `answers`.

choosing, finding       the brick that a command is for, and bricks on the network
connection, known_hosts, login_key   a connection by ssh, whom it trusts, how it logs in
answers, remote_files   commands and single files, bounded in time and size
program_files, install  the program for the brick, and its installation
running, terminal, run_log   a program on a terminal there, and the log of it here
jobs, touching          drawings that the brick draws alone, points touched with its arm
diagnosis, transfers    facts of a brick, judged; arms, logs and figures, there and back
"""

from shared.arm_description import ArmError
from shared.message_fields import printable
from shared.state import laptop_program

COMMAND = f"{laptop_program()} brick"
"""Beginning of a command line for the brick, before the command's name."""

MAX_TEXT = 1000
"""Greatest length of a problem's text, characters."""


class BrickProblem(ArmError):
    """Problem that prevents a command on the brick, with the next step, in one line.

    Args:
        text: the line; what of it the brick has said may be anything, and is cut and made
            printable.
        status: exit status of the command that meets it.
    """

    def __init__(self, text: str, status: int = 1) -> None:
        shown = printable(text)
        super().__init__(shown if len(shown) <= MAX_TEXT else shown[: MAX_TEXT - 3] + "...")
        self.status = status
