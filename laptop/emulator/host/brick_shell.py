"""Shell of the brick, for lines that scripts pass to `os.system`.

It has quotes, `;`, `&&`, `||`, `&`, `|`, `>`, `>>`, `<`, `2>&1`, `*` and `$NAME`, and no loops.
"""

import glob
import os
import re
import shlex
import sys
from typing import Dict, List, NamedTuple, Tuple

from laptop.emulator.device.file_programs import Finished

MYPY = False
if MYPY:
    from typing import Callable, Mapping, Optional

    Sent = Tuple[str, str]  # how, and the name of a file or number of a stream
    Captured = Tuple[bool, bool]  # whether output and errors are to be in what is returned
    Run = Callable[[List[str], Optional[bytes], Captured], Optional[Finished]]
    Reads = Callable[[List[str]], Optional[bool]]

Command = NamedTuple(
    "Command", [("args", List[str]), ("end", str), ("redirected", Dict[int, Tuple[str, str]])]
)
Command.__doc__ = """A simple command of a line.

args        with quotes removed
end         separator after it: `;`, `&&`, `||`, `&` or `|`
redirected  stream (0, 1, 2) -> (`<`, `>` or `>>`, name of a file), or (`>&`, `1`)
"""

NOWHERE = "/dev/null"
LOOPS = "for", "while", "until", "if", "case"
"""Keywords of constructs that this shell does not support."""

_PART = re.compile(
    r"""&>|(?<![^\s;&|])[012]?(?:>>|>&|>|<)|[<>]|&&|\|\||[;&|\n]"""
    r"""|(?:[^\s;&|<>"'\\]|\\.|"(?:[^"\\]|\\.)*"|'[^']*')+|["']"""
)


def split_line(line: str) -> List[Command]:
    """Return a shell line's Commands.

    Raises:
        ValueError: an unclosed quote, nothing behind a `>`, or one of LOOPS.
    """
    parts = _PART.findall(line)
    commands = []  # type: List[Command]
    args, redirected = [], {}  # type: List[str], Dict[int, Sent]
    waiting = None  # type: Optional[str]
    for part in parts + [";"]:
        if part in ("&&", "||", ";", "&", "|", "\n"):
            if waiting:
                raise ValueError("the name of a file is missing behind {}".format(waiting))
            if args or redirected:
                commands.append(Command(args, ";" if part == "\n" else part, redirected))
            args, redirected = [], {}
        elif re.match("[012]?[<>]|&>", part):
            waiting = part
        elif waiting == "&>":
            redirected[1], redirected[2], waiting = (">", shlex.split(part)[0]), (">&", "1"), None
        elif waiting:
            how = waiting.lstrip("012")
            stream = waiting[: -len(how)] or ("0" if how == "<" else "1")
            redirected[int(stream)], waiting = (how, shlex.split(part)[0]), None
        else:
            args.extend(_expanded(part))
    for command in commands:
        if command.args and command.args[0] in LOOPS:
            raise ValueError(
                "{}: not done: the emulated brick's shell takes one command after another".format(
                    command.args[0]
                )
            )
    return commands


def _expanded(part: str) -> List[str]:
    """Return the arguments that one word of a line expands to."""
    if "$" in part and "'" not in part:
        part = os.path.expandvars(part)
    if re.search("[*?]", part) and not re.search("[\"'\\\\]", part):
        return sorted(glob.glob(part)) or [part]
    return shlex.split(part)


def _shown(finished: Finished, captured: "Captured") -> Finished:
    """Write what is not captured, and return the rest."""
    output, errors = finished.output, finished.errors
    if not captured[0] and output:
        sys.stdout.write(output.decode())
        output = b""
    if not captured[1] and errors:
        sys.stderr.write(errors.decode())
        errors = b""
    return finished._replace(output=output, errors=errors)


class Shell(object):
    """Shell that runs lines.

    Args:
        run: `run(args, piped, captured)` gives Finished, None if there is no such program; piped
            is the standard input, bytes, None for that of the script, and captured says whether
            output and errors are to be in there, two bools.
        reads: `reads(args)` tells whether a program reads its standard input; None where it may.
    """

    def __init__(self, run: "Run", reads: "Reads") -> None:
        self._run = run
        self._reads = reads

    def line(self, text: str, piped: "Optional[bytes]", captured: "Captured") -> Finished:
        """Run a line, which leaves the current folder as it was; return Finished."""
        try:
            commands = split_line(text)
        except ValueError as error:
            refused = Finished(2, b"", "sh: 1: {}\n".format(error).encode(), 0.0)
            return _shown(refused, captured)
        folder = os.getcwd()
        try:
            return self._all(commands, piped, captured)
        finally:
            os.chdir(folder)

    def _all(
        self, commands: List[Command], piped: "Optional[bytes]", captured: "Captured"
    ) -> Finished:
        left = piped  # for the next command that reads it
        status, seconds, output, errors = 0, 0.0, b"", b""
        before, skipped = ";", False
        for command in commands:
            if before != "|":
                skipped = (before == "&&" and status != 0) or (before == "||" and status == 0)
                piped = left
            if not skipped:
                if before != "|" and left and self._takes(command):
                    left = b""
                finished = self._one(command, piped, captured)
                status = finished.status
                seconds += 0.0 if command.end == "&" else finished.seconds
                errors += finished.errors
                piped = finished.output
                if command.end != "|":
                    output = output + finished.output if output else finished.output
            before = command.end
            status, output, errors, _ = _shown(Finished(status, output, errors, 0.0), captured)
        return Finished(status, output, errors, seconds)

    def _takes(self, command: Command) -> bool:
        """Return whether a command may read the line's standard input, which is then at its end."""
        free = bool(command.args) and 0 not in command.redirected
        return free and self._reads(command.args) is not False

    def _one(self, command: Command, piped: "Optional[bytes]", captured: "Captured") -> Finished:
        into = {stream: how for stream, how in command.redirected.items() if stream}
        captured = captured[0] or command.end == "|" or 1 in into, captured[1] or 2 in into
        try:
            if 0 in command.redirected and command.redirected[0][1] != NOWHERE:
                with open(command.redirected[0][1], "rb") as file:
                    piped = file.read()
            finished = self._started(command.args, piped, captured)
            return self._sent(finished, into)
        except OSError as error:
            message = "sh: 1: cannot open {}: {}\n".format(error.filename, error.strerror)
            return Finished(2, b"", message.encode(), 0.0)

    def _started(self, args: List[str], piped: "Optional[bytes]", captured: "Captured") -> Finished:
        if not args:
            return Finished(0, b"", b"", 0.0)
        if args[0] == "cd":
            os.chdir(args[1] if args[1:] else os.path.expanduser("~"))
            return Finished(0, b"", b"", 0.0)
        finished = self._run(args, piped, captured)
        if finished is None:
            message = "sh: 1: {}: not found\n".format(args[0])
            return Finished(127, b"", message.encode(), 0.0)
        return finished

    def _sent(self, finished: Finished, into: "Mapping[int, Sent]") -> Finished:
        """Write output into the files of `into`; return what is left."""
        sent = {1: finished.output, 2: finished.errors}
        for stream, (how, name) in sorted(into.items(), reverse=True):
            data, sent[stream] = sent[stream], b""
            if how == ">&":
                sent[int(name)] += data
            elif name != NOWHERE:
                with open(name, "ab" if how == ">>" else "wb") as file:
                    file.write(data)
        return finished._replace(output=sent[1], errors=sent[2])
