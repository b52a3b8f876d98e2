"""Times for people."""

from __future__ import annotations


def in_minutes(seconds: float) -> str:
    """A time for people: 45 s, 5 min 12 s, 1 h 20 min; of one below 0, 0 s."""
    whole = max(0, round(seconds))
    if whole < 60:
        return f"{whole} s"
    if whole < 3600:
        return f"{whole // 60} min {whole % 60} s"
    return f"{whole // 3600} h {whole % 3600 // 60} min"
