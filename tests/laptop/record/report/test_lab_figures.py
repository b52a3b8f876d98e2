"""Figures from raw data: drawn where there is something, and none where there is not."""

import numpy as np

from laptop.record.report.lab_figures import draw_servo, draw_trace, draw_tracks, draw_ways

NONE = np.zeros((0, 2))
TRACE = {name: np.arange(5.0) for name in ("t", "q1", "x", "y", "pen")}


def test_a_trace_without_what_is_drawn_gives_no_figure():
    assert draw_trace(TRACE).startswith(b"\x89PNG")
    for missing in ("t", "x", "y", "pen"):
        assert draw_trace({name: v for name, v in TRACE.items() if name != missing}) is None
    assert draw_trace({**TRACE, "x": np.full(5, np.nan)}) is None


def test_where_nothing_was_seen_there_is_no_figure():
    assert draw_ways({}, {}, {}, 5.0) is None
    assert draw_servo(NONE, NONE, {"q1": NONE}, NONE, None) is None
    assert draw_tracks([("goal", np.full((3, 2), np.nan))]) is None


def test_an_error_alone_or_joints_alone_are_drawn():
    rows = np.array([[0.0, 100.0], [1.0, 2.0]])
    assert draw_servo(rows, NONE, {}, NONE, None).startswith(b"\x89PNG")
    assert draw_servo(NONE, NONE, {"q1": rows}, rows, 5.0).startswith(b"\x89PNG")
