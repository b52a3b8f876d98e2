"""One run of `python -m laptop track`: set up, served, shown on a page, tracked and closed."""

from __future__ import annotations

import sys
import time
import webbrowser
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager, ExitStack
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import NamedTuple

import cv2
from rich.console import Console

from laptop.see.markers.markers import write_markers
from laptop.see.markers.tracker import Tracker
from laptop.see.markers.view import write_picture
from laptop.see.serve import announcements
from laptop.see.serve.announcements import Announce
from laptop.see.serve.joint_track import Joints
from laptop.see.serve.observation_csv import ObservationCsv, TrackingInterrupted
from laptop.see.serve.options import CAMERA_NAMES, TrackOptions
from laptop.see.serve.pairing_file import read_pairing
from laptop.see.serve.pipeline import (
    CameraPipeline,
    FrameSource,
    MarkerPlacers,
    PairPlacer,
    PipelineOutputs,
    TablePlacer,
)
from laptop.see.serve.process_signals import signals_ignored
from laptop.see.serve.server import TrackingServer
from laptop.see.serve.session import TrackingSession
from laptop.see.serve.setup import SYNTHETIC, OpenSynthetic, TrackingSetup, prepare
from laptop.see.serve.status_text import (
    brick_instructions,
    camera_lines,
    detection_table,
    fixed_goal_lines,
    line_printer,
    link_status,
    marker_lines,
)
from laptop.system.decoders import quiet_decoders
from shared import messages, pairing
from shared.arm_description import ArmError

StartBrick = Callable[[str], AbstractContextManager[Callable[[], str]]]
"""Starts an emulated brick that connects to HOST:PORT until the context is left; gives a function
that returns why the brick has ended, "" while it has not."""

WatchBoards = Callable[
    [Sequence[str], Callable[[str], None], Joints],
    tuple[Sequence[TablePlacer], PairPlacer | None],
]
"""Makes watches from the cameras' names, a logger of lines for people, and the joints: what places
each camera's markers on the table, and what places those of several in space."""


@dataclass(frozen=True)
class PageInputs:
    """Everything that a page shows and acts upon.

    pipelines    one for each camera
    trackers     theirs, in the same order
    sources      of the cameras as typed, in the same order
    server       of the brick, or None
    file         of learned markers
    start_brick  starts an emulated brick that connects to the server, see StartBrick; or None
    now          the clock of the frames, s
    report       gives people a line
    invite       is given each new address of the page, which lets one more browser in
    """

    pipelines: Sequence[CameraPipeline]
    trackers: Sequence[Tracker]
    sources: Sequence[str]
    server: TrackingServer | None
    file: Path
    start_brick: Callable[[], Callable[[], str]] | None
    now: Callable[[], float]
    report: Callable[[str], None]
    invite: Callable[[str], None]


class ServedPage(NamedTuple):
    """A page that is served.

    address        URL for a browser
    warning        a line for people, or ""
    has_viewers    returns True while somebody has it open, or is about to
    expect_viewer  announces that somebody is about to open it
    """

    address: str
    warning: str
    has_viewers: Callable[[], bool]
    expect_viewer: Callable[[], None]


OpenPage = Callable[[ExitStack], Callable[[PageInputs], ServedPage]]
"""Takes the page's port at once, or raises ArmError; gives a function that serves the page there.
The stack closes both."""


def track(
    options: TrackOptions,
    open_synthetic: OpenSynthetic,
    console: Console | None = None,
    start_brick: StartBrick | None = None,
    open_page: OpenPage | None = None,
    announce: Announce = announcements.silence,
    watch_boards: WatchBoards | None = None,
) -> int:
    """Track as the options say, and return the exit status.

    Args:
        options: checked here, all of them before anything starts.
        open_synthetic: opens a synthetic camera.
        console: shows status and summary; None: standard output.
        start_brick: for a page before a synthetic camera; None: the page brings no brick.
        open_page: makes the page; None: there is none.
        announce: tells programs how it goes.
        watch_boards: makes what waits for the board; None: there is none.

    Raises:
        ArmError: one line that says what is wrong.
    """
    try:
        status, reason = _track(
            options, open_synthetic, console or Console(), start_brick, open_page, announce,
            watch_boards,
        )  # fmt: skip
    except ArmError as error:
        announce(announcements.END, status=1, reason=str(error))
        raise
    announce(announcements.END, status=status, reason=reason)
    return status


def _track(
    options: TrackOptions,
    open_synthetic: OpenSynthetic,
    console: Console,
    start_brick: StartBrick | None,
    open_page: OpenPage | None,
    announce: Announce,
    watch_boards: WatchBoards | None,
) -> tuple[int, str]:
    """Do as `track`; exit status, and why it ended."""
    cv2.setNumThreads(1)  # on windows as small as the tracker's, more only wait for each other
    failed: TrackingInterrupted | None = None
    status = 1
    print_line = line_printer(console)
    with ExitStack() as stack:
        stack.enter_context(quiet_decoders())
        setup = prepare(options, open_synthetic, stack)
        now = clock_of(setup.cameras)
        server = serve(options, stack, now, print_line) if options.serve else None
        serve_page = open_page(stack) if open_page else None
        if setup.learned:
            write_markers(setup.file, {**setup.known, **setup.learned})
        # Only now: an old file is not given up for a run that does not begin.
        csv = _open_csv(options, stack)
        joints = partial(_reported_joints, server, now)
        placers = _placers(len(setup.cameras), watch_boards, print_line, joints)
        trackers = [Tracker(setup.markers) for _ in setup.cameras]
        outputs = PipelineOutputs(server, csv, setup.picture and setup.picture[1])
        pipelines = _pipelines(setup, trackers, outputs, placers, now)
        _introduce(print_line, announce, pipelines, options.camera, setup)
        if server:
            _invite(print_line, announce, server, len(pipelines), bool(serve_page))
        page = None
        if serve_page:
            brick = None
            if server and start_brick and SYNTHETIC in options.camera:
                brick = partial(_start_brick, stack, start_brick, server)
            invite = partial(_invite_browser, print_line, announce)
            page = serve_page(
                PageInputs(
                    pipelines, trackers, options.camera, server, setup.file, brick, now,
                    print_line, invite,
                )
            )  # fmt: skip
            _show(print_line, announce, page, options.open)
        session = _session(console, pipelines, outputs.csv, server, page, placers[0].space)
        try:
            status = session.run(partial(announce, announcements.READY))
        except TrackingInterrupted as error:
            failed = error
        with signals_ignored():
            stack.close()
    _conclude(console, pipelines, options.csv, setup.picture)
    if failed:
        raise failed
    if session.ended_by:
        print(f"laptop: stopped by {session.ended_by}", file=sys.stderr)
        return status, f"stopped by {session.ended_by}"
    return status, "every camera has ended"


def _open_csv(options: TrackOptions, stack: ExitStack) -> ObservationCsv | None:
    """Open the file of observations, if one is wanted; the stack closes it."""
    if not options.csv:
        return None
    csv = ObservationCsv(options.csv, len(options.camera) > 1, _columns(options))
    stack.callback(csv.close)
    return csv


def _placers(
    cameras: int,
    watch_boards: WatchBoards | None,
    print_line: Callable[[str], None],
    joints: Joints,
) -> list[MarkerPlacers]:
    """Return the placers of each camera's markers."""
    if not watch_boards:
        return [MarkerPlacers()] * cameras
    tables, space = watch_boards(CAMERA_NAMES[:cameras], print_line, joints)
    return [MarkerPlacers(table, space) for table in tables]


def _pipelines(
    setup: TrackingSetup,
    trackers: Sequence[Tracker],
    outputs: PipelineOutputs,
    placers: Sequence[MarkerPlacers],
    now: Callable[[], float],
) -> list[CameraPipeline]:
    """Return a pipeline for each camera, in their order."""
    names = CAMERA_NAMES[: len(setup.cameras)]
    return [
        CameraPipeline(name, camera, tracker, point, outputs, setup.live, now, placer)
        for name, camera, tracker, point, placer in zip(
            names, setup.cameras, trackers, setup.points, placers, strict=True
        )
    ]


def _session(
    console: Console,
    pipelines: Sequence[CameraPipeline],
    csv: ObservationCsv | None,
    server: TrackingServer | None,
    page: ServedPage | None,
    space: PairPlacer | None,
) -> TrackingSession:
    """Return the session over all pipelines, with what its status shows."""
    link = (lambda: link_status(server.state())) if server else None
    has_viewers = page.has_viewers if page else (lambda: False)
    others = space.lines if space else list
    return TrackingSession(pipelines, csv, link, console, has_viewers, others)


def _columns(options: TrackOptions) -> list[str]:
    """Return the CSV's columns for places."""
    if not options.board:
        return []
    space = ["z", "gap"] if len(options.camera) > 1 else []
    return ["x", "y", *space, *(["arm_x", "arm_y"] if options.touched else [])]


def _reported_joints(
    server: TrackingServer | None, now: Callable[[], float]
) -> tuple[float, Sequence[float]] | None:
    """Return the time and angles of the joints in the brick's last report; see Joints."""
    state = server.state() if server else None
    if state is None or state.status is None or state.client is None or state.status_age is None:
        return None
    return now() - state.status_age - state.status_lag, state.status.q


def clock_of(cameras: Sequence[FrameSource]) -> Callable[[], float]:
    """Return the clock of their frames, s: the emulated world's, if all of them live there."""
    clocks = [getattr(camera, "now", time.monotonic) for camera in cameras]
    return time.monotonic if time.monotonic in clocks else clocks[0]


def serve(
    options: TrackOptions,
    stack: ExitStack,
    now: Callable[[], float],
    print_line: Callable[[str], None],
) -> TrackingServer:
    """Listen for the brick, as the options say, by this laptop's code; the stack closes it."""
    port = messages.PORT if options.port is None else options.port
    code, salt = read_pairing(report=print_line)
    server = TrackingServer(options.host, port, code, now, salt=salt)
    stack.callback(server.close)
    return server


def _start_brick(
    stack: ExitStack, start_brick: StartBrick, server: TrackingServer
) -> Callable[[], str]:
    """Start an emulated brick, see StartBrick; the stack ends it."""
    return stack.enter_context(start_brick(server.place))


def _introduce(
    print_line: Callable[[str], None],
    announce: Announce,
    pipelines: Sequence[CameraPipeline],
    sources: Sequence[str],
    setup: TrackingSetup,
) -> None:
    """Report the cameras and markers that are tracked."""
    announce(
        announcements.CAMERAS,
        cameras=[
            {
                "name": pipeline.name,
                "source": source,
                "size": getattr(pipeline.camera, "size", None),
                "fps": pipeline.camera.fps,
            }
            for pipeline, source in zip(pipelines, sources, strict=True)
        ],
    )
    for line in (
        *camera_lines(pipelines, sources),
        *marker_lines(setup.markers, setup.learned, setup.known, setup.file),
        *fixed_goal_lines(pipelines, setup.points),
    ):
        print_line(line)


def _invite(
    print_line: Callable[[str], None],
    announce: Announce,
    server: TrackingServer,
    cameras: int,
    page: bool,
) -> None:
    """Report where the brick is served, and with which code."""
    host, _, _ = server.place.rpartition(":")
    code = pairing.show_code(server.code)
    announce(
        announcements.SERVING,
        host=host.strip("[]"),
        port=server.port,
        code=code,
        addresses=server.addresses(),
    )
    for line in brick_instructions(server.commands(), code, cameras, page):
        print_line(line)


def _show(
    print_line: Callable[[str], None], announce: Announce, page: ServedPage, open_it: bool
) -> None:
    """Report the page's address, and open it in a browser if wanted."""
    if page.warning:
        print_line(page.warning)
    print_line(f"page: {page.address}")
    announce(announcements.PAGE, url=page.address)
    if open_it:
        page.expect_viewer()  # a short film may be over before the browser is there
        webbrowser.open(page.address)


def _invite_browser(print_line: Callable[[str], None], announce: Announce, address: str) -> None:
    """Report the address that admits one more browser."""
    print_line(f"page, for one more browser: {address}")
    announce(announcements.PAGE, url=address)


def _conclude(
    console: Console,
    pipelines: Sequence[CameraPipeline],
    csv: Path | None,
    picture: tuple[Path, int | None] | None,
) -> None:
    """Print what was detected, and write the pictures."""
    print_line = line_printer(console)
    if any(pipeline.stats for pipeline in pipelines):
        console.print(detection_table(pipelines))
    for pipeline in pipelines:
        dropped = f", {pipeline.dropped} dropped" if pipeline.live else ""
        unread = "".join(f", {note}" for note in pipeline.camera.notes if "not be read" in note)
        print_line(f"camera {pipeline.name}: {pipeline.frames} frames{dropped}{unread}")
    if csv:
        print_line(str(csv))
    if picture:
        file, index = picture
        for pipeline in pipelines:
            own = file.with_stem(f"{file.stem}-{pipeline.name}") if len(pipelines) > 1 else file
            if pipeline.picture_view is None:
                missing = "no frame came" if index is None else f"frame {index} did not come"
                print_line(f"{own} was not written: {missing}")
            else:
                write_picture(own, pipeline.picture_view)
                print_line(str(own))
