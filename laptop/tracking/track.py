"""`python -m laptop track`: what the command line says is checked, opened, watched and closed."""

from __future__ import annotations

import math
import re
import socket
import string
import sys
import time
import webbrowser
from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager, ExitStack
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import NamedTuple

import cv2
from rich.console import Console

from laptop.page import process as page_process
from laptop.page.controller import PageController
from laptop.tracking.server import State, TrackingServer, pairing_code
from laptop.tracking.watching import (
    TICK,
    Camera,
    Interrupted,
    Point,
    Run,
    Sheet,
    Watcher,
    speaker,
    summary,
    undisturbed,
)
from laptop.vision.cameras import WEBCAM, is_live, name_of, open_camera
from laptop.vision.frames import Frame, quiet_decoders
from laptop.vision.learning import learn
from laptop.vision.markers import Marker, read_markers, read_spec, write_markers
from laptop.vision.tracker import Tracker
from laptop.vision.view import write_picture
from shared import messages
from shared.arm_description import ArmError
from shared.messages import EFFECTOR, GOAL
from shared.state import state_folder

DEFAULTS = {EFFECTOR: "disc:red", GOAL: "disc:green"}
"""What is looked for if nothing is said."""

LEARNED = ("disc", "ball")
"""Kinds of marker whose colour can be picked."""

NAMES = string.ascii_uppercase[:8]
"""Of cameras in observations; a brick listens to no more."""

FIRST_FRAME = 5.0
"""A live camera that gives no picture within this time, s, gives none."""


class BadOrder(ArmError, ValueError):
    """Something on the command line that cannot be done."""


# What the command line says


class Pick(NamedTuple):
    """A marker to learn: where it is in which frame of the first camera."""

    name: str
    where: tuple[float, ...]
    frame: int


def read_numbers(text: str) -> tuple[float, ...] | None:
    """Numbers with commas between them, or None."""
    try:
        numbers = tuple(float(part) for part in text.split(","))
    except ValueError:
        return None
    return numbers if all(map(math.isfinite, numbers)) else None


def read_pick(text: str) -> Pick:
    """`NAME=U,V@FRAME` or `NAME=U0,V0,U1,V1@FRAME`; without @FRAME the first one.

    Raises:
        BadOrder: it is neither.
    """
    name, _, rest = text.partition("=")
    where, at, frame = rest.partition("@")
    numbers = read_numbers(where)
    if not name or numbers is None or len(numbers) not in (2, 4):
        raise BadOrder(f"pick '{text}': write NAME=U,V@FRAME (px), e.g. effector=320,240@0")
    if at and not frame.isdecimal():
        raise BadOrder(f"pick '{text}': frame '{frame}' is not a whole number; the first one is 0")
    return Pick(name, numbers, int(frame or 0))


def read_goals(texts: Sequence[str], cameras: int) -> str | list[Point] | None:
    """A marker's SPEC, or one fixed point per camera, or None.

    Args:
        texts: a SPEC; or U,V for every camera in turn; or A:U,V, B:U,V, ... in any order.
        cameras: how many there are.

    Raises:
        BadOrder: points and cameras do not match.
    """
    fixed: dict[str, Point] = {}
    for name, text in zip(NAMES, texts, strict=False):
        camera, colon, where = text.rpartition(":")
        point = read_numbers(where)
        if point and len(point) == 2:
            fixed[camera if colon else name] = (point[0], point[1])
    if not fixed:
        if len(texts) > 1:
            raise BadOrder(f"goal '{texts[1]}': one marker is the goal; give --goal once")
        return texts[0] if texts else None
    names = NAMES[:cameras]
    if len(texts) != cameras or set(fixed) != set(names):
        each = " ".join(f"--goal {name}:U,V" for name in names)
        raise BadOrder(
            f"goal '{' '.join(texts)}': give one point for each of the {cameras} cameras: {each}"
            if cameras > 1
            else f"goal '{' '.join(texts)}': give one point U,V, or one marker"
        )
    return [fixed[name] for name in names]


def read_size(text: str) -> tuple[int, int]:
    """`WxH`, px.

    Raises:
        BadOrder: it is not.
    """
    size = re.fullmatch(r"(\d{2,5})x(\d{2,5})", text)
    if not size:
        raise BadOrder(f"size '{text}': write WIDTHxHEIGHT in px, e.g. 640x480")
    return int(size[1]), int(size[2])


def read_picture(text: str) -> tuple[Path, int | None]:
    """`FILE.png` or `FILE.png@FRAME`; without @FRAME the last one.

    Raises:
        BadOrder: no picture can be written there.
    """
    name, at, frame = text.rpartition("@")
    if not at or not frame.isdecimal():
        name, frame = text, ""
    file = Path(name)
    if file.suffix.lower() not in (".png", ".jpg"):
        raise BadOrder(f"picture '{name}': let its name end in .png or .jpg")
    if not file.parent.is_dir():
        raise BadOrder(f"picture {file}: there is no folder {file.parent}; make it first")
    return file, int(frame) if frame else None


def markers_file() -> Path:
    """Where learned markers are kept: in $BRICKSERVO_STATE or ~/.brickservo."""
    return Path(state_folder()) / "markers.ini"


@dataclass(frozen=True)
class Wanted:
    """Which markers, and where that is said.

    specs    per name SPEC, or a kind alone (a learned one's), or None
    picks    to learn
    known    by name, from the markers file
    all      look for every known one, not only for effector and goal
    default  SPEC by name, for what nobody says anything about
    """

    specs: Mapping[str, str | None]
    picks: Sequence[Pick]
    known: Mapping[str, Marker]
    all: bool
    default: Mapping[str, str]

    def check(self) -> None:
        """Refuse what cannot be meant, before any camera is opened.

        Raises:
            BadOrder: two picks of one marker, a name that nobody knows, a colour said twice.
        """
        names = [pick.name for pick in self.picks]
        for pick in self.picks:
            if pick.name not in (*self.specs, *self.known):
                there = ", ".join(dict.fromkeys([*self.specs, *self.known]))
                raise BadOrder(f"pick '{pick.name}': no marker has this name; there are {there}")
            if names.count(pick.name) > 1:
                raise BadOrder(f"pick '{pick.name}' is given twice; give it once")
            spec = self.specs.get(pick.name)
            if spec and spec not in LEARNED:
                raise BadOrder(
                    f"{pick.name} '{spec}': its colour is picked; say only disc or ball, or nothing"
                )
        self.markers(lambda pick: None)

    def markers(self, learned: Callable[[Pick], Marker | None]) -> list[Marker]:
        """What to look for.

        Args:
            learned: the marker that a pick gives; None: not known yet.
        """
        picks = {pick.name: pick for pick in self.picks}
        found = []
        for name in dict.fromkeys([*self.specs, *(self.known if self.all else ()), *picks]):
            if name in picks:
                marker = learned(picks[name])
            elif (spec := self.specs.get(name)) in LEARNED:
                marker = self.known.get(name)
                if marker is None or marker.color is None:
                    raise BadOrder(
                        f"{name} '{spec}': of which colour? write e.g. {spec}:green, or show it "
                        f"with --pick {name}=U,V@FRAME"
                    )
                marker = replace(marker, kind=spec)
            elif spec:
                marker = read_spec(name, spec)
            elif name in self.known:
                marker = self.known[name]
            elif name in self.default and not (name == GOAL and EFFECTOR in picks):
                marker = read_spec(name, self.default[name])
            else:
                marker = None  # only the effector was shown; or the scene has no goal
            if marker:
                found.append(marker)
        return found


# The command


@dataclass(frozen=True)
class Orders:
    """What was said on the command line; see `python -m laptop track --help`."""

    camera: tuple[str, ...]
    effector: str | None
    goal: tuple[str, ...]
    pick: tuple[str, ...]
    markers: Path | None
    scene: str
    csv: Path | None
    serve: bool
    host: str
    port: int | None
    fps: float | None
    size: str | None
    picture: str | None
    page: bool = False
    page_host: str = page_process.HOST
    page_port: int | None = None
    open: bool = False


SYNTHETIC = "synthetic"

Synthetic = Callable[[str, str, float | None], tuple[Camera, dict[str, str]]]
"""From the camera's name, the scene's text and frames per second (None: its own) to the camera, and
how its markers look: SPEC by name."""

OwnBrick = Callable[[str, str], AbstractContextManager[Callable[[], str]]]
"""From the server's address and the code to an emulated brick that calls there until it is left."""


class _Plan(NamedTuple):
    """What has been checked and opened."""

    cameras: list[Camera]
    live: bool
    markers: list[Marker]
    points: list[Point | None]  # a fixed goal per camera
    picture: tuple[Path, int | None] | None
    file: Path
    known: Mapping[str, Marker]  # in the file
    learned: dict[str, Marker]


def command(
    orders: Orders,
    synthetic: Synthetic,
    console: Console | None = None,
    own_brick: OwnBrick | None = None,
) -> int:
    """Do what the command line says; its exit status.

    Args:
        orders: checked here, all of it before anything starts.
        synthetic: opens a synthetic camera.
        console: where the status and the summary go.
        own_brick: what the page brings along for a synthetic camera; None: nothing.

    Raises:
        ArmError: one line that says what is wrong.
    """
    console = console or Console()
    cv2.setNumThreads(1)  # on windows as small as the tracker's, more only wait for each other
    failed: Interrupted | None = None
    status = 1
    with ExitStack() as stack:
        stack.enter_context(quiet_decoders())
        plan = _prepare(orders, synthetic, stack)
        now = _clock_of(plan.cameras)
        server = _serve(orders, stack, now) if orders.serve else None
        listener = desk = None
        if orders.page:
            listener = stack.enter_context(page_process.listen(orders.page_host, orders.page_port))
        if plan.learned:
            write_markers(plan.file, {**plan.known, **plan.learned})
        # Only now: an old file is not given up for a run that does not begin.
        sheet = Sheet(orders.csv, len(plan.cameras) > 1) if orders.csv else None
        if sheet:
            stack.callback(sheet.close)
        keep = plan.picture and plan.picture[1]
        trackers = [Tracker(plan.markers) for _ in plan.cameras]
        watchers = [
            Watcher(name, camera, tracker, point, server, sheet, plan.live, keep, now)
            for name, camera, tracker, point in zip(
                NAMES, plan.cameras, trackers, plan.points, strict=False
            )
        ]
        _introduce(speaker(console), watchers, orders.camera, plan)
        if server:
            for line in invitation(server.commands(), len(watchers), orders.page):
                speaker(console)(line)
        if listener:
            bring = None
            if server and own_brick and SYNTHETIC in orders.camera:
                bring = partial(_bring, stack, own_brick, server)
            desk = PageController(watchers, trackers, orders.camera, server, plan.file, bring, now)
            _show(speaker(console), desk, listener, orders, stack)
        link = (lambda: link_text(server.state())) if server else None
        watched = (lambda: desk.has_viewers) if desk else (lambda: False)
        run = Run(watchers, sheet, link, console, watched)
        try:
            status = run.run()
        except Interrupted as error:
            failed = error
        with undisturbed():
            stack.close()
    _conclude(console, watchers, orders.csv, plan.picture)
    if failed:
        raise failed
    if run.ended_by:
        print(f"laptop: stopped by {run.ended_by}", file=sys.stderr)
    return status


def _prepare(orders: Orders, synthetic: Synthetic, stack: ExitStack) -> _Plan:
    """Check everything and open the cameras; they are closed by the stack."""
    if len(orders.camera) > len(NAMES):
        raise BadOrder(f"{len(orders.camera)} cameras: give --camera at most {len(NAMES)} times")
    devices = [name_of(source) for source in orders.camera if is_live(source)]
    for device in devices:
        if devices.count(device) > 1:
            raise BadOrder(f"{device} is given twice; another --camera sees from another place")
    if orders.scene and SYNTHETIC not in orders.camera:
        raise BadOrder(f"scene '{orders.scene}': only --camera synthetic has a scene")
    shown_to = [name for name, s in zip(NAMES, orders.camera, strict=False) if s == SYNTHETIC]
    for name in re.findall(r"(?:^|,)\s*([A-Z])\.", orders.scene):
        if name not in shown_to:
            raise BadOrder(
                f"scene '{orders.scene}': no synthetic camera is {name}; "
                f"there is {', '.join(shown_to)}"
            )
    goal = read_goals(orders.goal, len(orders.camera))
    points: list[Point | None] = [None] * len(orders.camera)
    specs = {EFFECTOR: orders.effector}
    if isinstance(goal, list):
        points = list(goal)
    else:
        specs[GOAL] = goal
    picture = read_picture(orders.picture) if orders.picture else None
    size = read_size(orders.size) if orders.size else None
    webcams = [source for source in orders.camera if WEBCAM.fullmatch(source)]
    if size and not webcams and SYNTHETIC in orders.camera:
        raise BadOrder(f"size {orders.size}: write --scene width={size[0]},height={size[1]}")
    wanted, file = _wanted(orders, specs)
    known = wanted.known
    wanted.check()
    live = orders.serve or any(map(_goes_on, orders.camera))
    cameras: list[Camera] = []
    shown: dict[str, str] = {}
    for name, source in zip(NAMES, orders.camera, strict=False):
        if source == SYNTHETIC:
            camera, looks = synthetic(name, orders.scene, orders.fps)
            shown = {**looks, **shown}
            # What was learned from another camera is not known to be in the scene.
            wanted = replace(wanted, default=shown, known=known if orders.markers else {})
        else:
            asked = size if source in webcams or not webcams else None
            camera = open_camera(source, live, orders.fps, asked)
        cameras.append(camera)
        stack.callback(camera.close)
    learned = _learn(orders.camera[0], cameras[0], wanted)
    for name, source, camera, point in zip(NAMES, orders.camera, cameras, points, strict=False):
        if _goes_on(source):
            height, width = _frame_of(camera, 0).image.shape[:2]
        else:
            width, height = getattr(camera, "size", (0, 0))
        _check_point(point, f"camera {name}'s" if len(cameras) > 1 else "the", width, height)
        _check_frame("picture", picture[1] if picture and picture[1] else 0, camera)
    markers = wanted.markers(lambda pick: learned[pick.name])
    _check_names(markers, file)
    return _Plan(cameras, live, markers, points, picture, file, known, learned)


def _wanted(orders: Orders, specs: dict[str, str | None]) -> tuple[Wanted, Path]:
    """Which markers, and the file for what is learned."""
    picks = [read_pick(text) for text in orders.pick]
    file = orders.markers or markers_file()
    if orders.markers and not file.exists() and not picks:
        raise BadOrder(f"markers {file}: there is no such file; make it with --pick")
    known = read_markers(file) if file.exists() else {}
    return Wanted(specs, picks, known, orders.markers is not None, DEFAULTS), file


def _goes_on(source: str) -> bool:
    return source == SYNTHETIC or is_live(source)


def _learn(source: str, camera: Camera, wanted: Wanted) -> dict[str, Marker]:
    """The picked markers; a file is looked into beforehand, and tracked from its start."""
    learned = {}
    for pick in sorted(wanted.picks, key=lambda pick: pick.frame):
        _check_frame("pick", pick.frame, camera)
        if _goes_on(source):
            frame = _frame_of(camera, pick.frame)
        else:
            with open_camera(source) as again:
                frame = _frame_of(again, pick.frame)
        kind = wanted.specs.get(pick.name)
        learned[pick.name] = learn(pick.name, frame.image, pick.where, kind)
    return learned


def _frame_of(camera: Camera, index: int) -> Frame:
    """The frame with this index, or the next one after it."""
    deadline = time.monotonic() + FIRST_FRAME
    while time.monotonic() < deadline and not camera.ended:
        frame = camera.read(TICK)
        if frame and frame.index >= index:
            return frame
        if frame:
            deadline = time.monotonic() + FIRST_FRAME
    if camera.ended:
        raise BadOrder(f"frame {index} is beyond the end of {camera.name}; choose an earlier one")
    raise BadOrder(
        f"{camera.name} gives no picture within {FIRST_FRAME:g} s; end other programs that use it, "
        "or plug it in anew"
    )


def _check_names(markers: Sequence[Marker], file: Path) -> None:
    """Refuse what no observation can bear."""
    if len(markers) > messages.MAX_MARKERS - 1:  # one place is a fixed goal's
        raise BadOrder(
            f"{file} has {len(markers)} markers; at most {messages.MAX_MARKERS - 1} can be tracked"
        )
    for marker in markers:
        try:
            messages.encode(messages.Observation(0, NAMES[0], 0.0, {marker.name: None}))
        except messages.BadMessage:
            raise BadOrder(
                f"{file}: marker [{marker.name}]: rename it to 1 to 32 of A-Z a-z 0-9 _ -"
            ) from None


def _check_frame(what: str, index: int, camera: Camera) -> None:
    count = getattr(camera, "count", None)
    if count and index >= count:
        raise BadOrder(
            f"{what}: frame {index} is beyond the end; {camera.name} has frames 0 to {count - 1}"
        )


def _check_point(point: Point | None, whose: str, width: int, height: int) -> None:
    if point and width and not (0 <= point[0] <= width - 1 and 0 <= point[1] <= height - 1):
        raise BadOrder(
            f"goal {point[0]:g},{point[1]:g} is outside {whose} picture; u from 0 to {width - 1}, "
            f"v from 0 to {height - 1}"
        )


def _clock_of(cameras: Sequence[Camera]) -> Callable[[], float]:
    """The clock of their frames, s: the one of the emulated world, if all of them live there."""
    clocks = [getattr(camera, "now", time.monotonic) for camera in cameras]
    return time.monotonic if time.monotonic in clocks else clocks[0]


def _serve(orders: Orders, stack: ExitStack, now: Callable[[], float]) -> TrackingServer:
    port = messages.PORT if orders.port is None else orders.port
    server = TrackingServer(orders.host, port, pairing_code(), now)
    stack.callback(server.close)
    return server


def _show(
    say: Callable[[str], None],
    desk: PageController,
    listener: socket.socket,
    orders: Orders,
    stack: ExitStack,
) -> None:
    """Start the page; it is ended by the stack."""
    page = page_process.PageProcess(desk, listener, orders.page_host)
    stack.callback(page.close)
    if page.warning:
        say(page.warning)
    say(f"page: {page.address}")
    if orders.open:
        desk.expect_viewer()  # a short film may be over before the browser is there
        webbrowser.open(page.address)


def _bring(stack: ExitStack, own_brick: OwnBrick, server: TrackingServer) -> Callable[[], str]:
    """Let an emulated brick come, see `PageController`; it is ended by the stack."""
    host = server.host or "127.0.0.1"
    place = f"[{host}]:{server.port}" if ":" in host else f"{host}:{server.port}"
    return stack.enter_context(own_brick(place, pairing_code()))


def invitation(commands: Sequence[str], cameras: int = 1, page: bool = False) -> list[str]:
    """What to type on the brick, for people.

    Args:
        commands: as TrackingServer.commands gives them.
        cameras: how many watch.
        page: whether runs can be started from the page, too.
    """
    first, *others = commands
    lines = [f"on the brick, over ssh from here: {first}"]
    lines += [f"                 or otherwise: {other}" for other in others]
    if cameras > 1:
        lines.append("         for an arm in space: add --arm spatial, or your own arm's FILE.ini")
    if page:
        lines.append("      to start from the page: add --wait; without it the arm goes at once")
    return lines


def link_text(state: State) -> str:
    """Who is connected, how far away and how it is doing; or why nobody is."""
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


def _introduce(
    say: Callable[[str], None], watchers: Sequence[Watcher], sources: Sequence[str], plan: _Plan
) -> None:
    """What is about to be tracked."""
    for watcher, source in zip(watchers, sources, strict=True):
        camera = watcher.camera
        width, height = getattr(camera, "size", (0, 0))
        facts = [f"{width}x{height}"] if width else []
        facts += [f"{camera.fps:g} fps"] if camera.fps else []
        say(f"camera {watcher.name}: {', '.join([source, *facts])}")
        for note in camera.notes:
            say(f"  {note}")
    for marker in plan.markers:
        kept = ""
        if marker.name in plan.learned:
            kept = f" (learned, kept in {plan.file})"
        elif plan.known.get(marker.name) == marker:
            kept = f" (from {plan.file}; for another: --{marker.name} SPEC)"
        say(f"{marker.name}: {marker}{kept}")
    for watcher, point in zip(watchers, plan.points, strict=True):
        if point:
            where = f" for camera {watcher.name}" if len(watchers) > 1 else ""
            say(f"{GOAL}: fixed at {point[0]:g},{point[1]:g}{where}")


def _conclude(
    console: Console,
    watchers: Sequence[Watcher],
    sheet: Path | None,
    picture: tuple[Path, int | None] | None,
) -> None:
    """What came of it."""
    say = speaker(console)
    if any(watcher.tallies for watcher in watchers):
        console.print(summary(watchers))
    for watcher in watchers:
        dropped = f", {watcher.dropped} dropped" if watcher.live else ""
        unread = "".join(f", {note}" for note in watcher.camera.notes if "not be read" in note)
        say(f"camera {watcher.name}: {watcher.frames} frames{dropped}{unread}")
    if sheet:
        say(str(sheet))
    if picture:
        file, index = picture
        for watcher in watchers:
            own = file.with_stem(f"{file.stem}-{watcher.name}") if len(watchers) > 1 else file
            if watcher.picture is None:
                missing = "no frame came" if index is None else f"frame {index} did not come"
                say(f"{own} was not written: {missing}")
            else:
                write_picture(own, watcher.picture)
                say(str(own))
