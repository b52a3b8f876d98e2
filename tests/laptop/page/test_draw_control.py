"""A drawing on the page, from the file to the brick's last word, without a browser."""

import math
import multiprocessing
import re
import tempfile
import threading
import zlib
from pathlib import Path

import cv2
import numpy as np
import pytest
from arms import PLANAR as ARM
from arms import SPATIAL
from page_scene import PageScene
from waiting import until

from laptop.drawing.pictures import Tracing
from laptop.page import draw_job, draw_request, drawing_planner
from laptop.page.drawing_snapshots import PlacedDrawing, Placing, Request, Source
from laptop.page.drawing_worker import DrawingWorker
from laptop.page.marker_height import DrawingArm, HeightMemory, MarkerHeight
from laptop.page.paper_views import PaperViews
from laptop.page.table_mapping import TableView
from laptop.see.markers.tracker import Sighting
from robot.motion import kinematics
from shared.job import BadJob, Job
from shared.job_messages import Draw, JobStatus, Order, Want, bytes_of
from shared.messages import EFFECTOR, Status, Stop

SQUARE = b"""<svg xmlns="http://www.w3.org/2000/svg" width="4cm" height="4cm" viewBox="0 0 4 4">
<rect x="0.5" y="0.5" width="3" height="3" fill="none" stroke="black"/></svg>"""

AREA = b"""<svg xmlns="http://www.w3.org/2000/svg" width="4cm" height="4cm" viewBox="0 0 4 4">
<rect x="0.5" y="0.5" width="3" height="3" fill="black"/></svg>"""
TWO_COLOURS = b"""<svg xmlns="http://www.w3.org/2000/svg" width="4cm" height="4cm"
viewBox="0 0 4 4" fill="none">
<path d="M0.5,1H3" stroke="red"/><path d="M0.5,2H3" stroke="blue"/></svg>"""


class DrawScene(PageScene):
    """A page's controller before an arm in a plane, whose tip the camera sees from above."""

    def pixel(self, p):
        """Where the camera sees a place of the tip (cm): a homography, not only a scale."""
        x, y = p
        w = 1 + 0.002 * x
        return (160 - 6.0 * y) / w, (200 - 7.0 * x) / w

    def joints(self, q, still=5):
        """The arm stands at q (rad) for some frames, and tells so."""
        u, v = self.pixel(kinematics.forward(ARM, q))
        for k in range(still):
            if k == 2:
                self.server.status = Status(self.t, q, None, "ready")
            self.show(tip=(round(u), round(v)))

    def look_around(self):
        """The tip has been about, so that it is known where the table is."""
        for q1 in np.linspace(-0.8, 0.8, 5):
            for q2 in (0.4, 1.0, 1.8):
                self.joints((float(q1), q2))

    def tell(self, state, crc=None, cm=0.0, down=False, reason=""):
        crc = self.server.offered.draw.crc if crc is None else crc
        self.server.progress = JobStatus(
            self.t, crc, "it", state, 1, 1, cm, 12.0, 5.0, down, reason
        )

    def drawn(self):
        """Wait until nothing is read or planned any more; the DrawingSnapshot."""
        drawings = self.controller.drawings
        until(lambda: not drawings.state().busy, "a plan")
        return drawings.drawing()


class ThreadWorker(DrawingWorker):
    """The same, in a thread instead of a process, which takes a second to start."""

    def _begin(self):
        if self._pipe is None:
            self._pipe, theirs = multiprocessing.Pipe()
            planner = threading.Thread(target=drawing_planner.serve, args=(theirs, self._arm))
            planner.daemon = True
            planner.start()
        return self._pipe


@pytest.fixture
def scene(tmp_path, monkeypatch):
    monkeypatch.setattr(draw_request, "DrawingWorker", ThreadWorker)
    scene = DrawScene(tmp_path, arm=ARM)
    yield scene
    scene.controller.drawings.close()


@pytest.fixture
def drawings(scene):
    return scene.controller.drawings


def test_a_file_is_read_placed_planned_and_started(scene, drawings):
    assert drawings.start() == "there is no drawing yet; drop a file, or choose one"
    assert drawings.load("square.svg", SQUARE) == ""
    assert drawings.state().busy == "reading it"
    placed = scene.drawn().placed
    assert (placed.name, len(placed.reachable), placed.missed) == ("square.svg", 1, ())
    assert placed.why_not == ""
    assert placed.seconds > 1
    assert placed.job == b"", "browsers get no job"
    assert drawings.state().can_start
    scene.server.there = False
    assert "no brick is connected" in drawings.start()
    scene.server.there = True
    assert drawings.start() == ""
    offered = scene.server.offered
    assert scene.server.sent == [offered.draw]
    assert offered.draw == Draw(
        "square.svg", offered.draw.size, offered.draw.parts, offered.draw.crc
    )
    assert offered.job.header.arm == "planar"
    assert "abort it" in drawings.start()
    assert drawings.start() == scene.controller.runs.start()


def test_the_job_is_where_it_was_placed(scene, drawings, tmp_path):
    drawings.load("square.svg", SQUARE)
    assert drawings.place(Placing(14.0, -2.0, 3.0, 30.0)) == ""
    placed = scene.drawn().placed
    assert placed.centre == pytest.approx((14.0, -2.0))
    corners = np.unique(np.round(placed.reachable[0], 6), axis=0)
    assert np.hypot(*(corners - placed.centre).T) == pytest.approx(np.full(4, 3 / math.sqrt(2)))
    assert drawings.start() == ""
    job = job_of(scene.server.offered, tmp_path / "it.job")
    tips = [
        kinematics.forward(ARM, [cubic[0] for cubic in segment[2]])
        for piece in job.stroke(1).pieces
        for segment in piece[1]
    ]
    off = [np.hypot(*(np.array(tip) - (14.0, -2.0))) for tip in tips]
    assert max(off) == pytest.approx(3 / math.sqrt(2), abs=0.02)


def job_of(offered, file):
    """The Job that a brick gets."""
    wants = [Want(offered.draw.crc, k) for k in range(offered.draw.parts)]
    packed = b"".join(bytes_of(offered.part(want)) for want in wants)
    file.write_bytes(zlib.decompress(packed))
    return Job(str(file), ARM)


@pytest.mark.long
def test_what_has_several_colours_is_drawn_by_a_pen_for_each_if_that_is_wished(
    scene, drawings, tmp_path
):
    assert drawings.set_pens("colours") == "there is no drawing yet"
    drawings.load("two.svg", TWO_COLOURS)
    placed = scene.drawn().placed
    assert (placed.several, placed.pens) == (("colours",), "")
    assert drawings.set_pens("colours") == ""
    placed = scene.drawn().placed
    assert placed.pens == "colours"
    (reported,) = placed.notes
    assert reported in (
        "2 pens, in this order (strokes): red (1), blue (1)",
        "2 pens, in this order (strokes): blue (1), red (1)",
    )
    drawings.place(Placing(14.0, -2.0, 3.0))  # which keeps them
    scene.drawn()
    assert drawings.start() == ""
    job = job_of(scene.server.offered, tmp_path / "it.job")
    assert job.header.pens == "change"
    assert sorted(job.stroke(k).layer for k in (1, 2)) == ["blue", "red"]


def test_areas_are_hatched_if_that_is_wished(scene, drawings):
    assert drawings.hatch(True) == "there is no SVG to hatch; drop one first"
    drawings.load("area.svg", AREA)
    assert drawings.state().is_hatched is False
    drawings.place(Placing(14.0, -2.0, 3.0))
    placed = scene.drawn().placed
    outline = placed.cm
    assert any("not hatched" in note for note in placed.notes)
    assert drawings.hatch(True) == ""
    assert drawings.state().busy == "reading it"
    placed = scene.drawn().placed
    assert placed.cm > 3 * outline
    assert placed.centre == (14.0, -2.0), "it lies where it was"
    assert not any("hatched" in note for note in placed.notes)
    assert drawings.state().is_hatched
    drawings.choose("rose")
    assert drawings.hatch(False).startswith("there is no SVG")


def test_what_has_one_colour_is_drawn_by_one_pen_whatever_is_wished(scene, drawings):
    drawings.load("square.svg", SQUARE)
    assert drawings.set_pens("colours") == ""
    placed = scene.drawn().placed
    assert (placed.several, placed.pens, placed.why_not) == ((), "", "")


def test_while_a_run_is_on_nothing_is_started(scene, drawings):
    drawings.choose("rose")
    scene.drawn()
    scene.server.tell("", 1)
    assert drawings.start() == drawings.look_around()
    assert "hold or stop" in drawings.start()
    assert scene.server.sent == []


def test_an_answer_to_what_nobody_asks_any_more_is_left(scene, drawings):
    drawings.choose("rose")
    placed = scene.drawn().placed
    drawings._request.on_answer(
        Request(1, Source("gallery", "knot")), placed._replace(name="knot"), False
    )
    assert drawings.drawing().placed.name == "rose"
    assert drawings.state().busy == ""


def test_what_is_out_of_reach_is_shown_and_not_started(scene, drawings):
    drawings.load("square.svg", SQUARE)
    scene.drawn()
    drawings.place(Placing(20.0, 0.0, 4.0))
    placed = scene.drawn().placed
    assert placed.reachable
    assert placed.missed
    assert re.match(r"\d\.\d cm .*reached", placed.why_not)
    assert not drawings.state().can_start
    assert drawings.start() == placed.why_not
    drawings.place(Placing(14.0, 0.0, 4.0))
    assert scene.drawn().placed.missed == ()
    assert drawings.state().can_start


def test_of_many_places_the_last_counts(scene, drawings):
    drawings.choose("rose")
    for k in range(30):
        drawings.place(Placing(14.0, 0.1 * k - 1.5, 4.0))
    assert scene.drawn().placed.centre == pytest.approx((14.0, 1.4))


@pytest.mark.parametrize(
    ("order", "words"),
    [
        (("load", "a.svg", b"<svg"), "a.svg"),
        (("load", "a.svg", b"\0" * 9_000_000), "at most 8 MB are read"),
        (("load", "a.bin", bytes(range(256))), "a.bin"),
        (("write", "  "), "type a text first"),
        (("write", "a" * 3000), "at most 2000 are written"),
        (("write", "\u4e2d"), "can be written"),
        (("choose", "../../etc/passwd"), "there is no drawing ../../etc/passwd here"),
        (("choose", "/etc/hostname"), "choose one of house, knot"),
        (("order", "dance"), "dance: give one of pause"),
        (("order", "pause"), "nothing is drawn"),
        (("order", "speed", 500.0), "25 to 100 %"),
        (("place", Placing()), "there is no drawing yet"),
        (("trace", "A", [(1.0, 2.0), (100.0, 120.0)]), "is not known yet; look around first"),
    ],
)
def test_what_cannot_be_done_says_why(scene, drawings, order, words):
    name, *arguments = order
    why = getattr(drawings, name)(*arguments)
    scene.drawn()
    assert words in (why or drawings.state().trouble)
    assert not drawings.state().is_there


def test_without_an_arm_nothing_is_drawn(tmp_path):
    drawings = PageScene(tmp_path).controller.drawings
    assert "the arm is not known here" in drawings.choose("rose")
    assert "the arm is not known here" in drawings.look_around()


def test_the_arm_looks_around_with_the_pen_up(scene, drawings):
    assert drawings.look_around() == ""
    assert scene.server.offered.draw.dry
    assert scene.server.offered.job.header.strokes == 1
    assert drawings.state().job.is_on


def test_a_brick_that_does_not_begin_is_told(scene, drawings):
    drawings.look_around()
    assert drawings.state().job.state == "fetching"
    scene.t += 7
    job = drawings.state().job
    assert (job.state, job.is_on) == ("failed", False)
    assert "did not begin" in job.reason
    assert drawings.look_around() == "", "so it can be tried again"


def test_how_the_brick_gets_on_is_known_and_can_be_ordered(scene, drawings):
    drawings.look_around()
    scene.tell("drawing", cm=3.0, down=True)
    scene.show()
    job = drawings.state().job
    assert (job.state, job.share, job.seconds, job.is_on) == ("drawing", 0.25, 5.0, True)
    assert drawings.order("pause") == drawings.order("speed", 50.0) == ""
    assert scene.server.sent[-2:] == [Order("pause", None), Order("speed", 50.0)]
    scene.t += 60
    assert drawings.state().job.is_on, "however long it takes"
    scene.tell("done", cm=12.0)
    scene.show()
    assert not drawings.state().job.is_on
    assert "nothing is drawn" in drawings.order("pause")


def test_a_stop_is_said_until_it_is_heard(scene, drawings):
    drawings.look_around()
    scene.tell("drawing", cm=3.0)
    scene.show()
    scene.controller.runs.stop("browser 1")
    for _ in range(3):
        scene.tell("drawing", cm=4.0)
        scene.show()
    said = [word for word in scene.server.sent if isinstance(word, Stop)]
    assert len(said) == 4
    assert said[0].reason.endswith("by browser 1")
    scene.tell("aborted")
    scene.show()
    scene.tell("aborted")
    scene.show()
    assert len([word for word in scene.server.sent if isinstance(word, Stop)]) == 4


def test_a_lost_link_says_what_the_brick_does_then(scene, drawings):
    drawings.look_around()
    scene.tell("drawing", cm=3.0)
    scene.show()
    scene.server.there = False
    scene.show()
    assert "it pauses with the pen up" in drawings.state().job.reason


def test_the_tips_moves_tell_where_the_table_is(scene, drawings):
    assert drawings.view("A") is None
    assert "has not moved" in drawings.state().unmapped["A"]
    scene.look_around()
    view = drawings.view("A")
    assert drawings.state().unmapped == {}
    assert drawings.state().misfit < 2.0
    for p in ((14.0, 3.0), (10.0, -6.0), (17.0, 0.0)):
        assert view.to_picture(np.array([p]))[0] == pytest.approx(scene.pixel(p), abs=1.5)


def test_a_dragged_path_is_a_drawing_where_it_was_dragged(scene, drawings):
    scene.look_around()
    corners = [(14.0, 3.0), (14.0, -3.0), (10.0, 0.0), (14.0, 3.0)]
    dragged = [
        tuple(a + (b - a) * k / 20 for a, b in zip(scene.pixel(p), scene.pixel(q), strict=True))
        for p, q in zip(corners, corners[1:], strict=False)
        for k in range(20)
    ] + [scene.pixel(corners[-1])]
    assert drawings.trace("A", dragged) == ""
    placed = scene.drawn().placed
    assert (placed.why_not, placed.missed) == ("", ())
    (line,) = placed.reachable
    for corner in corners:
        assert np.hypot(*(line - corner).T).min() < 0.25
    assert drawings.trace("A", [(100.0, 100.0), (101.0, 101.0)]) == (
        "this path is too short to be drawn; drag a longer one"
    )


def test_what_was_drawn_is_compared_with_the_wish(scene, drawings):
    scene.look_around()
    drawings.load("square.svg", SQUARE)
    drawings.place(Placing(13.0, 0.0, 6.0))
    scene.drawn()
    drawings.start()
    scene.tell("drawing", down=True)
    scene.show(tip=None)
    ring = [(10.0, -3.0), (10.0, 3.0), (16.0, 3.0), (16.0, -3.0), (10.0, -3.0)]
    for p, q in zip(ring, ring[1:], strict=False):
        for k in range(20):
            at = [a + (b - a) * k / 20 for a, b in zip(p, q, strict=True)]
            u, v = scene.pixel((at[0] + 0.1, at[1]))
            scene.show(tip=(round(u), round(v)))
            scene.tell("drawing", cm=1.0, down=True)
    version, points = drawings.ink("A", -1, 0)
    assert len(points) > 50
    assert drawings.ink("A", version, len(points) - 3)[1] == points[-3:]
    scene.tell("done", cm=12.0)
    for _ in range(20):
        scene.show()
    until(lambda: drawings.drawing().deviation, "a comparison")
    deviation = drawings.drawing().deviation
    assert deviation.greatest == pytest.approx(1.0, abs=1.2), "mm; a pixel is 1.5 mm here"
    assert deviation.rms < 1.2


OFFSET_ARM = ARM._replace(marker_offset=(0.6, -0.4))


class OffsetScene(DrawScene):
    """The same with a marker beside the pen, seen exactly where it is."""

    def joints(self, q, still=5, down=None):
        c, s = math.cos(sum(q)), math.sin(sum(q))
        off = 0.6 * c + 0.4 * s, 0.6 * s - 0.4 * c
        marker = np.array(kinematics.forward(ARM, q)) + off
        seen = {EFFECTOR: Sighting(*self.pixel(marker), 1.0, 10.0)}
        self.trackers[0].find = lambda image, t: seen
        for k in range(still):
            self.t += 0.0005  # a status is of another moment than a frame
            if k == min(2, still - 1):
                self.server.status = Status(self.t - 0.02, q, None, "ready")
            if down is not None:
                self.tell("drawing", cm=1.0, down=down)
            self.show()


@pytest.mark.long
@pytest.mark.parametrize("by_board", [False, True])
def test_of_a_marker_beside_the_pen_the_ink_and_the_drawing_are_the_pens(
    tmp_path, monkeypatch, by_board
):
    monkeypatch.setattr(draw_request, "DrawingWorker", ThreadWorker)
    scene = OffsetScene(tmp_path, arm=OFFSET_ARM)
    scene.server.status = None
    drawings = scene.controller.drawings
    if by_board:  # which lies askew of the arm, and tells where the marker is on it
        turn = np.array([[0.8, -0.6], [0.6, 0.8]])
        back = TableView(homography(scene.pixel)).to_table
        scene.watchers[0]._placer = FakePlacer(lambda uv: tuple(turn @ back(np.array([uv]))[0]))
        drawings.set_marker_height(0.0)
    scene.look_around()
    assert drawings.view("A").source.startswith("the board" if by_board else "the tip")
    drawings.load("square.svg", SQUARE)
    drawings.place(Placing(13.0, 0.0, 6.0))
    shown = scene.drawn()
    for line in shown.placed.reachable:  # where it lies is where the pen will go
        seen = np.array([scene.pixel(p) for p in line])
        assert np.abs(shown.views["A"].to_picture(line) - seen).max() < 0.05, "px"
    drawings.start()
    ring = np.array([(10.0, -3.0), (10.0, 3.0), (16.0, 3.0), (16.0, -3.0), (10.0, -3.0)])
    scene.joints(kinematics.inverse(OFFSET_ARM, ring[0]), 10, down=False)
    for p, q in zip(ring, ring[1:], strict=False):
        for k in range(60):
            scene.joints(kinematics.inverse(OFFSET_ARM, p + (q - p) * k / 60), 1, down=True)
    _, points = drawings.ink("A", -1, 0)
    pens = TableView(homography(scene.pixel)).to_table(np.array([(p.u, p.v) for p in points]))
    assert len(pens) > 60
    off = np.abs(np.abs(pens - (13.0, 0.0)).max(axis=1) - 3.0)
    assert 10 * off.max() < 0.3, "mm; the marker itself is up to 7 mm beside the square"
    scene.tell("done", cm=12.0)
    for _ in range(20):
        scene.show()
    until(lambda: drawings.drawing().deviation, "a comparison")
    assert drawings.drawing().deviation.greatest < 0.3, "mm"
    drawings.close()


class FakePlacer:
    """Knows where pixels are on a board, once it is asked."""

    version, why, height = 1, "", None

    def __init__(self, where):
        self.where = where

    def update(self, image):
        pass

    def place_at(self, pixel, height):
        return self.where(pixel)

    def board_place(self, marker, pixel):
        return None


def homography(function):
    """The matrix of a function from cm to px."""
    corners = np.array([(6.0, -8.0), (6.0, 8.0), (18.0, -8.0), (18.0, 8.0)])
    pixels = np.array([function(p) for p in corners])
    return cv2.getPerspectiveTransform(corners.astype(np.float32), pixels.astype(np.float32))


def test_while_a_camera_is_not_where_it_was_nothing_is_shown_and_then_all_is_learned_anew(
    scene, drawings
):
    placer = scene.watchers[0]._placer = FakePlacer(lambda uv: None)
    scene.look_around()
    revision = drawings.state().revision
    placer.why = "camera or board has moved, by 3 px"
    scene.show()
    assert drawings.view("A") is None
    assert drawings.drawing().views == {}
    assert drawings.state().unmapped == {"A": "camera or board has moved, by 3 px"}
    assert drawings.state().revision > revision
    placer.why = ""
    scene.show()
    assert drawings.view("A"), "it is back where it was"
    placer.version = 2
    scene.show()
    assert drawings.view("A") is None
    assert "let the arm look around again" in drawings.state().unmapped["A"]


def test_where_a_board_tells_the_papers_place_wish_and_ink_are_shown_there(scene, drawings):
    scene.look_around()
    drawings.look_around()
    scene.tell("drawing", down=True)
    scene.show(tip=None)
    for k in range(10):
        scene.show(tip=(100 + 5 * k, 120))
        scene.tell("drawing", down=True)
    (_, above) = drawings.ink("A", -1, 0)
    lower = np.array([[1.0, 0, 7], [0, 1, 20], [0, 0, 1]]) @ drawings.view("A").matrix
    drawings._paper.boards["A"].view = TableView(lower, 5, 0.5, "the board on the table")
    (_, on_paper) = drawings.ink("A", -1, 0)
    assert len(on_paper) == len(above) > 5
    for seen, shown in zip(above, on_paper, strict=True):
        assert (shown.u, shown.v) == pytest.approx((seen.u + 7, seen.v + 20))
    assert drawings.state().source == "the board on the table"
    assert drawings.state().misfit == 0.5


def test_a_height_that_is_typed_has_wish_and_ink_shown_on_the_paper(scene, drawings):
    scene.look_around()
    assert not drawings.state().is_on_paper
    assert drawings.state().asks_height
    before = drawings.view("A").to_picture(np.array([(13.0, 0.0)]))[0]
    revision, (version, _) = drawings.state().revision, drawings.ink("A", -1, 0)
    assert drawings.set_marker_height(25.0) == ""
    state = drawings.state()
    assert (state.marker.cm, state.marker.source) == (2.5, "as typed here")
    assert state.is_on_paper
    assert state.revision > revision
    assert drawings.ink("A", -1, 0)[0] > version
    # A camera over the middle of the table sees what is lower nearer to its middle.
    after = drawings.view("A").to_picture(np.array([(13.0, 0.0)]))[0]
    assert np.hypot(*(after - before)) > 1.0
    assert drawings.set_marker_height(None) == ""
    assert drawings.view("A").to_picture(np.array([(13.0, 0.0)]))[0] == pytest.approx(before)
    assert drawings.set_marker_height(900.0) == "marker's height 900 mm: from 0 to 500 mm"
    assert drawings.set_marker_height(math.nan) == "marker's height nan mm: from 0 to 500 mm"


def test_heights_are_told_touched_or_remembered_in_this_order(tmp_path):
    memory = HeightMemory(tmp_path / "heights.json", ARM.name)
    first = DrawScene(tmp_path, arm=ARM, memory=memory).controller.drawings
    assert first.state().marker == MarkerHeight()
    assert first.set_marker_height(30.0) == ""
    again = PaperViews(DrawingArm(ARM, None, memory), {})
    assert again.height == MarkerHeight(3.0, "as typed here before")
    scene = PageScene(tmp_path)
    scene.watchers[0]._placer = FakePlacer(lambda uv: None)
    scene.watchers[0]._placer.height = 2.2
    feeds = scene.controller._cameras
    assert (
        PaperViews(DrawingArm(ARM, None, memory), feeds).height.source == "by the touched crosses"
    )
    reported = MarkerHeight(2.5, "as --marker-height says")
    assert PaperViews(DrawingArm(ARM, reported, memory), feeds).height == reported
    in_space = PaperViews(DrawingArm(SPATIAL, None, None), feeds)
    assert "needs no height of its marker" in in_space.set_height(25.0)


def test_of_a_drawing_that_was_cleared_nothing_is_left(scene, drawings):
    drawings.choose("rose")
    scene.drawn()
    revision = drawings.state().revision
    assert drawings.clear() == ""
    assert drawings.drawing().placed is None
    assert drawings.state().revision > revision
    assert not drawings.state().can_start


def test_what_comes_after_a_drawing_that_was_cleared_is_read(scene, drawings):
    drawings.load("square.svg", SQUARE)
    scene.drawn()
    drawings.clear()
    drawings.load("broken.svg", b"<svg")
    scene.drawn()
    assert "broken.svg" in drawings.state().trouble
    drawings.choose("rose")
    assert scene.drawn().placed.name == "rose"


def png(grey):
    """A picture's file."""
    return cv2.imencode(".png", grey)[1].tobytes()


def discs():
    """A dark disc and a lighter one on white paper, uint8."""
    grey = np.full((120, 160), 255, np.uint8)
    cv2.circle(grey, (45, 60), 16, 20, -1)
    cv2.circle(grey, (115, 60), 16, 130, -1)
    return grey


@pytest.mark.long
def test_a_picture_is_traced_as_the_sliders_say_and_lies_where_it_was(scene, drawings):
    drawings.load("discs.png", png(discs()))
    assert drawings.state().tracing == Tracing()
    drawings.place(Placing(14.0, -1.0, 6.0, 20.0))
    hatched = scene.drawn().placed
    assert drawings.trace_picture(Tracing(50.0, 0, 30.0)) == ""
    assert drawings.state().tracing == Tracing(50.0, 0, 30.0)
    outlined = scene.drawn().placed
    assert outlined.strokes == 2, "an outline each"
    assert hatched.strokes > 15
    assert 0 < outlined.seconds < hatched.seconds
    assert (outlined.centre, outlined.rotate) == ((14.0, -1.0), 20.0)
    assert max(outlined.size) == pytest.approx(6.0)
    assert drawings.start() == ""
    assert scene.server.offered.job.header.strokes == outlined.strokes


@pytest.mark.short(every=2)
@pytest.mark.parametrize("order", ["place", "trace_picture"])
def test_what_was_planned_before_is_not_started_any_more(scene, drawings, order):
    drawings.load("discs.png", png(discs()))
    scene.drawn()
    drawings._request._worker.ask = lambda request: None  # it takes its time
    wish = Placing(14.0) if order == "place" else Tracing(shades=1)
    assert getattr(drawings, order)(wish) == ""
    assert not drawings.state().can_start
    assert drawings.drawing().placed.seconds is None
    assert drawings.start() == "it is not planned yet; wait a moment"
    assert scene.server.sent == []


def test_a_picture_that_shows_nothing_at_first_can_be_traced_otherwise(scene, drawings):
    faint = np.full((120, 160), 255, np.uint8)
    cv2.circle(faint, (80, 60), 40, 236, -1)
    drawings.load("faint.png", png(faint))
    scene.drawn()
    state = drawings.state()
    assert re.match("faint.png: .*detail = 50 .*shades = 3", state.trouble)
    assert (state.is_there, state.tracing) == (False, Tracing())
    drawings.trace_picture(Tracing(100.0, 3, 0.0))
    assert scene.drawn().placed.strokes == 1
    assert drawings.state().trouble == ""


@pytest.mark.long
def test_sliders_that_leave_nothing_say_so_and_what_was_drawn_stays_in_sight(scene, drawings):
    drawings.load("discs.png", png(discs()))
    before = scene.drawn().placed
    drawings.trace_picture(Tracing(0.0, 0, 30.0))
    placed = scene.drawn().placed
    assert len(placed.reachable) == len(before.reachable)
    assert placed.why_not.startswith("detail = 0 and shades = 0: ")
    assert not drawings.state().can_start
    drawings.trace_picture(Tracing(0.0, 1, 30.0))
    assert scene.drawn().placed.why_not == ""
    assert drawings.state().can_start


@pytest.mark.short(every=4)
@pytest.mark.parametrize(
    ("order", "argument"),
    [("choose", "rose"), ("write", "LEGO"), ("load", SQUARE), ("load", png(discs())[:200])],
)
def test_only_of_a_picture_it_is_told_how_it_is_traced(scene, drawings, order, argument):
    names = ["it.png"] if order == "load" else []
    getattr(drawings, order)(*names, argument)
    scene.drawn()
    assert drawings.state().tracing is None
    assert drawings.trace_picture(Tracing()) == (
        "there is no picture to trace; drop a PNG or JPEG first"
    )


@pytest.fixture
def worker():
    answers = []
    worker = DrawingWorker(ARM, lambda *answer: answers.append(answer))
    yield worker, answers
    worker.close()


def last(answers):
    until(lambda: answers and answers[-1][2], "the last answer")
    return answers[-1][1]


@pytest.mark.long
def test_what_a_process_that_is_killed_has_written_goes_with_it(worker):
    worker, answers = worker
    worker.ask(Request(1, Source("gallery", "rose"), Placing(14.0, 0.0, 5.0)))
    last(answers)
    folder = Path(worker._folder.name)
    assert list(folder.iterdir()) == []
    (folder / "drawing.job.part").write_text("half")
    worker.close()
    assert not folder.exists()


def test_the_process_writes_into_the_folder_that_it_is_given(tmp_path, monkeypatch):
    monkeypatch.setattr(tempfile, "tempdir", None)
    for name in (
        "signal.signal",
        "platforms.lower_priority",
        "platforms.limit_memory",
        "cv2.setNumThreads",
    ):
        monkeypatch.setattr(f"laptop.page.drawing_planner.{name}", lambda *words: None)
    ours, theirs = multiprocessing.Pipe()
    ours.close()
    drawing_planner.work(theirs, ARM, str(tmp_path))
    assert tempfile.gettempdir() == str(tmp_path)


def test_a_job_that_cannot_be_offered_is_told(scene, drawings, monkeypatch):
    def refuse(file, **words):
        raise BadJob(f"{file} is longer than may be")

    drawings.load("square.svg", SQUARE)
    scene.drawn()
    monkeypatch.setattr(draw_job, "JobOffer", refuse)
    assert drawings.start() == "the drawing is longer than may be"


@pytest.mark.long
def test_the_process_plans_and_one_that_dies_is_replaced(worker):
    worker, answers = worker
    worker.ask(Request(1, Source("gallery", "rose"), Placing(14.0, 0.0, 5.0)))
    assert isinstance(last(answers), PlacedDrawing)
    assert last(answers).job
    assert answers[0][1].seconds is None, "where it lies is told before it is planned"
    first = worker._process
    first.kill()
    first.join()
    answers.clear()
    worker.ask(Request(1, Source("gallery", "rose"), Placing(15.0, 0.0, 5.0)))
    assert last(answers) == "this needs too much memory; make the drawing simpler" or last(
        answers
    ).centre == (15.0, 0.0)
    answers.clear()
    worker.ask(Request(1, Source("gallery", "rose"), Placing(16.0, 0.0, 5.0)))
    assert last(answers).centre == (16.0, 0.0)
    assert worker._process.pid != first.pid
