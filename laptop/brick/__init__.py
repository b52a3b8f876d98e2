"""A real brick by one command each: found, given the program, run and diagnosed, over ssh.

Rule: only here is ssh known, and only `finding` looks for bricks on the network.
"""

from shared.arm_description import ArmError
from shared.state import laptop_program

COMMAND = f"{laptop_program()} brick"
"""The words by which people type a command for the brick, in front of its name."""


class BrickProblem(ArmError):
    """Something that keeps a command from the brick, with the next step, in one line.

    Args:
        text: the line.
        status: exit status of the command that meets it.
    """

    def __init__(self, text: str, status: int = 1) -> None:
        super().__init__(text)
        self.status = status
