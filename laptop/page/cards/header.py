"""The bar above all cards: which brick there is, and STOP."""

from __future__ import annotations

from nicegui import ui

from laptop.page.cards.session import BrowserSession
from laptop.page.interface import RunCalls
from laptop.page.snapshots import PageState


class Header:
    """The bar above all cards.

    Args:
        session: the browser's choices.
    """

    def __init__(self, session: BrowserSession) -> None:
        self._session = session
        self._dark = ui.dark_mode(None)
        with ui.header(), ui.element("div").classes("bar"):
            ui.label("BrickServo").classes("word")
            self._brick = ui.label().classes("pill").mark("brick")
            ui.space()
            ui.button(icon="dark_mode", on_click=self.toggle_dark).props(
                'flat round color=white aria-label="dark or light"'
            ).tooltip("dark or light (D)")
            ui.button("STOP", on_click=self.stop).props(
                'color=negative unelevated aria-label="STOP the arm (Escape)"'
            ).classes("stop").tooltip("stop the arm (Escape)")

    def show(self, state: PageState) -> None:
        """Show which brick there is."""
        self._brick.set_text(brick_text(state))
        self._brick.classes(remove="ok warm", add="ok" if state.brick else "warm")

    def toggle_dark(self) -> None:
        """Change between dark and light."""
        # The first time it is as the system has it; then the other way round.
        self._dark.set_value(self._dark.value is not True)

    async def stop(self) -> None:
        """Stop the arm."""
        self._session.warn(await self._session.controller.call(RunCalls.stop))


def brick_text(state: PageState) -> str:
    """Return which brick there is, for people."""
    if state.brick is None:
        return "emulated brick is coming" if state.own else "no brick connected"
    return "emulated brick" if state.own else f"brick {state.brick.removeprefix('::ffff:')}"
