"""Selection of the markers to look for: of the command line, the markers file, or by default."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from laptop.see.markers.kinds import COLOR_KINDS
from laptop.see.markers.markers import Marker, read_spec
from laptop.see.serve.options import CAMERA_NAMES, InvalidTrackOption, Pick
from shared import messages
from shared.messages import EFFECTOR, GOAL

DEFAULT_SPECS = {EFFECTOR: "disc:red", GOAL: "disc:green"}
"""Default markers: SPEC by name."""


@dataclass(frozen=True)
class MarkerSelection:
    """Markers to look for, by where they are named.

    specs    SPEC by name, or a kind alone (a learned one's), or None
    picks    markers to learn
    known    markers by name, from the markers file
    all      True: look for every known one, not only for effector and goal
    default  SPEC by name, for those that are not given
    """

    specs: Mapping[str, str | None]
    picks: Sequence[Pick]
    known: Mapping[str, Marker]
    all: bool
    default: Mapping[str, str]

    def check(self) -> None:
        """Refuse contradictions, before any camera is opened.

        Raises:
            InvalidTrackOption: two picks of one marker, an unknown name, a colour given twice.
        """
        names = [pick.name for pick in self.picks]
        for pick in self.picks:
            if pick.name not in (*self.specs, *self.known):
                available = ", ".join(dict.fromkeys([*self.specs, *self.known]))
                raise InvalidTrackOption(
                    f"pick '{pick.name}': no marker has this name; there are {available}"
                )
            if names.count(pick.name) > 1:
                raise InvalidTrackOption(f"pick '{pick.name}' is given twice; give it once")
            spec = self.specs.get(pick.name)
            if spec and spec not in COLOR_KINDS:
                raise InvalidTrackOption(
                    f"{pick.name} '{spec}': its colour is picked; say only "
                    f"{' or '.join(COLOR_KINDS)}, or nothing"
                )
        self.markers(lambda pick: None)

    def markers(self, learned: Callable[[Pick], Marker | None]) -> list[Marker]:
        """Return the markers to look for.

        Args:
            learned: gives the marker of a pick; None: not known yet.
        """
        picks = {pick.name: pick for pick in self.picks}
        found = []
        for name in dict.fromkeys([*self.specs, *(self.known if self.all else ()), *picks]):
            if name in picks:
                marker = learned(picks[name])
            elif (spec := self.specs.get(name)) in COLOR_KINDS:
                marker = self.known.get(name)
                if marker is None or marker.color is None:
                    raise InvalidTrackOption(
                        f"{name} '{spec}': of which colour? write e.g. {spec}:green, or show it "
                        f"with --pick {name}=U,V@FRAME"
                    )
                marker = replace(marker, kind=spec)
            elif spec:
                marker = read_spec(name, spec)
            elif name in self.known:
                marker = self.known[name]
            elif name in self.default and not (name == GOAL and EFFECTOR in picks):
                marker = read_spec(name, self.default[name])
            else:
                marker = None  # only the effector was shown; or the scene has no goal
            if marker:
                found.append(marker)
        return found


def check_names(markers: Sequence[Marker], file: Path) -> None:
    """Refuse markers of a file that do not fit into an observation."""
    if len(markers) > messages.MAX_MARKERS - 1:  # one place is a fixed goal's
        raise InvalidTrackOption(
            f"{file} has {len(markers)} markers; at most {messages.MAX_MARKERS - 1} can be tracked"
        )
    for marker in markers:
        try:
            messages.encode(messages.Observation(0, CAMERA_NAMES[0], 0.0, {marker.name: None}))
        except messages.BadMessage:
            raise InvalidTrackOption(
                f"{file}: marker [{marker.name}]: rename it to 1 to 32 of A-Z a-z 0-9 _ -"
            ) from None
