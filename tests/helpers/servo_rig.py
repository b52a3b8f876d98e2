"""visual_servoing.py as a program on an emulated brick, watched by a camera that is only a formula.

The oracles are the true angles and speeds of the emulated links and where the camera truly has tip
and goal, never what the program says.
"""

import json
import math
import random
from collections import namedtuple
from pathlib import Path

from places import ROBOT
from rig import Terminal

from laptop.emulator.host.clocks import UPTIME
from laptop.emulator.virtual_tracker import HOST, FrameChain, VirtualTracker
from robot.tracking_client import Memory, ServerAddress

PROGRAM = str(ROBOT / "visual_servoing.py")

Shown = namedtuple("Shown", "status reason t out err log began")
"""What a shell would see of a run, when it ended (s), the log's lines as dicts, and when in the
world's time they begin (s; None without a log)."""

NOT_YET = "cpu=0"
"""The plant of those runs for which the servo is not good enough yet at the brick's own pace."""

Moment = namedtuple("Moment", "t driven speed q")
"""s, ports that were driven, greatest true speed of a link (rad/s), true angles (rad)."""


class Camera:
    """A pinhole without distortion that looks down on the plane of the arm at a slant.

    Args:
        tilt, roll: rad.
        shift: of the picture, px.
    """

    TILT, ROLL = math.radians(20), math.radians(25)
    FOCAL, HEIGHT, LOOKS_AT, CENTRE = 600.0, 50.0, (9.0, 5.0), (320.0, 240.0)

    def __init__(self, tilt=TILT, roll=ROLL, shift=(0.0, 0.0)):
        self.tilt, self.roll, self.shift = tilt, roll, shift

    def pixel(self, p):
        """Where a point of the plane (cm) is seen, px."""
        x, y = (a - b for a, b in zip(p, self.LOOKS_AT, strict=True))
        c, s = math.cos(self.roll), math.sin(self.roll)
        right, up = c * x - s * y, s * x + c * y
        depth = self.HEIGHT + up * math.sin(self.tilt)
        u = self.FOCAL * right / depth
        v = -self.FOCAL * up * math.cos(self.tilt) / depth
        return tuple(a + b + d for a, b, d in zip((u, v), self.CENTRE, self.shift, strict=True))

    def bumped(self):
        """As after a knock: 10 degrees of roll and 40 px of shift."""
        return Camera(self.tilt, self.roll + math.radians(10), (self.shift[0] + 40, self.shift[1]))


class SpaceCamera:
    """A pinhole without distortion 60 cm from the middle of an arm in space.

    Args:
        tilt: 0 looks down, 90 degrees level, rad.
        azimuth: where it stands, counter-clockwise from the right of the arm, rad.
    """

    FOCAL, AWAY, LOOKS_AT, CENTRE = 450.0, 60.0, (6.0, 0.0, 12.0), (320.0, 240.0)

    def __init__(self, tilt, azimuth=0.0):
        s, c = math.sin(azimuth), math.cos(azimuth)
        self._away = (s * math.sin(tilt), -c * math.sin(tilt), math.cos(tilt))
        self._right = (c, s, 0.0)
        self._up = (-s * math.cos(tilt), c * math.cos(tilt), math.sin(tilt))

    def pixel(self, p):
        """Where a point (x, y, z), cm, is seen, px."""
        way = [a - b for a, b in zip(p, self.LOOKS_AT, strict=True)]
        along, right, up = (
            sum(a * b for a, b in zip(way, axis, strict=True))
            for axis in (self._away, self._right, self._up)
        )
        zoom = self.FOCAL / (self.AWAY - along)
        return self.CENTRE[0] + zoom * right, self.CENTRE[1] - zoom * up


class Watched(Terminal):
    """An arm under a camera, with a tracker that visual_servoing.py finds as remembered.

    Args:
        folder, monkeypatch, capsys, others: as Terminal.
        goal: where the goal marker lies, cm; None for no marker.
        cameras: by name; one that looks down on the plane if None.
        noise: standard deviation, px; seed: of its luck.
        tracker: options of VirtualTracker.

    Attributes:
        cameras, goal: may be changed while it runs.
        hidden: names of the markers that are not seen now, and of cameras that see nothing.
        moments: what truly happened, every 2 ms or so.
        statuses: what the laptop was told, in order.
        struck: when what `in_motion` waits for was done, s.
    """

    def __init__(
        self, folder, monkeypatch, capsys, goal=(-6.0, 10.0), noise=0.5, tracker=None,
        cameras=None, seed=1, **others
    ):  # fmt: skip
        super().__init__(folder, monkeypatch, capsys, **others)
        self.cameras = {"A": Camera()} if cameras is None else cameras
        self.goal, self.noise, self.hidden = goal, noise, set()
        self.moments, self.statuses, self.struck = [], [], None
        self._luck = random.Random(seed)
        self.world.bodies.append(self._note)
        self.tracker = VirtualTracker(
            self.world, self._see, FrameChain(**(tracker or {})), tuple(self.cameras)
        )
        address = ServerAddress(HOST, self.tracker.port, self.tracker.code)
        Memory(self.state_folder).save(address, self.tracker.key)
        monkeypatch.setenv("SSH_CLIENT", f"{HOST} 0 22")

    def _see(self, camera, index, t):
        def marker(name, p):
            if p is None or self.hidden & {name, camera}:
                return None
            place = self.cameras[camera].pixel(p)
            return (*(x + self._luck.gauss(0, self.noise) for x in place), 1.0)

        return {"effector": marker("effector", self.tip), "goal": marker("goal", self.goal)}

    def _note(self, t):
        if self.moments and t - self.moments[-1].t < 0.0015:
            return
        speed = max(abs(drive.link.speed) for drive in self.brick.plant.joints)
        self.moments.append(Moment(t, self.brick.driven(), speed, self.q))
        if len(self.moments) % 10:
            return
        status = self.tracker.server.state().status
        if status and (not self.statuses or self.statuses[-1] is not status):
            self.statuses.append(status)

    def in_motion(self, after, act, joint=None):
        """Have `act()` done when a link truly turns fast, after a time (s); see `struck`.

        Of `joint`, if given, so fast that it has a way to go.
        """

        def fast():
            if joint is None:
                return self.moments[-1].speed > 0.6
            before, last = self.moments[-6], self.moments[-1]
            return abs(last.q[joint] - before.q[joint]) > 0.8 * (last.t - before.t)

        def look():
            if fast():
                self.struck = self.world.t
                act()
            else:
                self.world.at(self.world.t + 0.005, look)

        self.world.at(after, look)

    def loosen(self, seed):
        """Have the effector seen at one place whatever the joints do, with a little noise."""
        see, rng = self.tracker.see, random.Random(seed)
        self.tracker.see = lambda *frame: dict(
            see(*frame), effector=(300 + rng.gauss(0, 0.3), 200 + rng.gauss(0, 0.3), 1.0)
        )

    def moved(self):
        """Whether any motor was driven or any link turned; a weight settles within its play."""
        play = max(joint.backlash for joint in self.arm.joints)
        return any(m.driven for m in self.moments) or self._turned(self.moments) > play

    def error(self, goal=None):
        """How far off the tip truly is, px as seen now, from the marker or a pixel of A."""
        if goal:
            return math.dist(self.cameras["A"].pixel(self.tip), goal)
        seen = (math.dist(c.pixel(self.tip), c.pixel(self.goal)) for c in self.cameras.values())
        return math.hypot(*seen)

    def run(self, *words, **options):
        """Run `visual_servoing.py WORDS` with a log, and the world for 1 s more; Shown."""
        log = Path(self.state_folder) / "log.jsonl"
        if "--log" not in words:
            words = (*words, "--log", str(log))
        outcome, out, err = self.type(PROGRAM, *words, **options)
        lines = log.read_text().splitlines() if log.exists() else []
        log = [json.loads(line, parse_constant=_no) for line in lines]
        began = log[0]["clock"] - UPTIME - (outcome.start or 0.0) if log else None
        return Shown(*outcome[:3], out, err, log, began)

    def stands(self, since, until=math.inf):
        """Whether no motor was driven in that time (s), and no link turned by 1.5 deg.

        A motor that is held springs back by what it has overshot, which may be somewhat over 1 deg.
        """
        during = [m for m in self.moments if since <= m.t < until]
        return not any(m.driven for m in during) and self._turned(during) < math.radians(1.5)

    @staticmethod
    def _turned(moments):
        """By how much a link truly turned to and fro in these moments, rad."""
        return max(max(angles) - min(angles) for angles in zip(*(m.q for m in moments)))


def circling(w, speed):
    """Let the goal marker go round at so many cm/s; where it is at a time, cm."""

    def goal(t):
        angle = speed / 3.0 * t
        return 4.0 + 3.0 * math.cos(angle), 12.0 + 3.0 * math.sin(angle)

    def go():
        w.goal = goal(w.world.t)
        w.world.at(w.world.t + 0.01, go)

    go()
    return goal


def _no(word):
    raise ValueError(f"{word} is no JSON")
