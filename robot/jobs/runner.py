"""Drawing of a job: stroke by stroke, pausing on its path where that is ordered.

All that takes the brick long is done while the pen is up: reading a stroke, planning how its
backlash is crossed, files. So strokes that join are read ahead, up to MAX_CHAIN_SIZE, and drawn in
one go as a PenPath. The one read last, which does not join, is the first of the next chain.
"""

import contextlib
import math
import os

from robot.drawing import append_to_plan
from robot.jobs.checking import joined
from robot.jobs.logbook import LoggingFeed
from robot.jobs.orders import POLL_PERIOD
from robot.jobs.pen_path import PenPath
from robot.jobs.progress import SavedProgress, forget_progress, save_progress
from robot.jobs.report import Place
from robot.motion import kinematics
from robot.motion.feed import FeedOverride
from robot.motion.online_trajectory import STOP
from robot.program import ignore_signals
from shared.job_log import LogRow
from shared.state import PLAN

MYPY = False
if MYPY:
    from typing import List, Optional, Protocol, Sequence, Tuple  # noqa: F401

    from robot.clock import Clock  # noqa: F401
    from robot.ev3.motor import Motor  # noqa: F401
    from robot.jobs.orders import JobOrders  # noqa: F401
    from robot.jobs.report import JobReport  # noqa: F401
    from robot.motion.arm import RobotArm  # noqa: F401
    from robot.motion.trajectory import Trajectory  # noqa: F401
    from shared.arm_description import Arm, Joint  # noqa: F401
    from shared.job import Job, Stroke  # noqa: F401

    class LogSink(Protocol):
        """A receiver of what a job logs."""

        def add(self, rows):
            # type: (Sequence[LogRow]) -> None
            """Add rows to the log."""


MAX_CHAIN_SIZE = 100000
"""Greatest size of joined strokes that are read before the pen comes down on the first, bytes: the
brick has room for them. Where more are joined, it lifts."""

CHECK_PERIOD = 1.0
"""Period of checking a paused arm for pulled cables, s."""

MIN_RATE = 0.7
"""Least rate of a plan, of 1; below, it is planned anew: at a backlash the tip would stand long."""

MAX_SHIFT = math.radians(10)
"""Greatest turn of a joint by a nudge, rad."""

HAND_ACCURACY = math.radians(1.0)
"""Accuracy of putting a joint in its home pose by hand, rad."""


class JobRunner(object):
    """One drawing of a job with an arm whose zero is known.

    Args:
        arm: robot.motion.arm.RobotArm.
        clock: has `now()` and `sleep(seconds)`.
        job: shared.job.Job, for this arm.
        orders: robot.jobs.orders.JobOrders.
        report: robot.jobs.report.JobReport.
        log: receiver, by `add`, of the LogRows that the job asks for; None: no log.
        dry: whether the pen stays up.
    """

    def __init__(self, arm, clock, job, orders, report, log=None, dry=False):
        # type: (RobotArm, Clock, Job, JobOrders, JobReport, Optional[LogSink], bool) -> None
        self._arm, self._clock, self._job = arm, clock, job
        self._orders, self._report = orders, report
        self._log, self._dry = log, dry
        # (One that logs costs every tick two calls more.)
        logs = job.header.log if log else 0.0
        self._feed = FeedOverride(self._sample)
        if logs:
            self._feed = LoggingFeed(self._sample, logs)
        self._pen_is_down = None  # type: Optional[bool]
        self._repeat, self._place = 1, Place(1, 1, 0.0, 0.0)
        # The share of its speed at which what is drawn now was planned.
        self._share = 1.0
        # A job that is begun paused waits over its first point, one that is paused where it is.
        self._begun = False
        # The layer whose pen is in the holder; why the job is paused, for people; and whether it is
        # to be paused once more, over the first point of a new pen.
        self._pen = None  # type: Optional[str]
        self._why, self._touch_up = "", False

    def run(self, first=1, repeat=1, repeats=1):
        # type: (int, int, int) -> bool
        """Draw from one stroke on, then all again until the last repeat.

        Args:
            first: number of the stroke to begin with, from 1 on.
            repeat: number of the repeat that this is, from 1 on.
            repeats: number of times that all is drawn.

        Returns:
            Whether all was drawn; else it was aborted. The pen is up, the arm held.

        Raises:
            ArmError, Stopped: the motors stopped, and the status says why.
        """
        try:
            # When it is resumed, the pen of the stroke before is in the holder.
            if self._job.header.pens and not self._dry:
                self._pen = self._job.stroke(max(first - 1, 1)).layer
                self._report.say("the first pen is for {}".format(_quoted(self._pen)))
            for self._repeat in range(repeat, repeats + 1):
                if not self._draw_from(first if self._repeat == repeat else 1):
                    self._pen_up()
                    self._update("aborted")
                    return False
            forget_progress(self._job.crc)
            self._update("done")
            return True
        except BaseException as error:
            stopped = not isinstance(error, Exception)
            if stopped:
                ignore_signals()
            with contextlib.suppress(OSError):  # its terminal may be closed
                self._update("stopped" if stopped else "failed", str(error))
            raise

    # Strokes

    def _draw_from(self, k):
        # type: (int) -> bool
        """Draw the strokes from the k-th on; return False if that is aborted."""
        joints = self._arm.description.joints
        stroke = self._job.stroke(k)  # type: Optional[Stroke]
        self._place = self._before(k, stroke)
        self._save(k, self._repeat)
        self._update("drawing")
        while stroke is not None:
            chain, after = self._chain(k, stroke)
            self._path = PenPath(self._job, k, chain, self._repeat, joints)
            self._change_pen(stroke.layer)
            if os.environ.get(PLAN):
                for n in range(k, k + len(chain)):
                    append_to_plan(self._job.line(n).decode("ascii"))
            if not self._follow(self._path):
                return False
            k, stroke = k + len(chain), after
            self._save(k, self._repeat)
            self._place = self._before(k, stroke)
            if stroke is not None:
                self._update("drawing")
        return True

    def _chain(self, k, stroke):
        # type: (int, Stroke) -> Tuple[List[Stroke], Optional[Stroke]]
        """Return the strokes drawn in one go, the k-th (`stroke`) first; and the next, or None."""
        chain, size = [stroke], self._job.size(k)
        for n in range(k + 1, self._job.header.strokes + 1):
            after = self._job.stroke(n)
            size += self._job.size(n)
            other_pen = self._job.header.pens and after.layer != stroke.layer
            if size > MAX_CHAIN_SIZE or other_pen or self._job.header.rest:
                return chain, after
            if not joined(chain[-1], after):
                return chain, after
            chain.append(after)
        return chain, None

    def _follow(self, path):
        # type: (PenPath) -> bool
        """Draw from pen down to pen up; return False if that is aborted."""
        is_there = False
        while path.pieces:
            self._share = self._orders.share
            self._motions = path.motions(self._share)
            if not self._is_ready(self._motions[0], is_there):
                return False
            is_there = True
            if self._share != self._orders.share:
                continue  # there was time to change it
            self._feed.begin_at(1.0)
            self._arm.follow_fed(self._motions, self._feed, self._pen_down)
            self._pen_up()
            feed = self._feed
            if self._log and self._job.header.log and isinstance(feed, LoggingFeed):
                self._log.add(feed.rows(path.place))
            if not feed.held:
                self._rest(path)
                break
            self._place = path.place(feed.index, feed.tau)
            path.cut(feed.index, feed.tau)
        return not self._orders.aborted

    def _rest(self, path):
        # type: (PenPath) -> None
        """Stand for a while at the end of a path, and log where that is."""
        rest, clock = self._job.header.rest, self._clock
        until = clock.now() + rest
        while rest and clock.now() < until:
            clock.sleep(min(POLL_PERIOD, max(0.0, until - clock.now())))
            self._orders.sample(clock.now())
            if self._orders.aborted:
                return
        if rest and self._log:
            end = path.end()
            q = tuple([motor.angle() for motor in self._arm.joints])
            self._log.add([LogRow(end.stroke, end.planned, clock.now(), True, q)])

    def _sample(self, now):
        # type: (float) -> float
        """Return the wanted rate of the plan, 0 to 1, at the time `now` (s) in motion."""
        if not self._orders.sample(now):
            return 0.0
        # What is ordered beyond these is planned anew, with the pen up.
        rate = self._orders.share / self._share
        if not MIN_RATE <= rate <= 1.0:
            return 0.0
        if self._report.due(now):
            self._place = self._path.place(self._feed.index, self._feed.reached)
            q, _ = self._motions[self._feed.index].at(self._feed.reached)
            tip = kinematics.forward(self._arm.description, q)
            self._report.update("drawing", self._place, self._orders, tip, moving=True)
        return rate

    # With the pen up

    def _is_ready(self, motion, is_there):
        # type: (Trajectory, bool) -> bool
        """Wait where a motion begins, backlash taken up, until not paused; False if aborted."""
        while not self._orders.aborted:
            if not is_there and not (self._orders.paused and self._begun):
                is_there = self._approach(motion)
            if self._orders.aborted:
                break
            if not self._orders.paused:
                if is_there:
                    self._begun = True
                    return True
                continue
            self._update("paused", self._why)
            is_there = self._stand(motion, is_there)
            self._why = ""
            if self._touch_up and not self._orders.aborted:
                self._touch_up, self._begun, self._orders.paused = False, False, True
                self._why = "nudge the tip until it meets what is drawn, then resume"
            elif not self._orders.aborted:
                self._update("drawing")
        return False

    def _change_pen(self, layer):
        # type: (str) -> None
        """Pause for the pen of a layer to be put in, if another is in the holder."""
        pens = self._job.header.pens
        if not pens or self._dry or layer == self._pen:
            return
        self._pen, self._begun, self._orders.paused = layer, True, True
        self._touch_up = pens == "touch-up"
        self._why = "put in the pen for {}, then resume".format(_quoted(layer))

    def _approach(self, motion):
        # type: (Trajectory) -> bool
        """Go there from behind, as RobotArm.pre_approach; return False if an order came between."""
        orders, was_paused = self._orders, self._orders.paused

        def on_tick(now, links):
            # type: (float, Sequence[float]) -> Optional[object]
            orders.sample(now)
            return STOP if orders.aborted or (orders.paused and not was_paused) else None

        self._pen_up()
        return self._arm.pre_approach(motion, on_tick)

    def _stand(self, motion, is_there):
        # type: (Trajectory, bool) -> bool
        """Hold until the job is resumed or aborted; return whether the arm is where it was."""
        orders, clock = self._orders, self._clock
        check_at = clock.now() + CHECK_PERIOD
        while True:
            nudge = orders.pop_nudge()
            if nudge and not orders.aborted:
                self._nudge(nudge, motion)
                is_there = self._approach(motion)
            for note in orders.notes:
                self._report.say(note)
            del orders.notes[:]
            if orders.aborted or not orders.paused:
                return is_there
            clock.sleep(POLL_PERIOD)
            now = clock.now()
            orders.sample(now)
            if now >= check_at:
                check_at = now + CHECK_PERIOD
                for motor in self._arm.joints:
                    motor.check_plugged_in()

    def _nudge(self, nudge, motion):
        # type: (Sequence[float], Trajectory) -> None
        """Correct the joints' zero so that the tip comes down farther by `nudge`, (x, y), cm.

        Homing anew leaves an offset of the joints' angles, not of the tip's place. So the zero is
        corrected: then what is drawn meets here and elsewhere.
        """
        description = self._arm.description
        p = kinematics.forward(description, motion.start)
        nudged = tuple(a + b for a, b in zip(p, nudge)) + tuple(p[2:])
        try:
            q = kinematics.inverse(description, nudged, near=motion.start)
        except kinematics.Unreachable as problem:
            self._orders.notes.append("not shifted: {}".format(problem))
            return
        if max([abs(a - b) for a, b in zip(q, motion.start)]) > MAX_SHIFT:
            self._orders.notes.append("not shifted: the arm is nearly singular there")
            return
        for motor, a, b in zip(self._arm.joints, motion.start, q):
            motor.zero += motor.in_counts(b - a)

    def _pen_up(self):
        # type: () -> None
        self._move_pen(False)

    def _pen_down(self):
        # type: () -> None
        self._move_pen(True)

    def _move_pen(self, down):
        # type: (bool) -> None
        pen = self._arm.description.pen
        down = down and not self._dry
        if pen and self._pen_is_down is not down:
            deeper = math.copysign(self._orders.pen, self._orders.pen * (pen.down - pen.up))
            self._arm.move_pen(pen.down + deeper if down else pen.up)
            self._pen_is_down = down

    # Reporting

    def _before(self, k, stroke):
        # type: (int, Optional[Stroke]) -> Place
        """Return the Place where the k-th stroke begins; where there is none, the end."""
        header = self._job.header
        planned = stroke.start_s if stroke else header.seconds
        return Place(self._repeat, min(k, header.strokes), self._job.cm_before(k), planned)

    def _update(self, state, reason=""):
        # type: (str, str) -> None
        self._report.update(state, self._place, self._orders, reason=reason)

    def _save(self, k, repeat):
        # type: (int, int) -> None
        zeros = self._arm.motors.zeros()
        try:
            save_progress(self._job.crc, SavedProgress(k, repeat, zeros, self._orders.pen))
        except OSError as error:
            self._orders.notes.append(
                "how far it is cannot be put on file ({}): make room, or --resume will know of less"
                "".format(error.strerror)
            )


def _quoted(layer):
    # type: (str) -> str
    return "'{}'".format(layer) if layer else "what has no layer"


def max_offset(arm, motors, stroke, same_zero):
    # type: (Arm, Sequence[Motor], Stroke, bool) -> float
    """Return the greatest distance of what is drawn now from where it was meant before, cm.

    To first order a joint off by d moves the tip by |J_k| d, J_k its Jacobian column, cm/rad.
    The sum is the worst case: errors of homing have no known distribution.

    Args:
        arm: shared.arm_description.Arm.
        motors: its joints' JointMotors.
        stroke: shared.job.Stroke that is drawn next.
        same_zero: whether the zero is the one of before; else it was found anew.
    """
    q = [cubic[0] for cubic in stroke.pieces[0][1][0][2]]
    levers = [
        math.sqrt(sum([x * x for x in column])) for column in zip(*kinematics.jacobian(arm, q))
    ]
    total = 0.0
    for joint, motor, lever in zip(arm.joints, motors, levers):
        off = motor.resolution  # half a count each time
        if not same_zero:
            off += HAND_ACCURACY if joint.find_home == "here" else 2 * motor.resolution
        total += lever * off
    return total
