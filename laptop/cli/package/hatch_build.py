"""How the wheel is made: where the three folders lie, and what an index shows of it."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface
from hatchling.metadata.plugin.interface import MetadataHookInterface

LINK = re.compile(r"(!?)(\[[^\]]*\])\((?!https?:|#)([^)\s]+)\)")
"""A link of the README that leads to a file beside it."""


class WheelHook(BuildHookInterface[Any]):
    """Adds the package `brickservo` to a wheel; one that stands for a checkout links to it."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Take part in the making of a wheel: a "standard" or an "editable" one."""
        if version == "standard":
            build_data["force_include"][f"{self.root}/laptop/cli/package/brickservo"] = "brickservo"


class IndexHook(MetadataHookInterface):
    """Adds the README as an index shows it, and the project's addresses if it has a home."""

    def update(self, metadata: dict[str, Any]) -> None:
        """Complete the metadata of pyproject.toml."""
        homepage = self.config.get("home", "").rstrip("/")
        text = Path(self.root, "README.md").read_text(encoding="utf-8")
        metadata["readme"] = {"content-type": "text/markdown", "text": on_an_index(text, homepage)}
        if homepage:
            metadata["urls"] = {"Source": homepage, "Issues": f"{homepage}/issues"}


def on_an_index(text: str, homepage: str) -> str:
    """Return a README whose pictures and links are found from elsewhere, too.

    Args:
        text: of the README.
        homepage: address of the repository; "": pictures are left out, and links are their words.
    """

    def found(link: re.Match[str]) -> str:
        picture, alt_text, file = link.groups()
        if not homepage:
            return "" if picture else alt_text[1:-1]
        return f"{picture}{alt_text}({homepage}/{'raw' if picture else 'blob'}/main/{file})"

    return LINK.sub(found, text)
