"""The brick's battery: read seldom, for each reading costs a control tick half a millisecond."""

from shared.arm_description import ArmError

MYPY = False
if MYPY:
    from typing import Optional, Protocol  # noqa: F401

    from robot.clock import Timepiece  # noqa: F401

    class Supply(Protocol):
        """python-ev3dev2's battery."""

        @property
        def measured_volts(self):
            # type: () -> float
            """Voltage of the battery, V."""


READ_PERIOD = 10.0
"""Period of reading the battery, s."""

FLAT_VOLTAGE = 6.0
"""Voltage of a flat battery, V: below, ev3dev switches off by itself with a rechargeable one."""

ADVICE = "the battery is flat, {:.1f} V; charge it"


class BatteryFlat(ArmError):
    """The battery is too flat to begin.

    Args:
        volts: its voltage, V.
    """

    def __init__(self, volts):
        # type: (float) -> None
        ArmError.__init__(self, ADVICE.format(volts) + ", then start again")


def power_supply():
    # type: () -> Supply
    """Return python-ev3dev2's battery, whose `measured_volts` asks it each time."""
    from ev3dev2.power import PowerSupply  # not above: it is slow to import

    supply = PowerSupply()  # type: Supply
    return supply


def flat(clock):
    # type: (Timepiece) -> Optional[float]
    """Return the battery's voltage, V, if it is flat; else, or if it is not known, None."""
    volts = Battery(clock).volts()
    return volts if volts is not None and 0 < volts < FLAT_VOLTAGE else None


def check(clock):
    # type: (Timepiece) -> None
    """Refuse to begin, by BatteryFlat, what a flat battery would spoil."""
    volts = flat(clock)
    if volts is not None:
        raise BatteryFlat(volts)


class Battery(object):
    """The battery's voltage, cached.

    The first reading is at once, for it is slow: python-ev3dev2 has to find the battery.

    Args:
        clock: has `now()`.
    """

    def __init__(self, clock):
        # type: (Timepiece) -> None
        self._clock = clock
        self._supply = None  # type: Optional[Supply]
        self._read()

    def volts(self):
        # type: () -> Optional[float]
        """Return its voltage up to READ_PERIOD ago, V; None if unknown, which is no error."""
        if self._supply is not None and self._clock.now() - self._read_at >= READ_PERIOD:
            self._read()
        return self._volts

    def _read(self):
        # type: () -> None
        self._read_at = self._clock.now()
        try:
            if self._supply is None:
                self._supply = power_supply()
            self._volts = self._supply.measured_volts  # type: Optional[float]
        except Exception:  # any error of a driver: the voltage is informative only
            self._volts = None
