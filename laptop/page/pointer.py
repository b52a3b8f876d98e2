"""The pointer in a camera's image: its clicks and drags."""

from __future__ import annotations

import math

from laptop.see.serve.pipeline import Point

MAX_UNPRESSED_MOVES = 3
"""Greatest number of moves in a row with no button pressed; one more ends a drag."""
MAX_CLICK_MOTION = 5.0
"""A pointer that moves less than this, px of the image, has clicked."""


class Pointer:
    """Makes clicks and drags of a browser's pointer events, which may come late.

    Attributes:
        drag: the points since its button was pressed, px; none if it is not.
    """

    def __init__(self) -> None:
        self.drag: list[Point] = []
        self._unpressed = 0  # moves since then with no button pressed

    def handle(self, kind: str, point: Point, button: int, buttons: int) -> list[Point]:
        """Return the points of a drag that ends here, or the one of a click; [] if none ends.

        Args:
            kind: type of the pointer event.
            point: px.
            button: that has changed, as in the event.
            buttons: that are pressed, a bit each, as in the event.
        """
        if kind == "pointerdown" and button == 0:
            self.drag, self._unpressed = [point], 0
        elif kind == "pointermove" and self.drag:
            # Moves from before the press may arrive late.  Several mean a release outside
            # the picture, which sends no event.
            self._unpressed = 0 if buttons else self._unpressed + 1
            if buttons:
                self.drag.append(point)
            elif self._unpressed > MAX_UNPRESSED_MOVES:
                self.drag = []
        elif kind == "pointercancel":
            self.drag = []
        elif kind == "pointerup" and button == 0 and self.drag:
            drag, self.drag = [*self.drag, point], []
            clicked = all(math.dist(drag[0], where) < MAX_CLICK_MOTION for where in drag)
            return drag[:1] if clicked else drag
        return []
