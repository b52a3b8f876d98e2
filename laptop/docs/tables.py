"""Parts of the pages that the programs write themselves: tables and helps, as Markdown.

A page calls one of these functions within `[[[cog` and `]]]`, and holds what it has printed.
"""

from __future__ import annotations

import ast
import importlib
import inspect
import os
import re
import subprocess
import sys
from collections.abc import Iterable, Iterator, Mapping, Sequence
from enum import Enum
from pathlib import Path
from types import FunctionType
from typing import Any

import click
from click.testing import CliRunner

from laptop.cli.exit_status import MEANINGS
from laptop.cli.main import laptop
from laptop.docs import measured
from laptop.emulator.constants import Constant
from laptop.emulator.device import plant_constants as plant
from laptop.emulator.device import wheels
from laptop.emulator.device.sensor_kinds import KINDS
from laptop.emulator.scene import scene_constants as scene
from laptop.page import run_states
from robot import api

ROOT = Path(__file__).resolve().parents[2]
FLOOR = "{greatest mm} mm; half an encoder count makes {floor mm} mm"
REACHED = "{success %} %, {time s} s"
"""Figures of the first page, of a bench's columns."""
TERMINAL = {"COLUMNS": "96", "TERM": "dumb", "NO_COLOR": "1"}
"""Environment in which a help is printed."""
SCRIPTS = ("driver.py", "visual_servoing.py", "tracking_client.py", "bench_brick.py")
"""Scripts on the brick that people start."""
OTHER_COMMANDS = ("touch", "job", "jobs", "order")
"""Commands of driver.py that its own help has no line for."""
COMMAND_LINE = re.compile(r"^ {4}(\w+)", re.MULTILINE)
"""The line of a command in a script's help, where others are indented by less or by more."""
OF_A_RIG = (
    "rig.Rig",
    "simulation_result.SimulationResult",
    "host.runner.Outcome",
    "device.motion_record.MotionRecord",
    "device.motion_record.MotionSample",
    "rig.Plugs",
    "faults.Fault",
    "device.buttons.Press",
    "faults.InvalidSimulationOption",
)
"""The Rig of the emulator, and what goes into it or comes out."""


def plant_constants() -> None:
    """Print the table of the plant's constants."""
    _constants(plant.CONSTANTS)


def scene_constants() -> None:
    """Print the table of the synthetic camera's constants."""
    _constants(scene.CONSTANTS)


def wheel_constants() -> None:
    """Print the table of the constants of a robot on wheels."""
    _constants(wheels.CONSTANTS)


def sensor_kinds() -> None:
    """Print the table of the sensors that can be plugged in."""
    rows = []
    for name, kind in KINDS.items():
        quantities = [
            f"`{key}`{f' {one.unit}' if one.unit else ''}: {one.meaning}"
            for key, one in kind.quantities.items()
        ]
        rows.append((f"`{name}`", "; ".join(quantities), f"`{kind.driver}`"))
    _table(("kind", "quantities", "driver"), rows)


def exit_statuses() -> None:
    """Print the table of the exit statuses."""
    _table(("status", "meaning"), [(str(int(one)), text) for one, text in MEANINGS.items()])


def page_states() -> None:
    """Print the states and events of a run that the page orders, and its transitions."""
    kinds: Sequence[type[Enum]] = (run_states.RunState, run_states.RunEvent)
    _table(("state or event", "meaning"), [(one.name, one.value) for kind in kinds for one in kind])
    print(f"\n{run_states.transition_table()}")


def commands() -> None:
    """Print the help of each command, with all of its options."""
    for path, command in _walk("brickservo", laptop):
        if not isinstance(command, click.Group):
            full = {"--help-all"} & {name for one in command.params for name in one.opts}
            words = [*path.split()[1:], *(full or {"--help"})]
            shown = CliRunner(env=TERMINAL).invoke(laptop, words, prog_name="brickservo")
            _print_help(path, shown.output)


def scripts() -> None:
    """Print the help of each script on the brick, and of each command of driver.py."""
    for name in SCRIPTS:
        told = _script_help(name)
        _print_help(name, told)
        for command in (*COMMAND_LINE.findall(told), *OTHER_COMMANDS * (name == "driver.py")):
            _print_help(f"{name} {command}", _script_help(name, command), "###")


def _script_help(*words: str) -> str:
    """Return the help of a script on the brick, or of one of its commands."""
    args = [sys.executable, str(ROOT / "robot" / words[0]), *words[1:], "--help"]
    here = {**os.environ, **TERMINAL, "PYTHONPATH": str(ROOT)}
    return subprocess.run(args, env=here, capture_output=True, text=True, check=True).stdout


def bench_command(*names: str) -> None:
    """Print what one types to measure these anew."""
    typed = "\n".join(measured.read(name).command for name in names)
    print(f"\n```sh\n{typed}\n```\n")


def bench_table(
    names: str | Sequence[str],
    columns: Mapping[str, str] | Sequence[str],
    table: int = 0,
    across: Mapping[str, str] | None = None,
    **only: str,
) -> None:
    """Print rows and columns of what a bench has measured.

    Args:
        names: of the record, or of several that are alike.
        columns: those of the bench; or by its new heading each column's text, in which a
            bench's column stands in braces: "{greatest mm} ({in floors})".
        table: its number, where a bench prints several.
        across: one of the bench's columns, and the text of the new column that each of its
            values gets; rows with the same `columns` become one.
        only: by its heading a regular expression; only rows that match all of them are shown.

    Raises:
        NotMeasured: there is no such record, or no row.
    """
    shown = columns if isinstance(columns, Mapping) else {one: f"{{{one}}}" for one in columns}
    lines: dict[tuple[str, ...], dict[str, str]] = {}
    records = [names] if isinstance(names, str) else names
    for row in (row for name in records for row in _measured_rows(name, table, only)):
        line = lines.setdefault(tuple(text.format_map(row) for text in shown.values()), {})
        for heading, text in (across or {}).items():
            line.setdefault(row[heading], text.format_map(row))
    beside = list(dict.fromkeys(value for line in lines.values() for value in line))
    rows = ((*cells, *(line.get(one, "") for one in beside)) for cells, line in lines.items())
    _table(
        [*shown, *beside],
        # What failed, in floors failed too, is told once.
        ([re.sub(r"^(\w+) \(\1\)$", r"\1", one) for one in row] for row in rows),
    )


def bench_lines(name: str, pattern: str) -> None:
    """Print what a bench says below its tables, the lines that match.

    Raises:
        NotMeasured: there is no such record, or no line.
    """
    found = [line for line in measured.read(name).lines if re.fullmatch(pattern, line)]
    if not found:
        raise measured.NotMeasured(f"{name}: no line is like {pattern}")
    print("", *(f"* {line}" for line in found), "", sep="\n")


def main_figures() -> None:
    """Print the ten figures of the first page, each with its command."""
    line = {"plant": "backlash 2", "line": "line 1"}
    nominal = {"arm": "planar", "method": "chain"}
    known = _cell("servoing", "{time s}", arm="planar", method="clairvoyant").split("/")[0]
    rms = [row["rms mm"].split()[0] for row in _measured_rows("drawings", 0, {"arm": "planar"})]
    taught = _cell(
        "learning", "{greatest, median}", arm="planar", path="all lines", built="otherwise"
    )
    before, after = re.findall(r"(\S+) (?:before|after)", measured.read("calibration").lines[-1])
    disc = {"marker": "disc r 12, JPEG 90"}
    rows = (
        (
            "lines",
            "a line of 11 cm, arm in direct drive, 2 degrees of backlash: greatest deviation",
            _cell("lines", FLOOR, arm="planar", method="smooth", **line),
        ),
        (
            "lines",
            "the same line behind 5:1 gears",
            _cell("lines", FLOOR, arm="geared", method="smooth", **line),
        ),
        (
            "lines",
            "the same geared arm by a usual lab report's Jacobian steps",
            _cell("lines", "{greatest mm} mm", arm="geared", method="steps", **line),
        ),
        (
            "drawings",
            "ten whole drawings, arm in direct drive: RMS of the ink's deviation",
            f"{min(rms)} to {max(rms)} mm",
        ),
        (
            "learning",
            "a camera teaches three lines to arms with wrong links, zeros and backlash: greatest "
            "deviation at first, and after three rehearsals (median)",
            f"{taught.split()[0]} mm, {taught.split()[-1]} mm",
        ),
        (
            "calibration",
            "such arms measure themselves by a camera: how many times as far off as with the true "
            "numbers three lines are then, and before",
            f"{after}, {before}",
        ),
        (
            "tracking",
            "a disc of radius 12 px in a JPEG picture: error per axis; moments of an HSV gate",
            _cell("tracking", "{ours} px; {HSV moments} px", **disc),
        ),
        (
            "servoing",
            "random goals in the image, planar arm: reached; median time, and told where to go",
            _cell("servoing", REACHED, **nominal) + f"; {known} s",
        ),
        (
            "servoing",
            "the same by a usual lab report's method",
            _cell("servoing", REACHED, arm="planar", method="report"),
        ),
        (
            "servoing-in-space",
            "random goals in space, two cameras",
            _cell("servoing-in-space", REACHED, method="chain"),
        ),
    )
    commands = (measured.read(name).command.partition(" ")[2] for name, _, _ in rows)
    told = ((what, re.sub(r"/\S+ s", " s", figure)) for _, what, figure in rows)
    _table(
        ("what", "figure", "command"),
        [(*cells, f"`{command}`") for cells, command in zip(told, commands, strict=True)],
    )


def _cell(name: str, text: str, **only: str) -> str:
    """Return what a text makes of the first row of a record that matches."""
    return text.format_map(_measured_rows(name, 0, only)[0])


def _measured_rows(name: str, table: int, only: Mapping[str, str]) -> list[dict[str, str]]:
    """Return rows of a record that match, each by the table's headings."""
    kept = measured.read(name).tables[table]
    rows = [dict(zip(kept.headings, row, strict=True)) for row in kept.rows]
    found = [row for row in rows if all(re.fullmatch(e, row[h]) for h, e in only.items())]
    if not found:
        raise measured.NotMeasured(f"{name}, table {table}: no row of {dict(only)}")
    return found


def rooms() -> None:
    """Print each folder of the programs, and what each file in it is for."""
    for room in ("shared", "robot", "laptop"):
        for folder in sorted({file.parent for file in (ROOT / room).rglob("*.py")}):
            if folder == ROOT / "laptop" / "course" / "solutions":
                continue  # what students write
            rows = [
                (f"`{file.name}`", _purpose(file))
                for file in sorted(folder.glob("*.py"))
                if not file.name.startswith("__")
            ]
            if rows:
                print(f"\n## {folder.relative_to(ROOT).as_posix()}/")
                _table(("file", "what it is for"), rows)


def _purpose(file: Path) -> str:
    """Return the first paragraph of a module's docstring, on one line."""
    told = ast.get_docstring(ast.parse(file.read_text("utf-8"))) or ""
    return " ".join(told.split("\n\n")[0].split())


def api_members() -> None:
    """Print what makes Sphinx document each name of `robot.api`."""
    _documented(f"robot.api.{name}" for name in api.__all__)


def rig_members() -> None:
    """Print what makes Sphinx document the emulator's Rig, and what goes into it or comes out."""
    _documented(f"laptop.emulator.{name}" for name in OF_A_RIG)


def example(name: str) -> None:
    """Print a file of laptop/examples, by its name without .py."""
    text = (ROOT / "laptop" / "examples" / f"{name}.py").read_text("utf-8")
    print(f"\n```python\n{text}```")


def _documented(names: Iterable[str]) -> None:
    """Print a list of these, each MODULE.NAME, and what makes Sphinx document them."""
    values = {one: _value(one) for one in names}
    _table(("name", "what it is"), (row for one in values.items() for row in _summaries(*one)))
    print("```{eval-rst}")
    for one, value in values.items():
        if not isinstance(value, type):
            print(f".. auto{'function' if callable(value) else 'data'}:: {one}\n")
        elif issubclass(value, BaseException):
            print(f".. autoexception:: {one}\n")
        elif issubclass(value, tuple):  # whose fields its docstring has
            print(f".. autoclass:: {one}\n")
        else:
            print(f".. autoclass:: {one}\n   :members:\n")
    print("```")


def _value(name: str) -> Any:
    """Return what has a name, MODULE.NAME."""
    module, _, own = name.rpartition(".")
    return getattr(importlib.import_module(module), own)


def _summaries(name: str, value: Any) -> Iterator[tuple[str, str]]:
    """Yield what is called and named of a value, each with the first sentence of its docstring."""
    own = name.rpartition(".")[2]
    if not callable(value):
        yield f"`{own}`", "a constant"
        return
    yield f"`{own}`", _first_sentence(value)
    if isinstance(value, type) and not issubclass(value, (BaseException, tuple)):
        for part, function in vars(value).items():
            if part.startswith("_") or not isinstance(function, (FunctionType, property)):
                continue
            taken = "" if isinstance(function, property) else f"({_arguments(function)})"
            yield f"`{own}.{part}{taken}`", _first_sentence(function)


def _arguments(function: FunctionType) -> str:
    """Return the names of a method's arguments."""
    taken = list(inspect.signature(function).parameters.values())[1:]
    marks: dict[Any, str] = {
        inspect.Parameter.VAR_POSITIONAL: "*",
        inspect.Parameter.VAR_KEYWORD: "**",
    }
    return ", ".join(f"{marks.get(one.kind, '')}{one.name}" for one in taken)


def _first_sentence(value: Any) -> str:
    """Return the first sentence of a docstring, on one line."""
    told = " ".join((inspect.getdoc(value) or "").split("\n\n")[0].split())
    return re.split(r"(?<=[.])\s", told)[0]


def _walk(path: str, command: click.Command) -> Iterable[tuple[str, click.Command]]:
    """Yield each command below one with all words that are typed for it."""
    yield path, command
    if isinstance(command, click.Group):
        for name in command.list_commands(click.Context(command)):
            below = command.get_command(click.Context(command), name)
            if below is not None and not below.hidden:
                yield from _walk(f"{path} {name}", below)


def _print_help(title: str, text: str, mark: str = "##") -> None:
    """Print in a block what a program says of itself; `mark` makes the title a heading."""
    print(f"\n{mark} {title}\n\n```text\n{text.rstrip()}\n```")


def _constants(known: Mapping[str, Constant]) -> None:
    """Print a table of constants."""
    rows = []
    for name, one in known.items():
        default = "-" if one.default is None else f"{one.default} {one.unit}".strip()
        rows.append((f"`{name}`", default, _allowed(one.allowed), one.meaning))
    _table(("constant", "if not given", "allowed", "what it is"), rows)


def _allowed(allowed: Sequence[object]) -> str:
    """Return what is allowed: the two ends of a range, or words."""
    if len(allowed) == 2 and not isinstance(allowed[0], str):
        return f"{allowed[0]:g} to {allowed[1]:g}"
    return ", ".join(map(str, allowed))


def _table(headings: Sequence[str], rows: Iterable[Sequence[str]]) -> None:
    """Print a table."""
    print(f"\n| {' | '.join(headings)} |\n|{'---|' * len(headings)}")
    for row in rows:
        print(f"| {' | '.join(cell.replace('|', chr(92) + '|') for cell in row)} |")
    print()
