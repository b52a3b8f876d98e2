"""Where a drawing comes to lie, checked by the brick's own kinematics."""

import numpy as np
import pytest

from laptop.drawing import placing, reach
from laptop.drawing.artwork import Artwork, BadArtwork
from laptop.drawing.options import DrawingOptions
from laptop.drawing.placing import BadPlace
from robot.motion import kinematics, trajectory
from shared.arm_description import ArmError, find_arm, read_arm

ARMS = {name: read_arm(find_arm(name)) for name in ("planar", "spatial")}


def rings(count=3, radius=5.0, flat=0.7):
    t = np.linspace(0, 2 * np.pi, 60)
    strokes = [
        np.column_stack([np.cos(t) * r, flat * np.sin(t) * r])
        for r in np.linspace(radius / count, radius, count)
    ]
    return Artwork("rings", tuple(strokes), ("",) * count)


def arrow():
    """Points up: a shaft from below, and a flag to the right."""
    strokes = (np.array([(0.0, 0.0), (0.0, 4.0)]), np.array([(0.0, 4.0), (1.0, 4.0)]))
    return Artwork("arrow", strokes, ("", ""))


def place(artwork, arm="planar", **options):
    chosen = DrawingOptions(**options)
    return placing.place(
        artwork, ARMS[arm], chosen.placement_request(ARMS[arm]), chosen.postures(ARMS[arm])
    )


def can_follow(arm, stroke, height=0.0):
    dense = reach.on_table(arm, reach.densified([stroke])[0], height).tolist()
    for posture in reach.POSTURES:
        try:
            trajectory.joint_path(arm, dense, posture)
            return True
        except kinematics.Unreachable:
            pass
    return False


@pytest.mark.parametrize("arm", ARMS)
def test_as_large_as_the_arm_reaches_and_no_larger(arm):
    placed = place(rings(), arm)
    assert all(can_follow(ARMS[arm], stroke) for stroke in placed.strokes)
    # Nowhere near by does an eighth more fit.
    centre = np.array(placed.centre)
    table = reach.reach_map(
        ARMS[arm], 0.0, reach.POSTURES, reach.EASY_MARGIN, reach.EASY_SINGULARITY
    )
    for dx in np.arange(-2, 2.1, 0.5):
        for dy in np.arange(-2, 2.1, 0.5):
            outer = 1.125 * (placed.strokes[-1] - centre) + centre + (dx, dy)
            assert (np.bitwise_and.reduce(table.at(outer)) == 0).any()


def test_what_was_tried_by_too_few_points_is_made_smaller(monkeypatch):
    for name in ("COARSE_CELLS", "FINE_CELLS"):
        monkeypatch.setattr(placing, name, 6)
    monkeypatch.setattr(placing, "OUTLINE_POINTS", 6)
    monkeypatch.setattr(reach, "EASY_MARGIN", 0.0)
    monkeypatch.setattr(reach, "EASY_SINGULARITY", 0.0)
    placed = place(rings())
    assert all(can_follow(ARMS["planar"], stroke) for stroke in placed.strokes)


def test_who_sits_behind_the_arm_sees_it_upright():
    shaft, flag = place(arrow(), at=(12, 0), size=(1, None)).strokes
    assert shaft[1, 0] - shaft[0, 0] == pytest.approx(4)  # up is away from the base
    assert shaft[1, 1] == pytest.approx(shaft[0, 1])
    assert flag[1, 1] - flag[0, 1] == pytest.approx(-1)  # to the right is -y
    assert np.mean([shaft[0, 0], shaft[1, 0]]) == pytest.approx(12)


def test_a_turn_is_counter_clockwise_from_above():
    shaft, _ = place(arrow(), at=(12, 0), size=(1, None), rotate=90).strokes
    assert shaft[1] - shaft[0] == pytest.approx((0, 4))


def test_in_space_the_height_counts():
    low, high = (place(rings(), "spatial", height=h).size for h in (0.0, 8.0))
    assert high[0] > low[0] + 1
    with pytest.raises(BadArtwork, match="60 cm above the table"):
        place(rings(), "spatial", height=60.0)


def test_an_elbow_that_reaches_nothing_is_named():
    with pytest.raises(BadArtwork, match="its elbow down"):
        place(rings(), "spatial", elbow="down")


def test_a_height_is_refused_where_there_is_none():
    with pytest.raises(BadArtwork, match="draws on the table only"):
        place(rings(), "planar", height=3.0)


def test_a_drawing_made_for_the_sheet_keeps_its_size_and_place_on_it():
    corner = np.array([(1.0, 1.0), (3.0, 1.0), (3.0, 2.0)])
    artwork = Artwork("corner", (corner,), ("",), (10.5, 14.8))
    placed = place(artwork, paper="a6", at=(13, 0))
    assert placed.scale == 1
    low = placed.paper.min(axis=0)
    assert (placed.paper.max(axis=0) - low).tolist() == pytest.approx([14.8, 10.5])
    # From the sheet's lower left corner, as its viewer has it: up is x, to the right -y.
    assert placed.strokes[0][0] == pytest.approx((low[0] + 1, placed.paper[:, 1].max() - 1))


def test_on_another_sheet_it_is_as_large_as_margins_allow():
    placed = place(rings(), paper="a6-landscape")
    assert placed.size[1] == pytest.approx(10.5 - 2)  # 0.7 as high as wide: its height decides
    assert placed.size[0] < 14.8 - 2
    assert placed.paper is not None
    assert min(np.hypot(*placed.paper.T)) > placing.STAND_RADIUS


def test_a_sheet_that_is_too_large_is_drawn_on_as_far_as_the_arm_reaches():
    placed = place(rings(), "spatial", paper="a4")
    assert placed.size[0] < 14
    assert any("reaches no more" in note for note in placed.notes)


def test_a_size_that_is_too_large_names_the_largest():
    with pytest.raises(placing.BadPlace, match="at most .* give --size") as caught:
        place(rings(), size=(30, None))
    width, height = map(float, str(caught.value).split("give --size ")[1].split(",")[0].split("x"))
    assert place(rings(), size=(width, height)).size[0] == pytest.approx(width, abs=0.1)


def test_a_place_out_of_reach_is_refused():
    with pytest.raises(placing.BadPlace, match="around"):
        place(rings(), at=(40, 0))


@pytest.mark.parametrize("artwork", [
    Artwork("none", (), ()),
    Artwork("dot", (np.zeros((2, 2)),), ("",)),
])  # fmt: skip
def test_nothing_is_not_placed(artwork):
    with pytest.raises(BadArtwork):
        place(artwork)


def test_a_straight_line_can_be_placed_by_its_other_side():
    upright = Artwork("line", (np.array([(0.0, 0.0), (0.0, 5.0)]),), ("",))
    assert place(upright).size[1] > 10
    with pytest.raises(placing.BadPlace, match="no width"):
        place(upright, size=(5, None))
    assert place(upright, size=(5, 6)).size == pytest.approx((0, 6))


@pytest.mark.parametrize(
    ("text", "size"), [("a5", (14.8, 21)), ("A5-landscape", (21, 14.8)), ("10x12.5", (10, 12.5))]
)
def test_sheets_are_known_by_name_or_size(text, size):
    assert placing.paper_size(text) == size


@pytest.mark.parametrize("text", ["a9", "10", "x", "0x5", "1e9x3", "500x500", "-3x4", "a5-up"])
def test_other_sheets_are_refused_in_one_line(text):
    with pytest.raises(placing.BadPlace) as caught:
        placing.paper_size(text)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("wrong", [
    {"paper": "b5"}, {"at": (float("nan"), 0)}, {"at": (500, 0)}, {"size": (0, None)},
    {"size": (-3, 4)}, {"rotate": float("inf")}, {"height": float("nan")}, {"speed": 0},
    {"speed": 1000}, {"tolerance": -1}, {"tolerance": 5}, {"elbow": "left"},
])  # fmt: skip
def test_wrong_options_are_refused_at_once(wrong):
    with pytest.raises(ArmError) as caught:
        DrawingOptions(**wrong)
    assert "\n" not in str(caught.value)


def test_it_lies_straight_ahead_where_that_costs_little():
    for arm in ARMS:
        x, y = place(rings(flat=1.0), arm).centre
        assert x > 8
        assert abs(y) <= 1


def test_a_dot_has_its_own_size_whatever_that_of_the_drawing():
    dot = np.array([[1.99, 3.0], [2.01, 3.0]])
    drawing = Artwork("dotted", (*arrow().strokes, dot), ("",) * 3)
    for size in (2.0, 10.0):
        placed = place(drawing, size=(size / 4, size), at=(12, 0))
        begin, end = placed.strokes[-1]
        assert np.hypot(*(end - begin)) == pytest.approx(0.02)
        shaft = placed.strokes[0]
        off = (begin + end) / 2 - shaft[0]  # up the sheet is x, to its right -y
        assert off == pytest.approx(placed.scale * np.array([3.0, -2.0]))


def test_what_does_not_fit_on_its_sheet_is_refused_with_both_sizes():
    why = r"10\.0 x 40\.0 cm do not fit on a sheet of 10\.5 x 14\.8 cm; make it smaller, or give"
    with pytest.raises(BadPlace, match=why):
        place(arrow(), paper="a6", size=(10, 40))
    assert place(arrow(), paper="a6", size=(2, 8)).size == pytest.approx((2, 8))


def test_a_drawing_may_keep_its_own_size():
    placed = place(arrow(), at=(12, 0), scale=1.0)
    assert (placed.scale, placed.size) == (1.0, (1.0, 4.0))
    sheet = place(arrow(), paper="a6", scale=1.0)
    assert sheet.paper.mean(axis=0) == pytest.approx(sheet.centre)
