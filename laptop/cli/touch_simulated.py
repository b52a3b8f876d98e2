"""`measure pen --simulate`: an emulated hand touches the crosses, before the synthetic camera."""

from __future__ import annotations

import contextlib
import random
import sys
from collections.abc import Callable
from typing import TYPE_CHECKING

from laptop.cli.line_handler import LineHandler
from laptop.emulator.device.buttons import Press
from laptop.emulator.device.hand_guiding import BadHand, HandPlace
from laptop.emulator.device.plant_constants import read_plant
from laptop.emulator.rendered_tracker import marker_specs
from laptop.emulator.rig import Rig
from laptop.emulator.scene.board_items import board_place
from laptop.emulator.scene.scene import Scene
from laptop.emulator.scene.scene_constants import BadScene, read_scene
from laptop.emulator.scene.synthetic_camera import SyntheticCamera, film
from laptop.see.camera.frames import Frame
from laptop.see.markers.board import CROSSES
from laptop.see.markers.markers import read_spec
from laptop.see.table.cross_sampling import CrossSampler
from laptop.see.table.cross_touching import CrossTouching, read_point
from laptop.system import platforms
from shared.arm_description import Arm, ArmError
from shared.messages import EFFECTOR

if TYPE_CHECKING:
    from laptop.emulator.device.brick import EmulatedBrick
    from laptop.emulator.device.peripherals import Peripherals

SCENE = "board=a4,board_x=12,marker_stray=0.4"
"""The usual one: an arm in the plane reaches all crosses there."""
READY_TIME, LEADING_TIME, PRESSING_TIME = 4.0, 2.5, 0.6
"""Times of the hand, s: until it begins, from cross to cross, and from there to the press."""
PLACING_SIGMA = 0.02
"""Error with which it sets the pen on a cross, standard deviation, cm."""
PRESS_TIME = 0.2
"""Time for which the touch sensor is pressed, s."""
MAX_PRESSES = 3
"""Greatest number of presses at a cross that does not count; then it is left out."""
PEOPLE_PREFIXES = ("point ", "lead the arm")
"""Beginnings of the program's lines that are for whoever leads the arm."""
STOP_PREFIX = "driver.py: stopped by "
"""Beginning of its line about a signal, of which this process tells in its own words."""
TOUCH_TIMEOUT = 600.0
"""Longest time of all of it, s."""


class TouchEnded(ArmError):
    """The program on the emulated brick has ended badly."""


class SimulatedTouching:
    """A brick whose arm a hand leads to the crosses, and a camera above it.

    Args:
        arm: in the plane.
        scene: of the synthetic camera, beside SCENE.
        plant: constants of the arm, as text.
        report: called with a line for people.

    Raises:
        ArmError: a text is wrong, or there is no board in the scene.
    """

    def __init__(
        self, arm: Arm, scene: str | None, plant: str, report: Callable[[str], None]
    ) -> None:
        self._report = report
        self._arm, self._scene = arm, f"{SCENE},{scene}" if scene else SCENE
        self._plant = read_plant(plant)
        self._constants = read_scene(self._scene)
        if self._constants["board"] == "none":
            raise BadScene("the scene has no board to touch: --scene board=a4,board_x=12")
        self._complete = Scene(arm, self._constants).constants
        self._camera: SyntheticCamera | None = None
        self._brick: EmulatedBrick
        self._devices: Peripherals
        self._touching: CrossTouching
        self._problem: ArmError | None = None
        self._tries = 0
        self._rng = random.Random(self._constants["seed"])
        self._index = -1

    def sampler(self, effector: str | None) -> CrossSampler:
        """Return a sampler of its camera, which shows the home pose before the run."""
        spec = effector or marker_specs(self._complete)[EFFECTOR]
        return CrossSampler(self, read_spec(EFFECTOR, spec), live=True)

    def read(self, timeout: float = 1.0) -> Frame | None:
        """Return a picture of the arm's present pose."""
        if self._camera is None:
            return self._at_home()
        # The arm rests while several pictures are taken; their noise differs.
        self._index += 1
        newest = self._camera.newest(self._brick.world.now())
        return self._camera.capture(max(newest - self._index % 5, 0))

    def _at_home(self) -> Frame:
        from laptop.emulator.scene.poses import ScriptedPoses

        self._index += 1
        home = tuple(joint.home for joint in self._arm.joints)
        scene = Scene(self._arm, self._constants)
        camera = SyntheticCamera(scene, ScriptedPoses(self._arm, lambda t: home), lambda: 0.0)
        return camera.capture(self._index)

    def run(self, touching: CrossTouching) -> None:
        """Touch all crosses.

        Raises:
            ArmError: what `touching` raises, or the program on the emulated brick ended badly.
            KeyboardInterrupt: Ctrl-C came meanwhile.
        """
        with (
            # (Closed while what it writes to is open: later that would be an error of nobody's.)
            contextlib.closing(LineHandler(sys.stdout, self._on_line)) as out,
            contextlib.closing(
                LineHandler(sys.stderr, lambda line: None, (*PEOPLE_PREFIXES, STOP_PREFIX))
            ) as errors,
            contextlib.redirect_stdout(out),
            contextlib.redirect_stderr(errors),
            Rig(self._arm, plant=self._plant) as rig,
        ):
            run = rig.run(
                "driver.py",
                "touch",
                "--json",
                timeout=TOUCH_TIMEOUT,
                person=lambda brick, devices: self._begin(touching, brick, devices),
            )
        platforms.raise_signals(run.outcome.signals)
        if self._problem:
            raise self._problem
        if run.outcome.status:
            raise TouchEnded(
                f"driver.py touch has ended on the emulated brick: {run.outcome.reason}, status "
                f"{run.outcome.status}"
            )

    def _begin(self, touching: CrossTouching, brick: EmulatedBrick, devices: Peripherals) -> None:
        self._brick, self._devices, self._touching = brick, devices, touching
        self._camera = film(brick, self._scene)
        self._ask(READY_TIME)

    def _ask(self, after: float) -> None:
        """Schedule the hand's next place, and the press."""
        touching, now = self._touching, self._brick.world.now()
        while touching.cross is not None:
            if self._tries >= MAX_PRESSES:
                touching.skip()
                self._tries = 0
                continue
            self._report(touching.request())
            x, y, _ = board_place(self._constants, CROSSES[[touching.cross]])[0]
            x, y = (float(one) + self._rng.gauss(0, PLACING_SIGMA) for one in (x, y))
            t = now + after + LEADING_TIME
            try:
                self._brick.guide([HandPlace((x, y), t)])
            except BadHand as problem:
                self._report(str(problem))
                touching.skip()
                continue
            self._devices.press(Press("touch:in4", t + PRESSING_TIME, PRESS_TIME))
            return
        self._devices.press(Press("down", now + PRESSING_TIME, PRESS_TIME))

    def _on_line(self, line: str) -> None:
        # In the world's time: the laptop's computation takes no time on the brick.
        self._brick.world.at(self._brick.world.now(), lambda: self._handle_point(line))

    def _handle_point(self, line: str) -> None:
        try:
            counts = self._touching.handle(read_point(line))
        except ArmError as problem:
            self._problem = problem
            self._devices.press(Press("down", self._brick.world.now() + PRESSING_TIME, PRESS_TIME))
            return
        self._tries = 0 if counts else self._tries + 1
        self._ask(0.0)
