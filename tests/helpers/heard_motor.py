"""A motor of the emulated brick whose writes are heard."""


class HeardMotor:
    """A device in a motor's place in sysfs: each write is told first, and then done."""

    def __init__(self, motor, hear):
        self._motor = motor
        self._hear = hear
        self.read = motor.read

    @property
    def notifications(self):
        """Those of the motor."""
        return self._motor.notifications

    def write(self, attribute, text):
        """Tell of a write, and do it."""
        self._hear(attribute, text)
        self._motor.write(attribute, text)


def listen(sysfs, motor, hear):
    """Call `hear(attribute, text)` before each write that comes to a motor through sysfs."""
    (place,) = [key for key, device in sysfs._devices.items() if device is motor]
    sysfs._devices[place] = HeardMotor(motor, hear)
