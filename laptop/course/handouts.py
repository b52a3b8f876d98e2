"""The class's handouts: each a page, a skeleton, a solution and a check."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from laptop.course import criteria
from laptop.course.criteria import CheckPoint
from laptop.course.examination import CannotExamine
from laptop.record.figures.document import render_report
from shared.arm_description import ArmError, find_arm, read_arm
from shared.state import laptop_program

HERE = Path(__file__).parent
SOLUTIONS = "solutions"
"""Name of the folder of solutions, here and in a class's folder."""


ANSWER = re.compile(r"(?P<begin>(?:^ *# -> .*\n)+)(?P<answer>(?s:.*?))^ *# <-\n", re.MULTILINE)
"""An answer in a marked script: above it, behind "# -> ", what students begin with instead."""
SOLVED = "A solution."
PLACES = (
    "One place is yours: it bears the word TODO.",
    "Two places are yours: they bear the word TODO.",
    "Three places are yours: they bear the word TODO.",
    "Four places are yours: they bear the word TODO.",
)
"""Sentences in the head of a skeleton, by its number of places; they replace SOLVED."""


class NoHandout(ArmError):
    """A file of which it is not known which handout it belongs to, or no room for handouts."""


@dataclass(frozen=True)
class Handout:
    """One of them.

    name   of its files
    title  of its page
    check  yields what is right and what is wrong with a script
    """

    name: str
    title: str
    check: Callable[[Path], Iterator[CheckPoint]]

    @property
    def script(self) -> str:
        """Name of the file that students write in."""
        return f"{self.name}.py"

    @property
    def source(self) -> Path:
        """The marked script that both are made of; it passes its check, too."""
        return HERE / SOLUTIONS / self.script

    @property
    def skeleton(self) -> str:
        """Text of the script as students get it; it fails its check."""
        text = ANSWER.sub(lambda found: found["begin"].replace("# -> ", ""), self._marked())
        return text.replace(SOLVED, PLACES[text.count("TODO") - 1])

    @property
    def solution(self) -> str:
        """Text of a script that passes."""
        return ANSWER.sub(lambda found: found["answer"], self._marked())

    def _marked(self) -> str:
        return self.source.read_text(encoding="utf-8")

    def findings(self, file: Path) -> Iterator[CheckPoint]:
        """Yield what is right and what is wrong with a script, also one that cannot be tried."""
        try:
            yield from self.check(file)
        except CannotExamine as problem:
            yield CheckPoint(False, str(problem))

    def page(self, folder: Path = Path()) -> str:
        """Return the page as the text of an HTML file.

        Args:
            folder: where the script lies, as seen from where commands are typed.
        """
        from laptop.record.figures.formulas import formula, matrix  # matplotlib is slow to import

        program = laptop_program()
        # By its name alone it can be typed in any folder.
        typed = Path() if program == "brickservo" else folder
        return render_report(
            HERE / "templates" / f"{self.name}.html",
            title=self.title,
            kind="BrickServo: a handout",
            script=self.script,
            typed=(typed / self.script).as_posix(),
            program=program,
            formula=formula,
            matrix=matrix,
            **_figures(self.name),
        )


HANDOUTS = (
    Handout("kinematics", "1. From a point to the joints' angles", criteria.check_kinematics),
    Handout("pid", "2. A controller for one joint", criteria.check_pid),
    Handout("line", "3. A straight line", criteria.check_line),
    Handout("servoing", "4. The camera guides the arm", criteria.check_servoing),
)
BASINS_GOAL = (9, 8)
"""Goal in the picture of basins, cm."""


def handout_of(file: Path) -> Handout:
    """Return the handout that a script belongs to: its name begins with the handout's.

    Raises:
        NoHandout: it begins with none.
    """
    for handout in HANDOUTS:
        if file.stem.startswith(handout.name):
            return handout
    raise NoHandout(
        f"{file.name}: begin the file's name with that of its handout: "
        f"{', '.join(handout.script for handout in HANDOUTS)}, or such as "
        f"{HANDOUTS[0].name}_anna.py"
    )


def write_handouts(folder: Path, solutions: bool = False) -> list[Path]:
    """Put pages and skeletons into a folder; no file that is there is touched.

    Args:
        folder: where they go; made if need be.
        solutions: whether the solutions are written, too, in a folder of their own.

    Returns:
        The new files.

    Raises:
        NoHandout: some file is there already, or there is no room.
    """
    scripts = {folder / handout.script: handout.skeleton for handout in HANDOUTS}
    if solutions:
        scripts |= {folder / SOLUTIONS / handout.script: handout.solution for handout in HANDOUTS}
    pages = {folder / f"{handout.name}.html": handout for handout in HANDOUTS}
    for file in (*scripts, *pages):
        if file.exists():
            raise NoHandout(f"{file} is there already; remove it, or choose another folder")
    try:
        for file, text in scripts.items():
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_text(text, encoding="utf-8", newline="\n")
        for file, handout in pages.items():
            file.write_text(handout.page(folder), encoding="utf-8")
    except OSError as error:
        raise NoHandout(
            f"cannot write to {folder}: {error.strerror}; make room or choose another folder"
        ) from None
    return [*pages, *scripts]


def _figures(name: str) -> dict[str, Any]:
    """Return the figures and pictures of a handout's page."""
    arm = read_arm(find_arm("planar"))
    if name == "kinematics":
        from laptop.course.basins import draw_basins
        from laptop.record.figures.document import data_url

        picture = data_url(draw_basins(arm, BASINS_GOAL))
        links = [joint.link for joint in arm.joints]
        return {"links": links, "goal": BASINS_GOAL, "basins": picture}
    if name == "pid":
        return {
            "rise": criteria.RISE_TIME,
            "overshoot": f"{criteria.OVERSHOOT:g}",
            "tolerance": f"{criteria.TARGET_TOLERANCE:g}",
        }
    if name == "line":
        return {"line": criteria.LINE, "tolerance": f"{10 * criteria.LINE_TOLERANCE:g}"}
    return {"tolerance": f"{criteria.SIGHT_TOLERANCE:g}"}
