"""A script that runs once on an emulated brick of its own."""

import inspect

from laptop.emulator.rig import Rig

OF_THE_RIG = set(inspect.signature(Rig).parameters)


def one_run(arm, script, words=(), **options):
    """As `Rig.run` in a Rig of its own; options of either."""
    of_the_rig = {name: options.pop(name) for name in OF_THE_RIG & set(options)}
    with Rig(arm, **of_the_rig) as rig:
        return rig.run(str(script), *words, **options)
