"""The ink against the wanted paths: oracles by hand."""

import math
from collections import namedtuple

import numpy as np
import pytest

from laptop.record.figures import line_accuracy
from laptop.record.figures.line_accuracy import (
    BadWantedPath,
    has_content,
    measure,
    pen_down_runs,
    write_trace,
)

Row = namedtuple("Row", "t q x y pen z", defaults=[None])

LINE = [(0.0, 0.0), (10.0, 0.0)]
CIRCLE = [(5 + 4 * math.cos(k / 100), 4 * math.sin(k / 100)) for k in range(629)]


def record(*strokes, period=0.01):
    """Rows that draw each stroke (a list of points), the pen up for 0.5 s before each."""
    rows, t = [], 0.0
    for stroke in strokes:
        for pen, points in ((0, [stroke[0]] * 50), (1, stroke)):
            for x, y, *z in points:
                rows.append(Row(t, (0.25, -0.5), x, y, pen, *z))
                t += period
    return rows


def along(a, b, n=101):
    """`n` points from a to b."""
    return [tuple(point) for point in np.linspace(a, b, n)]


def the_measure(ink, path):
    (m,) = measure(record(ink), [path])
    return m


def test_an_offset_line_deviates_by_its_offset():
    m = the_measure(along((0, 0.15), (10, 0.15)), LINE)
    for value in (m.greatest_mm, m.rms_mm, m.start_mm, m.end_mm, m.missed_mm):
        assert value == pytest.approx(1.5)
    assert m.length_cm == pytest.approx(10)
    assert m.ink_cm == pytest.approx(10)
    assert m.seconds == pytest.approx(1.0)
    assert m.floor_mm is None


@pytest.mark.parametrize(("y", "sign"), [(0.15, 1), (-0.15, -1)], ids=["left", "right"])
def test_the_profile_is_positive_on_the_left(y, sign):
    place, deviation = the_measure(along((0, y), (10, y)), LINE).lateral.T
    assert deviation == pytest.approx(sign * 1.5)
    assert (place[0], place[-1]) == pytest.approx((0, 10))
    assert (np.diff(place) > 0).all()


@pytest.mark.parametrize("y", [0.15, -0.15])
def test_in_space_there_is_no_left(y):
    upright = [(5.0, 0.0, 2.0), (5.0, 0.0, 12.0)]
    m = the_measure(along((5, y, 2), (5, y, 12)), upright)
    assert m.lateral[:, 1] == pytest.approx(1.5)
    assert (m.lateral[0, 0], m.lateral[-1, 0]) == pytest.approx((0, 10))
    assert m.greatest_mm == pytest.approx(1.5)


def test_a_wedge_has_the_rms_of_a_triangle():
    m = the_measure([(0, 0), (10, 0.3)], LINE)
    assert m.greatest_mm == pytest.approx(3)
    assert m.rms_mm == pytest.approx(3 / math.sqrt(3), rel=1e-3)


def test_resting_does_not_dilute_the_rms():
    wedge = along((0, 0), (10, 0.3))
    rested = the_measure([wedge[0]] * 3000 + wedge, LINE)
    assert rested.rms_mm == pytest.approx(the_measure(wedge, LINE).rms_mm)
    assert rested.seconds == pytest.approx(31.0)


def test_creeping_counts_as_much_as_hurrying():
    m = the_measure([*along((0, 0), (5, 0), 20), *along((5, 0.2), (10, 0.2), 5000)], LINE)
    assert m.rms_mm == pytest.approx(2 / math.sqrt(2), rel=0.03)


def test_ink_past_the_end_counts():
    m = the_measure(along((-0.2, 0), (10.4, 0)), LINE)
    assert m.greatest_mm == pytest.approx(4)
    assert (m.start_mm, m.end_mm) == pytest.approx((2, 4))
    assert m.missed_mm == pytest.approx(0, abs=1e-9)
    assert (m.lateral[0, 0], m.lateral[-1, 0]) == pytest.approx((-0.2, 10.4))


def test_what_was_left_out_is_missed():
    m = the_measure(along((0, 0), (7, 0)), LINE)
    assert m.greatest_mm == pytest.approx(0)
    assert (m.end_mm, m.missed_mm) == pytest.approx((30, 30))


def test_what_a_detour_left_out_is_missed():
    m = the_measure([(0, 0), (5, 3), (10, 0)], LINE)
    assert m.missed_mm == pytest.approx(10 * 5 * math.sin(math.atan2(3, 5)), abs=0.1)
    assert m.greatest_mm == pytest.approx(30)


def test_a_cut_corner_is_as_far_from_both_sides():
    corner = [(0, 0), (10, 0), (10, 10)]
    m = the_measure([(0, 0), (9, 0), (10, 1), (10, 10)], corner)
    assert m.greatest_mm == pytest.approx(5, abs=0.1)
    assert m.missed_mm == pytest.approx(10 / math.sqrt(2), abs=0.1)
    assert m.lateral[:, 1].min() == pytest.approx(0)


def test_a_circle_is_as_far_off_all_round_and_its_profile_goes_round_once():
    ink = [(5 + 4.1 * math.cos(a), 4.1 * math.sin(a)) for a in np.linspace(-0.05, 6.33, 1200)]
    m = the_measure(ink, CIRCLE)
    assert (m.greatest_mm, m.rms_mm) == pytest.approx((1, 1), abs=2e-3)
    assert m.length_cm == pytest.approx(8 * math.pi, abs=0.02)
    assert (m.lateral[:, 1] < 0).all()  # outside is right of a counter-clockwise way
    assert (np.diff(m.lateral[:, 0]) > 0).all()


def test_a_path_out_and_back_is_followed_out_and_back():
    there_and_back = [(0, 0), (10, 0), (0, 0)]
    m = the_measure([*along((0, 0.1), (10, 0.1)), *along((10, 0.1), (0, 0.1))], there_and_back)
    assert m.lateral[-1, 0] == pytest.approx(20)
    assert (np.diff(m.lateral[:, 0]) > -1e-9).all()
    assert m.lateral[-1, 1] == pytest.approx(-1)  # on the way back the other side is left


def test_a_dot_is_measured_as_a_dot():
    m = the_measure([(10, 0.2)], LINE)
    assert (m.greatest_mm, m.rms_mm, m.end_mm) == pytest.approx((2, 2, 2))
    assert (m.seconds, m.ink_cm) == (0, 0)


def test_a_wanted_dot_is_a_path():
    m = the_measure(along((1, 1), (1, 1.1)), [(1, 1)])
    assert (m.greatest_mm, m.missed_mm, m.length_cm) == pytest.approx((1, 0, 0))


# Which ink belongs to which path

A = [(10, 0), (5, 10)]
B = [(15, 0), (0, 15)]
C = [(12, 15), (0, 15)]


def drawn(path, aside=0.1):
    """Ink for a straight path, `aside` cm beside it."""
    return along(*[(x + aside, y + aside) for x, y in path])


HATCH = [[(0, 0.3 * k), (5, 0.3 * k)] for k in range(6)]

MATCHES = {
    "in order": ([A, B, C], [A, B, C], [0, 1, 2]),
    "swapped": ([A, B, C], [C, A, B], [1, 2, 0]),
    "first missing": ([A, B, C], [B, C], [None, 0, 1]),
    "middle missing": ([A, B, C], [A, C], [0, None, 1]),
    "last missing": ([A, B, C], [A, B], [0, 1, None]),
    "one too many": ([A, C], [B, A, C], [1, 2]),
    "nothing drawn": ([A, B], [], [None, None]),
    "nothing wanted": ([], [A, B], []),
    "the same twice": ([A, A, B], [A, A, B], [0, 1, 2]),
}


@pytest.mark.short(every=3)
@pytest.mark.parametrize(("wanted", "inks", "expected"), MATCHES.values(), ids=MATCHES.keys())
def test_each_path_gets_its_ink(wanted, inks, expected):
    # Every ink lasts another time, which is how it is known again.
    strokes = [[*drawn(ink), *[drawn(ink)[-1]] * (10 * k)] for k, ink in enumerate(inks)]
    found = measure(record(*strokes), wanted)
    assert [m and round((m.seconds - 1.0) / 0.1) for m in found] == expected


def test_a_path_wanted_twice_keeps_its_order_though_the_second_was_drawn_better():
    first, second = measure(record(drawn(A, 0.2), drawn(A, 0.1)), [A, A])
    assert first.greatest_mm > second.greatest_mm


def test_hatching_that_is_off_by_more_than_half_its_pitch_is_not_shifted():
    inks = [along((0, y + 0.2), (5, y + 0.2)) for (_, y), _ in HATCH]
    assert [m.greatest_mm for m in measure(record(*inks), HATCH)] == pytest.approx([2] * 6)


def test_a_dab_is_not_taken_for_the_path_it_lies_on():
    dab = along((7.6, 4.8), (7.4, 5.2))  # nearer to A than the ink that was drawn for it
    found = measure(record(dab, drawn(B), drawn(A)), [A, B])
    assert [m.missed_mm < 3 for m in found] == [True, True]


def test_runs_are_split_where_the_pen_was_lifted_but_not_where_it_bounced():
    pens = [0, 1, 1, 0, 1] + [0] * 20 + [1, 1]
    rows = [Row(0.005 * k, (0, 0), 0.1 * k, 0, pen) for k, pen in enumerate(pens)]
    assert [[round(row.t / 0.005) for row in run] for run in pen_down_runs(rows)] == [
        [1, 2, 4],
        [25, 26],
    ]


def test_a_lift_just_longer_than_a_bounce_splits():
    def runs(gap):
        return len(pen_down_runs([Row(1.0, (), 0, 0, 1), Row(1.0 + gap, (), 0, 0, 1)]))

    assert (runs(line_accuracy.MAX_BOUNCE_TIME), runs(line_accuracy.MAX_BOUNCE_TIME + 0.001)) == (
        1,
        2,
    )


BAD = {
    "empty": [],
    "one coordinate": [(1,), (2,)],
    "three coordinates": [(1, 2, 3)],
    "ragged": [(1, 2), (3,)],
    "not a number": [(0, 0), (math.nan, 1)],
    "infinite": [(0, 0), (math.inf, 1)],
    "text": [("a", "b")],
    "no list": 7,
    "nothing": None,
}


@pytest.mark.parametrize("path", BAD.values(), ids=BAD.keys())
def test_a_path_that_is_none_is_refused_by_its_number(path):
    with pytest.raises(BadWantedPath, match="wanted path 2 is not") as caught:
        measure(record(drawn(A)), [A, path])
    assert "\n" not in str(caught.value)


def test_numbers_for_json_leave_the_profile_out():
    values = the_measure(along((0, 0.15), (10, 0.15)), LINE).as_dict()
    assert values == {
        "greatest_mm": 1.5,
        "rms_mm": 1.5,
        "start_mm": 1.5,
        "end_mm": 1.5,
        "missed_mm": 1.5,
        "seconds": 1.0,
        "length_cm": 10.0,
        "ink_cm": 10.0,
        "floor_mm": None,
    }


# The trace


def test_the_trace_has_the_agreed_columns_and_digits(tmp_path):
    rows = [
        Row(0.0, (0.0, 0.0), 20.8, 0.0, 0),
        Row(0.005, (math.pi, -0.1234567), -1.234567, 1 / 3, 1),
    ]
    write_trace(tmp_path / "trace.csv", rows)
    assert (tmp_path / "trace.csv").read_bytes() == (
        b"t,q1,q2,x,y,pen\n"
        b"0.0000,0.000000,0.000000,20.80000,0.00000,0\n"
        b"0.0050,3.141593,-0.123457,-1.23457,0.33333,1\n"
    )


@pytest.mark.parametrize(
    ("rows", "header"),
    [
        ([], "t,q1,q2,x,y,pen\n"),
        ([Row(0, (1,), 0, 0, 0)], "t,q1,x,y,pen\n"),
        ([Row(0, (1, 2, 3), 0, 0, 0)], "t,q1,q2,q3,x,y,pen\n"),
    ],
    ids=["no row", "one joint", "three joints"],
)
def test_the_trace_has_a_column_for_each_joint(tmp_path, rows, header):
    write_trace(str(tmp_path / "trace.csv"), rows)
    lines = (tmp_path / "trace.csv").read_text().splitlines(keepends=True)
    assert lines[0] == header
    assert len(lines) == 1 + len(rows)


def test_a_trace_that_cannot_be_written_is_an_os_error(tmp_path):
    with pytest.raises(FileNotFoundError):
        write_trace(tmp_path / "nowhere" / "trace.csv", [])


def test_there_is_to_see_a_wanted_path_ink_or_an_arm_that_moved():
    rest = [Row(t, (0.25, -0.5), 20.8, 0.0, 0) for t in (0.0, 0.005, 0.01)]
    settled = [*rest, rest[0]._replace(q=(0.25, -0.52))]
    for pen in (0, 1):  # an arm without a pen motor has it down always
        assert not has_content([row._replace(pen=pen) for row in settled], [])
    assert not has_content([], [])
    assert has_content(rest, [LINE])
    assert has_content([*rest, rest[0]._replace(pen=1)], [])
    there_and_back = [*rest, rest[0]._replace(q=(0.25, -0.7)), *rest]
    assert has_content(there_and_back, [])
