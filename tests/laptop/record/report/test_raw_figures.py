"""Figures from raw data: drawn where there is something, and none where there is not."""

import numpy as np

from laptop.record.report.raw_figures import draw_trace, draw_tracks

TRACE = {name: np.arange(5.0) for name in ("t", "q1", "x", "y", "pen")}


def test_a_trace_without_what_is_drawn_gives_no_figure():
    assert draw_trace(TRACE).startswith(b"\x89PNG")
    for missing in ("t", "x", "y", "pen"):
        assert draw_trace({name: v for name, v in TRACE.items() if name != missing}) is None
    assert draw_trace({**TRACE, "x": np.full(5, np.nan)}) is None


def test_where_nothing_was_seen_there_is_no_figure():
    assert draw_tracks([("goal", np.full((3, 2), np.nan))]) is None
