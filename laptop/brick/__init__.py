"""A real brick by one command each: found, given the program, run and diagnosed, over ssh.

Rule: only here is ssh known, and only `finding` looks for bricks on the network.
"""

from shared.arm_description import ArmError
from shared.message_fields import printable
from shared.state import laptop_program

COMMAND = f"{laptop_program()} brick"
"""The words by which people type a command for the brick, in front of its name."""

MOST_TEXT = 1000
"""Letters of a problem."""


class BrickProblem(ArmError):
    """Something that keeps a command from the brick, with the next step, in one line.

    Args:
        text: the line; what of it the brick has said may be anything, and is cut and made
            printable.
        status: exit status of the command that meets it.
    """

    def __init__(self, text: str, status: int = 1) -> None:
        shown = printable(text)
        super().__init__(shown if len(shown) <= MOST_TEXT else shown[: MOST_TEXT - 3] + "...")
        self.status = status
