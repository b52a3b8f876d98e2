"""The card of figures: link, battery, cameras and markers, and what to type to have a brick."""

from __future__ import annotations

from pathlib import Path

from nicegui import ui

from laptop.page.cards.card import card, heading
from laptop.page.cards.session import BrowserSession
from laptop.page.interface import RunCalls
from laptop.page.snapshots import LOW_BATTERY, PageState
from laptop.record.figures.document import load_templates

FACTS = load_templates(Path(__file__).with_name("templates")).get_template("facts.html")


class StateCard:
    """The card of figures.

    Args:
        session: the browser's.
    """

    def __init__(self, session: BrowserSession) -> None:
        self._shown_commands: tuple[str, ...] = ()
        with card("State", later=True):
            heading("State")
            self._note = ui.label().classes("quiet note")
            self._invitation = ui.element("div")
            with self._invitation:
                self._call = ui.button(
                    "Run it on the brick", on_click=lambda: session.order(RunCalls.call_brick)
                ).props("no-caps outline dense")
                ui.label("Type the first here, or another one on the brick itself").classes("quiet")
                self._commands = ui.column().classes("w-full gap-1")
            self._facts = ui.html("", sanitize=False).classes("w-full")

    def show(self, state: PageState) -> None:
        """Show what was last to be said, and to who has no brick what to type."""
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
        self._facts.set_content(facts_table(state))


def facts_table(state: PageState) -> str:
    """Return the figures as a table in HTML."""
    facts = []  # name, text, whether it is a warning
    if state.round_trip is not None:
        facts.append(("link", f"{1000 * state.round_trip:.1f} ms round trip", False))
    volts = state.status.battery if state.brick and state.status else None
    if volts is not None:
        low = volts < LOW_BATTERY
        advice = ": low, charge it or put in fresh cells" if low else ""
        facts.append(("battery", f"{volts:.1f} V{advice}", low))
    for camera in state.cameras:
        age = "" if camera.age is None else f", {1000 * camera.age:.0f} ms old"
        text = f"{camera.rate:.0f} fps{age}, {camera.dropped} dropped"
        facts.append((f"camera {camera.name}", text, False))
    facts += [(name, looks, False) for name, looks in state.markers.items()]
    facts.append(("colours in", state.file, False))
    return FACTS.render(facts=facts)
