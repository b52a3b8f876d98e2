"""What is said of where a drawing is shown claims no more than is known."""

import pytest

from laptop.page.drawing_snapshots import DrawingState
from laptop.page.marker_height import MarkerHeight
from laptop.page.paper_text import needs_look, where_text

MOVES = {"misfit": 1.94, "source": "the tip's own moves"}
TYPED = MarkerHeight(2.5, "as typed here")
FOUND = MarkerHeight(2.4, "found by the board and the tip's moves", 0.23)


@pytest.mark.parametrize(
    ("state", "reported", "look"),
    [
        (DrawingState(), "", False),
        (
            DrawingState(unmapped={"A": "the arm has not moved"}),
            "Where the table is in the picture is not known: the arm has not moved. Then",
            True,
        ),
        (
            DrawingState(**MOVES, asks_height=True),
            "The drawing is shown where the arm's marker moves, above the paper. Where that "
            "is in the picture is known by the tip's own moves, to 1.9 mm. So ink is seen beside "
            "it. Measure from the paper up to the marker, and type it here.",
            False,
        ),
        (DrawingState(**MOVES, asks_height=True, marker=TYPED), "seen beside it. Look", True),
        (
            DrawingState(**MOVES, asks_height=True, marker=TYPED, is_on_paper=True),
            "The drawing is shown on the paper. Where that is in the picture is known by the "
            "tip's own moves, to 1.9 mm. The arm's marker is 25 mm above it, as typed here.",
            False,
        ),
        (
            DrawingState(**MOVES, asks_height=True, marker=FOUND, is_on_paper=True),
            "24 \u00b1 2 mm above it, found by the board and the tip's moves.",
            False,
        ),
        (
            DrawingState(**MOVES, is_on_paper=True),
            "known by the tip's own moves, to 1.9 mm.",
            False,
        ),
    ],
)
def test_it_says_at_which_height_and_how_well_that_is_known(state, reported, look):
    text = where_text(state, False)
    assert reported in text
    assert (text == "") == (reported == "")
    assert needs_look(state) == look
    assert all(len(sentence.split()) <= 25 for sentence in text.split(". "))


def test_of_several_cameras_it_says_which():
    assert "camera B's picture" in where_text(DrawingState(unmapped={"B": "so"}), True)
