"""The card of the last minute, as plots."""

from __future__ import annotations

import itertools
import math
import time
from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

from nicegui import ui

from laptop.page.cards.browser_state import DRAW, BrowserState
from laptop.page.cards.card import explain, fold, term
from laptop.page.snapshots import HISTORY_DURATION, PlotSample

PLOT_PERIOD = 1.0
"""Period between two updates of each plot in one browser, s."""


PLOTS_TITLE = "Plots"
ROOMY = "(min-width: 61rem) and (min-height: 40rem)"
"""Windows in which plots have room below the pictures of two cameras, as CSS has it."""
NOTHING_YET = "Nothing to show yet. Plots come with the first pictures and the first run."


class PlotsCard:
    """The card of the last minute: plots, of which those are shown that have something to show.

    Args:
        browser_state: the browser's choices.
        has_room: it is open at first, unless the window is a small one.
    """

    def __init__(self, browser_state: BrowserState, has_room: bool = False) -> None:
        self._browser_state = browser_state
        self._due = -math.inf  # s
        with fold(browser_state, PLOTS_TITLE, "show_chart") as self.element:
            self.element.classes("plots-card")
            with ui.row().classes("w-full items-center gap-2 no-wrap"):
                ui.label("The last minute").classes("quiet")
                ui.space()
                self._running = ui.checkbox("Run", value=True).props("dense")
                explain(self._running, "Let go, the plots stand still, to be looked at.")
                ui.button(
                    "CSV", icon="download", on_click=lambda: ui.download.from_url("/history.csv")
                ).props("flat dense no-caps").tooltip("the last minute as a table")
            self._nothing = ui.label(NOTHING_YET).classes("quiet")
            with ui.element("div").classes("plots"):
                self._plots = [Plot(*plot) for plot in PLOTS]
        self._period = PLOT_PERIOD / len(self._plots)
        self._next_plot = itertools.cycle(self._plots)
        ui.timer(self._period, self._refresh)
        if has_room and PLOTS_TITLE not in browser_state.folds:
            ui.on("room-for-plots", self.element.open)
            ui.run_javascript(f"if (matchMedia('{ROOMY}').matches) emitEvent('room-for-plots')")

    def _refresh(self) -> None:
        """Draw the next plot; all at once would hold up the cameras' images."""
        is_seen = self.element.value and self._running.value
        if not is_seen or time.monotonic() < self._due:
            return
        controller = self._browser_state.controller
        self._due = controller.due(self._period)
        if controller.past:
            next(self._next_plot).show(controller.past, self._browser_state.tool == DRAW)
            self._nothing.set_visibility(not any(plot.element.visible for plot in self._plots))


class PlotKind(NamedTuple):
    """Kind of a plot.

    title        its name and unit
    explanation  with the field's own term
    values       from a sample of the history a value for each line, by name
    of_runs      of the servo's runs; of no use while something is drawn
    """

    title: str
    explanation: str
    values: Callable[[PlotSample], Mapping[str, float | None]]
    of_runs: bool = False


AXES = {"u": "across", "v": "down"}


def _across_and_down(sample: PlotSample) -> Mapping[str, float]:
    several = len({name.partition(".")[0] for name in sample.e}) > 1
    named = {}
    for name, value in sample.e.items():
        camera, _, axis = name.rpartition(".")
        axis_name = AXES.get(axis, axis)
        named[f"{camera} {axis_name}" if several else axis_name] = value
    return named


PLOTS = (
    PlotKind(
        "Distance from the goal, px",
        "The error: how far the tip's marker is from the goal in the picture, in pixels.",
        lambda s: {"error": s.error},
        of_runs=True,
    ),
    PlotKind(
        "Distance across and down, px",
        "The error's components: along the picture's columns (u) and rows (v), in pixels.",
        _across_and_down,
        of_runs=True,
    ),
    PlotKind(
        "Angles of the joints, °",
        "Where the motors have turned the joints to: q1, q2, ... from the base on.",
        lambda s: {f"joint {n}": math.degrees(q) for n, q in enumerate(s.q, 1)},
    ),
    PlotKind(
        "Moves of this run, number",
        "Each move is one step of the servo's iteration.",
        lambda s: {"moves": float(s.moves) if s.moves else None},
        of_runs=True,
    ),
    PlotKind(
        "How unevenly the joints act, ratio",
        "The condition number of the image Jacobian. 1: all directions are as easy. Large: near a "
        "pose from which the tip can hardly go one way.",
        lambda s: {"condition": s.condition},
        of_runs=True,
    ),
    PlotKind(
        "Age of the newest picture, ms",
        "The latency from the camera's shutter on.",
        lambda s: {name: age and 1000 * age for name, age in s.ages.items()},
    ),
    PlotKind(
        "Pictures, per second",
        "The frame rate (fps) of each camera.",
        lambda s: s.rates,
    ),
)


class Plot:
    """The last minute of something, as lines.

    Args:
        title, explanation, values, of_runs: as in PlotKind.
    """

    def __init__(
        self,
        title: str,
        explanation: str,
        values: Callable[[PlotSample], Mapping[str, float | None]],
        of_runs: bool,
    ) -> None:
        self._values, self._of_runs = values, of_runs
        quiet = {"color": "#7d8793", "fontSize": 12}
        grid = {"lineStyle": {"color": "#8a94a033"}}
        with ui.element("div").classes("plot") as self.element:
            term(title, explanation)
            self._chart = ui.echart(
                {
                    "animation": False,
                    "legend": {"type": "scroll", "right": 0, "top": 0, "textStyle": quiet,
                               "itemWidth": 10, "itemHeight": 8},
                    "grid": {"left": 44, "right": 14, "top": 8, "bottom": 20},
                    "xAxis": {"type": "value", "min": -HISTORY_DURATION, "max": 0, "interval": 20,
                              "axisLabel": {**quiet, ":formatter": "v => v + ' s'"},
                              "splitLine": grid},
                    "yAxis": {"type": "value", "scale": True, "axisLabel": quiet,
                              "splitLine": grid, "splitNumber": 3, "axisLine": {"show": False},
                              "axisTick": {"show": False}},
                    "color": ["#e8590c", "#1c7ed6", "#37b24d", "#ae3ec9", "#f59f00", "#0ca678"],
                    "series": [],
                }
            ).classes("chart")  # fmt: skip
        self.element.set_visibility(False)

    def show(self, past: Sequence[PlotSample], draws: bool = False) -> None:
        """Draw a line for each name, or hide it while there is nothing in it.

        Args:
            past: the last minute.
            draws: what belongs to runs of the servo is of no use.
        """
        rows = [self._values(sample) for sample in past]
        names = dict.fromkeys(
            name for row in rows for name, value in row.items() if value is not None
        )
        is_something = bool(names) and not (self._of_runs and draws)
        self.element.set_visibility(is_something)
        if not is_something:
            return
        times = [round(sample.t - past[-1].t, 2) for sample in past]
        options = self._chart.options
        options["legend"]["show"] = len(names) > 1
        options["grid"]["top"] = 24 if len(names) > 1 else 8
        options["series"] = [
            {"name": name, "type": "line", "showSymbol": False, "lineStyle": {"width": 2},
             "data": [
                 (t, None if (value := row.get(name)) is None else round(value, 3))
                 for t, row in zip(times, rows, strict=True)
             ]}
            for name in names
        ]  # fmt: skip
        self._chart.update()
