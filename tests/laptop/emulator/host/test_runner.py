"""Scripts run on the emulated brick: clocks, threads, signals and statuses as on a real one."""

import importlib
import io
import os
import random
import signal
import subprocess
import sys
import threading
import time
import traceback
import types

import pytest
from places import ROOT, SCRIPTS
from waiting import PATIENCE, until

from laptop.emulator.device.brick import EmulatedBrick
from laptop.emulator.device.buttons import read_press
from laptop.emulator.device.plant_constants import read_plant
from laptop.emulator.host import counting, processor, runner
from laptop.emulator.host.processor import SWITCH_INTERVAL
from laptop.emulator.host.runner import run_script
from laptop.emulator.host.watchdog import Watchdog
from laptop.emulator.host.world import World
from shared.arm_description import find_arm, read_arm

EPOCH = 1586476800.0


@pytest.fixture
def brick(request):
    """The planar arm, and a motor at D that moves nothing; a plant may be asked for."""
    plant = read_plant(getattr(request, "param", ""))
    return EmulatedBrick(World(), read_arm(find_arm("planar")), plant, extra={"D": "large"})


in_no_time = pytest.mark.parametrize("brick", ["cpu=0"], indirect=True)
"""For what looks at how waiting is timed: to go round, asking, is computing as well."""


@pytest.fixture
def run(tmp_path, brick, capsys):
    """Run source text on the emulated brick: (outcome, lines on stdout, text on stderr)."""

    def run(source, args=(), **options):
        script = tmp_path / "script.py"
        script.write_text(source)
        outcome = run_script(brick, str(script), args, **options)
        out, err = capsys.readouterr()
        return outcome, out.splitlines(), err

    return run


# Exit statuses, as `python3 script.py; echo $?` gives them


@pytest.mark.short(every=2)
@pytest.mark.parametrize(
    ("source", "status", "last_error"),
    [
        ("", 0, ""),
        ("import sys; sys.exit()", 0, ""),
        ("import sys; sys.exit(7)", 7, ""),
        ("import sys; sys.exit(256 + 3)", 3, ""),
        ("import sys; sys.exit(-1)", 255, ""),
        ("import sys; sys.exit(True)", 1, ""),
        ("import sys; sys.exit('no pen')", 1, "no pen"),
        ("exit(4)", 4, ""),
        ("raise SystemExit", 0, ""),
        ("raise ValueError('bad angle')", 1, "ValueError: bad angle"),
        ("def f(:", 1, "SyntaxError: invalid syntax"),
        ("raise KeyboardInterrupt", 130, "KeyboardInterrupt"),
        ("import os; os._exit(9)", 9, ""),
        ("import os\ntry: os._exit(9)\nfinally: print('never')", 9, ""),
        ("import argparse; argparse.ArgumentParser().parse_args(['--nonsense'])", 2, "--nonsense"),
        ("import threading, sys; threading.Thread(target=sys.exit, args=(5,)).start()", 0, ""),
        (
            "import threading; threading.Thread(target=lambda: 1 / 0).start()",
            0,
            "ZeroDivisionError",
        ),
        ("import _thread; _thread.start_new_thread(lambda: 1 / 0, ())", 0, "ZeroDivisionError"),
        ("import sys; sys.excepthook = lambda *e: print('mine'); 1 / 0", 1, ""),
    ],
)
def test_exit_status(run, source, status, last_error):
    outcome, out, err = run(source)
    assert (outcome.status, outcome.reason) == (status, "ended")
    assert "never" not in out
    assert last_error in (err.strip().splitlines() or [""])[-1]
    assert bool(err) == bool(last_error)


def test_traceback_shows_the_script_only(run, tmp_path):
    _, _, err = run("def f():\n    return 1 / 0\n\nf()\n")
    assert err.splitlines()[:2] == [
        "Traceback (most recent call last):",
        '  File "{}", line 4, in <module>'.format(tmp_path / "script.py"),
    ]
    assert os.path.join("laptop", "emulator") not in err


ERRING = {
    "a file": "open('/nowhere')",
    "a pause": "time.sleep('long')",
    "an attribute": "open('/sys/class/nowhere/x')",
    "a program": "subprocess.check_output(['nowhere'])",
    "a fork": "os.fork()",
    "a value that a motor does not take": "LargeMotor('outD').run_forever(speed_sp=99999)",
}


@pytest.mark.parametrize("erring", ERRING.values(), ids=ERRING)
@pytest.mark.parametrize(
    "message",
    [
        "{}",
        "try: {}\nexcept Exception: traceback.print_exc()",
        "try: {}\nexcept Exception: print(traceback.format_exc(), file=sys.stderr)",
        "try: {}\nexcept Exception: logging.exception('it broke')",
        "try:\n    try: {}\n    finally: [][1]\nexcept LookupError: traceback.print_exc()",
        "def work(): {}\nt = threading.Thread(target=work); t.start(); t.join()",
        "def work(): {}\n_thread.start_new_thread(work, ())\ntime.sleep(1)",
        "def work(): {}\natexit.register(work)",
        pytest.param(
            "class A:\n    def __del__(self): {}\na = A()\ndel a",
            marks=pytest.mark.skipif(sys.version_info < (3, 8), reason="Python itself tells of it"),
        ),
        "def look(): traceback.print_stack()\nlook()\n{}",
    ],
    ids=[
        "uncaught", "print_exc", "format_exc", "logged", "the cause of another", "in a thread",
        "in a bare thread", "at the end", "in __del__", "print_stack",
    ],
)  # fmt: skip
@pytest.mark.short(every=7)
def test_no_frame_of_the_emulator_stands_in_a_traceback(run, erring, message):
    source = (
        "import _thread, atexit, logging, os, subprocess, sys, threading, time, traceback\n"
        "from ev3dev2.motor import LargeMotor\n"
    )
    _, _, err = run(source + message.format(erring))
    assert "script.py" in err
    assert "Error: " in err
    assert os.path.join("laptop", "emulator") not in err


@pytest.mark.parametrize("brick", ["cpu=0", "cpu=1"], indirect=True)
@pytest.mark.parametrize(
    ("beside", "frames"),
    [("def f(:\n", ["script.py", "beside.py"]),
     ("def f():\n  1/0\nf()\n", ["script.py", "beside.py", "beside.py"]),
     (None, ["script.py"])],
    ids=["no Python", "it fails", "there is none"],
)  # fmt: skip
def test_the_traceback_of_an_import_shows_what_is_the_programs(run, tmp_path, beside, frames):
    if beside:
        (tmp_path / "beside.py").write_text(beside)
    _, _, err = run("import beside\n")
    files = [line.split('"')[1] for line in err.splitlines() if line.startswith("  File ")]
    assert [os.path.basename(file) for file in files] == frames


def test_tracebacks_of_the_host_are_whole_again_after_a_run(run):
    hooks = getattr(sys, "unraisablehook", None), traceback.TracebackException.__init__
    extracting = vars(traceback.StackSummary)["extract"]
    run("print(1)")
    assert hooks == (getattr(sys, "unraisablehook", None), traceback.TracebackException.__init__)
    assert vars(traceback.StackSummary)["extract"] is extracting


@pytest.mark.parametrize("name", ["missing.py", "."])
def test_a_script_that_is_not_there_is_refused_in_one_line(brick, tmp_path, capsys, name):
    outcome = run_script(brick, str(tmp_path / name))
    err = capsys.readouterr().err
    assert (outcome.status, outcome.reason) == (2, "no script")
    assert err.count("\n") == 1
    assert str(tmp_path) in err


def test_the_script_sees_what_python3_would_show_it(run, tmp_path):
    (tmp_path / "helper.py").write_text("import time\nNAME = __name__\nnow = time.time\n")
    (tmp_path / "package").mkdir()
    (tmp_path / "package" / "__init__.py").write_text("from .inner import VALUE\n")
    (tmp_path / "package" / "inner.py").write_text("VALUE = 5\n")
    before = os.getcwd()
    outcome, out, _ = run(
        "import helper, os, package, sys, __main__\n"
        "print(__name__, sys.argv, sys.path[0], os.getcwd())\n"
        "print(os.path.basename(__file__), __main__.x if hasattr(__main__, 'x') else '-')\n"
        "print(helper.NAME, round(helper.now(), -2), package.VALUE)\n",
        ["a", "--b"],
    )
    script = str(tmp_path / "script.py")
    assert out == [
        "__main__ {} {} {}".format([script, "a", "--b"], os.path.realpath(str(tmp_path)), before),
        "script.py -",
        f"helper {EPOCH} 5",
    ]
    assert outcome.status == 0


def test_nothing_of_a_run_is_left_in_the_host(run, tmp_path):
    (tmp_path / "wave_helper.py").write_text("import threading\n")
    names = (
        "time",
        "threading",
        "_thread",
        "signal",
        "select",
        "subprocess",
        "datetime",
        "logging",
    )
    before = {name: sys.modules.get(name) for name in names}
    seen = (list(sys.path), list(sys.argv), os.getcwd(), dict(os.environ), open, print, os.kill)
    handler = signal.getsignal(signal.SIGINT)
    dice = random.getstate()
    run(
        "import os, sys, signal, random, atexit, wave_helper, queue\n"
        "import ev3dev2.motor, robot.ev3.motors\n"
        "sys.path.append('x'); sys.argv.append('y'); os.chdir('/'); os.environ['ARM'] = '1'\n"
        "import io; sys.stdout = sys.stderr = io.StringIO()\n"
        "signal.signal(signal.SIGINT, signal.SIG_IGN); random.random()\n"
        "import builtins; builtins.hello = 1\n"
    )
    assert {name: sys.modules.get(name) for name in names} == before
    assert seen == (
        list(sys.path),
        list(sys.argv),
        os.getcwd(),
        dict(os.environ),
        open,
        print,
        os.kill,
    )
    assert signal.getsignal(signal.SIGINT) is handler
    assert random.getstate() == dice
    assert "wave_helper" not in sys.modules
    with pytest.raises(NameError):
        hello  # noqa: B018, F821
    assert time.time() > EPOCH + 1e7


def test_the_host_keeps_its_own_copy_of_the_library_and_of_the_robot(run):
    library = importlib.import_module("ev3dev2.motor")
    kinematics = importlib.import_module("robot.motion.kinematics")
    before = (sys.modules["ev3dev2"].get_current_platform, library.time, library.OUTPUT_A)
    _, out, _ = run(
        "import ev3dev2.motor, robot.motion.kinematics\n"
        "print(ev3dev2.motor.OUTPUT_A, id(ev3dev2.motor), id(robot.motion.kinematics))\n"
    )
    assert out[0].split()[0] == "ev3-ports:outA"
    assert str(id(library)) not in out[0]
    assert str(id(kinematics)) not in out[0]
    assert sys.modules["ev3dev2.motor"] is library
    assert (sys.modules["ev3dev2"].get_current_platform, library.time, library.OUTPUT_A) == before


def test_a_sibling_comes_before_a_module_of_the_host(run, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "config", types.ModuleType("config"))
    (tmp_path / "config.py").write_text("NAME = 'sibling'\n")
    assert run("import config; print(config.NAME)")[1] == ["sibling"]
    assert not hasattr(sys.modules["config"], "NAME")


@pytest.mark.parametrize("brick", ["cpu=0", "cpu=1"], indirect=True)
def test_a_module_is_compiled_once_and_again_when_it_has_changed(run, tmp_path, monkeypatch):
    compiled = []

    def compiling(source, name, *args, **kwargs):
        compiled.append(os.path.basename(name))
        return compile(source, name, *args, **kwargs)

    for module in importlib._bootstrap_external, counting:
        monkeypatch.setattr(module, "compile", compiling, raising=False)
    monkeypatch.setattr(sys, "dont_write_bytecode", True)
    lesson = tmp_path / "lesson.py"
    lesson.write_text("print('first')\n")
    for _ in range(3):
        assert run("import lesson\n")[1] == ["first"]
    lesson.write_text("print('then')\n")
    assert run("import lesson\n")[1] == ["then"]
    assert compiled.count("lesson.py") == 2


def test_a_program_killed_inside_an_import_does_not_block_the_next(run, tmp_path):
    (tmp_path / "lesson.py").write_text("import time\ntime.sleep(9)\nprint('imported')\n")
    assert run("import lesson\n", kill_at=1)[0].reason == "killed"
    outcome, out, _ = run("import lesson\n")
    assert (outcome.status, out) == (0, ["imported"])


def test_the_back_button_does_nothing_once_the_program_has_ended(run, brick):
    outcome, _, _ = run(MOVE, presses=[read_press("back@2")], aftermath=3)
    assert outcome.reason == "ended"
    assert brick.driven() == ["D"]


def test_sibling_modules_of_two_scripts_do_not_mix(brick, tmp_path, capsys):
    for name in ("one", "two"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "config.py").write_text(f"NAME = {name!r}\n")
        (tmp_path / name / "main.py").write_text("import config; print(config.NAME)\n")
        run_script(brick, str(tmp_path / name / "main.py"))
    assert capsys.readouterr().out.split() == ["one", "two"]


def test_objects_are_let_go_before_the_world_stops_listening(run, brick):
    _, out, _ = run(
        "import time\nfrom ev3dev2.motor import LargeMotor, OUTPUT_D\n"
        "class Arm:\n"
        "    def __init__(self): self.m = LargeMotor(OUTPUT_D); self.m.run_forever(speed_sp=100)\n"
        "    def __del__(self): self.m.stop(); print('stopped', self.m.position > 50)\n"
        "arm = Arm()\ntime.sleep(1)\n"
    )
    assert out == ["stopped True"]
    assert brick.driven() == []


# Time


@in_no_time
@pytest.mark.short(every=2)
@pytest.mark.parametrize(
    ("source", "seconds"),
    [
        ("from time import sleep\nsleep(1.5)", 1.5),
        ("import time\nend = time.time() + 2\nwhile time.time() < end: pass", 2.0),
        ("import time\nend = time.monotonic() + 2\nwhile time.monotonic() < end: pass", 2.0),
        ("import time\nend = time.perf_counter() + 2\nwhile time.perf_counter() < end: pass", 2.0),
        ("from datetime import datetime, timedelta\nend = datetime.now() + timedelta(seconds=2)\n"
         "while datetime.now() < end: pass", 2.0),
        ("from ev3dev2.stopwatch import StopWatch\ns = StopWatch(); s.start()\n"
         "while not s.is_elapsed_ms(2000): pass", 2.0),
        ("import threading\nthreading.Event().wait(1.25)", 1.25),
        ("import threading\nt = threading.Timer(1.25, print); t.start(); t.join()", 1.25),
        ("import threading\nthreading.Timer(1.25, print).start()", 1.25),
        ("import threading\nt = threading.Timer(9, print); t.start(); t.cancel(); t.join()", 0),
        ("import threading\nl = threading.Lock(); l.acquire(); l.acquire(timeout=0.75)", 0.75),
        ("import threading\nc = threading.Condition()\nwith c: c.wait(0.75)", 0.75),
        ("import threading\ns = threading.Semaphore(0); s.acquire(timeout=0.75)", 0.75),
        ("import queue\ntry: queue.Queue().get(timeout=0.75)\nexcept queue.Empty: pass", 0.75),
        ("import queue\ntry: queue.SimpleQueue().get(timeout=0.75)\nexcept queue.Empty: pass"
         if sys.version_info >= (3, 7) else "import time; time.sleep(0.75)", 0.75),
        ("import select\nselect.select([], [], [], 0.75)", 0.75),
        ("import select\nselect.poll().poll(750)", 0.75),
        ("import sched, time\ns = sched.scheduler(); s.enter(0.75, 1, print); s.run()", 0.75),
        ("import signal\nsignal.signal(signal.SIGALRM, lambda *a: None)\n"
         "signal.alarm(3); signal.pause()",
         3.0),
        ("import subprocess\nsubprocess.call(['beep', '-l', '750'])", 0.75),
        ("import os\nos.system('sleep 0.75')", 0.75),
        ("from concurrent.futures import ThreadPoolExecutor\nimport time\n"
         "with ThreadPoolExecutor(2) as pool: list(pool.map(time.sleep, [0.75, 0.75, 0.75]))", 1.5),
        ("import asyncio\nloop = asyncio.new_event_loop()\n"
         "loop.run_until_complete(asyncio.sleep(0.75)); loop.close()", 0.75),
    ],
)  # fmt: skip
def test_what_waits_waits_in_virtual_time(run, source, seconds):
    outcome, _, err = run(source, aftermath=0)
    assert (outcome.status, err) == (0, "")
    assert seconds <= outcome.t < seconds + 0.1


def test_clocks_agree(run):
    _, out, _ = run(
        "import time, datetime\n"
        "a = time.time(), time.monotonic(), time.perf_counter(), datetime.datetime.now()\n"
        "time.sleep(20)\n"
        "b = time.time(), time.monotonic(), time.perf_counter(), datetime.datetime.now()\n"
        "print(*(round(y - x) for x, y in zip(a[:3], b)), (b[3] - a[3]).seconds)\n"
        "print(round(time.mktime(time.localtime()) - time.time()), time.gmtime().tm_year)\n"
        "print(datetime.datetime.now().timestamp() - time.time() < 1e-3,\n"
        "      datetime.date.today().year)\n"
        "print(isinstance(b[3] + datetime.timedelta(1), datetime.datetime), time.strftime('%Y'))\n"
        "print(time.process_time() < 10)\n"
    )
    assert out == ["20 20 20 20", "0 2020", "True 2020", "True 2020", "True"]


def test_a_kind_of_date_of_a_program_holds_none_but_its_own(run):
    _, out, _ = run(
        "import datetime\n"
        "class Day(datetime.date):\n    pass\n"
        "today, mine = datetime.date.today(), Day(2020, 4, 10)\n"
        "print(isinstance(today, Day), isinstance(mine, Day), isinstance(mine, datetime.date))\n"
        "print(issubclass(datetime.datetime, Day), issubclass(Day, datetime.date))\n"
    )
    assert out == ["False True True", "False True"]


# Threads


def test_threads_share_the_clock(run):
    _, out, _ = run(
        "import threading, time, queue\n"
        "t0 = time.time()\n"
        "def at(): return round(time.time() - t0, 2)\n"
        "q = queue.Queue(maxsize=2)\n"
        "class Producer(threading.Thread):\n"
        "    def __init__(self):\n"
        "        super().__init__(name='producer')\n"
        "    def run(self):\n"
        "        for i in range(4):\n"
        "            time.sleep(0.5); q.put(i)\n"
        "        q.put(None)\n"
        "p = Producer(); p.start()\n"
        "print(p.is_alive(), p.name, threading.active_count(),\n"
        "      sorted(t.name for t in threading.enumerate()))\n"
        "while True:\n"
        "    item = q.get()\n"
        "    if item is None: break\n"
        "    print(item, at())\n"
        "p.join()\n"
        "print(p.is_alive(), threading.active_count(), threading.current_thread().name)\n"
        "print(threading.current_thread() is threading.main_thread())\n"
    )
    assert out == [
        "True producer 2 ['MainThread', 'producer']",
        "0 0.5", "1 1.0", "2 1.5", "3 2.0",
        "False 1 MainThread", "True",
    ]  # fmt: skip


def test_python_waits_for_threads_but_not_for_daemons_then_runs_exit_calls(run):
    outcome, out, _ = run(
        "import atexit, threading, time\nbegan = time.monotonic()\n"
        "atexit.register(print, 'first registered')\n"
        "atexit.register(lambda: print('last registered', time.monotonic() > began + 1.5))\n"
        "def work(name, seconds):\n"
        "    time.sleep(seconds); print(name)\n"
        "threading.Thread(target=work, args=('worker', 2)).start()\n"
        "threading.Thread(target=work, args=('daemon', 1), daemon=True).start()\n"
        "threading.Thread(target=work, args=('late daemon', 3), daemon=True).start()\n"
        "print('main')\n",
        aftermath=5,
    )
    assert out == ["main", "daemon", "worker", "last registered True", "first registered"]
    assert outcome.t == pytest.approx(2, abs=0.01)


def test_lock_barrier_and_condition_among_threads(run):
    _, out, _ = run(
        "import threading, time\n"
        "lock, barrier, log = threading.RLock(), threading.Barrier(3), []\n"
        "def work(n):\n"
        "    for _ in range(2):\n"
        "        with lock:\n"
        "            with lock: log.append(n); time.sleep(0.1); log.append(n)\n"
        "    barrier.wait(); log.append('b')\n"
        "ts = [threading.Thread(target=work, args=(n,)) for n in range(3)]\n"
        "for t in ts: t.start()\n"
        "for t in ts: t.join()\n"
        "print(*log)\n"
    )
    columns = out[0].split()
    assert columns[-3:] == ["b"] * 3
    pairs = list(zip(columns[:-3:2], columns[1:-3:2]))
    # Nobody gets between two entries of one, and nobody is kept out by another's hurry.
    assert all(a == b for a, b in pairs)
    assert [a for a, _ in pairs] == ["0", "1", "2", "0", "1", "2"]


@pytest.mark.parametrize("brick", ["cpu=0", "cpu=1", "cpu=4"], indirect=True)
def test_library_thread_and_spinning_main(run):
    # `while not flag: pass` touches nothing: the valve lets the thread get on, or the count.
    outcome, out, _ = run(
        "import threading, time\nfound, began = [], time.monotonic()\n"
        "def look():\n    time.sleep(1); found.append(time.monotonic() - began)\n"
        "threading.Thread(target=look).start()\n"
        "while not found: pass\n"
        "print(round(found[0], 1))\n"
    )
    assert (outcome.status, out) == (0, ["1.0"])


def test_who_goes_round_lets_others_have_their_turn_every_5_ms(run, monkeypatch):
    monkeypatch.setattr(Watchdog, "YIELD_TIMEOUT", 1e9)
    source = (
        "import threading, time\nturns = []\n"
        "def spin():\n    while len(turns) < 100: pass\n"
        "threading.Thread(target=spin).start()\n"
        "for k in range(100):\n    time.sleep(0.001); turns.append(time.monotonic())\n"
        "print(*sorted(b - a for a, b in zip(turns, turns[1:])))\n"
    )
    out = run(source, patience=10)[1]
    between = [float(word) for word in out[0].split()]
    # Who sleeps looks at the clock before and after, and at each look it is the other's turn.
    assert 3 * SWITCH_INTERVAL < between[10] <= between[-10] < 3.1 * SWITCH_INTERVAL


def test_a_signal_is_heard_by_who_goes_round(run, monkeypatch):
    monkeypatch.setattr(Watchdog, "YIELD_TIMEOUT", 1e9)
    source = MOVE + "while True: pass\n"
    outcome, _, _ = run(source, signals=[(2.0, number("SIGINT"))], patience=10)
    assert (outcome.status, outcome.reason) == (130, "ended")
    assert outcome.t == pytest.approx(2.0, abs=0.02)


def test_who_computes_for_ever_comes_to_the_time_limit_and_is_told_where(run, monkeypatch):
    for module in processor, runner:
        monkeypatch.setattr(module, "MAX_START", 0.5)
    source = "def go():\n    k = 0\n    while True:\n        k += 1\n\n\ngo()\n"
    outcome, _, err = run(source, timeout=1, patience=PATIENCE)
    assert (outcome.status, outcome.reason, outcome.t) == (124, "timeout", 1)
    assert outcome.stack == (("script.py", 3, "go"), ("script.py", 7, "<module>"))
    assert err.splitlines()[0] == (
        "simulate: script.py: it has computed for 0.5 s on the brick, and has not used it yet; "
        "Ctrl-C ends it"
    )
    assert err.endswith("; it was at line 3 (go)\n")


def test_who_has_used_the_brick_is_not_said_to_be_late(run, monkeypatch):
    monkeypatch.setattr(processor, "MAX_START", 3)  # (Python's start takes 1.2 s)
    _, _, err = run("import time\ntime.sleep(0)\nwhile True: pass\n", timeout=4)
    assert "has not used it yet" not in err
    assert err.count("\n") == 1


def test_where_a_script_was_cut_off_is_told_by_the_calls_in_its_folder(run, tmp_path):
    (tmp_path / "helper.py").write_text("import time\ndef wait():\n    time.sleep(1)\n")
    source = "from helper import wait\nimport json\ndef go():\n    while True: wait()\ngo()\n"
    outcome, _, err = run(source, timeout=2.5)
    assert outcome.stack[0] == ("helper.py", 3, "wait")
    assert err.endswith("; it was at helper.py line 3 (wait), called at line 4 (go)\n")
    assert run("print(1)")[0].stack == ()


@pytest.mark.short(every=2)
@pytest.mark.parametrize(
    "wait",
    ["while not e.is_set(): pass", "while t.is_alive(): pass", "while q.empty(): pass",
     "while not l.acquire(False): pass", "while not found: print('.', end='')"],
)  # fmt: skip
def test_loops_that_ask_threads_cost_time_and_repeat(run, monkeypatch, wait):
    source = (
        "import threading, time, queue\n"
        "found, e, q, l = [], threading.Event(), queue.Queue(), threading.Lock()\n"
        "l.acquire()\n"
        "def look():\n    time.sleep(1); found.append(1); e.set(); q.put(1); l.release()\n"
        "t = threading.Thread(target=look); t.start()\n" + wait
    )
    monkeypatch.setattr(Watchdog, "YIELD_TIMEOUT", 1e9)
    outcome, _, _ = run(source, aftermath=0, patience=PATIENCE)
    assert outcome.t == pytest.approx(1, abs=0.02)


@pytest.mark.parametrize("kind", ["Lock", "RLock"])
def test_a_signal_leaves_no_lock_taken(run, kind):
    """Wherever it comes: `with` lets go of what it took."""
    _, out, _ = run(
        "import signal, threading\n"
        "def come(*args): raise KeyboardInterrupt\n"
        "signal.signal(signal.SIGALRM, come)\n"
        f"lock, free = threading.{kind}(), []\n"
        "def ask(): free.append(lock.acquire(timeout=0.01) and not lock.release())\n"
        "for k in range(1, 60):\n"
        "    signal.setitimer(signal.ITIMER_REAL, 2e-4 * k)\n"
        "    try:\n"
        "        while True:\n"
        "            with lock:\n"
        "                for _ in range(40): pass\n"
        "    except KeyboardInterrupt: pass\n"
        "    t = threading.Thread(target=ask); t.start(); t.join()\n"
        "print(len(free), all(free))\n"
    )
    assert out == ["59 True"]


def test_deadlock_is_an_error_in_one_line(run):
    outcome, _, err = run("import threading\nl = threading.Lock()\nl.acquire()\nl.acquire()\n")
    assert (outcome.status, outcome.reason) == (124, "deadlock")
    assert err.count("\n") == 1


def test_uncaught_error_in_a_thread_keeps_its_lines(run):
    _, _, err = run(
        "import threading\ndef f():\n    raise ValueError('x')\n"
        "t = threading.Thread(target=f, name='pump'); t.start(); t.join()\n"
    )
    assert err.startswith("Exception in thread pump:\nTraceback")
    assert "script.py" in err
    assert os.path.join("laptop", "emulator") not in err


# Ends that the program did not choose

MOVE = (
    "import signal, sys, time\nfrom ev3dev2.motor import LargeMotor, OUTPUT_D\n"
    "m = LargeMotor(OUTPUT_D)\nm.run_forever(speed_sp=100)\n"
)
CAREFUL = (
    MOVE + "try:\n    while True: time.sleep(0.01)\n"
    "finally:\n    m.stop(); open(sys.argv[1], 'w').close(); print('cleaned up')\n"
)


def number(name):
    return int(getattr(signal, name))


@pytest.mark.short(every=2)
@pytest.mark.parametrize(
    ("options", "status", "reason", "end"),
    [
        ({"freeze_at": 2.0}, 124, "frozen", 2.0),
        ({"kill_at": 2.0}, 137, "killed", 2.0),
        ({"timeout": 2.0}, 124, "timeout", 2.0),
        ({"signals": [(2.0, number("SIGTERM"))]}, 143, "SIGTERM", 2.0),
        ({"signals": [(2.0, number("SIGHUP"))]}, 129, "SIGHUP", 2.0),
        ({"signals": [(2.0, number("SIGKILL"))]}, 137, "SIGKILL", 2.0),
        ({"signals": [(2.0, number("SIGSTOP"))]}, 124, "frozen", 2.0),
        ({"presses": [read_press("back@2")]}, 137, "back button", 2.0),
    ],
)
def test_a_program_that_is_ended_from_outside_never_acts_again(
    run, brick, tmp_path, options, status, reason, end
):
    marker = tmp_path / "marker"
    outcome, out, err = run(CAREFUL, [str(marker)], aftermath=3.0, **options)
    assert (outcome.status, outcome.reason) == (status, reason)
    assert outcome.t == end
    assert out == []
    assert err.count("\n") <= 1
    assert not marker.exists()
    # The world went on alone, with the motor as the program left it or as brickrun did.
    assert brick.world.now() == end + 3.0
    position = int(brick.motors["D"].read("position"))
    if reason == "back button":
        assert brick.driven() == []
        assert position < 20
    else:
        assert brick.driven() == ["D"]
        assert position == pytest.approx(500, abs=10)


@pytest.mark.short(every=2)
@pytest.mark.parametrize(
    ("handling", "options", "status", "last"),
    [
        ("", {"signals": [(2.0, number("SIGINT"))]}, 130, "cleaned up"),
        ("signal.signal(signal.SIGTERM, lambda n, f: sys.exit(5))\n",
         {"signals": [(2.0, number("SIGTERM"))]}, 5, "cleaned up"),
        ("signal.signal(signal.SIGHUP, lambda n, f: print(n) or sys.exit(6))\n",
         {"signals": [(2.0, number("SIGHUP"))]}, 6, "cleaned up"),
        ("signal.signal(signal.SIGINT, signal.SIG_IGN)\n"
         "signal.signal(signal.SIGTERM, lambda n, f: sys.exit(7))\n",
         {"signals": [(1.0, number("SIGINT")), (2.0, number("SIGTERM"))]}, 7, "cleaned up"),
        ("signal.signal(signal.SIGALRM, lambda n, f: sys.exit(8))\nsignal.setitimer(0, 2.0)\n",
         {}, 8, "cleaned up"),
    ],
)  # fmt: skip
def test_signals_reach_the_handlers_of_the_program(
    run, brick, tmp_path, handling, options, status, last
):
    source = CAREFUL.replace("try:", handling + "try:", 1)
    outcome, out, _ = run(source, [str(tmp_path / "marker")], **options)
    assert (outcome.status, outcome.reason) == (status, "ended")
    assert out[-1] == last
    assert outcome.t == pytest.approx(2.0, abs=0.05)
    assert brick.driven() == []


@pytest.mark.short(every=2)
@pytest.mark.parametrize(
    "wait",
    ["time.sleep(60)", "threading.Event().wait()", "t.join()", "q.get()", "m.wait(lambda s: False)",
     "signal.pause()"],
)  # fmt: skip
def test_a_signal_gets_through_every_wait(run, wait):
    outcome, _, _ = run(
        MOVE + "import queue, threading\nq = queue.Queue()\n"
        "t = threading.Thread(target=time.sleep, args=(60,), daemon=True); t.start()\n"
        "try:\n    " + wait + "\nexcept KeyboardInterrupt:\n    sys.exit(9)\n",
        signals=[(2.0, number("SIGINT"))],
    )
    assert outcome.status == 9
    assert outcome.t == pytest.approx(2.0, abs=0.02)


def test_a_handler_that_returns_lets_the_sleep_go_on(run):
    _, out, _ = run(
        MOVE + "signal.signal(signal.SIGTERM, lambda n, f: print('term'))\n"
        "t0 = time.time()\ntime.sleep(5)\nprint(round(time.time() - t0, 2))\n",
        signals=[(2.0, number("SIGTERM"))],
    )
    assert out == ["term", "5.0"]


def test_the_program_can_signal_itself_and_nobody_else(run):
    outcome, out, _ = run(
        "import os, signal, subprocess\n"
        "signal.signal(signal.SIGUSR1, lambda n, f: print('usr1'))\n"
        "os.kill(os.getpid(), signal.SIGUSR1)\n"
        "try: os.kill(1, signal.SIGTERM)\nexcept ProcessLookupError: print('nobody')\n"
        "os.kill(os.getpid(), signal.SIGTERM)\nprint('never')\n"
    )
    assert out == ["usr1", "nobody"]
    assert outcome.status == 143


def test_frozen_stays_frozen_with_all_its_threads(run, brick):
    outcome, out, _ = run(
        MOVE + "import threading\n"
        "def watchdog():\n"
        "    while True:\n        time.sleep(0.1); m.speed_sp\n"
        "        if time.monotonic() > began + 3: m.stop()\n"
        "began = time.monotonic()\n"
        "threading.Thread(target=watchdog).start()\n"
        "while True:\n"
        "    try: time.sleep(0.05)\n    except BaseException: print('never')\n",
        freeze_at=1.0,
        aftermath=10,
    )
    assert out == []
    assert brick.driven() == ["D"]
    accesses = brick.sysfs.accesses
    time.sleep(0.02)
    assert brick.sysfs.accesses == accesses


def test_accesses_of_a_run_are_its_own(run, brick):
    first, _, _ = run(MOVE + "m.stop()\n")
    second, _, _ = run(MOVE + "m.stop()\n")
    assert first.accesses == second.accesses
    assert brick.sysfs.accesses == 2 * first.accesses


def test_motor_waits_end_by_their_timeout(run):
    _, out, _ = run(
        MOVE + "t0 = time.time()\nprint(m.wait_while('running', timeout=3000))\n"
        "print(round(time.time() - t0, 2))\n"
        "print(m.wait_until('running'), m.is_running, m.position > 280)\n"
    )
    assert out[::2] == ["False", "True True True"]
    # It looks at the clock every 100 ms at most.
    assert 3.0 <= float(out[1]) < 3.11


def test_everything_of_auto_has_the_names_of_the_ev3(run):
    pytest.importorskip("PIL.Image")
    _, out, _ = run(
        "from ev3dev2.auto import *\n"
        "print(OUTPUT_A, INPUT_1, sorted(LEDS), get_current_platform())\n"
        "print(LargeMotor(OUTPUT_D).address, Button().any(), Leds().leds.keys() == LEDS.keys())\n"
    )
    assert out == [
        "ev3-ports:outA ev3-ports:in1 ['green_left', 'green_right', 'red_left', 'red_right'] ev3",
        "ev3-ports:outD False True",
    ]


def test_tank_and_odometry_of_the_library(run):
    # odometry_start() spins until its thread has begun.
    _, out, _ = run(
        "from ev3dev2.motor import MoveDifferential, MoveTank, OUTPUT_A, OUTPUT_D, SpeedRPM\n"
        "from ev3dev2.wheel import EV3Tire\nimport time\n"
        "t0 = time.time()\n"
        "MoveTank(OUTPUT_A, OUTPUT_D).on_for_seconds(5, 5, 0.5)\nprint(time.time() - t0)\n"
        "m = MoveDifferential(OUTPUT_A, OUTPUT_D, EV3Tire, 120)\n"
        "m.odometry_start()\nm.on_for_distance(SpeedRPM(10), 5)\ntime.sleep(0.3)\n"
        "m.odometry_stop()\nprint(m.y_pos_mm)\n"
    )
    assert float(out[0]) == pytest.approx(0.55, abs=0.06)
    assert float(out[1]) == pytest.approx(5, abs=1.5)


def test_sockets_among_threads_of_the_script(run):
    _, out, _ = run(
        "import socket, threading, time\n"
        "server = socket.socket(); server.bind(('127.0.0.1', 0)); server.listen(1)\n"
        "def client():\n"
        "    time.sleep(1)\n"
        "    c = socket.create_connection(server.getsockname()); c.sendall(b'hello')\n"
        "    time.sleep(1); c.close()\n"
        "began = time.monotonic()\n"
        "threading.Thread(target=client).start()\n"
        "peer, _ = server.accept()\n"
        "print(peer.recv(9), round(time.monotonic() - began, 1))\n"
        "print(peer.recv(9), round(time.monotonic() - began, 1))\n"
        "peer.close(); server.close()\n"
    )
    assert [line.split()[0] for line in out] == ["b'hello'", "b''"]
    assert 1 <= float(out[0].split()[1]) <= 2
    assert out[1].split()[1] == "2.0"


def test_input_is_read_from_the_host(run, monkeypatch):
    import io

    monkeypatch.setattr(sys, "stdin", io.StringIO("3.5\n"))
    outcome, out, err = run("x = float(input('x? '))\nprint(x)\ninput()\n")
    assert out == ["x? 3.5"]
    assert outcome.status == 1
    assert "EOFError" in err


def test_unseeded_dice_repeat(run):
    results = []
    for _ in range(2):
        results.append(run("import random; print(random.random())")[1])
        random.random()
    assert results[0] == results[1]


def test_folders_are_listed_in_one_order(run, tmp_path):
    names = [f"motor{n}" for n in range(40)]
    (tmp_path / "many").mkdir()
    for name in reversed(names):
        (tmp_path / "many" / name).write_text("")
    _, out, _ = run("import os, sys; print(*os.listdir(sys.argv[1]))", [str(tmp_path / "many")])
    assert out[0].split() == names, "motor9 before motor10: port A comes first"


# Real time and real signals


def test_a_real_signal_reaches_the_script(tmp_path):
    script = tmp_path / "careful.py"
    script.write_text(CAREFUL.replace("try:", "print('ready', flush=True)\ntry:", 1))
    program = (
        "import sys; sys.path.insert(0, {!r})\n"
        "from laptop.emulator.host.runner import run_script\n"
        "from laptop.emulator.device.brick import EmulatedBrick\n"
        "from laptop.emulator.pace import PacedClock\n"
        "from laptop.emulator.host.world import World\n"
        "from shared.arm_description import find_arm, read_arm\n"
        "arm = read_arm(find_arm('planar'))\n"
        "brick = EmulatedBrick(World(PacedClock({!r})), arm, extra={{'D': 'large'}})\n"
        "outcome = run_script(brick, {!r}, [{!r}], aftermath=0.1)\n"
        "print(brick.driven())\n"
        "sys.exit(outcome.status)\n"
    ).format(str(ROOT), str(tmp_path), str(script), str(tmp_path / "marker"))
    process = subprocess.Popen(
        [sys.executable, "-c", program], stdout=subprocess.PIPE, stderr=subprocess.PIPE
    )
    try:
        assert process.stdout.readline().split() == [b"ready"]
        process.send_signal(signal.SIGINT)
        out, err = process.communicate(timeout=PATIENCE)
    finally:
        process.kill()
    assert process.returncode == 130
    assert out.split() == [b"cleaned", b"up", b"[]"]
    assert err.strip().endswith(b"KeyboardInterrupt")


def test_runs_from_any_thread_of_the_host(run):
    results = []
    thread = threading.Thread(target=lambda: results.append(run("import time; time.sleep(1)")[0]))
    thread.start()
    thread.join(PATIENCE)
    assert results[0].status == 0


class LateKeyboard(io.StringIO):
    """A terminal's keyboard, or a pipe, on which a line comes late: never, to a pipe."""

    def __init__(self, world, is_terminal):
        super().__init__()
        self.isatty = lambda: is_terminal
        self._late = (lambda: time.sleep(0.6)) if is_terminal else (lambda: self._ended(world))

    @staticmethod
    def _ended(world):
        until(lambda: world.exit, "the end", lambda: time.sleep(0.5))

    def readline(self, size=-1):
        self._late()
        return "yes\n"


@pytest.mark.parametrize(
    ("is_terminal", "reason"), [(True, "ended"), (False, "waiting")], ids=["terminal", "pipe"]
)
def test_a_person_at_the_keyboard_may_take_all_the_time(
    run, brick, monkeypatch, is_terminal, reason
):
    monkeypatch.setattr(Watchdog, "WAIT_TIMEOUT", 0.1)
    monkeypatch.setattr(sys, "stdin", LateKeyboard(brick.world, is_terminal))
    outcome, out, _ = run("print(input('ready? '))\n")
    assert outcome.reason == reason
    assert out == ["ready? yes" if is_terminal else "ready? "]


# Scripts in the style of course repositories, on the emulated arm


COURSES = {}


@pytest.fixture
def course(capsys):
    """Run one of the scripts beside the tests on the emulated planar arm, or look at it again."""

    def course(name, *args, **options):
        brick = EmulatedBrick(World(), read_arm(find_arm("planar")))
        presses = [read_press(press) for press in options.pop("presses", ())]
        outcome = run_script(
            brick, str(SCRIPTS / name), args, presses=presses, aftermath=1.0, **options
        )
        out, err = capsys.readouterr()
        return outcome, out.splitlines(), err, brick

    def once(name, *args, again=False, **options):
        """What the first such run gave, or another one."""
        key = name, args, repr(options)
        if again or key not in COURSES:
            COURSES[key] = course(name, *args, **options)
        return COURSES[key]

    return once


COURSE = [
    ("lab1_moves.py", (), {}),
    ("lab2_points.py", ("--speed", "12"), {}),
    ("lab3_menu.py", (), {"presses": ["down@1", "enter@2", "up@4", "up@5", "enter@6", "left@8"]}),
    ("lab4_touch_thread.py", (), {"presses": ["touch@4"]}),
    ("lab5_homing.py", (), {}),
    ("lab6_pd_loop.py", (), {}),
    ("lab6_pd_loop.py", (), {"signals": [(1.5, number("SIGTERM"))]}),
]


@pytest.mark.short(every=3)
@pytest.mark.parametrize(("name", "args", "options"), COURSE)
def test_course_script_repeats_exactly_and_leaves_no_motor_driven(course, name, args, options):
    if name.startswith("lab5"):
        pytest.importorskip("PIL.Image")
    first = course(name, *args, **dict(options))
    second = course(name, *args, again=True, **dict(options))
    assert first[:3] == second[:3]
    assert first[3].record == second[3].record
    assert first[0].reason == "ended"
    assert first[3].driven() == []


def test_moves_lab_gets_where_it_says(course):
    outcome, out, err, _ = course("lab1_moves.py")
    assert (outcome.status, err) == (0, "")
    values = [[float(word) for word in line.split() if word.lstrip("-").replace(".", "").isdigit()]
              for line in out[:3]]  # fmt: skip
    for got, wanted in zip(values, ([45], [-30], [0, 0])):
        assert got == pytest.approx(wanted, abs=3)
    assert out[3] == "stopped True"


def test_points_lab_reads_its_file_and_moves_both_joints(course):
    outcome, out, _, brick = course("lab2_points.py", "--speed", "12")
    assert outcome.status == 0
    assert [line.partition(":")[0] for line in out[:3]] == [
        "(15.0, 5.0)",
        "(14.0, 7.0)",
        "(12.0, 9.0)",
    ]
    assert course("lab2_points.py", "--file", "no.txt")[0].status == 1


def test_menu_lab_follows_the_buttons(course):
    outcome, out, _, _ = course(
        "lab3_menu.py", presses=["down@1", "enter@2", "up@4", "up@5", "enter@6", "left@8"]
    )
    assert outcome.status == 3
    text = "\n".join(out)
    assert "pen down done" in text
    assert " V" in text
    assert outcome.t == pytest.approx(8.0, abs=0.2)


def test_touch_lab_notices_the_press_in_its_thread(course):
    outcome, out, _, _ = course("lab4_touch_thread.py", presses=["touch@4"])
    assert outcome.status == 0
    assert float(out[-1].split()[-1]) == pytest.approx(4.0, abs=0.1)


def test_homing_lab_finds_both_stops(course):
    pytest.importorskip("PIL.Image")
    outcome, out, err, _ = course("lab5_homing.py")
    assert (outcome.status, err) == (0, "")
    assert out[0].startswith("range ")
    assert "stalled" in out[1]


def test_pd_lab_stops_when_told(course):
    whole = course("lab6_pd_loop.py")
    cut = course("lab6_pd_loop.py", signals=[(1.5, number("SIGTERM"))])
    assert whole[0].t == pytest.approx(3.2, abs=0.1)
    # The producer is not a daemon: Python waits for it.
    assert cut[0].status == 0
    assert cut[1][-1] == f"INFO stopped after {int(cut[1][-1].split()[-2])} ticks"
    assert 70 <= int(cut[1][-1].split()[-2]) <= 76


# What `import *` from the library hands on


STAR = """
import time, logging
from ev3dev2.motor import *
logging.basicConfig(format="%(asctime)s %(message)s", stream=sys.stdout)
logging.warning("said")
print(time.strftime("%Y"), time.time() > 1e9)
begun = time.time()
while time.time() - begun < 1.5:
    pass
print(time.monotonic() > 1.4, callable(time.clock))
"""


def test_a_star_import_from_the_library_leaves_a_whole_time_module(run):
    outcome, out, err = run("import sys\n" + STAR)
    assert (outcome.status, err) == (0, "")
    assert out[0].startswith("2020-04-10")
    assert out[1:] == ["2020 True", "True True"]


SPIN = """
import threading
from ev3dev2.button import Button
stop = False
def wait():
    global stop
    Button().wait_for_bump("enter")
    stop = True
threading.Thread(target=wait).start()
while not stop:
    pass
print("stopped")
"""


def test_a_spinning_thread_lets_another_wait_for_a_button(run):
    outcome, out, _ = run(SPIN, presses=[read_press("enter@2.0")])
    assert (outcome.status, out) == (0, ["stopped"])
    assert 2.0 < outcome.t < 3.0


def test_a_socket_times_out_in_virtual_time(run):
    source = """
import socket, time
s = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
s.bind(("127.0.0.1", 0))
s.settimeout(30.0)
began = time.monotonic()
try:
    s.recvfrom(10)
except socket.timeout:
    print(round(time.monotonic() - began))
s.close()
"""
    outcome, out, _ = run(source)
    assert (outcome.status, out) == (0, ["30"])
