"""What clips, masks and nested viewports leave of lines, against points worked out by hand."""

import numpy as np
import pytest

from laptop.drawing.svg import read_svg

NAMES = 'xmlns="http://www.w3.org/2000/svg" width="100mm" height="80mm" viewBox="0 0 100 80"'
CUT = "A shape behind a mask"


def read(body):
    """An Artwork of a sheet of 100 x 80 mm, and its strokes in mm, y downwards."""
    group = f'<g stroke="black" fill="none">{body}</g>'
    artwork = read_svg(f"<svg {NAMES}>{group}</svg>".encode())
    return artwork, [(stroke - [0, 8]) * [10, -10] for stroke in artwork.strokes]


def lines(body):
    """Begin and end of each stroke of it, mm."""
    _, strokes = read('<path d="M90 70h1"/>' + body)
    return [[tuple(np.round(point, 3)) for point in stroke[[0, -1]]] for stroke in strokes[1:]]


RECT = '<rect x="10" y="10" width="50" height="50"/>'
LINE = "M0 20H90"
CASES = {
    "a rectangle": (RECT, "", [[(10, 20), (60, 20)]]),
    "a path": ('<path d="M10 10H60V60H10z"/>', "", [[(10, 20), (60, 20)]]),
    "a polygon": ('<polygon points="10,0 70,60 10,60"/>', "", [[(10, 20), (30, 20)]]),
    "a circle": ('<circle cx="40" cy="20" r="10"/>', "", [[(30, 20), (50, 20)]]),
    "two": (RECT + '<rect x="70" width="9" height="80"/>', "",
            [[(10, 20), (60, 20)], [(70, 20), (79, 20)]]),
    "a hole": ('<path clip-rule="evenodd" d="M10 10H60V60H10zM20 15H30V50H20z"/>', "",
               [[(10, 20), (20, 20)], [(30, 20), (60, 20)]]),
    "no hole": ('<path d="M10 10H60V60H10zM20 15H30V50H20z"/>', "", [[(10, 20), (60, 20)]]),
    "one that is moved": (RECT, 'transform="translate(5)"', [[(15, 20), (65, 20)]]),
    "one in a clip": (RECT, 'clip-path="url(#d)"', [[(10, 20), (40, 20)]]),
    "one of its own": ('<rect width="90" height="80" clip-path="url(#d)"/>', "",
                       [[(0, 20), (40, 20)]]),
    "one in parts of it": ('<rect x=".5" width=".2" height="1" y="-.5"/>',
                           'clipPathUnits="objectBoundingBox"', []),
    "what is used": ('<use href="#r"/>', "", [[(0, 20), (33, 20)]]),
    "hidden": (RECT + '<rect width="90" height="90" display="none"/>', "", [[(10, 20), (60, 20)]]),
    "nothing": ("", "", []),
}  # fmt: skip


@pytest.mark.parametrize("case", CASES)
def test_a_line_is_cut_where_a_clip_ends(case):
    shapes, attributes, wanted = CASES[case]
    defs = (
        f'<clipPath id="c" {attributes}>{shapes}</clipPath><rect id="r" width="33" height="80"/>'
        '<clipPath id="d"><rect width="40" height="80"/></clipPath>'
    )
    for dress in ('clip-path="url(#c)"', "style=\"clip-path: url('#c')\""):
        found = lines(f'<defs>{defs}</defs><path {dress} d="{LINE}"/>')
        assert np.array(found) == pytest.approx(np.array(wanted), abs=0.01)
    group = f'<defs>{defs}</defs><g clip-path="url(#c)"><path d="{LINE}"/></g>'
    assert lines(group) == found


def test_parts_of_a_box_are_those_of_the_shape_that_is_clipped():
    half = '<rect width=".5" height=".5"/>'
    clip = f'<clipPath id="c" clipPathUnits="objectBoundingBox">{half}</clipPath>'
    body = f'{clip}<rect clip-path="url(#c)" x="20" y="20" width="20" height="20"/>'
    _, (_, part) = read('<path d="M90 70h1"/>' + body)
    assert part == pytest.approx(np.array([[20, 30], [20, 20], [30, 20]]), abs=1e-3)


def test_a_clip_that_is_not_there_does_not_cut():
    assert lines(f'<path clip-path="url(#none)" d="{LINE}"/>') == [[(0, 20), (90, 20)]]
    body = f'<linearGradient id="g"/><path clip-path="url(#g)" d="{LINE}"/>'
    assert lines(body) == [[(0, 20), (90, 20)]]


@pytest.mark.parametrize(
    ("inner", "wanted"),
    [
        ('<rect x="10" width="50" height="80" fill="white"/>', [[(10, 20), (60, 20)]]),
        ('<rect width="90" height="80" fill="#fff"/><rect x="30" width="10" height="80"/>',
         [[(0, 20), (30, 20)], [(40, 20), (90, 20)]]),
        ('<rect width="90" height="80" fill="none"/>', []),
    ],
)  # fmt: skip
def test_a_mask_of_white_and_black_is_an_area(inner, wanted):
    mask = f'<mask id="m"><g stroke="none" fill="black">{inner}</g></mask>'
    assert lines(f'{mask}<path mask="url(#m)" d="{LINE}"/>') == wanted


@pytest.mark.parametrize("fill", ["gray", "url(#g)", "rgba(255,255,255,.5)"])
def test_what_shows_through_in_part_is_named(fill):
    gradient = '<linearGradient id="g"><stop/><stop stop-color="white"/></linearGradient>'
    mask = f'{gradient}<mask id="m"><rect width="90" height="80" fill="{fill}"/></mask>'
    artwork, strokes = read(f'<path d="M90 70h1"/>{mask}<path mask="url(#m)" d="{LINE}"/>')
    assert len(strokes) == 1
    assert artwork.left_out[0].startswith(CUT)


def test_a_clip_that_leads_back_to_itself_ends():
    clips = '<clipPath id="c" clip-path="url(#d)"><rect width="9" height="9"/></clipPath>'
    clips += '<clipPath id="d" clip-path="url(#c)"><rect width="9" height="9"/></clipPath>'
    artwork, strokes = read(f'<path d="M90 70h1"/>{clips}<path clip-path="url(#c)" d="{LINE}"/>')
    assert len(strokes) == 1
    assert artwork.left_out[0].startswith(CUT)


def test_a_nested_viewport_and_the_sheet_cut_what_is_beyond_unless_they_are_told_not_to():
    inner = '<svg x="10" y="10" width="30" height="40" {}><path d="M0 10H90"/></svg>'
    assert lines(inner.format("")) == [[(10, 20), (40, 20)]]
    assert lines(inner.format('overflow="visible"')) == [[(10, 20), (100, 20)]]
    assert lines('<path d="M50 20H150"/>') == [[(50, 20), (100, 20)]]
    data = f'<svg {NAMES} overflow="visible"><path stroke="red" d="M50 20H150"/></svg>'
    assert read_svg(data.encode()).strokes[0][-1] == pytest.approx([15, 6])


def test_a_clipped_area_is_drawn_around_what_is_seen_of_it():
    clip = '<clipPath id="c"><rect width="30" height="80"/></clipPath>'
    area = '<rect x="20" y="20" width="40" height="20" fill="red" stroke="none" {}/>'
    _, (ring,) = read(clip + area.format('clip-path="url(#c)"'))
    assert {tuple(p) for p in np.round(ring, 3)} == {(20, 20), (30, 20), (30, 40), (20, 40)}
    _, (ring,) = read(area.format('clip-path="url(#none)"'))
    assert ring[0] == pytest.approx([20, 20])
    assert len(ring) == 5


def test_contours_that_no_edge_of_an_area_shows_are_not_drawn():
    both = "M10 10H60V60H10zM20 20H30V30H20z"
    fills = '<path fill="red" stroke="none" {} d="{}"/>'
    assert len(read(fills.format("", both))[1]) == 1
    assert len(read(fills.format('fill-rule="evenodd"', both))[1]) == 2
    assert len(read(fills.format("", both.replace("H30V30H20z", "V30H30V20z")))[1]) == 2
