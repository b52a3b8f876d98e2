"""A clock for tests, which stands until it is turned."""


class FakeClock:
    """A clock that stands until it is turned, or somebody sleeps."""

    def __init__(self, t=100.0):
        self.t = t

    def now(self):
        """The time, s."""
        return self.t

    def sleep(self, seconds):
        """Turn it on, never back."""
        self.t += max(0.0, seconds)
