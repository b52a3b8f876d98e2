"""Texts without the folders of this computer, for what people hand to others.  Pure."""

from __future__ import annotations

import os
import re

_OPTION = re.compile(r"(--?[\w-]+=)?(.*)", re.DOTALL)
_ABSOLUTE = re.compile(r"(/|~|\.\.[/\\]|[A-Za-z]:[/\\]|\\\\)")
_LETTER = r"[^\s/\\'\"<>|:;,()\[\]]"
_PATH = re.compile(
    rf"(?:file://|(?<![\w.:/\\])|(?<=[\w.])(?=[/\\]{{2}})|(?<=:)(?![/\\]{{2}}[^/\\]))"
    rf"(?:~|\.\.|[A-Za-z]:)?[/\\]+(?:{_LETTER}(?:{_LETTER}| )*[/\\]+)*({_LETTER}+)"
)
_CODE = re.compile(
    r"(?:\x1b\[|\x9b)[0-?]*[@-~]?|\x1b[@-_a-z]?"
    r"|\[[\d;]+m(?=[/\\~])"  # of which somebody has taken the first letter
)
"""Codes that steer a terminal; a path right behind one would seem to be part of a word."""


def without_folders(text: str) -> str:
    """Return a text in which each path of this computer is but its last name; codes of colour go.

    Folders may have spaces in their names, so that words between two paths may go, too.  Paths that
    begin in the folder where one is stay, and so do addresses of pages.
    """
    text = _CODE.sub(" ", text)
    match = _OPTION.fullmatch(text)
    assert match  # the pattern takes any text
    option, value = match[1] or "", match[2]
    if _ABSOLUTE.match(value) and "\n" not in value:
        head = re.split(r"[/\\]", value.rstrip("/\\"))[-1]
        if " " not in head:
            return option + head
    return _PATH.sub(r"\1", _without_home(text))


def _without_home(text: str) -> str:
    home = os.path.expanduser("~")
    if os.path.dirname(home) in ("", home):  # nobody tells it, or it is the root
        return text
    return re.sub(rf"{re.escape(home)}(?!{_LETTER})", "~", text)
