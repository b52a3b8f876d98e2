"""A pointer in a picture: what it clicks, and along what it drags."""

from __future__ import annotations

import math

from laptop.tracking.pipeline import Point

LOOSE = 3
"""More moves in a row with no button pressed end a drag."""
CLICK = 5.0
"""A pointer that moves less than this, px of the picture, has clicked."""


class Pointer:
    """Makes clicks and drags of what a browser tells, which may come late.

    Attributes:
        drag: the points since its button was pressed, px; none if it is not.
    """

    def __init__(self) -> None:
        self.drag: list[Point] = []
        self._loose = 0  # moves since then with no button pressed

    def take(self, kind: str, point: Point, button: int, buttons: int) -> list[Point]:
        """The points of a drag that ends here, or the one of a click; [] if none ends.

        Args:
            kind: of the pointer event; `button`, `buttons`: as there.
            point: px.
        """
        if kind == "pointerdown" and button == 0:
            self.drag, self._loose = [point], 0
        elif kind == "pointermove" and self.drag:
            # Moves from before it was pressed may be late.  After several it was let go of outside
            # the picture, of which nothing is told.
            self._loose = 0 if buttons else self._loose + 1
            if buttons:
                self.drag.append(point)
            elif self._loose > LOOSE:
                self.drag = []
        elif kind == "pointercancel":
            self.drag = []
        elif kind == "pointerup" and button == 0 and self.drag:
            drag, self.drag = [*self.drag, point], []
            clicked = all(math.dist(drag[0], where) < CLICK for where in drag)
            return drag[:1] if clicked else drag
        return []
