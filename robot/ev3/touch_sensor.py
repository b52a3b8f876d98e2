"""Touch sensors at the brick's inputs."""

MYPY = False
if MYPY:
    from typing import Callable  # noqa: F401


class NoTouchSensor(OSError):
    """There is no touch sensor, or no longer."""


def touch_sensor(port):
    # type: (str) -> Callable[[], bool]
    """Return a function that returns whether the touch sensor at an input is pressed.

    Args:
        port: "in1" .. "in4".

    Raises:
        NoTouchSensor: at once, or by the function once its cable is pulled.
    """
    from ev3dev2 import DeviceNotFound  # not above: it is slow to import
    from ev3dev2.sensor.lego import TouchSensor

    try:
        sensor = TouchSensor(port)
    except (DeviceNotFound, OSError) as error:
        raise NoTouchSensor(str(error)) from None

    def is_pressed():
        # type: () -> bool
        try:
            return bool(sensor.is_pressed)
        except (DeviceNotFound, OSError) as error:
            raise NoTouchSensor(str(error)) from None

    return is_pressed
