"""End of a simulated process, as a shell would see it."""

from typing import NamedTuple

ProcessExit = NamedTuple("ProcessExit", [("status", int), ("reason", str)])
"""Exit status, and why."""

ENDLESS = 124
"""Exit status of a program that never comes to an end, as `timeout` of GNU coreutils reports it."""

BUSY = 75
"""Exit status where the host is too busy to emulate it, EX_TEMPFAIL of sysexits.h: try later."""
