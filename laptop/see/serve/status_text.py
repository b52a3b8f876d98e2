"""Texts for people: how cameras and link are doing, what to type on the brick, what was seen."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from rich.console import Console
from rich.table import Table

from laptop.see.markers.markers import Marker
from laptop.see.serve.pipeline import CameraPipeline, Point
from laptop.see.serve.server_state import ServerState
from shared.messages import GOAL, LEAST_CONFIDENCE


def line_printer(console: Console) -> Callable[[str], None]:
    """Return a function that prints a line as it is: not folded, not coloured."""
    return lambda line: console.print(line, soft_wrap=True, highlight=False, markup=False)


def pipeline_status(pipeline: CameraPipeline) -> str:
    """Put a camera's rate, markers and trouble in one line."""
    if pipeline.ended:
        return f"{pipeline.trouble or 'ended'}, {pipeline.frames} frames"
    parts = [f"{pipeline.rate():.0f} fps"]
    if missing := pipeline.trouble or pipeline.silence:  # what was seen last is seen no more
        return ", ".join([*parts, missing])
    if view := pipeline.view:
        for name, seen in view.found.items():
            if seen:
                at = view.places.get(name)
                cm = f" = {at}" if at else ""
                parts.append(f"{name} {seen.u:.1f},{seen.v:.1f}{cm} ({seen.confidence:.2f})")
            else:
                parts.append(f"{name} lost: {view.why.get(name) or 'not seen'}")
    parts += [f"{name} {u:g},{v:g} (fixed)" for name, (u, v, _) in pipeline.fixed.items()]
    if pipeline.age is not None:
        parts.append(f"age {1000 * pipeline.age:.0f} ms")
    if pipeline.dropped:
        parts.append(f"{pipeline.dropped} dropped")
    return ", ".join([*parts, *filter(None, [pipeline.slowness])])


def link_status(state: ServerState) -> str:
    """Return the status of the connected brick, with round trip and age; or why there is none."""
    if state.client is None:
        why = state.lost and f" (last: {state.lost})"
        refused = state.refusal and f" (refused {state.refusal})"
        return f"no brick connected{why}{refused}"
    parts = [f"brick {state.client.removeprefix('::ffff:')}"]
    if state.round_trip is not None:
        parts.append(f"round trip {1000 * state.round_trip:.1f} ms")
    if state.status:
        if state.status.error is not None:
            parts.append(f"error {state.status.error:.1f} px")
        if state.status.verdict:
            parts.append(state.status.verdict)
    return ", ".join(parts)


def brick_instructions(
    commands: Sequence[str], code: str, cameras: int = 1, page: bool = False
) -> list[str]:
    """Return lines on what to type to let the arm go to the goal.

    Args:
        commands: as TrackingServer.commands gives them.
        code: to pair with, as people write it.
        cameras: number of cameras.
        page: True if runs can be started from the page, too.
    """
    first, *others = commands
    lines = [f"to let the arm go there, type here: {first}"]
    lines += [f"            or on the brick itself: {other}" for other in others]
    lines.append(f"  which asks for the pairing code, once: {code}")
    if cameras > 1:
        lines.append("         for an arm in space: add --arm spatial, or your own arm's FILE.ini")
    if page:
        lines.append("      to start from the page: add --wait; without it the arm goes at once")
    return lines


def camera_lines(pipelines: Sequence[CameraPipeline], sources: Sequence[str]) -> list[str]:
    """Return lines on which cameras are about to be tracked.

    Args:
        pipelines: of the cameras.
        sources: of the cameras as typed, in the same order.
    """
    lines = []
    for pipeline, source in zip(pipelines, sources, strict=True):
        camera = pipeline.camera
        width, height = getattr(camera, "size", (0, 0))
        facts = [f"{width}x{height}"] if width else []
        facts += [f"{camera.fps:g} fps"] if camera.fps else []
        lines.append(f"camera {pipeline.name}: {', '.join([source, *facts])}")
        lines += [f"  {note}" for note in camera.notes]
    return lines


def marker_lines(
    markers: Sequence[Marker],
    learned: Mapping[str, Marker],
    known: Mapping[str, Marker],
    file: Path,
) -> list[str]:
    """Return lines on which markers are about to be looked for, and where they come from.

    Args:
        markers: all of them.
        learned: by name, those of this run's picks; they are kept in the file.
        known: by name, those that were in the file before.
        file: of the markers.
    """
    lines = []
    for marker in markers:
        origin = ""
        if marker.name in learned:
            origin = f" (learned, kept in {file})"
        elif known.get(marker.name) == marker:
            origin = f" (from {file}; for another: --{marker.name} SPEC)"
        lines.append(f"{marker.name}: {marker}{origin}")
    return lines


def fixed_goal_lines(
    pipelines: Sequence[CameraPipeline], points: Sequence[Point | None]
) -> list[str]:
    """Return lines on where a fixed goal is.

    Args:
        pipelines: of the cameras.
        points: (u, v), px, or None, per camera.
    """
    return [
        f"{GOAL}: fixed at {point[0]:g},{point[1]:g}"
        + (f" for camera {pipeline.name}" if len(pipelines) > 1 else "")
        for pipeline, point in zip(pipelines, points, strict=True)
        if point
    ]


def detection_table(pipelines: Sequence[CameraPipeline]) -> Table:
    """Return a table of how often each marker was seen."""
    several = len(pipelines) > 1
    table = Table(
        *(["camera"] * several),
        "marker",
        "seen",
        "%",
        f"{LEAST_CONFIDENCE:g} or\nmore, %",
        "median\nconfidence",
        "else mostly",
    )
    for pipeline in pipelines:
        for name, stats in pipeline.stats.items():
            most = stats.lost.most_common(1)
            table.add_row(
                *([pipeline.name] * several),
                name,
                f"{stats.seen} of {stats.frames}",
                f"{100 * stats.seen / stats.frames:.1f}",
                f"{100 * stats.reliable / stats.frames:.1f}",
                f"{stats.confidence:.2f}" if stats.seen else "",
                most[0][0] if most else "",
            )
    return table
