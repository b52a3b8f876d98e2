"""Programs that a script starts on the brick: their output, and the time that they take.

No sound is played and no program of the laptop is started.
"""

import os
import re
import wave
from typing import Callable, Optional, Sequence

from laptop.emulator.device.file_programs import NOT_DONE, FilePrograms, Finished, done, method_of
from laptop.emulator.device.screen import HEIGHT, WIDTH

MYPY = False
if MYPY:
    from typing import List, Tuple  # noqa: F401

    from laptop.emulator.device.attribute_devices import DeviceWorld  # noqa: F401

    BrickProgram = Callable[[Sequence[str], bytes], Finished]  # of its args and its standard input


class Sound(bytes):
    """Sampled sound in a pipe: empty bytes that know how long they last, s."""

    seconds = 0.0


class BrickPrograms(FilePrograms):
    """All programs there are.

    Args:
        world: the clock.

    Attributes:
        history: (s, command line) of every program that was started.
        volume: percent.
        font: (width, height) of a console character in pixels.
    """

    def __init__(self, world: "DeviceWorld") -> None:
        self._world = world
        self.history = []  # type: List[Tuple[float, str]]
        self.volume = 100
        self.font = (8, 16)

    def run(self, args: Sequence[str], piped: bytes = b"") -> Optional[Finished]:
        """Do as the program `args[0]` would on the brick.

        Args:
            args: its command line.
            piped: its standard input, bytes, or Sound.

        Returns:
            Finished; None when there is no such program.
        """
        name = os.path.basename(args[0])
        program = getattr(self, method_of(name), None)  # type: Optional[BrickProgram]
        self.history.append((self._world.now(), " ".join(args)))
        if name in NOT_DONE:
            return done(errors="{}: not done: {}\n".format(name, NOT_DONE[name]), status=1)
        return program and program(args[1:], piped)

    def _run_beep(self, args: Sequence[str], piped: bytes) -> Finished:
        length, delay, pause, repeats, total = 0.2, 0.0, 0.1, 1, 0.0
        args = [part for arg in args for part in _split_option(arg)]
        while args:
            option = args.pop(0)
            if option in ("-n", "--new"):
                total += repeats * (length + delay) + (repeats - 1) * pause
                length, delay, pause, repeats = 0.2, 0.0, 0.1, 1
            elif option in ("-f", "-l", "-r", "-d", "-D"):
                try:
                    value = float(args.pop(0))
                except (IndexError, ValueError):
                    return Finished(1, b"", b"beep: invalid option\n", 0.01)
                if option == "-l":
                    length = value / 1000.0
                elif option == "-r":
                    repeats = int(value)
                elif option == "-d":
                    pause, delay = value / 1000.0, 0.0
                elif option == "-D":
                    pause, delay = 0.0, value / 1000.0
        total += repeats * (length + delay) + (repeats - 1) * pause
        return Finished(0, b"", b"", total)

    def _run_aplay(self, args: Sequence[str], piped: bytes) -> Finished:
        seconds = getattr(piped, "seconds", 0.0)
        for arg in args:
            if arg.endswith(".wav"):
                try:
                    with wave.open(arg, "rb") as file:
                        seconds += file.getnframes() / float(file.getframerate())
                except (OSError, EOFError, wave.Error) as error:
                    message = "aplay: {}: {}\n".format(arg, error)
                    return Finished(1, b"", message.encode(), 0.01)
        return Finished(0, b"", b"", seconds)

    def _run_espeak(self, args: Sequence[str], piped: bytes) -> Finished:
        args = list(args)
        into_pipe = "--stdout" in args
        per_minute, text = 175.0, []
        while args:
            arg = args.pop(0)
            if arg == "-s" and args:
                per_minute = max(80.0, float(args.pop(0)))
            elif arg in ("-a", "-v", "-p", "-g", "-k", "-l") and args:
                args.pop(0)
            elif not arg.startswith("-"):
                text.append(arg)
        # A spoken word is taken as six characters.
        seconds = 0.2 + len(" ".join(text)) / 6.0 * 60.0 / per_minute
        sound = Sound()
        sound.seconds = seconds
        if into_pipe:
            return Finished(0, sound, b"", 0.0)
        return Finished(0, b"", b"", seconds)

    def _run_amixer(self, args: Sequence[str], piped: bytes) -> Finished:
        quiet = "-q" in args
        args = [arg for arg in args if arg != "-q"]
        if args[:1] == ["scontrols"]:
            return Finished(0, b"Simple mixer control 'PCM',0\n", b"", 0.01)
        for arg in args[1:]:
            if re.match(r"^\d+%$", arg):
                self.volume = min(100, int(arg[:-1]))
        report = "Simple mixer control 'PCM',0\n  Mono: Playback {0} [{0}%] [on]\n"
        return Finished(0, b"" if quiet else report.format(self.volume).encode(), b"", 0.01)

    def _run_setfont(self, args: Sequence[str], piped: bytes) -> Finished:
        match = re.search(r"(\d+)(?:x(\d+))?(?:\.psf)?(?:\.gz)?$", args[-1] if args else "")
        if match:
            # Names give height x width; a lone number is the height of an 8 pixel wide font.
            self.font = (int(match.group(2) or 8), int(match.group(1)))
        return Finished(0, b"", b"", 0.05)

    def _run_stty(self, args: Sequence[str], piped: bytes) -> Finished:
        output = b""
        if args == ["size"]:
            width, height = self.font
            output = "{} {}\n".format(HEIGHT // height, WIDTH // width).encode()
        return Finished(0, output, b"", 0.01)

    def _run_clear(self, args: Sequence[str], piped: bytes) -> Finished:
        return Finished(0, b"\x1b[H\x1b[2J", b"", 0.01)

    def _run_echo(self, args: Sequence[str], piped: bytes) -> Finished:
        end = "\n"
        if args[:1] == ["-n"]:
            args, end = args[1:], ""
        return Finished(0, (" ".join(args) + end).encode(), b"", 0.01)

    def _run_sleep(self, args: Sequence[str], piped: bytes) -> Finished:
        try:
            return Finished(0, b"", b"", max(0.0, float(args[0].rstrip("s"))))
        except (IndexError, ValueError):
            return done(errors="sleep: seconds are missing\n", status=1)

    def _run_true(self, args: Sequence[str], piped: bytes) -> Finished:
        return Finished(0, b"", b"", 0.0)

    def _run_hostname(self, args: Sequence[str], piped: bytes) -> Finished:
        return Finished(0, b"ev3dev\n", b"", 0.01)

    _run_sync = _run_tput = _run_chvt = _run_true


def _split_option(arg: str) -> Sequence[str]:
    """Return `-l100` as `-l 100`."""
    match = re.match(r"^(-[flrdD])(.+)$", arg)
    return match.groups() if match else (arg,)
