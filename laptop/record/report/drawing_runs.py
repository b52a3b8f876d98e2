"""Runs of `simulate` and of `draw --simulate`: paths and drawings against the ink."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from laptop.record.figures.private_paths import without_folders
from laptop.record.report.findings import DRAWING, NOT_THERE, SCRIPT, DamagedRun, LabFigure, LabRun
from laptop.record.report.findings import RawData as Raw
from laptop.record.report.lab_figures import draw_trace
from laptop.record.report.run_files import (
    decimal,
    items,
    number,
    own_files,
    read_columns,
    read_picture,
    word,
)

PATHS, DRAWINGS = "paths", "drawings"
TRACE, PICTURE, FROM_THE_SIDE = "trace.csv", "picture.png", "picture-side.png"
LEARNING = "learning.png"
NO_ARM = "none"
MAX_PATHS = 500
"""Of a run, that are shown."""
PATH_KEYS = ("length_cm", "seconds", "greatest_mm", "rms_mm", "end_mm", "missed_mm")
DRAWING_KEYS = ("ink_cm", "drawn_s", "estimated_s", "greatest_mm", "rms_mm", "missed_mm")
FULL_CAPTION = (
    "Left: ink and arm as they truly are on the emulated brick, and the wanted path. Right: how "
    "far the ink is off the wanted path, magnified, and the joint angles in time."
)
DRAWING_CAPTION = (
    "What was wished (grey), and over it the true ink of the emulated arm in colours for its "
    "distance from the wish."
)
SIDE_CAPTION = "The same from the side."
LEARNING_CAPTION = "The drawing as it was at first, and after rehearsals."


def read_simulated(name: str, folder: Path, summary: dict[str, Any]) -> LabRun:
    """Return a run of `simulate`.

    Raises:
        DamagedRun: the summary is not as it is written.
    """
    run = _begun(name, summary)
    words = [Path(word(summary, "script")).name, *items(summary, "args", str)]
    run.what = " ".join(without_folders(part) for part in words if part) or "a script"
    run.seconds = number(summary, "seconds")
    run.set_up += _emulated(summary)
    paths = items(summary, "paths", dict)
    if len(paths) > MAX_PATHS:
        run.gaps.append(f"it has {len(paths)} paths, of which the first {MAX_PATHS} are here")
        del paths[MAX_PATHS:]
    run.kind = DRAWING if paths else SCRIPT
    for k, path in enumerate(paths, 1):
        run.results.append((PATHS, (run.arm, str(k), *_values(run, path or {}, PATH_KEYS, k))))
        if path is None:
            run.gaps.append(f"path {k} was not drawn")
    seen = bool(paths)
    caption = FULL_CAPTION if seen else "The run, as it truly was."
    files = own_files(folder, summary, (TRACE, PICTURE, FROM_THE_SIDE))
    _add_pictures(run, folder, files, caption, _bears_a_path(summary))
    return run


def read_drawing(name: str, folder: Path, summary: dict[str, Any]) -> LabRun:
    """Return a run of `draw --simulate`.

    Raises:
        DamagedRun: the summary is not as it is written.
    """
    run = _begun(name, summary)
    run.kind = DRAWING
    drawn = without_folders(word(summary, "drawing")) or "a drawing"
    run.what = f"drawing {drawn}"
    run.seconds = number(summary, "drawn_s")
    run.set_up += _emulated(summary)
    inks, chains = (decimal(number(summary, key), 0) for key in ("inks", "chains"))
    run.results.append(
        (
            DRAWINGS,
            (
                run.arm,
                drawn,
                NOT_THERE if NOT_THERE in (inks, chains) else f"{inks} of {chains}",
                *_values(run, summary, DRAWING_KEYS),
            ),
        )
    )
    files = own_files(folder, summary, (TRACE, PICTURE))  # older ones may be of two drawings
    _add_pictures(run, folder, files, DRAWING_CAPTION)
    return run


def _begun(name: str, summary: dict[str, Any]) -> LabRun:
    arm = word(summary, "arm")
    run = LabRun(name, SCRIPT, "", arm="" if arm == NO_ARM else arm)
    status, reason = number(summary, "status"), without_folders(word(summary, "reason"))
    run.outcome = reason if not status else f"{reason}, status {status:.0f}"
    for attribute in ("arm_numbers", "built_numbers"):
        numbers = summary.get(attribute)
        if numbers is not None and not isinstance(numbers, dict):
            raise DamagedRun(f"summary.json: '{attribute}' is not as it is written")
        setattr(run, attribute, numbers)
    return run


def _emulated(summary: dict[str, Any]) -> list[tuple[str, str]]:
    """Return what the summary tells of brick and camera."""
    brick = "emulated"
    cpu, plant = number(summary, "cpu"), word(summary, "plant")
    if cpu is not None:
        brick += f", cpu={cpu:g}"
    if plant:
        brick += f", {plant}"
    if word(summary, "constants"):
        brick += f", constants of {without_folders(word(summary, 'constants'))}"
    found = [("brick", brick)]
    if summary.get("scene") is not None:
        scene = without_folders(word(summary, "scene"))
        words = f"scene {scene}" if scene else "the usual scene"
        found.append(("camera", f"synthetic, {words}"))
    if sensors := items(summary, "sensors", str):
        found.append(("sensors", ", ".join(map(without_folders, filter(None, sensors)))))
    return found


def _values(
    run: LabRun, values: dict[str, Any], keys: tuple[str, ...], path: int = 0
) -> tuple[str, ...]:
    """Return cells; a figure that is missing or no number is told of as a gap."""
    cells = tuple(decimal(number(values, key)) for key in keys)
    missing = [key for key, cell in zip(keys, cells, strict=True) if cell == NOT_THERE]
    if missing and values:
        where = f"path {path}: " if path else ""
        run.gaps.append(f"{where}summary.json has no value for {', '.join(missing)}")
    return cells


def _add_pictures(
    run: LabRun, folder: Path, files: Sequence[str], caption: str, private: bool = False
) -> None:
    """Add what there is to see of the run's files, and its trace."""
    trace = folder / TRACE
    columns = None
    if TRACE in files and trace.exists():
        try:
            columns = read_columns(trace)
            run.data.append(Raw(TRACE, trace, "t, joint angles (rad), place of the tip (cm), pen"))
        except DamagedRun as error:
            run.gaps.append(f"left out: {error}")
    else:
        run.gaps.append("there is no trace.csv, so no raw data of the motion")
    captions = {PICTURE: caption, FROM_THE_SIDE: SIDE_CAPTION, LEARNING: LEARNING_CAPTION}
    for file, words in captions.items():
        if file not in files:
            continue
        if private:
            run.gaps.append(f"{file} bears a folder of a computer in its title, so it is left out")
            continue
        try:
            run.figures.append(LabFigure(f"{words} ({file})", read_picture(folder / file)))
        except DamagedRun as error:
            run.gaps.append(f"left out: {error}")
    if run.figures or columns is None:
        return
    picture = draw_trace(columns)
    if picture is None:
        run.gaps.append("trace.csv holds no motion to draw")
    else:
        words = "Way of the tip, with the pen down in black, and the joint angles in time."
        run.figures.append(LabFigure(f"{words} (drawn from trace.csv)", picture))


def _bears_a_path(summary: dict[str, Any]) -> bool:
    """Return whether the picture's title may hold a folder: summaries without `kind` are older."""
    told = [word(summary, "script"), *items(summary, "args", str)]
    return "kind" not in summary and any(
        without_folders(part) != part for part in told if part is not None
    )
