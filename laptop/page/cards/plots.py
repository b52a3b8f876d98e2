"""The card of the last minute, as plots."""

from __future__ import annotations

import itertools
import math
import time
from collections.abc import Callable, Mapping, Sequence

from nicegui import ui

from laptop.page.cards.card import card, heading
from laptop.page.cards.session import BrowserSession
from laptop.page.snapshots import HISTORY_DURATION, PlotSample

PLOT_PERIOD = 1.0
"""Between two updates of each plot in one browser, s."""


class PlotsCard:
    """The card of the last minute.

    Args:
        session: the browser's choices.
    """

    def __init__(self, session: BrowserSession) -> None:
        self._controller = session.controller
        self._due = -math.inf  # s
        with card("The last minute", later=True):
            with ui.row().classes("w-full items-center gap-2 no-wrap"):
                heading("The last minute")
                ui.space()
                self._running = ui.checkbox("Run", value=True).props("dense")
                ui.button(
                    "CSV", icon="download", on_click=lambda: ui.download.from_url("/history.csv")
                ).props("flat dense no-caps")
            with ui.element("div").classes("plots"):
                plots = [
                    Plot("error, px", lambda s: {"error": s.error}),
                    Plot("components, px", lambda s: s.e),
                    Plot(
                        "joints, degrees",
                        lambda s: {f"q{n}": math.degrees(q) for n, q in enumerate(s.q, 1)},
                    ),
                    Plot(
                        "moves",
                        lambda s: {"moves": float(s.moves), "condition": s.condition},
                    ),
                    Plot(
                        "frame age, ms",
                        lambda s: {name: age and 1000 * age for name, age in s.ages.items()},
                    ),
                    Plot("frames per second", lambda s: s.rates),
                ]
        self._period = PLOT_PERIOD / len(plots)
        self._next_plot = itertools.cycle(plots)
        ui.timer(self._period, self._refresh)

    def _refresh(self) -> None:
        """Draw the next plot; all at once would hold up the cameras' images."""
        if not self._running.value or time.monotonic() < self._due:
            return
        self._due = self._controller.due(self._period)
        if self._controller.past:
            next(self._next_plot).show(self._controller.past)


class Plot:
    """The last minute of something, as lines.

    Args:
        title: its name and unit.
        values: from a sample of the history a value for each line, by name.
    """

    def __init__(
        self, title: str, values: Callable[[PlotSample], Mapping[str, float | None]]
    ) -> None:
        self._values = values
        quiet = {"color": "#8a94a0", "fontSize": 12}
        grid = {"lineStyle": {"color": "#8a94a033"}}
        self._chart = ui.echart(
            {
                "animation": False,
                "title": {"text": title, "left": 0, "top": 0,
                          "textStyle": {"color": "#8a94a0", "fontSize": 13}},
                "legend": {"right": 0, "top": 0, "textStyle": quiet, "itemWidth": 10,
                           "itemHeight": 8},
                "grid": {"left": 44, "right": 8, "top": 24, "bottom": 20},
                "xAxis": {"type": "value", "min": -HISTORY_DURATION, "max": 0, "interval": 20,
                          "axisLabel": {**quiet, ":formatter": "v => v + ' s'"},
                          "splitLine": grid},
                "yAxis": {"type": "value", "scale": True, "axisLabel": quiet,
                          "splitLine": grid, "splitNumber": 3, "axisLine": {"show": False},
                          "axisTick": {"show": False}},
                "color": ["#e8590c", "#1c7ed6", "#37b24d", "#ae3ec9", "#f59f00", "#0ca678"],
                "series": [],
            }
        ).classes("plot")  # fmt: skip

    def show(self, past: Sequence[PlotSample]) -> None:
        """Draw a line for each name."""
        rows = [self._values(sample) for sample in past]
        names = dict.fromkeys(name for row in rows for name in row)
        times = [round(sample.t - past[-1].t, 2) for sample in past]
        options = self._chart.options
        options["legend"]["show"] = len(names) > 1
        options["series"] = [
            {"name": name, "type": "line", "showSymbol": False, "lineStyle": {"width": 2},
             "data": [
                 (t, None if (value := row.get(name)) is None else round(value, 3))
                 for t, row in zip(times, rows, strict=True)
             ]}
            for name in names
        ]  # fmt: skip
        self._chart.update()
