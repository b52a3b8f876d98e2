"""The picture of a run: each case has one, it shows what it should, and always the same."""

import math
from collections import namedtuple
from dataclasses import replace

import matplotlib
import numpy as np
import pytest
from matplotlib.figure import Figure
from matplotlib.image import imread
from matplotlib.text import Text

from laptop.record.figures.line_accuracy import measure
from laptop.record.figures.line_plot import FinalPose, write_line_plot
from laptop.record.figures.sheet import ARM, COLUMN, HEIGHT, INK, SHEET, WANTED, WIDTH

Row = namedtuple("Row", "t q x y pen z", defaults=[None])

REACH = (1.8, 20.8)
SKELETON = [(0, 0), (7.2, 8.7), (0, 15)]
LINES = [[(10, 0), (5, 10)], [(15, 0), (0, 15)], [(12, 15), (0, 15)]]
CIRCLE = [(11 + 4 * math.cos(k / 20), 6 + 4 * math.sin(k / 20)) for k in range(126)]
FAN = [
    [(3 * math.cos(a), 3 * math.sin(a)), (18 * math.cos(a), 18 * math.sin(a))]
    for a in np.linspace(-1, 3, 20)
]


def record(paths, aside=0.1, pen=1):
    """Rows that draw `paths`, a little off, after a way there with the pen up."""
    rows = []
    for number, path in enumerate(paths, 1):
        way = np.array([(20.8, 0.0), *path])
        places = np.linspace(0, len(way) - 1, 40 * len(way) - 39)
        for place, x, y in zip(
            places, *(np.interp(places, range(len(way)), axis) for axis in way.T), strict=True
        ):
            q = (0.1 * place, -0.2 * place)
            rows.append(Row(0.005 * len(rows), q, x + aside * number, y, pen * (place >= 1)))
    return rows


ALL_DOWN = [row._replace(pen=1) for row in record(LINES[:1])]
NO_INK = "no ink: the pen never touched the paper"
CASES = {  # rows, wanted paths, words that are in the picture
    "three lines": (record(LINES), LINES, "greatest 1.00   RMS", "Deviation from the wanted path"),
    "one line": (record(LINES[:1]), LINES[:1], "greatest 1.00   RMS", "joint angles"),
    "circle": (record([CIRCLE]), [CIRCLE], "greatest"),
    "twenty lines": (
        record(FAN),
        FAN,
        "The 6 greatest of 20 deviations, mm",
        "14 more are left out.",
    ),
    "drawn in part": (record(LINES[:2]), LINES, "greatest 1.00   RMS", "not drawn"),
    "twenty, drawn in part": (
        record(FAN[:9]),
        FAN,
        "The 6 greatest of 9 deviations, mm",
        "14 more are left out, 11 of them not drawn.",
    ),
    "no wanted path": (record(LINES), [], "no wanted path was told", "tip  cm", "q2"),
    "no ink": (record(LINES, pen=0), [], NO_INK, "no wanted path was told"),
    "wanted but no ink": (record(LINES, pen=0), LINES, NO_INK, "None of 3 wanted paths was drawn"),
    "one wanted but no ink": (record(LINES, pen=0), LINES[:1], "The wanted path was not drawn"),
    "more than wanted": (record(LINES), LINES[:1], "2 strokes beyond what was wanted."),
    "always down": ([row._replace(pen=1) for row in record(LINES[:1])], LINES[:1], "greatest"),
    "dots": ([Row(0, (0, 0), 10, 0, 1)], [[(10, 0.1)]], "greatest 1.00   RMS 1.00"),
    "one row": ([Row(0, (0, 0), 20.8, 0, 0)], [], NO_INK),
    "three joints": ([row._replace(q=(*row.q, 1.0)) for row in record(LINES)], [], "q3"),
    "empty record": ([], [], "no record"),
    "empty record, wanted": ([], LINES, "no record", "None of 3 wanted paths was drawn"),
}


def draw(file, rows, wanted, title="driver.py lines", notes="planar, 8.0 V", floor=None):
    measures = [m and replace(m, floor_mm=floor) for m in measure(rows, wanted)]
    write_line_plot(file, rows, wanted, measures, FinalPose(SKELETON, REACH), title, notes)


def words_of(figure):
    return [text.get_text() for text in figure.findobj(Text)]


def inked(pixels, box, colour):
    """How many pixels within a box of the figure have just this colour."""
    left, bottom, width, height = box
    columns = slice(int(left * WIDTH), int((left + width) * WIDTH))
    lines = slice(int((1 - bottom - height) * HEIGHT), int((1 - bottom) * HEIGHT))
    wanted = matplotlib.colors.to_rgb(colour)
    return int((abs(pixels[lines, columns, :3] - wanted) < 0.02).all(axis=2).sum())


@pytest.fixture(scope="module")
def drawn(tmp_path_factory):
    """Of a case: its figure, the words in it, and its file, drawn once for all tests."""
    known = {}

    def look_up(case):
        if case not in known:
            file = tmp_path_factory.mktemp("drawn") / "picture.png"
            with pytest.MonkeyPatch.context() as monkeypatch:
                figures, save = [], Figure.savefig
                monkeypatch.setattr(
                    Figure, "savefig", lambda f, *a, **k: (figures.append(f), save(f, *a, **k))
                )
                draw(file, *CASES[case][:2])
            known[case] = figures[0], words_of(figures[0]), file
        return known[case]

    return look_up


@pytest.mark.short("three lines", "no ink", "empty record")
@pytest.mark.parametrize("case", CASES)
def test_every_case_has_a_picture_that_says_what_it_shows(case, drawn):
    _, _, *expected = CASES[case]
    _, words, file = drawn(case)
    shown = "\n".join(words)
    for text in [*expected, "driver.py lines", "planar, 8.0 V", "TRUE tip", "5 cm"]:
        assert text in shown
    pixels = imread(file)[:, :, :3]
    assert pixels.shape == (HEIGHT, WIDTH, 3)
    for box in (SHEET, COLUMN):
        assert inked(pixels, box, "white") < 0.99 * box[2] * box[3] * WIDTH * HEIGHT
    # What was cut off would leave its traces at the edge.
    for edge in (pixels[0], pixels[-1], pixels[:, 0], pixels[:, -1]):
        assert (edge == 1).all()


def test_ink_and_wanted_path_are_there(drawn):
    def seen(case, colour):
        return inked(imread(drawn(case)[2]), SHEET, colour)

    assert seen("no wanted path", INK) > seen("no ink", INK) + 1000
    assert seen("empty record, wanted", WANTED) > seen("empty record", WANTED) + 500


@pytest.mark.long
def test_the_worst_paths_are_shown_in_the_order_of_drawing(tmp_path, saved):
    rows = record(FAN, aside=0.02)
    draw(tmp_path / "picture.png", rows, FAN)
    measures = measure(rows, FAN)
    worst = sorted(range(20), key=lambda k: -measures[k].greatest_mm)[:6]
    numbers = [axes.texts[0].get_text() for axes in saved[0].axes[1:]]
    assert numbers == [str(k + 1) for k in sorted(worst)]


def test_the_deviations_share_their_scales_and_the_floor_is_a_band(tmp_path, saved):
    rows, wanted, *_ = CASES["three lines"]
    draw(tmp_path / "picture.png", rows, wanted, floor=9)
    panels = saved[0].axes[1:]
    assert len({(axes.get_xlim(), axes.get_ylim()) for axes in panels}) == 1
    assert words_of(saved[0]).count("floor 9.00") == 3
    assert all(axes.get_ylim()[0] < -9 for axes in panels)


def test_without_ink_the_way_of_the_tip_is_in_sight(drawn):
    figure, *_ = drawn("no ink")
    assert figure.axes[0].get_xlim()[1] > 20.8


def test_a_pen_that_is_always_down_has_no_way_with_the_pen_up(drawn):
    _, words, _ = drawn("always down")
    assert "pen up" not in words


def test_a_picture_without_an_arm(tmp_path):
    write_line_plot(
        tmp_path / "picture.png", record(LINES), [], [], FinalPose([], (0, 20.8)), "no arm"
    )
    assert inked(imread(tmp_path / "picture.png"), SHEET, ARM) == 0


def test_a_dot_of_ink_is_seen(drawn, tmp_path):
    def seen(file):
        return inked(imread(file), SHEET, INK)

    rows = record(LINES)
    draw(tmp_path / "picture.png", [*rows, Row(rows[-1].t + 1, (0, 0), 3, 13, 1)], [])
    assert seen(tmp_path / "picture.png") > seen(drawn("no wanted path")[2]) + 10


def test_the_same_run_gives_the_same_bytes_whatever_the_users_style(drawn, tmp_path):
    first, second = drawn("three lines")[2], tmp_path / "second.png"
    with matplotlib.rc_context({"font.size": 30, "lines.linewidth": 9, "savefig.bbox": "tight"}):
        draw(second, *CASES["three lines"][:2])
        assert matplotlib.rcParams["font.size"] == 30
    assert first.read_bytes() == second.read_bytes()
    assert b"matplotlib" not in first.read_bytes().lower()


def test_as_many_measures_as_paths(tmp_path):
    with pytest.raises(ValueError, match="0 measures for 3 wanted paths"):
        write_line_plot(tmp_path / "picture.png", [], LINES, [], FinalPose(SKELETON, REACH), "", "")


def test_a_picture_that_cannot_be_written_is_an_os_error(tmp_path):
    with pytest.raises(FileNotFoundError):
        draw(tmp_path / "nowhere" / "picture.png", [], [])
