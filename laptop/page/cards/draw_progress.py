"""Part of the card of drawings that shows the progress of a job."""

from __future__ import annotations

from functools import partial

from nicegui import events, ui

from laptop.drawing.timing import in_minutes
from laptop.page.cards.browser_state import BrowserState
from laptop.page.cards.card import term
from laptop.page.drawing_snapshots import Deviation, JobState
from laptop.page.interface import DrawCalls
from shared.job_messages import DONE, FAILED, FETCHING, PAUSED, PEN, RELATIVE_SPEED, SPEED

OFF = (
    "How far the ink is from the wish. On the whole: the RMS, the root of the mean of the squares, "
    "in which large ones count more."
)
PEN_STEP, MAX_PEN = 5.0, 30.0
"""Degrees of the pen's motor: a press of a button, and the most."""


class ProgressPart:
    """A job's share and state, its speed and its pen, and how far it was off.

    Args:
        browser_state: the browser's choices.
    """

    def __init__(self, browser_state: BrowserState) -> None:
        self._browser_state = browser_state
        self._pen = 0.0  # degrees deeper
        with ui.element("div").classes("w-full job") as self._job:
            self._bar = ui.linear_progress(0.0, show_value=False).props("size=.7rem rounded")
            self._bar.props('aria-label="share that is drawn"')
            self._word = ui.label().classes("job-word").props("role=status aria-live=polite")
            self._why = ui.label().classes("quiet why")
            with ui.element("div").classes("deviation") as self._deviation:
                self._off = term("", OFF).classes("job-word")
            with ui.row().classes("w-full gap-2 items-center no-wrap pen") as self._on_the_way:
                ui.label("Speed").classes("quiet")
                self._speed = ui.slider(
                    min=RELATIVE_SPEED[0], max=RELATIVE_SPEED[1], step=5, value=100
                ).props('label aria-label="speed, per cent" :label-value="$event"')
                self._speed.props(remove=":label-value")
                self._speed.on("change", self._on_speed)
                ui.label("Pen").classes("quiet")
                for label, step in (("lower", PEN_STEP), ("higher", -PEN_STEP)):
                    ui.button(label, on_click=partial(self._move_pen, step)).props(
                        "flat dense no-caps"
                    )

    def show(self, job: JobState | None) -> None:
        """Show the progress; None: there is no job."""
        self._on_the_way.set_visibility(job is not None and job.is_on)
        self._job.set_visibility(job is not None)
        if job is None:
            return
        self._bar.set_value(round(job.share, 3))
        self._bar.set_visibility(job.is_on)
        self._word.set_text(job_text(job))
        self._word.classes(remove="ok bad", add={DONE: "ok", FAILED: "bad"}.get(job.state, ""))
        self._why.set_text(job.reason[:1].upper() + job.reason[1:])
        if not job.is_on:
            self._pen = 0.0

    def show_deviation(self, deviation: Deviation | None) -> None:
        """Show how far it was off; None: that is not known."""
        self._deviation.set_visibility(deviation is not None)
        if deviation is not None:
            self._off.set_text(
                f"Off by {deviation.rms:.1f} mm on the whole, {deviation.greatest:.1f} mm at most"
            )

    async def _on_speed(self, event: events.GenericEventArguments) -> None:
        await self._browser_state.draw(DrawCalls.order, SPEED, float(self._speed.value))

    async def _move_pen(self, step: float) -> None:
        self._pen = min(max(-MAX_PEN, self._pen + step), MAX_PEN)
        await self._browser_state.draw(DrawCalls.order, PEN, self._pen)


def job_text(job: JobState) -> str:
    """Return how the brick gets on, for people."""
    share = f"{100 * job.share:.0f} %"
    if job.state == FETCHING:
        return f"The brick fetches {job.name}: {share}"
    if job.state == DONE:
        return f"{job.name}: done"
    if job.state == FAILED:
        return f"{job.name}: ended at {share}" if job.share else f"{job.name}: not begun"
    if job.is_on:
        word = "Paused, pen up" if job.state == PAUSED else "Drawing"
        text = f"{word}: {share}, stroke {job.stroke} of {job.strokes}"
        return text + (f", {in_minutes(job.seconds)} left" if job.seconds is not None else "")
    return f"{job.name}: {job.state} at {share}"
