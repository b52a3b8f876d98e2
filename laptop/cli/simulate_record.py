"""What `simulate` records of a run, leaves of it, and says of it."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

from laptop.emulator import measured_brick
from laptop.emulator.device.sensor_orders import read_sensors
from laptop.emulator.device.sensor_scene import LINE, line_points
from laptop.emulator.pace import BUSY
from laptop.emulator.rig import SimulationResult
from laptop.record.figures.private_paths import without_folders
from laptop.record.names import TRACE
from laptop.record.run import Ending, Run
from laptop.record.run_folder import FROM_THE_SIDE, PICTURE
from shared.arm_description import Arm

if TYPE_CHECKING:
    from laptop.record.figures import line_accuracy


def log_of(args: tuple[str, ...]) -> Path | None:
    """Return where a script was told to write the servo's log; None: it was not."""
    words = [(word, following) for word, following in pairwise((*args, ""))]
    named = [following for word, following in words if word == "--log"]
    named += [word.removeprefix("--log=") for word in args if word.startswith("--log=")]
    return Path(named[-1]) if named else None


def files_of(
    title: str,
    arm: Arm | None,
    run: SimulationResult,
    wanted: list,
    measures: list[line_accuracy.Measure | None],
    sensors: tuple[str, ...],
    pictured: bool,
) -> dict[str, tuple[Callable[[str], None], str]]:
    """Return what writes each file, and what it holds."""
    from laptop.record.figures import line_accuracy

    def draw_robot(file: str) -> None:
        from laptop.record.figures import robot_plot

        seen = any(LINE in order.quantities.values() for order in read_sensors(sensors).values())
        robot_plot.write_robot_plot(file, run.record, title, line_points() if seen else ())

    def draw(file: str, axes: str = "xy") -> None:
        from laptop.record.figures import line_plot as picture  # matplotlib is slow to import

        assert arm is not None
        assert run.reach is not None
        notes = f"{arm.name} arm, true tip of the emulated arm"
        picture.write_line_plot(
            file, run.record, wanted, measures, run.skeleton, run.reach, title, notes, axes
        )

    def record(file: str) -> None:
        line_accuracy.write_trace(file, run.record, run.names)

    files: dict[str, tuple[Callable[[str], None], str]] = {
        TRACE: (record, "t, joint angles (rad), place of the tip (cm), pen")
    }
    if pictured and arm:
        files[PICTURE] = (draw, LINES_CAPTION if wanted else RUN_CAPTION)
    elif pictured:
        files[PICTURE] = (draw_robot, WAY_CAPTION)
    if pictured and run.record and run.record[0].z is not None:
        files[FROM_THE_SIDE] = (partial(draw, axes="xz"), "The same from the side.")
    return files


LINES_CAPTION = (
    "Left: ink and arm as they truly are on the emulated brick, and the wanted path. Right: how "
    "far the ink is off the wanted path, magnified, and the joint angles in time."
)
RUN_CAPTION = "The run, as it truly was."
WAY_CAPTION = "The true way of the emulated robot."


def ending_of(run: SimulationResult, refused: bool, late: list[str]) -> Ending:
    """Return how a run ended.

    Args:
        run: it.
        refused: it failed before any motor was asked to turn.
        late: what was ordered and has not come.
    """
    outcome = run.outcome
    return Ending(
        outcome.status,
        outcome.reason,
        round(outcome.t, 6),
        {
            "start_s": outcome.start and round(outcome.start, 3),
            "pace": run.pace and round(run.pace, 3),
            "accesses": outcome.accesses,
            "motors": run.motors,
            "refused": refused,
            "never_came": late,
        },
    )


def camera_of(scene: str | None) -> dict[str, str]:
    """Return the camera by the name that a report has for it; {} if there was none."""
    if scene is None:
        return {}
    return {"camera": f"synthetic, {f'scene {scene}' if scene else 'the usual scene'}"}


def set_up_of(
    constants_file: str | None, measured: Any, sensors: tuple[str, ...], scene: str | None
) -> dict[str, Any]:
    """Return what there was besides the plant by the names that a report has for it."""
    found: dict[str, Any] = {}
    if constants_file:
        found["constants"] = without_folders(constants_file)
        found["measured"] = measured_brick.in_words(measured)
    found |= camera_of(scene)
    if sensors:
        found["sensors"] = list(map(without_folders, sensors))
    return found


def in_words(told: Run, run: SimulationResult, arm: Arm | None) -> str:
    """Return a short summary for people; in virtual time nothing of this computer is in it."""
    from laptop.record.drawing_tables import PATHS

    more, pace = told.ending.more, run.pace
    speed = "" if pace is None else f"; {pace:.2f} x real time"
    brick = f"cpu={told.set_up['cpu']:g}"
    if more["start_s"] is not None:
        brick += f", whose start takes another {more['start_s']:.1f} s"
    lines = [
        f"{told.ending.reason}, status {told.ending.status}, after {run.outcome.t:.2f} s on the "
        f"emulated brick ({brick}; {more['accesses']} accesses{speed})"
    ]
    if pace is not None and pace < BUSY:
        lines.append("this computer was busy, so the emulated clock went slower than real time")
    paths = told.rows(PATHS)
    for number, path in enumerate(paths, 1):
        lines.append(
            f"path {number}: not drawn"
            if path["length cm"] is None
            else f"path {number}: {path['length cm']:.1f} cm in {path['time s']:.1f} s, off by "
            f"{path['greatest mm']:.2f} mm at most and {path['rms mm']:.2f} mm rms, "
            f"{path['end off mm']:.2f} mm at its end"
        )
    if arm and len(run.wanted) > len(paths):
        lines.append(
            "the arm has no pen motor: all of its motion is ink, the paths are not measured"
        )
    driven = [port for port, motor in run.motors.items() if motor["driven"]]
    modes = ", ".join(f"{port} {motor['mode']}" for port, motor in run.motors.items())
    modes = modes or "none is plugged in; --plug A=large plugs one in"
    lines.append(f"STILL DRIVEN: {', '.join(driven)} ({modes})" if driven else f"motors: {modes}")
    return "\n".join(lines)
