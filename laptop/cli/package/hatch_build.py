"""How the wheel is made: the three folders lie in `brickservo/_house/`."""

from __future__ import annotations

from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface


class HouseHook(BuildHookInterface):
    """Adds the package `brickservo` to a wheel; one that stands for a checkout links to it."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Take part in the making of a wheel: a "standard" or an "editable" one."""
        if version == "standard":
            build_data["force_include"][f"{self.root}/laptop/cli/package/brickservo"] = "brickservo"
