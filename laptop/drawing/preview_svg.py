"""A preview as SVG: written at once, since matplotlib alone takes a second to load.  Pure."""

from __future__ import annotations

from html import escape

import numpy as np

from laptop.drawing.durations import in_minutes
from laptop.drawing.preview_scene import PreviewScene

SCALE = 24.0
"""Units of the picture per cm."""

TEXT = 15.0
"""Height of the letters, in units."""

LEAST_WIDTH = 880.0
"""For the legend, in units."""

LINE_WIDTH = 1.3
"""In units."""

STYLE = """
text { font: 15px "DejaVu Sans", Verdana, sans-serif; fill: #333 }
.title { font-size: 21px; font-weight: bold; fill: #1a1a1a }
.small { font-size: 12px; fill: #5b6167 }
.bad { fill: #c00000 }
path, line, polygon { fill: none; stroke-linecap: round; stroke-linejoin: round }
"""


def svg_text(scene: PreviewScene) -> str:
    """The picture of a scene, an SVG document."""
    page = _Page(scene)
    page.reach()
    page.paper()
    page.grid()
    page.arm()
    page.ways()
    page.strokes()
    page.missed()
    page.start()
    page.words()
    page.legend()
    return page.text()


class _Page:
    def __init__(self, scene: PreviewScene) -> None:
        self._scene = scene
        self._head = 22.0 + (len(scene.lines) + 1) * 1.5 * TEXT
        self._size = (scene.high - scene.low) * SCALE
        self._size[0] = max(self._size[0], LEAST_WIDTH)
        self._foot = 70.0
        self._out: list[str] = []
        self._reach = ""

    def text(self) -> str:
        width, height = self._size[0], self._size[1] + self._head + self._foot
        shown = "\n".join(self._out)
        return (
            f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width:.0f} {height:.0f}" '
            f'width="{width:.0f}" height="{height:.0f}">\n<style>{STYLE}</style>\n'
            f'<rect width="100%" height="100%" fill="white"/>\n{shown}\n</svg>\n'
        )

    def _at(self, points: np.ndarray) -> np.ndarray:
        """Points (n, 2) or (2,), cm, in units of the picture."""
        scene = self._scene
        room = self._size[0] - (scene.high[0] - scene.low[0]) * SCALE
        flipped = (points - (scene.low[0], scene.high[1])) * (SCALE, -SCALE)
        return np.asarray(flipped + (room / 2, self._head))

    def _path(self, points: np.ndarray) -> str:
        return "M" + " ".join(f"{x:.1f},{y:.1f}" for x, y in self._at(points).tolist())

    def reach(self) -> None:
        path = " ".join(self._path(outline) + "Z" for outline in self._scene.reach)
        self._out.append(
            f'<path d="{path}" style="fill:#F0F3F6" fill-rule="evenodd" stroke="#AEB8C2"/>'
        )
        self._reach = path

    def paper(self) -> None:
        if self._scene.paper is not None:
            self._out.append(
                f'<path d="{self._path(self._scene.paper)}Z" style="fill:#fffefa" stroke="#777"/>'
            )
            self._out.append(f'<path d="{self._reach}" stroke="#AEB8C2"/>')

    def grid(self) -> None:
        """Lines every 5 cm, with numbers of the arm's coordinates."""
        low, high = self._scene.low, self._scene.high
        for value in range(int(np.ceil(low[0] / 5)) * 5, int(high[0]) + 1, 5):
            x, y = self._at(np.array([value, low[1]]))
            top = self._at(np.array([value, high[1]]))[1]
            self._out.append(f'<line x1="{x:.0f}" y1="{y:.0f}" x2="{x:.0f}" y2="{top:.0f}" '
                             'stroke="#000" stroke-opacity=".06"/>')  # fmt: skip
            self._word(x, y + TEXT, f"{-value}", "small", "middle")
        for value in range(int(np.ceil(low[1] / 5)) * 5, int(high[1]) + 1, 5):
            x, y = self._at(np.array([low[0], value]))
            end = self._at(np.array([high[0], value]))[0]
            self._out.append(f'<line x1="{x:.0f}" y1="{y:.0f}" x2="{end:.0f}" y2="{y:.0f}" '
                             'stroke="#000" stroke-opacity=".06"/>')  # fmt: skip
            self._word(x + 4, y + 4, f"{value}", "small")

    def arm(self) -> None:
        self._out.append(
            f'<path d="{self._path(self._scene.joints)}" stroke="#B8962E" stroke-opacity=".35" '
            'stroke-width="12"/>'
        )
        x, y = self._at(self._scene.joints[0])
        self._out.append(f'<circle cx="{x:.1f}" cy="{y:.1f}" r="10" fill="#B8962E"/>')
        self._word(x, y + 26, "the arm", "small", "middle")

    def ways(self) -> None:
        path = " ".join(self._path(way) for way in self._scene.ways)
        if path:
            self._out.append(
                f'<path d="{path}" stroke="#7d8790" stroke-width=".8" stroke-dasharray="4 4"/>'
            )

    def strokes(self) -> None:
        self._out.append(f'<g stroke-width="{LINE_WIDTH}">')
        for points, colour in zip(self._scene.strokes, self._scene.colours, strict=True):
            self._out.append(f'<path d="{self._path(points)}" stroke="{colour}"/>')
        self._out.append("</g>")

    def missed(self) -> None:
        path = " ".join(self._path(points) for points in self._scene.missed)
        if path:
            self._out.append(f'<path d="{path}" stroke="#e00000" stroke-width="{2 * LINE_WIDTH}"/>')

    def start(self) -> None:
        if self._scene.start is not None:
            x, y = self._at(self._scene.start)
            self._out.append(
                f'<circle cx="{x:.1f}" cy="{y:.1f}" r="6" fill="none" stroke="#009E73" '
                'stroke-width="3"/>'
            )

    def words(self) -> None:
        y = 22.0 + 0.6 * TEXT
        self._word(16, y, self._scene.title, "title")
        for line in self._scene.lines:
            y += 1.5 * TEXT
            self._word(16, y, line, "bad" if "cannot be reached" in line else "")

    def legend(self) -> None:
        y = self._head + self._size[1] + 42.0
        self._word(16, y + 11, "first", "small")
        for k, colour in enumerate(self._scene.scale):
            self._out.append(f'<rect x="{50 + 6 * k}" y="{y}" width="6.5" height="13" '
                             f'fill="{colour}"/>')  # fmt: skip
        end = 50 + 6 * len(self._scene.scale)
        self._word(end + 6, y + 11, f"last, after {in_minutes(self._scene.seconds)}", "small")
        x = end + 190
        self._out.append(f'<circle cx="{x}" cy="{y + 6}" r="6" fill="none" stroke="#009E73" '
                         'stroke-width="3"/>')  # fmt: skip
        self._word(x + 12, y + 11, "start", "small")
        self._out.append(f'<path d="M{x + 62},{y + 6} {x + 92},{y + 6}" stroke="#7d8790" '
                         'stroke-dasharray="4 4"/>')  # fmt: skip
        self._word(x + 98, y + 11, "pen up", "small")
        self._out.append(f'<rect x="{x + 156}" y="{y}" width="14" height="13" fill="#F0F3F6" '
                         'stroke="#AEB8C2"/>')  # fmt: skip
        self._word(x + 176, y + 11, "within reach; numbers are cm, x up, y to the left", "small")

    def _word(self, x: float, y: float, text: str, kind: str = "", anchor: str = "start") -> None:
        self._out.append(
            f'<text x="{x:.0f}" y="{y:.0f}" class="{kind}" text-anchor="{anchor}">'
            f"{escape(text)}</text>"
        )
