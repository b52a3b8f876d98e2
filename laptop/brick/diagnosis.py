"""Facts that a brick reports of itself, judged: each line is fine, or says what to do."""

from __future__ import annotations

import contextlib
import re
import statistics
import time
from collections.abc import AsyncIterator, Callable, Mapping, Sequence
from typing import Any

import asyncssh

from laptop.brick import COMMAND, BrickProblem
from laptop.brick.answers import MAX_SILENCE, ask, lines, within
from laptop.brick.connection import BrickAddress, Dialogue
from laptop.brick.install import ASK, parse_installed
from laptop.brick.program_files import program_files, version_of
from laptop.system.findings import Finding
from shared.arm_description import Arm
from shared.config_files import InvalidFile, parse_json
from shared.message_fields import printable

OLDEST_PYTHON, OLDEST_LIBRARY = (3, 5), (2, 1)
"""Oldest versions of Python and python-ev3dev2 that the program is made for."""
CARD = "write the card anew with the last ev3dev-stretch of ev3dev.org"

MIN_MEMORY, MIN_ROOM = 8.0, 20.0
"""Least memory, and least room on the card, that should be left, MB."""
MAX_LOAD = 1.5
"""Greatest number of programs that want a core at the same time; with more, motions are late."""
MIN_BATTERY = 6.5
"""Least voltage of the battery, V: there ev3dev warns of a rechargeable one, too."""
MAX_CLOCK_ERROR = 86400.0
"""Greatest error of the clock, s; beyond, dates of files mislead."""
MAX_ROUND_TRIP = 0.05
"""Greatest median round trip of a cable or good radio, s."""
ROUND_TRIPS = 10
"""Number of round trips that are measured."""

MAX_TEXT, MAX_ITEMS = 200, 64
"""Greatest length of a text from a brick, characters, and number of its motors or programs."""
BY_HAND_TIMEOUT = 60.0
"""Longest time for turning motors by hand, s: doctor.py watches them for half of it."""


async def doctor(
    brick: asyncssh.SSHClientConnection,
    address: BrickAddress,
    dialogue: Dialogue,
    arm: Arm,
    by_hand: bool,
    report: Callable[[str], None],
) -> bool:
    """Report the findings about a brick; return True if all are fine.

    Args:
        brick: the connection.
        address: the brick's.
        dialogue: with who has asked.
        arm: the arm whose motors should be plugged in.
        by_hand: whether motors are watched while somebody turns them.
        report: called with each line.

    Raises:
        BrickProblem: the brick reports no facts.
    """
    findings = [judge_link(await _round_trips(brick))]
    installed = parse_installed((await ask(brick, ASK)).out)
    here = version_of(program_files())
    findings.append(judge_program(installed.version, here))
    script = program_files()["robot/doctor.py"].data
    process = await brick.create_process("python3 -" + " --motors" * by_hand, encoding=None)
    with contextlib.suppress(BrokenPipeError):  # it has ended without reading it: see below why
        process.stdin.write(script)
        process.stdin.write_eof()
    output = lines(process.stdout, silence=BY_HAND_TIMEOUT if by_hand else MAX_SILENCE)
    facts = await _facts(process, output)
    findings += judge(facts, arm, time.time())
    for finding in findings:
        report(str(finding))
    if by_hand:
        findings += await within(BY_HAND_TIMEOUT, _by_hand(output, facts, report))
    return not any(finding.advice for finding in findings)


async def _facts(
    process: asyncssh.SSHClientProcess[bytes], output: AsyncIterator[str]
) -> dict[str, Any]:
    """Return the first line of JSON that doctor.py prints.

    Raises:
        BrickProblem: there is none.
    """
    async for line in output:
        with contextlib.suppress(InvalidFile):
            return parse_json(line)
    errors = [line async for line in lines(process.stderr) if line.strip()]
    await within(MAX_SILENCE, process.wait_closed())
    why = errors[-1].strip() if errors else f"status {process.exit_status}"
    if process.exit_status == 127:
        why = f"there is no python3; {CARD}"
    raise BrickProblem(f"the brick cannot tell how it is: {why}")


async def _round_trips(brick: asyncssh.SSHClientConnection) -> list[float]:
    """Return the times of round trips to the brick, s."""
    process = await brick.create_process("cat", encoding=None)
    echoes = lines(process.stdout)
    times = []
    for _ in range(1 + ROUND_TRIPS):
        began = time.monotonic()
        process.stdin.write(b"there and back\n")
        if not await anext(echoes, ""):
            raise asyncssh.ConnectionLost("no echo")
        times.append(time.monotonic() - began)
    with contextlib.suppress(BrokenPipeError):
        process.stdin.write_eof()
    return times[1:]  # the first is also the start of that program


def judge_link(times: Sequence[float]) -> Finding:
    """Return the Finding of round trips, s."""
    middle, worst = statistics.median(times), max(times)
    value = f"there and back in {1000 * middle:.1f} ms, {1000 * worst:.1f} ms at most"
    slow = middle > MAX_ROUND_TRIP
    return Finding("link", value, "slow; take the cable, or go nearer" if slow else "")


def judge_program(on_brick: str, on_laptop: str) -> Finding:
    """Return the Finding of the program's versions there ("" for none) and here."""
    if on_brick == on_laptop:
        return Finding("program", f"{on_brick} is there and here")
    return Finding(
        "program", f"{on_brick or 'none'} is there, {on_laptop} here", f"type {COMMAND} install"
    )


def judge(facts: Mapping[str, Any], arm: Arm, now: float) -> list[Finding]:
    """Return the Findings of the facts of doctor.py.

    Args:
        facts: see FACTS.
        arm: the arm whose motors should be plugged in.
        now: time of this computer, s since 1970.

    Raises:
        BrickProblem: these are no such facts.
    """
    known = read_facts(facts)
    return [*_system(known, now), *_motors(known, arm)]


def _text(value: Any) -> str:
    if not isinstance(value, str):
        raise ValueError("a text")
    return printable(value)[:MAX_TEXT]


def _number(low: float, high: float) -> Callable[[Any], float]:
    def read(value: Any) -> float:
        if type(value) not in (int, float) or not low <= value <= high:
            raise ValueError(f"a number from {low:g} to {high:g}")
        return float(value)

    return read


def _or_none(read: Callable[[Any], Any]) -> Callable[[Any], Any]:
    return lambda value: None if value is None else read(value)


def _programs(value: Any) -> list[tuple[int, str]]:
    try:
        return [(int(_number(0, 1e9)(number)), _text(line)) for number, line in value[:MAX_ITEMS]]
    except (TypeError, ValueError):
        raise ValueError("a list of programs") from None


def _found_motors(value: Any) -> dict[str, dict[str, Any]]:
    if not isinstance(value, dict) or len(value) > MAX_ITEMS:
        raise ValueError("a table of motors")
    return {
        _text(port): {"kind": _text(motor["kind"]), "position": int(COUNTS(motor["position"]))}
        for port, motor in value.items()
    }


COUNTS = _number(-(2**31), 2**31)
"""Reader of a motor's counts."""

FACTS: dict[str, Callable[[Any], Any]] = {
    "python": _text,
    "library": _or_none(_text),
    "kernel": _text,
    "memory": _or_none(_number(0, 1e9)),
    "load": _number(0, 1e6),
    "cores": _number(1, 1e4),
    "others": _programs,
    "room": _number(0, 1e12),
    "battery": _or_none(_number(-100, 100)),
    "time": _number(-1e11, 1e11),
    "host": _text,
    "connection": _text,
    "motors": _found_motors,
    "problem": _or_none(_text),
}
"""Readers of the facts of doctor.py by name; their ValueErrors say what a fact must be."""


def read_facts(reported: Mapping[str, Any]) -> dict[str, Any]:
    """Return the facts of doctor.py as they can be relied on.

    Raises:
        BrickProblem: something is missing, of another kind or beyond its bounds.
    """
    facts = {}
    for name, read in FACTS.items():
        try:
            facts[name] = read(reported[name])
        except (KeyError, TypeError, ValueError) as error:
            value = reported.get(name)
            shown = "not told" if name not in reported else "of another kind"
            if isinstance(value, (str, int, float)):
                shown = ascii(value)[:40]
            allowed = f"; it must be {error}" if type(error) is ValueError else ""
            raise BrickProblem(
                f"the brick tells what is not understood here: {name} is {shown}{allowed}; is it "
                "a brick of yours? Then switch it off and on, and look again"
            ) from None
    return facts


def _system(facts: Mapping[str, Any], now: float) -> list[Finding]:
    found = [Finding("python", facts["python"], _old(facts["python"], OLDEST_PYTHON))]
    library = facts["library"]
    if library is None:
        found.append(Finding("ev3dev2", "there is no python-ev3dev2", CARD))
    else:
        found.append(Finding("ev3dev2", library or "?", _old(library, OLDEST_LIBRARY)))
    is_ev3dev = "ev3dev" in facts["kernel"] or facts["motors"]
    advice = "" if is_ev3dev else f"no kernel of ev3dev, which has the motors; {CARD}"
    found.append(Finding("kernel", facts["kernel"], advice))
    if facts["memory"] is not None:
        few = "little; end other programs" if facts["memory"] < MIN_MEMORY else ""
        found.append(Finding("memory", f"{facts['memory']:.0f} MB left", few))
    few = f"little; delete files of yours ({COMMAND} shell)" if facts["room"] < MIN_ROOM else ""
    found.append(Finding("card", f"{facts['room']:.0f} MB left", few))
    others = ", ".join(f"{line} ({number})" for number, line in facts["others"][:3])
    busy = facts["load"] > MAX_LOAD * facts["cores"]
    found.append(
        Finding(
            "load",
            f"{facts['load']:.1f}, {f'beside it runs {others}' if others else 'nothing beside it'}",
            "busy; wait, or end what is not needed, or motions are late" if busy else "",
        )
    )
    volts = facts["battery"]
    if volts is None:
        advice = "is this a brick, and is its python-ev3dev2 all right?"
        found.append(Finding("battery", "it does not tell", advice))
    else:
        weak = "low; charge it, or the arm is weak" if volts < MIN_BATTERY else ""
        found.append(Finding("battery", f"{volts:.2f} V", weak))
    off = facts["time"] - now
    advice = ""
    if abs(off) > MAX_CLOCK_ERROR:
        advice = f"dates of files mislead; type {COMMAND} shell, then sudo date -s @{now:.0f}"
    found.append(Finding("clock", _duration(off), advice))
    ends = facts["connection"].split()
    route = f", at {ends[2]} for {ends[0]}" if len(ends) == 4 else ""
    found.append(Finding("network", facts["host"] + route))
    return found


def _motors(facts: Mapping[str, Any], arm: Arm) -> list[Finding]:
    """Return the Finding of each port where a motor is or should be."""
    if facts["problem"]:
        return [Finding("motors", facts["problem"], "put python-ev3dev2 right, see above")]
    wanted = {joint.port: (joint.name, joint.motor) for joint in arm.joints}
    if arm.pen:
        wanted[arm.pen.port] = ("pen", arm.pen.motor)
    found = []
    for port in sorted({*wanted, *facts["motors"]}):
        name, kind = wanted.get(port, ("", ""))
        motor = facts["motors"].get(port)
        if motor is None:
            advice = f"the {arm.name} arm has its {name} there, a {kind} motor; look at the cable"
            found.append(Finding(f"port {port}", "no motor", advice))
            continue
        value = f"{motor['kind']} motor at {motor['position']} counts"
        if kind and motor["kind"] != kind:
            advice = f"the {arm.name} arm has a {kind} motor there, its {name}; plug that in there"
            found.append(Finding(f"port {port}", value, advice))
        else:
            found.append(Finding(f"port {port}", value + (f", {name}" if name else "")))
    return found


async def _by_hand(
    output: AsyncIterator[str], facts: Mapping[str, Any], report: Callable[[str], None]
) -> list[Finding]:
    """Report which motors count while they are turned by hand; return a Finding for each."""
    report("now turn each joint by hand, one after the other, within half a minute")
    turned: dict[str, int] = {}
    gone: set[str] = set()
    async for line in output:
        try:
            reported = parse_json(line)
            port = reported["port"]
            if port not in facts["motors"]:
                continue
            if reported.get("gone"):
                gone.add(port)
                continue
            counts = int(COUNTS(reported["position"])) - int(COUNTS(reported["before"]))
        except (InvalidFile, ValueError, KeyError, TypeError):
            continue  # what something else there has written
        turned[port] = turned.get(port, 0) + abs(counts)
        report(f"  {port} counts {counts:+d}")
    found = []
    for port in sorted(facts["motors"]):
        found.append(judge_turned(port, turned.get(port), port in gone))
        report(str(found[-1]))
    return found


def judge_turned(port: str, counts: int | None, gone: bool = False) -> Finding:
    """Return the Finding of a motor after the time to turn it.

    Args:
        port: its port, "A" to "D".
        counts: sum of all that it has counted, in both directions; None: it has not counted.
        gone: whether it came off meanwhile.
    """
    if gone:
        off = "its motor came off meanwhile", "push its cable in, and look again"
        return Finding(f"port {port}", *off)
    if counts is not None:
        return Finding(f"port {port}", f"counts {counts} by hand")
    advice = "if you have turned it, change its cable, then the motor"
    return Finding(f"port {port}", "has not counted", advice)


def _old(version: str, oldest: tuple[int, ...]) -> str:
    numbers = tuple(int(number) for number in re.findall(r"\d{1,9}", version)[: len(oldest)])
    if numbers >= oldest:
        return ""
    return f"older than {'.'.join(map(str, oldest))}; {CARD}"


def _duration(seconds: float) -> str:
    for unit, length in (("days", 86400), ("hours", 3600), ("minutes", 60)):
        if abs(seconds) >= 2 * length:
            return f"{seconds / length:+.0f} {unit} off"
    return f"{seconds:+.0f} s off"
