"""Start of a command: sets in one order, streams that are open, and an end in order."""

import _signal  # type: ignore[import-not-found]  # `signal` takes a while to import
import os
import sys

SEED, FIXED, RANDOM = "PYTHONHASHSEED", "0", "random"
"""The variable by which Python orders its sets, as long as the process; and what it may be."""

BLAS_THREADS = "OPENBLAS_NUM_THREADS"
"""The variable by which numpy's and scipy's linear algebra takes so many threads.

One is best here: the matrices are small, and threads that wait for each other spin.  Beside other
work a camera's calibration took twelve times as long with two.  And the order of a sum, so its last
digits, would depend on the computer's cores.
"""

SERVERS = ("page", "track")
"""The commands that serve others for long, who must not know how their dictionaries are filled."""


def run() -> None:
    """Run the command that was typed, and end this process with its status."""
    # While importing there is nothing to end in order.
    _signal.signal(_signal.SIGINT, _signal.SIG_DFL)
    os.environ.setdefault(BLAS_THREADS, "1")
    order_sets()
    _open_streams()
    try:
        from shared import state

        os.environ.setdefault(state.PROGRAM, _typed())  # the commands' examples say it, too
        from laptop.cli.main import main

        sys.exit(main())
    except ModuleNotFoundError as missing:
        sys.exit(f"laptop: {missing.name} is not installed here; run .uv/bin/uv run brickservo")
    except SystemExit as end:
        _leave_threads(end.code)
        raise


def _typed() -> str:
    """Return what was typed before the command, as whoever reads messages can type it again."""
    if os.path.basename(sys.argv[0]) != "__main__.py":
        program = "brickservo"
    elif os.path.basename(os.path.dirname(sys.argv[0])) == "laptop":
        program = "python -m laptop"
    else:
        program = "python -m brickservo"
    uv = os.environ.get("UV", "") if "UV_RUN_RECURSION_DEPTH" in os.environ else ""
    if not uv:
        return program
    own = os.path.join(os.getcwd(), "")
    return f"{uv.removeprefix(own) if uv.startswith(own) else 'uv'} run {program}"


def order_sets() -> None:
    """Restart the process with a fixed hash seed: sets then have the same order in each run.

    A program on the emulated brick, and what is drawn here, hangs on that order.
    Commands that this one starts have it from here, in the environment.
    """
    wanted = RANDOM if sys.argv[1:2] and sys.argv[1] in SERVERS else FIXED
    if os.environ.get(SEED, RANDOM) == wanted or not sys.executable:
        return
    args = [sys.executable, *sys.orig_argv[1:]]
    if os.name != "nt":
        os.execve(sys.executable, args, {**os.environ, SEED: wanted})
    if wanted == RANDOM:
        return  # a demo's own: who ends it must not end one that only waits for it
    # Windows would not let whoever waits for this process wait for that one.
    import subprocess

    os.environ[SEED] = wanted
    _signal.signal(_signal.SIGINT, _signal.SIG_IGN)  # Ctrl-C is for that one, which gets it, too
    sys.exit(subprocess.call(args))


def _open_streams() -> None:
    """Replace a closed standard stream by an empty one.

    Else a file that is opened later would get its number, and what children write.
    """
    for name, mode in (("stdin", "r"), ("stdout", "w"), ("stderr", "w")):
        if getattr(sys, name) is None:
            setattr(sys, name, open(os.devnull, mode))  # noqa: SIM115 (as long as the process)


def _leave_threads(status: object) -> None:
    """End this process at once if daemon threads go on, such as one that a camera's driver holds.

    The interpreter would take all away from under them, C code included, and may crash by that.
    """
    import threading

    left = any(thread.daemon for thread in threading.enumerate())
    if not isinstance(status, int) or not left:
        return
    try:
        sys.stdout.flush()
        sys.stderr.flush()
    except OSError:  # the interpreter's to tell
        return
    os._exit(status)
