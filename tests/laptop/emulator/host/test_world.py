"""The world's clock and its scheduler, in virtual time, against times worked out by hand."""

import sys
import threading
import time as wall

import pytest
from waiting import PATIENCE

from laptop.emulator import pace
from laptop.emulator.host.process_exit import ProcessExit
from laptop.emulator.host.wait_queue import WaitQueue
from laptop.emulator.host.world import World
from laptop.emulator.pace import PacedClock


@pytest.fixture
def world():
    return World()


def play(world, *programs, **options):
    """Run the first of `programs` as the main thread, the others started by it at once."""
    log = []

    def say(*parts):
        log.append((round(world.now(), 6),) + parts)

    def main():
        for number, program in enumerate(programs[1:], 2):
            world.spawn(lambda program=program: program(say), f"thread {number}")
        programs[0](say)
        return 0

    return world.run(main, **options), log


# The clock alone


def test_sleep_and_touch_pass_time(world):
    world.sleep(1.5)
    world.touch(0.25)
    world.sleep(-1)
    assert world.now() == 1.75
    assert world.busy == 0.25


def test_bodies_are_brought_to_every_event_and_to_the_end(world):
    seen = []
    world.bodies.append(seen.append)
    world.at(0.5, lambda: seen.append("event"))
    world.sleep(2)
    assert seen == [0.5, "event", 2]


def test_events_of_one_time_happen_in_the_order_they_were_asked_for(world):
    seen = []
    world.at(1, lambda: seen.append("a"))
    world.at(0.5, lambda: world.at(1, lambda: seen.append("c")))
    world.at(1, lambda: seen.append("b"))
    world.sleep(1)
    assert seen == ["a", "b", "c"]


def test_an_event_that_is_overdue_happens_at_the_next_moment(world):
    world.sleep(2)
    seen = []
    world.at(1, lambda: seen.append(world.now()))
    world.touch(0.1)
    assert seen == [2.0]


def test_cancelled_event_does_not_happen(world):
    seen = []
    event = world.at(1, lambda: seen.append(1))
    world.cancel(event)
    world.sleep(2)
    assert seen == []


# Threads


def test_threads_wake_in_the_order_of_their_times(world):
    def main(say):
        for _ in range(2):
            world.sleep(1)
            say("main")
        world.sleep(5)

    def other(say):
        for _ in range(3):
            world.sleep(0.7)
            say("other")

    verdict, log = play(world, main, other)
    assert verdict == ProcessExit(0, "ended")
    assert log == [(0.7, "other"), (1, "main"), (1.4, "other"), (2, "main"), (2.1, "other")]


def test_one_core_two_busy_threads_take_turns(world):
    def busy(name):
        def program(say):
            for _ in range(3):
                world.touch(1)
                say(name)

        return program

    def main(say):
        busy("main")(say)
        world.sleep(10)

    _, log = play(world, main, busy("other"))
    # Each piece of work lasts 1 s and only one is done at a time; the other one is done first
    # when both end theirs at once, for it has waited longer.
    names = [entry[1] for entry in log]
    assert names == ["main", "other"] * 3
    assert [entry[0] for entry in log] == [2, 3, 4, 5, 6, 6]
    assert world.busy == 6


def test_touch_is_not_cut_short_by_another_wake_up(world):
    def main(say):
        world.sleep(0.1)
        world.touch(1)
        say("main")

    def other(say):
        world.sleep(0.5)
        say("other")

    _, log = play(world, main, other)
    assert log == [(1.1, "other"), (1.1, "main")]


def test_wait_queue_is_first_come_first_served(world):
    line = WaitQueue(world)

    def main(say):
        world.sleep(1)
        assert line.wake()
        world.sleep(1)
        assert line.wake()
        world.sleep(1)
        assert not line.wake()

    def waiter(name, delay):
        def program(say):
            world.sleep(delay)
            say(name, line.wait())

        return program

    _, log = play(world, main, waiter("late", 0.2), waiter("early", 0.1))
    assert log == [(1, "early", True), (2, "late", True)]


def test_wait_queue_times_out_at_its_time(world):
    line = WaitQueue(world)

    def main(say):
        say(line.wait(0.25))
        assert not line.wake()

    _, log = play(world, main)
    assert log == [(0.25, False)]


def test_an_event_can_wake_a_thread_while_all_sleep(world):
    line = WaitQueue(world)
    world.at(3, line.wake)

    def main(say):
        say(line.wait(10))

    _, log = play(world, main)
    assert log == [(3, True)]


def test_run_repeats_exactly():
    def once():
        world = World()

        def worker(pause):
            def program(say):
                for step in range(50):
                    world.touch(0.0013)
                    say(pause, step)
                    world.sleep(pause)

            return program

        def main(say):
            worker(0.01)(say)
            world.sleep(3)

        return play(world, main, worker(0.007), worker(0.003))[1]

    assert once() == once()


# Ends


def test_all_waiting_for_ever_is_a_deadlock(world):
    lines = [WaitQueue(world), WaitQueue(world)]
    verdict, _ = play(world, lambda say: lines[0].wait(), lambda say: lines[1].wait())
    assert verdict == ProcessExit(124, "deadlock")


def test_the_limit_ends_an_endless_program(world):
    def main(say):
        while True:
            world.sleep(0.3)

    verdict, _ = play(world, main, limit=10)
    assert verdict == ProcessExit(124, "timeout")
    assert world.now() == 10


def test_an_event_at_the_limit_still_happens(world):
    seen = []
    world.at(10, lambda: seen.append(world.now()))
    play(world, lambda say: world.sleep(99), limit=10)
    assert seen == [10]


def test_after_a_verdict_no_thread_acts_again(world):
    world.at(1.0, lambda: world.halt(ProcessExit(124, "frozen")))
    log = []

    def stubborn(say):
        while True:
            try:
                world.touch(0.3)
                log.append(world.now())
            except BaseException:
                log.append("unwound")
            finally:
                log.append("cleaned up")

    verdict, _ = play(world, stubborn, stubborn)
    assert verdict.reason == "frozen"
    assert world.now() == 1.0
    before = list(log)
    world.advance(5)
    wall.sleep(0.01)
    assert log == before
    assert "unwound" not in log


def test_the_first_verdict_stands(world):
    world.at(1, lambda: world.halt(ProcessExit(137, "killed")))
    world.at(1, lambda: world.halt(ProcessExit(124, "frozen")))
    assert play(world, lambda say: world.sleep(2))[0].reason == "killed"


def test_an_error_in_the_physics_is_raised_by_run_not_in_the_program(world):
    def broken():
        raise ValueError("physics")

    world.at(1, broken)
    caught = []

    def main(say):
        try:
            world.sleep(2)
        except ValueError:
            caught.append(True)

    with pytest.raises(ValueError, match="physics"):
        play(world, main)
    assert not caught


def test_a_world_can_run_one_program_after_another(world):
    play(world, lambda say: world.sleep(1))
    verdict, log = play(world, lambda say: (world.sleep(1), say("again")), limit=100)
    assert log == [(2, "again")]
    assert verdict.reason == "ended"


def test_interrupt_reaches_a_sleeping_main_thread_and_the_sleep_goes_on(world):
    def main(say):
        world.at(1, lambda: world.interrupt(lambda: say("interrupt")))
        world.sleep(3)
        say("slept")

    _, log = play(world, main, lambda say: world.sleep(2))
    assert log == [(1, "interrupt"), (3, "slept")]


def test_an_interrupt_that_raises_ends_the_wait(world):
    line = WaitQueue(world)

    def main(say):
        def raise_it():
            raise KeyError

        world.at(1, lambda: world.interrupt(raise_it))
        with pytest.raises(KeyError):
            line.wait()
        say("out")
        assert not line.wake()

    _, log = play(world, main)
    assert log == [(1, "out")]


def test_an_interrupt_that_comes_just_before_a_wait_is_heard_before_it(world):
    """From outside, as Ctrl-C comes: while the main thread computes."""
    line = WaitQueue(world)

    def main(say):
        def out_of_it():
            raise KeyError

        def come(action):
            outside = threading.Thread(target=world.interrupt, args=(action,))
            outside.start()
            outside.join()

        come(lambda: say("interrupt"))
        world.sleep(3)
        say("slept")
        come(out_of_it)
        with pytest.raises(KeyError):
            line.wait()
        say("out")

    ended, log = play(world, main)
    assert log == [(0, "interrupt"), (3, "slept"), (3, "out")]
    assert ended.reason == "ended"


# Wall time


def test_valve_lets_time_pass_beside_a_thread_that_spins(world):
    flag = []

    def main(say):
        while not flag:
            pass
        world.touch(0)
        say("main saw it")

    def other(say):
        world.sleep(2)
        flag.append(True)
        for _ in range(20):
            world.sleep(1)

    _, log = play(world, main, other)
    # The spinner sees the flag at once; a slow machine is given some of the other thread's steps.
    assert 2 <= log[0][0] <= 8


def test_a_thread_that_lost_the_baton_does_not_act_after_the_verdict(world):
    world.at(3, lambda: world.halt(ProcessExit(137, "killed")))

    def main(say):
        while world.exit is None:
            pass
        world.touch(1)
        say("acted")

    verdict, log = play(world, main, lambda say: world.sleep(5))
    assert verdict.reason == "killed"
    assert log == []
    assert world.now() == 3


def test_a_thread_that_lost_the_baton_may_end_without_it(world):
    line = WaitQueue(world)
    until = wall.monotonic() + 0.4

    def main(say):
        world.sleep(1)
        line.wait()

    def spinner(say):
        while wall.monotonic() < until:
            pass

    # Only when the world knows that the spinner is gone can it tell a deadlock.
    assert play(world, main, spinner, patience=PATIENCE)[0].reason == "deadlock"


@pytest.mark.long
@pytest.mark.skipif(
    not hasattr(wall, "pthread_getcpuclockid"),
    reason="this Python does not tell what a thread computes: then it counts as waiting",
)
def test_a_program_that_computes_for_ever_is_stopped(world):
    def main(say):
        while True:
            pass

    before = threading.active_count()
    verdict, _ = play(world, main, patience=0.3)
    assert verdict == ProcessExit(124, "stuck")
    assert threading.active_count() == before


# In real time


@pytest.fixture
def paced(tmp_path):
    """A World in real time."""
    clock = PacedClock(str(tmp_path))
    yield World(clock)
    clock.close()


def test_realtime_keeps_pace_with_the_wall(paced):
    start = wall.monotonic()
    _, log = play(paced, lambda say: (paced.sleep(0.2), say("slept")))
    assert log == [(0.2, "slept")]
    assert wall.monotonic() - start >= 0.2


def test_in_realtime_an_event_asked_for_meanwhile_happens_first(paced):
    seen = []

    def ask():
        paced.at(0.01, lambda: seen.append("early"))
        paced.at(0.02, lambda: paced.halt(ProcessExit(0, "seen")))

    def main(say):
        threading.Timer(0.0, ask).start()
        paced.sleep(3600)

    paced.at(3599, lambda: seen.append("late"))
    verdict, _ = play(paced, main)
    assert (verdict.reason, seen) == ("seen", ["early"])


@pytest.mark.skipif(
    sys.version_info < (3, 8), reason="before Python 3.8 no thread tells its number"
)
def test_in_realtime_the_computing_of_the_host_takes_no_time(paced):
    def main(say):
        spent = wall.process_time() + 0.2
        while wall.process_time() < spent:
            pass
        paced.touch(0.001)
        say("touched")

    _, log = play(paced, main)
    assert log == [(0.001, "touched")]


def test_in_realtime_what_waits_for_the_host_takes_time(paced):
    def main(say):
        paced.touch(0.001)
        while paced.t < 0.1:
            wall.sleep(0.05)  # as for a key on the host's keyboard
        paced.touch(0.001)
        say("touched")

    _, log = play(paced, main)
    assert log[0][0] > 0.101


def test_in_realtime_whose_run_has_ended_waits_for_the_clock_no_more(paced, monkeypatch):
    """It used to go on until it had computed for half a second, in waits that take no computing."""
    waits, worth_waiting = [], paced.pacer._clock.worth_waiting

    def count(until):
        waits.append(paced.exit)
        if len(waits) == 3:
            threading.Thread(target=lambda: paced.halt(ProcessExit(1, "ended"))).start()
        return worth_waiting(until)

    monkeypatch.setattr(paced.pacer._clock, "worth_waiting", count)
    other = paced.pacer._clock.join("a tracker")  # that does nothing
    verdict, _ = play(paced, lambda say: paced.sleep(3600))
    other.leave()
    assert verdict.reason == "ended"
    assert not any(waits)


def test_a_host_that_is_too_busy_ends_the_run_for_its_own_reason(paced, monkeypatch):
    monkeypatch.setattr(paced.pacer, "long_pace", pace.PaceMeter(paced.pacer._clock, 0.3))
    other = paced.pacer._clock.join("a tracker")  # that does nothing
    verdict, _ = play(paced, lambda say: paced.sleep(3600))
    other.leave()
    assert verdict == ProcessExit(75, "too busy")
    assert paced.awaited.startswith("a tracker (process ")


@pytest.mark.long
def test_that_the_host_is_busy_is_told_now_and_then(paced, monkeypatch):
    reported = []
    monkeypatch.setattr(paced.pacer, "pace", pace.PaceMeter(paced.pacer._clock, 0.3))
    monkeypatch.setattr(paced.pacer, "long_pace", pace.PaceMeter(paced.pacer._clock, 0.6))
    monkeypatch.setattr(paced, "report", reported.append)
    other = paced.pacer._clock.join("a tracker")
    play(paced, lambda say: paced.sleep(3600))
    other.leave()
    assert set(reported) == {"this computer is busy: running at 0 x"}


def test_an_access_is_cheap(world):
    """A run makes millions: each may take a few calls, however many came before."""
    accesses, calls = 1000, []

    def main(say):
        sys.setprofile(lambda frame, event, arg: calls.append(event))
        for _ in range(accesses):
            world.touch(0.001)
        sys.setprofile(None)

    play(world, main)
    assert sum(event.endswith("call") for event in calls) < 12 * accesses
