"""Texts without the folders of this computer, for what people hand to others.  Pure."""

from __future__ import annotations

import re
from pathlib import Path

_OPTION = re.compile(r"(--?[\w-]+=)?(.*)", re.DOTALL)
_ABSOLUTE = re.compile(r"(/|~|\.\.[/\\]|[A-Za-z]:[/\\]|\\\\)")
_LETTER = r"[^\s/\\'\"<>|:;,()\[\]]"
_PATH = re.compile(
    rf"(?:file://|(?<![\w.:/\\])|(?<=:)(?![/\\]{{2}}))(?:~|\.\.|[A-Za-z]:)?[/\\]{{1,2}}"
    rf"(?:{_LETTER}(?:{_LETTER}| )*[/\\])*({_LETTER}+)"
)


def without_folders(text: str) -> str:
    """Return a text in which each path of this computer is but its last name.

    Folders may have spaces in their names, so that words between two paths may go, too.  Paths that
    begin in the folder where one is stay, and so do addresses of pages.
    """
    match = _OPTION.fullmatch(text)
    assert match  # the pattern takes any text
    option, value = match[1] or "", match[2]
    if _ABSOLUTE.match(value) and "\n" not in value:
        head = re.split(r"[/\\]", value.rstrip("/\\"))[-1]
        if " " not in head:
            return option + head
    return _PATH.sub(r"\1", text.replace(str(Path.home()), "~"))
