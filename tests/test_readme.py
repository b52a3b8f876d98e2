"""What the READMEs show works: each command, each Python snippet, each link, each option.

They are found by parsing the text: commands stand in ```sh blocks, in tables in the column
`command`, and inline where they begin as one types them.  Those for the brick run on the emulated
one.  Options are really parsed; what takes minutes runs in the form that `REDUCED` states.
"""

import importlib
import os
import re
import shlex
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from click.testing import CliRunner
from commands import parse
from lab_runs import left
from places import ROOT, SCRIPTS
from waiting import PATIENCE, until

from laptop.cli.main import laptop
from laptop.course.handouts import HANDOUTS
from laptop.emulator.device.sensor_kinds import KINDS
from laptop.emulator.device.wheels import CONSTANTS as WHEELS
from laptop.page import run_states
from laptop.see.serve import announcements
from robot import api
from shared import state
from tests.claims.__main__ import claims

MAIN = ROOT / "README.md"
READMES = [
    MAIN,
    *(
        path
        for room in ("robot", "shared", "laptop", "tests")
        for path in sorted((ROOT / room).rglob("README.md"))
    ),
]

SKIPPED = {
    "python3 -m": "it loads uv from the network",
    r"\.uv/bin/pip": "the same, where there is no pip",
    r"\.uv/bin/uv (tool|cache)": "it installs into the home, or cleans there; .ci/run installs",
    "scp": "it needs a brick",
    r"\.ci/": "it runs all tests, on several Pythons; constrain.py loads from the network",
    "--group cluster": "it needs a cluster; tests/laptop/bench/test_workers.py has one",
}
"""What is not run, by a pattern for how it begins, and why."""

REDUCED = (
    (r"KS82-DNHF-7WQM|\bCODE\b", "{code}"),  # the code of the tracker at hand
    (r"--camera \d", "--camera synthetic"),  # no webcam
    (r" --open\b", " --page"),  # no browser
    (r"--seeds (\d+):\d+", lambda seeds: f"--seeds {seeds[1]}:{int(seeds[1]) + 1}"),
    (r" --to \S+\.pdf", ""),  # no browser
    (r"--seconds \d+", "--seconds 3"),  # pairing takes one of them
    (r"(tracking_client\.py(?!.*--seconds).*)", r"\1 --seconds 3"),  # else until Ctrl-C
    (r"\bpytest\b.*", "pytest --collect-only --quiet -n 0 tests/shared/test_ini.py"),
    (r"(bench_brick\.py)(?! planar| spatial)", r"\1 planar"),  # one arm
    (r"(--realtime robot/driver\.py) .*", r"\1 where"),  # no drawing in real time
    (r"((--realtime|--arm spatial) .*visual_servoing\.py.*)", r"\1 --tolerance 100"),  # soon there
)
"""What becomes of a command before it runs: pattern and replacement, one after the other."""

UNTIL = {
    "demo": r"http://",  # the page is there
    "bench": r"\d+/\d+",  # the bar: all cases are made, and the first are worked on
    "track": r"pairing code, once: (\S+)",  # the brick may come
}
"""Commands of minutes are ended by Ctrl-C once they have said this."""

STATUS = {"--fault unplug": 1, "--wait": 130, "class check": 1}
"""Exit statuses other than 0, by what stands in the command."""

EXAMPLE = re.compile(r"demo$|bench (draw|track)$|bench servo --seeds")
"""Of `demo` and `bench` these are begun; of the others the options are parsed, no more."""

SHORTHAND = tuple(laptop.commands)
"""In a table, what begins so has `.uv/bin/uv run brickservo` in front."""

BRICK = re.compile(r"(?:robot/)?(\w+\.py)\b")
INLINE = re.compile(r"\.uv/bin/uv run (?!brickservo$)|python3 -m |robot/\w+\.py -")
PREPARES = re.compile(r"cp |.*\bbrickservo track ")
"""With such a command a block is one story; else each line stands for itself."""


# What a README holds


def blocks(text, language):
    """The bodies of the fenced blocks of a language."""
    return re.findall(rf"^```{language}\n(.*?)^```$", text, re.MULTILINE | re.DOTALL)


def prose(text):
    """The text without its fenced blocks."""
    return re.sub(r"^```.*?^```$", "", text, flags=re.MULTILINE | re.DOTALL)


def table_commands(text):
    """What stands in the columns `command` of the tables."""
    column = None
    for line in prose(text).splitlines():
        cells = [cell.strip() for cell in line.strip("| ").split("|")]
        if not line.startswith("|"):
            column = None
        elif column is None:
            column = cells.index("command") if "command" in cells else -1
        elif column >= 0 and cells[column].strip("-"):
            assert re.fullmatch(r"`[^`]+`", cells[column]), f"no command: {line}"
            yield cells[column].strip("`")


def stories(text):
    """The commands as tuples of those that belong together."""
    for block in blocks(text, "sh"):
        lines = [line for line in block.replace("\\\n", " ").splitlines() if line.strip()]
        yield from [tuple(lines)] if PREPARES.match(lines[0]) else [(line,) for line in lines]
    for command in table_commands(text):
        yield (command,)
    for code in re.findall(r"`([^`\n]+)`", prose(text)):
        if INLINE.match(code):
            yield (code,)


def plain(command):
    """A command as one types it, however short it was shown."""
    command = re.sub(r"^ssh -t robot@ev3dev\.local ", "", command)  # the brick is emulated
    command = re.sub(r"^brickservo ", ".uv/bin/uv run brickservo ", command)
    command = re.sub(r"^\.uv/bin/uv run brickservo simulate (robot/\w+\.py)", r"\1", command)
    if command.split()[0] in SHORTHAND:
        return ".uv/bin/uv run brickservo " + command
    return re.sub(r"^(\w+\.py)", r"robot/\1", command)


def test_in_powershell_the_first_commands_are_the_same():
    """Whatever the shell: uv's package comes by pip, then uv runs the same."""
    text = MAIN.read_text("utf-8")
    (others,) = blocks(text, "powershell")
    ours = blocks(text, "sh")[0]
    ours = ours.replace("python3 -m pip", "py -m pip").replace(" --target .uv", "")
    assert others == ours.replace(" && ", "; ").replace(".uv/bin/uv run", "py -m uv run")


def all_stories():
    """Each story of all READMEs once, without what is skipped."""
    found = {}
    for path in READMES:
        for story in stories(path.read_text("utf-8")):
            parts = [part for line in story for part in plain(line).split(" && ")]
            found.setdefault(tuple(part for part in parts if not is_skipped(part)), None)
    return [story for story in found if story]


def is_skipped(part):
    """Whether a command is not run."""
    return any(re.search(rf"(^|\s){start}", part) for start in SKIPPED)


def is_quick(story):
    """Whether it takes this process less than a second, and needs no other."""
    quick = r"driver\.py (where|inverse|move|home --here|line) ?|^cp "
    return all(re.search(quick, part) and "--realtime" not in part for part in story)


# How it is run


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """An empty folder in which commands run, with what a reader has by then."""
    shutil.copy(SCRIPTS / "lab1_moves.py", tmp_path / "my_lab_script.py")
    shutil.copy(ROOT / "shared" / "arms" / "geared.ini", tmp_path / "my.ini")
    left(tmp_path / "runs" / "line")
    (tmp_path / "class").mkdir()
    (line,) = (handout for handout in HANDOUTS if handout.name == "line")
    (tmp_path / "class" / line.script).write_text(line.skeleton, "utf-8")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("BRICKSERVO_STATE", str(tmp_path / "state"))
    monkeypatch.setenv("PYTHONPATH", str(ROOT))
    monkeypatch.setenv("BROWSER", "true")  # it opens nothing
    return tmp_path


class Shell:
    """Runs the parts of a story one after the other; a tracker goes on until the end.

    code, port   of the tracker
    """

    def __init__(self, folder):
        self.folder = folder
        self.code, self.port = "ABCD-EFGH-JKMN", None  # of the one in virtual time
        self.tracker = None
        self.count = 0

    def run(self, part):
        """Run one command; fails unless it ends as it should."""
        for pattern, replacement in REDUCED:
            part = re.sub(pattern, replacement, part)
        part = part.format(code=self.code)
        words = shlex.split(part, comments=True)
        if words[:2] == [".uv/bin/uv", "run"]:
            words = words[2:]
            while words[0] == "--group":
                words = words[2:]
        if words[0] == "brickservo":
            words[:1] = ["python", "-m", "laptop"]
        if BRICK.match(words[0]):
            words = ["python", "-m", "laptop", "simulate", *_for_the_brick(words), *words]
        words = [str(ROOT / w) if w.startswith(("robot/", "shared/")) else w for w in words]
        if words[0] == "pytest":
            words = ["python", "-m", *words]
        if words[0] != "python":
            subprocess.run(words, check=True)
            return
        assert words[1] == "-m", part
        if words[2] == "tests.claims":  # they take minutes; tests/claims has their parts
            parse(words[3:], claims)
        elif words[2] != "laptop":
            self._process(words[1:], 0, cwd=ROOT)
        elif words[3] in ("demo", "bench"):
            if EXAMPLE.match(part.partition(" brickservo ")[2]):
                self._until(words[3:], UNTIL[words[3]])
            else:
                parse(words[3:])
        # These need a brick, a camera, or a network; their own tests have them.
        elif words[3] in ("brick", "doctor", "bundle", "page") or (
            words[3:5] in (["measure", "pen"], ["measure", "arm"]) and "--simulate" not in words
        ):
            parse(words[3:])
        elif words[3] == "draw" and not {"--preview", "--to"} & set(words):
            parse(words[3:])  # the same; tests/laptop/cli/test_draw.py has --simulate
        elif words[3:5] == ["measure", "accuracy"]:  # minutes; tests/laptop/cli/test_accuracy.py
            parse(words[3:])
        elif words[3] == "track":
            self.close()
            self._until(words[3:], UNTIL["track"])
        else:
            self._end_to_end(words[3:], part)

    def _end_to_end(self, words, part):
        status = next((status for text, status in STATUS.items() if text in part), 0)
        if words[0] == "simulate":
            words = ["simulate", "--no-picture", *words[1:]]
            if "--constants" in words:
                self.run("robot/bench_brick.py")
        if "--realtime" in words:
            words = [f"{w}:{self.port}" if w == "127.0.0.1" else w for w in words]
            self._process(["-m", "laptop", *words], status)
            return
        result = CliRunner().invoke(laptop, words)
        if result.exception and not isinstance(result.exception, SystemExit):
            raise result.exception
        assert result.exit_code == status, result.output

    def _process(self, words, status, cwd=None):
        done = subprocess.run(
            [sys.executable, *words], cwd=cwd, stdout=subprocess.PIPE, stderr=subprocess.STDOUT
        )
        assert done.returncode == status, done.stdout.decode()

    def _until(self, words, said):
        """Start it, and wait until it has said this."""
        if words[0] == "track":
            words += ["--listen-port", "0", "--no-simulate"]
            words += [] if "--page" in words else ["--no-page"]
        if words[0] == "demo" or "--page" in words:
            words += ["--page-port", "0"]
        self.count += 1
        file = self.folder / f"said-{self.count}.txt"
        with open(file, "wb") as out:
            process = subprocess.Popen(
                [sys.executable, "-m", "laptop", *words],
                stdout=out,
                stderr=subprocess.STDOUT,
                env={**os.environ, "FORCE_COLOR": "1", "TERM": "xterm", "COLUMNS": "200"},
            )
        try:
            found = until(
                lambda: re.search(said, file.read_text("utf-8")) or process.poll() is not None,
                " ".join(words),
                lambda: time.sleep(0.05),
            )
            assert found is not True, file.read_text("utf-8")
            if words[0] == "track":
                self.tracker, self.code = (process, file), found.group(1)
                self.port = re.search(r"visual_servoing\.py :(\d+)", found.string).group(1)
            else:
                end(process, file)
        except BaseException:
            process.kill()
            process.wait()
            raise

    def close(self):
        """End the tracker."""
        if self.tracker:
            tracker, self.tracker = self.tracker, None
            end(*tracker)


def end(process, file):
    """End a process by Ctrl-C; it must say that it was stopped."""
    process.send_signal(signal.SIGINT)
    try:
        status = process.wait(PATIENCE)
    finally:
        process.kill()
        print(file.read_text("utf-8"))  # shown where a test fails
    assert status == 130


def _for_the_brick(words):
    """The options of `simulate` for a program of the brick."""
    options = []
    if "--arm" in words:
        options += ["--arm", words[words.index("--arm") + 1]]
    if BRICK.match(words[0]).group(1) in ("visual_servoing.py", "tracking_client.py"):
        options += ["--scene", ""]
    if "--camera" in words:
        options += ["--scene", "goal_x=0,goal_y=8"]
    if "--wait" in words:
        options += ["--fault", "int@2"]
    if "touch" in words:  # somebody leads the arm, and presses at two places
        options += ["--hand", "12,0@5 8,6@9"]
        for press in ("enter@7", "enter@11", "enter@15" if "--go" in words else "down@15"):
            options += ["--press", press]
    if words[-1] in ("home", "check"):  # somebody confirms, and answers, at the brick
        presses = ["enter@2", "left@10", "left@13", "right@20", "left@23"]
        for press in presses if words[-1] == "check" else presses[:1]:
            options += ["--press", press]
    return options


@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
@pytest.mark.filterwarnings("ignore:unclosed:ResourceWarning")
@pytest.mark.parametrize(
    "story",
    [
        pytest.param(story, marks=() if is_quick(story) else pytest.mark.long)
        for story in all_stories()
    ],
    ids=" && ".join,
)
def test_a_command_works(story, folder):
    shell = Shell(folder)
    try:
        for part in story:
            shell.run(part)
    finally:
        shell.close()


SNIPPETS = [
    pytest.param(
        snippet,
        id=f"{path.parent.name}-{number}",
        marks=pytest.mark.long if "TrackingClient" in snippet else (),
    )
    for path in READMES
    for number, snippet in enumerate(blocks(path.read_text("utf-8"), "python"), 1)
]


@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
@pytest.mark.filterwarnings("ignore:unclosed:ResourceWarning")
@pytest.mark.parametrize("snippet", SNIPPETS)
def test_a_snippet_works_on_the_emulated_brick(snippet, folder):
    Path("mine.py").write_text(snippet, encoding="utf-8")
    words = ["simulate", "--no-picture"]
    if "TrackingClient" in snippet:
        words += ["--scene", ""]
    endless = "while True" in snippet
    if endless:
        words += ["--fault", "int@3"]
    result = CliRunner().invoke(laptop, [*words, "mine.py"])
    assert result.exit_code == (130 if endless else 0), result.output
    assert not endless or re.search(r"^\d+\.\d+ \(", result.output, re.MULTILINE), result.output


@pytest.mark.parametrize("snippet", SNIPPETS)
def test_a_snippet_imports_from_the_api_alone(snippet):
    for line in re.findall(r"^(?:from|import) .*$", snippet, re.MULTILINE):
        found = re.fullmatch(r"from robot\.api import ([\w, ]+)", line)
        assert found, line
        assert set(found.group(1).split(", ")) <= set(api.__all__)


def test_few_commands_are_skipped_and_each_for_a_reason():
    assert len(SKIPPED) <= 8
    shown = [" && ".join(story) for path in READMES for story in stories(path.read_text("utf-8"))]
    for start in SKIPPED:
        assert any(re.search(start, plain(text)) for text in shown), (
            f"no README shows {start} any more"
        )


def test_commands_are_found_where_they_stand():
    text = "`robot/driver.py --stay` `--stay`\n```sh\ntrack # so\n\ncp a b\n```\n"
    text += "```sh\ncp a b\nls\n```\n| what | command |\n|---|---|\n| it | `where` |\n"
    assert list(stories(text)) == [
        ("track # so",), ("cp a b",), ("cp a b", "ls"), ("where",), ("robot/driver.py --stay",)
    ]  # fmt: skip


# Links


def anchors(path):
    """The anchors of a file's headings, as GitHub makes them."""
    headings = re.findall(r"^#+ (.*)$", prose(path.read_text("utf-8")), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading).lower().replace(" ", "-") for heading in headings}


def links(text):
    """The targets of links and pictures."""
    return re.findall(r"\]\(([^)\s]+)\)", prose(text))


def is_broken(target, path):
    """Whether a link in a file leads nowhere; of an address only the form counts."""
    if "://" in target:
        return not re.fullmatch(r"https://[\w-]+(\.[\w-]+)+(/[\w./#?=&~%-]*)?", target)
    name, _, anchor = target.partition("#")
    file = (path.parent / name).resolve() if name else path
    if file != ROOT and ROOT not in file.parents or not file.exists():
        return True
    if file.is_dir() and anchor:
        return True
    return bool(anchor) and anchor not in anchors(file)


@pytest.mark.parametrize("path", READMES, ids=lambda path: str(path.relative_to(ROOT)))
def test_every_link_leads_somewhere(path):
    assert [target for target in links(path.read_text("utf-8")) if is_broken(target, path)] == []


@pytest.mark.parametrize(
    "target",
    ["robots/README.md", "#no-such-heading", "robot/README.md#no-such", "../../etc", "http://a b"],
)
def test_a_broken_link_is_seen(target):
    assert is_broken(target, MAIN)


def test_the_first_readme_leads_to_all_others_and_they_lead_back():
    def goals(path):
        return {
            (path.parent / t.partition("#")[0]).resolve() for t in links(path.read_text("utf-8"))
        }

    assert set(READMES[1:]) <= goals(MAIN)
    for path in READMES[1:]:
        assert MAIN in goals(path)


def test_every_picture_is_shown():
    shown = {
        (path.parent / t).resolve() for path in READMES for t in links(path.read_text("utf-8"))
    }
    assert set((ROOT / "laptop" / "pictures").iterdir()) <= shown


# What is named


SOURCES = [
    *(ROOT / "laptop" / "cli").glob("*.py"),
    *(ROOT / "robot").glob("*.py"),
    ROOT / "tests" / "claims" / "__main__.py",
]
OPTION = re.compile(r"(?<![\w-])--[a-z][a-z-]*(?!\w)")


def options(text):
    """All long options in a text."""
    return set(OPTION.findall(text))


def test_every_option_that_a_readme_names_is_there():
    known = {o for path in SOURCES for o in options(path.read_text("utf-8"))}
    others = {
        "--upgrade",
        "--target",
        "--group",
        "--no-project",
        "--help",
        "--constraints",
        "--reinstall",
        "--format",
    }  # of pip, uv and all
    for path in READMES:
        assert options(path.read_text("utf-8")) <= known | others, path


def test_every_option_is_named_in_a_readme():
    named = {o for path in READMES for o in options(path.read_text("utf-8"))}
    for path in SOURCES:
        defined = re.findall(r"""^\s*(?:[\w.]+\()?"(--[a-z/-]+)",""", path.read_text("utf-8"), re.M)
        for option in defined:  # one, or one/its opposite
            assert named & set(option.split("/")), f"{path}: {option}"


def invoke(*words):
    """What a command prints, its lines joined."""
    return " ".join(CliRunner().invoke(laptop, list(words)).output.split())


def test_every_constant_of_the_plant_and_the_scene_is_told():
    text = (ROOT / "laptop" / "emulator" / "README.md").read_text("utf-8")
    plant, scene = text.split("## The synthetic camera")
    told = invoke("simulate", "--plant", "foo=1", "robot/driver.py").partition("known: ")[2]
    assert "voltage" in told
    assert set(re.findall(r"\w+", told)) <= set(re.findall(r"^\| `(\w+)`", plant, re.MULTILINE))
    told = invoke("track", "--no-serve", "--camera", "synthetic", "--scene", "foo=1")
    told = told.partition("known: ")[2]
    assert "tilt" in told
    assert set(re.findall(r"\w+", told)) <= set(re.findall(r"^\| `(\w+)`", scene, re.MULTILINE))


def test_every_key_of_an_arm_is_told():
    folder = ROOT / "shared" / "arms"
    text = (folder / "README.md").read_text("utf-8")
    for path in folder.glob("*.ini"):
        keys = re.findall(r"^(\w+) *=", path.read_text("utf-8"), re.MULTILINE)
        assert set(keys) <= set(re.findall(r"`(\w+)`", text)), path


def test_the_first_readme_is_short_and_holds_the_command_that_ci_looks_for():
    lines = MAIN.read_text("utf-8").splitlines()
    assert len(lines) <= 200
    command = next(line for line in lines if re.fullmatch(r"\.uv/bin/uv run .*pytest", line))
    assert command == ".uv/bin/uv run --group test pytest"


def test_the_readme_of_the_page_shows_the_states_of_a_run_as_they_are():
    text = (ROOT / "laptop" / "page" / "README.md").read_text("utf-8")
    assert f"\n\n{run_states.transition_table()}\n" in text + "\n"
    for word in (*run_states.RunState, *run_states.RunEvent):
        assert f"\n| {word.name} | {word.value} |\n" in text


def test_events_and_files_between_programs_are_told():
    text = (ROOT / "laptop" / "README.md").read_text("utf-8")
    for event in (value for name, value in vars(announcements).items() if name.isupper()):
        assert f"\n| `{event}` |" in text
    for name in (value for name, value in vars(state).items() if name.isupper()):
        assert re.search(rf"^\| `{re.escape(name)}/?` \|", text, re.MULTILINE), name


@pytest.mark.parametrize("room", ["laptop", "laptop/emulator"])
def test_every_file_of_a_room_stands_in_its_table(room):
    text = (ROOT / room / "README.md").read_text("utf-8").partition("\n## Rooms\n")[2]
    named, here = set(), ""
    for row in re.findall(r"^\| (.*) \|$", text, re.MULTILINE)[1:]:
        where, _, files = row.split("|")
        here = next(iter(re.findall(r"`([\w./]+)`", where)), here)
        named |= {ROOT / room / here / f"{name}.py" for name in re.findall(r"`(\w+)`", files)}
    there = {path for path in (ROOT / room).rglob("*.py") if not path.name.startswith("__")}
    if room == "laptop":
        there = {path for path in there if "emulator" not in path.parts}
    assert named == there


def test_the_glossary_has_fifty_words_and_says_where_each_is_found():
    text = (ROOT / "robot" / "README.md").read_text("utf-8").partition("\n## Glossary\n")[2]
    rows = re.findall(r"^\| (.+) \| .+ \| \[(\w+\.py)\]\((\S+)\) \|$", text, re.MULTILINE)
    words = [word for word, _, _ in rows]
    assert len(words) == 50 == text.count("\n|") - 2
    assert words == sorted(set(words), key=str.lower)
    for _, name, target in rows:
        assert target.endswith("/" + name)
        assert not is_broken(target, ROOT / "robot" / "README.md")


@pytest.mark.parametrize("name", ["driver", "visual_servoing", "tracking_client", "bench_brick"])
def test_the_help_of_a_script_ends_with_two_examples(name, capsys):
    with pytest.raises(SystemExit):
        importlib.import_module("robot." + name).main(["--help"])
    *_, title, one, other = capsys.readouterr().out.splitlines()
    assert title == "examples:"
    for example in (one, other):
        assert re.match(rf"  {name}\.py \S", example)


def test_every_sensor_and_all_that_it_measures_is_told():
    text = (ROOT / "laptop" / "emulator" / "README.md").read_text("utf-8")
    told = set(re.findall(r"[\w-]+", text.partition("## Sensors")[2].partition("\n## ")[0]))
    for name, kind in KINDS.items():
        assert {name, kind.driver, *kind.quantities} <= told, name


def test_every_constant_of_the_wheels_is_told():
    text = (ROOT / "laptop" / "emulator" / "README.md").read_text("utf-8")
    section = text.partition("## A bare brick")[2].partition("\n## ")[0]
    rows = "\n".join(re.findall(r"^\| (`.*?) \|", section, re.MULTILINE))
    assert set(re.findall(r"`(\w+)`", rows)) == set(WHEELS)
