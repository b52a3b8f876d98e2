"""The frame of a card and its heading."""

from __future__ import annotations

from nicegui import ui


def card(title: str, later: bool = False) -> ui.element:
    """Add a card, to be filled by `with`.

    Args:
        title: by which it is announced to who does not see it.
        later: on a narrow page it stands below the others.
    """
    classes = "card later" if later else "card"
    return ui.element("section").classes(classes).props(f'aria-label="{title.lower()}"')


def heading(title: str) -> None:
    """Add the heading of a card."""
    ui.html(title, sanitize=False, tag="h2")
