"""The arms, methods and scenarios of the servoing bench.

The command line offers them: nothing that is slow to import belongs here.
"""

from __future__ import annotations

from dataclasses import dataclass

from shared import run_options
from shared.messages import Start

ARMS = ("planar", "geared")
"""Default arms, in the plane; an arm in space is asked for by name."""

BASELINE = "report"
"""Name of the lab report's method, the baseline."""

ORACLE = "oracle"
"""Name of the servo that knows the true image Jacobian."""

CLAIRVOYANT = "clairvoyant"
"""Name of the servo that is told the goal's joint angles, goes there, and looks."""

PEERS = {
    "peer-broyden": "laptop.bench.servo_peers:BROYDEN",
    "peer-kalman": "laptop.bench.servo_peers:KALMAN",
    "peer-rls": "laptop.bench.servo_peers:RLS",
    "peer-ibvs": "laptop.bench.servo_peers:IBVS",
}
"""Laws of the literature: name -> module:constant, a PeerLaw.  The one place where they are
registered."""

METHODS = (
    BASELINE,
    f"{BASELINE}, median",
    *(method for method in run_options.METHODS if method != BASELINE),
    *PEERS,
    ORACLE,
    CLAIRVOYANT,
)
DEFAULT, DEFAULT_MODE = Start().method, Start().mode
"""Name of the default method, and of the default mode."""


MOVED = "moved"
"""What happens to the cameras between two programs, of a ServoScenario."""


@dataclass(frozen=True)
class ServoScenario:
    """Ranges from which a set-up is drawn, and the task.

    tolerance  of the goal, px
    sigma      of a seen place, px
    outliers   share of them, 0 .. 1
    latency    from the picture to the brick, s
    jitter     mean of the further delay, s
    drops      share of lost frames, 0 .. 1
    tilt       greatest tilt of the camera, deg
    bend       range of the elbow's angle, deg
    turn       greatest angle of the first joint, deg
    speed      of the goal, px/s
    mode       "look" or "stream", of methods that can
    goals      number of goals, one after the other
    meanwhile  "" one program goes to all of them; "program" another one to each, which begins with
               what the last one has seen; "moved" the same, and somebody has moved the cameras
    """

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
    mode: str = DEFAULT_MODE
    goals: int = 1
    meanwhile: str = ""


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
    "goals": [("", ServoScenario(goals=3))],
    "programs": [
        ("next program", ServoScenario(goals=2, meanwhile="program")),
        ("cameras moved", ServoScenario(goals=2, meanwhile=MOVED)),
    ],
    "latency": [
        (
            f"{1000 * t:.0f} ms late",
            ServoScenario(latency=t, jitter=0.02, drops=0.05, mode="stream"),
        )
        for t in (0.03, 0.12, 0.25, 0.4)
    ],
    "moving": [
        (f"goal at {v:.0f} px/s", ServoScenario(latency=0.12, speed=v, mode="stream"))
        for v in (10.0, 25.0, 50.0)
    ],
}
"""Scenarios by name: label and ServoScenario of each condition."""

RENDERED = ("nominal", "precise", "latency")
"""Names of the scenarios that rendered pictures can show."""


def methods_of(name: str, rendered: bool = False) -> tuple[str, ...]:
    """Return the default methods of a scenario."""
    if rendered:
        return (DEFAULT,)
    if name == "programs":
        return DEFAULT, CLAIRVOYANT
    if name == "latency":
        return DEFAULT, ORACLE
    if name == "moving":
        return BASELINE, DEFAULT, ORACLE
    return tuple(method for method in METHODS if method not in PEERS)
