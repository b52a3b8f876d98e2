"""Programs of the brick for its files, its clock and its name, as scripts call them.

Rule: they see and change only what the script itself would, by the same `open` and `os`.  Output is
as if it went into a pipe, and of what people read alone, such as dates of files, there is none.
"""

import collections
import importlib
import os
import re
import stat
from typing import Callable, List, NamedTuple, Sequence, Tuple

Finished = NamedTuple(
    "Finished", [("status", int), ("output", bytes), ("errors", bytes), ("seconds", float)]
)
Finished.__doc__ = (
    """Result of a program: exit status, output, error output, and the time that it took, s."""
)

RUN_COST = 0.01
"""Time that a small program takes besides its start, s."""

_GOES_ON = "the emulated brick stays on"
_INSTALLS = "the emulated brick installs nothing; install for the Python that runs simulate"
_ALONE = "the emulated brick reaches no network"
_NO_OTHERS = "no other program runs on the emulated brick"
NOT_DONE = {
    name: why
    for names, why in (
        ("reboot poweroff shutdown halt init", _GOES_ON),
        ("apt apt-get dpkg pip pip3 easy_install", _INSTALLS),
        ("wget curl ssh scp sftp git ping ifconfig ip connmanctl bluetoothctl hcitool", _ALONE),
        ("systemctl service kill killall pkill ps brickrun conrun", _NO_OTHERS),
    )
    for name in names.split()
}
"""Programs that the brick has and the emulated one does not run, and why."""


def done(output: str = "", errors: str = "", status: int = 0) -> Finished:
    """Return the Finished of a small program that wrote these texts."""
    return Finished(status, output.encode(), errors.encode(), RUN_COST)


def _each(name: str, args: Sequence[str], act: Callable[[str], str]) -> Finished:
    """Join the texts of `act(arg)` for each arg; failures go to the errors, with status 1."""
    output, errors = [], []
    for arg in args:
        try:
            output.append(act(arg))
        except OSError as error:
            errors.append("{}: {}: {}\n".format(name, arg, error.strerror))
    return done("".join(output), "".join(errors), 1 if errors else 0)


def _options(args: Sequence[str]) -> Tuple[str, List[str]]:
    """Return the letters of the options, and the other args."""
    letters = "".join(arg[1:] for arg in args if re.match("-[a-zA-Z]", arg))
    return letters, [arg for arg in args if not re.match("-[a-zA-Z]", arg)]


class FilePrograms(object):
    """Programs by name: `_run_NAME(args, piped)` gives Finished; `piped`: its stdin, bytes."""

    def _run_ls(self, args: Sequence[str], piped: bytes) -> Finished:
        letters, places = _options(args)

        def line(folder: str, name: str) -> str:
            if "l" not in letters:
                return name + "\n"
            found = os.stat(os.path.join(folder, name))
            mode = stat.filemode(found.st_mode)
            return "{} 1 robot robot {:>8} {}\n".format(mode, found.st_size, name)

        def listed(place: str) -> str:
            if "d" in letters or not os.path.isdir(place):
                os.stat(place)
                return line("", place)
            names = sorted(os.listdir(place))
            shown = [name for name in names if "a" in letters or not name.startswith(".")]
            head = place + ":\n" if len(places) > 1 else ""
            return head + "".join(line(place, name) for name in shown)

        return _each("ls", places or ["."], listed)

    def _run_cat(self, args: Sequence[str], piped: bytes) -> Finished:
        if not args or args == ["-"]:
            return Finished(0, piped, b"", RUN_COST)

        def read(name: str) -> str:
            with open(name) as file:
                return file.read()

        return _each("cat", [arg for arg in args if not arg.startswith("-")], read)

    def _run_chmod(self, args: Sequence[str], piped: bytes) -> Finished:
        wanted, names = (args[0], args[1:]) if len(args) > 1 else ("", [])
        match = re.match(r"([ugoa]*)([+=-])([rwx]+)$", wanted)
        if not match and not re.match("[0-7]{3,4}$", wanted):
            return done(errors="chmod: invalid mode: '{}'\n".format(wanted), status=1)

        def change(name: str) -> str:
            mode = stat.S_IMODE(os.stat(name).st_mode)
            if match is None:
                mode = int(wanted, 8)
            else:
                who, how, what = match.groups()
                whose = {"u": 0o700, "g": 0o070, "o": 0o007}
                mask = sum(whose[letter] for letter in set(who) if letter != "a") or 0o777
                bits = sum({"r": 0o444, "w": 0o222, "x": 0o111}[letter] for letter in set(what))
                kept_bits = 0 if how == "-" else bits & mask
                mode = mode & ~(mask if how == "=" else bits & mask) | kept_bits
            os.chmod(name, mode)
            return ""

        return _each("chmod", names, change)

    def _run_mkdir(self, args: Sequence[str], piped: bytes) -> Finished:
        letters, names = _options(args)

        def make(name: str) -> str:
            if "p" in letters:
                os.makedirs(name, exist_ok=True)
            else:
                os.mkdir(name)
            return ""

        return _each("mkdir", names, make)

    def _run_touch(self, args: Sequence[str], piped: bytes) -> Finished:
        def touch(name: str) -> str:
            with open(name, "a"):
                return ""

        return _each("touch", args, touch)

    def _run_rm(self, args: Sequence[str], piped: bytes) -> Finished:
        letters, names = _options(args)
        if set(letters) & set("rR"):
            return done(errors="rm: -r is not done: it might reach too far here\n", status=1)

        def remove(name: str) -> str:
            if "f" not in letters or os.path.exists(name):
                os.remove(name)
            return ""

        return _each("rm", names, remove)

    def _run_date(self, args: Sequence[str], piped: bytes) -> Finished:
        form = args[-1][1:] if args and args[-1].startswith("+") else "%a %b %d %H:%M:%S UTC %Y"
        time = importlib.import_module("time")  # of the program, on the emulated clock
        now = time.time()
        form = form.replace("%s", str(int(now)))
        return done(time.strftime(form, time.gmtime(now)) + "\n")

    def _run_pwd(self, args: Sequence[str], piped: bytes) -> Finished:
        return done(os.getcwd() + "\n")

    def _run_whoami(self, args: Sequence[str], piped: bytes) -> Finished:
        return done("robot\n")

    def _run_uname(self, args: Sequence[str], piped: bytes) -> Finished:
        figures = collections.OrderedDict(
            [
                ("s", "Linux"),
                ("n", "ev3dev"),
                ("r", "4.14.117-ev3dev-2.3.5-ev3"),
                ("m", "armv5tejl"),
            ]
        )
        letters = _options(args)[0] or "s"
        return done(
            " ".join(text for key, text in figures.items() if key in letters or "a" in letters)
            + "\n"
        )

    def _run_which(self, args: Sequence[str], piped: bytes) -> Finished:
        found = [arg for arg in args if self.knows(arg)]
        return done("".join("/usr/bin/{}\n".format(w) for w in found), "", int(found != args))

    def _run_test(self, args: Sequence[str], piped: bytes) -> Finished:
        tests = {"-e": os.path.exists, "-f": os.path.isfile, "-d": os.path.isdir}
        args = [arg for arg in args if arg != "]"]
        if len(args) != 2 or args[0] not in tests:
            return done(errors="test: only -e, -f and -d are known here\n", status=2)
        return done(status=0 if tests[args[0]](args[1]) else 1)

    def _run_grep(self, args: Sequence[str], piped: bytes) -> Finished:
        letters, args = _options(args)
        if not args:
            return done(errors="grep: no pattern\n", status=2)
        try:
            text = (
                piped.decode() if len(args) == 1 else self._run_cat(args[1:], b"").output.decode()
            )
            pattern = re.compile(args[0], re.I if "i" in letters else 0)
        except re.error as error:
            return done(errors="grep: {}\n".format(error), status=2)
        lines = [
            line for line in text.splitlines(True) if bool(pattern.search(line)) != ("v" in letters)
        ]
        return done("".join(lines), status=0 if lines else 1)

    def _run_false(self, args: Sequence[str], piped: bytes) -> Finished:
        return Finished(1, b"", b"", 0.0)

    def reads_input(self, args: Sequence[str]) -> bool:
        """Return whether a program reads its standard input, by its command line."""
        name, names = os.path.basename(args[0]), _options(args[1:])[1]
        return (
            (name == "cat" and names in ([], ["-"]))
            or (name == "grep" and len(names) == 1)
            or (name == "aplay" and not any(arg.endswith(".wav") for arg in names))
        )

    def knows(self, name: str) -> bool:
        """Return True if there is a program of that name, here or in processes."""
        return hasattr(self, method_of(name)) or name in ("sh", "bash", "python3", "sudo")


def method_of(name: str) -> str:
    """Return the name of the method that is a program; `[` is test."""
    return "_run_" + {"[": "test"}.get(name, name).replace("-", "_")
