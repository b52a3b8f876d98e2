"""Commands as people type them, parsed by the programs' own parsers."""

import importlib
import re

import click

from laptop.cli.main import laptop

SCRIPTS = {
    "driver.py": "drawing_commands",
    "visual_servoing.py": "servoing_commands",
    "tracking_client.py": "tracking_commands",
}
"""Scripts of the brick and the modules that read their command lines."""
OTHERS = {"touch": "touch_command"}
"""Commands of `driver.py` that a module of their own reads."""


def parse(words, command=laptop):
    """Parse what is typed for a command, the laptop's; fails unless it would be taken."""
    name, words = command.name, list(words)
    context = click.Context(command)
    while isinstance(command, click.Group) and not (command.invoke_without_command and not words):
        if words[0].startswith("-"):
            break
        name, command, words = command.resolve_command(context, words)
    return command.make_context(name, words)


def parse_all(words):
    """Parse a command and, where it runs a script of the brick, what that is given, too.

    Returns:
        The name of the script, None without one.
    """
    params = parse(words).params
    script = params.get("script")
    if script is None:
        return None
    name = script.rpartition("/")[2]
    if name in SCRIPTS:
        parse_script(name, params["args"])
    return name


def parse_script(name, words):
    """Parse what a script of the brick is given; fails unless it would be taken."""
    words = [" " + word if re.match(r"-\d", word) else word for word in words]
    module = OTHERS.get(words[0] if words else "") if name == "driver.py" else None
    importlib.import_module("robot." + (module or SCRIPTS[name]))._parser().parse_args(words)
