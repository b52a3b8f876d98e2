"""Parts of cards: their frame, their heading, what folds away, and words explained."""

from __future__ import annotations

from typing import Any

from nicegui import events, ui

from laptop.page.cards.browser_state import BrowserState

TOUCH_DELAY = 100
"""Delay after a touch before an explanation is shown again, ms."""


def card(title: str) -> ui.element:
    """Add a card, to be filled by `with`.

    Args:
        title: by which it is announced to who does not see it.
    """
    return ui.element("section").classes("card").props(f'aria-label="{title.lower()}"')


def heading(title: str) -> None:
    """Add the heading of a card, for who does not see it: a tab or a fold shows it otherwise."""
    ui.html(title, sanitize=False, tag="h2").classes("unseen")


def fold(browser_state: BrowserState, title: str, icon: str, is_open: bool = False) -> ui.expansion:
    """Add a card that folds away, to be filled by `with`; it is as it was left when loaded anew.

    Args:
        browser_state: the browser's choices, which store whether it is open.
        title: stands above it.
        icon: beside the title.
        is_open: at first.
    """

    def on_change(event: events.ValueChangeEventArguments[Any]) -> None:
        browser_state.folds[title] = bool(event.value)

    is_open = browser_state.folds.get(title, is_open)
    made = ui.expansion(title, icon=icon, value=is_open, on_value_change=on_change)
    made.props("dense").classes("card fold")
    return made


def explain(element: ui.element, text: str) -> None:
    """Show an explanation at an element while the mouse or the focus is there, or once touched."""
    with element:
        tip = ui.tooltip(text).classes("tip")
        tip.props("anchor='top middle' self='bottom middle'")  # what one presses lies below
    show, hide = (f'runMethod({tip.id}, "{what}", [])' for what in ("show", "hide"))
    element.on("focusin", js_handler=f"() => {show}")
    element.on("focusout", js_handler=f"() => {hide}")
    # By default it closes when the touch ends; keep it open until the next touch.
    element.on("click", js_handler=f"() => setTimeout(() => {show}, {TOUCH_DELAY})")


def term(text: str, explanation: str) -> ui.label:
    """Add an everyday term whose tooltip gives the field's own term.

    Args:
        text: the everyday term, shown.
        explanation: with the field's own term.

    Returns:
        The label.
    """
    button = ui.element("button").classes("term")
    button.props["type"] = "button"
    button.props["aria-description"] = explanation
    with button:
        shown = ui.label(text)
    explain(button, explanation)
    return shown
