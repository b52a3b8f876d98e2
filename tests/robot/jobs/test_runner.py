"""A job is drawn, held on its path and gone on with, judged by the true ink."""

import json
import math
import re

import jobs
import pytest
from drawn_jobs import Drawn
from rig import described, switched_on

from laptop.emulator.brick_home import wanted_paths
from robot.jobs.progress import load_progress
from robot.jobs.runner import max_offset
from robot.motion import kinematics
from shared.job import BadJob, Job

SQUARE = [(9.0, 2.0), (13.0, 2.0), (13.0, 6.0), (9.0, 6.0), (9.0, 2.0)]
LONG = [(6.0, 10.0), (13.0, -2.0)]


@pytest.fixture(autouse=True)
def state(tmp_path, monkeypatch):
    monkeypatch.setenv("BRICKSERVO_STATE", str(tmp_path))
    monkeypatch.delenv("BRICKSERVO_PLAN", raising=False)


def off_path(sample, path):
    """Distance of a sample from a way, mm."""
    best = math.inf
    for (ax, ay), (bx, by) in zip(path, path[1:]):
        ux, uy = bx - ax, by - ay
        share = ((sample.x - ax) * ux + (sample.y - ay) * uy) / (ux * ux + uy * uy)
        share = min(max(share, 0.0), 1.0)
        best = min(best, math.hypot(sample.x - ax - share * ux, sample.y - ay - share * uy))
    return 10 * best


def apart_mm(a, b):
    return 10 * math.hypot(a.x - b.x, a.y - b.y)


def standing(strokes, within=0.02):
    """The longest time for which the pen is down and the tip stays `within` so many cm, s."""
    longest = 0.0
    for ink in strokes:
        first = 0
        for sample in ink:
            while math.hypot(sample.x - ink[first].x, sample.y - ink[first].y) > within:
                first += 1
            longest = max(longest, sample.t - ink[first].t)
    return longest


def test_every_stroke_is_drawn_with_the_pen_up_between_them(tmp_path):
    path = jobs.write(tmp_path)
    with switched_on(tmp_path) as rig:
        drawn = Drawn(rig, path)
        assert drawn.run()
    inks = rig.ink()
    assert len(inks) == 3
    for ink, points in zip(inks, jobs.CROSSES):
        assert max(off_path(sample, points) for sample in ink) < 2.5
        assert apart_mm(ink[-1], ink[-1]._replace(x=points[1][0], y=points[1][1])) < 2.5
    assert standing(inks) < 0.5
    assert not rig.brick.plant.pen_down
    assert re.match(r"\d+ %, stroke [23] of 3, 0:0\d left$", drawn.said[1])
    assert drawn.said[-1].startswith("done at 100 %")


def test_strokes_that_are_joined_are_drawn_without_lifting_the_pen(tmp_path):
    path = jobs.write(tmp_path, [SQUARE[:3], SQUARE[2:], LONG])
    with switched_on(tmp_path) as rig:
        Drawn(rig, path).run()
    first, second = rig.ink()
    assert max(off_path(sample, SQUARE) for sample in first) < 2.5
    assert max(off_path(sample, LONG) for sample in second) < 2.5
    assert standing([first, second]) < 0.5


@pytest.mark.short("planar-0.6")
@pytest.mark.parametrize("share", [0.25, 0.6])
@pytest.mark.parametrize("name", ["planar", "geared"])
def test_a_pause_lifts_the_pen_soon_and_no_ink_is_missing_or_twice(tmp_path, name, share):
    path = jobs.write(tmp_path, [LONG], name)
    with switched_on(tmp_path / "a", name) as rig:
        Drawn(rig, path).run()
    (ink,) = rig.ink()
    t = ink[0].t + share * (ink[-1].t - ink[0].t)
    with switched_on(tmp_path / "b", name) as rig:
        drawn = Drawn(rig, path, [(t, "pause"), (t + 4, "resume")])
        assert drawn.run()
    before, after = rig.ink()
    paused = drawn.begin + t
    assert 0 < before[-1].t - paused < 0.5
    assert after[0].t > paused + 4
    assert apart_mm(before[-1], after[0]) < 1.0
    assert standing([before, after]) < 0.5
    limit = {"planar": 2.5, "geared": 0.6}[name]
    assert max(off_path(sample, LONG) for sample in before + after) < limit
    still = [s for s in rig.brick.record if before[-1].t + 1 < s.t < t + 4]
    assert max(apart_mm(still[0], sample) for sample in still) < 0.3
    assert any(line.startswith("paused at") for line in drawn.said)


@pytest.mark.long
def test_a_pause_at_a_corner_and_between_strokes_loses_nothing(tmp_path):
    path = jobs.write(tmp_path, [SQUARE, LONG])
    with switched_on(tmp_path / "a") as rig:
        Drawn(rig, path).run()
    square, long = rig.ink()
    corner = next(s.t for s in square if off_path(s, [(13.0, 6.0), (13.0, 6.01)]) < 1.0)
    for k, t in enumerate((corner - 0.1, corner, square[-1].t + 0.6, long[0].t - 0.15)):
        with switched_on(tmp_path / str(k)) as rig:
            assert Drawn(rig, path, [(t, "pause"), (t + 3, "resume")]).run()
        inks = rig.ink()
        ink = [sample for one in inks for sample in one]
        assert len(inks) == (3 if t < square[-1].t else 2) + (k == 3)  # it was just coming down
        for p in SQUARE + LONG:
            assert min(10 * math.hypot(s.x - p[0], s.y - p[1]) for s in ink) < 3.5
        assert standing(inks) < 0.5


def test_an_abort_lifts_the_pen_and_ends(tmp_path):
    path = jobs.write(tmp_path, [LONG, SQUARE])
    with switched_on(tmp_path) as rig:
        drawn = Drawn(rig, path, [(4.0, "abort")])
        assert not drawn.run()
    assert len(rig.ink()) <= 1
    assert not rig.brick.plant.pen_down
    assert drawn.said[-1].startswith("aborted at")
    assert not rig.brick.driven()


@pytest.mark.long
def test_a_paused_job_is_aborted_where_it_stands(tmp_path):
    path = jobs.write(tmp_path, [LONG, SQUARE])
    with switched_on(tmp_path / "a") as rig:
        Drawn(rig, path).run()
    begins = rig.ink()[0][0].t
    with switched_on(tmp_path / "b") as rig:
        orders = [(begins + 0.3, "pause"), (begins + 3.4, "abort")]
        assert not Drawn(rig, path, orders).run()
        assert rig.world.now() < begins + 5.4
    (ink,) = rig.ink()
    assert ink[-1].t < begins + 1.0


@pytest.mark.long
@pytest.mark.parametrize(
    ("share", "order", "slower", "lifts"),
    [(0.5, None, 1.3, 0), (1.0, "speed 80", 1.05, 0), (1.0, "speed 30", 1.3, 1),
     (0.4, "speed 90", 0.9, 1)],
)  # fmt: skip
def test_speed_is_changed_on_the_way_and_greatly_only_with_the_pen_up(
    tmp_path, share, order, slower, lifts
):
    path = jobs.write(tmp_path, [LONG])
    with switched_on(tmp_path / "a") as rig:
        Drawn(rig, path).run()
    (ink,) = rig.ink()
    usual = ink[-1].t - ink[0].t
    with switched_on(tmp_path / "b") as rig:
        drawn = Drawn(rig, path, [(ink[0].t + 0.5, order)] if order else (), share)
        assert drawn.run()
    inks = rig.ink()
    assert len(inks) == 1 + lifts
    assert sum(one[-1].t - one[0].t for one in inks) > slower * usual
    assert max(off_path(sample, LONG) for one in inks for sample in one) < 2.5
    for one, other in zip(inks, inks[1:]):
        assert apart_mm(one[-1], other[0]) < 1.0
    assert standing(inks) < 0.5


@pytest.mark.long
def test_a_pen_that_is_to_come_deeper_does_so_when_it_next_comes_down(tmp_path):
    path = jobs.write(tmp_path)
    angles = []
    with switched_on(tmp_path) as rig:
        rig.world.bodies.append(lambda t: angles.append((t, rig.brick.motors["C"].position)))
        Drawn(rig, path, [(5.0, "pen 15")]).run()
    first, *_, last = rig.ink()
    lows = [max(angle for t, angle in angles if ink[0].t < t < ink[-1].t) for ink in (first, last)]
    assert first[0].t < 5.0 < last[0].t
    assert lows[1] - lows[0] == pytest.approx(15, abs=2)


def test_nudges_over_the_first_point_put_a_zero_right_that_was_found_a_little_off(tmp_path):
    path = jobs.write(tmp_path, [LONG, SQUARE], "geared")
    off = [math.radians(1.0), math.radians(-1.5)]
    with switched_on(tmp_path, "geared") as rig:
        zero = dict(rig.on_file()["zero"])
        for joint, error in zip(rig.arm.joints, off):
            zero[joint.port] += math.degrees(error) * joint.gear * joint.direction
        rig.state.save(zero, dict.fromkeys(zero, 0))
        # By the wrong zero, each joint turns so much too far.
        q = kinematics.inverse(rig.arm, LONG[0])
        there = kinematics.forward(rig.arm, [a + b for a, b in zip(q, off)])
        missing = [10 * (a - b) for a, b in zip(LONG[0], there)]
        assert math.hypot(*missing) > 1.5
        first = [f"nudge {missing[0] / 2} 0", f"nudge {missing[0] / 2} {missing[1]}"]
        orders = [(3.0, "pause"), (7, first[0]), (7.1, first[1]), (12, "resume")]
        Drawn(rig, path, orders).run()
        for port, correct in (("A", 0.0), ("B", 0.0)):
            assert rig.on_file()["zero"][port] == pytest.approx(correct, abs=0.3)
    for ink, points in zip(rig.ink(), (LONG, SQUARE)):
        assert max(off_path(sample, points) for sample in ink) < 0.7


@pytest.mark.long
def test_a_nudge_in_mid_stroke_shifts_where_the_pen_comes_down_again(tmp_path):
    path = jobs.write(tmp_path, [LONG], "geared")
    with switched_on(tmp_path, "geared") as rig:
        orders = [(8.0, "pause"), (9.0, "nudge 3 0"), (15.0, "resume")]
        Drawn(rig, path, orders).run()
    before, after = rig.ink()
    assert after[0].x - before[-1].x == pytest.approx(0.3, abs=0.1)
    assert after[0].y - before[-1].y == pytest.approx(0.0, abs=0.1)


@pytest.mark.long
def test_a_nudge_beyond_the_reach_is_refused_and_nothing_is_lost(tmp_path):
    path = jobs.write(tmp_path, [[(20.2, 0.0), (19.0, 4.0)]])
    with switched_on(tmp_path) as rig:
        orders = [(1.5, "pause"), (4, "nudge 10 0"), (8, "resume")]
        drawn = Drawn(rig, path, orders)
        assert drawn.run()
    assert any("not shifted" in line for line in drawn.said)
    assert len(rig.ink()) == 1


# Several pens


@pytest.mark.parametrize("joined", [False, True])
def test_before_another_pen_it_waits_with_the_pen_up_and_says_which(tmp_path, joined):
    shapes = [SQUARE[:3], SQUARE[2:]] if joined else list(jobs.CROSSES[:2])
    path = jobs.write(tmp_path, [LONG, *shapes], layers=["red", "red", "black"], pens="change")
    with switched_on(tmp_path) as rig:
        drawn = Drawn(rig, path, [(60.0, "resume")])
        assert drawn.run()
    red, also_red, black = rig.ink()
    assert also_red[-1].t < drawn.begin + 30
    assert black[0].t > drawn.begin + 60
    still = [s for s in rig.brick.record if also_red[-1].t + 2 < s.t < drawn.begin + 60]
    assert max(apart_mm(still[0], sample) for sample in still) < 0.3
    assert max(off_path(sample, LONG) for sample in red) < 2.5
    assert max(off_path(sample, shapes[1]) for sample in black) < 2.5
    assert drawn.said[0] == "the first pen is for 'red'"
    (asked,) = (line for line in drawn.said if line.startswith("paused"))
    assert asked.endswith("stroke 3 of 3: put in the pen for 'black', then resume")


def test_a_new_pen_is_touched_up_over_its_first_point(tmp_path):
    path = jobs.write(tmp_path, [LONG, SQUARE], "geared", layers=["red", "black"], pens="touch-up")
    with switched_on(tmp_path, "geared") as rig:
        orders = [(60.0, "resume"), (75.0, "nudge 2 0"), (80.0, "resume")]
        drawn = Drawn(rig, path, orders)
        assert drawn.run()
    red, black = rig.ink()
    assert black[0].t > drawn.begin + 80
    over = [s for s in rig.brick.record if drawn.begin + 70 < s.t < drawn.begin + 75]
    assert apart_mm(over[0], over[0]._replace(x=SQUARE[0][0], y=SQUARE[0][1])) < 1.0
    shifted = [(x + 0.2, y) for x, y in SQUARE]
    assert max(off_path(sample, shifted) for sample in black) < 1.2
    assert sum("then resume" in line for line in drawn.said) == 2
    assert any("nudge the tip until it meets" in line for line in drawn.said)


def test_pens_are_not_changed_where_none_is_down_or_the_job_does_not_ask(tmp_path):
    layers = ["red", "black", "red"]
    for folder, pens, dry in (("a", "change", True), ("b", "", False)):
        (tmp_path / folder).mkdir()
        path = jobs.write(tmp_path / folder, layers=layers, pens=pens)
        with switched_on(tmp_path / folder) as rig:
            drawn = Drawn(rig, path, dry=dry)
            assert drawn.run()
        assert not any("pen" in line for line in drawn.said)


def test_a_job_that_is_resumed_waits_for_the_pen_that_it_was_waiting_for(tmp_path):
    path = jobs.write(tmp_path, layers=["red", "black", "black"], pens="change")
    for first, waits in ((2, 1), (3, 0)):
        with switched_on(tmp_path / str(first)) as rig:
            drawn = Drawn(rig, path, [(40.0, "resume")])
            assert drawn.run(first)
        assert sum(line.startswith("paused") for line in drawn.said) == waits


def test_it_is_aborted_while_it_waits_for_a_pen(tmp_path):
    path = jobs.write(tmp_path, layers=["red", "black", "black"], pens="touch-up")
    with switched_on(tmp_path) as rig:
        assert not Drawn(rig, path, [(40.0, "abort")]).run()
    assert len(rig.ink()) == 1


# Crash and resume


def test_after_a_crash_only_the_stroke_under_way_is_drawn_again(tmp_path):
    strokes = [[(7.0 + k, 3.0), (7.5 + k, 7.0)] for k in range(6)]
    path = jobs.write(tmp_path, strokes)

    class Crash(BaseException):
        pass

    def crash():
        raise Crash

    with switched_on(tmp_path) as rig:
        drawn = Drawn(rig, path)
        drawn.orders.sample = lambda now: crash() if now - begin > 14 else 1.0
        begin = rig.world.now()
        with pytest.raises(Crash):
            drawn.runner.run()
        drawn.robot.park()
    first = rig.ink()
    assert drawn.said[-1].startswith("stopped at")
    assert 2 <= len(first) <= 5
    with switched_on(tmp_path) as rig:
        drawn = Drawn(rig, path)
        progress = load_progress(drawn.job.crc, drawn.job.header.strokes)
        drawn.run(progress.stroke, progress.repeat)
    second = rig.ink()
    drawn_first = [k for k, points in enumerate(strokes) if any(_is_of(i, points) for i in first)]
    drawn_next = [k for k, points in enumerate(strokes) if any(_is_of(i, points) for i in second)]
    whole = [k for k in drawn_first if k not in drawn_next]
    assert drawn_next == list(range(progress.stroke - 1, 6))
    assert set(drawn_first) | set(drawn_next) == set(range(6))
    assert len(drawn_first) - len(whole) <= 1, "drawn twice at most: the one under way"
    with pytest.raises(Exception, match="leave --resume out"):
        load_progress(drawn.job.crc, drawn.job.header.strokes)


def _is_of(ink, points):
    """Whether ink lies along these points, wherever it ends."""
    return max(off_path(sample, points) for sample in ink) < 3.0


def test_a_job_is_repeated_and_its_progress_counts_the_times(tmp_path):
    path = jobs.write(tmp_path, [LONG])
    with switched_on(tmp_path) as rig:
        drawn = Drawn(rig, path, [(12.0, "abort")], repeats=3)
        assert not drawn.run(repeats=3)
    assert len(rig.ink()) in (2, 3)
    progress = load_progress(drawn.job.crc, 1)
    assert progress.repeat in (2, 3)
    assert any(f"time {progress.repeat} of 3" in line for line in drawn.said)


def test_a_job_that_is_spoilt_on_the_way_fails_with_the_pen_up(tmp_path):
    path = jobs.write(tmp_path)

    def spoil():
        with open(path, "r+b") as file:
            file.seek(-400, 2)
            file.write(b"x" * 200)

    with switched_on(tmp_path) as rig:
        drawn = Drawn(rig, path, status=str(tmp_path / "status"))
        rig.world.at(rig.world.now() + 3, spoil)
        with pytest.raises(rig.its(BadJob)):
            drawn.run()
    assert not rig.brick.plant.pen_down
    with open(str(tmp_path / "status")) as file:
        status = json.load(file)
    assert status["state"] == "failed"
    assert "make it again" in status["reason"]


# What is told


def test_the_status_tells_how_it_goes_also_in_motion(tmp_path):
    path = jobs.write(tmp_path, [[(6.0, 10.0), (13.0, -2.0), (6.0, 10.1), (13.0, -1.9)]])
    status, seen = str(tmp_path / "status"), []

    def look():
        with open(status) as file:
            seen.append(json.load(file))

    with switched_on(tmp_path) as rig:
        drawn = Drawn(rig, path, status=status)
        for k in range(9):
            rig.world.at(rig.world.now() + 1.5 + k, look)
        drawn.run()
    look()
    assert seen[-1]["state"] == "done"
    assert seen[-1]["cm"] == seen[-1]["cm_all"] == pytest.approx(41.7, abs=0.5)
    lengths = [reported["cm"] for reported in seen]
    assert lengths == sorted(lengths)
    moving = [reported for reported in seen if reported["tip"]]
    assert moving
    for reported in moving:
        assert 6 <= reported["tip"][0] <= 13
        assert 0 <= reported["cm"] < reported["cm_all"]
        assert reported["left_s"] <= seen[0]["left_s"]


def test_no_tick_comes_late_for_what_is_told_in_motion(tmp_path):
    path = jobs.write(tmp_path, [LONG + [(6.0, 10.1)]])
    ticks, reported = [], []
    with switched_on(tmp_path) as rig:
        drawn = Drawn(rig, path, status=str(tmp_path / "status"))
        pace, report = drawn.robot.motors.loop.pace, drawn.report.update
        note = pace.update

        def noted(t, since, computing):
            ticks.append(since)
            note(t, since, computing)

        def updating(*args, **options):
            reported.append(options.get("moving", False))
            report(*args, **options)

        pace.update, drawn.report.update = noted, updating
        drawn.run()
    assert sum(reported) >= 2
    assert max(ticks) < 0.022


def test_the_wanted_path_is_told_to_whoever_watches(tmp_path, monkeypatch):
    plan = tmp_path / "plan"
    monkeypatch.setenv("BRICKSERVO_PLAN", str(plan))
    path = jobs.write(tmp_path, [SQUARE, LONG])
    with switched_on(tmp_path) as rig:
        Drawn(rig, path).run()
    reported = wanted_paths(str(plan), described("planar"))
    assert len(reported) == 2
    for points, wanted in zip(reported, (SQUARE, LONG)):
        assert points[0] == pytest.approx(wanted[0], abs=1e-3)
        assert points[-1] == pytest.approx(wanted[-1], abs=1e-3)
        assert jobs.length(points) == pytest.approx(jobs.length(wanted), rel=1e-3)


def test_how_far_two_parts_may_be_apart_grows_with_the_zero_found_anew(tmp_path):
    path = jobs.write(tmp_path)
    arm = described("planar")
    stroke = Job(path, arm).stroke(1)
    with switched_on(tmp_path) as rig:
        motors = rig.robot().joints
        same, anew = (10 * max_offset(rig.arm, motors, stroke, known) for known in (True, False))
    x, y = jobs.CROSSES[0][0]
    count = math.radians(1.0)
    assert same == pytest.approx(10 * count * (math.hypot(x, y) + 9.5), rel=1e-6)
    assert anew == pytest.approx(2 * same, rel=1e-6)


# Long ones


@pytest.mark.claims
def test_five_hundred_strokes_end_as_exactly_as_they_begin(tmp_path):
    strokes = [
        [(8 + 0.25 * (k % 25), 1 + 0.4 * (k // 25)), (9 + 0.25 * (k % 25), 2 + 0.4 * (k // 25))]
        for k in range(500)
    ]
    path = jobs.write(tmp_path, strokes)
    with switched_on(tmp_path) as rig:
        Drawn(rig, path).run()
        known = rig.robot().angles()
    inks = rig.ink()
    assert len(inks) == 500
    off = [max(off_path(s, points) for s in ink) for ink, points in zip(inks, strokes)]
    first, last = (sorted(part)[len(part) // 2] for part in (off[:100], off[-100:]))
    assert last < 1.3 * first + 0.1
    assert max(off) < 3.5
    assert max(abs(a - b) for a, b in zip(known, rig.q)) < math.radians(2.5)
    assert standing(inks) < 0.5
