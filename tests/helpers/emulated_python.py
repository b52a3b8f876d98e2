"""`python3` on a brick of `ssh_brick`: scripts run on the emulated brick, all else as it is.

$EMULATED is the brick's folder. `options` there are more words for `simulate`, one a line. A brick
that has been checked or homed stays so, and the arm is where the last run has left it; before that
it is where `start` says.
"""

import os
import signal
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]


SIMULATE = """
import contextlib, sys
import click
def echo(*words, to=click.echo, **options):
    with contextlib.suppress(OSError):
        to(*words, **options)
click.echo = echo
from laptop.cli.main import main
import os
from laptop.emulator import brick_home
from laptop.emulator.host import linux
from shared.state import state_folder
linux.PID = os.getpid()
linux.ENVIRONMENT.update((key, os.environ[key]) for key in os.environ if key.startswith("SSH_"))
def copy(folder, here=os.path.join(state_folder(), "jobs"), copy=brick_home._copy_own_arms):
    os.makedirs(here, exist_ok=True)
    os.symlink(here, os.path.join(folder, "jobs"))
    copy(folder)
brick_home._copy_own_arms = copy
sys.exit(main())
"""
"""The command, which writes its files also where nobody is left to read what it says of them. The
files of jobs are those of the brick's home, and outlive a run. Its process is one of those that the
brick's shell knows, and sshd tells it who has called."""


def simulate(brick, words):
    """Run a script on the emulated brick; its status."""
    runs = brick / "runs"
    runs.mkdir(exist_ok=True)
    out = tempfile.mkdtemp(prefix="run-", dir=runs)
    last = brick / "last"
    begin = brick / "start"
    start = begin.read_text() if begin.exists() else "lost"
    start = "after:" + last.read_text() if last.exists() else start
    extra = (brick / "options").read_text().split("\n") if (brick / "options").exists() else []
    options = ["--out", out, "--no-picture", "--start", start, *filter(None, extra)]
    home = os.environ["HOME"]
    if "--arm" in words:  # the emulated brick carries it
        k = words.index("--arm") + 1
        own = Path(home, ".brickservo", "arms", words[k] + ".ini")
        words[k] = str(own) if own.exists() else words[k]  # its state folder is another one
        options += ["--arm", words[k]]
    # What is installed there runs, and not what lies here.
    environment = dict(os.environ, PYTHONPATH=os.pathsep.join([home, str(ROOT)]))
    words = [sys.executable, "-c", SIMULATE, "simulate", *options, *words]
    (brick / "started").write_text(out)
    # The terminal would send it what it sends to this process, too: each once.
    process = subprocess.Popen(words, env=environment, start_new_session=True)
    sent = set()

    def hand_on(number, _):
        """Once: terminal and watch each send a SIGHUP, the second after the script has ended."""
        if number not in sent:
            sent.add(number)
            process.send_signal(number)

    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):  # they are for the script
        signal.signal(number, hand_on)
    status = process.wait()
    if (Path(out) / "trace.csv").exists() and (last.exists() or (status == 0 and "home" in words)):
        last.write_text(out)
    if status == 0 and "check" in words:
        begin.write_text("0,0")  # and somebody puts it at home
    return status if status >= 0 else 128 - status  # as a shell tells of a signal


def main():
    """The command line."""
    brick, words = Path(os.environ["EMULATED"]), sys.argv[1:]
    with open(brick / "python-starts", "a") as log:
        log.write(" ".join(words) + "\n")
    if words and words[0] == "-":
        with tempfile.NamedTemporaryFile("w", suffix=".py", dir=str(brick)) as file:
            file.write(sys.stdin.read())
            file.flush()
            return simulate(brick, [file.name, *words[1:]])
    if words and not words[0].startswith("-"):
        return simulate(brick, words)
    os.execv(sys.executable, [sys.executable, *words])


if __name__ == "__main__":
    sys.exit(main())
