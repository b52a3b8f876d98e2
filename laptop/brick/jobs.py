"""Jobs on the brick, drawings that it draws alone: sent, started, watched and given orders.

The program there is started apart from the connection, and goes on when that ends. Its status is
a file, and its orders are lines in another one: a shell there hands both on, and no Python.
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
from shared.message_fields import printable
from shared.small_files import InvalidFile, parse_json

JOBS = ".brickservo/jobs"
STATUS, ORDERS = f"{JOBS}/status", f"{JOBS}/orders"
LOG = ".brickservo/logs/job.log"
"""Places in the brick's home, see shared.state; the last holds what the program says."""

DRIVER, PROBLEM = "robot/driver.py", "driver.py: "
"""The program there, and how it begins to tell what is wrong."""

NUMBER = r"\"pid\": *\([0-9]*\)"
IS_ON = f"""
pid=$(sed -n 's/.*{NUMBER}.*/\\1/p' {STATUS} 2>/dev/null | head -n 1)
[ -n "$pid" ] && tr '\\0' ' ' <"/proc/$pid/cmdline" 2>/dev/null | grep -q ' job '
"""
"""Whether the program of the job in the status is on, which then has the number $pid."""

START = """
mkdir -p {jobs} .brickservo/logs && rm -f {status} && cd "$HOME" || exit 1
setsid sh -c '{hold}; exec env PYTHONUNBUFFERED=1 {command}' >{log} 2>&1 </dev/null &
echo $!
"""
"""Starts the program apart from the connection; tells its number."""

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
"""Tells every new status while the program is on, then the end of what it has said; hands on
orders. Every few seconds it tells an empty line, too. It is one shell, which starts nothing: each
program that starts takes the arm's time."""

MOST, MOST_SAID = 1e6, 4000
"""Greatest number of a status, and so many letters of what the program there says at its end."""
COUNTS, SIGNED = ("stroke", "strokes", "repeat", "repeats"), ("pen",)
"""Numbers of a status that are whole, and that may be negative."""

ENDS = (*job_messages.ENDS, "stopped")
"""States in which a job is over: those that are told over a link, and by a signal."""

SPEED_STEP, PEN_STEP = 10, 2.0
"""What a key changes: per cent of the planned speed, degrees of the pen's motor."""
SLOWEST = 25
"""Least speed that the brick takes, per cent."""

PATIENCE_WITH_ABORT = 30.0
"""Time in which a job that was aborted is over, s: the arm parks."""


@dataclass(frozen=True)
class BrickJobStatus:
    """How a job goes, as the brick tells it; see robot.jobs.report.

    Attributes:
        state: "drawing" | "paused" | one of ENDS.
        reason: of the state, for people; or "".
        job: its name.
        stroke, strokes: under way, and how many there are.
        cm, cm_all: drawn so far of this time, and all of it.
        left_s: time left, s.
        repeat, repeats: which time it is drawn, of how many.
        tip: as planned, cm; None on its way.
        volts: of the battery; None where not known.
        speed: per cent of what is planned.
        pen: how much deeper it comes down, degrees.
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
        """Share of its length that is drawn, 0 to 1."""
        return min(1.0, self.cm / self.cm_all) if self.cm_all > 0 else 0.0


def read_status(value: object) -> BrickJobStatus | None:
    """Read what the brick has told, which may be anything; None: it is no status."""
    if not isinstance(value, dict) or not isinstance(value.get("state"), str):
        return None
    told: dict[str, Any] = {}
    for field in fields(BrickJobStatus):
        one: Any = value.get(field.name)
        if field.name in ("state", "job", "reason"):
            told[field.name] = printable(one)[:200] if isinstance(one, str) else ""
        elif field.name == "tip":
            if isinstance(one, list) and len(one) in (2, 3) and all(map(_is_number, one)):
                told[field.name] = tuple(one)
        elif _is_number(one) and (field.name in SIGNED or one >= 0):
            if field.name not in COUNTS:
                told[field.name] = float(one)
            elif type(one) is int:
                told[field.name] = one
    return BrickJobStatus(**told)


def _is_number(value: Any) -> bool:
    return type(value) in (int, float) and abs(value) <= MOST


class StatusReader:
    """Takes statuses out of the lines that FOLLOW tells, as they come.

    Attributes:
        said: what the program said at its end, as far as it is kept; None while it is on.
    """

    def __init__(self) -> None:
        self.said: str | None = None

    def take(self, line: str) -> BrickJobStatus | None:
        """Return the status that a line tells; None: it tells none, or it is over."""
        if self.said is not None:
            self.said = f"{self.said}{line}\n"[-MOST_SAID:]
            return None
        try:
            value = parse_json(line)
        except InvalidFile:  # nothing new, or it was replaced while it was read
            return None
        if value.get("over") is True:
            self.said = ""
            return None
        return read_status(value)


class JobKeys:
    """What is typed while a job is drawn, as orders to it.

    Args:
        order: sends one.
        leave: ends the watching; the job goes on.
    """

    HELP = "space pauses and goes on, a aborts, + - speed, u d pen up and down, q leaves it to draw"

    def __init__(self, order: Callable[[str], None], leave: Callable[[], None]) -> None:
        self._order, self._leave = order, leave
        self.status = BrickJobStatus("drawing")
        self._wants_pause = False

    def take(self, typed: bytes) -> None:
        """Take some keys; Ctrl-C pauses, and where that was so, aborts."""
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
                speed = min(max(round(self.status.speed) + step, SLOWEST), 100)
                self._order(f"speed {speed}")
                self.status = replace(self.status, speed=speed)
            elif letter in b"ud":
                deeper = PEN_STEP if letter == b"d" else -PEN_STEP
                self._order(f"pen {self.status.pen + deeper:g}")
                self.status = replace(self.status, pen=self.status.pen + deeper)
            elif letter == b"q":
                self._leave()

    def see(self, status: BrickJobStatus) -> None:
        """Take in how the job goes."""
        self._wants_pause = status.state == "paused" or (
            self._wants_pause and self.status.state != "paused"
        )
        self.status = status


async def draw(
    brick: asyncssh.SSHClientConnection,
    address: BrickAddress,
    dialogue: Dialogue,
    job: Path,
    words: tuple[str, ...],
    show: Callable[[BrickJobStatus], None],
    detach: bool = False,
) -> int:
    """Send a job, let the brick draw it, and watch it; return its exit status.

    Args:
        brick: the connection.
        address: the brick's.
        dialogue: with who watches.
        job: its file here.
        words: options of `driver.py job`.
        show: called with every status.
        detach: it is left alone once it is started.

    Raises:
        BrickProblem: another job is on, it cannot be sent or started, or it ended badly.
    """
    if (await ask(brick, IS_ON)).status == 0:
        raise BrickProblem(
            f"{address} draws another job; watch it by brick watch, or abort it there"
        )
    await update(brick, address, dialogue)
    there = f"{JOBS}/{_file_name(job.name)}"
    await put(brick, there, job.read_bytes())
    command = " ".join([DRIVER, "job", shlex.quote(there), *map(shlex.quote, words)])
    started = await ask(
        brick, START.format(jobs=JOBS, status=STATUS, hold=HOLD, log=LOG, command=_inner(command))
    )
    if started.status or not _number(started.out):
        raise BrickProblem(f"{address} cannot start it: {started.errors.strip() or 'no answer'}")
    dialogue.say(f"{address}: sent, and started; that takes a brick some seconds")
    if detach:
        dialogue.say("it draws alone; brick watch shows how it goes")
        return 0
    return await _watch(brick, address, dialogue, _number(started.out), show)


async def watch(
    brick: asyncssh.SSHClientConnection,
    address: BrickAddress,
    dialogue: Dialogue,
    show: Callable[[BrickJobStatus], None],
) -> int:
    """Watch the job that is drawn already; return its exit status.

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


async def _driver(brick: asyncssh.SSHClientConnection, address: BrickAddress, words: str) -> str:
    done = await ask(brick, f"{DRIVER} {words}")
    if done.status:
        raise BrickProblem(f"{address}: {printable(done.errors.strip() or done.out.strip())}")
    return "\n".join(printable(line) for line in done.out.rstrip().splitlines())


def _number(text: str) -> int:
    """Return the number of a program that the brick tells; 0: it tells none."""
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
    """Show how it goes, and pass orders on, until it is over or left."""
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
        dialogue.say("left to draw alone; brick watch shows it again")
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
        """Follow it until it is over, or somebody leaves it to draw alone; return whether so.

        Args:
            process: that runs FOLLOW.
        """
        left = asyncio.Event()

        def order(line: str) -> None:
            if not process.stdin.is_closing():
                process.stdin.write(f"{line}\n".encode())

        keys = JobKeys(order, left.set)

        def take(data: bytes) -> None:
            if data != END_OF_INPUT:  # nobody types: then it is watched only
                keys.take(data)

        told = lines(process.stdout, most=None)
        with (
            platforms.keys_one_by_one(),
            reading(take),
            on_signal(signal.SIGINT, lambda: take(CTRL_C)),
        ):
            leaving = asyncio.ensure_future(left.wait())
            while True:
                coming = asyncio.ensure_future(anext(told, None))
                await asyncio.wait({coming, leaving}, return_when=asyncio.FIRST_COMPLETED)
                if left.is_set():
                    coming.cancel()
                    return True
                line = coming.result()
                if line is None or not self._hear(line, keys):
                    leaving.cancel()
                    return False

    def _hear(self, line: str, keys: JobKeys) -> bool:
        """Take in a line of FOLLOW's; return whether more is wanted."""
        status = self._reader.take(line)
        if len(self._reader.said or "") == MOST_SAID:
            return False  # no program of ours says so much at its end
        if status is not None:
            self._last = status
            keys.see(status)
            self._show(status)
        return True

    def why_not_done(self, address: BrickAddress) -> str:
        """Return why it is over and not drawn, for people; "": it is drawn."""
        last, said = self._last, self._reader.said
        if said is None:
            return f"{address} ended the watching; brick watch shows the job again"
        if last is not None and last.state in ENDS:
            if last.state == job_messages.DONE:
                return ""
            return f"{last.job}: {last.state}{': ' if last.reason else ''}{last.reason}"
        problems = [line for line in said.splitlines() if line.startswith(PROBLEM)]
        why = problems[-1][len(PROBLEM) :] if problems else "it was killed, or there was no memory"
        return f"the job has ended on {address}: {printable(why)}"
