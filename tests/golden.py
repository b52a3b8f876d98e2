"""What the commands say and leave, word by word: kept, and compared with what they did before.

    python tests/golden.py make DIR [NAME ...]     run all, or these, and keep it in DIR
    python tests/golden.py compare OLD NEW         name what differs; status 1 if anything does

A run in virtual time is a function of what was typed, so that a move of code may change none of it.
Figures are kept by their data, not by their pixels.
"""

from __future__ import annotations

import contextlib
import difflib
import hashlib
import json
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
DRIVER, SERVO = ROOT / "robot" / "driver.py", ROOT / "robot" / "visual_servoing.py"
LABS = ROOT / "tests" / "scripts"
TEXTS = {".json", ".csv", ".txt", ".html", ".ini", ".jsonl", ".svg", ".log", ".py", ".md"}
TIMEOUT = 1200

RUNS = {
    "line": f"simulate --out out {DRIVER} line 10,0 5,10",
    "line-space": f"simulate --out out --arm spatial {DRIVER} line 10,0,5 5,10,5",
    "fault": f"simulate --out out --plant backlash=3,seed=4 --fault unplug:A@1.5 {DRIVER} home",
    "house": "draw house --simulate --out out",
    "text": 'draw --text "Hi" --arm geared --simulate --plant seed=3 --out out',
    "learned": 'draw --line "10,0 5,10" --by-sight 2 --simulate --out out',
    "arm": "calibrate --simulate --seed 3 --out out",
    "accuracy": "accuracy --simulate --cycles 3 --out out",
    "touch": "touch --simulate --out out",
    "camera": "camera synthetic --scene board=a4,tilt=20 --out camera.json",
    "servo": f"simulate --out out --scene tilt=20 {SERVO} --goal 400,200",
    "servo-space": f"simulate --out out --arm spatial --scene B.azimuth=30 {SERVO} --rows xyz",
    "lab": f"simulate --out out {LABS / 'lab2_points.py'}",
    "wheels": (
        "simulate --out out --arm none --wheels left=B,right=C --sensor in2=gyro:robot "
        f"{LABS / 'sensor4_gyro_square.py'}"
    ),
}
AT_ONCE = {
    "line-at-once": f"simulate --out out --plant cpu=0 {DRIVER} line 10,0 5,10",
    "home-at-once": (
        f"simulate --out out --plant cpu=0,backlash=3,seed=4 --start lost {DRIVER} home"
    ),
    "seek-at-once": f"simulate --out out --arm geared --plant cpu=0,seed=4 {DRIVER} home --seek",
    "text-at-once": 'draw --text "Hi" --arm geared --simulate --plant cpu=0,seed=3 --out out',
    "servo-at-once": f"simulate --out out --plant cpu=0 --scene tilt=20 {SERVO} --goal 400,200",
    "space-at-once": (
        f"simulate --out out --arm spatial --plant cpu=0 --scene azimuth=9 {SERVO} --rows xyz"
    ),
}
"""On a brick that computes in no time: what is read when a script starts costs nothing."""
AFTERWARDS = {"report": "report . --title Golden"}
"""Of what all the runs have left."""
OTHERS = {
    "preview": "draw rose --preview rose.svg",
    "job": "draw owl --size 9 --job owl.job",
    "guide": "guide --out guide.html",
    "handouts": "guide handouts --out class",
    "markers": "markers markers.svg",
    "board": "markers --board board.svg",
}
BENCHES = {
    "bench-servo": "bench servo --seeds 1000:1002 --json",
    "bench-servo-space": "bench servo --arm spatial --method chain --seeds 1000:1001 --json",
    "bench-draw": "bench draw --seeds 1000:1001 --json",
    "bench-calibrate": "bench calibrate --seeds 0:1 --json",
    "bench-ilc": "bench ilc --seeds 1:2 --json",
    "claims-disturbances": "claims disturbances --seeds 1000:1001 --json",
    "claims-faults": "claims faults --seeds 1000:1001 --json",
    "claims-interruptions": "claims interruptions --seeds 1:2 --arm planar --json",
    "claims-jobs": "claims jobs --seeds 40000:40005 --json",
    "claims-limits": "claims limits",
    "claims-wrong-arms": "claims wrong-arms --seeds 1000:1001 --json",
    "claims-brick": "claims brick",
    "claims-camera": "claims camera --seeds 5000:5001 --json",
    "bench-accuracy": "bench accuracy --arm planar --cycles 3 --json",
    "claims-confidence": "claims confidence --seeds 7000:7001 --json",
}
REFUSALS = [
    *("simulate drivr.py", f"simulate {SERVO} --goal 400,200", "simulate", "simulat x.py"),
    *(f"simulate --plant backlsh=3 {DRIVER} home", f"simulate --plant cpu=x {DRIVER} home"),
    *(f"simulate --arm nowhere.ini {DRIVER} home", f"simulate --start 99 {DRIVER} home"),
    *(f"simulate --fault melt@1 {DRIVER} home", f"simulate --press bell@1 {DRIVER} home"),
    *(f"simulate --plug A=large {DRIVER} home", f"simulate --sensor in9=touch {DRIVER} home"),
    *(f"simulate --wheels left=B,right=C {DRIVER} home", f"simulate --timeout 0 {DRIVER} home"),
    *(f"simulate {DRIVER} line 10,0", f"simulate {DRIVER} line 40,0 5,10"),
    *(f"simulate {DRIVER} move 99,99", f"simulate --scene foo=1 {SERVO}", "draw", "draw nothing"),
    *("draw house --width 10 --simulate", "draw house --size 99 --simulate", "draw x.svg"),
    *("draw house --size 0 --simulate", "draw house --at 90,90 --simulate", "draw house --pens"),
    *("draw house --text Hi --simulate", "draw --text Hi --font comic --simulate"),
    *("draw --card moon --simulate", 'draw --line "1,1" --simulate', "draw house --speed 0"),
    *("draw house --paper a9 --simulate", "draw house --rotate x --simulate"),
    *("draw house --by-sight 99 --simulate", "draw house --preview x.gif", "draw house --scale 2"),
    *("calibrate --simulate --seed 3 --seconds 5", "calibrate a b c", "calibrate nofile.mp4"),
    *("calibrate --simulate --board-square 45", "calibrate 0 --brick", "accuracy nofile.mp4"),
    *("accuracy --simulate --cycles 1", "accuracy --simulate --place 1,2", "camera nofile.png"),
    *(
        "camera synthetic --scene tilt=999",
        "camera synthetic --bar 9",
        "touch --simulate --crosses 1",
    ),
    *(
        "markers x.doc",
        "markers --size 9999 m.svg",
        "report nowhere",
        "report .",
        "guide check no.py",
    ),
    *("guide check", "track --camera nofile.mp4 --no-serve", "track --effector mauve --no-serve"),
    *(
        "track --goal x --camera nofile.mp4",
        "track --pick a=1 --no-serve",
        "track --size 9 --no-serve",
    ),
    *("track --port 99999", "bench serv", "bench servo --seeds 5:1", "bench servo --seeds x"),
    *("bench draw --arm nowhere", "bench servo --method best", "servo", "home", "plot house"),
]
CASES = {**RUNS, **AT_ONCE, **OTHERS, **BENCHES}
LONGEST = ["claims-faults", "claims-disturbances", "bench-calibrate", "bench-ilc"]


def main() -> int:
    """Do what was typed."""
    words = sys.argv[1:]
    if words[:1] == ["make"] and len(words) > 1:
        return make(Path(words[1]).resolve(), words[2:])
    if words[:1] == ["compare"] and len(words) == 3:
        return compare(Path(words[1]), Path(words[2]))
    if words[:1] == ["run"]:  # in a process of its own: the words of one command, as JSON
        return run(json.loads(words[1]), Path(words[2]))
    if words == ["helps"]:
        return helps()
    sys.exit(__doc__)


def make(folder: Path, names: list[str]) -> int:
    """Run all cases, two at a time; tell of those that take long."""
    known = [*CASES, *AFTERWARDS, "helps", "refusals"]
    unknown = set(names) - set(known)
    if unknown:
        sys.exit(f"no {', '.join(sorted(unknown))}; there are {', '.join(known)}")
    wanted = names or known
    folder.mkdir(parents=True, exist_ok=True)
    first = sorted((name for name in wanted if name in CASES), key=lambda name: name not in LONGEST)
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        for name in pool.map(lambda name: keep(name, CASES[name], folder), first):
            print(name, flush=True)
        refused = list(enumerate(REFUSALS)) if "refusals" in wanted else []
        for _ in pool.map(lambda case: keep(f"refusal-{case[0]:02d}", case[1], folder), refused):
            pass
    if "helps" in wanted:
        keep("helps", None, folder)
    if "report" in wanted:
        keep("report", AFTERWARDS["report"], folder, *(folder / name for name in RUNS))
    return 0


def keep(name: str, line: str | None, folder: Path, *given: Path) -> str:
    """Run a command in an empty folder; keep what it says, its status and what it leaves."""
    import shlex
    import tempfile

    kept = folder / name
    shutil.rmtree(kept, ignore_errors=True)
    with tempfile.TemporaryDirectory() as empty:
        home, here = Path(empty) / "home", Path(empty) / "here"
        home.mkdir()
        here.mkdir()
        for one in given:
            shutil.copytree(one, here / one.name)
        data = Path(empty) / "figures.txt"
        words = ["helps"] if line is None else ["run", json.dumps(shlex.split(line)), str(data)]
        env = {key: value for key, value in os.environ.items() if "BRICKSERVO" not in key}
        env |= {"PYTHONHASHSEED": "0", "HOME": str(home), "COLUMNS": "100", "PYTHONPATH": str(ROOT)}
        env |= {"TERM": "dumb", "MPLCONFIGDIR": str(Path(empty) / "mpl")}
        done = subprocess.run(
            [sys.executable, __file__, *words],
            cwd=here, env=env, capture_output=True, text=True, timeout=TIMEOUT, check=False,
        )  # fmt: skip
        kept.mkdir(parents=True)
        texts = {"stdout": done.stdout, "stderr": done.stderr, "status": f"{done.returncode}\n"}
        if data.exists():
            texts["figures"] = data.read_text()
        for path in sorted((*here.rglob("*"), *home.rglob("*"))):
            inside = path.relative_to(empty)
            if path.is_file() and inside.parts[1] not in {one.name for one in given}:
                texts[str(inside)] = _text_of(path)
        for inside, text in texts.items():
            place = kept / inside
            place.parent.mkdir(parents=True, exist_ok=True)
            place.write_text(_the_same(text, empty))
    return name


def _text_of(path: Path) -> str:
    """A text whole, anything else by its name alone: pixels and archives change by themselves."""
    if path.suffix in TEXTS or not path.suffix:
        with contextlib.suppress(UnicodeDecodeError):
            return path.read_text()
    return "(not a text)\n"


def _the_same(text: str, empty: str) -> str:
    """The text without what is another each time: folders, times, pictures within a page."""
    text = text.replace(empty, "TMP").replace(str(ROOT), "ROOT")
    text = re.sub(
        r"data:[a-z]+/[a-z0-9+.-]+;base64,[A-Za-z0-9+/=]+",
        lambda found: f"data:{len(found[0]) // 10000}",
        text,
    )
    text = re.sub(r"\b(?:image|[a-z])?[0-9a-f]{10}(?=[\")])", "ID", text)  # matplotlib's, in an SVG
    text = re.sub(r"\d{4}-\d\d-\d\d[T -]\d\d:?\d\d(:?\d\d)?(\.\d+)?", "TIME", text)
    return re.sub(
        r"[\d.]+ (s|min)(?= (of this computer|ago))|(?<![\d.])(?=\d*[a-f])[0-9a-f]{16,}\b",
        "N",
        text,
    )


def run(words: list[str], data: Path) -> int:
    """Run a command in this process; the data of all figures that it saves go into a file."""
    from matplotlib.figure import Figure

    save = Figure.savefig

    def savefig(figure: Figure, *args: object, **options: object) -> None:
        with data.open("a") as file:
            file.writelines(f"{line}\n" for line in _data_of(figure))
        save(figure, *args, **options)  # type: ignore[arg-type]

    Figure.savefig = savefig  # type: ignore[method-assign, assignment]
    from laptop.cli.main import main as laptop
    from tests.claims.__main__ import PROGRAM, claims

    os.environ["BRICKSERVO_PROGRAM"] = "python -m laptop"
    sys.argv = [str(ROOT / "laptop" / "__main__.py"), *words]
    if words[0] == "claims":
        del sys.argv[1]
        return laptop(claims, PROGRAM)
    return laptop()


def _data_of(figure: object) -> Iterator[str]:
    """What a figure shows: its texts, and of each line how many points and a digest of them."""
    for axes in figure.axes:  # type: ignore[attr-defined]
        yield f"axes {axes.get_title()!r} {axes.get_xlabel()!r} {axes.get_ylabel()!r}"
        for line in axes.get_lines():
            points = line.get_xydata().round(6)
            digest = hashlib.sha256(points.tobytes()).hexdigest()[:12]
            yield f"  line {line.get_label()!r} {len(points)} {digest}"
        for group in axes.collections:
            yield f"  {type(group).__name__} {group.get_label()!r} {len(group.get_offsets())}"
        for text in axes.texts:
            yield f"  text {text.get_text()!r}"


def helps() -> int:
    """Print the help of every command."""
    import click

    from laptop.cli.main import laptop

    def walk(command: click.Command, name: str, parent: click.Context | None) -> None:
        context = click.Context(command, info_name=name, parent=parent, terminal_width=100)
        print(f"== {context.command_path}\n{command.get_help(context)}\n")
        for below in sorted(getattr(command, "commands", {})):
            walk(command.commands[below], below, context)  # type: ignore[attr-defined]

    walk(laptop, "laptop", None)
    return 0


def compare(old: Path, new: Path) -> int:
    """Name the files that differ, with the first lines of the difference; of cases in both."""
    differ = 0
    cases = {path.name for path in old.iterdir()} & {path.name for path in new.iterdir()}
    files = {
        path.relative_to(one)
        for one in (old, new)
        for case in cases
        for path in (one / case).rglob("*")
        if path.is_file()
    }
    for inside in sorted(files):
        before, after = (
            (one / inside).read_text().splitlines() if (one / inside).exists() else ["(none)"]
            for one in (old, new)
        )
        if before == after:
            continue
        differ += 1
        print(f"\n## {inside}")
        lines = list(difflib.unified_diff(before, after, "before", "after", lineterm="", n=0))[2:]
        print("\n".join(line[:160] for line in lines[:12]))
    print(f"\n{len(files)} files, {differ} differ")
    return 1 if differ else 0


if __name__ == "__main__":
    sys.exit(main())
