"""Record of a run of `simulate`: its data, its files, its text."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, partial
from typing import Any

from laptop.cli.simulate_options import BrickOptions, BrickSetup
from laptop.emulator import measured_brick
from laptop.emulator.device.sensor_environment import LINE, line_points
from laptop.emulator.pace import BUSY_PACE
from laptop.emulator.simulation_result import SimulationResult
from laptop.record.drawing_tables import PATHS, paths_table
from laptop.record.figures import line_accuracy
from laptop.record.figures.arm_numbers import numbers_of
from laptop.record.figures.private_paths import without_folders
from laptop.record.names import TRACE
from laptop.record.run import DRAWING, SCRIPT, Ending, Run
from laptop.record.run_folder import MIN_KILLED_STATUS, PICTURE, SIDE_PICTURE

LINES_CAPTION = (
    "Left: ink and arm as they truly are on the emulated brick, and the wanted path. Right: how "
    "far the ink is off the wanted path, magnified, and the joint angles in time."
)
RUN_CAPTION = "The run, as it truly was."
WAY_CAPTION = "The true way of the emulated robot."


def camera_of(scene: str | None) -> dict[str, str]:
    """Return the camera by the name that a report has for it; {} if there was none."""
    if scene is None:
        return {}
    return {"camera": f"synthetic, {f'scene {scene}' if scene else 'the usual scene'}"}


@dataclass(frozen=True, eq=False)
class ScriptRun:
    """A script's run on the emulated brick, for its summary and its files.

    title    the script and its words
    run      what came of it
    typed    the brick, as it was typed
    brick    the same, as it was
    scene    that a camera watched, as text; None: none did
    late     what was ordered and has not come
    """

    title: str
    run: SimulationResult
    typed: BrickOptions
    brick: BrickSetup
    scene: str | None
    late: list[str]

    @property
    def is_refused(self) -> bool:
        """Whether it failed before any motor was asked to turn."""
        return not self.run.asked and 0 < self.run.outcome.status < MIN_KILLED_STATUS

    @property
    def is_seen(self) -> bool:
        """Whether there is an arm or a robot that can be drawn."""
        return self.brick.arm is not None or self.brick.wheels is not None

    @cached_property
    def is_there_to_see(self) -> bool:
        """Whether it has moved, or was to draw something."""
        return line_accuracy.has_content(self.run.record, self.run.wanted)

    @property
    def why_no_picture(self) -> str:
        """Reason why there is no picture, for people; "" if none was requested."""
        if not self.is_seen:
            return "; without an arm and --wheels there is no picture"
        mover = "arm" if self.brick.arm else "robot"
        return (
            "" if self.is_there_to_see else f"; the {mover} has not moved, so there is no picture"
        )

    @cached_property
    def wanted(self) -> list[Any]:
        """The paths that were to be drawn.

        Without a pen motor all of the motion is ink, and none of it belongs to one path.
        """
        return self.run.wanted if self.brick.built and self.brick.built.pen else []

    @cached_property
    def measures(self) -> list[line_accuracy.Measure | None]:
        """Measures of what each of them drew."""
        return line_accuracy.measure(self.run.record, self.wanted)

    def record(self, typed: list[str]) -> Run:
        """Return the record of it.

        Args:
            typed: the command's words.

        Raises:
            ArmError: a path that was wanted is none.
        """
        arm, built, measures = self.brick.arm, self.brick.built, self.measures
        reported = Run(
            kind=DRAWING if self.wanted else SCRIPT,
            what=self.title,
            typed=typed,
            ending=self._ending(),
            arm=arm and numbers_of(arm),
            built=numbers_of(built) if built and built is not arm else None,
            tables=[paths_table(arm.name, measures)] if arm and self.wanted else [],
        )
        reported.on_emulated_brick(self.typed.plant_text, self.scene, cpu=self.brick.plant["cpu"])
        reported.set_up |= self._set_up()
        return reported

    def _ending(self) -> Ending:
        outcome, pace = self.run.outcome, self.run.pace
        return Ending(
            outcome.status,
            outcome.reason,
            round(outcome.t, 6),
            {
                "start_s": outcome.start and round(outcome.start, 3),
                "pace": pace and round(pace, 3),
                "accesses": outcome.accesses,
                "motors": self.run.motors,
                "refused": self.is_refused,
                "never_came": self.late,
            },
        )

    def _set_up(self) -> dict[str, Any]:
        """Return what there was besides the plant by the names that a report has for it."""
        found: dict[str, Any] = {}
        if self.typed.constants_file and self.brick.measured:
            found["constants"] = without_folders(self.typed.constants_file)
            found["measured"] = measured_brick.in_words(self.brick.measured)
        found |= camera_of(self.scene)
        if self.typed.sensors:
            found["sensors"] = list(map(without_folders, self.typed.sensors))
        return found

    def files(self, pictured: bool) -> dict[str, tuple[Callable[[str], None], str]]:
        """Return what writes each file, and what it holds."""
        record = self.run.record
        files: dict[str, tuple[Callable[[str], None], str]] = {
            TRACE: (self._write_trace, "t, joint angles (rad), place of the tip (cm), pen")
        }
        if pictured and self.brick.arm:
            files[PICTURE] = (self._draw, LINES_CAPTION if self.wanted else RUN_CAPTION)
        elif pictured:
            files[PICTURE] = (self._draw_robot, WAY_CAPTION)
        if pictured and record and record[0].z is not None:
            files[SIDE_PICTURE] = (partial(self._draw, axes="xz"), "The same from the side.")
        return files

    def _write_trace(self, file: str) -> None:
        line_accuracy.write_trace(file, self.run.record, self.run.names)

    def _draw(self, file: str, axes: str = "xy") -> None:
        from laptop.record.figures import line_plot as picture  # matplotlib is slow to import

        assert self.brick.arm is not None
        notes = f"{self.brick.arm.name} arm, true tip of the emulated arm"
        run = self.run
        assert run.reach is not None
        arm = picture.FinalPose(run.skeleton, run.reach)
        picture.write_line_plot(
            file, run.record, self.wanted, self.measures, arm, self.title, notes, axes
        )

    def _draw_robot(self, file: str) -> None:
        from laptop.record.figures import robot_plot

        orders = self.brick.sensors.values()
        seen = any(LINE in order.quantities.values() for order in orders)
        line = line_points() if seen else ()
        robot_plot.write_robot_plot(file, self.run.record, self.title, line)

    def summary(self, recorded: Run) -> str:
        """Return a short summary for people; in virtual time nothing of this computer is in it.

        Args:
            recorded: record of the run.
        """
        ending, end, pace = recorded.ending, self.run.outcome.t, self.run.pace
        more = ending.more
        speed = "" if pace is None else f"; {pace:.2f} x real time"
        brick = f"cpu={recorded.set_up['cpu']:g}"
        if more["start_s"] is not None:
            brick += f", whose start takes another {more['start_s']:.1f} s"
        lines = [
            f"{ending.reason}, status {ending.status}, after {end:.2f} s on the emulated "
            f"brick ({brick}; {more['accesses']} accesses{speed})"
        ]
        if pace is not None and pace < BUSY_PACE:
            lines.append("this computer was busy, so the emulated clock went slower than real time")
        paths = recorded.rows(PATHS)
        for number, path in enumerate(paths, 1):
            lines.append(
                f"path {number}: not drawn"
                if path["length cm"] is None
                else f"path {number}: {path['length cm']:.1f} cm in {path['time s']:.1f} s, off by "
                f"{path['greatest mm']:.2f} mm at most and {path['rms mm']:.2f} mm rms, "
                f"{path['end off mm']:.2f} mm at its end"
            )
        if self.brick.arm and len(self.run.wanted) > len(paths):
            lines.append(
                "the arm has no pen motor: all of its motion is ink, the paths are not measured"
            )
        driven = [port for port, motor in self.run.motors.items() if motor["driven"]]
        modes = ", ".join(f"{port} {motor['mode']}" for port, motor in self.run.motors.items())
        modes = modes or "none is plugged in; --plug A=large plugs one in"
        lines.append(
            f"STILL DRIVEN: {', '.join(driven)} ({modes})" if driven else f"motors: {modes}"
        )
        return "\n".join(lines)
