"""A student's script on the emulated brick: what its functions answer, what the arm truly did."""

from __future__ import annotations

import contextlib
import io
import json
import re
import shutil
import sys
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from laptop.simulator import session
from laptop.simulator.device.plant_constants import read_plant
from shared.arm_description import Arm, ArmError, find_arm, read_arm

EXAMINER = Path(__file__).with_name("examiner.py")
NAME = "handout"
"""Name of the copy of a script whose functions are called."""

TIMEOUT, ANSWER_TIMEOUT = 90.0, 15.0
"""For a script to end, and for its functions to answer, s of the brick."""

Question = tuple[str, Sequence[Any]]
"""Name of a function, and its arguments."""


class CannotExamine(ArmError):
    """A file that is not there, or no script."""


@dataclass(frozen=True)
class Returned:
    """What a function returned, or in `error` what went wrong."""

    value: Any
    error: str

    def array(self, *shape: int) -> np.ndarray | None:
        """Return the value as numbers of some shape; None if it is none."""
        try:
            numbers = np.array(self.value, dtype=float)
        except (TypeError, ValueError):
            return None
        return numbers if numbers.shape == shape and np.isfinite(numbers).all() else None


@dataclass(frozen=True)
class TrialRun:
    """One run of a script.

    complaint  why it failed, in a line; "" if its exit status was 0
    t          s, n of them
    q          true joint angles, rad, n x 2
    tip        true place of the tip, cm, n x 2
    pen        whether the pen was down, n
    """

    complaint: str
    t: np.ndarray
    q: np.ndarray
    tip: np.ndarray
    pen: np.ndarray


def the_arm() -> Arm:
    """Return the arm of all handouts."""
    return read_arm(find_arm("planar"))


def run(script: Path, plant: str = "", scene: str | None = None) -> TrialRun:
    """Run a script on an emulated brick.

    Args:
        plant: constants as `simulate --plant` takes them.
        scene: as `simulate --scene` takes it; None: nobody watches.

    Raises:
        CannotExamine: there is no such file.
    """
    if not script.is_file():
        raise CannotExamine(f"{script}: there is no such file; give the path of your script")
    arm = the_arm()
    watched = None
    if scene is not None:
        from laptop.simulator.scene.watching import watching  # OpenCV is slow to import

        watched = watching(scene, arm)
    with _unseen() as complaints:
        result = session.run(
            arm, str(script), (), plant=read_plant(plant), timeout=TIMEOUT, watched=watched
        )
    rows = result.record
    complaint = ""
    if result.outcome.status:
        complaint = (
            f"it did not end within {TIMEOUT:g} s of the brick's time"
            if result.outcome.reason in ("timeout", "stuck")
            else _cause(complaints.getvalue(), script) or f"exit status {result.outcome.status}"
        )
    return TrialRun(
        complaint,
        np.array([row.t for row in rows]),
        np.array([row.q for row in rows]).reshape(len(rows), -1),
        np.array([(row.x, row.y) for row in rows]).reshape(len(rows), 2),
        np.array([row.pen for row in rows], dtype=bool),
    )


def ask(script: Path, questions: Sequence[Question]) -> list[Returned]:
    """Return what functions of a script answer, each in turn, on an emulated brick.

    Raises:
        CannotExamine: it cannot be imported, or does not come to an end.
    """
    if not script.is_file():
        raise CannotExamine(f"{script}: there is no such file; give the path of your script")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for beside in script.parent.glob("*.py"):
            shutil.copy(beside, folder)
        shutil.copy(script, folder / f"{NAME}.py")
        shutil.copy(EXAMINER, folder)
        asked, answered = folder / "questions.json", folder / "answers.json"
        asked.write_text(json.dumps(questions), encoding="utf-8")
        with _unseen() as complaints:
            result = session.run(
                the_arm(),
                str(folder / EXAMINER.name),
                (NAME, str(asked), str(answered)),
                plant=read_plant(""),
                timeout=ANSWER_TIMEOUT,
            )
        if result.outcome.reason != "ended":  # out of time, or never looking at the clock
            raise CannotExamine(
                f"{script.name}: a function did not answer within {ANSWER_TIMEOUT:g} s of the "
                "brick's time; does a loop in it ever end?"
            )
        if not answered.exists():
            why = _cause(complaints.getvalue(), folder / f"{NAME}.py") or "it ends by itself"
            raise CannotExamine(f"{script.name} cannot be imported: {why}; correct it")
        found = json.loads(answered.read_text(encoding="utf-8"))
    return [Returned(one.get("value"), one.get("error", "")) for one in found]


@contextlib.contextmanager
def _unseen() -> Iterator[io.StringIO]:
    """Keep what a script prints to itself; what it writes to stderr is given. Nobody types."""
    keyboard, sys.stdin = sys.stdin, io.StringIO()
    complaints = io.StringIO()
    try:
        with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(complaints):
            yield complaints
    finally:
        sys.stdin = keyboard


def _cause(complaints: str, script: Path) -> str:
    """Return the line of a script at which it failed, and why, from what it wrote to stderr."""
    lines = [line.strip() for line in complaints.splitlines() if line.strip()]
    if not lines:
        return ""
    places = re.findall(rf'{re.escape(script.name)}", line (\d+)', complaints)
    where = f"line {places[-1]}: " if places else ""
    return where + lines[-1].removeprefix(f"simulate: {script.name}: ")
