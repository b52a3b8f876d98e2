"""Options that belong together reach a command as one value with a name and types."""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import fields
from typing import Any


def in_groups(**kinds: type[Any]) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """Hand a command its options group by group; it stands right above the function.

    Args:
        kinds: argument of the function -> the dataclass that it gets there.  Its fields are names
            of options.  What is a field of none comes by its own name, as without this.
    """

    def grouped(command: Callable[..., None]) -> Callable[..., None]:
        @functools.wraps(command)
        def typed(**options: Any) -> None:
            groups = {
                argument: kind(**{field.name: options.pop(field.name) for field in fields(kind)})
                for argument, kind in kinds.items()
            }
            command(**groups, **options)

        return typed

    return grouped
