"""SVG becomes strokes, against points and lengths worked out by hand or by numpy."""

import gzip
import math

import numpy as np
import pytest

from laptop.drawing import svg, svg_tree
from laptop.drawing.artwork import SMOOTH_TURN, BadArtwork, stroke_length, turns
from laptop.drawing.svg import read_svg

PX = 2.54 / 96
NAMES = (
    'xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink" '
    'xmlns:inkscape="http://www.inkscape.org/namespaces/inkscape"'
)


SHEET = 'width="100mm" height="80mm" viewBox="0 0 100 80"'


def read(body, head=f'{SHEET} overflow="visible"', name="it.svg"):
    """An Artwork of a sheet of 10 x 8 cm whose units are mm; y goes down there."""
    group = '<g stroke="black" fill="none">'
    return read_svg(f"<svg {NAMES} {head}>{group}{body}</g></svg>".encode(), name)


def mm(points):
    """Points in the sheet's mm, y down, as the artwork has them."""
    return np.array(points, float) * [0.1, -0.1] + [0, 8]


def only(body):
    """The one stroke of a drawing."""
    (stroke,) = read(body).strokes
    return stroke


# Shapes and commands


@pytest.mark.parametrize(
    ("body", "points"),
    [
        ('<line x1="1" y1="2" x2="3" y2="4"/>', [(1, 2), (3, 4)]),
        ('<polyline points="1,2 3,4,5-6"/>', [(1, 2), (3, 4), (5, -6)]),
        ('<polygon points="1 2 3 4 5 0"/>', [(1, 2), (3, 4), (5, 0), (1, 2)]),
        ('<rect x="1" y="2" width="3" height="4"/>', [(1, 2), (4, 2), (4, 6), (1, 6), (1, 2)]),
        ('<path d="m1 2l3 4h9v7 1"/>', [(1, 2), (4, 6), (13, 6), (13, 13), (13, 14)]),
        ('<path d="M1 2 3 4 5 5z"/>', [(1, 2), (3, 4), (5, 5), (1, 2)]),
        ('<line x1="10%" y1="50%" x2="1cm" y2="1in"/>', [(10, 40), (96 / 2.54, 96)]),
    ],
)
def test_straight_shapes_keep_each_point(body, points):
    assert only(body) == pytest.approx(mm(points), abs=1e-12)


def test_a_path_of_several_parts_makes_several_strokes():
    artwork = read('<path d="M1 1l2 0zm5 5l1 1M20 20L30 30zL25 28"/>')
    wanted = [
        [(1, 1), (3, 1), (1, 1)], [(6, 6), (7, 7)], [(20, 20), (30, 30), (20, 20)],
        [(20, 20), (25, 28)],
    ]  # fmt: skip
    assert len(artwork.strokes) == 4
    for stroke, points in zip(artwork.strokes, wanted, strict=True):
        assert stroke == pytest.approx(mm(points), abs=1e-12)


def area(points):
    """Of a polygon, by Gauss."""
    x, y = points.T
    return abs(np.dot(x[:-1], y[1:]) - np.dot(y[:-1], x[1:])) / 2


def test_a_circle_is_round_and_closed():
    stroke = only('<circle cx="50" cy="40" r="30"/>')
    assert np.hypot(*(stroke - mm([50, 40])).T) == pytest.approx(3)
    assert stroke[0] == pytest.approx(stroke[-1])
    assert stroke_length(stroke) == pytest.approx(2 * math.pi * 3, rel=1e-3)
    assert area(stroke) == pytest.approx(math.pi * 9, rel=2e-3)


def test_an_ellipse_that_is_turned_has_its_area():
    stroke = only('<ellipse cx="50" cy="40" rx="30" ry="10" transform="rotate(30 50 40)"/>')
    assert area(stroke) == pytest.approx(math.pi * 3 * 1, rel=2e-3)
    c, s = math.cos(math.radians(30)), math.sin(math.radians(30))
    x, y = ((stroke - mm([50, 40])) * [1, -1] @ np.array([[c, -s], [s, c]])).T
    assert x**2 / 9 + y**2 == pytest.approx(np.ones(len(x)))


def test_a_rounded_rectangle_has_round_corners_of_a_circle():
    stroke = only('<rect x="10" y="10" width="40" height="20" rx="5"/>')
    assert stroke_length(stroke) == pytest.approx(2 * 3 + 2 * 1 + 2 * math.pi * 0.5, rel=1e-3)
    assert area(stroke) == pytest.approx(8 - (4 - math.pi) * 0.25, rel=1e-3)


@pytest.mark.parametrize(
    ("flags", "centre", "swept"),
    [("0 1", (20, 30), 90), ("0 0", (30, 20), 90), ("1 1", (30, 20), 270), ("1 0", (20, 30), 270)],
)
def test_the_flags_of_an_arc_choose_one_of_four(flags, centre, swept):
    """From (20, 20) to (30, 30) at radius 10 there are these four, and these two centres."""
    stroke = only(f'<path d="M20 20A10 10 0 {flags} 30 30"/>')
    assert np.hypot(*(stroke - mm(centre)).T) == pytest.approx(1)
    assert stroke_length(stroke) == pytest.approx(math.radians(swept), rel=1e-3)
    assert stroke[[0, -1]] == pytest.approx(mm([(20, 20), (30, 30)]))


def test_an_arc_too_small_for_its_ends_is_enlarged_and_one_without_radius_is_a_line():
    stroke = only('<path d="M20 20A1 1 0 0 1 40 20"/>')
    assert stroke_length(stroke) == pytest.approx(math.pi, rel=1e-3)
    assert only('<path d="M1 1A0 5 0 0 1 9 9"/>') == pytest.approx(mm([(1, 1), (9, 9)]))


def bernstein(control, t):
    """A Bezier curve by its definition."""
    n = len(control) - 1
    weights = [math.comb(n, k) * t**k * (1 - t) ** (n - k) for k in range(n + 1)]
    return np.array(weights).T @ np.array(control, float)


@pytest.mark.parametrize(
    ("data", "curves"),
    [
        ("M10 10C20 10 30 40 50 20", [[(10, 10), (20, 10), (30, 40), (50, 20)]]),
        ("M10 10Q30 60 50 20", [[(10, 10), (30, 60), (50, 20)]]),
        (
            "M10 10q10 20 20 0t20 0",
            [[(10, 10), (20, 30), (30, 10)], [(30, 10), (40, -10), (50, 10)]],
        ),
        (
            "M10 10c0 10 10 10 10 0s10-10 10 0",
            [[(10, 10), (10, 20), (20, 20), (20, 10)], [(20, 10), (20, 0), (30, 0), (30, 10)]],
        ),
    ],
)
def test_bezier_curves_go_where_their_definition_says(data, curves):
    stroke = only(f'<path d="{data}"/>')
    exact = np.vstack([bernstein(curve, np.linspace(0, 1, 4000)) for curve in curves])
    exact = mm(exact)
    near = np.linalg.norm(stroke[:, None] - exact[None], axis=-1).min(axis=1)
    assert near.max() < 2e-3  # each point is on the curve
    control = mm(np.vstack(curves))
    begin, step = stroke[:-1], np.diff(stroke, axis=0)
    along = ((exact[:, None] - begin) * step).sum(-1) / (step**2).sum(-1)
    foot = begin + np.clip(along, 0, 1)[..., None] * step
    off = np.linalg.norm(exact[:, None] - foot, axis=-1).min(axis=1)
    assert off.max() < 1.1 * svg.TOLERANCE * np.ptp(control, axis=0).max()  # and all is drawn
    assert np.degrees(turns(stroke)).max() <= SMOOTH_TURN + 1e-6


def test_a_dot_becomes_a_dash_and_a_line_without_length_is_named():
    artwork = read('<path d="M10 10h0" stroke-linecap="round"/><path d="M20 10z"/>')
    (dash,) = artwork.strokes
    assert stroke_length(dash) == pytest.approx(0.02)
    assert dash.mean(axis=0) == pytest.approx(mm([10, 10]))
    assert artwork.left_out == ("A line without length is not drawn.",)


# Where it is


def matrix(a, b, c, d, e, f):
    return np.array([[a, c, e], [b, d, f], [0, 0, 1.0]])


def turn(degrees):
    c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    return matrix(c, s, -s, c, 0, 0)


def shift(x, y):
    return matrix(1, 0, 0, 1, x, y)


@pytest.mark.parametrize(
    ("text", "wanted"),
    [
        ("translate(3,4)", shift(3, 4)),
        ("translate(3)", shift(3, 0)),
        ("scale(2 3)", matrix(2, 0, 0, 3, 0, 0)),
        ("scale(2)", matrix(2, 0, 0, 2, 0, 0)),
        ("rotate(30)", turn(30)),
        ("rotate(30, 5, 6)", shift(5, 6) @ turn(30) @ shift(-5, -6)),
        ("skewX(20)", matrix(1, 0, math.tan(math.radians(20)), 1, 0, 0)),
        ("skewY(20)", matrix(1, math.tan(math.radians(20)), 0, 1, 0, 0)),
        ("matrix(1 2 3 4 5 6)", matrix(1, 2, 3, 4, 5, 6)),
        ("translate(1,2)rotate(40),scale(-2,1)", shift(1, 2) @ turn(40) @ np.diag([-2, 1, 1])),
    ],
)
def test_transforms_are_those_of_numpy(text, wanted):
    points = np.array([[1, 2, 1], [30, 5, 1], [7, 40, 1]], float)
    body = f'<polyline transform="{text}" points="1 2 30 5 7 40"/>'
    assert only(body) == pytest.approx(mm((points @ wanted.T)[:, :2]), abs=1e-9)
    inside = f'<g transform="translate(2 3)"><g transform="{text}">{body}</g></g>'
    nested = shift(2, 3) @ wanted @ wanted
    assert only(inside) == pytest.approx(mm((points @ nested.T)[:, :2]), abs=1e-9)


@pytest.mark.parametrize(
    ("head", "size", "point"),
    [
        ('width="21cm" height="297mm"', (21, 29.7), (10 * PX, 29.7 - 20 * PX)),
        ('width="96" height="1in"', (2.54, 2.54), (10 * PX, 2.54 - 20 * PX)),
        ('width="72pt" height="6pc"', (2.54, 2.54), (10 * PX, 2.54 - 20 * PX)),
        ('viewBox="0 0 96 48"', (2.54, 1.27), (10 * PX, 1.27 - 20 * PX)),
        ('width="10cm" viewBox="0 0 100 50"', (10, 5), (1, 3)),
        ('height="10cm" width="100%" viewBox="0 0 50 100"', (5, 10), (1, 8)),
        ('width="10cm" height="10cm" viewBox="-10 -20 100 100"', (10, 10), (2, 6)),
        ('width="20cm" height="10cm" viewBox="0 0 100 100"', (20, 10), (6, 8)),
        (
            'width="20cm" height="10cm" viewBox="0 0 100 100" preserveAspectRatio="none"',
            (20, 10), (2, 8),
        ),
        (
            'width="20cm" height="10cm" viewBox="0 0 100 100" preserveAspectRatio="xMaxYMin meet"',
            (20, 10), (11, 8),
        ),
        (
            'width="20cm" height="10cm" viewBox="0 0 100 100" preserveAspectRatio="xMinYMax slice"',
            (20, 10), (2, 16),
        ),
    ],
)  # fmt: skip
def test_units_and_view_boxes_place_a_point(head, size, point):
    artwork = read('<path d="M10 20h1"/>', f'{head} overflow="visible"')
    assert artwork.size == pytest.approx(size)
    assert artwork.strokes[0][0] == pytest.approx(point)


def test_without_any_size_the_drawing_stands_on_its_lowest_point():
    artwork = read('<path d="M10 20V120"/>', "")
    assert artwork.size is None
    assert artwork.strokes[0] == pytest.approx(np.array([[10 * PX, 100 * PX], [10 * PX, 0]]))


def test_what_is_used_stands_where_it_is_used():
    artwork = read(
        '<defs><path id="p" d="M1 2h3"/><symbol id="s" viewBox="0 0 10 10"><path d="M5 5h5"/>'
        '</symbol></defs><use href="#p" x="10" y="20" transform="scale(2)"/>'
        '<use xlink:href="#s" x="50" y="10" width="20" height="20"/>'
        '<svg x="10" y="30" width="40" height="40" viewBox="0 0 10 10"><path d="M1 1h1"/></svg>'
    )
    wanted = [[(22, 44), (28, 44)], [(60, 20), (70, 20)], [(14, 34), (18, 34)]]
    for stroke, points in zip(artwork.strokes, wanted, strict=True):
        assert stroke == pytest.approx(mm(points))


# What is drawn, and what is named


def test_layers_are_named_and_hidden_ones_left_out():
    artwork = read(
        '<g inkscape:groupmode="layer" inkscape:label="ink"><path d="M1 1h1"/>'
        '<g inkscape:groupmode="layer" id="layer2"><path d="M1 1h1"/></g><g><path d="M1 1h1"/></g>'
        '</g><g inkscape:groupmode="layer" inkscape:label="notes" style="display:none">'
        '<path d="M1 1h1"/></g><path d="M1 1h1"/>'
    )
    assert artwork.layers == ("ink", "layer2", "ink", "")
    assert artwork.left_out == ('The layer "notes" is hidden: show it in the editor to draw it.',)


@pytest.mark.parametrize(
    ("body", "told"),
    [
        (
            '<text font-family="Nowhere">Hello <tspan>you</tspan></text>',
            'The text "Hello you" is in a font that is not on this computer: make it a path first '
            "(Inkscape: Path > Object to Path).",
        ),
        ('<image href="a.png"/>',
         "A picture is not drawn (\"a.png\"): draw the picture's own file."),
        ('<image href="data:image/png;base64,AAAA"/>',
         "A picture is not drawn: draw the picture's own file."),
        ('<rect width="9" height="9" fill="red" stroke="none"/>',
         "An area is drawn by its outline, not hatched."),
        ('<rect width="100" height="80" fill="#fff" stroke="none"/>',
         "A white shape is as the paper, and not drawn (<rect>)."),
        ('<path d="M1 1h9" stroke="white"/>',
         "A white shape is as the paper, and not drawn (<path>)."),
        ('<path d="M1 1h1" stroke="none"/>',
         "A shape has neither line nor fill (<path>), and is not drawn."),
        ('<path d="M1 1h1" visibility="hidden"/>', "An element is hidden (<path>)."),
        ('<g display="none"><path d="M1 1h1"/></g>', "An element is hidden (<g>)."),
        ('<path d="M1 1h1" stroke-dasharray="1 2"/>', "A dashed line is drawn through."),
        ('<path d="M1 1h1" marker-end="url(#a)"/>',
         "An arrow head or other marker on a line is not drawn."),
        ('<use href="#nowhere"/>', 'A reference leads nowhere ("#nowhere").'),
        ('<path d="L1 1"/>', 'A path is broken, and drawn up to there ("L1 1").'),
        ('<rect width="9" height="?"/>', 'A value that cannot be read is passed over ("?").'),
        ("<style>g >> path {stroke: red}</style>",
         'A style rule is not understood, and not followed ("g >> path").'),
        ('<path d="M1 1h1" style="clip-path: circle(9px)"/>',
         'A clip by CSS does not cut ("circle(9px)").'),
        ('<text><textPath href="#a">round</textPath></text>',
         'A text along a line is not drawn ("round"): make it a path first '
         "(Inkscape: Path > Object to Path)."),
    ],
)  # fmt: skip
def test_what_is_left_out_is_named(body, told):
    assert read('<path d="M0 0h1"/>' + body).left_out == (told,)


@pytest.mark.parametrize(
    "body",
    [
        '<mask id="m"><path d="M1 1h1"/></mask>',
        '<marker id="m"><path d="M1 1h1"/></marker>',
        '<symbol id="m"><path d="M1 1h1"/></symbol>',
        '<clipPath id="m"><path d="M1 1h1"/></clipPath>',
        '<pattern id="m"><path d="M1 1h1"/></pattern>',
        "<metadata><path/></metadata><title>a</title><desc>b</desc>",
        '<path xmlns="http://example.org/other" d="M1 1h1"/>',
        '<rect width="0" height="5"/><circle r="0"/><ellipse rx="0" ry="3"/>',
        '<path d="M1 1h1" transform="scale(1, 0)"/>',
        '<svg width="0" height="9"><path d="M1 1h1"/></svg>',
        '<path d="M1 1h1" requiredExtensions="a"/><path d="M1 1h1" systemLanguage="de"/>',
    ],
)
def test_what_shows_nothing_by_itself_is_not_drawn(body):
    artwork = read('<path d="M0 0h1"/>' + body)
    assert (len(artwork.strokes), artwork.left_out) == (1, ())


@pytest.mark.parametrize(
    ("rules", "attributes", "is_drawn"),
    [
        (".a{display:none}", 'class="b a"', False),
        ("path{display:none}", 'style="display:inline"', True),
        ("path{display:inline}", 'display="none"', True),  # a rule over an attribute
        ("@media print{path{display:none}}", "", True),
        ("@media screen{path{display:none}}", "", False),
        ("path{stroke:bogus}", 'stroke="none"', False),
        ("*{stroke:none}", "", False),
    ],
)
def test_style_sheets_hide_and_colour_what_is_drawn(rules, attributes, is_drawn):
    artwork = read(f'<style>{rules}</style><path {attributes} d="M1 1h1"/><path style="stroke:red;'
                   'display:inline" d="M5 5h1"/>')  # fmt: skip
    assert len(artwork.strokes) == 1 + is_drawn


@pytest.mark.parametrize(
    "fault", ["l 3 nan 9 9", "H", "H nan", "l3", "h", "C1 1 2 2", "X 3 4", "a1 1 0 0 1 5", "t nan"]
)
def test_a_broken_path_is_drawn_up_to_its_fault(fault):
    artwork = read(f'<path d="M1 1h5v5 {fault}"/><path d="{fault}"/>')
    (stroke,) = artwork.strokes  # of a path that does not begin with a move there is none
    assert stroke == pytest.approx(mm([(1, 1), (6, 1), (6, 6)]))
    told = "2 paths are broken, and drawn up to there"
    assert artwork.left_out == (f'{told} ("M1 1h5v5 {fault}", "{fault}").',)


@pytest.mark.parametrize(
    "text", ["rotate(30!)", "scale()", "turn(3)", "rotate(1 2)", "translate(1 2) x", "scale(1e999)"]
)
def test_a_transform_that_says_nothing_is_as_if_it_were_not_said(text):
    artwork = read(f'<path d="M1 1h1" transform="{text}"/>')
    assert artwork.strokes[0] == pytest.approx(mm([(1, 1), (2, 1)]))
    assert artwork.left_out == (f'A value that cannot be read is passed over ("{text}").',)


def test_points_are_counted_as_they_stand_there_and_as_they_are_drawn(monkeypatch):
    for module in (svg, svg_tree):
        monkeypatch.setattr(module, "MAX_POINTS", 500)
    assert read('<circle r="5"/>' * 3).points() > 250
    with pytest.raises(BadArtwork, match="has more than 500 points"):
        read('<circle r="5"/>' * 10)
    with pytest.raises(BadArtwork, match="has more than 500 points"):
        read('<path d="M1 1h0"/>' + '<polyline points="1 1 2 2 3 3"/>' * 200)


def test_several_of_a_kind_are_counted_and_some_named():
    body = "".join(f'<text font-family="Nowhere">text {k}</text>' for k in range(5))
    (told,) = read('<path d="M0 0h1"/>' + body).left_out
    wanted = (
        '5 texts are in fonts that are not on this computer ("text 0", "text 1", "text 2", ...)'
    )
    assert told.startswith(wanted)


def test_a_packed_drawing_is_that_drawing():
    data = f'<svg {NAMES} viewBox="0 0 9 9"><path stroke="red" d="M1 2L3 4"/></svg>'.encode()
    plain, packed = read_svg(data, "a"), read_svg(gzip.compress(data), "a")
    assert packed.strokes[0].tolist() == plain.strokes[0].tolist()
    assert packed.size == plain.size


def test_a_drawing_without_its_namespace_is_read_too():
    (stroke,) = read_svg(
        b'<svg width="9cm" height="9cm"><path stroke="red" d="M0 0h96"/></svg>'
    ).strokes
    assert stroke == pytest.approx(np.array([[0, 9], [2.54, 9]]))


def test_what_is_drawn_has_no_point_twice_in_a_row():
    artwork = read('<path d="M1 1h0h5h0v5h0z"/><polyline points="1 1 1 1 2 2"/>')
    for stroke in artwork.strokes:
        assert stroke.dtype == np.float64
        assert (np.hypot(*np.diff(stroke, axis=0).T) > 0).all()


def test_nothing_to_draw_is_said_with_its_reason():
    with pytest.raises(BadArtwork, match='^a.svg: nothing in it is drawn: The text "Hi" is in a'):
        read_svg(f'<svg {NAMES}><text font-family="Nowhere">Hi</text></svg>'.encode(), "a.svg")


def test_attributes_that_a_head_gives_to_every_element_are_short():
    """One of a megabyte would be one of each of twenty thousand paths."""
    drawing = f'<svg {NAMES}><path d="M0 0h1"/></svg>'
    head = '<!DOCTYPE svg [<!ATTLIST path stroke CDATA "red" id CDATA "{}">]>'
    assert len(read_svg((head.format("i") + drawing).encode()).strokes) == 1
    with pytest.raises(BadArtwork, match=r"declares more than 500 letters .* \(id of <path>\)"):
        read_svg((head.format("i" * 501) + drawing).encode())


# Areas, hatched


AREAS = '<g stroke="none">{}</g>'


def hatched(body):
    """Lines of hatching of areas, mm, y downwards, and what is said."""
    data = f"<svg {NAMES} {SHEET}>{AREAS.format(body)}</svg>".encode()
    plain, filled = read_svg(data), read_svg(data, is_hatched=True)
    count = len(plain.strokes)
    for stroke, same in zip(filled.strokes, plain.strokes, strict=False):
        assert stroke == pytest.approx(same)
    return [(stroke - [0, 8]) * [10, -10] for stroke in filled.strokes[count:]], filled.left_out


def test_an_area_is_hatched_by_lines_inside_it_as_far_apart_as_it_is_light():
    """By distances of parallel lines, of which 90 of what is black lie across the greater side."""
    length = {}
    for fill in ("black", "#808080"):
        lines, told = hatched(f'<rect x="10" y="10" width="60" height="40" fill="{fill}"/>')
        assert told == ()
        for begin, end in lines:
            assert abs(end - begin) == pytest.approx(np.full(2, abs(end - begin)[0]))  # 45 degrees
            assert (begin - end).prod() < 0  # up to the right
        points = np.concatenate(lines)
        assert points.min(axis=0) == pytest.approx([10, 10], abs=1.5)
        assert points.max(axis=0) == pytest.approx([70, 50], abs=1.5)
        length[fill] = sum(np.hypot(*(end - begin)) for begin, end in lines)
    assert length["black"] == pytest.approx(60 * 40 / (60 / 90), rel=0.02)
    assert length["#808080"] / length["black"] == pytest.approx(127 / 255, rel=0.03)


def test_what_lies_above_hides_the_hatching_below():
    below = '<rect x="10" y="10" width="60" height="40" fill="black"/>'
    whole, _ = hatched(below)
    for fill, share in (("white", 0.75), ("none", 1.0), ("rgba(255,255,255,.5)", 1.0)):
        lines, _ = hatched(f'{below}<rect x="10" y="10" width="30" height="20" fill="{fill}"/>')
        length = sum(np.hypot(*(end - begin)) for begin, end in lines)
        assert length == pytest.approx(
            share * sum(np.hypot(*(end - begin)) for begin, end in whole), rel=0.03
        )


def test_hatching_ends_where_a_clip_or_a_hole_does():
    clip = '<clipPath id="c"><rect x="10" y="10" width="20" height="70"/></clipPath>'
    lines, _ = hatched(f'{clip}<rect width="90" height="70" fill="red" clip-path="url(#c)"/>')
    points = np.concatenate(lines)
    assert ((points > 9.99) & (points < [30.01, 70.01])).all()
    lines, _ = hatched('<path fill-rule="evenodd" d="M10 10h60v60h-60zM20 20h40v40h-40z"/>')
    middles = np.array([line.mean(axis=0) for line in lines])
    assert not ((middles > 21) & (middles < 59)).all(axis=1).any()
