"""Commands of the READMEs, tried: those for the brick on the emulated one, long ones shorter."""

import os
import re
import shlex
import signal
import subprocess
import sys
import time

from click.testing import CliRunner
from commands import parse
from places import ROOT
from waiting import PATIENCE, until

from laptop.cli.main import laptop
from tests.claims.__main__ import claims

SKIPPED = {
    "python3 -m": "it loads uv from the network",
    r"\.uv/bin/pip": "the same, where there is no pip",
    r"\.uv/bin/uv (tool|cache)": "it installs into the home, or cleans there; .ci/run installs",
    "scp": "it needs a brick",
    r"\.ci/": "it runs all tests, on several Pythons; constrain.py loads from the network",
    "python laptop/examples": "tests/laptop/test_examples.py runs these",
    "--group compiled": "it needs a C compiler; tests/laptop/emulator/test_compiled.py has one",
    "--group cluster": "it needs a cluster; tests/laptop/bench/test_workers.py has one",
}
"""What is not run, by a pattern for how it begins, and why."""

TYPED = (
    (r"^ssh -t robot@ev3dev\.local ", ""),  # the brick is emulated
    (r"^brickservo ", ".uv/bin/uv run brickservo "),
    (r"^\.uv/bin/uv run brickservo simulate (robot/\w+\.py)", r"\1"),
    (rf"^({'|'.join(laptop.commands)})(?!\S)", r".uv/bin/uv run brickservo \1"),  # as in tables
    (r"^(\w+\.py)", r"robot/\1"),
)
"""What makes a command as one types it of one that is shown shorter."""

REDUCED = (
    (r"KS82-DNHF-7WQM|\bCODE\b", "{code}"),  # the code of the tracker at hand
    (r"127\.0\.0\.1", "127.0.0.1{port}"),  # and its port
    (r"--camera \d", "--camera synthetic"),  # no webcam
    (r"class new( 7b)?$", "class new another"),  # theirs is there for what follows
    (r" --open\b", " --page"),  # no browser
    (r"--seeds (\d+):\d+", lambda seeds: f"--seeds {seeds[1]}:{int(seeds[1]) + 1}"),
    (r" --to \S+\.pdf", ""),  # no browser
    (r"--seconds \d+", "--seconds 3"),  # pairing takes one of them
    (r"(tracking_client\.py(?!.*--seconds).*)", r"\1 --seconds 3"),  # else until Ctrl-C
    (r"\bpytest\b.*", "python -m pytest --collect-only -q -n 0 tests/shared/test_ini.py"),
    (r"(bench_brick\.py)(?! planar| spatial)", r"\1 planar"),  # one arm
    (r"(--realtime robot/driver\.py) .*", r"\1 where"),  # no drawing in real time
    (r"((--realtime|--arm spatial) .*visual_servoing\.py.*)", r"\1 --tolerance 100"),  # soon there
    (r"^\.uv/bin/uv run (--group \w+ )*", ""),
    (r"^brickservo ", "python -m laptop "),
)
"""What becomes of a command before it runs: pattern and replacement, one after the other."""

MODES = (
    (r"-m tests\.claims", "parse_claims"),  # minutes; tests/claims has their parts
    (r"-m pytest", "process"),
    (r"laptop (demo$|bench (draw|track)$|bench servo --seeds|track)", "until"),
    # Other benches take minutes. These need a brick, a camera, or a network.
    (r"laptop (demo|bench|brick|doctor|bundle|page|measure accuracy)", "parse"),
    (r"laptop (measure (pen|arm)(?!.*--simulate)|draw(?!.* --(preview|to)\b))", "parse"),
    (r"--realtime", "process"),
    (r"-m laptop", "invoke"),
    (r"", "shell"),
)
"""How a command is tried, by the first pattern that it holds; what is parsed has its own tests."""

UNTIL = {"demo": r"http://", "bench": r"\d+/\d+", "track": r"pairing code, once: (\S+)"}
"""Commands of minutes are ended by Ctrl-C once they have said this: they are at work."""

STATUS = {"--fault unplug": 1, "--wait": 130, "class check": 1}
"""Exit statuses other than 0, by what stands in the command."""

AT_THE_BRICK = (
    (r"(visual_servoing|tracking_client)\.py", "--scene ''"),
    (r"--camera", "--scene goal_x=0,goal_y=8"),
    (r"--wait", "--fault int@2"),
    (r" touch", "--hand '12,0@5 8,6@9' --press enter@7 --press enter@11"),  # somebody leads it
    (r" touch(?!.*--go)", "--press down@15"),
    (r" touch.*--go", "--press enter@15"),
    (r" (home|check)$", "--press enter@2"),  # somebody confirms, and answers
    (r" check$", "--press left@10 --press left@13 --press right@20 --press left@23"),
)
"""What happens on the emulated brick where a script's words hold this, as options of `simulate`."""


def replaced(command, pairs):
    """Return a command after all replacements."""
    for pattern, replacement in pairs:
        command = re.sub(pattern, replacement, command)
    return command


def is_skipped(part):
    """Return True if a command is not run."""
    return any(re.search(rf"(^|\s){start}", part) for start in SKIPPED)


def is_quick(story):
    """Return True if it takes this process less than a second, and needs no other."""
    quick = r"driver\.py (where|inverse|move|home --here|line) ?|^cp "
    return all(re.search(quick, part) and "--realtime" not in part for part in story)


class Shell:
    """Runs the parts of a story one after the other; a tracker goes on until the end."""

    def __init__(self):
        self.code, self.port = "ABCD-EFGH-JKMN", ""  # of the tracker; the one in virtual time
        self._tracker = None

    def run(self, part):
        """Run one command; fails unless it ends as it should."""
        part = replaced(part, REDUCED).format(code=self.code, port=self.port)
        if part.startswith("robot/"):
            happens = [option for pattern, option in AT_THE_BRICK if re.search(pattern, part)]
            happens += re.findall(r"--arm \S+", part)
            part = " ".join(["python -m laptop simulate", *happens, part])
        part = re.sub(r"(laptop simulate)", r"\1 --no-picture", part)
        words = shlex.split(part, comments=True)
        words = [str(ROOT / w) if w.startswith(("robot/", "shared/")) else w for w in words]
        mode = next(mode for pattern, mode in MODES if re.search(pattern, part))
        status = next((status for text, status in STATUS.items() if text in part), 0)
        getattr(self, "_" + mode)(words, status)

    def close(self):
        """End the tracker."""
        if self._tracker:
            tracker, self._tracker = self._tracker, None
            _end(tracker)

    def _parse(self, words, status):
        parse(words[3:])

    def _parse_claims(self, words, status):
        parse(words[3:], claims)

    def _shell(self, words, status):
        subprocess.run(words, check=True)

    def _process(self, words, status):
        cwd = ROOT if "pytest" in words else None
        words = [sys.executable, *words[1:]]
        done = subprocess.run(words, cwd=cwd, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
        assert done.returncode == status, done.stdout.decode()

    def _invoke(self, words, status):
        if "--constants" in words:
            self.run("robot/bench_brick.py")
        result = CliRunner().invoke(laptop, words[3:])
        if result.exception and not isinstance(result.exception, SystemExit):
            raise result.exception
        assert result.exit_code == status, result.output

    def _until(self, words, status):
        """Start it, and wait until it has said that it is at work."""
        kind = words[3]
        if kind == "track":
            self.close()
            words += ["--listen-port", "0", "--no-simulate"]
            words += [] if "--page" in words else ["--no-page"]
        if kind == "demo" or "--page" in words:
            words += ["--page-port", "0"]
        terminal = {**os.environ, "FORCE_COLOR": "1", "TERM": "xterm", "COLUMNS": "200"}
        with open("said.txt", "wb") as out:
            words = [sys.executable, *words[1:]]
            process = subprocess.Popen(words, stdout=out, stderr=subprocess.STDOUT, env=terminal)
        try:
            found = until(
                lambda: re.search(UNTIL[kind], _said()) or process.poll() is not None,
                " ".join(words),
                lambda: time.sleep(0.05),
            )
            assert found is not True, _said()
            if kind != "track":
                _end(process)
                return
            self._tracker, self.code = process, found.group(1)
            self.port = re.search(r"visual_servoing\.py (:\d+)", found.string).group(1)
        except BaseException:
            process.kill()
            process.wait()
            raise


def _said():
    with open("said.txt", encoding="utf-8") as file:
        return file.read()


def _end(process):
    """End a process by Ctrl-C; it must say that it was stopped."""
    process.send_signal(signal.SIGINT)
    try:
        status = process.wait(PATIENCE)
    finally:
        process.kill()
        print(_said())  # shown where a test fails
    assert status == 130
