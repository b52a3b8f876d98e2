#!/usr/bin/env python3
"""Print what this brick is and has, as a line of JSON; it moves nothing.

    doctor.py              for the laptop's `brick doctor`, which says what that means
    doctor.py --motors     then for half a minute, a line for each motor that a hand turns

It stands for itself, as `brick doctor` runs it on bricks on which nothing is installed yet.
"""

import datetime
import glob
import importlib.util
import json
import os
import platform
import re
import socket
import sys
import threading

MYPY = False
if MYPY:
    from typing import Any, Dict, List, Optional, Tuple  # noqa: F401

    Motors = Dict[str, Any]  # python-ev3dev2's, by port

WATCH_TIME, POLL_PERIOD = 30.0, 0.1
"""Time for which motors are watched, and period of reading them, s."""
MIN_TURN = 5
"""Least turn of a motor since its last line for another one, counts."""

KINDS = {"lego-ev3-l-motor": "large", "lego-ev3-m-motor": "medium"}
"""Kinds of motors that an arm has, by their drivers."""


def read(path):
    # type: (str) -> str
    """Return the text of a file of the system's; "" if there is none."""
    try:
        with open(path, errors="replace") as file:
            return file.read()
    except OSError:
        return ""


def library():
    # type: () -> Optional[str]
    """Return the version of python-ev3dev2, "" if not known, None if it is not installed."""
    found = importlib.util.find_spec("ev3dev2")
    if found is None or not found.origin:
        return None
    text = read(os.path.join(os.path.dirname(found.origin), "version.py"))
    version = re.search(r"__version__ *= *['\"]([^'\"]+)", text)
    return version.group(1) if version else ""


def memory():
    # type: () -> Optional[float]
    """Return the memory that is left for programs, MB; None if it is not known."""
    found = re.search(r"^MemAvailable: *(\d+) kB", read("/proc/meminfo"), re.MULTILINE)
    return int(found.group(1)) / 1024 if found else None


def python_processes():
    # type: () -> List[Tuple[int, str]]
    """Return other programs of Python: (process number, command line)."""
    found = []
    for path in glob.glob("/proc/[0-9]*/cmdline"):
        number = int(path.split("/")[2])
        args = read(path).split("\0")
        is_python = re.match(r"(micro|pybricks-micro)?python", os.path.basename(args[0]))
        if is_python and number not in (os.getpid(), os.getppid()):
            found.append((number, " ".join(args).strip()[:80]))
    return sorted(found)


def free_space():
    # type: () -> float
    """Return the room that is left on the card, MB."""
    left = os.statvfs(os.path.expanduser("~"))
    return left.f_bavail * left.f_frsize / 1e6


def battery():
    # type: () -> Optional[float]
    """Return the battery's voltage, V; None if it is not known."""
    try:
        from ev3dev2.power import PowerSupply

        volts = PowerSupply().measured_volts  # type: float
        return volts
    except Exception:  # any error of a driver
        return None


def motors():
    # type: () -> Tuple[Motors, Optional[str]]
    """Return the motors of python-ev3dev2 by port, and why there are none, or None."""
    try:
        from ev3dev2.motor import list_motors

        return {motor.address[-1:]: motor for motor in list_motors()}, None
    except Exception as error:  # any error of that library, or of a driver
        return {}, "{}: {}".format(type(error).__name__, error)


def facts(found, problem):
    # type: (Motors, Optional[str]) -> Dict[str, object]
    """Return all facts of the brick, but how motors turn.

    Args:
        found: port -> motor.
        problem: why there are none, or None.
    """
    by_port = {}
    for port, motor in found.items():
        driver = motor.driver_name
        by_port[port] = {"kind": KINDS.get(driver, driver), "position": motor.position}
    now = datetime.datetime.now(datetime.timezone.utc)
    return {
        "python": platform.python_version(),
        "library": library(),
        "kernel": platform.release(),
        "memory": memory(),
        "load": os.getloadavg()[0],
        "cores": os.cpu_count() or 1,
        "others": python_processes(),
        "room": free_space(),
        "battery": battery(),
        "time": now.timestamp(),
        "host": socket.gethostname(),
        "connection": os.environ.get("SSH_CONNECTION", ""),
        "motors": by_port,
        "problem": problem,
    }


def announce(fact):
    # type: (Dict[str, object]) -> None
    """Print a dict as a line of JSON."""
    print(json.dumps(fact), flush=True)


def watch(found):
    # type: (Motors) -> None
    """Print a line for each motor that is turned by hand, or comes off by that."""
    last, present = {}, dict(found)  # type: Dict[str, int], Motors
    pause = threading.Event()
    for _ in range(int(WATCH_TIME / POLL_PERIOD)):
        for port, motor in sorted(present.items()):
            try:
                position = motor.position
            except Exception:  # any error of that library, or of a driver
                announce({"port": port, "gone": True})
                del present[port]
                continue
            last.setdefault(port, position)
            if abs(position - last[port]) >= MIN_TURN:
                announce({"port": port, "before": last[port], "position": position})
                last[port] = position
        pause.wait(POLL_PERIOD)


def main():
    # type: () -> None
    """Print the facts, then motors that turn, if that is asked for."""
    found, problem = motors()
    announce(facts(found, problem))
    if "--motors" in sys.argv[1:]:
        watch(found)


if __name__ == "__main__":
    main()
