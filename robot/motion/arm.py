"""An arm built from its description and its motors: where it is, go there, follow this, stop.

The only place that clamps to limits.  Every wait here has a deadline, every way out stops the
motors.
"""

import contextlib
import math

from robot.motion import homing, kinematics
from robot.motion.backlash import BacklashCompensation
from robot.motion.control_loop import COARSE, FINE, SETTLE, UNHURRIED, ControlLoop, Stalled
from robot.motion.gravity import Gravity
from robot.motion.joint_controller import GAINS, JointController
from robot.motion.motors import JointMotor
from robot.motion.online_trajectory import STOP, Landing, Moving, OnlineTrajectory
from robot.motion.trajectory import JOINT_ACCELERATION, JointMove
from robot.motion.zero import Zero

STEP_SPEED, STEP_TICK = math.radians(100), 0.02
"""The speed of the report's joint steps, rad/s; and how often they are looked at, s."""

SETTLED_FOR, SETTLE_DEADLINE = 0.06, 0.4
"""A step has settled when it has been within a count for so long; it has so long for that, s."""

BEHIND, SLOWLY = math.radians(2), 0.3
"""A start is approached from the play and so much more (rad), at this share of full speed."""

GENTLE = math.radians(15)
"""Acceleration at which links do not leave the side of the play they are pushed by, rad/s^2."""

RUNS_ON = math.radians(10)
"""A motor stopped at more than this speed leaves its link running on into the play, rad/s."""

TABLE = 1.0
"""Elbow and tip go no lower than this above the table on the way to where they are parked, cm; or
than where they have come from."""

DOWN, STAGES = 0.3, 40
"""Share of full speed with which the arm is parked low, and places looked at on the way there."""

CHASE_ASTRAY = math.radians(5)
"""Greatest error in a chase, rad: a motor faster than described runs ahead on a long way."""

PEN_SPEED, PEN_ACCELERATION, PEN_ASTRAY = (math.radians(x) for x in (400, 3000, 25))
"""Of the pen's motor: greatest speed and acceleration, rad/s and rad/s^2, and error, rad."""


class RobotArm(object):
    """The arm on this brick.

    Args:
        description: shared.arm_description.Arm.
        clock: has `now()` and `sleep(seconds)`.
        zero: robot.motion.zero.Zero, where the zero is remembered; the arm's own file if None.
        gains: robot.motion.joint_controller.Gains by kind of motor.
        gravity: robot.motion.gravity.Gravity, what pulls on the joints; as described if None.
        say: called with what people should know of how fast the brick is.

    Attributes:
        sides: per joint, on which side its play lies: +1 pushed in the positive direction last, or
            pulled in the negative by gravity; -1 the other way round; 0 unknown; between, it is
            being crossed.

    Raises:
        MotorNotFound: a motor of the description is not there.
    """

    def __init__(self, description, clock, zero=None, gains=GAINS, gravity=None, say=print):
        self.description = description
        self.clock = clock
        self.zero = zero or Zero(description.name)
        self.joints = [
            JointMotor(joint.name, joint.port, joint.motor, joint.gear, joint.direction)
            for joint in description.joints
        ]
        pen = description.pen
        self.pen = JointMotor("pen", pen.port, pen.motor, 1.0, 1) if pen else None
        self._motors = self.joints + ([self.pen] if pen else [])
        self._controllers = controllers = {
            motor: JointController(joint.gear, gains[joint.motor])
            for motor, joint in zip(self.joints, description.joints)
        }
        if pen:
            controllers[self.pen] = JointController(1.0, gains[pen.motor])
        self._checked = 0
        self._loop = ControlLoop(clock, controllers, self._check_next, say)
        self._plan = None
        self.sides = (0,) * len(self.joints)
        self._gravity = gravity or Gravity(description)
        loaded = self._gravity.loaded
        self._pressed = self._gravity.pressed if loaded else None
        self._weigh = self._gravity.torques if loaded else None
        self._engaged = False
        self._standing = True
        self._homed = False

    # Where it is

    @property
    def homed(self):
        """Whether its zero is known; a stall puts it in doubt."""
        return self._homed

    def counts(self):
        """The encoders' readings by port."""
        return {motor.port: motor.counts() for motor in self._motors}

    def wake(self):
        """Believe the remembered zero.

        Raises:
            NotHomed: there is none, or the encoders contradict it.
        """
        zero = self.zero.confirmed(self.counts())
        for motor in self._motors:
            motor.zero = zero[motor.port]
        self._homed = True

    def angles(self):
        """Joint angles, rad, as the encoders have them, allowing for play as far as known."""
        angles = [motor.angle() for motor in self.joints]
        self.sides = self._gravity.sides(angles, self.sides)
        return self._links(angles)

    def position(self):
        """The tip, cm, as the encoders have it."""
        return kinematics.forward(self.description, self.angles())

    # Motion

    def _engage(self):
        """The arm is about to move, which goes on record."""
        self._standing = False
        if self._engaged:
            return
        self._engaged = True
        if self._homed:
            self.zero.save(self._zeros(), None)

    def _zeros(self):
        return {motor.port: motor.zero for motor in self._motors}

    def go_to(self, q, speed=1.0, acceleration=JOINT_ACCELERATION, watch=None):
        """Move all joints together to `q` (rad), each at most at `speed` times its greatest.

        `acceleration` is the greatest of any joint, rad/s^2; `watch` as for `follow`.

        Raises:
            kinematics.Unreachable: a joint angle past its limit; nothing has moved.
        """
        self.check(q)
        fastest = [speed * joint.max_speed for joint in self.description.joints]
        self.follow([JointMove(self.angles(), q, fastest, acceleration)], UNHURRIED, watch)

    def check(self, q):
        """Refuse joint angles (rad) past the limits.

        Raises:
            kinematics.Unreachable: naming the joint, its angle and the limit.
        """
        for joint, angle in zip(self.description.joints, q):
            if not joint.lower - 1e-9 <= angle <= joint.upper + 1e-9:
                raise kinematics.Unreachable(
                    "the {} cannot go to {:.1f} deg: its limits are {:.1f} and {:.1f} deg; "
                    "choose another pose".format(
                        joint.name, *(math.degrees(a) for a in (angle, joint.lower, joint.upper))
                    )
                )

    def approach(self, motion):
        """Go to the start of `motion` from behind, so that all play is taken up its way."""
        behind = []
        for joint, start, direction in zip(
            self.description.joints, motion.start, motion.directions
        ):
            back = start - direction * (joint.backlash + BEHIND)
            behind.append(min(max(back, joint.lower), joint.upper))
        self.go_to(behind)
        self.go_to(motion.start, SLOWLY, GENTLE)

    def follow(self, motions, settle=SETTLE, watch=None):
        """Let the links follow Trajectories or JointMoves, one after the other; end at rest, held.

        Args:
            settle: longest correction after each, s.
            watch: called in every control tick, right after the encoders were read, with the time
                (s) and the links' angles as observed (rad), play allowed for as far as known.  If
                it returns STOP, the motions end, all motors held; so they do if it raises, which
                goes on.

        Raises:
            Stalled, TooSlow, MotorNotFound: after stopping.
        """
        self._engage()
        with self._stopping_on_error():
            # All of it is planned before anything moves: from one stroke to the next the motors are
            # driven, and their dead-man would stop them.
            plans, sides = [], self.sides
            for motion in motions:
                sides = self._gravity.sides(motion.start, sides)
                plans.append(
                    BacklashCompensation(self.description.joints, motion, sides, self._pressed)
                )
                sides = plans[-1].sides
            for self._plan in plans:
                noting = self._noting(self._plan, watch) if watch else None
                if not self._loop.run(
                    self.joints, self._plan, settle, watch=noting, weigh=self._weigh
                ):
                    self._note_braked()
                    break
                self.sides = self._plan.sides
            self._hold(self.joints)

    def reach(
        self, q, speed=1.0, acceleration=JOINT_ACCELERATION, watch=None, within=FINE, spare=None
    ):
        """Move to `q` (rad), each joint by itself, as fast as a chase and landing as softly.

        On a long way sooner there than `go_to`, and the links end nearer to where they should; but
        the joints do not move together.

        Args:
            speed, acceleration, within: as for `chase`.
            watch: as for `follow`.
            spare: as for ControlLoop.run.

        Raises:
            kinematics.Unreachable: a joint angle past its limit; nothing has moved.
            Stalled, TooSlow, MotorNotFound: after stopping.
        """
        self.check(q)

        def tell(t, links):
            return STOP if watch and watch(t, links) is STOP else q

        self._pursue(tell, speed, acceleration, within, True, spare)

    def chase(self, aim, speed=1.0, acceleration=JOINT_ACCELERATION, within=FINE, spare=None):
        """Let the links follow an aim that may move as it likes; end at rest, held.

        Args:
            aim: called in every control tick as `watch` of `follow`, it returns where the joints
                should be (rad, or a Moving if they are to go on from there; what is past a limit
                means the limit); or a Landing: end there; or None: come to rest, end; or STOP:
                end at once.
                It is called to the end, so that it sees the coming to rest, too.
            speed: share of each joint's greatest.
            acceleration: greatest of any joint, rad/s^2.
            within: so many counts from its end a joint has settled: a coarse loop takes its time
                for the last bit, and who measures where it is has no need of that.
            spare: as for ControlLoop.run.

        Raises:
            kinematics.Unreachable: an aim that is not a number.
            Stalled, TooSlow, MotorNotFound: after stopping.
        """
        self._pursue(aim, speed, acceleration, within, False, spare)

    def _pursue(self, aim, speed, acceleration, within, once, spare):
        """Chase an aim, or `once` go where it is at first."""
        self._engage()
        with self._stopping_on_error():
            joints = self.description.joints
            q = self.angles()
            pursuit = OnlineTrajectory(joints, q, self.sides, speed, acceleration, self._pressed)

            def steer(t, now, angles):
                self.sides = pursuit.sides_at(t)
                wanted = aim(now, self._links(angles))
                if wanted is STOP:
                    return STOP
                if pursuit.duration < math.inf:
                    pursuit.press(t)
                    return None
                last = once or isinstance(wanted, Landing)
                if isinstance(wanted, Landing):
                    wanted = wanted.q
                angles = wanted.q if isinstance(wanted, Moving) else wanted
                if angles is not None and not all(math.isfinite(angle) for angle in angles):
                    self.check(angles)
                pursuit.steer(t, wanted, last)
                return None

            if not self._loop.run(
                self.joints,
                pursuit,
                UNHURRIED,
                within,
                CHASE_ASTRAY,
                steer,
                self._weigh,
                spare,
            ):
                self._note_braked()
            self._hold(self.joints)

    def _noting(self, plan, watch):
        """What tells `watch`, in the control loop, where the links are."""

        def note(t, now, angles):
            self.sides = plan.sides_at(t)
            return watch(now, self._links(angles))

        return note

    def _links(self, angles):
        """The links' angles for these of the motors, rad."""
        return tuple(
            angle - side * joint.backlash / 2
            for angle, side, joint in zip(angles, self.sides, self.description.joints)
        )

    @contextlib.contextmanager
    def _stopping_on_error(self):
        """Whatever goes wrong, every motor is stopped before anybody hears of it."""
        try:
            yield
        except BaseException as error:
            # Blocked or blind looks the same; blind, its counts are worth nothing from now on.
            self._homed = self._homed and not isinstance(error, Stalled)
            if self._plan:
                self.sides = self._plan.sides_at(self._loop.plan_time)
            self._note_braked()
            self._halt()
            raise
        finally:
            self._plan = None

    def _note_braked(self):
        """Which side of its backlash a joint lies on is unknown where it runs on."""
        self.sides = tuple(
            0 if abs(self._controllers[motor].speed) > RUNS_ON else side
            for motor, side in zip(self.joints, self.sides)
        )

    def check_plugged_in(self):
        """Notice a pulled cable, also of a motor that is idle; costs no access.

        Raises:
            MotorNotFound: naming the motor.
        """
        for motor in self._motors:
            motor.check_plugged_in()

    def _check_next(self):
        """The same, of one motor after the other."""
        self._checked = (self._checked + 1) % len(self._motors)
        self._motors[self._checked].check_plugged_in()

    def _hold(self, motors):
        for motor in motors:
            motor.hold()
        self._loop.rest(motors)

    def move_pen(self, angle):
        """Turn the pen's motor to `angle`, rad.

        Raises:
            Stalled: it does not get there.
        """
        self._engage()
        move = JointMove([self.pen.angle()], [angle], [PEN_SPEED], PEN_ACCELERATION)
        with self._stopping_on_error():
            self._loop.run([self.pen], move, SETTLE, COARSE, PEN_ASTRAY)
            self._hold([self.pen])

    def move_motor(self, k, move):
        """Let one joint's motor alone follow a JointMove of one angle, without limits; then hold.

        For homing, when angles are not known yet.
        """
        self._engage()
        with self._stopping_on_error():
            self._loop.run([self.joints[k]], move, SETTLE, COARSE)
            self._hold([self.joints[k]])

    @contextlib.contextmanager
    def lend_motors(self):
        """For a `with` block somebody else turns the joints' motors; whatever goes wrong, all stop.

        Where the play lies is unknown afterwards.
        """
        self._engage()
        with self._stopping_on_error():
            try:
                yield
            finally:
                self.sides = (0,) * len(self.joints)

    def home(self, here=False, say=print):
        """Find the zero, or with `here` take the joints to be at the home pose; remember it.

        The pen is taken to be up.

        Returns:
            One homing.Found per joint; empty with `here`.

        Raises:
            homing.Blocked, Stalled, MotorNotFound: after stopping.
        """
        self._homed = False
        self.zero.forget()
        if self.pen:
            homing.take_as_it_stands(self.pen, self.description.pen.up)
        found = []
        if here:
            joints = self.description.joints
            sides = self._gravity.pressed([joint.home for joint in joints])
            for motor, joint, side in zip(self.joints, joints, sides):
                homing.take_as_it_stands(motor, joint.home + side * joint.backlash / 2)
        else:
            self._engage()
            with self._stopping_on_error():
                self._hold(self.joints)
                found = homing.find_zero(self, say)
        self._homed = True
        self.sides = (0,) * len(self.joints)
        self.zero.save(self._zeros(), None if self._engaged else self.counts())
        return found

    def step_to(self, q):
        """The report's move: both joints commanded together, then settled to a count for 60 ms.

        Raises:
            Stalled: a joint does not get there in time.
        """
        self.check(q)
        self._engage()
        with self._stopping_on_error():
            self._go_and_settle(q)
        self.sides = (0,) * len(self.joints)

    def _go_and_settle(self, q):
        clock = self.clock
        longest = max(abs(a - b) for a, b in zip(q, self.angles())) / STEP_SPEED
        targets = [motor.go(angle, STEP_SPEED) for motor, angle in zip(self.joints, q)]
        deadline = clock.now() + longest + SETTLE_DEADLINE
        settled = None
        self.check_plugged_in()
        while settled is None or clock.now() - settled < SETTLED_FOR:
            off = [motor.counts() - target for motor, target in zip(self.joints, targets)]
            if all(abs(counts) <= 1 for counts in off):
                settled = clock.now() if settled is None else settled
            else:
                settled = None
                if clock.now() > deadline:
                    worst = max(range(len(off)), key=lambda k: abs(off[k]))
                    raise Stalled(
                        self.joints[worst], "{:.0f} counts are missing".format(abs(off[worst]))
                    )
            clock.sleep(STEP_TICK)

    # Ending

    def stop(self):
        """Stop and hold every motor that still answers; then tell of the first that does not.

        Raises:
            MotorNotFound, or what else a motor answered.
        """
        lost = self._halt()
        if lost:
            raise lost

    def _halt(self):
        """Stop and hold every motor that still answers; the first trouble, or None."""
        lost = None
        # All stand before anything is tidied up: an access may be slow.
        for act in (JointMotor.hold, JointMotor.disengage):
            for motor in self._motors:
                try:
                    act(motor)
                except Exception as error:  # one motor's trouble must not keep the next one running
                    lost = lost or error
        self._loop.rest(self._motors)
        self._standing = True
        return lost

    def go_low(self):
        """Go slowly, the base staying, to where the arm is to rest, as its description says.

        Straight there, or by way of the home pose: whichever keeps off the table.

        Returns:
            Whether it went; not if nothing was moved, or no resting place is described.

        Raises:
            kinematics.Unreachable: neither way is free; nothing has moved.
            Stalled, TooSlow, MotorNotFound: after stopping.
        """
        joints = self.description.joints
        if not (self._engaged and self._homed) or all(joint.rest is None for joint in joints):
            return False
        q = self.angles()
        rest, home = (
            tuple(
                min(max(a, joint.lower), joint.upper)
                if joint.rest is None
                else getattr(joint, where)
                for a, joint in zip(q, joints)
            )
            for where in ("rest", "home")
        )
        for way in ((rest,), (home, rest)):
            if self._is_free((q,) + way):
                for place in way:
                    self.go_to(place, DOWN)
                return True
        raise kinematics.Unreachable(
            "no way down to where the arm rests keeps off the table: it is held where it is; "
            "support it before the brick is switched off"
        )

    def _is_free(self, way):
        """Whether elbow and tip keep off the table on the straight joint moves of a way."""
        lowest = min(TABLE, self._clearance(way[0]))
        return all(
            self._clearance([x + (y - x) * k / float(STAGES) for x, y in zip(a, b)]) > lowest - 1e-6
            for a, b in zip(way, way[1:])
            for k in range(STAGES + 1)
        )

    def _clearance(self, q):
        """Height of what is lowest of the arm, the base aside, cm."""
        return min(p[-1] for p in kinematics.joint_positions(self.description, q)[1:])

    def park(self, low=False):
        """Stop for good, and put on record where; nothing if nothing was moved.

        With `low` it goes low first if it can, see `go_low`.
        """
        if not self._engaged:
            return
        if low:
            with contextlib.suppress(kinematics.Unreachable):
                self.go_low()
        if not self._standing:
            self.stop()
        self._engaged = False
        if self._homed:
            self.clock.sleep(0.1)
            self.zero.save(self._zeros(), self.counts())
