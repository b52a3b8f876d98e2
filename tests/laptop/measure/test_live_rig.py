"""A live rig: a synthetic camera's frames, an emulated brick that is linked, both in real time."""

from pathlib import Path
from types import SimpleNamespace

import jobs
import pytest
from arms import PLANAR as ARM
from waiting import PATIENCE

from laptop.cli.rigs import RigOptions, live_rig
from laptop.measure import live_rig as live
from laptop.measure.run_data import BadMeasurement
from robot.motion import kinematics
from shared.job_log import LogRow
from shared.job_messages import DONE, DRAWING, JobStatus
from shared.messages import EFFECTOR, Observation

WAYS = [[(9.0, 2.0), (12.0, 4.0)], [(12.0, 4.0), (14.0, -2.0)]]
SCENE = "fps=10,jpeg=0,exposure=0.004"


@pytest.mark.long
def test_a_job_is_done_and_seen_and_one_that_fails_is_told(tmp_path, monkeypatch):
    monkeypatch.setenv("BRICKSERVO_STATE", str(tmp_path / "state"))
    job = Path(jobs.write(tmp_path, WAYS, log=0.05, rest=1.5))
    other = ARM._replace(joints=(ARM.joints[0]._replace(link=8.0), ARM.joints[1]))
    wrong = Path(jobs.write(tmp_path, [[(8.0, 2.0), (10.0, 4.0)]], other, "wrong", rest=0.5))
    told = []
    asked = RigOptions(["synthetic"], "planar", SCENE, port=0, host="127.0.0.1")
    with live_rig(asked, told.append) as rig:
        assert rig.image().shape == (480, 640, 3)
        rig.wait_for_brick(PATIENCE)
        run = rig.measure(job)
        rests = run.rests()
        assert rests.stroke.tolist() == [1, 2]
        assert (rests.seen >= 2).all()
        # Where two rests are apart by cm they are so in the picture, too.
        apart = [kinematics.distance(*way) for way in [(WAYS[0][1], WAYS[1][1])]]
        moved = ((rests.pixel[1] - rests.pixel[0]) ** 2).sum() ** 0.5
        assert 5 < moved / apart[0] < 40, "px/cm"
        assert len(run.motors()[0]) > 20
        assert {status.strokes for status in told} >= {2}
        with pytest.raises(BadMeasurement, match="the brick has failed: .*was planned for planar"):
            rig.measure(wrong)


class OneBrick:
    """A server whose brick draws what it is offered: every look finds it one state further."""

    def __init__(self):
        self.drawn, self.progress, self.to_tell = 0, None, []

    def offer(self, offer):
        self.to_tell = [None, DRAWING, DONE]
        self.offered = offer
        return True

    def send(self, message):
        return True

    def state(self):
        if self.to_tell:
            state = self.to_tell.pop(0)
            if state == DONE:
                self.drawn += 1
                self.offered.log.append(LogRow(1, 0.0, 0.0, False, (0.0, 0.0)))
            if state:
                told = 10.0 * self.drawn + (state == DONE)
                crc = self.offered.draw.crc
                self.progress = JobStatus(told, crc, "", state, 1, 1, 0, 1, None, False, "")
        return SimpleNamespace(client="brick", progress=self.progress, lost="")


def test_the_same_job_offered_again_is_drawn_again(tmp_path):
    job, brick = Path(jobs.write(tmp_path, WAYS, log=0.05)), OneBrick()
    rig = live.LiveRig(ARM, [], brick, live.SightCollector(brick))
    for times in (1, 2):
        assert rig.measure(job).rows
        assert brick.drawn == times


class RelinkedBrick(OneBrick):
    """One whose link breaks in mid-job, and is there again with no word of the job yet."""

    def __init__(self, again):
        super().__init__()
        self.again = again

    def offer(self, offer):
        super().offer(offer)
        self.to_tell = [*[DRAWING] * 30, *["relinked"] * 5, *[DONE] * self.again]
        return True

    def state(self):
        if self.to_tell[:1] == ["relinked"]:
            self.to_tell.pop(0)
            self.progress = None
            return SimpleNamespace(client="brick", progress=None, lost="")
        return super().state()


@pytest.mark.parametrize("again", [True, False])
def test_a_link_that_breaks_late_in_a_job_and_mends_ends_it_only_if_the_brick_stays_silent(
    tmp_path, monkeypatch, again
):
    job, brick, now = Path(jobs.write(tmp_path, WAYS, log=0.05)), RelinkedBrick(again), [0.0]
    clock = SimpleNamespace(
        monotonic=lambda: now[0], sleep=lambda s: now.__setitem__(0, now[0] + 10 * s)
    )
    monkeypatch.setattr(live, "time", clock)
    rig = live.LiveRig(ARM, [], brick, live.SightCollector(brick))
    if again:
        assert rig.measure(job).rows
        assert now[0] > live.BEGIN_TIMEOUT
    else:
        with pytest.raises(BadMeasurement, match="the link broke, and since then the brick says"):
            rig.measure(job)


def test_sights_are_kept_only_while_somebody_measures():
    passed = []
    collector = live.SightCollector(SimpleNamespace(publish=passed.append))
    seen = [Observation(t, "A", float(t), {EFFECTOR: (t, 2.0, 1.0)}) for t in range(4)]
    collector.publish(seen[0])
    collector.begin()
    collector.publish(seen[1])
    collector.publish(seen[2])
    assert collector.finish()["A"].pixels.tolist() == [[1.0, 2.0], [2.0, 2.0]]
    collector.publish(seen[3])
    assert collector.finish() == {}
    assert passed == seen, "the link gets them all"
