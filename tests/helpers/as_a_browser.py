"""Drawings beside what a browser shows of them: python tests/helpers/as_a_browser.py 1000:1300

It prints how many of which features differ, and writes those that do as pictures: what the browser
shows in grey, what is drawn in red.
"""

import base64
import re
import sys
from collections import Counter
from contextlib import contextmanager
from pathlib import Path

import cv2
import numpy as np
from svg_grammar import ACROSS, CELL, DOWN, GAP, drawing

ZOOM = 6
"""Pixels of the pictures to a px of the drawing."""
DARK = 140
"""What is darker in the browser's picture has ink."""
NEAR = 4
"""Ink and line belong together where they are so near to each other, pixels: 0.7 px."""
LEAST = 24
"""So many pixels without a partner are no difference: half of a line's width may show along the
edge of a clip, and the sharp end of a corner is longer than its line."""
PX = 2.54 / 96


def side(n):
    """Pixels across so many cells."""
    return n * (CELL + GAP) * ZOOM


def ours(svg):
    """A picture of the strokes that are drawn, and what is said of it."""
    from laptop.drawing.artwork import BadArtwork
    from laptop.drawing.svg import read_svg

    picture = np.zeros((side(DOWN), side(ACROSS)), np.uint8)
    try:
        artwork = read_svg(svg.encode(), "it.svg")
    except BadArtwork as error:
        return picture, (str(error),)
    for stroke in artwork.strokes:
        points = (stroke * [1, -1] + [0, artwork.size[1]]) / PX * ZOOM - 0.5
        cv2.polylines(
            picture, [np.round(points * 16).astype(np.int32)], False, 255, 1, cv2.LINE_8, 4
        )
    return picture, artwork.left_out


@contextmanager
def page_of(browser):
    """A function that gives the browser's picture of an SVG: 255 where there is ink."""
    size = {"width": ACROSS * (CELL + GAP), "height": DOWN * (CELL + GAP)}
    page = browser.new_page(viewport=size, device_scale_factor=ZOOM, color_scheme="light")

    def shown(svg):
        page.goto("data:image/svg+xml;base64," + base64.b64encode(svg.encode()).decode())
        picture = cv2.imdecode(np.frombuffer(page.screenshot(), np.uint8), cv2.IMREAD_GRAYSCALE)
        return np.where(picture < DARK, np.uint8(255), np.uint8(0))

    try:
        yield shown
    finally:
        page.close()


def apart(lines, ink):
    """Where there is ink, or the edge of an area, without a line, and lines without ink."""
    disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * NEAR + 1, 2 * NEAR + 1))
    edge = ink & ~cv2.erode(ink, np.ones((5, 5), np.uint8))
    missing = (edge > 0) & (cv2.dilate(lines, disc) == 0)
    return missing | ((lines > 0) & (cv2.dilate(edge, disc) == 0))


def differences(svg, shown):
    """(feature, whether it differs, its picture) of each cell of a drawing."""
    lines, said = ours(svg)
    ink = shown(svg)
    off = apart(lines, ink)
    for kind, row, column in re.findall(r'<g id="(\w+)-(\d)(\d)"', svg):
        rows = slice(side(int(row)), side(int(row) + 1))
        cell = rows, slice(side(int(column)), side(int(column) + 1))
        picture = np.full((*lines[cell].shape, 3), 255, np.uint8)
        picture[ink[cell] > 0] = (190, 190, 190)
        picture[lines[cell] > 0] = (0, 0, 255)
        yield kind, bool(off[cell].sum() > LEAST), picture, said


def main():
    """Compare drawings of these seeds, and print the table."""
    sys.path.insert(0, str(Path(__file__).resolve().parents[2]))
    from rich.console import Console
    from rich.progress import track
    from rich.table import Table

    from tests.claims.page import browser

    first, last = map(int, sys.argv[1].split(":"))
    out = Path(sys.argv[2]) if len(sys.argv) > 2 else None
    seen, differ, drawings = Counter(), Counter(), 0
    with browser() as made, page_of(made) as shown:
        for seed in track(range(first, last), "comparing", console=Console(stderr=True)):
            some = False
            for number, (kind, differs, picture, _) in enumerate(differences(drawing(seed), shown)):
                seen[kind] += 1
                differ[kind] += differs
                some |= differs
                if differs and out:
                    out.mkdir(exist_ok=True)
                    cv2.imwrite(str(out / f"{seed}-{number}-{kind}.png"), picture)
            drawings += some
    table = Table("feature", "cells", "differ", title=f"as a browser shows it, seeds {sys.argv[1]}")
    for kind in sorted(seen):
        table.add_row(kind, str(seen[kind]), str(differ[kind]))
    table.add_row("drawings of nine", str(last - first), str(drawings), style="bold")
    Console().print(table)


if __name__ == "__main__":
    main()
