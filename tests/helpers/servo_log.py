"""The log of a run of the servo, made up."""

import json

GOAL = (400.0, 300.0)
"""Of its first camera, px."""


def line(kind, t=0.0, **values):
    return json.dumps({"kind": kind, "t": t, **values}) + "\n"


def lines_of(text):
    """The lines of a log, to be changed."""
    return [json.loads(told) for told in text.splitlines()]


def text_of(lines):
    """A log of these lines."""
    return "".join(json.dumps(told) + "\n" for told in lines)


def log_text(off=2.0, verdict="converged", method="chain", cameras="A", **words):
    """What the servo writes of a run from 200 px away to `off` px, all along the first row."""
    joints = ("base", "shoulder", "elbow")[1 - len(cameras) :]
    rows = [f"{camera}.{axis}" for camera in cameras for axis in "uv"]
    n = len(joints)
    text = line(
        "run",
        version=1,
        method=method,
        mode="look",
        arm="planar",
        joints=joints,
        tolerance=5.0,
        budget=60.0,
        goal="marker",
        rows="stereo",
        clock=102.5,
    )
    for number in range(5):
        share = number / 4
        error = 200 + share * (off - 200)
        q, s = [0.1 * number] * n, [GOAL[0] - error, GOAL[1], *GOAL][: len(rows)]
        text += line("seen", number, camera="A", q=q, s=s[:2], goal=list(GOAL))
        explores = number < 2
        text += line(
            "step",
            number,
            q=q,
            rows=rows,
            s=s,
            goal=GOAL * len(cameras),
            error=error,
            sigma=0.1,
            frames=6,
            J=None if explores else [[300.0] * n] * len(rows),
            condition=None if explores else 3.5,
            model=None if explores else method,
            action="explore" if explores else "move" if number < 4 else "hold",
            q_wanted=[0.1 * number + 0.1] * n if number < 4 else None,
            computing=0.001,
        )
    text += line("note", 4.0, text=words.pop("note", "marker lost: held"))
    reason = words.pop("reason", "")
    return text + line(
        "verdict", 4.5, verdict=verdict, reason=reason, error=off, q=[0.4] * n, moves=4
    )
