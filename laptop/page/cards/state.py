"""The cards of numbers: how to connect a brick; link, cameras, markers; the last message."""

from __future__ import annotations

from typing import NamedTuple

from nicegui import ui

from laptop.page.cards.browser_state import BrowserState
from laptop.page.cards.card import card, fold, heading, term
from laptop.page.interface import RunCalls
from laptop.page.marker_text import marker_title
from laptop.page.snapshots import LOW_BATTERY, PageState

LINK = "The link's round trip time: so long goes a question to the brick, and its answer back."
BATTERY = f"The battery's voltage. Below {LOW_BATTERY} V it is soon empty."
CAMERA = (
    "The camera's frame rate (fps), the age of its newest frame (latency), and frames that were "
    "dropped, because newer ones were there already."
)
FILE = "Where the markers' colours are kept: a file that one can read and correct."


class Fact(NamedTuple):
    """A figure: its name and text, what the field calls it, and whether it is a warning."""

    name: str
    text: str
    explanation: str
    warns: bool = False


class StateCard:
    """The cards of figures.

    Args:
        browser_state: the browser's choices.
    """

    def __init__(self, browser_state: BrowserState) -> None:
        self._shown_commands: tuple[str, ...] = ()
        self._named: list[tuple[str, str]] = []  # facts that have a row, and their explanations
        self._browser_state = browser_state
        with card("Brick") as self._invitation:
            heading("Brick")
            self._call = ui.button(
                "Run it on the brick", on_click=lambda: browser_state.order(RunCalls.call_brick)
            ).props("no-caps outline dense")
            ui.label("Type the first here, or another one on the brick itself").classes("quiet")
            self._commands = ui.column().classes("w-full gap-1")

    def add_more(self) -> None:
        """Add what comes after all others: it may grow, and nothing moves by that."""
        with fold(self._browser_state, "Numbers", "info"):
            self._facts = ui.element("dl").classes("facts")
        self._note = ui.label().classes("quiet note")

    def show(self, state: PageState) -> None:
        """Show the last message and, without a brick, the commands to type."""
        self._note.set_text(state.note)
        self._invitation.set_visibility(
            state.brick is None and not state.own and bool(state.commands)
        )
        self._call.set_visibility(state.can_call)
        if state.commands != self._shown_commands:
            self._shown_commands = state.commands
            self._commands.clear()
            with self._commands:
                for command in state.commands:
                    ui.label(f"{command} --wait").classes("mono")
                if len(state.cameras) > 1:
                    ui.label("for an arm in space with --arm spatial").classes("quiet")

    def show_facts(self, state: PageState) -> None:
        """Show the figures, which change all the time."""
        facts = facts_of(state)
        named = [(fact.name, fact.explanation) for fact in facts]
        if named != self._named:  # else what is explained just now would go
            self._named = named
            self._facts.clear()
            with self._facts:
                self._rows = [self._add_row(fact) for fact in facts]
        for row, fact in zip(self._rows, facts, strict=True):
            row.set_text(fact.text)
            row.classes(add="warn" if fact.warns else "", remove="" if fact.warns else "warn")

    def _add_row(self, fact: Fact) -> ui.label:
        with ui.element("dt"):
            term(fact.name, fact.explanation)
        with ui.element("dd"):
            return ui.label(fact.text)


def facts_of(state: PageState) -> list[Fact]:
    """Return the figures."""
    facts = []
    if state.round_trip is not None:
        facts.append(Fact("link", f"{1000 * state.round_trip:.1f} ms there and back", LINK))
    volts = state.status.battery if state.brick and state.status else None
    if volts is not None:
        low = volts < LOW_BATTERY
        advice = ": low, charge it or put in fresh cells" if low else ""
        facts.append(Fact("battery", f"{volts:.1f} V{advice}", BATTERY, low))
    for camera in state.cameras:
        text = f"{camera.rate:.0f} pictures per second"
        if camera.age is not None:
            text += f", the newest {1000 * camera.age:.0f} ms old"
        text += f", {camera.dropped} left out"
        facts.append(Fact(f"camera {camera.name}", text, CAMERA))
    for name, figures in state.markers.items():
        facts.append(
            Fact(
                marker_title(name), state.marker_descriptions.get(name, figures), _of(name, figures)
            )
        )
    facts.append(Fact("colours in", state.file, FILE))
    return facts


def _of(name: str, figures: str) -> str:
    """Return the field's term for a marker, and its appearance."""
    return (
        f"{name}: {figures}. What the picture says of how sure it is, is the confidence, from 0 "
        "to 100 %; below 50 % it may be something else."
    )
