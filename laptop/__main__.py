"""The laptop's commands: `python -m laptop demo`, `track ...`, `simulate ...`, `bench ...`."""

from __future__ import annotations

import contextlib
import errno
import json
import os
import signal
import subprocess
import sys
import tempfile
import time
import webbrowser
from collections.abc import Callable, Iterator
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import Any

if __name__ == "__main__":
    signal.signal(signal.SIGINT, signal.SIG_DFL)  # while importing there is nothing to end in order

try:
    import click

    from laptop import drawing
    from laptop.simulator import peripherals, session
    from laptop.simulator.pace import BUSY
    from laptop.simulator.plant import CONSTANTS, read_plant
    from shared.arm_description import Arm, ArmError, find_arm, read_arm
    from shared.state import state_folder
except ImportError as missing:
    sys.exit(f"laptop: {missing.name} is not installed here; run .uv/bin/uv run python -m laptop")


SERVO = Path(__file__).resolve().parent.parent / "robot" / "visual_servoing.py"
FOREVER = 1e6
"""For an emulated brick that ends with the tracker, s."""
BESIDE = """
import os, signal, sys, threading
def follow():
    sys.stdin.read()
    os.kill(os.getpid(), signal.SIGTERM)
threading.Thread(target=follow, daemon=True).start()
from laptop.__main__ import main
sys.exit(main())
"""
"""A command in a process that ends with the one that has the other end of its input."""

FREE_MOTOR = ("D=large",)
"""What is plugged in beside the arm if nothing is said, where the arm leaves the port free."""


@click.group(context_settings={"help_option_names": ["-h", "--help"]})
def laptop() -> None:
    """Everything that runs beside the brick."""


def _plants() -> str:
    return "; ".join(
        f"{key} ({constant.default if constant.default is not None else 'not given'}"
        f"{' ' + constant.unit if constant.unit else ''}): {constant.meaning}"
        for key, constant in CONSTANTS.items()
    )


ON_THE_BRICK = click.option(
    "--arm",
    "arm_file",
    default="planar",
    envvar="BRICKSERVO_ARM",
    show_default=True,
    show_envvar=True,
    metavar="FILE",
    help="Arm on the emulated brick: planar, geared, spatial or a file.",
)


def on_the_page(command: Callable[..., None]) -> Callable[..., None]:
    """Options of a command that serves the page."""
    for option in (
        click.option("--open", "open", is_flag=True, help="Open what is to be seen in a browser."),
        click.option(
            "--page-host",
            default="127.0.0.1",
            metavar="H",
            show_default=True,
            help="Address at which the page is to be had; 0.0.0.0 for the whole network.",
        ),
        click.option(
            "--page-port",
            type=click.IntRange(0, 65535),
            metavar="P",
            help="Of the page, 0 for any.  [default: 7780, or any if that is taken]",
        ),
    ):
        command = option(command)
    return command


@laptop.command(
    context_settings={"ignore_unknown_options": True, "allow_interspersed_args": False},
    epilog=f"Plant constants: {_plants()}.",
)
@ON_THE_BRICK
@click.option("--plant", "plant_text", default="", metavar="KEY=VALUE,...", help="See below.")
@click.option(
    "--out", default="out", metavar="DIR", type=click.Path(path_type=Path), show_default=True
)
@click.option("--realtime", is_flag=True, help="Keep pace with the clock on the wall.")
@click.option(
    "--press",
    "presses",
    multiple=True,
    metavar="BUTTON@S",
    help="Press a brick button (or touch) at a time, e.g. enter@2.0; several times if needed.",
)
@click.option(
    "--fault",
    "faults",
    multiple=True,
    metavar="KIND[:WHAT]@S",
    help="Let something go wrong: "
    + ", ".join(kind + (f":{what}" if what else "") for kind, what in session.FAULTS.items()),
)
@click.option(
    "--start",
    default="home",
    show_default=True,
    metavar="POSE",
    help="home: parked there, zero known; lost: never homed; or one angle per joint in degrees.",
)
@click.option(
    "--plug",
    multiple=True,
    metavar="PORT=KIND",
    default=FREE_MOTOR,
    show_default=True,
    help="A motor (large or medium) that moves nothing; at the pen's port it replaces the pen.",
)
@click.option("--timeout", default=600.0, show_default=True, help="Virtual seconds allowed.")
@click.option(
    "--scene",
    metavar="KEY=VALUE,...",
    help="Let a synthetic camera watch ('' for the usual one) and a tracker serve what it sees, in "
    "virtual time; the script finds it as one that it remembers.",
)
@click.argument("script", type=click.Path(exists=True, dir_okay=False))
@click.argument("args", nargs=-1, type=click.UNPROCESSED)
def simulate(
    arm_file: str,
    plant_text: str,
    out: Path,
    realtime: bool,
    presses: tuple[str, ...],
    faults: tuple[str, ...],
    start: str,
    plug: tuple[str, ...],
    timeout: float,
    scene: str | None,
    script: str,
    args: tuple[str, ...],
) -> None:
    """Run any ev3dev2 SCRIPT, unmodified, on an emulated brick; its exit status is the script's.

    Leaves trace.csv, picture.png and summary.json in the folder given by --out.  Options go before
    SCRIPT.  Every run is a brick of its own: what one run homes, the next does not know.
    """
    try:
        arm = read_arm(find_arm(arm_file))
        orders = {
            "plant": read_plant(plant_text),
            "faults": [session.read_fault(text) for text in faults],
            "presses": [peripherals.read_press(text) for text in presses],
            "extra": _plugged(arm, plug),
            "start": start,
            "realtime": realtime,
            "timeout": timeout,
            "watched": None if scene is None else _watched(scene, arm, realtime),
        }
        _check_room(out)
        began = time.perf_counter()
        run = session.run(arm, script, args, **orders)
        took = time.perf_counter() - began
        # Without a pen motor all of the motion is ink, and none of it belongs to one path.
        wanted = run.wanted if arm.pen else []
        measures = drawing.measure(run.record, wanted)
    except ArmError as error:
        raise click.ClickException(str(error)) from None
    except OSError as error:
        raise click.ClickException(f"{error.strerror}: {error.filename}; make room there") from None
    summary = _summary(script, args, arm, plant_text, run, measures)
    click.echo(_report(summary, took))
    try:
        _write(out, arm, run, wanted, measures, summary)
    except OSError as error:
        raise _no_room(out, error) from None
    click.echo(f"{out}/picture.png, trace.csv, summary.json")
    sys.exit(run.outcome.status)


def _watched(text: str, arm: Arm, realtime: bool) -> Callable[[Any], Any]:
    """What serves a brick in virtual time with what the tracker finds in rendered frames."""
    if realtime:
        raise session.BadOrder(
            "a scene is for virtual time; with --realtime, run track --camera synthetic beside it"
        )
    from laptop.simulator.scene import Scene, cameras, read_scene  # OpenCV is slow to import
    from laptop.simulator.sight import rendered
    from laptop.simulator.virtual_tracker import VirtualTracker

    scenes = {
        name: Scene(arm, {**read_scene(text, name), "fps_wander": 0.0})
        for name in cameras(arm, text)
    }
    chain = {key: scenes["A"].constants[key] for key in ("fps", "jitter", "delay", "seed")}
    for name, scene in scenes.items():
        for key, value in chain.items():
            if scene.constants[key] != value:
                raise session.BadOrder(
                    f"scene {name}.{key}: cameras in virtual time share it; write {key}=VALUE"
                )
    latency = chain.pop("delay")

    def watch(brick: Any) -> Any:
        see = rendered(scenes, brick)
        return VirtualTracker(brick.world, see, latency=latency, cameras=list(scenes), **chain)

    return watch


def _plugged(arm: Arm, plugs: tuple[str, ...]) -> dict[str, str]:
    """Port -> kind of the motors beside the arm's."""
    joints = {joint.port for joint in arm.joints}
    extra: dict[str, str] = {}
    for text in plugs:
        port, _, kind = text.partition("=")
        if port not in tuple("ABCD") or kind not in ("large", "medium"):
            raise session.BadOrder(
                f"plug '{text}': write PORT=KIND with a port from A to D and large or medium"
            )
        if plugs == FREE_MOTOR:
            # Ordered by nobody, it gives way to whatever the arm has there.
            if port not in joints | ({arm.pen.port} if arm.pen else set()):
                extra[port] = kind
        elif port in joints or port in extra:
            raise session.BadOrder(f"plug '{text}': port {port} is taken; choose another one")
        else:
            extra[port] = kind
    return extra


def _check_room(out: Path) -> None:
    """Refuse a folder that cannot take the results before anything runs."""
    try:
        out.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=out) as file:
            file.write(bytes(1 << 20))
            file.flush()
    except OSError as error:
        raise _no_room(out, error) from None


def _no_room(out: Path, error: OSError) -> click.ClickException:
    advice = "make room or " if error.errno == errno.ENOSPC else ""
    return click.ClickException(
        f"cannot write to {out}: {error.strerror}; {advice}choose another folder with --out"
    )


def _write(
    out: Path,
    arm: Arm,
    run: session.Run,
    wanted: list,
    measures: list[drawing.Measure | None],
    summary: dict,
) -> None:
    """All three files, each whole or not at all."""
    title = " ".join([summary["script"], *summary["args"]])
    notes = f"{arm.name} arm, true tip of the emulated arm"

    def draw(file: str, axes: str = "xy") -> None:
        from laptop import picture  # matplotlib is slow to import; every other answer is quicker

        picture.draw_picture(
            file, run.record, wanted, measures, run.skeleton, run.reach, title, notes, axes
        )

    from_the_side = [("picture-side.png", lambda file: draw(file, "xz"))]
    for name, write in (
        ("trace.csv", lambda file: drawing.write_trace(file, run.record)),
        ("summary.json", lambda file: Path(file).write_text(json.dumps(summary, indent=1) + "\n")),
        *(from_the_side if run.record and run.record[0].z is not None else []),
        ("picture.png", draw),
    ):
        draft = out / f".{name}.part"
        try:
            write(str(draft))
            os.replace(draft, out / name)
        finally:
            draft.unlink(missing_ok=True)


def _summary(
    script: str,
    args: tuple[str, ...],
    arm: Arm,
    plant: str,
    run: session.Run,
    measures: list[drawing.Measure | None],
) -> dict:
    return {
        "script": script,
        "args": list(args),
        "arm": arm.name,
        "plant": plant,
        "status": run.outcome.status,
        "reason": run.outcome.reason,
        "seconds": round(run.outcome.t, 6),
        "pace": run.pace and round(run.pace, 3),
        "accesses": run.outcome.accesses,
        "motors": run.motors,
        "paths": [measure and measure.as_dict() for measure in measures],
        "unmeasured": len(run.wanted) - len(measures),
    }


def _report(summary: dict, took: float) -> str:
    """A short summary for people."""
    pace = summary["pace"]
    speed = f"{summary['seconds'] / took:.0f}" if pace is None else f"{pace:.2f}"
    lines = [
        f"{summary['reason']}, status {summary['status']}, after {summary['seconds']:.2f} s on the "
        f"emulated brick ({summary['accesses']} accesses; {speed} x real time)"
    ]
    if pace is not None and pace < BUSY:
        lines.append("this computer was busy, so the emulated clock went slower than real time")
    for number, path in enumerate(summary["paths"], 1):
        lines.append(
            f"path {number}: not drawn"
            if path is None
            else f"path {number}: {path['length_cm']:.1f} cm in {path['seconds']:.1f} s, off by "
            f"{path['greatest_mm']:.2f} mm at most and {path['rms_mm']:.2f} mm rms, "
            f"{path['end_mm']:.2f} mm at its end"
        )
    if summary["unmeasured"]:
        lines.append(
            "the arm has no pen motor: all of its motion is ink, the paths are not measured"
        )
    driven = [port for port, motor in summary["motors"].items() if motor["driven"]]
    modes = ", ".join(f"{port} {motor['mode']}" for port, motor in summary["motors"].items())
    lines.append(f"STILL DRIVEN: {', '.join(driven)} ({modes})" if driven else f"motors: {modes}")
    return "\n".join(lines)


@laptop.command()
@ON_THE_BRICK
@click.option(
    "--seed",
    type=click.IntRange(0, 2**31 - 1),
    default=0,
    show_default=True,
    help="Draws where the camera stands, what lies about and where the goals are.",
)
@click.option(
    "--out", default="runs", metavar="DIR", type=click.Path(path_type=Path), show_default=True
)
@click.option(
    "--page/--no-page",
    default=True,
    help="Serve a web page to watch from, and to stop the arm (default); its address is printed.",
)
@on_the_page
def demo(arm_file: str, **orders: Any) -> None:
    """Show everything without brick or camera: draw three lines, then reach three goals by sight.

    The programs of the brick run unmodified and in real time, linked to the tracker by TCP; one
    camera watches, or two where --arm spatial moves in space.  Leaves a report and all raw files in
    a folder of its own under --out.  Its exit status is 0 only if the arm truly got everywhere,
    whatever the brick says.
    """
    from rich.console import Console

    from laptop import demo as show_off  # OpenCV and matplotlib are slow to import

    try:
        status, report = show_off.run(show_off.Orders(arm=arm_file, **orders), Console())
    except ArmError as error:
        raise click.ClickException(str(error)) from None
    if orders["open"]:
        webbrowser.open(report.as_uri())
    sys.exit(status)


@laptop.command()
@click.option(
    "--camera",
    multiple=True,
    default=("0",),
    show_default=True,
    metavar="SOURCE",
    help="A webcam's number, a video file, a folder of pictures, a stream (http://, rtsp://) or "
    "synthetic; several times for several cameras, A, B, ...",
)
@click.option(
    "--effector",
    metavar="SPEC",
    help="The arm's marker: [disc:|ball:]COLOUR, aruco:ID, or a markers file.",
)
@click.option(
    "--goal",
    multiple=True,
    metavar="SPEC|[A:]U,V",
    help="The goal's marker, or a fixed point in px (one for each camera, A:U,V, B:U,V, ...).",
)
@click.option(
    "--pick",
    multiple=True,
    metavar="NAME=U,V@FRAME",
    help="Learn a marker's colour where it is in a frame of the first camera, or from a rectangle, "
    "NAME=U0,V0,U1,V1@FRAME; it is kept in the markers file.  --effector ball (or disc) beside it "
    "says the kind.",
)
@click.option(
    "--markers",
    type=click.Path(dir_okay=False, path_type=Path),
    metavar="FILE",
    help="The markers file; all of its markers are tracked.  "
    "[default: effector and goal of ~/.brickservo/markers.ini]",
)
@click.option(
    "--scene",
    default="",
    metavar="KEY=VALUE,...",
    help="Of the synthetic cameras; B.KEY=VALUE is for camera B alone.",
)
@click.option(
    "--csv",
    type=click.Path(dir_okay=False, path_type=Path),
    metavar="FILE",
    help="One row per frame and marker: frame,t,marker,u,v,confidence; of several cameras with "
    "another column, camera.",
)
@click.option(
    "--serve/--no-serve",
    default=True,
    help="Serve the brick (default); without it, files are gone through as fast as possible.",
)
@click.option("--host", default="", metavar="H", help="Address to listen at.  [default: all]")
@click.option(
    "--port",
    type=click.IntRange(0, 65535),
    metavar="P",
    help="Port to listen at, 0 for any.  [default: 7711]",
)
@click.option(
    "--fps",
    type=click.FloatRange(0.1, 1000),
    metavar="F",
    help="Asked of a webcam; the pace of files instead of their own.",
)
@click.option("--size", metavar="WxH", help="Asked of a webcam, px.  [default: 640x480]")
@click.option(
    "--picture",
    metavar="FILE.png[@FRAME]",
    help="Write the tracker's view of a frame (the last one if not said); of several cameras "
    "FILE-A.png, FILE-B.png, ...",
)
@click.option(
    "--page/--no-page",
    default=None,
    help="Serve a web page to watch, pick, aim and stop from; its address is printed.  "
    "[default: with --serve]",
)
@on_the_page
@click.option(
    "--brick/--no-brick",
    default=True,
    help="Before a synthetic camera, an emulated brick comes when the page is first opened and "
    "none has called (default).",
)
def track(page: bool | None, brick: bool, **orders: Any) -> None:
    """Find the markers in every frame, and serve the brick.

    Ends with the last video, once nobody has the page open, or by Ctrl-C.
    """
    from laptop import track as tracking  # OpenCV is slow to import

    shown = orders["serve"] if page is None else page
    # The page brings an emulated brick along; its arm is there from the beginning.
    usual = "spatial" if shown and orders["camera"].count("synthetic") > 1 else "planar"
    arm = os.environ.get("BRICKSERVO_ARM", usual)
    if orders["open"] and not shown:
        raise click.UsageError("--open opens the page; leave --no-page out.")
    try:
        status = tracking.command(
            tracking.Orders(page=shown, **orders),
            partial(_synthetic, arm),
            own_brick=partial(_own_brick, arm) if brick else None,
        )
    except ArmError as error:
        raise click.ClickException(str(error)) from None
    sys.exit(status)


@contextlib.contextmanager
def _own_brick(arm: str, place: str, code: str) -> Iterator[Callable[[], str]]:
    """An emulated brick that waits for orders; its lines go to its folder in the state folder.

    Gives what tells why it has ended, "" as long as it has not.
    """
    home = Path(state_folder()) / "emulated-brick"
    home.mkdir(parents=True, exist_ok=True)
    words = ["simulate", "--realtime", "--timeout", f"{FOREVER:g}", "--arm", arm]
    words += ["--out", str(home), str(SERVO), place, "--code", code, "--arm", arm, "--wait"]
    with open(home / "lines.txt", "wb") as lines:
        brick = subprocess.Popen(
            [sys.executable, "-c", BESIDE, *words],
            cwd=SERVO.parent.parent,
            stdin=subprocess.PIPE,
            stdout=lines,
            stderr=subprocess.STDOUT,
            start_new_session=True,  # Ctrl-C is the tracker's, who then ends this
        )

    def why() -> str:
        if brick.poll() is None:
            return ""
        return f"the emulated brick has ended; what it said is in {home / 'lines.txt'}"

    try:
        yield why
    finally:
        brick.terminate()
        try:
            brick.wait(5.0)
        except subprocess.TimeoutExpired:
            brick.kill()
        brick.communicate()


def _synthetic(arm: str, name: str, scene: str, fps: float | None) -> tuple[Any, dict[str, str]]:
    """The synthetic camera of this name, and how the markers in its scene look."""
    from laptop.simulator.sight import looks
    from laptop.simulator.synthetic_camera import open_live

    text = ",".join([*([scene] if scene else []), *([f"fps={fps}"] if fps else [])])
    camera = open_live(text, camera=name, resting=arm)
    return camera, looks(camera.constants)


@laptop.command()
@click.option("--size", default=20.0, metavar="MM", show_default=True, help="Of a disc, mm.")
@click.argument("file", default="markers.pdf", type=click.Path(dir_okay=False, path_type=Path))
def markers(size: float, file: Path) -> None:
    """Make a page of markers to print: FILE is .pdf (markers.pdf if not said), .svg or .png."""
    from laptop.marker_sheet import write_sheet

    try:
        write_sheet(file, size)
    except ArmError as error:
        raise click.ClickException(str(error)) from None
    click.echo(f"{file}: print it at 100 %")


@laptop.group()
def bench() -> None:
    """Measure against the reference method and the physical limit, on the emulated brick."""


class _Seeds(click.ParamType):
    name = "A:B"

    def convert(
        self, value: str, param: click.Parameter | None, ctx: click.Context | None
    ) -> range:
        try:
            first, last = (int(part) for part in value.split(":"))
        except ValueError:
            self.fail(f"'{value}' is not A:B, two whole numbers like 1000:1020")
        if not 0 <= first < last:
            self.fail(f"'{value}' holds no seed: A must be from 0 and below B")
        return range(first, last)


@bench.command("draw")
@click.option(
    "--seeds",
    type=_Seeds(),
    default="1000:1020",
    show_default=True,
    help="Random plants and lines.",
)
@click.option(
    "--arm",
    type=click.Choice(["planar", "spatial"]),
    default="planar",
    show_default=True,
    help="planar: in direct drive and geared; spatial: what gravity does, and the preload.",
)
@click.option("--json", "as_json", is_flag=True, help="Every line's figures instead of the table.")
def bench_draw(seeds: range, arm: str, as_json: bool) -> None:
    """Straightness of lines: smooth and steps, beside the encoders' floor."""
    from laptop.bench import draw, show  # what else a command needs is slow to import

    in_space = arm == "spatial"
    drawings = draw.space_cases(seeds) if in_space else list(draw.cases(seeds))
    results = list(show.progress(draw.run(drawings), len(drawings), "drawing"))
    if as_json:
        click.echo(json.dumps([asdict(result) for result in results], indent=1))
    else:
        title = f"seeds {seeds.start}:{seeds.stop}, figures from the emulator, lengths in mm"
        if in_space:
            title += "; greatest deviations"
            show.table(title, draw.SPACE_HEADINGS, draw.space_table(results), sections=1)
            sags = [f"{draw.sag(weight):.2f} mm" for weight in ("not fed forward", "felt", "off")]
            click.echo(
                "the level line hangs through by {}; with the weight fed forward {}; without "
                "gravity {}".format(*sags)
            )
        else:
            show.table(title, draw.HEADINGS, draw.table(results), sections=3)
        for reason, count in draw.failures(results).items():
            click.echo(f"{count} x {reason}")


@bench.command("track")
@click.option(
    "--seeds",
    type=_Seeds(),
    default="4000:4002",
    show_default=True,
    help="Noise, places, scenes and motions.",
)
@click.option("--json", "as_json", is_flag=True, help="All figures instead of the tables.")
def bench_track(seeds: range, as_json: bool) -> None:
    """The tracker's precision, hold under changing light, and cost, beside the usual recipes."""
    from laptop.bench import show, track

    todo = track.cases(seeds)
    parts = show.progress(track.run(todo), len(todo), "tracking")
    results = track.gathered(result for part in parts for result in part)
    timed = track.costs(show.progress(range(track.TURNS), track.TURNS, "timing"))
    link = track.serving()
    if as_json:
        click.echo(json.dumps({**track.figures(results, timed), "serving": link}, indent=1))
        return
    title = f"seeds {seeds.start}:{seeds.stop}, figures from the emulator"
    precision, light = track.precision_table(results), track.light_table(results)
    show.table(f"Precision, px rms per axis; {title}", track.PRECISION_HEADINGS, precision, 0)
    show.table(f"Light and scene, px; {title}", track.LIGHT_HEADINGS, light, 0)
    show.table("Cost, measured on this machine", track.COST_HEADINGS, track.cost_table(timed), 0)
    click.echo(f"serving the brick 60 times a second: {100 * link:.1f} % of a core")
    for line in track.errors(results):
        click.echo(line)


@bench.command("servo")
@click.option(
    "--seeds",
    type=_Seeds(),
    default="1000:1050",
    show_default=True,
    help="Random arms, cameras, starts and goals; those of a release are 1000:1600.",
)
@click.option(
    "--scene",
    type=click.Choice(("nominal", "outliers", "lego", "precise", "latency", "moving")),
    default="nominal",
    show_default=True,
    help="Or 10 % outliers, the LEGO stress, 2 px, late pictures, a goal that moves.",
)
@click.option(
    "--arm",
    "arms",
    multiple=True,
    type=click.Choice(("planar", "geared", "spatial")),
    help="Several times for several.  [default: planar, geared]",
)
@click.option(
    "--rows",
    type=click.Choice(("stereo", "xyz")),
    default="stereo",
    show_default=True,
    help="Of two cameras: u and v of both, or of the second one row.",
)
@click.option(
    "--method",
    "methods",
    multiple=True,
    type=click.Choice(("report", "report, median", "broyden", "kalman", "chain", "oracle")),
    help="Several times for several.  [default: those that the scene is about]",
)
@click.option("--rendered", is_flag=True, help="Through rendered frames and the tracker.")
@click.option("--json", "as_json", is_flag=True, help="Every run instead of the table.")
def bench_servo(
    seeds: range,
    scene: str,
    arms: tuple[str, ...],
    rows: str,
    methods: tuple[str, ...],
    rendered: bool,
    as_json: bool,
) -> None:
    """Servoing from random starts to random goals, beside the report's method and an oracle."""
    from laptop.bench import servo, show

    if scene == "moving" and "spatial" in arms:
        raise click.ClickException(
            "--scene moving: its goals run round in the plane; take another with --arm spatial"
        )
    if rendered and scene not in servo.RENDERED:
        raise click.ClickException(
            f"--scene {scene} is made of points with noise; with --rendered take one of "
            f"{', '.join(servo.RENDERED)}"
        )
    arms = arms or servo.ARMS
    orders = seeds, scene, arms, methods, rendered, rows
    parts = show.progress(servo.run(*orders), servo.count(*orders), "servoing")
    results = [result for part in parts for result in part]
    if as_json:
        click.echo(json.dumps([asdict(result) for result in results], indent=1))
        return
    headings = servo.MOVING_HEADINGS if scene == "moving" else servo.HEADINGS
    title = f"seeds {seeds.start}:{seeds.stop}, figures from the emulator; {servo.LEGEND}"
    show.table(title, headings, servo.table(results), sections=2)
    for line in [*servo.failures(results), servo.step_cost(arms[0])]:
        click.echo(line)


@bench.command("page")
@click.option(
    "--seeds", type=_Seeds(), default="1000:1004", show_default=True, help="Cameras and goals."
)
@click.option("--json", "as_json", is_flag=True, help="All figures instead of the table.")
def bench_page(seeds: range, as_json: bool) -> None:
    """What it matters how many look at the page: tracking, servoing, and how late they see."""
    from laptop.bench import page, show

    try:
        todo = len(seeds) * len(page.CASES)
        results = list(show.progress(page.run(seeds), todo, "looking"))
    except ArmError as error:
        raise click.ClickException(str(error)) from None
    if as_json:
        click.echo(json.dumps([asdict(result) for result in results], indent=1))
        return
    title = (
        f"seeds {seeds.start}:{seeds.stop}; camera, brick and browsers on one machine, "
        f"{os.cpu_count()} cores; figures from the emulator, in real time"
    )
    show.table(title, page.HEADINGS, page.table(results), sections=0)
    for line in page.failures(results):
        click.echo(line)


@bench.command("limits")
def bench_limits() -> None:
    """Where straightness ends: the planar arm's three lines on plants farther and farther off."""
    from laptop.bench import draw, show

    drawings = draw.limit_cases()
    results = list(show.progress(draw.run(drawings), len(drawings), "drawing"))
    title = "planar arm, smooth, greatest deviation in floors; figures from the emulator"
    show.table(title, draw.LIMIT_HEADINGS, draw.limit_table(results), sections=0)


def main() -> int:
    """Run a command; every failure is one line on stderr and a status of its own."""
    if signal.getsignal(signal.SIGINT) is signal.SIG_DFL:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        laptop(prog_name="python -m laptop", standalone_mode=False)
    except click.exceptions.NoArgsIsHelpError as error:
        click.echo(error.format_message(), err=True)
        return error.exit_code
    except click.UsageError as error:
        where = error.ctx.command_path if error.ctx else "python -m laptop"
        click.echo(f"laptop: {error.format_message()} See {where} --help.", err=True)
        return error.exit_code
    except click.ClickException as error:
        click.echo(f"laptop: {error.format_message()}", err=True)
        return error.exit_code
    except BrokenPipeError:
        # Whoever read along has seen enough; the interpreter must not try to flush the rest.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 141
    except OSError as error:
        click.echo(f"laptop: {error.strerror}: {error.filename or 'the output'}", err=True)
        return 1
    except click.Abort:
        click.echo("laptop: stopped", err=True)
        return 130
    return 0


if __name__ == "__main__":
    sys.exit(main())
