"""The brick's battery: looked at seldom, for each look costs a control tick half a millisecond."""

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
            """What the battery has, V."""


READ_PERIOD = 10.0
"""Between two looks, s."""

FLAT = 6.0
"""Below so much, V, ev3dev switches off by itself with a rechargeable battery."""

ADVICE = "the battery is flat, {:.1f} V; charge it"


class BatteryFlat(ArmError):
    """There is too little left to begin with.

    Args:
        volts: what it has, V.
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
    """The battery's voltage, V, if it is flat; else, or if it does not tell, None."""
    volts = Battery(clock).volts()
    return volts if volts is not None and 0 < volts < FLAT else None


def check(clock):
    # type: (Timepiece) -> None
    """Refuse to begin, by BatteryFlat, what a flat battery would spoil."""
    volts = flat(clock)
    if volts is not None:
        raise BatteryFlat(volts)


class Battery(object):
    """What the battery has left.

    The first look is at once, for it is slow: python-ev3dev2 has to find the battery.

    Args:
        clock: has `now()`.
    """

    def __init__(self, clock):
        # type: (Timepiece) -> None
        self._clock = clock
        self._supply = None  # type: Optional[Supply]
        self._look()

    def volts(self):
        # type: () -> Optional[float]
        """Its voltage a short while ago, V; None if it does not tell, which stops nobody."""
        if self._supply is not None and self._clock.now() - self._looked >= READ_PERIOD:
            self._look()
        return self._volts

    def _look(self):
        # type: () -> None
        self._looked = self._clock.now()
        try:
            if self._supply is None:
                self._supply = power_supply()
            self._volts = self._supply.measured_volts  # type: Optional[float]
        except Exception:  # whatever a driver may have: it is for show only
            self._volts = None
