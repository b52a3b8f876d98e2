"""Programs that scripts start: the shell's line, the brick's small programs, and other scripts."""

import os
import subprocess
import sys

import pytest

from laptop.emulator.device.brick import EmulatedBrick
from laptop.emulator.host.brick_shell import Command, split_line
from laptop.emulator.host.runner import run_script
from laptop.emulator.host.world import World


@pytest.fixture
def run(tmp_path, monkeypatch, capsys):
    """Run source text in its folder on a bare brick: (outcome, lines on stdout, stderr)."""
    monkeypatch.chdir(tmp_path)

    def run(source, **options):
        (tmp_path / "mine.py").write_text("import os, subprocess, sys\n" + source)
        brick = EmulatedBrick(World(), None, extra={"A": "large"})
        outcome = run_script(brick, str(tmp_path / "mine.py"), **options)
        out, err = capsys.readouterr()
        return outcome, out.splitlines(), err

    return run


@pytest.fixture
def shell(run):
    """Run a line by os.system: (status, lines on stdout, stderr)."""

    def shell(line):
        _, out, err = run(f"status = os.system({line!r})\nprint(status >> 8)\n")
        return int(out[-1]), out[:-1], err

    return shell


@pytest.mark.parametrize(
    ("line", "commands"),
    [
        ("setfont Lat15-Terminus24x12", [(["setfont", "Lat15-Terminus24x12"], ";", {})]),
        ("espeak --stdout 'a; b' | aplay -q",
         [(["espeak", "--stdout", "a; b"], "|", {}), (["aplay", "-q"], ";", {})]),
        ("beep -l 10 & beep", [(["beep", "-l", "10"], "&", {}), (["beep"], ";", {})]),
        ("clear > /dev/null 2>&1 && stty -echo",
         [(["clear"], "&&", {1: (">", "/dev/null"), 2: (">&", "1")}),
          (["stty", "-echo"], ";", {})]),
        ("a || b\nc", [(["a"], "||", {}), (["b"], ";", {}), (["c"], ";", {})]),
        ("echo 1 >>log <in", [(["echo", "1"], ";", {1: (">>", "log"), 0: ("<", "in")})]),
        ("echo 1 2>>log", [(["echo", "1"], ";", {2: (">>", "log")})]),
        ("echo a1>b", [(["echo", "a1"], ";", {1: (">", "b")})]),
        ("ls &> all", [(["ls"], ";", {1: (">", "all"), 2: (">&", "1")})]),
        ("echo 'don''t' \"$5 > 3\"", [(["echo", "dont", "$5 > 3"], ";", {})]),
        ("", []),
    ],
)  # fmt: skip
def test_split_line(line, commands):
    assert split_line(line) == [Command(*command) for command in commands]


@pytest.mark.parametrize("line", ["echo 'a", "echo >", 'echo "'])
def test_a_line_that_is_no_line_is_told(shell, line):
    status, out, err = shell(line)
    assert (status, out) == (2, [])
    assert err.startswith("sh: ")
    assert err.count("\n") == 1


@pytest.mark.short(every=3)
@pytest.mark.parametrize(
    ("line", "out"),
    [
        ("echo a && echo b", ["a", "b"]),
        ("false && echo b; echo c", ["c"]),
        ("false || echo b", ["b"]),
        ("true || echo b", []),
        ("false && echo a | cat; echo c", ["c"]),
        ("echo -n a; echo b", ["ab"]),
        ("cat two | grep -v b", ["a"]),
        ("cat < two", ["a", "b"]),
        ("echo c >> two; cat two", ["a", "b", "c"]),
        ("echo c > two; cat two", ["c"]),
        ("ls", ["mine.py", "one.txt", "two"]),
        ("ls *.txt nothing 2>/dev/null", ["one.txt"]),
        ("ls nothing 2>&1 | cat", ["ls: nothing: No such file or directory"]),
        ("mkdir -p d/e; touch d/e/f; ls d/e", ["f"]),
        ("mkdir d && cd d && touch g; ls; cd ..; ls d", ["g", "g"]),
        ("rm two; ls", ["mine.py", "one.txt"]),
        ("rm -f nothing && echo gone", ["gone"]),
        ("[ -f two ] && echo there; [ -d two ] || echo no folder", ["there", "no folder"]),
        ("sh -c 'echo hi; false' || bash -c \"echo ho\"", ["hi", "ho"]),
        ("echo '# no\necho yes' > s; sh s", ["yes"]),
        ("whoami; hostname; uname; uname -m", ["robot", "ev3dev", "Linux", "armv5tejl"]),
        ("date +%Y-%m-%d", ["2020-04-10"]),
        ("date | grep '^Fri Apr 10 00:00:0. UTC 2020$' > in && echo so", ["so"]),
        ("which beep nothing python3", ["/usr/bin/beep", "/usr/bin/python3"]),
        ("echo $COLOUR '$COLOUR'", ["blue $COLOUR"]),
        ("sudo -n echo x; nohup echo y", ["x", "y"]),
        ("python3 --version", ["Python 3.5.3"]),
        ("python3 -c 'import sys; print(sys.argv, sys.path[0])' x", ["['-c', 'x'] "]),
    ],
)
def test_what_the_shell_does(shell, tmp_path, monkeypatch, line, out):
    monkeypatch.setenv("COLOUR", "blue")
    (tmp_path / "one.txt").write_text("1\n")
    (tmp_path / "two").write_text("a\nb\n")
    assert shell(line)[1] == out


def test_the_folder_is_that_of_the_script_and_stays(run, tmp_path):
    (tmp_path / "d").mkdir()
    _, out, _ = run(
        "os.system('cd d; pwd')\nprint(subprocess.check_output('pwd', cwd='d').decode().strip())\n"
        "print(os.getcwd())\n"
    )
    here = os.path.realpath(tmp_path)
    assert out == [os.path.join(here, "d")] * 2 + [here]


@pytest.mark.skipif(os.name == "nt", reason="there are no such rights")
@pytest.mark.parametrize(
    ("args", "before", "after"),
    [("+x", 0o640, 0o751), ("u+x", 0o640, 0o740), ("755", 0, 0o755), ("a-w", 0o666, 0o444),
     ("go=r", 0o777, 0o744)],
)  # fmt: skip
def test_chmod(shell, tmp_path, args, before, after):
    (tmp_path / "x").touch()
    (tmp_path / "x").chmod(before)
    assert shell(f"chmod {args} x") == (0, [], "")
    assert (tmp_path / "x").stat().st_mode & 0o777 == after


@pytest.mark.short(every=4)
@pytest.mark.parametrize(
    ("line", "why"),
    [
        ("sudo reboot", "reboot: not done: the emulated brick stays on"),
        ("sudo apt-get install x", "apt-get: not done: the emulated brick installs nothing; "
         "install for the Python that runs simulate"),
        ("wget http://x", "wget: not done: the emulated brick reaches no network"),
        ("killall python3", "killall: not done: no other program runs on the emulated brick"),
        ("rm -rf d", "rm: -r is not done: it might reach too far here"),
        ("python3 -m pip", "python3 -m: not done on the emulated brick; give a script, or -c"),
        ("python3", "python3: not done on the emulated brick; give a script, or -c"),
        ("for i in 1 2; do rm d; done", "sh: 1: for: not done: the emulated brick's shell takes "
         "one command after another"),
        ("sh nothing.sh", "sh: not done: give a script that is there, or -c"),
        ("cat nothing", "cat: nothing: No such file or directory"),
        ("python3 nothing.py", "python3: can't open file 'nothing.py': [Errno 2] No such file or "
         "directory"),
        ("chmod much x", "chmod: invalid mode: 'much'"),
        ("nothing", "sh: 1: nothing: not found"),
        ("sudo nothing", "sudo: nothing: command not found"),
        ("sudo", "sudo: a command is missing"),
        ("sleep", "sleep: seconds are missing"),
    ],
)  # fmt: skip
def test_what_is_not_done_says_so(shell, tmp_path, line, why):
    (tmp_path / "d").mkdir()
    status, out, err = shell(line)
    assert status != 0
    assert (out, err) == ([], why + "\n")
    assert (tmp_path / "d").is_dir()


def test_devices_are_files_for_the_shell_too(run):
    _, out, _ = run(
        "led = '/sys/class/leds/led0:red:brick-status/brightness'\n"
        "os.system('echo 120 > ' + led)\n"
        "print(subprocess.check_output(['cat', led]).decode().strip())\n"
    )
    assert out == ["120"]


# Other scripts


def test_another_script_is_a_program_of_its_own(run, tmp_path):
    (tmp_path / "helper.py").write_text("count = []\n")
    (tmp_path / "other.py").write_text(
        "import atexit, helper, sys, time\nhelper.count.append(1)\n"
        "atexit.register(print, 'bye')\ntime.sleep(2)\n"
        "print(__name__, sys.argv, len(helper.count))\nsys.exit(4)\n"
    )
    _, out, _ = run(
        "import atexit, helper, time\natexit.register(print, 'end')\nhelper.count += [1, 2]\n"
        "began = time.time()\n"
        "print(os.system('python3 other.py a b') >> 8, int(time.time() - began) >= 2)\n"
        "print(len(helper.count), sys.argv[0].endswith('mine.py'), __name__)\n"
    )
    assert out == [
        "__main__ ['other.py', 'a', 'b'] 1", "bye", "4 True", "2 True __main__", "end",
    ]  # fmt: skip


@pytest.mark.short(every=4)
@pytest.mark.parametrize(
    "command",
    [
        "['python3', 'other.py']",
        "[sys.executable, 'other.py']",
        "['./other.py']",
        "'python3 other.py', shell=True",
    ],
)
def test_what_another_script_prints_can_be_caught(run, tmp_path, command):
    (tmp_path / "other.py").write_text("import sys\nprint('out')\nsys.stderr.write('err')\n")
    _, out, err = run(
        f"done = subprocess.run({command}, stdout=subprocess.PIPE, stderr=subprocess.PIPE)\n"
        "print(done.returncode, done.stdout, done.stderr)\n"
    )
    assert (out, err) == (["0 b'out\\n' b'err'"], "")


def test_another_script_drives_the_same_motors(run, tmp_path):
    (tmp_path / "other.py").write_text(
        "from ev3dev2.motor import LargeMotor\n"
        "LargeMotor('outA').on_for_degrees(50, 90)\nLargeMotor('outB')\n"
    )
    outcome, out, err = run(
        "from ev3dev2.motor import LargeMotor\n"
        "print(os.system('python3 other.py') >> 8, abs(LargeMotor('outA').position - 90) < 15)\n"
    )
    assert out == ["1 True"]
    assert "DeviceNotFound: LargeMotor(outB) is not connected." in err
    assert outcome.status == 0


@pytest.mark.long
def test_scripts_that_start_themselves_come_to_an_end(run):
    outcome, out, err = run("print('x')\nos.system('python3 mine.py')\n")
    assert outcome.status == 0
    assert len(out) == 9
    assert err == "python3: not done: 8 programs have started one another\n"


def test_a_time_limit_ends_another_script_too(run, tmp_path):
    (tmp_path / "other.py").write_text("import time\nwhile True: time.sleep(1)\n")
    outcome, _, err = run("os.system('python3 other.py')\n", timeout=5)
    assert (outcome.status, outcome.reason) == (124, "timeout")
    assert "other.py line 2" in err


# Standard input

TALKS = {
    "communicate": "print(p(['cat']).communicate(b'a\\nb\\n'))",
    "text": "print(p(['cat'], universal_newlines=True).communicate('\u00e4\\n'))",
    "nothing": "print(p(['cat']).communicate())",
    "input that nobody reads": "print(p(['echo', 'hi']).communicate(b'a'))",
    "no pipe": "print(subprocess.Popen(['echo', 'hi'], stdout=-1).communicate(b'a'))",
    "run": "print(subprocess.run(['grep', 'b'], input=b'a\\nb\\n', stdout=-1).stdout)",
    "check_output": "print(subprocess.check_output(['grep', '-v', 'b'], input=b'a\\nb\\n'))",
    "write and close":
        "q = p(['cat'])\nq.stdin.write(b'a')\nprint(q.poll())\nq.stdin.write(b'b')\n"
        "q.stdin.close()\nprint(q.stdout.read(), q.wait())",
    "write and communicate": "q = p(['cat'])\nq.stdin.write(b'a')\nprint(q.communicate(b'b'))",
    "with":
        "with subprocess.Popen(['grep', 'a'], stdin=-1, stdout=-3) as q: q.stdin.write(b'b\\n')\n"
        "print(q.returncode)",
    "line whose first command reads nothing":
        "print(p('echo c; cat; cat', shell=True).communicate(b'a'))",
    "pipeline":
        "q = p(['cat'])\nr = subprocess.Popen(['grep', 'b'], stdin=q.stdout, stdout=-1)\n"
        "q.stdin.close()\nprint(r.communicate())",
    "line": "print(p('grep b | cat; echo c', shell=True).communicate(b'a\\nb\\n'))",
    "line of a file":
        "open('f', 'w').write('x')\nprint(p('cat < f; cat', shell=True).communicate(b'y'))",
    "line that reads nothing": "q = p('echo c', shell=True)\nprint(q.wait(), q.stdout.read())",
    "script": "print(p([sys.executable, 'other.py']).communicate(b'a\\nb\\n'))",
    "script of a line":
        "print(p('echo a | ' + sys.executable + ' other.py', shell=True).communicate(b'b'))",
    "script without input": "q = p([sys.executable, 'other.py'])\nprint(q.communicate(), q.poll())",
    "input twice":
        "q = p(['cat'])\nq.communicate(b'a')\n"
        "try: print(q.communicate(b'b'))\nexcept ValueError: print('refused')",
    "wrong type":
        "q = p(['cat'])\ntry: print(q.communicate('b'))\nexcept TypeError: print('refused')",
    "killed": "q = p(['cat'])\nq.kill()\nprint(q.wait(), q.stdout.read())",
    "timeout":
        "q = p(['cat'])\ntry: q.wait(0.2)\nexcept subprocess.TimeoutExpired: print('late')\n"
        "print(q.communicate(b'a', timeout=9))",
    "one pipe for both":
        "print(p(['cat', 'none'], stderr=subprocess.STDOUT).communicate()[0].count(b'none'))",
    "two programs at once":
        "q, r = p(['cat']), p(['cat'])\nr.stdin.write(b'r')\nq.stdin.write(b'q')\n"
        "print(q.communicate(), r.communicate())",
}  # fmt: skip
"""Lines of a script that talks with programs."""

TALK = """
def p(*args, **more): return subprocess.Popen(*args, stdin=-1, stdout=-1, **more)
"""


@pytest.mark.parametrize("talk", sorted(TALKS))
def test_a_program_gets_its_input_as_from_real_python(run, tmp_path, talk):
    (tmp_path / "other.py").write_text("import sys\nprint(sys.stdin.read().upper())\n")
    outcome, out, _ = run(TALK + TALKS[talk])
    assert outcome.status == 0
    real = subprocess.run(
        [sys.executable, "mine.py"], stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, cwd=tmp_path
    )
    assert out == real.stdout.decode().splitlines()


def test_a_program_that_reads_ends_only_where_its_input_does(run):
    outcome, out, _ = run(TALK + "print('on')\np(['cat']).wait()\nprint('off')", timeout=5)
    assert (outcome.status, out) == (124, ["on"])


def test_another_thread_may_end_the_input_of_a_program_that_is_waited_for(run):
    source = (
        "import threading, time\nq = p(['cat'])\n"
        "threading.Timer(2.0, q.stdin.close).start()\nq.wait()\nprint(round(time.monotonic(), 0))"
    )
    begins = run("import time\nprint(time.monotonic())")[1][0]
    outcome, out, _ = run(TALK + source)
    assert outcome.status == 0
    assert 2.0 <= float(out[0]) - float(begins) + 0.5 < 3.1


@pytest.mark.parametrize("errors", ["", ", stderr=subprocess.STDOUT"])
def test_sound_in_a_pipe_lasts_as_long_whatever_else_is_in_there(run, errors):
    _, out, _ = run(
        "import time\nwords = ['espeak', '--stdout', 'a sentence of many words']\n"
        f"speaks = subprocess.Popen(words, stdout=subprocess.PIPE{errors})\n"
        "plays = subprocess.Popen(['aplay', '-q'], stdin=speaks.stdout)\n"
        "before = time.monotonic()\nplays.wait()\nprint(time.monotonic() - before > 1.0)\n"
    )
    assert out == ["True"]
