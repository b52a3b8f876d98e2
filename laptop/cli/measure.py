"""`measure`: what cameras tell of a camera, the pen, an arm and its accuracy."""

import click

from laptop.cli.accuracy import accuracy
from laptop.cli.calibrate import calibrate
from laptop.cli.camera import camera
from laptop.cli.commands import FullHelpGroup
from laptop.cli.touch import touch


@click.group(cls=FullHelpGroup, short_help="Measure a camera, the pen, the arm, its accuracy.")
def measure() -> None:
    """Measure by camera: where a camera stands, then the arm, and how accurate it is."""


for _name, _command in (
    ("camera", camera),
    ("pen", touch),
    ("arm", calibrate),
    ("accuracy", accuracy),
):
    measure.add_command(_command, _name)
