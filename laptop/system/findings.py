"""Findings of a check, part by part, each with advice unless it is fine."""

from __future__ import annotations

from dataclasses import dataclass

from shared.message_fields import printable


@dataclass(frozen=True)
class Finding:
    """One line.

    Args:
        what: has been looked at.
        value: what was found.
        advice: what to do; "" if it is fine.
    """

    what: str
    value: str
    advice: str = ""

    def __str__(self) -> str:
        return printable(f"{self.what:9} {self.value}: {self.advice or 'fine'}")
