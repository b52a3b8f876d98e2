"""Additions to `simulate`'s record where the script was a servo that kept a log."""

from __future__ import annotations

import shutil
from collections.abc import Mapping
from pathlib import Path

from laptop.emulator.host.clocks import UPTIME
from laptop.emulator.scene.camera_rig import CameraRig
from laptop.emulator.scene.servo_truth import truth_of
from laptop.emulator.simulation_result import SimulationResult
from laptop.record.run import SERVO, DamagedRun, Run
from laptop.record.servo.figures import Scenery
from laptop.record.servo.servo_files import Files, add_servo
from laptop.record.servo.servo_log import Log, is_log, read_log
from laptop.record.servo.servo_run import MALFORMED, NO_LOG, Truth, run_of_log
from shared.arm_description import Arm

LOG_WORDS = "what the servo saw, decided and did"


def servo_files(
    recorded: Run,
    file: Path,
    run: SimulationResult,
    built: Arm | None,
    scene: str | None,
    drawn: bool,
) -> Files:
    """Add what a log tells, and, with a scene, what truly became of it; return what writes files.

    Args:
        recorded: record of the run.
        file: the log.
        run: the run on the emulated brick.
        built: the arm as it is.
        scene: that was watched, as text; None: the emulated brick knows of no cameras.
        drawn: with figures.
    """
    if not is_log(file):
        return {}
    files: Files = {f"{file.stem}.jsonl": (lambda path: _copy(file, path), LOG_WORDS)}
    try:
        log = read_log(file)
        rig = CameraRig(built, scene) if built and scene is not None else None
        truth = _truth(rig, log, run) if rig and log.verdict and log.steps else None
        servo = run_of_log("goal", log, truth)
    except (DamagedRun, *MALFORMED) as error:
        why = str(error) if isinstance(error, DamagedRun) else NO_LOG
        recorded.notes = [*recorded.notes, f"{file.name}: {why}"]
        return files
    recorded.kind = SERVO
    if log.verdict is None:
        recorded.notes = [*recorded.notes, "the log ends without a verdict: the run was cut off"]
    recorded.set_up["servo"] = f"mode {servo.mode}, tolerance {servo.tolerance:g} px"
    size = rig["A"].camera.size if rig else None
    scenery = Scenery(size=size and (int(size[0]), int(size[1])))
    return files | add_servo(recorded, [servo], scenery, drawn=drawn)


def _truth(rig: CameraRig, log: Log, run: SimulationResult) -> Truth:
    """Return what truly became of it; the goal is where it was given, or where its marker is."""
    goal = log.run.get("goal")
    wanted: tuple[float, ...] | None = None
    if isinstance(goal, Mapping) and set(goal) == set(rig):
        wanted = tuple(float(x) for camera in rig for x in goal[camera])
    elif not isinstance(goal, Mapping) and "goal" in rig["A"].centres(run.record[-1].q):
        wanted = rig.truth(run.record[-1].q, "goal")
    began = log.run["clock"] - UPTIME - (run.outcome.start or 0.0)
    return truth_of(rig, run.record, log, began, wanted)


def _copy(file: Path, path: str) -> None:
    shutil.copyfile(file, path)
