"""Motors of the emulated brick under the real library, without a script, for tests."""

import contextlib
import math

import ev3dev2.motor

from laptop.emulator.device.brick import EmulatedBrick
from laptop.emulator.device.plant_constants import read_plant
from laptop.emulator.host.world import World
from shared.arm_description import find_arm, read_arm


class Bench:
    """The planar arm without its pen on A and B, and two bare motors: medium on C, large on D."""

    def __init__(self, plant="", start=None):
        arm = read_arm(find_arm("planar"))._replace(pen=None)
        self.world = World()
        extra = {"C": "medium", "D": "large"}
        self.brick = EmulatedBrick(self.world, arm, read_plant(plant), start, extra)
        self.sleep = self.world.sleep
        self.now = self.world.now

    def motor(self, port):
        """The library's own motor at `port`."""
        kind = ev3dev2.motor.MediumMotor if port == "C" else ev3dev2.motor.LargeMotor
        return kind("out" + port)

    def degrees(self, port):
        """The TRUE angle of the shaft since the start."""
        return math.degrees(self.brick.plant.drives[port].shaft)

    def watch(self, port, seconds):
        """The TRUE angles of the shaft during `seconds`, every millisecond."""
        out = []
        for _ in range(int(round(seconds * 1000))):
            self.sleep(0.001)
            out.append(self.degrees(port))
        return out

    def until(self, condition, most=10.0):
        """Wait until `condition()`; the time it took, s."""
        start = self.now()
        while not condition():
            assert self.now() - start < most, "never happened"
            self.sleep(0.001)
        return self.now() - start

    def timed(self, call):
        start = self.now()
        value = call()
        return value, self.now() - start


@contextlib.contextmanager
def benches():
    """Provide what makes benches; the library is on the last one made."""
    with contextlib.ExitStack() as stack:

        def build(plant="", start=None):
            bench = Bench(plant, start)
            stack.enter_context(bench.brick.sysfs.installed())
            return bench

        yield build
