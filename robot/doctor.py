#!/usr/bin/env python3
"""Tell what this brick is and has, as a line of JSON; it moves nothing.

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
"""For so long motors are watched, and as often as this they are looked at, s."""
MIN_TURN = 5
"""A motor that has counted so far from where it was last told is told again, counts."""

KINDS = {"lego-ev3-l-motor": "large", "lego-ev3-m-motor": "medium"}
"""Kinds of motors that an arm has, by their drivers."""


def read(path):
    # type: (str) -> str
    """The text of a file of the system's; "" if there is none."""
    try:
        with open(path, errors="replace") as file:
            return file.read()
    except OSError:
        return ""


def library():
    # type: () -> Optional[str]
    """The version of python-ev3dev2, "" if it does not say, None if it is not there."""
    found = importlib.util.find_spec("ev3dev2")
    if found is None or not found.origin:
        return None
    text = read(os.path.join(os.path.dirname(found.origin), "version.py"))
    version = re.search(r"__version__ *= *['\"]([^'\"]+)", text)
    return version.group(1) if version else ""


def memory():
    # type: () -> Optional[float]
    """What is left of the memory for programs, MB; None if the system does not say."""
    found = re.search(r"^MemAvailable: *(\d+) kB", read("/proc/meminfo"), re.MULTILINE)
    return int(found.group(1)) / 1024 if found else None


def others():
    # type: () -> List[Tuple[int, str]]
    """Other programs of Python: (number, command line)."""
    found = []
    for path in glob.glob("/proc/[0-9]*/cmdline"):
        number = int(path.split("/")[2])
        words = read(path).split("\0")
        is_python = re.match(r"(micro|pybricks-micro)?python", os.path.basename(words[0]))
        if is_python and number not in (os.getpid(), os.getppid()):
            found.append((number, " ".join(words).strip()[:80]))
    return sorted(found)


def room():
    # type: () -> float
    """What is left of the card, MB."""
    left = os.statvfs(os.path.expanduser("~"))
    return left.f_bavail * left.f_frsize / 1e6


def battery():
    # type: () -> Optional[float]
    """Its voltage, V; None if it does not tell."""
    try:
        from ev3dev2.power import PowerSupply

        volts = PowerSupply().measured_volts  # type: float
        return volts
    except Exception:  # whatever a driver may have
        return None


def motors():
    # type: () -> Tuple[Motors, Optional[str]]
    """The motors of python-ev3dev2 by port, and why there are none."""
    try:
        from ev3dev2.motor import list_motors

        return {motor.address[-1:]: motor for motor in list_motors()}, None
    except Exception as error:  # whatever that library, or a driver, may have
        return {}, "{}: {}".format(type(error).__name__, error)


def facts(found, problem):
    # type: (Motors, Optional[str]) -> Dict[str, object]
    """All that there is to tell, but how motors turn.

    Args:
        found: port -> motor.
        problem: why there are none, or None.
    """
    told = {}
    for port, motor in found.items():
        driver = motor.driver_name
        told[port] = {"kind": KINDS.get(driver, driver), "position": motor.position}
    now = datetime.datetime.now(datetime.timezone.utc)
    return {
        "python": platform.python_version(),
        "library": library(),
        "kernel": platform.release(),
        "memory": memory(),
        "load": os.getloadavg()[0],
        "cores": os.cpu_count() or 1,
        "others": others(),
        "room": room(),
        "battery": battery(),
        "time": now.timestamp(),
        "host": socket.gethostname(),
        "connection": os.environ.get("SSH_CONNECTION", ""),
        "motors": told,
        "problem": problem,
    }


def tell(what):
    # type: (Dict[str, object]) -> None
    """Write a line."""
    print(json.dumps(what), flush=True)


def watch(found):
    # type: (Motors) -> None
    """Tell of each motor that is turned by hand, or comes off by that."""
    last, there = {}, dict(found)  # type: Dict[str, int], Motors
    pause = threading.Event()
    for _ in range(int(WATCH_TIME / POLL_PERIOD)):
        for port, motor in sorted(there.items()):
            try:
                position = motor.position
            except Exception:  # whatever that library, or a driver, may have
                tell({"port": port, "gone": True})
                del there[port]
                continue
            last.setdefault(port, position)
            if abs(position - last[port]) >= MIN_TURN:
                tell({"port": port, "before": last[port], "position": position})
                last[port] = position
        pause.wait(POLL_PERIOD)


def main():
    # type: () -> None
    """Tell it all."""
    found, problem = motors()
    tell(facts(found, problem))
    if "--motors" in sys.argv[1:]:
        watch(found)


if __name__ == "__main__":
    main()
