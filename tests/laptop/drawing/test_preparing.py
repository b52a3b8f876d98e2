"""From an artwork to a job: what is told, refused and written."""

from dataclasses import replace

import numpy as np
import pytest

from laptop.drawing import planning, preparing, timing
from laptop.drawing.artwork import Artwork, BadArtwork
from laptop.drawing.options import DrawingOptions
from laptop.record.figures.line_accuracy import distances
from robot.motion import kinematics
from shared import job
from shared.arm_description import find_arm, read_arm

ARMS = {name: read_arm(find_arm(name)) for name in ("planar", "spatial")}


def artwork(count=3):
    t = np.linspace(0, 2 * np.pi, 80)
    circle = np.column_stack([np.cos(t), np.sin(t)])
    square = np.array([(0, 0), (1, 0), (1, 1), (0, 1), (0, 0)], float)
    strokes = [shape + (3 * k, k % 2) for k in range(count) for shape in (circle, square)]
    return Artwork("shapes", tuple(strokes), ("round", "straight") * count)


@pytest.mark.parametrize("arm", ARMS)
def test_the_job_on_file_is_what_was_wished(arm, tmp_path):
    plan = preparing.prepare(artwork(), ARMS[arm], DrawingOptions(size=(8, None)))
    header = plan.write_job(tmp_path / "shapes.job")
    read = job.Job(str(tmp_path / "shapes.job"), ARMS[arm])
    assert read.header == header
    assert header.strokes == len(plan.strokes) == plan.after.strokes
    assert header.cm == pytest.approx(plan.cm, abs=0.1)
    assert header.seconds == pytest.approx(plan.estimate.seconds, abs=0.01)
    starts = []
    for k in range(1, header.strokes + 1):
        stroke = read.stroke(k)
        starts.append(stroke.start_s)
        for _, segments, end in stroke.pieces:
            tips = [[cubic[0] for cubic in cubics] for _, _, cubics, _ in segments] + [end]
            for q in tips:
                tip = kinematics.forward(ARMS[arm], q)
                assert (
                    min(distances(np.array([tip[:2]]), line)[0] for line in plan.placement.strokes)
                    < 0.02
                )
                assert arm == "planar" or tip[2] == pytest.approx(0, abs=0.01)
    assert starts == sorted(starts)
    assert 0 < starts[0] < starts[-1] < header.seconds


def test_what_is_out_of_reach_is_told_and_refused(tmp_path):
    plan = preparing.prepare(artwork(), ARMS["planar"], DrawingOptions(at=(20, 0), size=(8, None)))
    assert plan.missed
    assert plan.strokes
    with pytest.raises(kinematics.Unreachable, match="cannot be drawn"):
        plan.write_job(tmp_path / "x.job")
    assert list(tmp_path.iterdir()) == []


def test_or_left_out(tmp_path):
    options = DrawingOptions(at=(20, 0), size=(8, None), clip=True)
    plan = preparing.prepare(artwork(), ARMS["planar"], options)
    whole = sum(np.hypot(*np.diff(s, axis=0).T).sum() for s in plan.placement.strokes)
    assert 0 < plan.write_job(tmp_path / "x.job").cm < whole - 2


def test_nothing_left_is_refused_in_spite_of_clipping():
    options = DrawingOptions(at=(60, 0), size=(8, None), clip=True)
    plan = preparing.prepare(artwork(), ARMS["planar"], options)
    assert plan.strokes == ()
    with pytest.raises(kinematics.Unreachable, match="nothing is left"):
        plan.check()


def test_order_is_left_alone_if_that_is_wished():
    lines = tuple(np.array([(0.0, k), (5.0, k)]) for k in (3, 0, 2, 1))
    given = Artwork("lines", lines, ("",) * 4)
    kept = preparing.prepare(given, ARMS["planar"], DrawingOptions(order=False))
    assert [s.placed.number for s in kept.strokes] == [1, 2, 3, 4]
    better = preparing.prepare(given, ARMS["planar"])
    assert better.after.pen_up_cm < kept.after.pen_up_cm - 1
    assert kept.before == better.before


def test_a_layer_lies_where_it_is_in_the_whole():
    """So that two pens, each for a layer, register."""
    wished = DrawingOptions(size=(9, None), at=(12, 0), order=False)
    whole = preparing.prepare(artwork(), ARMS["planar"], wished)
    parts = [
        preparing.prepare(artwork(), ARMS["planar"], replace(wished, layers=(name,)))
        for name in ("round", "straight")
    ]
    for name, part in zip(("round", "straight"), parts, strict=True):
        same = [s.placed.points for s in whole.strokes if s.placed.layer == name]
        assert part.placement.scale == whole.placement.scale
        for stroke, points in zip(part.strokes, same, strict=True):
            assert stroke.placed.points == pytest.approx(points)


def test_layers_are_chosen_by_name():
    options = DrawingOptions(layers=("round",))
    plan = preparing.prepare(artwork(), ARMS["planar"], options)
    assert {s.placed.layer for s in plan.strokes} == {"round"}
    with pytest.raises(BadArtwork, match="'red'.*'round', 'straight'"):
        preparing.prepare(artwork(), ARMS["planar"], DrawingOptions(layers=("red",)))


def test_progress_grows_to_the_end():
    told = []
    preparing.prepare(artwork(2), ARMS["planar"], progress=lambda *x: told.append(x))
    assert list(dict(told)) == list(preparing.STAGES)
    shares = [share for _, share in told]
    assert shares == sorted(shares)
    assert shares[-1] == 1


@pytest.mark.parametrize("value", [np.nan, np.inf, 1e300])
def test_points_that_are_no_places_are_refused(value):
    bad = Artwork("bad", (np.array([(0, 0), (value, 1)]),), ("",))
    with pytest.raises(BadArtwork, match="no place"):
        preparing.prepare(bad, ARMS["planar"])


def test_slower_takes_longer():
    fast, slow = (
        preparing.prepare(artwork(2), ARMS["planar"], DrawingOptions(speed=s, size=(8, None)))
        for s in (12, 1)
    )
    assert slow.estimate.seconds > 1.5 * fast.estimate.seconds
    assert max(m._segments[k][0] for s in slow.strokes for m in s.motions
               for k in range(len(m._segments))) <= 1 + 1e-9  # fmt: skip


def test_a_stroke_too_long_for_the_brick_is_drawn_in_parts(monkeypatch, tmp_path):
    monkeypatch.setattr(job, "MAX_LINE", 9000)
    t = np.linspace(0, 20 * np.pi, 800)
    spiral = np.column_stack([np.cos(t), np.sin(t)]) * t[:, None] / 20
    zigzag = np.column_stack([np.arange(30) / 8, np.arange(30) % 2])
    plan = preparing.prepare(Artwork("long", (spiral, zigzag), ("", "")), ARMS["planar"])
    assert len(plan.strokes) > 4
    plan.write_job(tmp_path / "long.job")  # no line is too long
    drawn = sum(np.hypot(*np.diff(s, axis=0).T).sum() for s in plan.placement.strokes)
    assert plan.cm == pytest.approx(drawn, rel=0.01)
    for a, b in zip(plan.strokes, plan.strokes[1:], strict=False):
        if a.placed.number == b.placed.number:
            assert a.motions[-1].end == pytest.approx(b.motions[0].start, abs=1e-6)


def test_postures_are_kept_where_they_can_be():
    plan = preparing.prepare(artwork(), ARMS["planar"])
    assert len({stroke.posture for stroke in plan.strokes}) == 1
    down = preparing.prepare(artwork(), ARMS["planar"], DrawingOptions(elbow="down"))
    assert {stroke.posture for stroke in down.strokes} == {"down"}
    assert all(m.end[1] < 0 for stroke in down.strokes for m in stroke.motions)


# ---- the estimate


def test_a_stroke_more_takes_a_lift_a_way_and_its_own_time_more():
    lines = tuple(np.array([(0.0, k), (4.0, k)]) for k in range(3))
    options = DrawingOptions(size=(4, None), at=(12, 0), order=False)
    two, three = (
        preparing.prepare(Artwork("lines", lines[:n], ("",) * n), ARMS["planar"], options)
        for n in (2, 3)
    )
    assert three.estimate.drawing_s == pytest.approx(1.5 * two.estimate.drawing_s, rel=0.25)
    assert 2.5 < three.estimate.seconds - two.estimate.seconds < 6


def test_strokes_that_go_on_where_the_last_ended_need_no_lift():
    line = np.array([(0.0, 0.0), (3.0, 0.0), (3.0, 3.0)])
    options = DrawingOptions(size=(3, None), at=(12, 0), order=False)
    joined = Artwork("joined", (line[:2], line[1:]), ("", ""))
    apart = Artwork("apart", (line[:2], line[:0:-1]), ("", ""))
    one, other = (preparing.prepare(a, ARMS["planar"], options).estimate for a in (joined, apart))
    assert one.seconds < other.seconds - 1.5


@pytest.mark.parametrize(
    ("name", "kind"),
    [("planar", timing.DIRECT), ("geared", timing.GEARED), ("spatial", timing.IN_SPACE)],
)
def test_the_kind_of_arm_is_known(name, kind):
    assert timing.kind_of(read_arm(find_arm(name))) == kind


def test_planning_is_that_of_the_brick():
    plan = preparing.prepare(artwork(1), ARMS["planar"], DrawingOptions(order=False))
    stroke = plan.strokes[1]  # the square: four straight pieces
    assert isinstance(stroke, planning.PlannedStroke)
    assert len(stroke.motions) == 4
    corners = [kinematics.forward(ARMS["planar"], m.end) for m in stroke.motions]
    assert np.array(corners) == pytest.approx(plan.placement.strokes[1][1:], abs=1e-6)
