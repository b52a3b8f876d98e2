"""The bar above all cards: which brick there is, who steers, and STOP."""

from __future__ import annotations

from pathlib import Path

from nicegui import ui

from laptop.page.cards.browser_state import BrowserState
from laptop.page.snapshots import PageState

SCRIPT = Path(__file__).with_name("pulse.js")
STOP = (
    '<span class="can">STOP<span class="unseen"> the arm (Escape)</span></span>'
    '<span class="cannot">STOP cannot be sent: press the brick\'s Back button</span>'
)


class Header:
    """The bar above all cards.

    Args:
        browser_state: the browser's choices.
        gate_port: of laptop.page.stop_gate.
    """

    def __init__(self, browser_state: BrowserState, gate_port: int) -> None:
        self._browser_state = browser_state
        self._dark = ui.dark_mode(None)
        page = ui.context.client.id
        script = SCRIPT.read_text(encoding="utf-8")
        ui.add_head_html(f"<script>{script} beginPulse({gate_port}, '{page}');</script>")
        with ui.header(), ui.element("div").classes("bar"):
            ui.html("BrickServo", sanitize=False, tag="h1").classes("word")
            with ui.element("div").classes("who"):
                self._brick = ui.label().classes("pill").mark("brick")
                self._driver = ui.label().classes("pill driver")
            self._take_over = ui.button("Take over", on_click=browser_state.take_over).props(
                "outline dense no-caps color=white"
            )
            ui.space()
            ui.button(icon="dark_mode", on_click=self.toggle_dark).props(
                'flat round color=white aria-label="dark or light"'
            ).classes("dark-or-light").tooltip("dark or light (D)")
            # The script handles this button: it sends STOP on two channels at once.
            with ui.button(color="negative").props("unelevated").classes("stop"):
                ui.html(STOP, sanitize=False)
        ui.element("div").classes("alarm").props("role=alert")

    def show(self, state: PageState) -> None:
        """Show which brick there is, and who steers."""
        self._brick.set_text(brick_text(state))
        self._brick.classes(remove="ok warm", add="ok" if state.brick else "warm")
        steers = state.driver == self._browser_state.browser
        self._driver.set_text("You steer" if steers else f"{state.driver_name or 'nobody'} steers")
        self._take_over.set_visibility(not steers)

    def toggle_dark(self) -> None:
        """Change between dark and light."""
        # The first time it follows the system's setting, then it is inverted.
        self._dark.set_value(self._dark.value is not True)


def brick_text(state: PageState) -> str:
    """Return which brick there is, for people."""
    if state.brick is None:
        return "emulated brick is coming" if state.own else "no brick connected"
    return "emulated brick" if state.own else f"brick {state.brick.removeprefix('::ffff:')}"
