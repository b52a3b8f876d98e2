"""Fonts of the brick's screen, where pip has not installed them."""

import importlib
import os
import types
from typing import Any, List


def has_fonts(library: Any) -> bool:
    """Return True if the `ev3dev2` package brings its bitmap fonts."""
    folder = os.path.join(os.path.dirname(library.__file__), "fonts")
    return os.path.isdir(folder) and any(name.endswith(".pil") for name in os.listdir(folder))


def fonts_module() -> types.ModuleType:
    """Return `ev3dev2.fonts` by the names on the brick, all in Pillow's default font.

    The library's bitmap fonts are on the brick, but not in what pip installs.
    """
    module = types.ModuleType("ev3dev2.fonts")
    families = (
        "charB charBI charI charR courB courBO courO courR helvB helvBO helvO helvR luBIS luBS "
        "luIS luRS lutBS lutRS ncenB ncenBI ncenI ncenR symb timB timBI timI timR"
    )
    sizes = (8, 10, 12, 14, 18, 19, 24)
    names = {"{}{:02d}".format(family, size) for family in families.split() for size in sizes}
    names |= {"tech14", "techB14", "term14", "termB14"}

    def available() -> List[str]:
        """Return the names of the fonts."""
        return sorted(names)

    def load(name: str) -> Any:
        """Return the font of that name."""
        if name not in names:
            raise Exception('Failed to load font "{}". '.format(name))
        return importlib.import_module("PIL.ImageFont").load_default()

    vars(module).update(available=available, load=load)
    return module
