"""A brick that lies: a real server of ssh whose answers are anything but a brick's.

Run by itself it prints what the commands make of each lie: seconds, memory, sentence.
"""

import asyncio
import json
import os
import resource
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path

import asyncssh

KINDS = {
    "installed": "readlink $name",
    "install": "install.lock",
    "doctor": "python3 -",
    "logs": "brickservo-*.err.log",
    "read": "head -c",
    "arms": "ls -1",
    "is on": "/proc/$pid/cmdline",
    "follow": "read -r -t 1 order",
    "watch": "read -r -t 15 word",
    "echo": "cat",
    "program": "BRICK_RUN=",
}
"""What a command is for, and by what of it that is known; the first that fits."""

STEER = "\x1b]0;mine\x07\x1b[31m\x1b[2K\rport A    large motor: fine\n\x1b[8m"
"""Sets a window's title, wipes out a line, fakes another, hides what follows."""

WELL = {
    "python": "3.5.3", "library": "2.1.0", "kernel": "4.14-ev3dev", "memory": 30.0, "room": 500.0,
    "others": [], "load": 0.1, "cores": 1, "battery": 8.0, "time": 1.8e9,
    "connection": "1 2 3 4", "host": "ev3dev", "problem": None, "motors": {},
}  # fmt: skip


def told(**changed):
    """What doctor.py tells, with something else in it."""
    return json.dumps({**WELL, **changed}).encode() + b"\n"


def forever(chunk, stream="stdout"):
    """An answer that has no end."""

    async def answer(process):
        out = getattr(process, stream)
        while True:
            out.write(chunk)
            await out.drain()

    return answer


async def silence(process):
    """Say nothing."""
    await asyncio.sleep(3600)


def said(data, status=0, stream="stdout", then=None):
    """An answer of some bytes."""

    async def answer(process):
        getattr(process, stream).write(data)
        if then is not None:
            await then(process)
        process.exit(status)

    return answer


async def _echo(process):
    data = await process.stdin.read(4096)
    while data:
        process.stdout.write(data)
        data = await process.stdin.read(4096)
    process.exit(0)


ON = {"is on": said(b"123\n")}
"""A job is drawn."""

FULL = b"x" * (1 << 20)

LIES = {
    # name: (words behind `brick`, what is answered, what is said of it)
    "an answer of no end": ("doctor", {"installed": forever(b"A" * 65536)}, "than 1049 kB"),
    "errors of no end": (
        "doctor", {"installed": forever(b"A" * 65536, "stderr")}, "than 1049 kB"),
    "one line of no end": ("doctor", {"doctor": forever(b"A" * 65536)}, "than 66 kB"),
    "lines of no end": ("doctor", {"doctor": forever(b"no\n" * 20000)}, "than 1049 kB"),
    "echoes of no end": ("doctor", {"echo": forever(b"A" * 65536)}, "than 66 kB"),
    "a mode of 999": ("doctor", {"installed": said(b"mode 999 x\n")}, "no program is there|none"),
    "a version that steers": (
        "doctor", {"installed": said(f"folder versions/{STEER}-1\n".encode())}, "is there, "),
    "facts that steer": (
        "doctor", {"doctor": said(told(host=STEER, kernel=f"ev3dev {STEER}", others=[[1, STEER]],
         motors={STEER: {"kind": STEER, "position": 0}}))}, "network"),
    "a motor's count that is a text": (
        "doctor", {"doctor": said(told(motors={"A": {"kind": "large", "position": STEER}}))},
        "motors is of another kind"),
    "time of 400 digits": ("doctor", {"doctor": said(told(time=10**400))}, "time is 1000"),
    "memory without bound": (
        "doctor", {"doctor": said(told(memory=5).replace(b'"memory": 5', b'"memory": 1e999'))},
        "memory is inf"),
    "facts nested deeply": ("doctor", {"doctor": said(b"[" * 60_000 + b"\n" + told())}, "network"),
    "facts of another kind": ("doctor", {"doctor": said(b'{"python": 5}\n')}, "python is 5"),
    "bytes by chance": ("doctor", {"doctor": said(os.urandom(5000) + b"\n{}\n")}, "is not told"),
    "errors that steer": (
        "doctor", {"doctor": said(f"oops {STEER}\n".encode(), 1, "stderr")}, "cannot tell how it"),
    "nothing installed, said by an empty line": (
        "install", {"install": said(b"\n")}, "is installed"),
    "something moved, half told": ("install", {"install": said(b"moved x\n")}, "is installed"),
    "something moved that steers": (
        "install", {"install": said(f"moved {STEER} y\n".encode())}, "is installed"),
    "a reason that steers": (
        "install", {"install": said(STEER.encode(), 5, "stderr")}, "cannot take the program"),
    "logs out of the folder": (
        "log", {"logs": said(b"../../x.log\n.brickservo/logs/../../y.log\n/etc/passwd.log\n"
         b".brickservo/logs/..\\..\\evil.log\n.brickservo/logs/.bashrc\n")}, "has no logs"),
    "logs by names of devices and none": (
        "log", {"logs": said(b".brickservo/logs/CON.log\n.brickservo/logs/\n\n..\n")},
        "has no logs"),
    "a log's name that steers": (
        "log", {"logs": said(f".brickservo/logs/{STEER}.log\n".encode())}, "has no logs"),
    "a million logs": ("log", {"logs": forever(b".brickservo/logs/a.log\n" * 1000)}, "1049 kB"),
    "a log of no end": (
        "log", {"logs": said(b".brickservo/logs/a.log\n"), "read": forever(FULL)}, "than 335"),
    "an arm of 200 kB": ("arm --fetch x", {"read": said(b"x" * 200_000)}, "98 kB|none of ours"),
    "arms that steer": ("arm", {"arms": said(f"{STEER}.ini\nb.ini\n".encode())}, "arms of its own"),
    "a program of no number": ("watch", {"is on": said(b"abc\n")}, "draws no job"),
    "numbers without bound": (
        "watch", {**ON, "follow": said(
            b'{"state":"drawing","cm":1e999,"left_s":1' + b"0" * 400 + b',"speed":-1e308}\n'
            b'{"over": true}\n')}, "it was killed"),
    "a status nested deeply": (
        "watch", {**ON, "follow": said(b'{"state":"drawing","x":' + b"[" * 60_000 + b"\n")},
        "ended the watching"),
    "a status that steers": (
        "watch", {**ON, "follow": said(json.dumps(
            {"state": "failed", "job": STEER, "reason": STEER}).encode() + b'\n{"over": true}\n')},
        "failed"),
    "a status of no end": ("watch", {**ON, "follow": forever(b'{"' * 32768)}, "66 kB"),
    "last words of no end": (
        "watch", {**ON, "follow": said(b'{"over": true}\n', 0, "stdout",
         said(b"x\n" * 5_000_000))}, "it was killed"),
    "errors of no end while a job is watched": (
        "watch", {**ON, "follow": forever(b"A" * 65536, "stderr")}, "66 kB"),
}  # fmt: skip

HANGS = {
    "silence at once": ("doctor", {"installed": silence}, "not said a word for 30 s"),
    "silence of its doctor": ("doctor", {"doctor": silence}, "not said a word for 30 s"),
    "silence behind a status": (
        "watch", {**ON, "follow": said(b'{"state":"drawing"}\n', then=silence)},
        "not said a word for 30 s"),
    "silence before a log": (
        "log", {"logs": said(b".brickservo/logs/a.log\n"), "read": silence},
        "not said a word for 30 s"),
}  # fmt: skip


class LyingBrick:
    """A server that lets everybody in, and answers as it is told to.

    Args:
        folder: for its key.
        lies: by kind of command, a coroutine of the process; others get what is harmless.
    """

    def __init__(self, folder, lies):
        self.lies = lies
        key = asyncssh.generate_private_key("ssh-ed25519")

        class OpenDoor(asyncssh.SSHServer):
            def begin_auth(self, username):
                return False

        async def serve():
            self._listener = await asyncssh.listen(
                "127.0.0.1",
                0,
                server_factory=OpenDoor,
                server_host_keys=[key],
                process_factory=self._answer,
                encoding=None,
            )
            self.port = self._listener.get_port()

        self._loop = asyncio.new_event_loop()
        self._thread = threading.Thread(target=self._loop.run_forever, daemon=True)
        self._thread.start()
        asyncio.run_coroutine_threadsafe(serve(), self._loop).result(60)

    @property
    def place(self):
        """What to give to --brick."""
        return f"robot@127.0.0.1:{self.port}"

    async def _answer(self, process):
        command = process.command or ""
        kind = next((kind for kind, words in KINDS.items() if words in command), "")
        if kind == "echo" and command != "cat":
            kind = ""
        try:
            if kind in self.lies:
                await self.lies[kind](process)
            elif kind == "echo":
                await _echo(process)
            elif kind == "doctor":
                await said(told())(process)
            else:
                process.exit(1 if kind == "is on" else 0)
        except (BrokenPipeError, ConnectionError, asyncssh.Error):
            pass  # nobody listens any more

    def close(self):
        """End it."""

        async def close():
            self._listener.close()
            for task in asyncio.all_tasks() - {asyncio.current_task()}:
                task.cancel()

        asyncio.run_coroutine_threadsafe(close(), self._loop).result(60)
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join()
        self._loop.close()


def words_of(command, place):
    """The words of a command line for a brick at a place."""
    name, *rest = command.split()
    return [*(["draw"] if name == "draw" else ["brick", name]), "--brick", place, *rest]


def main():
    """Print a table of all lies: exit status, seconds, MB, what is said."""
    for name, (command, lies, _) in {**LIES, **HANGS}.items():
        with tempfile.TemporaryDirectory() as folder:
            brick = LyingBrick(Path(folder), lies)
            environment = {**os.environ, "HOME": folder, "BRICKSERVO_STATE": folder + "/state"}
            began = time.monotonic()
            done = subprocess.Popen(
                [sys.executable, "-m", "laptop", *words_of(command, brick.place)],
                env={**environment, "PYTHONPATH": str(Path(__file__).parents[2])},
                cwd=folder, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                stderr=subprocess.STDOUT, text=True,
            )  # fmt: skip
            out = done.stdout.read()
            _, status, used = os.wait4(done.pid, 0)
            done.returncode = os.waitstatus_to_exitcode(status)
            took = time.monotonic() - began
            brick.close()
        last = out.strip().splitlines()[-1] if out.strip() else ""
        trouble = " TRACEBACK" if "Traceback" in out else ""
        trouble += " STEERS" if "\x1b" in out else ""
        used = f"{took:6.1f} s {used.ru_maxrss / 1024:5.0f} MB"
        print(f"{name:42} {done.returncode:3} {used}{trouble}  {ascii(last)[:150]}", flush=True)
    print(f"beside them: {resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024:.0f} MB")


if __name__ == "__main__":
    main()
