import re

import cv2
import numpy as np
import pytest

from laptop.see.markers import marker_sheet
from laptop.see.markers.board import BOARDS, CROSSES, DICTIONARY, MARKER
from laptop.see.markers.board_sheet import write_board
from laptop.see.markers.finders.aruco import detector
from laptop.see.markers.markers import ARUCO_IDS

STUCK_ON = cv2.aruco.DICT_4X4_50
"""The dictionary of markers on an arm."""

PX_PER_CM = 100
"""254 dots an inch."""


@pytest.fixture(scope="module", params=["a4", pytest.param("letter", marks=pytest.mark.long)])
def page(request, tmp_path_factory):
    file = tmp_path_factory.mktemp("board") / "board.png"
    board = write_board(file, request.param)
    return board, cv2.imread(str(file), cv2.IMREAD_GRAYSCALE)


def on_board(board, pixels):
    """Pixels of the page, (n, 2), in the board's frame, cm."""
    places = (np.asarray(pixels, float) + 0.5) / PX_PER_CM
    return (places - (board.width / 2, board.height / 2)) * (1, -1)


def test_the_page_has_the_papers_size(page):
    board, image = page
    millimetres = {"a4": (210, 297), "letter": (215.9, 279.4)}[board.paper]
    assert image.shape[::-1] == pytest.approx(np.array(millimetres) * 10, abs=0.01)


def test_its_markers_are_where_the_board_says_and_as_large(page):
    board, image = page
    quads, numbers, _ = detector(DICTIONARY).detectMarkers(
        cv2.copyMakeBorder(image, *[9] * 4, 1, value=255)
    )
    assert sorted(numbers.ravel()) == list(board.numbers)
    for quad, number in zip(quads, numbers.ravel()):
        seen = on_board(board, quad[0] - 9)
        assert np.abs(seen - board.square(number)[:, :2]).max() < 0.015
    assert board.square(board.first)[0] == pytest.approx(
        (1 - board.width / 2, board.height / 2 - 1, 0)
    )
    assert MARKER == 2.5


def test_boards_share_no_number_with_each_other_nor_with_markers_that_are_stuck_on():
    used = [number for board in BOARDS.values() for number in board.numbers]
    assert len(used) == len(set(used))
    assert min(used) >= ARUCO_IDS
    assert max(used) < 100
    for board in BOARDS.values():
        assert len(board.centres) == len(board.numbers)


def test_no_marker_of_an_arm_is_seen_on_the_board(page):
    _, image = page
    small = cv2.resize(image, None, fx=0.28, fy=0.28, interpolation=cv2.INTER_AREA)
    _, numbers, _ = detector().detectMarkers(small)
    assert numbers is None
    numbered = cv2.aruco.generateImageMarker(cv2.aruco.getPredefinedDictionary(STUCK_ON), 7, 60)
    small[100:160, 100:160] = numbered
    assert list(detector().detectMarkers(small)[1].ravel()) == [7]


def test_the_codes_stay_two_wrong_bits_away_from_those_that_are_stuck_on():
    def bits(number):
        dictionary = cv2.aruco.getPredefinedDictionary(DICTIONARY)
        return cv2.aruco.generateImageMarker(dictionary, number, 6)[1:5, 1:5] > 0

    apart = min(
        (bits(a) != np.rot90(bits(b), turns)).sum()
        for a in range(50)
        for b in range(50, 100)
        for turns in range(4)
    )
    assert apart >= 3  # one wrong bit is put right by the detector


def test_the_bar_is_100_mm_long(page):
    board, image = page
    row = round((board.height / 2 + 9.2) * PX_PER_CM)
    middle = board.width / 2 * PX_PER_CM
    line = image[row - 1 : row + 2].min(axis=0)
    inside = np.flatnonzero(line[int(middle) - 650 : int(middle) + 650] < 128)
    assert np.ptp(inside) + 1 == pytest.approx(1000, abs=5)
    assert len(inside) > 990  # and straight


def test_its_crosses_are_where_the_board_says(page):
    board, image = page
    for x, y in CROSSES:
        u, v = ((board.width / 2 + x) * PX_PER_CM, (board.height / 2 - y) * PX_PER_CM)
        across = image[int(v) - 30, int(u) - 20 : int(u) + 20]
        down = image[int(v) - 20 : int(v) + 20, int(u) - 30]
        for line, whole in ((across, u), (down, v)):
            dark = np.average(np.arange(40) + 0.5, weights=255.0 - line) + int(whole) - 20
            assert dark == pytest.approx(whole, abs=0.3)


def test_the_middle_is_free_but_for_crosses_and_words(page):
    board, image = page
    width, height = (round(side * PX_PER_CM) for side in board.middle)
    assert width >= 13 * PX_PER_CM
    top, left = (image.shape[0] - height) // 2, (image.shape[1] - width) // 2
    middle = image[top : top + height, left : left + width]
    assert (middle < 200).mean() < 0.01


@pytest.mark.parametrize(
    ("name", "paper", "reported"),
    [
        ("board.doc", "a4", "board.doc: end its name in .pdf, .svg or .png"),
        ("none/board.pdf", "a4", "none/board.pdf: there is no folder none; make it first"),
        ("board.pdf", "a3", "paper 'a3': there is a board for a4 and for letter"),
    ],
)
def test_what_cannot_be_made_is_said_in_one_line(name, paper, reported, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(marker_sheet.BadSheet, match=f"^{re.escape(reported)}$"):
        write_board(tmp_path.__class__(name), paper)
    assert list(tmp_path.iterdir()) == []


def test_the_pdf_is_as_large_as_the_paper(tmp_path):
    write_board(tmp_path / "board.pdf", "letter")
    box = re.search(rb"/MediaBox \[ ?([\d. ]+)\]", (tmp_path / "board.pdf").read_bytes())
    assert list(map(float, box.group(1).split())) == pytest.approx([0, 0, 612, 792], abs=0.1)
