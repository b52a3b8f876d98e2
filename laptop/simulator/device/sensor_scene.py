"""What the emulated world itself shows a sensor: the tip, the turning of a link or of the robot."""

import math

from laptop.simulator.device.sensor_orders import BadSensor

ROBOT, TIP, WALL = "robot", "tip", "wall"


class _Seen(object):
    """A quantity of the world now, as a Signal is one over time.

    Args:
        value, slope: callables; what it is and how fast it changes, 1/s.
    """

    def __init__(self, value, slope=lambda: 0.0):
        self._value = value
        self._slope = slope

    def value(self, t):
        """The value now, which must be `t`."""
        return self._value()

    def slope(self, t):
        """How fast it changes now, 1/s."""
        return self._slope()


def scene_of(brick):
    """Return `scene(word, place)` for the sensors of an EmulatedBrick, see `sensors.Measuring`.

    It raises BadSensor for what this brick has not.
    """

    def scene(word, place):
        if word == TIP and brick.arm is not None:
            return _tip(brick.plant, place)
        links = {} if brick.arm is None else _links(brick)
        if word in links:
            return _turning(links[word])
        rolls = brick.arm is None and brick.plant.wheels is not None
        if rolls and word == ROBOT:
            return _heading(brick.plant)
        if rolls and word == WALL:
            return _wall(brick.plant, place)
        has = [TIP] + sorted(links) if brick.arm is not None else rolls and [ROBOT, WALL] or []
        raise BadSensor(
            "sensor: there is no {} for it to see here; write a value, or one of {}".format(
                word, ", ".join(has) or "nothing: this brick has neither arm nor wheels"
            )
        )

    return scene


def _tip(plant, place):
    """Distance from the sensor to the arm's true tip, cm."""

    def distance():
        x, y, z = plant.tip()
        across = math.hypot(x - place["x"], y - place["y"])
        return math.hypot(across, (z or 0.0) - place["z"])

    return _Seen(distance)


def _heading(plant):
    """Angle and rate of the robot, deg, clockwise as seen from above."""
    return _Seen(lambda: -math.degrees(plant.heading), lambda: -math.degrees(plant.turning))


def _wall(plant, place):
    """Distance of the robot, the way it looks, to a wall across at the place's x, cm."""

    def distance():
        x, _, _ = plant.tip()
        ahead = place["x"] - x
        towards = math.cos(plant.heading)
        # Beside a wall, or looking away from it, there is nothing to hear.
        return ahead / towards if ahead * towards > 0 else math.inf

    return _Seen(distance)


def _links(brick):
    """Return link name -> the joints that turn it about its own axis, from the base outwards."""
    turned_by, turning = {}, []
    for joint, drive in zip(brick.arm.joints, brick.plant.joints):
        turning.append(drive)
        turned_by[joint.name] = list(turning)
        if joint.name == "base":
            turning = []  # about the vertical, which no other joint of an arm in space turns about
    return turned_by


def _turning(drives):
    """Angle and rate of a link, clockwise where the joints' angles are counter-clockwise, deg."""
    return _Seen(
        lambda: -math.degrees(sum(drive.link.angle for drive in drives)),
        lambda: -math.degrees(sum(drive.link.speed for drive in drives)),
    )
