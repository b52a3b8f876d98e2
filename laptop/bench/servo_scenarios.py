"""What the servoing bench may be asked for: its arms, methods and scenarios.

The command line offers them: nothing that is slow to import belongs here.
"""

from __future__ import annotations

from dataclasses import dataclass

from shared import run_options

ARMS = ("planar", "geared")
"""Those of the plane, of which the scenes' figures are told; an arm in space is asked for."""

BASELINE = "report"
"""The lab report's method, beside which the others stand."""

METHODS = (
    BASELINE,
    f"{BASELINE}, median",
    *(method for method in run_options.METHODS if method != BASELINE),
    "oracle",
)
DEFAULT = "chain"


@dataclass(frozen=True)
class ServoScenario:
    """Ranges from which a set-up is drawn, and the task."""

    tolerance: float = 5.0
    sigma: float = 1.0
    outliers: float = 0.0
    latency: float = 0.06
    jitter: float = 0.0
    drops: float = 0.0
    tilt: float = 55.0
    bend: tuple[float, float] = (20.0, 125.0)
    turn: float = 85.0
    speed: float = 0.0
    mode: str = "look"


SCENARIOS = {
    "nominal": [("", ServoScenario())],
    "outliers": [("10 % outliers", ServoScenario(outliers=0.1))],
    "lego": [
        (
            "LEGO stress",
            ServoScenario(
                tolerance=8.0, sigma=2.0, outliers=0.05, tilt=70.0, bend=(5.0, 138.0), turn=92.0
            ),
        )
    ],
    "precise": [("2 px", ServoScenario(tolerance=2.0))],
    "latency": [
        (
            f"stream, {1000 * t:.0f} ms",
            ServoScenario(latency=t, jitter=0.02, drops=0.05, mode="stream"),
        )
        for t in (0.03, 0.12, 0.25, 0.4)
    ],
    "moving": [
        (f"goal at {v:.0f} px/s", ServoScenario(latency=0.12, speed=v, mode="stream"))
        for v in (10.0, 25.0, 50.0)
    ],
}
"""By name: what is asked, and of which scene."""

RENDERED = ("nominal", "precise", "latency")
"""Those that differ by more than the noise of points."""


def methods_of(name: str, rendered: bool = False) -> tuple[str, ...]:
    """Return the default methods of a scenario."""
    if rendered:
        return (DEFAULT,)
    if name == "latency":
        return DEFAULT, "oracle"
    return (BASELINE, DEFAULT, "oracle") if name == "moving" else METHODS
