"""`visual_servoing.py --wait` draws what the laptop offers, and does as it is told meanwhile."""

import math
import os
import signal
import statistics

import pytest
from drawn_jobs import move
from offered_jobs import planned_job
from servo_rig import PROGRAM

from laptop.emulator.host.runner import run_script
from laptop.emulator.virtual_tracker import LAPTOP_CLOCK_LEAD
from laptop.see.serve.job_offer import JobOffer
from robot.jobs import linked
from robot.motion import kinematics
from shared.job import header_of, write_job
from shared.job_messages import Order
from shared.messages import Start, Stop

KILL, PID = os.kill, os.getpid()  # a program on the emulated brick has its own
LINES = [[(14.0, -4.0), (16.0, 0.0), (14.0, 4.0)], [(12.0, 4.0), (12.0, -4.0)]]
ENDED = ("done", "aborted", "failed")


class Laptop:
    """A laptop that offers a job, does what the test says at what is told, and ends all.

    Args:
        w: servo_rig.Watched.
        offer: JobOffer.
        react: called with the laptop and every new JobStatus.
        after: s after the job's end at which the program is ended.

    Attributes:
        reported: every JobStatus that came, in order.
        statuses: every Status.
        down: true times at which the pen was found on the paper, with the true tip.
        off: how far the joints truly were from where they were told to be, whenever that came, rad.
    """

    def __init__(self, w, offer, react=lambda laptop, progress: None, after=1.0):
        self.w, self._offer, self._react, self._after = w, offer, react, after
        self.reported, self.statuses, self.down, self.off = [], [], [], []
        self._over_at = None
        w.world.at(1.0, self._begin)

    @property
    def server(self):
        return self.w.tracker.server

    def _begin(self):
        if not self.server.offer(self._offer):
            self.w.world.at(self.w.world.t + 0.1, self._begin)
            return
        self._look()

    def _look(self):
        state, w = self.server.state(), self.w
        if state.status and (not self.statuses or state.status.t != self.statuses[-1].t):
            self.statuses.append(state.status)
            self.off.append(max(abs(a - b) for a, b in zip(state.status.q, w.q, strict=True)))
        progress = state.progress
        if progress and (not self.reported or progress != self.reported[-1]):
            self.reported.append(progress)
            self._react(self, progress)
        if progress and progress.state in ENDED and self._over_at is None:
            self._over_at = w.world.t + self._after
        pen = w.brick.motors["C"].position
        if pen > 45:
            self.down.append((w.world.t, w.tip))
        if self._over_at is not None and w.world.t >= self._over_at:
            KILL(PID, signal.SIGTERM)
            return
        w.world.at(w.world.t + 0.02, self._look)


@pytest.fixture
def offer(tmp_path):
    def make(w, lines=LINES, **how):
        return JobOffer(planned_job(tmp_path / "lines.job", w.arm, lines), **how)

    return make


def drawn(w, laptop):
    outcome = run_script(w.brick, PROGRAM, ["--wait"], timeout=1e4)
    assert (outcome.status, outcome.reason) == (143, "ended")
    assert not w.brick.driven()
    return laptop


def states(laptop):
    """What was told of it, one after the other, but for its being fetched."""
    seen = [progress.state for progress in laptop.reported if progress.state != "fetching"]
    return [state for k, state in enumerate(seen) if k == 0 or state != seen[k - 1]]


def off(point, lines=LINES):
    """How far a point is from the lines, cm."""
    nearest = math.inf
    for line in lines:
        for (x0, y0), (x1, y1) in zip(line, line[1:], strict=False):
            d = x1 - x0, y1 - y0
            share = ((point[0] - x0) * d[0] + (point[1] - y0) * d[1]) / math.hypot(*d) ** 2
            share = min(max(share, 0.0), 1.0)
            nearest = min(nearest, math.dist(point, (x0 + share * d[0], y0 + share * d[1])))
    return nearest


def test_it_draws_what_is_offered_and_tells_how_it_goes(watched, offer, capsys):
    w = watched(plant="cpu=0")
    laptop = drawn(w, Laptop(w, offer(w)))
    assert states(laptop) == ["drawing", "done"]
    last = laptop.reported[-1]
    assert (last.stroke, last.strokes, last.name, last.down) == (2, 2, "lines", False)
    assert last.cm == last.cm_all == pytest.approx(2 * math.sqrt(20) + 8, abs=0.01)
    assert max(off(tip) for _, tip in laptop.down) < 0.3
    ends = [min(math.dist(tip, end) for _, tip in laptop.down) for line in LINES for end in line]
    assert max(ends) < 0.3
    # The pen is told as it is: down twice, and only then.
    downs = [progress.down for progress in laptop.reported]
    assert sum(b and not a for a, b in zip([False, *downs], downs, strict=False)) == 2
    seconds = [p.seconds for p in laptop.reported if p.state == "drawing" and p.seconds is not None]
    assert seconds[0] > seconds[-1]
    assert "'lines': done" not in capsys.readouterr().err
    assert w.on_file()["parked"]


def test_what_a_job_logs_comes_by_the_laptops_clock(watched, tmp_path):
    w = watched(plant="cpu=0,backlash=0")
    arm = w.arm
    offer = JobOffer(planned_job(tmp_path / "a.job", arm, LINES, log=0.05, rest=0.5), dry=True)
    laptop = Laptop(w, offer)
    drawn(w, laptop)
    rows = offer.log
    assert [row.stroke for row in rows if row.rest] == [1, 2]
    assert len(rows) > 40
    record = {round(sample.t, 3): sample.q for sample in w.brick.record}
    for row in rows:
        t = row.t - LAPTOP_CLOCK_LEAD
        q = record[round(round(t / 0.005) * 0.005, 3)]
        assert max(abs(a - b) for a, b in zip(row.q, q, strict=True)) < math.radians(2.5)
    assert not laptop.down


def test_where_the_arm_is_goes_on_being_told(watched, offer):
    w = watched(plant="cpu=0")
    laptop = drawn(w, Laptop(w, offer(w)))
    times = [status.t for status in laptop.statuses]
    assert max(b - a for a, b in zip(times, times[1:], strict=False)) < 1.5
    assert {status.verdict for status in laptop.statuses} == {"ready"}
    placed = [kinematics.forward(w.arm, status.q) for status in laptop.statuses]
    on_the_way = [p for p in placed if off(p) < 0.3]
    assert len(on_the_way) > 10, "most of them, for most of the time it draws"
    # The links, not the motors: half the play is 1 degree. On the way a status is 20 ms old.
    assert math.degrees(statistics.quantiles(laptop.off, n=4)[2]) < 0.8
    assert math.degrees(max(laptop.off)) < 6.0


def test_a_pause_lifts_the_pen_and_a_resume_goes_on(watched, offer):
    w = watched(plant="cpu=0")
    ordered = {}

    def react(laptop, progress):
        if progress.cm > 3.0 and "pause" not in ordered:
            ordered["pause"] = w.world.t
            laptop.server.send(Order("pause", None))
        if progress.state == "paused" and "paused" not in ordered:
            ordered["paused"] = w.world.t
            w.world.at(w.world.t + 3.0, lambda: laptop.server.send(Order("resume", None)))

    laptop = drawn(w, Laptop(w, offer(w), react))
    assert states(laptop) == ["drawing", "paused", "drawing", "done"]
    lifted = [t for t, _ in laptop.down if t > ordered["pause"] + 1.0]
    assert lifted[0] > ordered["paused"] + 3.0, "nothing is drawn in the pause"
    assert max(t for t, _ in laptop.down if t < lifted[0]) < ordered["pause"] + 0.6
    assert max(off(tip) for _, tip in laptop.down) < 0.3


@pytest.mark.parametrize("how", ["abort", "stop"])
def test_an_abort_and_a_stop_end_it_with_the_pen_up(watched, offer, how):
    w = watched(plant="cpu=0")
    ordered = []

    def react(laptop, progress):
        if progress.cm > 3.0 and not ordered:
            ordered.append(w.world.t)
            word = Order("abort", None) if how == "abort" else Stop("stopped from the page")
            laptop.server.send(word)

    laptop = drawn(w, Laptop(w, offer(w), react))
    assert states(laptop) == ["drawing", "aborted"]
    assert laptop.reported[-1].reason == ("" if how == "abort" else "stopped from the page")
    assert max(t for t, _ in laptop.down) < ordered[0] + 0.6
    assert w.on_file()["parked"]


@pytest.mark.long
def test_a_start_meanwhile_is_ignored_and_a_run_after_it_is_done(watched, offer, capsys):
    w = watched(plant="cpu=0")
    sent = []

    def react(laptop, progress):
        if progress.cm > 3.0 and not sent:
            sent.append(1)
            laptop.server.send(Start(goals={"A": (400.0, 200.0)}))
        if progress.state == "done" and len(sent) == 1:
            sent.append(2)
            laptop.server.send(Start(goals={"A": (400.0, 200.0)}))

    laptop = drawn(w, Laptop(w, offer(w), react, after=20.0))
    assert states(laptop) == ["drawing", "done"]
    assert "a start of the laptop is ignored: a job is on" in capsys.readouterr().out
    assert laptop.statuses[-1].verdict == "converged"


@pytest.mark.long
def test_its_speed_and_pen_can_be_ordered_and_nonsense_is_told(watched, offer, capsys):
    w = watched(plant="cpu=0")
    sent = []

    def react(laptop, progress):
        if progress.state == "drawing" and not sent:
            sent.append(1)
            for order in (Order("speed", 30.0), Order("pen", 10.0), Order("speed", 500.0)):
                laptop.server.send(order)

    slow = drawn(w, Laptop(w, offer(w), react))
    assert "speed 500.0: give a number from 25 to 100 %" in capsys.readouterr().out
    duration = slow.down[-1][0] - slow.down[0][0]
    assert duration > 6.0


@pytest.mark.long
def test_without_a_pen_it_goes_the_same_way(watched, offer):
    w = watched(plant="cpu=0")
    laptop = drawn(w, Laptop(w, offer(w, dry=True)))
    assert states(laptop) == ["drawing", "done"]
    assert laptop.down == []
    assert not any(progress.down for progress in laptop.reported)
    placed = [kinematics.forward(w.arm, status.q) for status in laptop.statuses]
    assert len([p for p in placed if off(p) < 0.3]) > 10


class Cutter:
    """Takes the tracker away in mid-job, and brings it back after a while (s)."""

    def __init__(self, w, away):
        self.w, self.away, self.cut = w, away, None

    def __call__(self, laptop, progress):
        if progress.cm > 2.0 and progress.state == "drawing" and self.cut is None:
            self.cut = self.w.world.t
            self.w.tracker.restart(self.away)
        if progress.state == "paused" and "link was lost" in progress.reason:
            laptop.server.send(Order("resume", None))


def test_a_lost_link_pauses_it_until_it_is_back_and_resumed(watched, offer):
    w = watched(plant="cpu=0")
    laptop = drawn(w, Laptop(w, offer(w, [[(12.0, -8.0), (12.0, 8.0)]] * 3), Cutter(w, 12.0)))
    assert states(laptop)[-3:] == ["paused", "drawing", "done"]


@pytest.mark.long
def test_alone_it_goes_on_without_a_link(watched, offer):
    w = watched(plant="cpu=0")
    laptop = drawn(w, Laptop(w, offer(w, alone=True), Cutter(w, 20.0)))
    assert states(laptop) == ["drawing", "done"]
    assert laptop.reported[-1].cm == laptop.reported[-1].cm_all


@pytest.mark.long
def test_without_a_link_for_long_it_is_given_up(watched, offer):
    w = watched(plant="cpu=0")
    cutter = Cutter(w, linked.LINK_TIMEOUT + 10)
    laptop = drawn(w, Laptop(w, offer(w, [[(12.0, -8.0), (12.0, 8.0)]] * 3), cutter))
    assert states(laptop)[-1] == "aborted"
    assert f"no link for {linked.LINK_TIMEOUT:.0f} s" in laptop.reported[-1].reason
    assert max(t for t, _ in laptop.down) < cutter.cut + linked.LINK_PATIENCE + 1


@pytest.mark.long
def test_one_of_many_parts_tells_how_far_it_has_come(watched, offer):
    w = watched(plant="cpu=0")
    lines = [[(12 + 0.05 * k, -2.0), (12 + 0.04 * k, 2.0)] for k in range(40)]
    one = offer(w, lines)
    assert one.draw.parts > 5

    def react(laptop, progress):
        if progress.state == "drawing":
            laptop.server.send(Stop("enough"))

    laptop = drawn(w, Laptop(w, one, react))
    assert laptop.reported[0].state == "fetching"
    assert laptop.reported[0].cm_all in (0.0, 1.0)
    assert states(laptop)[-1] == "aborted"


@pytest.mark.long
def test_all_of_it_goes_at_the_pace_of_the_brick_too(watched, offer):
    w = watched()
    laptop = drawn(w, Laptop(w, offer(w)))
    assert states(laptop) == ["drawing", "done"]
    assert max(off(tip) for _, tip in laptop.down) < 0.4
    times = [status.t for status in laptop.statuses]
    assert max(b - a for a, b in zip(times, times[1:], strict=False)) < 3.0


@pytest.mark.long
def test_a_long_stroke_is_read_and_planned_with_the_laptop_heard(watched, offer, capsys):
    w = watched()
    zigzag = [(12 + 0.05 * k, -3.0 if k % 2 else 3.0) for k in range(60)]

    def react(laptop, progress):
        if progress.down:
            laptop.server.send(Stop("enough"))

    laptop = drawn(w, Laptop(w, offer(w, [zigzag]), react))
    assert states(laptop) == ["drawing", "aborted"]
    assert "not linked" not in capsys.readouterr().out
    times = [status.t for status in laptop.statuses]
    assert max(b - a for a, b in zip(times, times[1:], strict=False)) < 1.5


def test_a_job_of_another_arm_is_refused_and_says_why(watched, tmp_path):
    w = watched(plant="cpu=0")
    path = planned_job(tmp_path / "lines.job", w.arm, LINES)
    text = path.read_bytes().replace(b'"links":[11.3,9.5]', b'"links":[12.3,9.5]')
    path.write_bytes(text)
    import json
    import zlib

    *body, _ = text.splitlines(keepends=True)
    end = {"end": len(LINES), "crc": zlib.crc32(b"".join(body))}
    path.write_bytes(b"".join(body) + json.dumps(end).encode() + b"\n")
    laptop = drawn(w, Laptop(w, JobOffer(path)))
    assert states(laptop) == ["failed"]
    assert "was planned for planar (planar, links 12.3, 9.5 cm)" in laptop.reported[-1].reason
    assert laptop.down == []


def test_its_last_stroke_is_looked_at_before_the_first_is_drawn(watched, tmp_path):
    w = watched(plant="cpu=0")
    ways = ((0, 20), (40, 20), (-85, -120))  # of the shoulder; the runner itself looks one ahead
    strokes = [move((begin, 100), (end, 100)) for begin, end in ways]
    path = tmp_path / "beyond.job"
    write_job(str(path), header_of(w.arm, "beyond", 12.0, strokes, 0.0, 20.0), strokes)
    laptop = drawn(w, Laptop(w, JobOffer(path)))
    assert states(laptop) == ["failed"]
    told = "stroke 3 needs the shoulder at -120.0 deg, beyond its limits"
    assert told in laptop.reported[-1].reason
    assert not w.moved()


def test_a_first_stroke_that_is_not_there_is_refused(watched, offer):
    w = watched(plant="cpu=0")
    laptop = drawn(w, Laptop(w, offer(w, first=3)))
    assert laptop.reported[-1].state == "failed"
    assert "'lines' has 2 strokes" in laptop.reported[-1].reason


@pytest.mark.long
def test_it_can_begin_with_a_later_stroke(watched, offer):
    w = watched(plant="cpu=0")
    laptop = drawn(w, Laptop(w, offer(w, first=2)))
    assert states(laptop) == ["drawing", "done"]
    assert max(off(tip, LINES[1:]) for _, tip in laptop.down) < 0.3
