"""A student's script on the emulated brick: what its functions answer, what the arm truly did."""

from __future__ import annotations

import contextlib
import io
import itertools
import json
import linecache
import re
import shutil
import sys
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from laptop.emulator.host.runner import Outcome, in_words
from laptop.emulator.rig import Rig
from shared.arm_description import Arm, ArmError, find_arm, read_arm

EXAMINER = Path(__file__).with_name("call_functions.py")
NAME = "handout"
"""Name of the copy of a script whose functions are called."""

TIMEOUT, ANSWER_TIMEOUT = 45.0, 15.0
"""Longest run of a script, and of its functions' answers, in the brick's time, s; a good one takes
23 s."""
PATIENCE = 5.0
"""Longest computation without a look at the clock, s of this computer."""
ENDLESS = ("timeout", "stuck", "waiting", "deadlock")
"""Reasons for which a run is cut off."""

Question = tuple[str, Sequence[Any]]
"""Name of a function, and its arguments."""


class CannotExamine(ArmError):
    """A file that is not there, or no script."""


@dataclass(frozen=True)
class Returned:
    """A function's return value, or in `error` what went wrong; `endless`: it did not return."""

    value: Any
    error: str
    endless: bool = False

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
    endless    whether it was cut off
    t          s, n of them
    q          true joint angles, rad, n x 2
    tip        true place of the tip, cm, n x 2
    pen        whether the pen was down, n
    """

    complaint: str
    endless: bool
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
        script: path of the script.
        plant: constants as `simulate --plant` takes them.
        scene: as `simulate --scene` takes it; None: nobody watches.

    Raises:
        CannotExamine: there is no such file.
    """
    if not script.is_file():
        raise CannotExamine(f"{script}: there is no such file; give the path of your script")
    with _unseen() as complaints, Rig(the_arm(), plant=plant, cameras=scene) as rig:
        result = rig.run(str(script), timeout=TIMEOUT, patience=PATIENCE)
    rows, outcome = result.record, result.outcome
    complaint, endless = "", outcome.reason in ENDLESS
    if endless:
        complaint = _endless(outcome, script, TIMEOUT)
    elif outcome.status:
        complaint = _cause(complaints.getvalue(), script) or f"exit status {outcome.status}"
    return TrialRun(
        complaint,
        endless,
        np.array([row.t for row in rows]),
        np.array([row.q for row in rows]).reshape(len(rows), -1),
        np.array([(row.x, row.y) for row in rows]).reshape(len(rows), 2),
        np.array([row.pen for row in rows], dtype=bool),
    )


def ask(script: Path, questions: Sequence[Question]) -> list[Returned]:
    """Return the return values of a script's functions, each in turn, on an emulated brick.

    A function that does not come to an end is not asked again.

    Raises:
        CannotExamine: it cannot be imported.
    """
    answers: list[Returned] = []
    endless: dict[str, Returned] = {}
    while len(answers) < len(questions):
        name, _ = questions[len(answers)]
        if name in endless:
            answers.append(endless[name])
            continue
        rest = itertools.takewhile(lambda one: one[0] not in endless, questions[len(answers) :])
        answers += _answers(script, list(rest))
        if answers[-1].endless:
            endless[questions[len(answers) - 1][0]] = answers[-1]
    return answers


def _answers(script: Path, questions: Sequence[Question]) -> list[Returned]:
    """Return the functions' return values, up to the first that does not end.

    Raises:
        CannotExamine: the script cannot be imported.
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
        with _unseen() as complaints, Rig(the_arm()) as rig:
            result = rig.run(
                *(str(folder / EXAMINER.name), NAME, str(asked), str(answered)),
                timeout=ANSWER_TIMEOUT,
                patience=PATIENCE,
            )
        outcome = result.outcome
        why = _endless(outcome, folder / f"{NAME}.py", ANSWER_TIMEOUT)
        if not answered.exists():
            if outcome.reason not in ENDLESS:
                why = _cause(complaints.getvalue(), folder / f"{NAME}.py") or "it ends by itself"
            raise CannotExamine(f"{script.name} cannot be imported: {why}; correct it")
        _, *lines = answered.read_text(encoding="utf-8").splitlines()
    answers = map(json.loads, lines)
    found = [Returned(one.get("value"), one.get("error", "")) for one in answers]
    if len(found) < len(questions):
        found.append(Returned(None, why, endless=True))
    return found


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


def _endless(outcome: Outcome, script: Path, limit: float) -> str:
    """Say that a script was cut off, and what it was doing: the line, and how that begins."""
    stack = [call for call in outcome.stack if call[0] == script.name]
    when = f"after {limit:g} s of the brick's time" if outcome.reason == "timeout" else "at last"
    if not stack:
        return f"it does not end; {when} it is still not done"
    linecache.checkcache(str(script))
    line = linecache.getline(str(script), stack[0][1]).strip()
    return (
        f"it does not end; {when} it was at {in_words(stack)}: `{line:.50}`. "
        "Does the loop there ever end?"
    )


def _cause(complaints: str, script: Path) -> str:
    """Return the line of a script at which it failed, and why, from what it wrote to stderr."""
    lines = [line.strip() for line in complaints.splitlines() if line.strip()]
    if not lines:
        return ""
    places = re.findall(rf'{re.escape(script.name)}", line (\d+)', complaints)
    where = f"line {places[-1]}: " if places else ""
    return where + lines[-1].removeprefix(f"simulate: {script.name}: ")
