"""The exit statuses of the commands, all of them."""

from enum import IntEnum

from laptop.emulator.host import process_exit


class ExitStatus(IntEnum):
    """Exit status of a command; `simulate` and `brick run` end with a script's own."""

    DONE = 0
    FAILED = 1
    MISTYPED = 2
    NEVER_CAME = 3
    BUSY = process_exit.BUSY
    ENDLESS = process_exit.ENDLESS
    STOPPED = 130
    KILLED = 137
    UNREAD = 141


MEANINGS = {
    ExitStatus.DONE: "all is done, and fine",
    ExitStatus.FAILED: "something failed or is not fine: a line says what, and what to do",
    ExitStatus.MISTYPED: "what was typed is wrong: nothing was done",
    ExitStatus.NEVER_CAME: "`simulate`: the script succeeded before all that was ordered had come",
    ExitStatus.BUSY: "this computer is too busy for the emulation: try later",
    ExitStatus.ENDLESS: "`simulate`: the script would never have ended, or its time was over",
    ExitStatus.STOPPED: "stopped, by Ctrl-C",
    ExitStatus.KILLED: "`simulate`: the script hung inside C code, and was killed",
    ExitStatus.UNREAD: "nobody reads what is printed any more",
}
"""Meanings of the exit statuses, for people."""
