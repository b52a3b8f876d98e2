"""Pose stream of an arm that runs in real time, for cameras in other processes.

Each `simulate --realtime` writes a file of its own in the folder `live` of the state folder
($BRICKSERVO_STATE or ~/.brickservo), `1.txt`, `2.txt`, ...:
a header in JSON, then a line `t q1 q2 ... pen` (s of the world, rad, 0 or 1) per 5 ms in which
something moved, and at least two a second.  It is append-only, so that a camera that starts late
gets all the ink; the ink of earlier runs stays on the paper.  The writer holds a lock on the file,
by which readers know that it is alive.  Of two runs cameras see the one that drove its motors last,
which has the higher number.  A run that drives no motor, or may not, has no file.

No file is renamed, and one that cannot be removed is left: Windows allows neither for open files.
"""

import bisect
import contextlib
import json
import math
import os
import re
import sys
from typing import IO, List, NamedTuple, Optional, Sequence, Tuple

from laptop.system import platforms
from robot.motion import kinematics
from shared.arm_description import ArmError, read_arm
from shared.config_files import InvalidFile, number, open_file, parse_json
from shared.state import LIVE_FOLDER, laptop_program, state_folder

MYPY = False
if MYPY:
    from typing import Any, Dict, Protocol, TypedDict  # noqa: F401

    from shared.arm_description import Arm  # noqa: F401

    Segment = Tuple[float, float, float, float]  # x0, y0, x1, y1, cm
    # Of a run's file: path of the arm's file, the process, and the world's zero on its clock, s.
    Header = TypedDict("Header", {"arm": str, "pid": int, "script": str, "zero": float})

    class PoseSample(Protocol):
        """Pose of an arm at one time."""

        @property
        def t(self) -> float:
            """Virtual time, s."""

        @property
        def q(self) -> Tuple[float, ...]:
            """Joint angles, rad."""

        @property
        def pen(self) -> int:
            """Return 1 if it is down."""

    class MovingBrick(Protocol):
        """An emulated brick in a world in real time."""

        @property
        def world(self) -> Any:
            """World, whose clock it uses."""

        @property
        def arm(self) -> Optional[Arm]:
            """Arm that it moves; None without one."""

        @property
        def record(self) -> Sequence[PoseSample]:
            """Poses so far."""

        def driven(self) -> Sequence[str]:
            """Return the ports of the motors that a command is turning."""


VERSION = 1
SAMPLE_PERIOD = 0.005
"""Period of the lines while the arm moves, s."""
HEARTBEAT_PERIOD = 0.5
"""Period of the lines while it rests, s."""

MIN_MOTION = 1e-6
"""Least motion of a joint that is written, rad."""
MAX_INK_HEIGHT = 0.5
"""Greatest height of the tip of an arm in space at which it leaves ink, cm above the table."""
MIN_INK_LENGTH = 0.02
"""Least length of a segment of ink, cm."""
HISTORY_LENGTH = 30.0
"""Time for which the poses of a run in another process are stored, s; its ink stays."""

NO_RUN = (
    "no emulated arm is running in real time, so it is shown at home; "
    "start one: {} simulate --realtime SCRIPT".format(laptop_program())
)

Pose = NamedTuple(
    "Pose",
    [
        ("arm", "Arm"),
        ("q", Tuple[float, ...]),
        ("ink", List[Tuple[float, float, float, float]]),
    ],
)
"""Arm, joint angles (rad), segments (x0, y0, x1, y1) in cm drawn so far."""


class History(object):
    """History of an arm's poses, and the ink it left.

    Args:
        arm: Arm.
        window: poses older than this (s, before the newest) are forgotten; None: none is.
        ink: what is on the paper from the beginning, segments as in Pose.
    """

    def __init__(
        self, arm: "Arm", window: Optional[float] = None, ink: Sequence["Segment"] = ()
    ) -> None:
        self.arm = arm
        self._window = window
        self._times = []  # type: List[float]
        self._poses = []  # type: List[Tuple[float, ...]]
        self._ink = list(ink)
        self._ink_times = [-math.inf] * len(self._ink)
        self._pen_at = None  # type: Optional[Tuple[float, float]]

    @property
    def newest(self) -> Optional[float]:
        """Time of the newest pose, s; None before the first."""
        return self._times[-1] if self._times else None

    @property
    def ink(self) -> List["Segment"]:
        """Segments of all ink on the paper, as in Pose."""
        return self._ink

    def append(self, t: float, q: Sequence[float], pen: float) -> None:
        """Append the pose at t (s), which is not before the newest."""
        self._times.append(t)
        self._poses.append(tuple(q))
        if self._window is not None and self._times[0] < t - 2 * self._window:
            old = bisect.bisect_left(self._times, t - self._window)
            del self._times[:old]
            del self._poses[:old]
        x, y, *height = kinematics.forward(self.arm, q)
        if not pen or (height and height[0] > MAX_INK_HEIGHT):
            self._pen_at = None
            return
        p = x, y
        before = self._pen_at
        if before is None:
            self._pen_at = p
        elif math.hypot(p[0] - before[0], p[1] - before[1]) >= MIN_INK_LENGTH:
            self._ink.append(before + p)
            self._ink_times.append(t)
            self._pen_at = p

    def at(self, t: float) -> Optional[Pose]:
        """Return the Pose at t (s), interpolated linearly; outside the known ones the nearest.

        None before anything is known.
        """
        times = self._times
        if not times:
            return None
        after = bisect.bisect_right(times, t)
        if after in (0, len(times)):
            q = self._poses[min(after, len(times) - 1)]
        else:
            share = (t - times[after - 1]) / (times[after] - times[after - 1])
            pair = zip(self._poses[after - 1], self._poses[after])
            q = tuple(a + share * (b - a) for a, b in pair)
        return Pose(self.arm, q, self._ink[: bisect.bisect_right(self._ink_times, t)])


def run_files(folder: str) -> List[str]:
    """Return the paths of the runs' files in a folder, which need not exist, the newest first."""
    try:
        names = os.listdir(folder)
    except (FileNotFoundError, NotADirectoryError):
        return []
    numbers = [int(name[:-4]) for name in names if re.match(r"[0-9]{1,9}\.txt$", name)]
    return [_path(folder, number) for number in sorted(numbers, reverse=True)]


def _path(folder: str, number: int) -> str:
    return os.path.join(folder, "{}.txt".format(number))


class PoseWriter(object):
    """Writer of the file that cameras follow; one of the world's bodies, behind the brick.

    A full disk or a folder that cannot be written costs the live picture, never the run.

    Args:
        brick: EmulatedBrick in a world in real time.
        script: its name, for people.
        folder: None takes the state folder.

    Attributes:
        path: of the file, None before there is one.
    """

    def __init__(self, brick: "MovingBrick", script: str, folder: Optional[str] = None) -> None:
        self.path = None  # type: Optional[str]
        self._folder = os.path.join(folder or state_folder(), LIVE_FOLDER)
        self._brick = brick
        self._script = script
        self._file = None  # type: Optional[IO[bytes]]
        self._over = False
        self._written = 0
        self._last = None  # type: Optional[PoseSample]
        self._skipped = None  # type: Optional[PoseSample]
        self._next_check = -math.inf

    def advance(self, t: float) -> None:
        """Write the new samples of the brick's record up to world time t, s."""
        if self._over:
            return
        try:
            file = self._file
            if file is None:
                if not self._is_to_publish(t):
                    return
                file = self._open()
            lines = self._new_lines()
            if lines:
                file.write("".join(lines).encode("ascii"))
        except OSError as error:
            sys.stderr.write(
                "simulate: cameras no longer see this arm: {}: {}\n".format(
                    self.path or self._folder, error.strerror
                )
            )
            self._drop()

    def close(self) -> None:
        """End the file: cameras that follow it see its end, later ones find no file."""
        self._drop()

    def _is_to_publish(self, t: float) -> bool:
        """Return True if it drives a motor, or the cameras see no other live run."""
        if self._brick.driven():
            return True
        if t < self._next_check:
            return False
        self._next_check = t + HEARTBEAT_PERIOD
        return not any(map(_is_alive, run_files(self._folder)))

    def _open(self) -> IO[bytes]:
        """Begin the file; return it."""
        world, arm = self._brick.world, self._brick.arm
        assert arm is not None, "cameras see arms"
        header = {
            "arm": os.path.abspath(arm.file),
            "pid": os.getpid(),
            "script": self._script,
            "version": VERSION,
            "zero": world.zero,
        }
        os.makedirs(self._folder, mode=0o700, exist_ok=True)
        left = run_files(self._folder)
        file = self._take_number(left)
        file.write(json.dumps(header, sort_keys=True).encode("ascii") + b"\n")
        for path in left:
            _sweep(path)
        return file

    def _take_number(self, others: Sequence[str]) -> IO[bytes]:
        """Create a file with a higher number than these, lock it, and return it."""
        newest = os.path.basename(others[0]) if others else "0.txt"
        number = int(newest[:-4])
        while True:
            number += 1
            path = _path(self._folder, number)
            try:
                file = open(path, "xb", buffering=0)  # noqa: SIM115 (it stays open, and locked)
            except FileExistsError:
                continue
            # Another run may be sweeping just now, and take it for one that nobody has locked.
            if platforms.lock(file.fileno()) and platforms.is_named(file.fileno(), path):
                self.path, self._file = path, file
                return file
            file.close()

    def _new_lines(self) -> List[str]:
        """Return a line per SAMPLE_PERIOD of motion, with its start; else a heartbeat."""
        lines = []
        record = self._brick.record
        for sample in record[self._written :]:
            last = self._last
            if last is not None and sample.t - last.t < SAMPLE_PERIOD - 1e-9:
                continue
            moved = _has_moved(last, sample)
            if moved or last is None or sample.t - last.t >= HEARTBEAT_PERIOD:
                if moved and self._skipped is not None:
                    lines.append(_line(self._skipped))
                lines.append(_line(sample))
                self._last, self._skipped = sample, None
            else:
                self._skipped = sample
        self._written = len(record)
        return lines

    def _drop(self) -> None:
        """Unlock the file, which makes it invalid, and remove it."""
        self._over = True
        file, self._file = self._file, None
        if file is not None and self.path is not None:
            platforms.remove_open(self.path, file.close)


def _has_moved(last: "Optional[PoseSample]", now: "PoseSample") -> bool:
    if last is None or now.pen != last.pen:
        return True
    return any(abs(a - b) > MIN_MOTION for a, b in zip(now.q, last.q))


def _sweep(path: str) -> None:
    """Remove the file of a run that was killed, if it can be."""
    with contextlib.suppress(OSError, InvalidFile):
        file = open(open_file(path), "rb")  # noqa: SIM115 (closed before it can be removed)
        if platforms.lock(file.fileno()):
            platforms.remove_open(path, file.close)
        else:
            file.close()


def _is_alive(path: str) -> bool:
    """Return True if the file is that of a live run."""
    try:
        with open(open_file(path), "rb") as file:
            return platforms.is_locked(file.fileno())
    except (FileNotFoundError, InvalidFile):
        return False


def _line(sample: "PoseSample") -> str:
    angles = " ".join("{:.7f}".format(angle) for angle in sample.q)
    return "{:.4f} {} {:d}\n".format(sample.t, angles, sample.pen)


class PoseReader(object):
    """Reader of the poses in another process, while they are written.

    Args:
        folder: None takes the state folder.

    Attributes:
        header: dict of the run that is followed or was last, None before any.
        alive: whether it still runs.
        pen: whether its pen has been down.
        refused: why a file that is there is not followed, "" if there is nothing to say.
    """

    def __init__(self, folder: Optional[str] = None) -> None:
        self._folder = os.path.join(folder or state_folder(), LIVE_FOLDER)
        self.header = None  # type: Optional[Header]
        self.alive = False
        self.pen = False
        self.refused = ""
        self._file = None  # type: Optional[IO[bytes]]
        self._rest = b""
        # By path: which file had that name then.
        self._refused = {}  # type: Dict[str, Tuple[int, int, float, int]]
        self._history = None  # type: Optional[History]

    @property
    def newest(self) -> Optional[float]:
        """Time of the newest pose, s on the world's clock (pace); None before any."""
        if self._history is None or self.header is None or self._history.newest is None:
            return None
        return self._history.newest + self.header["zero"]

    def poll(self) -> None:
        """Read new lines; switch to a newer run if there is one."""
        self._switch()
        history = self._history
        if self._file is None or history is None or not self.alive:
            return
        # Whether it was locked is asked before reading: all it wrote is then there to be read.
        locked = platforms.is_locked(self._file.fileno())
        *lines, self._rest = (self._rest + self._file.read()).split(b"\n")
        for line in lines:
            self._handle(line, history)
        self.alive = locked

    def at(self, t: float) -> Optional[Pose]:
        """Return the Pose at t (s, world's clock, see pace), or the newest; None before any run."""
        if self._history is None or self.header is None:
            return None
        return self._history.at(t - self.header["zero"])

    def close(self) -> None:
        """Stop following."""
        if self._file is not None:
            self._file.close()
            self._file = None

    def _switch(self) -> None:
        """Follow the newest live run, unless it is followed already."""
        for path in run_files(self._folder):
            try:
                if self._file is not None and platforms.is_named(self._file.fileno(), path):
                    return
                found = os.stat(path)
                # A file that was refused stays so; its name may come back with another one.
                identity = found.st_dev, found.st_ino, found.st_mtime, found.st_size
                if self._refused.get(path) == identity:
                    continue
                self._refused[path] = identity
                if self._follow(path):
                    return
            except FileNotFoundError:
                continue
            except InvalidFile as error:
                self.refused = "{} is not followed: {}".format(path, error)
            except OSError as error:
                self.refused = "{}: {}".format(path, error.strerror)

    def _follow(self, path: str) -> bool:
        """Follow this file and return True if it is that of a live run and has a header."""
        file = open(open_file(path), "rb", buffering=0)  # noqa: SIM115 (read on and on)
        try:
            begun = _start(file)
        except (ValueError, KeyError, TypeError, ArmError, OSError) as error:
            file.close()
            self.refused = "{} is not followed: {}".format(path, error)
            return False
        if begun is None:
            file.close()
            del self._refused[path]
            return False
        header, arm, rest = begun
        self.close()
        self.refused = ""
        # Nobody changes the paper between two runs of one arm.
        paper = self._history.ink if self._history and self._history.arm == arm else ()
        self.header, self._file, self.alive = header, file, True
        self._history = History(arm, HISTORY_LENGTH, paper)
        self._rest = rest
        return True

    def _handle(self, line: bytes, history: History) -> None:
        """Add the pose of a line; an invalid one is skipped."""
        try:
            t, *q, pen = (float(word) for word in line.split())
        except ValueError:
            return
        newest = history.newest
        if len(q) != len(history.arm.joints) or not all(map(math.isfinite, [t, pen] + q)):
            return
        if newest is None or t > newest:
            history.append(t, q, pen)
            self.pen = self.pen or bool(pen)


def _start(file: IO[bytes]) -> Optional[Tuple["Header", "Arm", bytes]]:
    """Read the head of a file: header (dict), Arm, the bytes after it.

    Returns:
        None if its run has not written all of the header yet.

    Raises:
        ValueError, KeyError, TypeError, ArmError, OSError: it is not of a run that lives.
    """
    locked = platforms.is_locked(file.fileno())
    line, written, rest = file.read().partition(b"\n")
    if not line:  # it may be about to be locked
        return None
    if not locked:
        raise ValueError("its program is gone")
    if not written:
        return None
    values = parse_json(line.decode("utf-8"))
    if values["version"] != VERSION:
        raise ValueError("it is of version {}, not {}".format(values["version"], VERSION))
    header = {
        "arm": str(values["arm"]),
        "pid": int(number(values["pid"])),
        "script": str(values["script"]),
        "zero": number(values["zero"]),
    }  # type: Header
    return header, read_arm(header["arm"]), rest
