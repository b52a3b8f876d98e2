"""Jobs on the brick, drawings that it draws alone: sent, started, watched and given orders.

The program there is detached from the connection (setsid), and goes on when that ends. Its status
is a file, and its orders are lines in another one: a shell there passes both on, and no Python.
"""

from __future__ import annotations

import asyncio
import re
import shlex
import signal
from collections.abc import Callable
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any

import asyncssh

from laptop.brick import BrickProblem
from laptop.brick.answers import ask, lines
from laptop.brick.connection import CUT, BrickAddress, Dialogue
from laptop.brick.install import update
from laptop.brick.program_files import HOLD
from laptop.brick.remote_files import put
from laptop.brick.terminal import CTRL_C, END_OF_INPUT, on_signal, reading
from laptop.system import platforms
from shared import job_messages
from shared.config_files import InvalidFile, parse_json
from shared.message_fields import printable

JOBS = ".brickservo/jobs"
STATUS, ORDERS = f"{JOBS}/status", f"{JOBS}/orders"
LOG = ".brickservo/logs/job.log"
"""Paths in the brick's home, see shared.state; the last holds what the program prints."""

DRIVER, PROBLEM = "robot/driver.py", "driver.py: "
"""The program there, and the beginning of its line about a problem."""

NUMBER = r"\"pid\": *\([0-9]*\)"
IS_ON = f"""
pid=$(sed -n 's/.*{NUMBER}.*/\\1/p' {STATUS} 2>/dev/null | head -n 1)
[ -n "$pid" ] && tr '\\0' ' ' <"/proc/$pid/cmdline" 2>/dev/null | grep -q ' job '
"""
"""Script that succeeds if the program of the job in the status runs, with $pid its number."""

START = """
mkdir -p {jobs} .brickservo/logs && rm -f {status} && cd "$HOME" || exit 1
setsid sh -c '{hold}; exec env PYTHONUNBUFFERED=1 {command}' >{log} 2>&1 </dev/null &
echo $!
"""
"""Script that starts the program detached from the connection, and prints its number."""

FOLLOW = """exec bash -c '
told=
tell() {{
    status=
    read -r status 2>/dev/null <{status} || [ -n "$status" ] || return
    [ "$status" = "$told" ] || printf "%s\\n" "$status"
    told=$status
}}
beat=0
while [ -d /proc/{pid} ]; do
    tell
    beat=$(( (beat + 1) % 5 )); [ $beat != 0 ] || echo
    if read -r -t 1 order; then echo "$order" >>{orders}; else [ $? -gt 128 ] || exit 0; fi
done
tell
echo "{{\\"over\\": true}}"
tail -c 2000 {log}'"""
"""Script that prints every new status while the program runs, then the end of its output, and
passes orders on. Every few seconds it prints an empty line, too. It is one shell, which starts
nothing: each program that starts takes the arm's time."""

MAX_NUMBER, MAX_FINAL_OUTPUT = 1e6, 4000
"""Greatest number of a status, and greatest length of the program's output at its end, characters.
"""
COUNTS, SIGNED = ("stroke", "strokes", "repeat", "repeats"), ("pen",)
"""Names of a status's numbers that are whole, and that may be negative."""

ENDS = (*job_messages.ENDS, "stopped")
"""States in which a job is over: those of a link's messages, and by a signal."""

SPEED_STEP, PEN_STEP = 10, 2.0
"""Steps of a key: per cent of the planned speed, degrees of the pen's motor."""
MIN_SPEED = 25
"""Least speed that the brick takes, per cent."""


@dataclass(frozen=True)
class BrickJobStatus:
    """The status of a job as the brick reports it; see robot.jobs.report.

    Attributes:
        state: "drawing" | "paused" | one of ENDS.
        reason: of the state, for people; or "".
        job: its name.
        stroke, strokes: number of the one under way, from 1 on, and of all.
        cm, cm_all: length drawn so far of this repeat, and of all of it.
        left_s: time left, s.
        repeat, repeats: number of the repeat, from 1 on, and of all.
        tip: (x, y) or (x, y, z) as planned, cm; None between strokes.
        volts: voltage of the battery, V; None where not known.
        speed: per cent of the planned speed.
        pen: depth that is added to the pen's, degrees of its motor.
    """

    state: str
    job: str = ""
    reason: str = ""
    stroke: int = 0
    strokes: int = 0
    cm: float = 0.0
    cm_all: float = 0.0
    left_s: float = 0.0
    repeat: int = 1
    repeats: int = 1
    tip: tuple[float, ...] | None = None
    volts: float | None = None
    speed: float = 100.0
    pen: float = 0.0

    @property
    def share(self) -> float:
        """Share of the job's length that is drawn, 0 to 1."""
        return min(1.0, self.cm / self.cm_all) if self.cm_all > 0 else 0.0


def read_status(value: object) -> BrickJobStatus | None:
    """Return the status in untrusted data of the brick; None: it is not valid."""
    if not isinstance(value, dict) or not isinstance(value.get("state"), str):
        return None
    known: dict[str, Any] = {}
    for field in fields(BrickJobStatus):
        one: Any = value.get(field.name)
        if field.name in ("state", "job", "reason"):
            known[field.name] = printable(one)[:200] if isinstance(one, str) else ""
        elif field.name == "tip":
            if isinstance(one, list) and len(one) in (2, 3) and all(map(_is_number, one)):
                known[field.name] = tuple(one)
        elif _is_number(one) and (field.name in SIGNED or one >= 0):
            if field.name not in COUNTS:
                known[field.name] = float(one)
            elif type(one) is int:
                known[field.name] = one
    return BrickJobStatus(**known)


def _is_number(value: Any) -> bool:
    return type(value) in (int, float) and abs(value) <= MAX_NUMBER


class StatusReader:
    """A reader of the lines that FOLLOW prints, as they come.

    Attributes:
        final_output: the program's last MAX_FINAL_OUTPUT letters of output; None while it runs.
    """

    def __init__(self) -> None:
        self.final_output: str | None = None

    def handle(self, line: str) -> BrickJobStatus | None:
        """Return the status of a line; None: it has none, or the program has ended."""
        if self.final_output is not None:
            self.final_output = f"{self.final_output}{line}\n"[-MAX_FINAL_OUTPUT:]
            return None
        try:
            value = parse_json(line)
        except InvalidFile:  # nothing new, or it was replaced while it was read
            return None
        if value.get("over") is True:
            self.final_output = ""
            return None
        return read_status(value)


class JobKeys:
    """Keys that are typed while a job is drawn, as orders to it.

    Args:
        order: called with an order to send.
        leave: called to end the watching; the job goes on.

    Attributes:
        status: BrickJobStatus that is known, with what was ordered since.
    """

    HELP = "space pauses and goes on, a aborts, + - speed, u d pen up and down, q leaves it to draw"

    def __init__(self, order: Callable[[str], None], leave: Callable[[], None]) -> None:
        self._order, self._leave = order, leave
        self.status = BrickJobStatus("drawing")
        self._wants_pause = False

    def handle(self, typed: bytes) -> None:
        """Handle some keys; Ctrl-C pauses, and where that was so, aborts."""
        for key in typed:
            letter = bytes((key,))
            paused = self._wants_pause
            if letter == CTRL_C:
                self._order("abort" if paused else "pause")
                self._wants_pause = True
            elif letter in b" p\r\n":
                self._order("resume" if paused else "pause")
                self._wants_pause = not paused
            elif letter == b"a":
                self._order("abort")
            elif letter in b"+-":
                step = SPEED_STEP if letter == b"+" else -SPEED_STEP
                speed = min(max(round(self.status.speed) + step, MIN_SPEED), 100)
                self._order(f"speed {speed}")
                self.status = replace(self.status, speed=speed)
            elif letter in b"ud":
                deeper = PEN_STEP if letter == b"d" else -PEN_STEP
                self._order(f"pen {self.status.pen + deeper:g}")
                self.status = replace(self.status, pen=self.status.pen + deeper)
            elif letter == b"q":
                self._leave()

    def update(self, status: BrickJobStatus) -> None:
        """Update the status of the job."""
        self._wants_pause = status.state == "paused" or (
            self._wants_pause and self.status.state != "paused"
        )
        self.status = status


async def draw(
    brick: asyncssh.SSHClientConnection,
    address: BrickAddress,
    dialogue: Dialogue,
    job: Path,
    args: tuple[str, ...],
    show: Callable[[BrickJobStatus], None],
    detach: bool = False,
) -> int:
    """Send a job, let the brick draw it, and watch it; return its exit status.

    Args:
        brick: the connection.
        address: the brick's.
        dialogue: with who watches.
        job: its file here.
        args: options of `driver.py job`.
        show: called with every status.
        detach: whether it is left alone once it is started.

    Raises:
        BrickProblem: another job is on, it cannot be sent or started, or it ended badly.
    """
    if (await ask(brick, IS_ON)).status == 0:
        raise BrickProblem(
            f"{address} draws another job; watch it by brick watch, or abort it there"
        )
    await update(brick, address, dialogue)
    target = f"{JOBS}/{_file_name(job.name)}"
    await put(brick, target, job.read_bytes())
    command = " ".join([DRIVER, "job", shlex.quote(target), *map(shlex.quote, args)])
    started = await ask(
        brick, START.format(jobs=JOBS, status=STATUS, hold=HOLD, log=LOG, command=_inner(command))
    )
    if started.status or not _number(started.out):
        raise BrickProblem(f"{address} cannot start it: {started.errors.strip() or 'no answer'}")
    dialogue.report(f"{address}: sent, and started; that takes a brick some seconds")
    if detach:
        dialogue.report("it draws alone; brick watch shows how it goes")
        return 0
    return await _watch(brick, address, dialogue, _number(started.out), show)


async def watch(
    brick: asyncssh.SSHClientConnection,
    address: BrickAddress,
    dialogue: Dialogue,
    show: Callable[[BrickJobStatus], None],
) -> int:
    """Watch the job that is drawn already; return its exit status.

    Args:
        brick: the connection.
        address: the brick's.
        dialogue: with who watches.
        show: called with every status.

    Raises:
        BrickProblem: none is, or it ended badly.
    """
    found = await ask(brick, f"{IS_ON.rstrip()} && echo $pid")
    if found.status or not _number(found.out):
        raise BrickProblem(f"{address} draws no job; send one by draw FILE")
    return await _watch(brick, address, dialogue, _number(found.out), show)


async def jobs(
    brick: asyncssh.SSHClientConnection, address: BrickAddress, dialogue: Dialogue
) -> str:
    """Return what `driver.py jobs` lists."""
    await update(brick, address, dialogue)
    return await _driver(brick, address, "jobs")


async def cancel(
    brick: asyncssh.SSHClientConnection, address: BrickAddress, dialogue: Dialogue, name: str
) -> str:
    """Remove a job from the brick; return what it says.

    Raises:
        BrickProblem: there is none of that name, or it is drawn.
    """
    await update(brick, address, dialogue)
    return await _driver(brick, address, f"jobs {shlex.quote(name)} --remove")


async def _driver(brick: asyncssh.SSHClientConnection, address: BrickAddress, args: str) -> str:
    done = await ask(brick, f"{DRIVER} {args}")
    if done.status:
        raise BrickProblem(f"{address}: {printable(done.errors.strip() or done.out.strip())}")
    return "\n".join(printable(line) for line in done.out.rstrip().splitlines())


def _number(text: str) -> int:
    """Return the number of a program that the brick has printed; 0: it has printed none."""
    return int(text) if re.fullmatch(r"\s*[0-9]{1,9}\s*", text) else 0


def _file_name(name: str) -> str:
    """Return a name that any file system takes, and no shell minds."""
    return re.sub(r"[^\w.-]+", "_", name)


def _inner(command: str) -> str:
    """Return a command as it stands between the quotes of another."""
    return command.replace("'", "'\\''")


async def _watch(
    brick: asyncssh.SSHClientConnection,
    address: BrickAddress,
    dialogue: Dialogue,
    pid: int,
    show: Callable[[BrickJobStatus], None],
) -> int:
    """Show every status, and pass orders on, until it is over or left; return the exit status."""
    watching = _Watching(show)
    try:
        process = await brick.create_process(
            FOLLOW.format(pid=pid, status=STATUS, orders=ORDERS, log=LOG),
            encoding=None,
            stderr=asyncssh.STDOUT,
        )
        is_left = await watching.follow(process)
    except CUT:
        raise BrickProblem(
            f"the connection to {address} is lost; the job goes on there: brick watch shows it "
            "again, the brick's centre button pauses it"
        ) from None
    if is_left:
        dialogue.report("left to draw alone; brick watch shows it again")
        return 0
    why = watching.why_not_done(address)
    if why:
        raise BrickProblem(why)
    return 0


class _Watching:
    """A job that is watched from here, and is given orders.

    Args:
        show: called with every status.
    """

    def __init__(self, show: Callable[[BrickJobStatus], None]) -> None:
        self._show = show
        self._reader = StatusReader()
        self._last: BrickJobStatus | None = None

    async def follow(self, process: asyncssh.SSHClientProcess[bytes]) -> bool:
        """Follow the job until it ends or the user detaches; return True if detached.

        Args:
            process: process that runs FOLLOW.
        """
        left = asyncio.Event()

        def order(line: str) -> None:
            if not process.stdin.is_closing():
                process.stdin.write(f"{line}\n".encode())

        keys = JobKeys(order, left.set)

        def on_typed(data: bytes) -> None:
            if data != END_OF_INPUT:  # no input: the job is only watched
                keys.handle(data)

        output = lines(process.stdout, most=None)
        with (
            platforms.keys_one_by_one(),
            reading(on_typed),
            on_signal(signal.SIGINT, lambda: on_typed(CTRL_C)),
        ):
            leaving = asyncio.ensure_future(left.wait())
            while True:
                coming = asyncio.ensure_future(anext(output, None))
                await asyncio.wait({coming, leaving}, return_when=asyncio.FIRST_COMPLETED)
                if left.is_set():
                    coming.cancel()
                    return True
                line = coming.result()
                if line is None or not self._handle(line, keys):
                    leaving.cancel()
                    return False

    def _handle(self, line: str, keys: JobKeys) -> bool:
        """Handle a line of FOLLOW's; return whether more is wanted."""
        status = self._reader.handle(line)
        if len(self._reader.final_output or "") == MAX_FINAL_OUTPUT:
            return False  # no program of ours prints so much at its end
        if status is not None:
            self._last = status
            keys.update(status)
            self._show(status)
        return True

    def why_not_done(self, address: BrickAddress) -> str:
        """Return why it is over and not drawn, for people; "": it is drawn."""
        last, output = self._last, self._reader.final_output
        if output is None:
            return f"{address} ended the watching; brick watch shows the job again"
        if last is not None and last.state in ENDS:
            if last.state == job_messages.DONE:
                return ""
            return f"{last.job}: {last.state}{': ' if last.reason else ''}{last.reason}"
        problems = [line for line in output.splitlines() if line.startswith(PROBLEM)]
        why = problems[-1][len(PROBLEM) :] if problems else "it was killed, or there was no memory"
        return f"the job has ended on {address}: {printable(why)}"
