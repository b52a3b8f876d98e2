"""A brick to reach by ssh: Debian's own sshd on loopback, with a home and a python3 of its own.

Each connection is given to a `sshd -i`, so that the system picks the port, and connections can be
counted. What runs there is `python3` of `emulated_python.py`: scripts of the brick's side run on
the emulated brick, and everything else as it is. Each start of it is on record.

Who logs in is whoever runs the tests, by a key. Passwords need an account of the system: for these
there is `PasswordServer`, which is asyncssh's own server.
"""

import asyncio
import contextlib
import getpass
import glob
import os
import shutil
import signal
import socket
import subprocess
import sys
import threading
from pathlib import Path

import asyncssh
import pytest
from places import ROOT
from waiting import PATIENCE, until

from laptop.emulator import live
from shared.state import LIVE_FOLDER

SSHD = shutil.which("sshd", path=os.pathsep.join([os.environ.get("PATH", ""), "/usr/sbin"]))
SFTP_SERVER = "/usr/lib/openssh/sftp-server"

CONFIG = """
HostKey {folder}/host_key
PidFile none
StrictModes no
UsePAM no
PasswordAuthentication no
KbdInteractiveAuthentication no
AuthorizedKeysFile {folder}/authorized_keys {folder}/home/.ssh/authorized_keys
PrintMotd no
PrintLastLog no
ForceCommand {folder}/session
MaxStartups 100
"""

SESSION = """#!/bin/sh
# What a brick's session has; {limits}
export HOME={folder}/home PATH={folder}/bin:/usr/bin:/bin EMULATED={folder} LC_ALL=C.UTF-8
unset BRICKSERVO_STATE BRICKSERVO_ARM BRICKSERVO_PLAN PYTHONPATH
cd "$HOME"
{setup}
if [ -n "$SSH_ORIGINAL_COMMAND" ]; then exec sh -c "$SSH_ORIGINAL_COMMAND"; fi
exec sh -i
"""


def needs_sshd():
    """Skip, and say so, where there is no sshd; fail where what is missing must not be skipped."""
    if SSHD is None:
        problem = "there is no sshd here: apt install openssh-server"
        assert not os.environ.get("CI"), problem
        pytest.skip(problem)


def new_key(file):
    """Write a new key for ssh; return it."""
    key = asyncssh.generate_private_key("ssh-ed25519")
    key.write_private_key(str(file))
    file.chmod(0o600)
    return key


def read_bytes(file):
    """The bytes of a file."""
    with open(file, "rb") as opened:
        return opened.read()


class SshBrick:
    """A brick, and the home of somebody on the laptop who may log in there.

    Args:
        folder: an empty one.
        program: words by which a Python runs the laptop's commands.
    """

    def __init__(self, folder, program=("-m", "laptop")):
        needs_sshd()
        self._program = program
        self.folder, self.home = folder, folder / "home"
        self.laptop = folder / "laptop"
        for one in (self.home, self.laptop / ".ssh", folder / "bin"):
            one.mkdir(parents=True)
        self.renew_host_key()
        if os.geteuid() == 0:  # its own start at boot would make this, and there may be none
            os.makedirs("/run/sshd", mode=0o755, exist_ok=True)
        key = new_key(self.laptop / ".ssh" / "id_ed25519")
        (folder / "authorized_keys").write_bytes(key.export_public_key())
        (folder / "sshd_config").write_text(CONFIG.format(folder=folder))
        self.set_up()
        python = folder / "bin" / "python3"
        program = ROOT / "tests" / "helpers" / "emulated_python.py"
        python.write_text(f'#!/bin/sh\nexec {sys.executable} -S -E {program} "$@"\n')
        python.chmod(0o755)
        (folder / "python").write_text(sys.executable)
        self.connections = 0
        self.sessions = []
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.port = self._listener.getsockname()[1]
        self._thread = threading.Thread(target=self._serve, daemon=True)
        self._thread.start()

    def set_up(self, setup="", limits="nothing is limited"):
        """Let each session from now on begin with a line of sh."""
        session = self.folder / "session"
        session.write_text(SESSION.format(folder=self.folder, setup=setup, limits=limits))
        session.chmod(0o755)

    def renew_host_key(self):
        """Become another brick."""
        new_key(self.folder / "host_key")

    @property
    def place(self):
        """What to give to --brick."""
        return self.by_way_of(self)

    @staticmethod
    def by_way_of(cable):
        """The same through a Proxy."""
        return f"{getpass.getuser()}@127.0.0.1:{cable.port}"

    def take_python_away(self):
        """Let there be no python3 in sessions from now on."""
        tools = self.folder / "tools"
        tools.mkdir()
        for path in Path("/usr/bin").iterdir():
            if not path.name.startswith("python"):
                (tools / path.name).symlink_to(path)
        self.set_up(f"PATH={tools}")

    def use_plain_python(self):
        """Let scripts run as they are from now on, with nothing emulated."""
        program = f'#!/bin/sh\nexec {sys.executable} "$@"\n'
        (self.folder / "bin" / "python3").write_text(program)

    def emulate(self, *words):
        """Let scripts be emulated from now on with more words for `simulate`."""
        (self.folder / "options").write_text("\n".join(words))

    def be_new(self):
        """Be a brick on which nobody has looked yet which motor is where."""
        (self.folder / "start").write_text("unchecked")

    @property
    def last_run(self):
        """The folder that the last emulated script has, or will have, its files in."""
        return Path((self.folder / "started").read_text())

    def pen_samples(self):
        """How many samples of the arm that runs in real time have the pen on the paper."""
        runs = live.run_files(str(self.home / ".brickservo" / LIVE_FOLDER))
        lines = Path(runs[0]).read_text().splitlines()[1:] if runs else []
        return sum(line.endswith(" 1") for line in lines)

    @property
    def python_starts(self):
        """The words of each start of python3 so far."""
        log = self.folder / "python-starts"
        return log.read_text().splitlines() if log.exists() else []

    @property
    def environment(self):
        """The variables of a program of the laptop."""
        kept = {k: v for k, v in os.environ.items() if k != "SSH_AUTH_SOCK"}
        return {
            **kept,
            "HOME": str(self.laptop),
            "BRICKSERVO_STATE": str(self.laptop / ".brickservo"),
        }

    def command(self, *words, **options):
        """Begin `python -m laptop brick WORDS`, words behind the first one after --brick."""
        name, *rest = map(str, words)
        place = options.pop("place", self.place)
        where = ["--brick", place] if place else []
        return subprocess.Popen(
            [sys.executable, *self._program, "brick", name, *where, *rest],
            cwd=options.pop("cwd", ROOT),
            env={**self.environment, **options.pop("env", {})},
            stdin=options.pop("stdin", subprocess.DEVNULL),
            stdout=options.pop("stdout", subprocess.PIPE),
            stderr=options.pop("stderr", subprocess.PIPE),
            text=True,
            **options,
        )

    def run(self, *words, typed=None, **options):
        """Status, output and errors of that; `typed` is what somebody types."""
        if typed is not None:
            options["stdin"] = subprocess.PIPE
        process = self.command(*words, **options)
        out, errors = process.communicate(typed, timeout=300)
        return process.returncode, out, errors

    def wait_for_sessions(self):
        """Wait until nothing runs there any more."""
        for session in self.sessions:
            session.wait(300)
        until(lambda: not self.running(), "the end of what runs on the brick")

    def running(self):
        """The processes of sessions here: by environment, words, or, of a sshd still, its log."""
        log, found = str(self.folder / "sshd.log"), []
        for process in glob.glob("/proc/[0-9]*"):
            with contextlib.suppress(OSError):
                environment = read_bytes(process + "/environ")
                words = read_bytes(process + "/cmdline")
                logs = [os.readlink(fd) for fd in glob.glob(process + "/fd/2")]
                if (
                    f"EMULATED={self.folder}\0".encode() in environment
                    or f"{self.folder}/session".encode() in words
                    or log in logs
                ):
                    found.append(int(process.split("/")[2]))
        return found

    def close(self):
        """End it, and what runs there."""
        self._listener.close()
        for session in self.sessions:
            session.kill()
            session.wait()
        for number in self.running():
            with contextlib.suppress(ProcessLookupError):
                os.kill(number, signal.SIGKILL)

    def _serve(self):
        while True:
            try:
                sock, _ = self._listener.accept()
            except OSError:  # closed
                return
            self.connections += 1
            with sock, open(self.folder / "sshd.log", "ab") as log:
                words = [SSHD, "-i", "-e", "-f", str(self.folder / "sshd_config")]
                self.sessions.append(
                    subprocess.Popen(words, stdin=sock.fileno(), stdout=sock.fileno(), stderr=log)
                )


class Proxy:
    """A cable to a port on this machine, which is cut after so many bytes from the laptop.

    Args:
        port: where it leads.
        most: bytes; None for as many as come.
    """

    def __init__(self, port, most=None):
        self._target, self._left = port, most
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.port = self._listener.getsockname()[1]
        self._ends = []
        self._open = threading.Event()
        self._open.set()
        self._threads = []
        self._begin(self._serve)

    def _begin(self, target, *args):
        thread = threading.Thread(target=target, args=args, daemon=True)
        self._threads.append(thread)
        thread.start()

    def _serve(self):
        while True:
            try:
                laptop, _ = self._listener.accept()
            except OSError:  # closed
                return
            brick = socket.create_connection(("127.0.0.1", self._target))
            self._ends += [laptop, brick]
            for source, goal, counted in ((laptop, brick, True), (brick, laptop, False)):
                self._begin(self._pass_on, source, goal, counted)

    def _pass_on(self, source, goal, counted):
        with contextlib.suppress(OSError):  # the other way has been cut
            for data in iter(lambda: source.recv(4096), b""):
                self._open.wait()
                if counted and self._left is not None:
                    data, self._left = data[: self._left], self._left - len(data)
                goal.sendall(data)
                if counted and self._left is not None and self._left <= 0:
                    break
        self.cut()

    def fall_silent(self):
        """Let nothing through any more, as where a laptop sleeps or a cable is pulled."""
        self._open.clear()

    def cut(self):
        """Cut it now."""
        self._open.set()
        for end in self._ends:
            with contextlib.suppress(OSError):  # it is cut already
                end.shutdown(socket.SHUT_RDWR)

    def close(self):
        """End it, threads and sockets and all."""
        with contextlib.suppress(OSError):  # on some systems closing it is enough
            self._listener.shutdown(socket.SHUT_RDWR)
        self._listener.close()
        self._threads[0].join(PATIENCE)  # from here on there are no more ends
        self.cut()
        for thread in self._threads:
            thread.join(PATIENCE)
        for end in self._ends:
            end.close()


class PasswordServer:
    """A server of asyncssh that lets in by a password, and says yes to every command.

    Args:
        password: the right one.
        folder: for its key.
    """

    def __init__(self, password, folder):
        self.tried = []
        key = new_key(folder / "password_server_key")
        server = self

        class PasswordDoor(asyncssh.SSHServer):
            def password_auth_supported(self):
                return True

            def validate_password(self, username, given):
                server.tried.append((username, given))
                return given == password

        async def serve():
            server._listener = await asyncssh.listen(
                "127.0.0.1",
                0,
                server_factory=PasswordDoor,
                server_host_keys=[key],
                process_factory=lambda process: process.exit(0),
            )
            server.port = server._listener.get_port()

        self._loop = asyncio.new_event_loop()
        self._thread = threading.Thread(target=self._loop.run_forever, daemon=True)
        self._thread.start()
        asyncio.run_coroutine_threadsafe(serve(), self._loop).result(60)

    def close(self):
        """End it."""

        async def close():
            self._listener.close()
            await self._listener.wait_closed()

        asyncio.run_coroutine_threadsafe(close(), self._loop).result(60)
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join()
        self._loop.close()
