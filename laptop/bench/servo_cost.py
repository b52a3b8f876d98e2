"""Cost of one decision of the default method."""

from __future__ import annotations

import gc
import math
import random
import time
import timeit
from collections.abc import Sequence

from laptop.bench.servo_scenarios import DEFAULT
from laptop.bench.servo_setups import Pixel
from robot.motion import kinematics
from robot.servoing.chain_model import REWEIGH_PERIOD
from robot.servoing.image_models import model_kind
from robot.servoing.measurement import Measurement
from robot.servoing.servo import Servo
from shared.arm_description import find_arm, read_arm


def step_cost(arm_name: str = "planar", keys: int = 24) -> str:
    """Measure one decision of the default method, with a number of key-frames held; return a line.

    The unit is the interpreter's own `a*d-b*c` on four floats, measured in the same moment.  Its
    cost on another machine gives the decision's there.  Both as `timeit`
    measures: the fastest of several, without garbage collection; some decisions weigh the
    key-frames anew, and the mean is over as many as have one of these among them.
    """
    arm = read_arm(find_arm(arm_name))
    draw = random.Random(1)
    axes = {"A": (0, 1), "B": (0, 2)}  # of space, that a camera sees
    cameras = sorted(axes)[: len(arm.joints) - 1]

    def seen(q: Sequence[float], camera: str) -> Pixel:
        across, along = (kinematics.forward(arm, tuple(q))[k] for k in axes[camera])
        return 320 + 12 * across, 400 - 12 * along

    start, goal = ((0.2, 0.9), (0.6, 0.5)) if len(cameras) == 1 else ((0.2, 0.9, -1), (0.6, 1, -1))

    def measured(q: Sequence[float]) -> list[Measurement]:
        return [Measurement(name, seen(q, name), seen(goal, name), 0.1, 6) for name in cameras]

    def prepared(fits: int) -> Servo:
        servo = Servo(arm, model_kind(DEFAULT, arm), 5.0)
        here: Sequence[float] = start
        for _ in arm.joints:  # all are explored
            here = servo.decide(here, measured(here)).q or here
        for _ in range(6 * keys):
            around = [a + draw.uniform(-0.8, 0.8) for a in start]
            for name in cameras:
                for _ in range(3):  # a frame waits for its neighbours
                    servo.observe_in_motion(name, around, seen(around, name))
        for _ in range(fits):
            for name in cameras:
                servo.models.of(name).seen_from(here, seen(here, name))
        return servo

    fastest = [math.inf] * REWEIGH_PERIOD
    for fits in 10 * list(range(REWEIGH_PERIOD)):
        servo = prepared(fits)
        gc.disable()
        began = time.perf_counter()
        decision = servo.decide(start, measured(start))
        fastest[fits] = min(fastest[fits], time.perf_counter() - began)
        gc.enable()
        if decision.action != "move":
            raise AssertionError(f"a move was to be measured, not {decision.action}")
    loops = 200_000
    names = "a, b, c, d = 1.1, 2.2, 3.3, 4.4"
    unit = min(timeit.repeat("a*d-b*c", names, number=loops, repeat=5)) / loops
    step, worst = sum(fastest) / REWEIGH_PERIOD, max(fastest)
    return (
        f"one decision of {DEFAULT}, {arm_name}, with {keys} key-frames of every camera: "
        f"{1e6 * step:.0f} us (at most {1e6 * worst:.0f}), {step / unit:.0f} x a*d-b*c on four "
        f"floats ({1e9 * unit:.0f} ns)"
    )
