"""Online trajectory generation: joint set-points to an aim that may change in every tick.  Pure.

Each joint goes to its aim as fast as its limits of speed and acceleration allow, without overshoot;
a moving aim it meets at the aim's speed.  A new aim replaces the rest of the trajectory, from the
present angle and speed on, so that position and speed stay continuous.  A spline through old and
new aims would need the new one in advance; a low-pass filter would lag, and knows no limits.

The joints are not coordinated: the tip reaches a moving aim sooner, but not on a straight line.  A
straight one comes from knots.  At a reversal a joint stands while its motor crosses the backlash,
unless gravity keeps that closed.

The controller feeds speeds forward by LEAD, and these cannot be taken back; so an aim of time t
changes the trajectory from t + LEAD on.
"""

import math

from robot.motion import kinematics
from robot.motion.backlash import crossed, crossing_time
from robot.motion.joint_controller import LEAD
from shared.arm_description import move_accelerations
from shared.record import record

MYPY = False
if MYPY:
    from enum import Enum  # noqa: F401
    from typing import List, Literal, NamedTuple, Optional, Sequence, Tuple, Union  # noqa: F401

    from robot.motion.backlash import Crossing, PreloadSides, Sides  # noqa: F401
    from robot.motion.chains import Pose  # noqa: F401
    from robot.motion.trajectory import SetPoint  # noqa: F401
    from shared.arm_description import Joint  # noqa: F401

    Phase = Tuple[float, float, float, float]  # since, angle, speed, acceleration
    JointState = Tuple[float, float, float, float]  # angle, speed, side of the backlash, its rate

    class Stopping(Enum):
        """The type of STOP, which is no aim."""

        STOP = 0


SOFT_DECELERATION = 0.4
"""Deceleration of a joint with room to stop, as a share of its acceleration: friction alone keeps a
link from running ahead through its backlash."""

START_THRESHOLD, REVERSAL_THRESHOLD = 0.5, 1.0 / 3
"""Minimum distances of an aim that moves a joint at rest: ahead, counts; behind, a share of the
backlash, and no less than ahead.  A nearer aim may be noise."""

COUNTS_PER_TURN = 360
"""Counts per turn of a motor's encoder."""

PRELOAD_PERIOD = 0.05
"""Period of the updates of gravity's side, s."""

MAX_MATCHED_SPEED = 0.9
"""Maximum speed of an aim that a joint keeps up with, as a share of the joint's maximum."""


if MYPY:
    Moving = NamedTuple("Moving", [("q", Pose), ("q_dot", Sequence[float])])
    Landing = NamedTuple("Landing", [("q", Pose)])
    Aim = Union[Pose, Moving, Landing, Literal[Stopping.STOP], None]
    STOP = Stopping.STOP  # type: Literal[Stopping.STOP]
else:
    Moving = record("Moving", "q q_dot")
    Landing = record("Landing", "q")
    STOP = object()
    """Value that ends a motion at once, all motors held: in place of an aim, or from `on_tick`."""

Moving.__doc__ = "An aim that moves at a known speed: rad and rad/s."
Landing.__doc__ = "The last aim, rad: the motion ends there."


def time_optimal_profile(e, v, u, fastest, up, down):
    # type: (float, float, float, float, float, float) -> List[Tuple[float, float]]
    """Return the fastest motion to an aim `e` ahead that moves forward at `u`; never backwards.

    In the aim's frame, with w = v - u, the time-optimal motion has three phases (bang-bang control
    with a speed limit; general case: Kroeger and Wahl, IEEE T-RO 26(1), 2010): acceleration a to a
    peak speed P, constant speed, deceleration b to rest.  Without the limit the two ramps cover e:

        (P^2 - w^2) / 2a + P^2 / 2b = e,   so   P^2 = (e + w^2 / 2a) / (1 / 2a + 1 / 2b)

    A smaller P, by the limit, leaves a middle phase.  If the stopping distance exceeds e, the same
    holds with all signs reversed.

    Args:
        e: distance of the aim, rad; behind if negative.
        v: own speed, rad/s, 0 .. fastest.
        u: the aim's speed, rad/s, 0 .. fastest.
        fastest: maximum speed, rad/s.
        up: maximum acceleration, rad/s^2, > 0.
        down: maximum deceleration, rad/s^2, > 0.

    Returns:
        List of (duration, s; acceleration, rad/s^2).  After the last the speed is u, and the aim is
        reached, unless one at rest was too near to stop at it.
    """
    w = v - u
    stopping = w * w / (2 * down) if w > 0 else -w * w / (2 * up)
    sign = 1 if e >= stopping else -1
    first, second, most = (up, down, fastest - u) if sign > 0 else (down, up, u)
    e, w = sign * e, sign * w
    peak = math.sqrt(max(0.0, e + w * w / (2 * first)) / (0.5 / first + 0.5 / second))
    peak = max(min(peak, most), w, 0.0)
    phases = [((peak - w) / first, sign * first)]
    left = e - (peak * peak - w * w) / (2 * first) - peak * peak / (2 * second)
    if peak > 0 and left > 0:
        phases.append((left / peak, 0.0))
    phases.append((peak / second, -sign * second))
    return phases


class _Joint(object):
    """The trajectory of one joint.

    Args:
        joint: shared.arm_description.Joint.
        angle: at the start, rad.
        side: of the backlash at the start, -1 .. +1.
        fastest: maximum speed, rad/s.
        acceleration: maximum, rad/s^2.

    Attributes:
        rests_from: time when its set-point comes to rest, s; inf with a moving aim.
    """

    def __init__(self, joint, angle, side, fastest, acceleration):
        # type: (Joint, float, float, float, float) -> None
        self._limits = joint.lower, joint.upper
        # A joint that begins beyond a limit may come back.
        self._lower, self._upper = min(joint.lower, angle), max(joint.upper, angle)
        self.half_backlash = joint.backlash / 2
        self._fastest = fastest
        self._acceleration = acceleration
        self._start_threshold = START_THRESHOLD * 2 * math.pi / COUNTS_PER_TURN / joint.gear
        self._reversal_threshold = max(
            self._start_threshold, REVERSAL_THRESHOLD * 2 * self.half_backlash
        )
        self._crossing_time = crossing_time(joint)
        # Phases of constant acceleration: (since, angle, speed, acceleration).
        self._phases = [(-math.inf, angle, 0.0, 0.0)]
        self._direction = side if side in (1, -1) else 0  # type: float
        # Sides of the backlash: at first, crossings since then (begin, time, step), at the end.
        self._side = self._last_side = side
        self._crossings = []  # type: List[Crossing]
        self._ready = self._crossing_end = -math.inf
        self._preload_side = 0  # type: float
        self._aim = None  # type: Optional[float]
        self.rests_from = 0.0

    def at(self, t):
        # type: (float) -> JointState
        """Return angle (rad), speed (rad/s), side of the backlash and its rate (1/s) at `t` (s)."""
        phases = self._phases
        k = len(phases) - 1
        while phases[k][0] > t:
            k -= 1
        since, angle, speed, acceleration = phases[k]
        if speed or acceleration:
            dt = t - since
            angle += dt * (speed + 0.5 * acceleration * dt)
            speed += acceleration * dt
        if not self._lower <= angle <= self._upper:
            angle, speed = min(max(angle, self._lower), self._upper), 0.0
        if not self._crossings:
            return angle, speed, self._side, 0.0
        return (angle, speed) + crossed(t, self._side, self._crossings)

    def update_preload(self, t, side):
        # type: (float, float) -> None
        """Let gravity close the backlash on a side from `t` + LEAD (s) on; 0: it does not."""
        then = t + LEAD
        self._preload_side = side
        lies = side or (self.at(then)[1] and self._direction)
        if lies and lies != self._last_side:
            self._cross(then, lies, self._last_side)
            self.rests_from = max(self.rests_from, self._crossing_end)

    def steer(self, t, aim, certain, speed=0.0):
        # type: (float, Optional[float], bool, float) -> None
        """Go to `aim` (rad), which moves at `speed` (rad/s), from `t` + LEAD on; None: stop.

        A `certain` aim moves the joint however near it is.
        """
        then = t + LEAD
        if aim == self._aim and not speed and not certain and then < self.rests_from < math.inf:
            return  # the same aim
        self._aim = aim
        q, v, side, _ = self.at(then)
        ready = max(then, self._ready)  # no motion before the backlash is crossed
        u = 0.0
        if aim is None:
            aim = q
        else:
            aim = min(max(aim, self._limits[0]), self._limits[1])
            most = MAX_MATCHED_SPEED * self._fastest
            u = min(max(speed, -most), most)
        e = aim + u * (ready - t) - q
        if not v and ready == then:
            direction = 1 if e > 0 else -1
            if abs(e) <= (0.0 if certain else self._dead_zone(direction, u)):
                if self.rests_from == math.inf:  # a limit stops it
                    self._replan(t, then, ready, q, 0.0, 0.0, 0.0)
                return
            self._direction = direction
            if abs(side - direction) > 1e-6 and self.half_backlash and not self._preload_side:
                self._cross(then, direction, side)
                ready = self._ready = self._crossing_end
                e += u * self._crossing_time
            self._last_side = self._preload_side or direction
        self._replan(t, then, ready, q, v, e, u)

    def _cross(self, then, side, before):
        # type: (float, float, float) -> None
        """Cross the backlash from the side `before` to another, from the time `then` (s) on."""
        self._crossings.append((then, self._crossing_time, side - before))
        self._crossing_end = then + self._crossing_time
        self._last_side = side

    def _dead_zone(self, direction, u):
        # type: (float, float) -> float
        """Return the distance (rad) up to which an aim, moving at `u`, does not start the joint."""
        if u * direction > 0:
            return 0.0
        back = direction == -self._direction and not self._preload_side
        return self._reversal_threshold if back else self._start_threshold

    def _replan(self, t, then, ready, q, v, e, u):
        # type: (float, float, float, float, float, float, float) -> None
        """Plan the phases on from the time `then`, the backlash being crossed until `ready`."""
        sign, up = self._direction, self._acceleration
        while len(self._phases) > 1 and self._phases[1][0] <= t:
            del self._phases[0]
        while self._crossings and self._crossings[0][0] + self._crossing_time <= t:
            self._side += self._crossings.pop(0)[2]
        while self._phases[-1][0] >= then:
            del self._phases[-1]
        e, v, u = sign * e, max(sign * v, 0.0), max(sign * u, 0.0)
        if u:
            # A moving aim is followed only as long as the joint can stop before its limit.
            left = (self._upper if sign > 0 else -self._lower) - sign * q
            if v * v / (2 * up) > left - 2 * LEAD * v:
                e, u = min(e, left), 0.0
        down = SOFT_DECELERATION * up
        if v > u:  # soft as far as there is room for it
            down = min(max(down, (v - u) ** 2 / (2 * e) if e > 0 else up), up)
        if ready > then:
            self._phases.append((then, q, 0.0, 0.0))
        since = ready
        for dt, a in time_optimal_profile(e, v, u, self._fastest, up, down):
            self._phases.append((since, q, sign * v, sign * a))
            since += dt
            q += sign * (v * dt + a * dt * dt / 2)
            v += a * dt
        self._phases.append((since, q, sign * u, 0.0))
        self.rests_from = math.inf if u else max(since, self._crossing_end)


class OnlineTrajectory(object):
    """The set-points of all joints; used by the control loop like a BacklashCompensation.

    Args:
        joints: the arm's shared.arm_description.Joints.
        q: the links' angles at the start, rad.
        sides: per joint, the side of the backlash at the start: +1, -1, or between (0: unknown).
        speed: share of each joint's maximum.
        preload_sides: from the links' angles (rad) to the side, per joint, that gravity closes,
            0: none; None: gravity closes none.

    Attributes:
        duration: s; inf until the end is known.
        rests_from: per joint, when its set-point comes to rest, s; inf: with a moving aim.
    """

    before = 0.0

    def __init__(
        self,
        joints,  # type: Sequence[Joint]
        q,  # type: Pose
        sides,  # type: Sides
        speed=1.0,  # type: float
        preload_sides=None,  # type: Optional[PreloadSides]
    ):
        # type: (...) -> None
        self._joints = [
            _Joint(joint, angle, side, speed * joint.max_speed, acceleration)
            for joint, angle, side, acceleration in zip(
                joints, q, sides, move_accelerations(joints)
            )
        ]
        self._described = joints
        self.duration = math.inf
        self._t, self._states = None, []  # type: Optional[float], List[JointState]
        self._preloaded_at = -math.inf
        self.rests_from = [0.0] * len(self._joints)
        self._preload_sides = preload_sides

    def update_preload(self, t):
        # type: (float) -> None
        """Update at time `t` (s) the sides that gravity closes, at most every PRELOAD_PERIOD."""
        if not self._preload_sides or t - self._preloaded_at < PRELOAD_PERIOD:
            return
        self._preloaded_at = t
        sides = self._preload_sides([joint.at(t + LEAD)[0] for joint in self._joints])
        for joint, side in zip(self._joints, sides):
            joint.update_preload(t, side)
        self._update_rests()
        if self.duration < math.inf:
            self.duration = max(self.duration, max(self.rests_from))

    def _update_rests(self):
        # type: () -> None
        """Copy the times at which the joints come to rest, s."""
        self.rests_from = [joint.rests_from for joint in self._joints]

    def steer(self, t, aim, last=False):
        # type: (float, Union[Pose, Moving, None], bool) -> None
        """Steer the joints at time `t` to an aim.

        Args:
            t: s.
            aim: joint angles, rad; or a Moving; None: come to rest and end.
            last: whether the motion ends there, however near the aim is.
        """
        self.update_preload(t)
        if isinstance(aim, Moving):
            for k, joint in enumerate(self._joints):
                joint.steer(t, aim.q[k], last, aim.q_dot[k])
        else:
            for k, joint in enumerate(self._joints):
                joint.steer(t, None if aim is None else aim[k], last)
        self._update_rests()
        if aim is None or last:
            self.duration = max(t, max(self.rests_from))

    def handle(self, t, aim, once=False):
        # type: (float, Aim, bool) -> Optional[Literal[Stopping.STOP]]
        """Handle the answer of an aim function at time `t`; return STOP if the motion is over.

        Args:
            t: s.
            aim: as for `steer`; or a Landing: end there; or STOP.  Once the end is known, only STOP
                counts.
            once: whether to end at the first aim.

        Raises:
            kinematics.Unreachable: an aim that is not a number.
        """
        if aim is STOP:
            return STOP
        if self.duration < math.inf:
            self.update_preload(t)
            return None
        last = once or isinstance(aim, Landing)
        if isinstance(aim, Landing):
            aim = aim.q
        angles = aim.q if isinstance(aim, Moving) else aim
        if angles is not None and not all(math.isfinite(angle) for angle in angles):
            kinematics.check_limits(self._described, angles)
        self.steer(t, aim, last)
        return None

    def _at(self, t):
        # type: (float) -> List[JointState]
        """Return _Joint.at of every joint, stored: a tick asks for the same time twice."""
        if t != self._t:
            self._t, self._states = t, [joint.at(t) for joint in self._joints]
        return self._states

    def at(self, t):
        # type: (float) -> SetPoint
        """Return (q, None) of the motors' side at `t` (s), at most LEAD after the last `steer`."""
        q = []
        for joint, (angle, _, side, _) in zip(self._joints, self._at(t)):
            q.append(angle + side * joint.half_backlash)
        return q, None

    def speeds(self, t):
        # type: (float) -> List[float]
        """Return dq/dt of the motors' side at `t` (s), rad/s."""
        speeds = []
        for joint in self._joints:
            _, speed, _, rate = joint.at(t)
            speeds.append(speed + rate * joint.half_backlash)
        return speeds

    def sides_at(self, t):
        # type: (float) -> Tuple[float, ...]
        """Return the side of the backlash per joint at time `t` (s), -1 .. +1."""
        return tuple([side for _, _, side, _ in self._at(t)])
