"""The card that drives the arm: where it is to go, how the run goes, Start and Hold."""

from __future__ import annotations

import time
from itertools import groupby

from nicegui import ui

from laptop.page.cards.browser_state import AIM, TOOLS, BrowserState
from laptop.page.cards.card import card, explain, fold, heading, term
from laptop.page.interface import RunCalls
from laptop.page.run_records import RunSummary
from laptop.page.snapshots import DEFAULTS, PageState, points
from shared.messages import BUDGET, GOAL, TOLERANCE
from shared.run_options import METHODS, MODES, ROWS, SERVO_METHODS, usual_mode
from shared.verdicts import CONVERGED, READY, STOPPED, VERDICT_TEXTS

ERROR = (
    "The error: so far the tip's marker is from the goal in the picture, in pixels. "
    "The picture is 640 wide, unless the camera was told otherwise."
)
METHOD_HELP = "; ".join(
    f"{', '.join(method.name for method in alike)}: {words}"
    for words, alike in groupby(reversed(SERVO_METHODS), lambda method: method.help)
)
"""What the methods do, those that do the same together."""
CHOICE_HELP = (
    "How the arm learns what its motors change in the picture (the image Jacobian). "
    f"{METHOD_HELP}.",
    "look: it looks, then moves. stream: it steers while it moves.",
    "stereo: all four coordinates of two cameras, weighed by their noise. xyz: three of them, as "
    "in the lab report.",
    "So near to the goal the run ends well, in pixels.",
    "So long may the run take at most, in seconds.",
)
"""Explanations of the choices of a run, in their order."""


class DriveCard:
    """The card that drives the arm.

    Args:
        browser_state: the browser's choices.
    """

    def __init__(self, browser_state: BrowserState) -> None:
        self._browser_state = browser_state
        self._runs: tuple[RunSummary, ...] = ()  # that the menu of reports has
        with card("Drive").classes("main") as self.element:
            heading("Drive")
            self._add_progress()
            self._add_buttons()

    def add_more(self, several: bool) -> None:
        """Add what is not always in sight.

        Args:
            several: whether there are several cameras.
        """
        with ui.element("div").classes("part") as self.more:
            self._add_reports()
            self._add_options(several)

    def _add_progress(self) -> None:
        with ui.element("div").classes("messages").props("role=status aria-live=polite"):
            self._verdict = ui.label().classes("verdict").mark("verdict")
            self._reason = ui.label().classes("quiet reason")
        with ui.element("div").classes("measure"):
            self._error = ui.label().classes("error").mark("error")
            with ui.element("div"):
                term("from the goal", ERROR)
                self._run = ui.label().classes("quiet run")
        self._goal = ui.label().classes("quiet goal")

    def _add_buttons(self) -> None:
        with ui.row().classes("w-full gap-2 no-wrap"):
            # (A tooltip would hide what is beside them.)
            self._start = (
                ui.button("Start", icon="play_arrow", on_click=self.start)
                .props("color=positive unelevated aria-keyshortcuts=S")
                .classes("go")
            )
            self._hold = (
                ui.button("Hold", icon="pause", on_click=self.hold)
                .props("outline aria-keyshortcuts=H")
                .classes("go")
            )

    def _add_reports(self) -> None:
        with ui.row().classes("w-full gap-1 quick"):
            self._report = (
                ui.button("Report", icon="assessment")
                .props("flat dense no-caps type=a href=/report target=_blank")
                .classes("report")
                .tooltip("of the last run, in a new tab")
            )
            self._earlier = ui.button("Earlier", icon="history").props("flat dense no-caps")
            with self._earlier:
                self._reports = ui.menu()
            self._to_marker = ui.button("Goal marker", on_click=self._aim_at_marker)
            self._to_marker.props("flat dense no-caps icon=my_location")
            self._to_marker.tooltip("aim at the goal marker again")

    def _add_options(self, several: bool) -> None:
        with fold(self._browser_state, "How it drives", "tune"):
            self._method = ui.select(list(METHODS), value=DEFAULTS.method, label="method")
            self._mode = ui.select(list(MODES), value=DEFAULTS.mode, label="mode")
            self._method.on_value_change(lambda e: self._mode.set_value(usual_mode(e.value)))
            self._rows = ui.select(list(ROWS), value=DEFAULTS.rows, label="rows of two cameras")
            self._rows.set_visibility(several)
            self._tolerance, self._budget = (
                ui.number(f"{what}, {unit}", value=usual, min=least, max=most, step=step)
                for what, usual, (least, most, unit), step in (
                    ("tolerance", DEFAULTS.tolerance, TOLERANCE, 0.5),
                    ("budget", DEFAULTS.budget, BUDGET, 10.0),
                )
            )
            choices = self._method, self._mode, self._rows, self._tolerance, self._budget
            for choice, explanation in zip(choices, CHOICE_HELP, strict=True):
                choice.classes("field").props("dense")
                explain(choice, explanation)
            self._follow = ui.switch("follow the goal marker as it moves").props("dense")
            ui.label(
                "in the mode stream, until the budget is spent or Hold or STOP ends it"
            ).classes("quiet")
            ui.label("Keys: S starts, H holds, Escape stops.").classes("quiet")

    def show(self, state: PageState) -> None:
        """Show the run's state, and enable the possible orders."""
        status = state.status if state.brick else None
        text, tone = verdict_text(state)
        self._verdict.set_text(text)
        self._verdict.classes(remove="ok bad", add=tone)
        reason = status.reason if status else ""
        is_ready = status is not None and status.verdict == READY
        self._reason.set_text(reason or (TOOLS[AIM].explanation if is_ready else ""))
        known = status is not None and status.error is not None
        self._error.set_text(f"{status.error:.1f} px" if status and known else "– px")
        self._run.set_text(
            f"run {status.run}, {status.moves} move{'s' * (status.moves != 1)}"
            if status and status.run
            else ""
        )
        self._goal.set_text("Goal: " + goal_text(state))
        # (Seen only once one has aimed, it would move what is beside it.)
        self._to_marker.set_visibility(GOAL in state.markers)
        self._to_marker.set_enabled(bool(state.aims))
        steers = self._browser_state.steers
        self._start.set_enabled(state.brick is not None and not state.running and steers)
        self._hold.set_enabled(state.running and steers)
        self._show_reports(state.runs)

    def _show_reports(self, runs: tuple[RunSummary, ...]) -> None:
        self._report.set_enabled(bool(runs))
        self._earlier.set_enabled(len(runs) > 1)
        if runs == self._runs:
            return
        self._runs = runs
        self._reports.clear()
        with self._reports:
            for run in reversed(runs[:-1]):
                began = time.strftime("%H:%M:%S", time.localtime(run.when))
                ui.menu_item(f"{began} {run.verdict or 'on its way'}").props(
                    f"href=/report/{run.number} target=_blank"
                )

    async def start(self) -> None:
        """Start a run."""
        browser_state = self._browser_state
        numbers = []
        for what, field, (_, _, unit) in (
            ("tolerance", self._tolerance, TOLERANCE),
            ("budget", self._budget, BUDGET),
        ):
            if field.value is None:
                browser_state.warn(
                    f"{what}: write a number of {unit}, e.g. {getattr(DEFAULTS, what):g}"
                )
                return
            numbers.append(float(field.value))
        tolerance, budget = numbers
        how = self._method.value, self._mode.value, self._rows.value
        order = *how, tolerance, budget, bool(self._follow.value)
        await browser_state.order(RunCalls.start, *order)

    async def hold(self) -> None:
        """Halt the arm."""
        await self._browser_state.order(RunCalls.hold, self._browser_state.title)

    async def _aim_at_marker(self) -> None:
        await self._browser_state.order(RunCalls.aim_at_marker)


def verdict_text(state: PageState) -> tuple[str, str]:
    """Return how the run goes, for people, and the tone of it: "ok", "bad" or ""."""
    status = state.status if state.brick else None
    verdict = status.verdict if status else None
    if state.following and verdict == "":
        return "Following the goal marker. Hold or STOP ends it.", ""
    if state.running and state.left:
        return f"Along the path, {points(state.left)} to go.", ""
    if state.running:
        if status and verdict == "" and status.reason:
            return f"Held: {status.reason.split(':')[0]}. It goes on by itself.", ""
        return "On its way." if verdict == "" else "Starting ...", ""
    if status is None:
        return "The emulated brick is coming ..." if state.own else "No brick is connected.", ""
    tone = {CONVERGED: "ok", READY: "", STOPPED: ""}.get(status.verdict, "bad")
    return VERDICT_TEXTS.get(status.verdict, f"{status.verdict}."), tone


def goal_text(state: PageState) -> str:
    """Return where the tip is to go, for people."""
    if state.aims:
        where = [f"{u:.0f}, {v:.0f}" for u, v in state.aims.values()]
        if len(state.cameras) > 1:
            where = [f"{name} {text}" for name, text in zip(state.aims, where, strict=True)]
        missing = [camera.name for camera in state.cameras if camera.name not in state.aims]
        rest = f"; click it in {' and '.join(missing)}, too" if missing else ""
        rest += f", then {state.left} more" if state.left else ""
        return "pixel " + " and ".join(where) + rest
    if state.fixed:
        return "the pixel that the command line fixed"
    return "the goal marker" if GOAL in state.markers else "none yet; click one in the picture"
