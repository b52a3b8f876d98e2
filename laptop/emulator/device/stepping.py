"""The steps of the brick's time: physics, encoders, motor drivers, and the record of the motion."""

import math
from typing import Union

from laptop.emulator.device.plant import ArmPlant
from laptop.emulator.device.tacho_motor import TICK

MYPY = False
if MYPY:
    from typing import Dict, List, Optional, Tuple  # noqa: F401

    from laptop.emulator.device.hand_guiding import HandGuiding  # noqa: F401
    from laptop.emulator.device.motion_record import MotionRecord  # noqa: F401
    from laptop.emulator.device.motor_and_link import Drive, DrivenLink  # noqa: F401
    from laptop.emulator.device.tacho_motor import TachoMotor  # noqa: F401
    from laptop.emulator.device.wheels import BarePlant  # noqa: F401

STEP = 0.001
"""Step of the physics, s."""
TICK_STEPS = round(TICK / STEP)
"""Steps between two ticks of the motor drivers."""
SAMPLE_STEPS = 5
"""Steps between two samples of the record."""
PUSH_ANGLE, PUSH_SPEED = math.radians(20), math.radians(200)
"""Angle, rad, and speed, rad/s, at which a hand turns what a motor moves."""


def time_of_sample(number: int) -> float:
    """Return the time of a sample of the record, s."""
    return number * SAMPLE_STEPS * STEP


class Stepper(object):
    """Steps of a plant and of the drivers of its motors.

    Args:
        plant: ArmPlant or BarePlant.
        motors: port -> TachoMotor, which others change.
        record: MotionRecord, which begins with where the plant is.

    Attributes:
        steps: number of steps so far.
        hand: HandGuiding of a hand that leads the tip; None without one.
    """

    def __init__(
        self,
        plant: Union[ArmPlant, "BarePlant"],
        motors: "Dict[str, TachoMotor]",
        record: "MotionRecord",
    ) -> None:
        self.plant = plant
        self.motors = motors
        self.record = record
        self.steps = 0
        self.hand = None  # type: Optional[HandGuiding]
        # Links and bare rotors in a hand, and where that takes them, rad.
        self._pushed = []  # type: List[Tuple[Union[DrivenLink, Drive], float]]
        self._tip_at, self._tip = plant.q, plant.tip()  # joint angles, and the true tip
        self._sample()

    @property
    def now(self) -> float:
        """Time of the last step, s."""
        return self.steps * STEP

    def push(self, moved: "Union[DrivenLink, Drive]") -> None:
        """Turn back a link or a bare rotor, as a hand."""
        self._pushed.append((moved, moved.angle - PUSH_ANGLE))

    def advance(self, t: float) -> None:
        """Advance physics and drivers to time `t`, s."""
        while (self.steps + 1) * STEP <= t + 1e-9:
            if self.hand is not None:
                self.hand.guide((self.steps + 1) * STEP, STEP)
            self.plant.step(STEP)
            for moved, end in self._pushed:
                moved.angle = max(end, moved.angle - PUSH_SPEED * STEP)
            self.steps += 1
            now = self.steps * STEP
            regulate = self.steps % TICK_STEPS == 0
            for motor in self.motors.values():
                motor.sense(now)
                if regulate:
                    motor.tick(now)
            if self.steps % SAMPLE_STEPS == 0:
                self._sample()

    def _sample(self) -> None:
        q = self.plant.q
        if q != self._tip_at:  # mostly it stands
            self._tip_at, self._tip = q, self.plant.tip()
        x, y, z = self._tip
        self.record.append(q, x, y, z, int(self.plant.pen_down))
