"""visual_servoing.py --wait: a run per Start of the laptop, the arm held between them.

It runs as a program on the emulated brick, in virtual time; whether the arm moved or arrived is
read from the emulated plant and the camera's own formula, what was told from the laptop's server.
"""

import math
import signal

import pytest
from rig import degrees
from servo_rig import SpaceCamera

from laptop.emulator.device.peripherals import Peripherals
from laptop.emulator.virtual_tracker import HOST
from robot.servoing.loss_of_sight import LINK_PATIENCE, SIGHT_PATIENCE
from shared.messages import Start, Stop

SIGNALS = signal.SIGTERM, signal.SIGINT, signal.SIGHUP

PIXEL, OTHER = (230.0, 185.0), (250.0, 220.0)


class Laptop:
    """What the laptop does while the program waits, and what it hears.

    Args:
        w: servo_rig.Watched.
    """

    def __init__(self, w):
        self.w = w
        self.sent = []  # when, s

    def send(self, *messages):
        """Say them in one breath."""
        self.sent.append(self.w.world.t)
        for message in messages:
            assert self.w.tracker.server.send(message)

    def at(self, t, *messages):
        """Say them at time t, s."""
        self.w.world.at(t, lambda: self.send(*messages))

    def after(self, run, act, pause=1.0):
        """Do `act()` so long (s) after the end of a run has been told."""

        def look():
            reported = [s for s in self.w.statuses if s.run == run and s.verdict]
            t = self.w.world.t
            self.w.world.at(*((t + pause, act) if reported else (t + 0.02, look)))

        look()

    def end(self, number=signal.SIGTERM):
        """Send the program a signal, now: while it runs, run_script hands on those of this process.

        (Through the kernel it would come in at no certain virtual time.)
        """
        signal.getsignal(number)(number, None)

    def reported(self, run):
        """The last Status of a run."""
        return [status for status in self.w.statuses if status.run == run][-1]

    def verdicts(self):
        """(run, verdict), in order of what was told."""
        found = []
        for status in self.w.statuses:
            if status.verdict and found[-1:] != [(status.run, status.verdict)]:
                found.append((status.run, status.verdict))
        return found


@pytest.fixture
def waiting(watched):
    """Makes arms under a camera, and the laptop that orders their runs."""

    def build(**options):
        w = watched(**options)
        return w, Laptop(w)

    return build


def ended(w, shown, number=signal.SIGTERM):
    """Whether the signal ended it, in one line, with the arm held and parked."""
    assert shown.status == 128 + number
    assert shown.err == f"visual_servoing.py: stopped by {signal.Signals(number).name}\n"
    assert w.on_file()["parked"] is not None
    assert "the program has ended" in w.tracker.server.state().lost
    assert w.stands(shown.t + 0.2)
    return True


# Without a Start


@pytest.mark.short("SIGTERM")
@pytest.mark.parametrize(
    "number", [signal.SIGTERM, signal.SIGINT, signal.SIGHUP], ids=lambda n: n.name
)
def test_without_a_start_nothing_moves_until_a_signal_ends_it(waiting, number):
    w, laptop = waiting()
    shown = w.run("--wait", signals=[(5.0, number)])
    assert ended(w, shown, number)
    assert shown.t < 5.2
    assert not w.moved()
    assert laptop.verdicts() == [(0, "ready")]
    assert len(w.statuses) > 15
    assert laptop.reported(0).q == pytest.approx(w.q, abs=math.radians(2))
    assert shown.log == []


@pytest.mark.long
def test_neither_a_lost_link_nor_a_stop_moves_anything(waiting):
    w, laptop = waiting()
    laptop.at(1.0, Stop("for nothing"))
    w.world.at(2.0, w.tracker.cut)
    w.world.at(5.0, lambda: w.tracker.restart(30.0))
    shown = w.run("--wait", signals=[(45.0, signal.SIGTERM)])
    assert ended(w, shown)
    assert not w.moved()
    assert w.tracker.server.state().refusal == ""
    assert shown.out.count(f"linked to {HOST}") == 3


def test_a_start_that_is_taken_back_in_the_same_breath_moves_nothing(waiting):
    w, laptop = waiting()
    laptop.at(1.0, Start(), Stop("no, wait"))
    assert ended(w, w.run("--wait", signals=[(4.0, signal.SIGTERM)]))
    assert not w.moved()
    assert laptop.verdicts() == [(0, "ready")]


# Runs


def test_every_start_is_a_run_as_ordered_and_the_arm_is_held_between_them(waiting):
    w, laptop = waiting()
    laptop.at(1.0, Start(tolerance=4.0, budget=50.0))
    off = []
    laptop.after(1, lambda: (off.append(w.error()), laptop.send(Start(goals={"A": PIXEL}))), 3.0)
    laptop.after(2, laptop.end)
    shown = w.run("--wait")
    assert ended(w, shown)
    assert laptop.verdicts() == [(0, "ready"), (1, "converged"), (2, "converged")]
    assert off[0] < 6
    assert w.error(PIXEL) < 7
    first, second = laptop.sent
    assert not any(m.driven for m in w.moments if m.t < first)
    assert w.stands(second - 2.8, second)
    assert all(w.brick.motors[port].mode == "hold" for port in "AB")
    assert shown.log[0]["goal"] == {"A": list(PIXEL)}, "the log is of the last run"
    assert [line["kind"] for line in shown.log].count("run") == 1
    assert [line.split(":")[0] for line in shown.out.splitlines()].count("converged") == 2


@pytest.mark.short("chain")
@pytest.mark.parametrize(
    "orders",
    [
        Start("report", "look", "stereo", 20.0, 100.0),
        Start("kalman", "look", "stereo", 6.0, 70.0),
        Start("chain", "stream", "stereo", 7.5, 40.0, goals={"A": PIXEL}),
    ],
    ids=lambda orders: orders.method,
)
def test_it_does_what_is_ordered(waiting, orders):
    w, laptop = waiting()
    laptop.at(1.0, orders)
    laptop.after(1, laptop.end)
    shown = w.run("--wait")
    assert laptop.reported(1).verdict == "converged"
    assert w.error(orders.goals.get("A")) < orders.tolerance + 2
    run = shown.log[0]
    assert {key: run[key] for key in ("method", "mode", "rows", "tolerance", "budget")} == {
        key: value for key, value in orders._asdict().items() if key in run
    }
    models = {line["model"] for line in shown.log if line["kind"] == "step"} - {None}
    assert models == {orders.method}


def test_who_has_just_arrived_explores_no_more_on_the_way_to_the_next_point(waiting):
    """A path is followed point after point, not by way of exploring steps at each of them."""
    w, laptop = waiting()
    laptop.at(1.0, Start(goals={"A": PIXEL}))
    laptop.after(1, lambda: laptop.send(Start(goals={"A": OTHER})), 0.1)
    laptop.after(2, laptop.end)
    shown = w.run("--wait")
    assert laptop.reported(2).verdict == "converged"
    assert w.error(OTHER) < 7
    assert {line["action"] for line in shown.log if line["kind"] == "step"} == {"move", "hold"}


@pytest.mark.long
def test_what_it_has_learned_does_not_outlive_a_change_of_method_or_a_failure(waiting):
    w, laptop = waiting()
    laptop.at(1.0, Start(goals={"A": PIXEL}))
    laptop.after(1, lambda: laptop.send(Start("kalman", goals={"A": OTHER})))
    laptop.after(2, laptop.end)
    shown = w.run("--wait")
    assert laptop.reported(2).verdict == "converged"
    assert "explore" in {line.get("action") for line in shown.log}


@pytest.mark.long
def test_a_goal_that_moves_is_followed_until_the_laptop_says_stop(waiting):
    w, laptop = waiting()
    laptop.at(1.0, Start(mode="stream", tolerance=10.0, budget=100.0, follow=True))
    laptop.at(15.0, Stop("enough"))
    laptop.after(1, laptop.end)
    shown = w.run("--wait")
    assert laptop.reported(1).verdict == "converged"
    assert w.error() < 12
    assert w.stands(15.5, shown.t)


def test_the_laptop_is_told_what_goes_on(waiting):
    w, laptop = waiting()
    laptop.at(1.0, Start(mode="look"))
    laptop.after(1, laptop.end)
    shown = w.run("--wait")
    of_run = [status for status in w.statuses if status.run == 1]
    assert of_run[0].verdict == of_run[0].reason == ""
    moves = [status.moves for status in of_run]
    assert moves == sorted(moves)
    assert moves[-1] == shown.log[-1]["moves"] > 2
    steps = [line for line in shown.log if line["kind"] == "step"]
    assert of_run[-1].condition == pytest.approx(steps[-1]["condition"], abs=0.001)
    measured = [status for status in of_run if status.error is not None]
    assert len(measured) > 20
    for status in measured:
        assert sorted(status.e) == ["A.u", "A.v"]
        assert math.hypot(*status.e.values()) == pytest.approx(status.error, abs=0.01)
    assert measured[0].e["A.u"] == pytest.approx(steps[0]["s"][0] - steps[0]["goal"][0], abs=0.01)
    assert {status.battery for status in w.statuses} == {8.0}
    gaps = [b.t - a.t for a, b in zip(w.statuses, w.statuses[1:])]
    assert max(gaps) < 0.5


@pytest.mark.long
@pytest.mark.parametrize("tells", [True, False])
def test_the_battery_is_looked_at_seldom_and_stops_nobody(waiting, tells):
    w, laptop = waiting()
    looks = []

    def voltage():
        looks.append(w.world.t)
        return 7.4 - 0.1 * len(looks) if tells else math.nan  # of which no driver makes a number

    laptop.at(1.0, Start())
    laptop.after(1, laptop.end, 18.0 if tells else 0.0)
    w.run("--wait", peripherals=Peripherals(w.world, w.brick.sysfs, voltage))
    assert laptop.reported(1).verdict == "converged"
    if not tells:
        assert {status.battery for status in w.statuses} == {None}
        return
    assert len(looks) > 2
    assert all(9.95 <= b - a < 10.5 for a, b in zip(looks, looks[1:])), looks
    reported = [status.battery for status in w.statuses]
    assert reported[0] == 7.3
    assert sorted(set(reported), reverse=True) == pytest.approx(
        [7.4 - 0.1 * k for k in range(1, len(looks) + 1)]
    )


def test_in_space_it_goes_where_the_pixels_of_two_cameras_say(waiting):
    cameras = {"A": SpaceCamera(math.radians(10)), "B": SpaceCamera(math.radians(90))}
    goal = 11.0, 8.0, 8.0
    pixels = {name: camera.pixel(goal) for name, camera in cameras.items()}
    w, laptop = waiting(
        arm="spatial", cameras=cameras, start=degrees(-30, 60, -80), goal=goal, noise=0.3
    )
    w.hidden.add("goal")
    laptop.at(1.0, Start(rows="xyz", goals=pixels))
    laptop.after(1, laptop.end, 3.0)
    shown = w.run("--wait")
    assert ended(w, shown)
    assert laptop.verdicts() == [(0, "ready"), (1, "converged")]
    assert sorted(laptop.reported(1).e) == ["A.u", "A.v", "B.v"]
    assert w.error() < 7
    assert w.stands(shown.t - 2.0, shown.t), "it is held against gravity"


# Faults


def test_stop_ends_a_run_at_once_and_it_waits_again(waiting):
    w, laptop = waiting()
    laptop.at(1.0, Start())
    w.in_motion(2.5, lambda: laptop.send(Stop("the red button")))
    laptop.after(1, lambda: laptop.send(Start()), 3.0)
    laptop.after(2, laptop.end)
    shown = w.run("--wait")
    assert ended(w, shown)
    assert laptop.verdicts() == [(0, "ready"), (1, "stopped"), (2, "converged")]
    assert laptop.reported(1).reason == "the red button"
    assert w.stands(w.struck + 0.5, laptop.sent[-1])
    assert w.error() < 7


def test_a_start_in_mid_run_is_ignored_with_a_line(waiting):
    w, laptop = waiting()
    laptop.at(1.0, Start())
    w.in_motion(3.0, lambda: laptop.send(Start(goals={"A": PIXEL})))
    laptop.after(1, laptop.end, 3.0)
    shown = w.run("--wait")
    assert laptop.verdicts() == [(0, "ready"), (1, "converged")]
    assert shown.log[0]["goal"] == "marker"
    assert w.error() < 7
    assert shown.out.count("a start of the laptop is ignored") == 1
    assert w.stands(shown.t - 2.5, shown.t)


@pytest.mark.short("cut")
@pytest.mark.parametrize(
    "lose", [lambda w: w.tracker.cut(), lambda w: w.tracker.restart(4.0)], ids=["cut", "away"]
)
def test_a_run_goes_on_when_the_link_is_back(waiting, lose):
    w, laptop = waiting()
    laptop.at(1.0, Start())
    w.in_motion(2.5, lambda: lose(w))
    laptop.after(1, laptop.end)
    shown = w.run("--wait")
    assert ended(w, shown)
    assert laptop.verdicts() == [(0, "ready"), (1, "converged")]
    assert w.error() < 7


@pytest.mark.long
def test_a_link_that_stays_away_ends_the_run_and_nothing_moves_when_it_is_back(waiting):
    w, laptop = waiting()
    laptop.at(1.0, Start())
    w.in_motion(2.5, lambda: w.tracker.restart(LINK_PATIENCE + 10))
    laptop.after(1, lambda: laptop.send(Start()), 3.0)
    laptop.after(2, laptop.end)
    shown = w.run("--wait")
    assert ended(w, shown)
    assert laptop.verdicts() == [(0, "ready"), (1, "link lost"), (2, "converged")]
    assert "start the tracker there" in laptop.reported(1).reason
    assert w.stands(w.struck + 0.5, laptop.sent[-1])
    assert w.error() < 7


@pytest.mark.long
def test_a_marker_that_is_lost_is_told_and_nothing_moves_when_it_is_back(waiting):
    w, laptop = waiting()
    laptop.at(1.0, Start())
    w.in_motion(2.5, lambda: w.hidden.add("effector"))

    def again():
        w.hidden.clear()
        w.world.at(w.world.t + 3.0, lambda: laptop.send(Start()))

    laptop.after(1, again)
    laptop.after(2, laptop.end)
    shown = w.run("--wait")
    assert ended(w, shown)
    assert laptop.verdicts() == [(0, "ready"), (1, "marker lost"), (2, "converged")]
    assert laptop.reported(1).reason.startswith("the effector has not been seen for 10 s")
    held = [status for status in w.statuses if status.run == 1 and status.reason == "marker lost"]
    assert len(held) > 4 * SIGHT_PATIENCE
    assert {status.verdict for status in held} == {""}
    assert w.stands(w.struck + 0.5, laptop.sent[-1])
    assert w.error() < 7


@pytest.mark.short("SIGTERM")
@pytest.mark.parametrize(
    "number", [signal.SIGTERM, signal.SIGINT, signal.SIGHUP], ids=lambda n: n.name
)
def test_a_signal_in_mid_run_stops_the_arm_and_ends_the_program(waiting, number):
    w, laptop = waiting()
    laptop.at(1.0, Start())
    w.in_motion(2.5, lambda: laptop.end(number))
    shown = w.run("--wait")
    assert w.stands(w.struck + 0.2)
    assert ended(w, shown, number)
    assert laptop.verdicts() == [(0, "ready"), (1, "stopped")]
    assert laptop.reported(1).reason == f"stopped by {signal.Signals(number).name}"
    assert shown.log[-1]["verdict"] == "stopped"


@pytest.mark.long
def test_who_is_killed_between_runs_leaves_the_arm_parked(waiting):
    w, laptop = waiting()
    laptop.at(1.0, Start())
    shown = w.run("--wait", kill_at=25.0)
    assert shown.status == 137
    assert laptop.verdicts() == [(0, "ready"), (1, "converged")]
    assert w.on_file()["parked"] is not None
    assert w.stands(shown.t - 1)


@pytest.mark.short("method", "one pixel")
@pytest.mark.parametrize(
    ("orders", "arm", "says"),
    [
        (Start(method="magic"), "planar", "'magic' is no method; take one of report, "),
        (Start(mode="fast"), "planar", "'fast' is no mode; take one of look, stream"),
        (Start(rows="all"), "planar", "'all' is no rows; take one of stereo, xyz"),
        (Start("report", "stream"), "planar", "the report's method looks, then moves"),
        (Start(mode="look", follow=True), "planar", "in the mode stream only"),
        (Start(mode="stream", follow=True, goals={"A": PIXEL}), "planar", "aim at it, not at a"),
        (Start(goals={"A": PIXEL}), "spatial", "one pixel does not say where 3 joints are to go"),
    ],
    ids=["method", "mode", "rows", "report", "follow", "follow a pixel", "one pixel"],
)
def test_orders_without_sense_are_refused_in_one_line_and_nothing_moves(waiting, orders, arm, says):
    w, laptop = waiting(arm=arm, cameras={})
    laptop.at(1.0, orders)
    shown = w.run("--wait", signals=[(3.0, signal.SIGTERM)])
    assert shown.status == 128 + signal.SIGTERM
    assert laptop.verdicts() == [(0, "ready"), (1, "refused")]
    assert says in laptop.reported(1).reason
    assert "--" not in laptop.reported(1).reason, "the laptop's page shows it, too"
    assert shown.out.count("refused: ") == 1
    assert shown.log == []
    assert not w.moved()


@pytest.mark.long
def test_after_orders_without_sense_it_waits_for_better_ones(waiting):
    w, laptop = waiting()
    laptop.at(1.0, Start(method="magic"))
    laptop.after(1, lambda: laptop.send(Start(method="magic")))
    laptop.after(2, lambda: laptop.send(Start()))
    laptop.after(3, laptop.end)
    assert ended(w, w.run("--wait"))
    assert laptop.verdicts() == [(0, "ready"), (1, "refused"), (2, "refused"), (3, "converged")]
    assert w.error() < 7


@pytest.mark.short("unplugged")
@pytest.mark.parametrize(
    ("harm", "verdict", "says"),
    [
        (lambda w: w.brick.jam("A"), "refused", "driver.py home"),
        (lambda w: w.brick.unplug("B"), "stalled", "the elbow motor at port B no longer"),
    ],
    ids=["jammed", "unplugged"],
)
def test_after_a_stall_no_start_moves_the_arm_and_it_says_what_to_do(waiting, harm, verdict, says):
    w, laptop = waiting()
    laptop.at(1.0, Start())
    w.in_motion(2.5, lambda: harm(w))
    laptop.after(1, lambda: laptop.send(Start()))
    laptop.after(2, laptop.end)
    shown = w.run("--wait")
    assert shown.status == 128 + signal.SIGTERM
    assert laptop.verdicts() == [(0, "ready"), (1, "stalled"), (2, verdict)]
    assert says in laptop.reported(2).reason
    assert w.stands(w.struck + 0.5)
    assert "Traceback" not in shown.out + shown.err


def test_a_log_that_cannot_be_written_is_told_and_nothing_moves(waiting):
    w, laptop = waiting()
    laptop.at(1.0, Start())
    w.run("--wait", "--log", "/nowhere/log", signals=[(3.0, signal.SIGTERM)])
    assert laptop.verdicts() == [(0, "ready"), (1, "refused")]
    assert "cannot write /nowhere/log" in laptop.reported(1).reason
    assert not w.moved()


# The command line


@pytest.mark.short(every=3)
@pytest.mark.parametrize(
    "args",
    [
        ("--goal", "400,200"), ("--method", "report"), ("--mode", "look"), ("--rows", "xyz"),
        ("--tolerance", "6"), ("--budget", "10"), ("--follow",), ("--low",),
    ],
    ids=lambda args: args[0],
)  # fmt: skip
def test_what_the_laptop_orders_is_not_to_be_said_beside_wait(waiting, args):
    w, _ = waiting()
    shown = w.run("--wait", *args, aftermath=0.1)
    assert shown.status == 2
    assert shown.err.count("\n") == 1
    assert "with --wait the laptop orders each run" in shown.err
    assert not w.moved()


def test_an_arm_that_is_not_homed_does_not_wait(waiting):
    w, _ = waiting(homed=False)
    shown = w.run("--wait")
    assert shown.status == 1
    assert "driver.py home" in shown.err
    assert not w.moved()


def test_a_wrong_code_ends_it_in_one_line(waiting):
    w, _ = waiting()
    shown = w.run(f"{HOST}:{w.tracker.port}", "--code", "ZZZZ-ZZZZ-ZZZZ", "--wait")
    assert shown.status == 1
    assert shown.err.count("\n") == 1
    assert "this is not the pairing code" in shown.err
    assert not w.moved()
