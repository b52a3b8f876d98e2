"""Link between one world and the paced clock that it shares with others (laptop.emulator.pace)."""

from laptop.emulator.pace import PaceMeter

MYPY = False
if MYPY:
    from typing import Optional  # noqa: F401

    from laptop.emulator.pace import Member, PacedClock  # noqa: F401

LONG_PACE_WINDOW = 60.0
"""Window of the pace by which a run in real time is ended, wall s."""


class Pacer(object):
    """One world among those of a paced clock; its times are virtual ones, s.

    Args:
        clock: pace.PacedClock.

    Attributes:
        zero: time of the clock at the virtual time 0, s.
        pace, long_pace: PaceMeter of the clock over seconds, and over a minute.
        waiting: whether the world waits for the clock.
        drifting: whether its time goes on while a program waits for the host.
    """

    def __init__(self, clock: "PacedClock") -> None:
        self.zero = 0.0
        self.pace = PaceMeter(clock)
        self.long_pace = PaceMeter(clock, LONG_PACE_WINDOW)
        self.waiting = False
        self.drifting = False
        self._clock = clock
        self._member = None  # type: Optional[Member]

    def join(self, t: float, name: str) -> None:
        """Join the clock, whose members then wait for this world, from its time `t` on.

        Args:
            t: virtual time now, s.
            name: of the world, for people.
        """
        if self._member is None:
            self.zero = self._clock.now() - t
            self._member = self._clock.join(name)

    def leave(self) -> None:
        """Leave the clock, whose members wait for this world no longer."""
        if self._member is not None:
            self._member.leave()
            self._member = None

    @property
    def joined(self) -> bool:
        """Whether others wait for it."""
        return self._member is not None

    def promise(self, t: float) -> None:
        """Promise that nothing of this world happens before `t`."""
        if self._member is not None:
            self._member.promise(self.zero + t)

    def reached(self, t: float) -> bool:
        """Return True if the clock lets us go on to `t`; nothing of ours happens before."""
        self.promise(t)
        return self._clock.now() >= self.zero + t

    def now(self) -> float:
        """Return the clock's time as virtual time, s."""
        return self._clock.now() - self.zero

    def worth_waiting(self, t: float) -> float:
        """Return the least wall time until the clock lets us go on to `t`, s."""
        return self._clock.worth_waiting(self.zero + t)

    @property
    def latest(self) -> str:
        """Name of the member that the clock waits for; "" for none."""
        return self._clock.latest
