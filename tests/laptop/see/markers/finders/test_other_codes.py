"""What is said where the ArUco marker that is looked for is not seen, but other codes are."""

import cv2
import numpy as np
import pytest

from laptop.emulator.scene.optics import to_srgb
from laptop.page.camera_feed import _advice
from laptop.see.markers.board import BOARDS, DICTIONARY
from laptop.see.markers.finders import aruco
from laptop.see.markers.finders.aruco import OTHERS_EVERY, find_aruco
from laptop.see.markers.finders.other_codes import FAMILIES, other_codes
from laptop.see.markers.markers import read_spec
from laptop.see.markers.tracker import Tracker
from laptop.see.markers.tracks import Track

MARKER = read_spec("effector", "aruco:7")
IS_4X4 = "; it takes a 4x4 one: brickservo markers prints some"
IS_SINGLE = "; it takes a single 4x4 one: brickservo markers prints some"


def code(dictionary, number, side=40):
    """A code on its paper, cut along the white rim."""
    dictionary = cv2.aruco.getPredefinedDictionary(dictionary)
    cells = dictionary.markerSize + 2
    drawn = cv2.aruco.generateImageMarker(dictionary, number, 12 * cells)
    drawn = cv2.copyMakeBorder(drawn, *[12] * 4, cv2.BORDER_CONSTANT, value=255)
    size = round(side * (cells + 2) / cells)
    return cv2.resize(drawn, (size, size), interpolation=cv2.INTER_AREA)


def table(*codes, ground=90, turn=0.0, seed=0):
    """Codes side by side on a table."""
    image = np.full((200, max(320, 90 * len(codes))), ground, np.uint8)
    for k, drawn in enumerate(codes):
        height, width = drawn.shape
        image[50 : 50 + height, 30 + 85 * k : 30 + 85 * k + width] = drawn
    middle = (30 + len(codes[0]) / 2, 50 + len(codes[0]) / 2) if codes else (160, 100)
    turned = cv2.getRotationMatrix2D(middle, turn, 1.0)
    image = cv2.warpAffine(image, turned, image.shape[1::-1], borderValue=[ground])
    return spoilt(image, seed)


def spoilt(grey, seed=0):
    """Blurred, with noise: BGR."""
    values = 20 + 0.8 * cv2.GaussianBlur(grey, (0, 0), 0.8).astype(float)
    values += np.random.default_rng(seed).normal(0, 3, grey.shape)
    return cv2.cvtColor(np.clip(values, 0, 255).astype(np.uint8), cv2.COLOR_GRAY2BGR)


def charuco(dictionary=cv2.aruco.DICT_4X4_50, ids=None):
    board = cv2.aruco.CharucoBoard(
        (7, 5), 0.04, 0.03, cv2.aruco.getPredefinedDictionary(dictionary), ids
    )
    grey = board.generateImage((560, 400), marginSize=20)
    return spoilt(cv2.copyMakeBorder(grey, *[30] * 4, cv2.BORDER_CONSTANT, value=90))


def why(image, marker=MARKER):
    return find_aruco(image, 0.0, marker, Track()).why


@pytest.mark.parametrize("ground", [40, 235])
@pytest.mark.parametrize(
    ("dictionary", "number", "reported"),
    [
        (cv2.aruco.DICT_4X4_50, 8, ", only 8"),
        (cv2.aruco.DICT_4X4_1000, 582, ", only 582"),
        (cv2.aruco.DICT_5X5_50, 3, ", only 5x5 marker 3" + IS_4X4),
        (cv2.aruco.DICT_6X6_250, 200, ", only 6x6 marker 200" + IS_4X4),
        (cv2.aruco.DICT_7X7_1000, 7, ", only 7x7 marker 7" + IS_4X4),
        (cv2.aruco.DICT_ARUCO_ORIGINAL, 7, ", only original ArUco marker 7" + IS_4X4),
        (cv2.aruco.DICT_APRILTAG_36h11, 0, ", only AprilTag 36h11 marker 0" + IS_4X4),
        (cv2.aruco.DICT_ARUCO_MIP_36h12, 5, ", only ArUco MIP 36h12 marker 5" + IS_4X4),
    ],
)
def test_a_code_that_is_not_it_is_named(dictionary, number, reported, ground):
    for turn in (0, 20, 90, 200):
        image = table(code(dictionary, number), ground=ground, turn=turn)
        assert why(image) == "no ArUco marker 7" + reported


def test_of_many_markers_some_are_named():
    codes = [code(cv2.aruco.DICT_4X4_50, number) for number in (9, 4, 30, 2, 1)]
    turned = [np.rot90(one, k) for k, one in enumerate(codes)]
    assert why(table(*turned[:2])) == "no ArUco marker 7, only 4, 9"
    assert why(table(*turned)) == "no ArUco marker 7, only 1, 2, 4 and 2 more"
    other = [code(cv2.aruco.DICT_6X6_50, number) for number in (9, 7)]
    assert why(table(*other)) == "no ArUco marker 7, only 6x6 markers 7, 9" + IS_4X4


@pytest.mark.parametrize(
    ("board", "reported"),
    [
        (charuco(ids=np.arange(20, 37)), "a board of markers" + IS_SINGLE),
        (charuco(cv2.aruco.DICT_4X4_100, np.arange(60, 77)), "a board of markers" + IS_SINGLE),
        (charuco(cv2.aruco.DICT_5X5_100), "a board of 5x5 markers" + IS_SINGLE),
        (
            spoilt(
                cv2.aruco.GridBoard(
                    (5, 4), 4, 1, cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_6X6_250)
                ).generateImage((500, 400), marginSize=10)
            ),
            "a board of 6x6 markers" + IS_SINGLE,
        ),
    ],
    ids=["ChArUco", "other numbers", "ChArUco 5x5", "grid"],
)
def test_a_board_is_told_apart_from_single_markers(board, reported):
    assert why(board) == f"no ArUco marker 7, only {reported}"


@pytest.mark.parametrize("paper", BOARDS)
def test_the_printed_board_may_lie_there(paper):
    board = BOARDS[paper]
    image = np.full((int(16 * board.height), int(16 * board.width)), 255, np.uint8)
    for number, (x, y) in zip(board.numbers, board.centres, strict=True):
        drawn = code(DICTIONARY, number)[6:-6, 6:-6]
        left = int(16 * (board.width / 2 + x)) - len(drawn) // 2
        top = int(16 * (board.height / 2 - y)) - len(drawn) // 2
        image[top : top + len(drawn), left : left + len(drawn)] = drawn
    assert why(spoilt(image)) == "no ArUco marker 7, only the printed board"


def test_a_marker_that_is_seen_is_seen_whatever_is_beside_it():
    image = table(*(code(cv2.aruco.DICT_4X4_50, n) for n in (8, 7)), code(FAMILIES["6x6"], 1))
    assert find_aruco(image, 0.0, MARKER, Track()).sighting is not None


def test_one_frame_in_many_is_looked_at_for_other_codes(monkeypatch):
    looked = []
    monkeypatch.setattr(aruco, "other_codes", lambda grey: looked.append(1) or other_codes(grey))
    tracker = Tracker([MARKER])
    image = table(code(FAMILIES["6x6"], 3))
    for k in range(3 * OTHERS_EVERY):
        assert tracker.find(image, k / 30) == {"effector": None}
        assert tracker.why["effector"] == "no ArUco marker 7, only 6x6 marker 3" + IS_4X4
    assert len(looked) == 3
    for k in range(OTHERS_EVERY + 1):
        tracker.find(table(), 10 + k / 30)
    assert tracker.why["effector"] == "no ArUco marker 7"
    tracker.find(table(code(cv2.aruco.DICT_4X4_50, 8)), 20)
    assert tracker.why["effector"] == "no ArUco marker 7, only 8"


def test_a_marker_too_blurred_to_be_placed_is_not_called_another_one(monkeypatch):
    quads = dict.fromkeys((7, 9), np.zeros((4, 2), np.float32))
    monkeypatch.setattr(aruco, "other_codes", lambda grey: {"4x4": {7: quads[7]}})
    assert why(table()) == "no ArUco marker 7"
    monkeypatch.setattr(aruco, "other_codes", lambda grey: {"4x4": dict(quads)})
    assert why(table()) == "no ArUco marker 7, only 9"


def leaves(seed):
    """A ground full of overlapping ellipses with stalks, in greys: many edges, no code."""
    draw = np.random.default_rng(seed)
    image = np.full((480, 640), 120, np.uint8)
    for _ in range(700):
        place = tuple(int(x) for x in draw.uniform((0, 0), (640, 480)))
        axes = tuple(int(x) for x in draw.uniform((8, 4), (40, 16)))
        turn, shade = draw.uniform(0, 360), int(draw.uniform(20, 235))
        cv2.ellipse(image, place, axes, turn, 0, 360, shade, -1)
        cv2.ellipse(image, place, (axes[0], 1), turn, 0, 360, max(shade - 60, 0), -1)
    return image


def boxes(seed):
    """Rectangles in rectangles, as windows, keys and shelves are."""
    draw = np.random.default_rng(seed)
    image = np.full((480, 640), 120, np.uint8)
    for _ in range(200):
        left, top, width, height = (int(x) for x in draw.uniform((0, 0, 8, 8), (600, 440, 90, 90)))
        cv2.rectangle(image, (left, top), (left + width, top + height), int(draw.integers(256)), -1)
    return image


def noise(seed):
    draw = np.random.default_rng(seed)
    values = cv2.GaussianBlur(draw.random((480, 640)), (0, 0), 1 + seed % 4)
    return to_srgb(cv2.normalize(values, None, 0, 1, cv2.NORM_MINMAX)).astype(np.uint8)


@pytest.mark.short(every=6)
@pytest.mark.parametrize("seed", range(12))
@pytest.mark.parametrize("ground", [leaves, boxes, noise])
def test_where_no_code_is_none_is_read(ground, seed):
    assert other_codes(ground(seed)) == {}


@pytest.mark.short(every=3)
@pytest.mark.parametrize("bits", [3, 5, 6, 7, 8, 10])
def test_a_code_of_no_family_is_not_named(bits):
    """Black frames with any bits in them: one with 4 x 4 bits may well be a code."""
    draw = np.random.default_rng(bits)
    for _ in range(100):
        cells = np.zeros((bits + 2, bits + 2), np.uint8)
        cells[1:-1, 1:-1] = 255 * draw.integers(0, 2, (bits, bits))
        cells = np.pad(cells, 1, constant_values=255)
        drawn = cv2.resize(cells, (96, 96), interpolation=cv2.INTER_AREA)
        found = other_codes(cv2.copyMakeBorder(drawn, *[20] * 4, cv2.BORDER_CONSTANT, value=90))
        assert found.keys() <= ({"4x4"} if bits == 3 else set())


@pytest.mark.parametrize(
    ("why", "advice"),
    [
        ("no ArUco marker 7", "bring it into the picture"),
        ("no ArUco marker 7, only 8", "bring it into the picture"),
        ("no ArUco marker 7, only 6x6 marker 3" + IS_4X4, ""),
    ],
)
def test_on_the_page_what_to_do_is_said_once(why, advice):
    assert _advice(why)[: len("bring it into the picture")] == advice
