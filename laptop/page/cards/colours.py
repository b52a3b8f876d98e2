"""The card of the tools: what a click in an image does, and which marker's colour it teaches."""

from __future__ import annotations

from functools import partial
from typing import Any

from nicegui import events, ui

from laptop.page.cards.browser_state import AIM, COLOUR_EDITS, TOOLS, BrowserState
from laptop.page.cards.card import explain, fold
from laptop.page.interface import ColourCalls, StatusCalls
from laptop.page.snapshots import PageState
from shared.messages import EFFECTOR, GOAL

MASK = "The mask: shows the pixels that have the marker's colour, and darkens the others. Key: M."
WINDOWS = "The search windows: dashed, where in the picture each marker is looked for first."


class ColourCard:
    """The card of the tools.

    Args:
        browser_state: the browser's choices, some of which are made here.
    """

    def __init__(self, browser_state: BrowserState) -> None:
        self._browser_state = browser_state
        with fold(browser_state, "Picture and colours", "palette") as self.element:
            self.element.on_value_change(self._on_fold)
            self._add_tools()
            self._add_rename_dialog()
            with ui.row().classes("w-full gap-2 items-center"):
                self._undo = ui.button("Undo", icon="undo", on_click=self.undo).props(
                    "flat dense no-caps"
                )
                self._pause = ui.button(
                    "Pause", icon="pause_circle", on_click=self.toggle_pause
                ).props("flat dense no-caps")
            with ui.row().classes("w-full gap-2 items-center"):
                self._mask = ui.checkbox("Colour's pixels", on_change=self._update_mask)
                self._mask.props("dense aria-keyshortcuts=M")
                explain(self._mask, MASK)
                windows = ui.checkbox("Search areas", value=True, on_change=self._on_windows)
                explain(windows.props("dense"), WINDOWS)

    def _add_tools(self) -> None:
        # (A toggle takes no click on what was chosen before its last click has been answered.)
        with ui.button_group().props("unelevated").classes("tools"):
            self._tools = {
                key: ui.button(tool.name, on_click=partial(self.choose_tool, key), color=None)
                for key, tool in TOOLS.items()
            }
        self._explanation = ui.label().classes("quiet")
        self._marker_row = ui.row().classes("w-full gap-2 no-wrap items-end")
        with self._marker_row:
            self._marker = (
                ui.select([EFFECTOR, GOAL], value=EFFECTOR, with_input=True,
                          label=f"of the marker ({EFFECTOR}: the tip's), or a new name",
                          new_value_mode="add-unique")
                .classes("grow").props("dense")
                .on_value_change(self._on_marker)
            )  # fmt: skip
            self._rename = ui.button("Rename", icon="edit", on_click=self._open_dialog).props(
                "flat dense no-caps"
            )
        self.choose_tool(AIM)

    def _add_rename_dialog(self) -> None:
        with ui.dialog() as self._dialog, ui.element("div").classes("card naming"):
            self._name_field = ui.element("div")
            ui.label(
                f"The arm brings the marker named {EFFECTOR} to the one named {GOAL}."
            ).classes("quiet")
            with ui.row().classes("w-full justify-end"):
                ui.button("Leave it", on_click=self._dialog.close).props("flat no-caps")
                ui.button("Rename it", on_click=self.rename).props("unelevated no-caps")

    def _on_fold(self, event: events.ValueChangeEventArguments[Any]) -> None:
        """Select the tool Aim once the colour tools are folded away."""
        if not event.value and self._browser_state.tool in COLOUR_EDITS:
            self.choose_tool(AIM)

    def show(self, state: PageState) -> None:
        """Show the markers, and enable the possible edits."""
        marker = self._browser_state.marker
        self._undo.set_enabled(state.undoable > 0)
        self._rename.set_enabled(marker in state.markers)
        self._pause.set_visibility(not all(camera.ended for camera in state.cameras))
        names = [*dict.fromkeys([EFFECTOR, GOAL, *state.markers, marker])]
        if self._marker.options != names:
            self._marker.set_options(names)

    def choose_tool(self, chosen: str) -> None:
        """Choose a tool by its key in TOOLS; those of colours are in sight from then on."""
        self._browser_state.tool = chosen
        if chosen in COLOUR_EDITS:
            self.element.open()
        for key, button in self._tools.items():
            button.props(f"aria-pressed={'true' if key == chosen else 'false'}")
        self._explanation.set_text(TOOLS[chosen].explanation)
        self._marker_row.set_visibility(chosen != AIM)

    def toggle_pause(self) -> None:
        """Pause the images, or resume."""
        paused = self._browser_state.paused = not self._browser_state.paused
        self._pause.set_text("Go on" if paused else "Pause")
        self._pause.set_icon("play_circle" if paused else "pause_circle")

    def toggle_mask(self) -> None:
        """Show the marker's pixels, or hide them."""
        self._mask.set_value(not self._mask.value)

    async def undo(self) -> None:
        """Take back the last change of a marker."""
        browser_state = self._browser_state
        before = (
            dict(browser_state.controller.state.markers) if browser_state.controller.state else {}
        )
        await browser_state.edit(ColourCalls.undo)
        now = (await browser_state.controller.call(StatusCalls.state)).markers
        if (
            browser_state.marker in before and browser_state.marker not in now
        ):  # its name was undone
            back = next((name for name in now if name not in before), EFFECTOR)
            self._offer(back)

    def _open_dialog(self) -> None:
        marker = self._browser_state.marker
        self._name_field.clear()  # an old field that is set anew undoes what is typed meanwhile
        with self._name_field:
            self._new_name = ui.input(f"{marker} is from now on", value=marker)
            self._new_name.classes("w-full").props("autofocus").on("keydown.enter", self.rename)
        self._dialog.open()

    async def rename(self) -> None:
        """Give the chosen marker the name that was typed."""
        old, new = self._browser_state.marker, str(self._new_name.value).strip()
        if new != old:
            if not await self._browser_state.edit(ColourCalls.rename, old, new):
                return
            self._offer(new)
        self._dialog.close()

    def _offer(self, marker: str) -> None:
        """Choose a marker, which need not be among those on offer."""
        self._marker.set_options([*dict.fromkeys([*self._marker.options, marker])], value=marker)

    def _on_marker(self, event: events.ValueChangeEventArguments[Any]) -> None:
        self._browser_state.marker = str(event.value or EFFECTOR)
        self._update_mask()

    def _on_windows(self, event: events.ValueChangeEventArguments[Any]) -> None:
        self._browser_state.windows = event.value

    def _update_mask(self) -> None:
        """Ask the tracker for the chosen marker's pixels, or no longer."""
        mask = self._browser_state.mask = self._browser_state.marker if self._mask.value else ""
        for feed in self._browser_state.controller.feeds.values():
            feed.masks.pop(ui.context.client.id, None)
            if mask:
                feed.masks[ui.context.client.id] = mask
