"""Whether all gives the same bytes as before: `python tests/golden.py`; `--take` makes them anew.

For changes that are to change nothing.  On a brick that computes in no time, for what is computed
there may change its place; figures in seconds of this computer are left out.
"""

import argparse
import hashlib
import json
import os
import re
import subprocess
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path

ROOT = Path(__file__).parent.parent
FILE = Path(__file__).with_suffix(".json")
FOOTAGE = ROOT.parent / "shared" / "footage"

SCRIPTS = {
    "line": ["robot/driver.py", "line", "10,0", "5,10"],
    "rectangle in space": ["--arm", "spatial", "robot/driver.py", "rectangle", "8,-3", "12,3"],
    "circle, geared": ["--arm", "geared", "robot/driver.py", "circle", "10,4", "--radius", "3"],
    "servo": ["--scene", "", "robot/visual_servoing.py", "--mode", "stream"],
    "points of a lab": ["tests/scripts/lab2_points.py", "--file", "points.txt"],
    "homing of a lab": ["tests/scripts/lab5_homing.py"],
}
SERVO = ["bench", "servo", "--seeds", "1000:1020", "--method", "chain", "--json", "--cpu", "0"]
BENCHES = {
    "bench draw": ["bench", "draw", "--seeds", "1000:1002", "--json", "--cpu", "0"],
    "bench draw, space": [
        *("bench", "draw", "--arm", "spatial", "--seeds", "1000:1002", "--json", "--cpu", "0")
    ],
    **{f"bench servo, {arm}": [*SERVO, "--arm", arm] for arm in ("planar", "geared", "spatial")},
    **{f"bench servo, {scene}": [*SERVO, "--scene", scene] for scene in ("latency", "outliers")},
    "bench track": ["bench", "track", "--json"],
}
CLIPS = {
    "giusenso_test1.mp4": ["--effector", "ball:green"],
    "trflorian_ball2.mp4": ["--effector", "ball:green"],
}
SECONDS = ("cost", "serving", "timing")
"""Keys of a JSON of which the figures are of this computer."""

OF_THIS_RUN = (r"[\d.]+ x real time", "... x real time"), (r"127\.0\.0\.1:\d+", "127.0.0.1:PORT")
"""What a program says that is another in every run, and what is put in its place."""


def _without(value: object) -> object:
    if isinstance(value, dict):
        return {k: _without(v) for k, v in value.items() if not any(s in k for s in SECONDS)}
    return [_without(v) for v in value] if isinstance(value, list) else value


def _ran(words: list[str], folder: str) -> str:
    environment = {**os.environ, "HOME": folder, "BRICKSERVO_STATE": folder, "COLUMNS": "200"}
    done = subprocess.run(
        [sys.executable, "-m", "laptop", *words],
        cwd=ROOT, env=environment, stdin=subprocess.DEVNULL, capture_output=True, text=True,
    )  # fmt: skip
    return f"{done.returncode}\n{done.stdout}\n{done.stderr}"


def _simulated(words: list[str], folder: str) -> str:
    said = _ran(["simulate", "--plant", "cpu=0", "--no-picture", "--out", folder, *words], folder)
    files = [Path(folder) / name for name in ("trace.csv", "summary.json")]
    for pattern, instead in OF_THIS_RUN:
        said = re.sub(pattern, instead, said)
    return "\n".join([said.replace(folder, "OUT"), *(f.read_text() for f in files if f.exists())])


def _benched(words: list[str], folder: str) -> str:
    said = _ran(words, folder)
    status, _, rest = said.partition("\n")
    found, _ = json.JSONDecoder().raw_decode(rest.lstrip())
    return f"{status}\n{json.dumps(_without(found), sort_keys=True)}"


def _tracked(clip: str, words: list[str], folder: str) -> str:
    csv = Path(folder) / "seen.csv"
    clip = str(FOOTAGE / clip)
    _ran(["track", "--camera", clip, "--no-serve", "--csv", str(csv), *words], folder)
    return csv.read_text()


def works() -> dict[str, Callable[[str], str]]:
    """By name: what makes the text of one piece, given an empty folder."""
    return {
        **{n: lambda f, w=w: _simulated(w, f) for n, w in SCRIPTS.items()},
        **{c: lambda f, c=c, w=w: _tracked(c, w, f) for c, w in CLIPS.items() if FOOTAGE.exists()},
        **{n: lambda f, w=w: _benched(w, f) for n, w in BENCHES.items()},
    }


def main() -> int:
    """Compare all, or take it; the status is 1 if something differs."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--take", action="store_true", help="keep what comes out now")
    parser.add_argument("--keep", metavar="DIR", help="leave the texts there")
    parser.add_argument("only", nargs="*", help="names; all if none is said")
    args = parser.parse_args()
    golden = json.loads(FILE.read_text()) if FILE.exists() else {}
    differs = 0
    for name, work in works().items():
        if args.only and name not in args.only:
            continue
        with tempfile.TemporaryDirectory() as folder:
            text = work(folder)
        if args.keep:
            Path(args.keep, name.replace(" ", "_") + ".txt").write_text(text)
        now = hashlib.sha256(text.encode()).hexdigest()
        same = golden.get(name) == now
        differs += not same
        print(f"{name}: {'same' if same else 'taken' if args.take else 'DIFFERS'}", flush=True)
        if args.take:
            golden[name] = now
    if args.take:
        FILE.write_text(json.dumps(golden, indent=1, sort_keys=True) + "\n")
        return 0
    return int(differs > 0)


if __name__ == "__main__":
    raise SystemExit(main())
