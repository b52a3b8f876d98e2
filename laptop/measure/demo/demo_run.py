"""`python -m laptop demo`: everything at once, on this machine alone, and whether it truly worked.

Separate processes in real time: the tracker on rendered frames, of one camera or, for an arm in
space, of two; and one after the other the unmodified programs of the brick, which reach it by TCP
on loopback.  First the driver draws its lines, then the servo brings the tip to three goals, each
from where the arm was left.  Beside it the method of the report goes to the first goal, in virtual
time.
"""

from __future__ import annotations

import os
import tempfile
import threading
import time
from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path

from rich.console import Console

from laptop.emulator import temporary_folders
from laptop.emulator.brick_home import AFTER
from laptop.emulator.bundled_scripts import DRIVER, SERVO
from laptop.emulator.live import PoseReader
from laptop.emulator.pace import PacedClock, PaceMeter
from laptop.emulator.scene.camera_rig import CameraRig
from laptop.measure.demo import results
from laptop.measure.demo.goals import GOALS, Goal, choose_goals, servo_args
from laptop.measure.demo.processes import (
    DRAWING_TIMEOUT,
    END_TIMEOUT,
    POLL_PERIOD,
    READY_TIMEOUT,
    REPORT_TIMEOUT,
    SERVO_TIMEOUT,
    ChildProcess,
    Deadline,
    DemoFailed,
    ProcessGroup,
    TooBusy,
    answers,
    ending_on_signals,
    wait_for_link,
    wait_for_page,
)
from laptop.measure.demo.progress import ProgressDisplay
from laptop.measure.demo.results import BASELINE, BASELINE_FOLDER, DRAWING, TRACKER, DemoResult
from laptop.measure.demo.truth import ink_in_space, read_trace, run_of_goal
from laptop.record.drawing_tables import PATHS
from laptop.record.figures.arm_numbers import numbers_of
from laptop.record.names import RUN, TRACE
from laptop.record.report.run_report import REPORT as PAGE
from laptop.record.report.run_report import report_of, write_report
from laptop.record.run import DamagedRun, RunFile, read_run
from laptop.record.run_folder import run_folder
from laptop.system import platforms
from shared.arm_description import Arm, find_arm, read_arm
from shared.state import ARM, STATE

REPORT_STAGE = "report"
"""Name of the last stage."""
TOLERANCE = 5.0
"""Tolerance of the servo if none is given, px."""
REPORT_BUDGET = 180.0
"""Time limit of the report's method, virtual s."""


@dataclass(frozen=True)
class DemoOptions:
    """Options of a demo.

    out    the folder for all files; None: a new one in runs
    typed  the command's words, for the record
    arm    name or file
    seed   draws camera, table and goals
    servo  the program that servoes
    page, page_host, page_port   whether the tracker serves its page, and where
    open   the page is opened in a browser
    """

    out: Path | None
    typed: tuple[str, ...] = ()
    arm: str = "planar"
    seed: int = 0
    servo: str | Path = SERVO
    page: bool = False
    page_host: str = "127.0.0.1"
    page_port: int | None = None
    open: bool = False


def run(options: DemoOptions, console: Console) -> tuple[int, Path]:
    """Show everything; the exit status, 0 if it truly worked, and the report.

    Raises:
        ArmError: one line that says what has failed; every program has ended then.
    """
    arm = read_arm(find_arm(options.arm))
    began = time.monotonic()
    progress = ProgressDisplay(
        console,
        [TRACKER, DRAWING, *(f"goal {k + 1}" for k in range(GOALS)), BASELINE, REPORT_STAGE],
    )
    with ExitStack() as stack:
        folder = stack.enter_context(run_folder("demo", options.out, *results.NAMES, PAGE))
        folder.clear()  # or an earlier demo's programs would seem to have ended
        stack.callback(temporary_folders.sweep)  # of programs that it had to kill
        temporary_folders.sweep()  # of an earlier demo that was killed
        state = stack.enter_context(temporary_folders.made("demo", tempfile.gettempdir()))
        clock = PacedClock(state)
        stack.callback(clock.close)
        # The cameras show this arm from the start, before it moves.
        out_dir = folder.path.resolve()
        processes = ProcessGroup(out_dir, {STATE: state, ARM: os.path.abspath(arm.file)})
        stack.enter_context(ending_on_signals())
        stack.callback(processes.close)
        stack.enter_context(progress.shown())
        demo = DemoRun(arm, options, out_dir, processes, progress, clock, PoseReader(state))
        stack.callback(demo.close)
        demo.run()
        progress.stages[REPORT_STAGE].begin("drawing the pictures")
        processes.close()  # the tracker leaves its picture when it ends
        found = demo.result
        found.timing["in all s"] = round(time.monotonic() - began, 1)
        record, files = results.record_of(found, out_dir)
        record.typed, record.arm = list(options.typed), numbers_of(arm)
        record.seeds = {"demo": options.seed}
        record.files.append(RunFile(PAGE))
        folder.write(record, files)
        page = write_report(out_dir, report_of(out_dir))
        shown = os.path.relpath(page)
        shown = str(page) if shown.startswith("..") else shown
        progress.finish(REPORT_STAGE, True, shown)
    console.print(results.table(found))
    console.print(results.headline(found), soft_wrap=True, highlight=False, markup=False)
    took = (
        f"{time.monotonic() - began:.0f} s, the emulated brick with cpu={found.set_up['cpu']:g}, "
        f"its clock at {found.timing['pace, to real time']:.2f} x"
    )
    first = found.timing.get("first ink after s")
    ink = "" if first is None else f", first ink after {first:.1f} s"
    console.print(f"{took}{ink}; {shown}", soft_wrap=True, highlight=False, markup=False)
    return (0 if found.worked else 1), page


@dataclass
class ProgramRun:
    """One program on the emulated brick, started once or twice.

    name     for people
    options  of `simulate`
    out_dir  for its files
    script   with its arguments
    program  the latest that was started for it
    """

    name: str
    options: Sequence[str]
    out_dir: Path
    script: Sequence[str]
    program: ChildProcess


class DemoRun:
    """The course of one demo, up to the end of the last program.

    Args:
        arm: on the emulated brick.
        options: what is to be shown.
        folder: for the raw files.
        processes: starts the programs.
        progress: reports how it goes.
        clock: of the emulated world.
        follower: sees the emulated arm.
    """

    def __init__(
        self,
        arm: Arm,
        options: DemoOptions,
        folder: Path,
        processes: ProcessGroup,
        progress: ProgressDisplay,
        clock: PacedClock,
        follower: PoseReader,
    ) -> None:
        self._arm = arm
        self._options = options
        self._folder = folder
        self._processes = processes
        self._progress = progress
        self._clock = clock
        self._pace = PaceMeter(clock)
        self._follower = follower
        self._began = time.monotonic()
        self._finished: list[ChildProcess] = []
        self._baseline: ChildProcess | None = None
        self._page: threading.Thread | None = None
        self._over = threading.Event()
        self.result = DemoResult()

    def run(self) -> None:
        """Run all of it; `result` is then whole.

        Raises:
            DemoFailed: a program failed or hangs.
        """
        stages = self._progress.stages
        stages[DRAWING].begin("starting")
        drawing = self._begin(DRAWING, ["--realtime"], "drawing", [DRIVER, "--stay"])
        stages[TRACKER].begin("choosing goals")  # which takes as long as the other's start
        self._set_scene()
        self._tracker = self._track()
        place = self._invitation()
        self._progress.finish(TRACKER, True, f"listens at {place}")
        if self._options.page:
            address = wait_for_page(self._tracker)
            self._page = threading.Thread(target=self._show_page, args=(address,), daemon=True)
            self._page.start()
        out_dir = drawing.out_dir
        part = ahead = self._start_servo(self._goals[0], out_dir, place)
        self._wait(drawing, DRAWING_TIMEOUT)
        self._handle_lines(drawing)

        for goal, following in zip(self._goals, [*self._goals[1:], None], strict=True):
            stages[goal.name].begin("starting")
            if following:
                ahead = self._start_servo(following, part.out_dir, place)
            if self._baseline is None:
                self._compare(goal, out_dir)
            self._wait(part, SERVO_TIMEOUT)
            run = run_of_goal(self._rig, goal, part.out_dir, part.program)
            self.result.runs.append(run)
            self._progress.finish(goal.name, run.reached, run.summary)
            part = ahead
        self.result.timing["pace, to real time"] = round(self._pace.mean, 3)
        self._conclude_comparison()
        for program in self._finished:
            program.wait(DRAWING_TIMEOUT)  # it may be at its picture
        if self._page:
            self._page.join()

    def _handle_lines(self, drawing: ProgramRun) -> None:
        try:
            record = read_run(drawing.out_dir)
        except DamagedRun as error:
            raise DemoFailed(f"{drawing.out_dir}: {error}; is the disk full?") from None
        if record.ending.status:
            drawing.program.wait(END_TIMEOUT)
            raise drawing.program.failure()
        self.result.set_up["cpu"] = record.set_up["cpu"]
        self.result.lines = next((one for one in record.tables if one.name == PATHS), None)
        self.result.ink = ink_in_space(self._rig, read_trace(drawing.out_dir / TRACE))
        lines = self.result.paths
        self._progress.finish(DRAWING, results.drawn(lines), results.lines_text(lines))

    def close(self) -> None:
        """Look at nothing any more."""
        self._over.set()
        self._follower.close()

    def _set_scene(self) -> None:
        """Choose cameras and goals.

        Raises:
            DemoFailed: this arm and seed have none.
        """
        text, self._goals = choose_goals(self._arm, self._options.seed)
        self._rig = CameraRig(self._arm, text)
        width, height = (int(side) for side in self._rig["A"].camera.size)
        self.result.cameras, self.result.size = "".join(self._rig), (width, height)
        cameras = " and ".join(self._rig)
        source = f"synthetic, {cameras}, {width} x {height} px, scene '{text}'"
        self.result.set_up |= {"brick": "emulated", "camera": source}

    def _track(self) -> ChildProcess:
        return self._processes.start(
            TRACKER,
            [
                "track",
                "--json",
                *["--camera", "synthetic"] * len(self._rig),
                *self._page_args(),
            ]
            + ["--scene", self._rig.text, "--listen-port", "127.0.0.1:0"]
            + ["--to", str(self._folder / "track.csv")]
            + ["--to", str(self._folder / "camera.png")],
            self._pass_on,
        )

    def _pass_on(self, line: str) -> None:
        """Report what the tracker announces of its page: another address, a new start."""
        if line.startswith(("page, ", "page: its process")):
            self._progress.report(line)

    def _invitation(self) -> str:
        """Address of the tracker; one that fails to start is started again."""
        try:
            return wait_for_link(self._tracker)[0]
        except DemoFailed as trouble:
            if self._tracker.running:
                raise
            self._report_retry(trouble)
            self._tracker = self._track()
            return wait_for_link(self._tracker)[0]

    def _report_retry(self, trouble: DemoFailed) -> None:
        self._progress.report(f"{trouble}; trying once more")

    def _page_args(self) -> list[str]:
        """Return the tracker's arguments about the page; it is to bring no brick along."""
        options = self._options
        if not options.page:
            return ["--no-page"]
        port = "" if options.page_port is None else options.page_port
        args = ["--page", "--no-simulate", "--page-port", f"{options.page_host}:{port}"]
        return args + ["--open"] * options.open

    def _show_page(self, address: str) -> None:
        """Report where the page is, as soon as it answers."""
        deadline = time.monotonic() + READY_TIMEOUT
        while not answers(address):
            if self._over.wait(POLL_PERIOD) or not self._tracker.running:
                return
            if time.monotonic() > deadline:
                self._progress.report(f"the page does not answer: {address}")
                return
        self._progress.report(f"page: {address}")

    def _begin(
        self, name: str, options: Sequence[str], folder: str, script: Sequence[str]
    ) -> ProgramRun:
        """Start a program on the emulated brick."""
        out_dir = self._folder / folder
        return ProgramRun(
            name, options, out_dir, script, self._simulate(name, options, out_dir, script)
        )

    def _start_servo(self, goal: Goal, out_dir: Path, place: str) -> ProgramRun:
        """Start a servo ahead of time; it waits for the run that leaves its files in `out_dir`."""
        folder = goal.name.replace(" ", "-")
        args = [str(self._options.servo), place, *servo_args(goal)]
        args += ["--log", f"{self._folder / folder}.jsonl"]
        return self._begin(goal.name, ["--realtime", _start(out_dir)], folder, args)

    def _simulate(
        self, name: str, options: Sequence[str], out_dir: Path, script: Sequence[str]
    ) -> ChildProcess:
        args = [
            "simulate",
            *options,
            "--arm",
            os.path.abspath(self._arm.file),
            "--out",
            str(out_dir),
        ]
        return self._processes.start(name, [*args, *script], self._progress.stages[name].report)

    def _compare(self, goal: Goal, start: Path) -> None:
        """Start the report's method on its way to a goal, from where another run has ended."""
        self._progress.stages[BASELINE].begin("starting")
        out_dir = self._folder / BASELINE_FOLDER
        self._baseline = self._simulate(
            BASELINE,
            ["--scene", self._rig.text + BASELINE_SCENE, _start(start)],
            out_dir,
            [str(self._options.servo), *servo_args(goal), "--method", "report"]
            + ["--budget", f"{REPORT_BUDGET:g}", "--log", f"{out_dir}.jsonl"],
        )
        # What runs in real time goes first.
        platforms.lower_priority(BASELINE_NICENESS, self._baseline.pid)

    def _conclude_comparison(self) -> None:
        """Take its outcome once; whatever becomes of it does no harm to the demo."""
        if self._baseline is None or self._progress.stages[BASELINE].took is not None:
            return
        out_dir = self._folder / BASELINE_FOLDER
        deadline = time.monotonic() + REPORT_TIMEOUT
        while self._baseline.running and time.monotonic() < deadline:
            time.sleep(POLL_PERIOD)
        try:
            self._baseline.interrupt()
            self._baseline.wait(END_TIMEOUT)
            run = run_of_goal(self._rig, self._goals[0], out_dir, self._baseline)
            self.result.baseline = run
            self._progress.finish(BASELINE, run.reached, run.summary)
        except (DemoFailed, DamagedRun) as trouble:
            self.result.trouble = str(trouble)
            self._progress.finish(BASELINE, False, str(trouble))

    def _wait(self, part: ProgramRun, limit: float) -> None:
        """Wait until a run's figures are there; its picture may take longer.

        A run that ends without any has failed to start, and is started once more.

        Raises:
            DemoFailed: it takes longer than `limit` s, or failed twice, or the tracker has ended.
        """
        deadline = Deadline(self._clock, limit)
        again = False
        while not (part.out_dir / RUN).exists():
            if not self._tracker.running:
                self._tracker.wait(END_TIMEOUT)
                raise self._tracker.failure()
            if not part.program.running and not (part.out_dir / RUN).exists():
                part.program.wait(END_TIMEOUT)
                trouble = part.program.failure()
                if again or isinstance(trouble, TooBusy):
                    raise trouble
                again = True
                self._report_retry(trouble)
                part.program = self._simulate(part.name, part.options, part.out_dir, part.script)
            if deadline.passed:
                raise part.program.hangs(limit)
            self._sample()
            time.sleep(POLL_PERIOD)
        self._sample()  # at what came in last, too, or was there at once
        self._finished.append(part.program)

    def _sample(self) -> None:
        """Sample the emulated clock's pace, the arm's ink and the comparison."""
        self._progress.add_pace(self._pace.sample())
        if "first ink after s" not in self.result.timing:
            self._follower.poll()
            if self._follower.pen:
                self.result.timing["first ink after s"] = round(time.monotonic() - self._began, 2)
        if self._baseline and not self._baseline.running:
            self._conclude_comparison()


def _start(out_dir: Path) -> str:
    """Return the option by which a run starts where another ends."""
    return f"--start={AFTER}{out_dir}"


BASELINE_SCENE, BASELINE_NICENESS = ",fps=10", 10
"""The report takes 20 pictures in 2 s: no more would be looked at."""
