"""What a marker looks like: words, files that people write by hand, and the gate of a colour."""

import colorsys
import itertools

import cv2
import numpy as np
import pytest
from odd_files import ODD

from laptop.see.markers import kinds
from laptop.see.markers.markers import (
    ARUCO_IDS,
    NAMED_COLORS,
    BadMarker,
    Color,
    Marker,
    hsv_mask,
    hsv_of,
    hue_distance,
    read_markers,
    read_spec,
    scene_of,
    write_markers,
)

COLOR = """\
kind = ball
hue = 133.5
tolerance = 24
saturation = 0.62
value = 0.71
"""


def refusal(call, *args):
    """The one line that a person reads."""
    with pytest.raises(BadMarker) as caught:
        call(*args)
    text = str(caught.value)
    assert text
    assert "\n" not in text
    assert len(text) < 600
    return text


@pytest.fixture
def file(tmp_path):
    def write(text):
        path = tmp_path / "markers.ini"
        path.write_text(text, encoding="utf-8")
        return path

    return write


# Words


@pytest.mark.parametrize("word", NAMED_COLORS)
def test_a_word_is_a_disc_of_this_colour(word):
    assert read_spec("effector", word) == Marker("effector", "disc", NAMED_COLORS[word])


def test_a_kind_may_be_said_before_a_colour():
    assert read_spec("goal", "ball:green") == Marker("goal", "ball", NAMED_COLORS["green"])
    assert read_spec("goal", "disc:red") == Marker("goal", "disc", NAMED_COLORS["red"])


@pytest.mark.parametrize("number", [0, ARUCO_IDS - 1])
def test_an_aruco_marker_has_a_number(number):
    assert read_spec("effector", f"aruco:{number}") == Marker("effector", "aruco", id=number)


@pytest.mark.parametrize("number", ["", "50", "-1", "1.5", "one", "1e1", " 3", "²", "9" * 30])
def test_another_number_of_an_aruco_marker_is_refused_with_the_limit(number):
    text = refusal(read_spec, "effector", f"aruco:{number}")
    assert "effector" in text
    assert f"'aruco:{number}'" in text
    assert "0 to 49" in text


@pytest.mark.parametrize(
    "text", ["aruco:" + 5000 * "5", "\x1b[31mblue", "x\x1b]0;y\x07.ini", "a\nb"]
)
def test_what_is_long_or_steers_a_terminal_is_shown_as_one_short_line(text):
    shown = refusal(read_spec, "effector", text)
    assert shown.isprintable()
    assert len(shown) < 300


@pytest.mark.parametrize(
    "spec",
    ["", "disc", "ball", "aruco", "disc:", "ball:", ":", ":red", "Red", "mauve", "ball:mauve",
     "cube:red", "ball:ball:red", "red ",
     "disc:" + "x" * 50],
)  # fmt: skip
def test_a_spec_without_meaning_is_refused_with_what_may_be_written(spec):
    text = refusal(read_spec, "effector", spec)
    assert "effector" in text
    assert f"'{spec}'" in text
    assert "red, orange, yellow" in text
    assert "aruco:ID" in text


def test_a_spec_too_long_for_a_file_name_is_no_file():
    with pytest.raises(BadMarker, match="write disc:COLOUR"):
        read_spec("effector", "x" * 5000)


@pytest.mark.parametrize("kind", ["", "ball:"])
def test_a_file_that_is_not_there_is_called_so(tmp_path, kind):
    for missing in (tmp_path, "no/such/file.ini", "markers.ini"):
        reported = f"effector '{kind}{missing}': there is no file {missing}; make it with --pick"
        assert refusal(read_spec, "effector", f"{kind}{missing}") == reported


def test_for_the_goal_a_point_is_offered_too():
    assert refusal(read_spec, "goal", "400").endswith("or a point U,V such as 400,200")
    assert "U,V" not in refusal(read_spec, "effector", "400")


def test_a_word_means_what_people_call_so():
    paints = {
        "red": (200, 20, 30),
        "orange": (232, 114, 12),
        "yellow": (242, 197, 15),
        "green": (15, 143, 60),
        "cyan": (22, 165, 184),
        "blue": (18, 80, 180),
        "purple": (107, 47, 150),
        "pink": (230, 60, 150),
    }
    assert set(paints) == set(NAMED_COLORS)
    rgb = np.array([list(paints.values())], np.uint8)
    hsv = cv2.cvtColor(rgb, cv2.COLOR_RGB2HSV)
    for k, word in enumerate(paints):
        assert [bool(hsv_mask(hsv, NAMED_COLORS[other])[0, k]) for other in paints] == [
            other == word for other in paints
        ]


# Files


def test_a_spec_may_be_a_file_that_holds_the_name(file):
    path = file("[effector]\n" + COLOR + "[goal]\nkind = aruco\nid = 3\n")
    color = Color(133.5, 0.62, 0.71, 24)
    assert read_spec("effector", str(path)) == Marker("effector", "ball", color)
    assert read_spec("goal", str(path)) == Marker("goal", "aruco", id=3)


def test_a_kind_before_a_file_is_what_counts(file):
    path = file("[effector]\n" + COLOR)
    assert read_spec("effector", f"disc:{path}").kind == "disc"
    assert read_spec("effector", f"disc:{path}").color == Color(133.5, 0.62, 0.71, 24)


def test_an_aruco_marker_of_a_file_has_no_colour_to_track(file):
    path = file("[effector]\nkind = aruco\nid = 3\n")
    text = refusal(read_spec, "effector", f"disc:{path}")
    assert str(path) in text
    assert "aruco:3" in text


def test_a_file_without_the_name_says_which_it_holds(file):
    path = file("[goal]\n" + COLOR + "[other]\n" + COLOR)
    text = refusal(read_spec, "effector", str(path))
    assert str(path) in text
    assert "[effector]" in text
    assert "goal, other" in text
    assert "--pick" in text
    assert "nothing" in refusal(read_spec, "effector", str(file("# empty\n")))


def test_what_is_not_said_in_a_file_has_a_default(file):
    path = file("[effector]\nhue=10\ntolerance=20\nsaturation=0.5\nvalue=0.5\n")
    assert read_markers(path) == {
        "effector": Marker("effector", "disc", Color(10, 0.5, 0.5, 20, scene=None), radius=None)
    }


def test_a_file_may_be_empty(file):
    assert read_markers(file("")) == {}


def test_markers_come_back_from_their_file_as_they_were(tmp_path):
    markers = {
        "effector": Marker(
            "effector", "ball", Color(0, 1, 1, 8, scene=(255.0, 0.0, 12.3)), radius=31.25
        ),
        "goal": Marker("goal", "disc", Color(359.9, 0.12, 0.02, 40)),
        "x_1-y": Marker("x_1-y", "aruco", id=49),
        "DEFAULT": Marker("DEFAULT", "disc", Color(55, 0.05, 0.8, 15.5), radius=2000),
    }
    path = tmp_path / "a" / "b" / "markers.ini"
    write_markers(path, markers)
    assert read_markers(path) == markers
    assert list(read_markers(path)) == list(markers)
    write_markers(path, {})
    assert read_markers(path) == {}
    assert [entry.name for entry in path.parent.iterdir()] == ["markers.ini"]


def test_a_written_file_tells_how_to_correct_it(tmp_path):
    path = tmp_path / "markers.ini"
    write_markers(path, {"effector": Marker("effector", "disc", NAMED_COLORS["red"])})
    text = path.read_text(encoding="utf-8")
    for what in ("degrees", "0 red", "hue = 0", "saturation = 0.85", "[effector]"):
        assert what in text


NUMBERS = {
    "hue": ("0 to 360", ["-0.1", "360.1"]),
    "tolerance": ("1 to 90", ["0.9", "91", "0"]),
    "saturation": ("0.05 to 1", ["0", "1.01", "85"]),
    "value": ("0.02 to 1", ["0.01", "2"]),
    "radius": ("1 to 2000", ["0", "2001", "-30"]),
}
NEVER = ["", "nan", "inf", "-inf", "red", "0,5", "1 2", "50 %", "0.5 ; half", "0x1"]
KINDS = ["", "cube", "Disc", "disc ball", "aruco:3"]
SCENES = ["", "1", "1,2", "1,2,3,4", "1,2,red", "1,2,256", "-1,2,3", "nan,1,1", "inf,1,1", "1;2;3"]


def with_value(key, value):
    lines = dict(line.split(" = ") for line in COLOR.splitlines())
    lines[key] = value
    return "[goal]\n" + COLOR + "[effector]\n" + "".join(f"{k} = {v}\n" for k, v in lines.items())


WRONG = [
    *(
        (key, value, f"a number from {limits}")
        for key, (limits, wrong) in NUMBERS.items()
        for value in [*wrong, *NEVER]
    ),
    *(("scene", value, "three numbers from 0 to 255: red, green, blue") for value in SCENES),
    *(("kind", value, "one of " + ", ".join(kinds.KINDS)) for value in KINDS),
]


@pytest.mark.parametrize(("key", "value", "wanted"), WRONG)
def test_a_wrong_value_is_named_with_its_file_section_key_and_what_it_may_be(
    file, key, value, wanted
):
    path = file(with_value(key, value))
    assert refusal(read_markers, path) == f"{path}: [effector] {key}: '{value}' is not {wanted}"


@pytest.mark.parametrize("key", ["hue", "tolerance", "saturation", "value", "radius"])
def test_the_limits_themselves_are_allowed(file, key):
    for limit in NUMBERS[key][0].split(" to "):
        marker = read_markers(file(with_value(key, limit)))["effector"]
        got = marker.radius if key == "radius" else getattr(marker.color, key)
        assert got == float(limit)


@pytest.mark.parametrize("key", ["hue", "tolerance", "saturation", "value"])
def test_a_missing_number_is_named(file, key):
    remaining = "".join(line for line in COLOR.splitlines(True) if not line.startswith(key))
    path = file("[effector]\n" + remaining)
    assert refusal(read_markers, path) == (
        f"{path}: [effector] {key}: missing; a number from {NUMBERS[key][0]}"
    )


@pytest.mark.parametrize("value", ["50", "-1", "1.0", "", "three", "nan"])
def test_a_wrong_aruco_number_is_named(file, value):
    path = file(f"[effector]\nkind = aruco\nid = {value}\n")
    assert refusal(read_markers, path) == (
        f"{path}: [effector] id: '{value}' is not a whole number from 0 to 49"
    )


def test_an_aruco_marker_without_a_number_is_named(file):
    path = file("[effector]\nkind = aruco\n")
    assert refusal(read_markers, path) == (
        f"{path}: [effector] id: missing; a whole number from 0 to 49"
    )


def test_an_unknown_key_is_named_with_those_there_are(file):
    path = file("[effector]\n" + COLOR + "hew = 3\n")
    text = refusal(read_markers, path)
    assert text.startswith(f"{path}: [effector] hew: no such key; there are kind, id, scene, hue, ")


def test_a_value_that_runs_over_two_lines_is_told_in_one(file):
    for key in ("kind", "hue", "scene"):
        path = file(with_value(key, "12\n  13"))
        assert refusal(read_markers, path).startswith(f"{path}: [effector] {key}: '12")


@pytest.mark.parametrize(
    ("content", "why"),
    [
        (b"hue = 3\n", "not a markers file"),
        (b"[effector]\nhue = 3\nhue = 4\n", "twice (line 3)"),
        (b"[effector]\nhue = 3\n[effector]\n", "twice (line 3)"),
        (b"[effector]\nhue\n", "not a markers file"),
        (b"[effector\nhue = 3\n", "not a markers file"),
        (b"\xff\xd8\xff\xe0\x00\x10JFIF\x00", "not a markers file"),
        (b"\x00\x01\x02", "not a markers file"),
        (b"[effector]\n" + b"".join(b"line %d\n" % k for k in range(2000)), "not a markers file"),
        (b"frame,t,marker,u,v,confidence\n" * 1000, "not a markers file"),
        (b"x" * 100000, "not a markers file"),
    ],
    ids=["no section", "key twice", "section twice", "no value", "no bracket", "picture", "zeros",
         "long text", "table", "long line"],
)  # fmt: skip
def test_what_is_no_markers_file_is_refused(tmp_path, content, why):
    path = tmp_path / "markers.ini"
    path.write_bytes(content)
    text = refusal(read_markers, path)
    assert text.startswith(f"{path}: ")
    assert why in text
    assert text.endswith("correct or remove it")


@pytest.mark.parametrize("kind", sorted(set(ODD) - {"empty", "list"}))
def test_whatever_has_become_of_the_file_is_said_at_once(tmp_path, kind):
    ODD[kind][0](str(tmp_path / "markers.ini"))
    text = refusal(read_markers, tmp_path / "markers.ini")
    assert "markers.ini: this is not a markers file" in text
    assert "\n" not in text


@pytest.mark.parametrize(
    "content",
    [
        "[eff\x1b[31mector]\nhue = 1\n",
        "[" + "e" * 9000 + "]\nhue = 1\n",
        "[effector]\nkind = \x1b[2Jball\n",
        "[effector]\nhue = " + "1 " * 9000 + "\n",
        "[effector]\nkind = aruco\nid = " + "9" * 5000 + "\n",
        "[effector]\n" + "h" * 9000 + " = 1\n",
    ],
)
def test_a_refusal_is_short_and_steers_no_terminal(tmp_path, content):
    (tmp_path / "markers.ini").write_text(content)
    text = refusal(read_markers, tmp_path / "markers.ini")
    assert text.isprintable()
    assert len(text) < len(str(tmp_path)) + 250


def test_what_cannot_be_read_is_refused(tmp_path):
    assert str(tmp_path) in refusal(read_markers, tmp_path)
    assert "No such file" in refusal(read_markers, tmp_path / "none.ini")
    assert "too long" in refusal(read_markers, "x" * 300)


def test_what_cannot_be_written_is_told_with_the_way_out(tmp_path):
    markers = {"effector": Marker("effector", "disc", NAMED_COLORS["red"])}
    taken = tmp_path / "taken"
    taken.write_text("mine")
    folder = tmp_path / "folder"
    (folder / "inside").mkdir(parents=True)
    for target in (taken / "markers.ini", folder, tmp_path / ("x" * 300), "/", "."):
        text = refusal(write_markers, target, markers)
        assert text.startswith("cannot write ")
        assert "--markers" in text
    assert taken.read_text() == "mine"
    assert sorted(entry.name for entry in tmp_path.iterdir()) == ["folder", "taken"]


def test_a_file_that_cannot_be_replaced_stays_as_it_was(tmp_path, monkeypatch):
    path = tmp_path / "markers.ini"
    write_markers(path, {"goal": Marker("goal", "disc", NAMED_COLORS["red"])})
    before = path.read_bytes()

    def full(draft, target):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("os.replace", full)
    text = refusal(write_markers, path, {"goal": Marker("goal", "disc", NAMED_COLORS["blue"])})
    assert "No space left" in text
    assert path.read_bytes() == before
    assert [entry.name for entry in tmp_path.iterdir()] == ["markers.ini"]


def test_a_marker_says_what_it_looks_like():
    assert str(Marker("goal", "aruco", id=7)) == "aruco:7"
    text = str(Marker("goal", "ball", Color(133.4, 0.621, 0.71, 24)))
    assert text == "ball, hue 133 +- 24, saturation 0.62, value 0.71"


# Colours


def test_hsv_agrees_with_the_standard_library():
    steps = (0, 1, 77, 128, 254, 255)
    for r, g, b in itertools.product(steps, repeat=3):
        h, s, v = colorsys.rgb_to_hsv(r / 255, g / 255, b / 255)
        hue, saturation, value = hsv_of((b, g, r))
        assert abs(hue_distance(hue, 360 * h)) < 1e-9
        assert (saturation, value) == pytest.approx((s, v))
        assert 0 <= hue < 360


def test_hsv_takes_what_a_mean_gives():
    assert hsv_of(np.array([10.0, 10.0, 60.5])) == pytest.approx((0, 50.5 / 60.5, 60.5 / 255))
    assert hsv_of((0, 0, 0)) == (0, 0, 0)


@pytest.mark.parametrize(
    ("a", "b", "way"),
    [(10, 350, 20), (350, 10, -20), (0, 360, 0), (90, 0, 90), (179, 0, 179), (181, 0, -179)],
)
def test_hues_are_apart_the_short_way_round(a, b, way):
    assert hue_distance(a, b) == way
    assert hue_distance(a + 360, b) == way


def strip(hue=None, saturation=200, value=200):
    """Every hue, or every value of what is a range."""
    parts = (np.arange(180) if hue is None else hue), saturation, value
    return np.stack(np.broadcast_arrays(*parts), axis=-1)[None].astype(np.uint8)


@pytest.mark.parametrize("tolerance", [1, 5, 20, 33.3, 40, 90])
@pytest.mark.parametrize("hue", [0, 1, 10, 19.9, 20, 60, 123.4, 180, 240, 320, 340, 341, 359, 360])
def test_the_gate_lets_in_what_is_within_the_tolerance_all_around_the_circle(hue, tolerance):
    inside = hsv_mask(strip(), Color(hue, 0.8, 0.8, tolerance))[0] > 0
    away = np.array([abs(hue_distance(2 * k, hue)) for k in range(180)])
    # OpenCV's hues are two degrees apart.
    assert inside[away <= tolerance - 1].all()
    assert not inside[away > tolerance + 1].any()


def test_the_gate_lets_red_in_on_either_side_of_zero():
    hues = np.array([160, 169, 170, 175, 179, 0, 5, 10, 11, 20])
    inside = hsv_mask(strip(hue=hues), Color(0, 0.8, 0.8, 20))[0] > 0
    assert inside.tolist() == [False, False] + 6 * [True] + [False, False]


@pytest.mark.parametrize(("hue", "edge"), [(358, 0), (340, 0), (20, 0), (2, 179), (18, 179)])
def test_the_gate_reaches_over_the_edge_of_opencv_s_hues(hue, edge):
    assert hsv_mask(strip(hue=np.array([edge])), Color(hue, 0.8, 0.8, 20)).all()


def test_a_gate_as_wide_as_the_circle_lets_every_hue_in():
    for hue in (0, 90, 180, 200, 359):
        assert hsv_mask(strip(), Color(hue, 0.8, 0.8, 180)).all()


@pytest.mark.parametrize("hue", [0, 120, 350])
def test_the_gate_is_closed_towards_grey_and_black_and_open_towards_vivid_and_bright(hue):
    every = np.arange(256)
    color = Color(hue, 0.8, 0.6, 20)
    inside = hsv_mask(strip(hue=hue // 2, saturation=every), color)[0] > 0
    assert not inside[: round(0.55 * 0.8 * 255) - 1].any()
    assert inside[round(0.55 * 0.8 * 255) + 1 :].all()
    inside = hsv_mask(strip(hue=hue // 2, value=every), color)[0] > 0
    assert not inside[: round(0.4 * 0.6 * 255) - 1].any()
    assert inside[round(0.4 * 0.6 * 255) + 1 :].all()


def test_black_white_and_grey_are_of_no_colour():
    greys = np.repeat(np.arange(256, dtype=np.uint8), 3).reshape(1, 256, 3)
    hsv = cv2.cvtColor(greys, cv2.COLOR_BGR2HSV)
    for color in (*NAMED_COLORS.values(), Color(0, 0.12, 0.04, 90)):
        assert not hsv_mask(hsv, color).any()


def test_the_scene_is_the_mean_red_green_and_blue():
    image = np.zeros((48, 64, 3), np.uint8)
    image[..., 0], image[..., 1], image[:, 32:, 2] = 10, 20, 60
    assert scene_of(image) == (30, 20, 10)
