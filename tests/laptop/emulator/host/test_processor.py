"""The emulated brick computes as slowly as it is told to, whatever this computer does."""

import json
import os

import pytest
from places import SCRIPTS

from laptop.emulator.device.brick import ACCESS_TIME, EmulatedBrick
from laptop.emulator.device.plant_constants import read_plant
from laptop.emulator.host import processor, program
from laptop.emulator.host.instruction_costs import START
from laptop.emulator.host.processor import HOME, REPO_ROOT, SECONDS_PER_INSTRUCTION, Processor
from laptop.emulator.host.runner import run_script
from laptop.emulator.host.world import World
from shared.arm_description import find_arm, read_arm

ARM = read_arm(find_arm("planar"))


def brick_of(plant=""):
    return EmulatedBrick(World(), ARM, read_plant(plant))


@pytest.fixture
def run(tmp_path, capfd):
    """`run(source, plant)`: what the script prints, each line as JSON, and the Outcome."""

    def run(source, plant=""):
        script = tmp_path / "script.py"
        script.write_text(source)
        outcome = run_script(brick_of(plant), str(script))
        out, err = capfd.readouterr()
        assert outcome.status == 0, err
        return [json.loads(line) for line in out.splitlines()], outcome

    return run


LOOP = """
import time
x, y = 1.1, 2.2
from ev3dev2.motor import LargeMotor
motor = LargeMotor("outA")
motor.position
began = time.monotonic()
for k in range({turns}):
    x * y
print(time.monotonic() - began)
"""


def test_a_loop_takes_its_time(run):
    (short,), _ = run(LOOP.format(turns=1000))
    (long,), _ = run(LOOP.format(turns=3000))
    # A turn of it was counted on CPython 3.5.3 as 871 instructions, of which 329 are the loop's.
    assert (long - short) / 2000 == pytest.approx(871 * SECONDS_PER_INSTRUCTION, rel=0.25)


@pytest.mark.parametrize("slowness", [0.5, 2, 4])
def test_a_slower_brick_takes_longer_for_all_of_it(run, slowness):
    (usual,), begun = run(LOOP.format(turns=3000))
    (slow,), slow_begun = run(LOOP.format(turns=3000), f"cpu={slowness}")
    assert slow == pytest.approx(slowness * usual, rel=0.01)
    assert slow_begun.start == pytest.approx(slowness * begun.start, rel=0.01)


def test_a_brick_that_computes_in_no_time_does(run):
    (seconds,), outcome = run(LOOP.format(turns=100000), "cpu=0")
    assert seconds < 0.001
    assert outcome.start is None


@pytest.mark.parametrize(
    ("plant", "access"),
    [
        ("cpu=1", ACCESS_TIME),
        ("cpu=2", 2 * ACCESS_TIME),
        ("cpu=0", 0.001),
        ("cpu=1,access=0.003", 0.003),
    ],
)
def test_an_access_takes_what_the_kernel_takes(plant, access):
    assert brick_of(plant).sysfs.access_cost == access


def test_the_start_is_told_and_is_no_part_of_the_world_s_time(run):
    source = LOOP.format(turns=0) + "import os\nprint(os.times()[4] * 0 + time.process_time())\n"
    source = "for k in range(100000): pass\n" + source
    (_, computed), outcome = run(source)
    assert outcome.start > (1000 * START + 100000 * 200) * SECONDS_PER_INSTRUCTION
    assert outcome.t < 0.1
    assert computed == pytest.approx(outcome.start, abs=0.1)


@pytest.mark.parametrize(
    "first",
    [
        "LargeMotor('outA')",
        "time.sleep(0.001)",
        "threading.Thread(target=int).start()",
        "s = socket.socket(type=socket.SOCK_DGRAM); s.connect(('127.0.0.1', 9)); s.close()",
    ],
)
def test_a_program_has_started_once_it_has_to_do_with_the_world(run, first):
    source = (
        "import socket, threading, time\nfrom ev3dev2.motor import LargeMotor\n" + first + "\n"
        "began = time.monotonic()\nfor k in range(100000): pass\nprint(time.monotonic() - began)\n"
    )
    (seconds,), outcome = run(source)
    assert seconds > 0.3
    assert outcome.t == pytest.approx(seconds, abs=0.05)


def test_the_library_costs_where_it_is_imported_only(run):
    with_it = run(LOOP.format(turns=0))[1].start
    without = run("import time\n")[1].start
    assert with_it - without == pytest.approx(67e6 * SECONDS_PER_INSTRUCTION, rel=0.1)  # as counted


def test_a_module_is_imported_once(run):
    once = run("import json\n")[1].start
    twice = run("import json\nimport json\n")[1].start
    assert twice - once < 0.001 < once - run("pass\n")[1].start


def test_what_a_function_imports_costs_when_it_does(run):
    above = run("import json\n")[1].start
    source = "def f():\n    import json\n    return json\n"
    assert run(source + "f()\nf()\n")[1].start == pytest.approx(above, abs=0.001)
    assert run(source)[1].start == pytest.approx(run("pass\n")[1].start, abs=0.001)


def test_functions_of_the_library_cost_what_they_do(run):
    source = (
        "import json, time\nfrom ev3dev2.motor import LargeMotor\nLargeMotor('outA').position\n"
        "for text in ('[1]', '[%s]' % ', '.join(['1.5'] * 100)):\n"
        "    began = time.monotonic()\n    json.loads(text)\n    print(time.monotonic() - began)\n"
    )
    (short, long), _ = run(source)
    assert 5e3 * SECONDS_PER_INSTRUCTION < short < 15e3 * SECONDS_PER_INSTRUCTION
    assert 80e3 * SECONDS_PER_INSTRUCTION < long < 160e3 * SECONDS_PER_INSTRUCTION
    assert run(source)[0] == [short, long]


def test_what_the_world_does_beside_the_brick_costs_it_nothing():
    """A camera's server writes JSON in the same process, but on another computer."""

    def waited(action):
        brick = brick_of()
        with program.on(brick) as slow:
            brick.world.at(0.01, action)
            slow.clock.sleep(0.02)
            return slow.clock.now()

    assert waited(lambda: json.dumps(["something"] * 100)) == waited(lambda: None)


def test_two_runs_are_the_same_to_the_last_bit():
    records = []
    for _ in range(2):
        brick = brick_of()
        outcome = run_script(brick, str(SCRIPTS / "lab6_pd_loop.py"))
        records.append((outcome, brick.record))
    assert records[0] == records[1]


def test_a_program_in_this_process_is_charged_like_a_script():
    with program.on(brick_of("cpu=0")) as plain:
        kinematics, clock = plain["robot.motion.kinematics"], plain.clock
        began = clock.now()
        kinematics.inverse(ARM, (10.0, 5.0))
        assert clock.now() == began
    for _ in range(2):  # the counted modules are there still
        with program.on(brick_of()) as slow:
            assert slow["robot.motion.kinematics"] is not kinematics
            began = slow.clock.now()
            slow["robot.motion.kinematics"].inverse(ARM, (10.0, 5.0))
            # Counted on CPython 3.5.3: 148,000 instructions for this arm.
            taken = slow.clock.now() - began
            assert taken == pytest.approx(148e3 * SECONDS_PER_INSTRUCTION, rel=0.25)
    from robot.motion import kinematics as after

    assert after is kinematics


def test_what_was_computed_is_taken_once():
    processor = Processor(1.0)
    names = {"__name__": "module"}
    processor.enrol(names, 0, [])
    names["_count_"] += 1000
    processor.begin()
    names["_count_"] += 1000
    assert processor.charge() == pytest.approx(1000 * SECONDS_PER_INSTRUCTION, rel=0.2)
    assert processor.charge() == 0
    names["_spend_"](500)
    assert processor.charge() == pytest.approx(500 * SECONDS_PER_INSTRUCTION, rel=0.2)


@pytest.mark.parametrize("file", ["shared/arms/planar.ini", ""])
def test_where_this_computer_has_programs_and_files_costs_the_brick_nothing(
    tmp_path, monkeypatch, file
):
    monkeypatch.chdir(tmp_path)
    elsewhere = processor._elsewhere()
    here, there, mine, not_mine = (
        processor._length(json.dumps({"file": os.path.join(folder, file)}), elsewhere)
        for folder in (REPO_ROOT, HOME, str(tmp_path), str(tmp_path) + "er")
    )
    assert here == there == mine == not_mine - len(str(tmp_path) + "er") + len(HOME)
    assert processor._length("", elsewhere) == 0
