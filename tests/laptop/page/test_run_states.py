"""The run protocol, row by row of its table, with a brick that does what a test says."""

import itertools

import pytest
from page_scene import PATH

from laptop.page.run_control import START_TIMEOUT
from laptop.page.run_states import (
    RUN_IS_ON,
    TRANSITIONS,
    RunAction,
    RunEvent,
    RunState,
    next_state,
    transition_table,
)
from laptop.see.serve.server_state import ServerState as LinkState
from shared.messages import Start, Stop


def reach(scene, state):
    """Bring the runs to a state, on a path of 5 points, of which 4 are to come."""
    runs, server = scene.controller.runs, scene.server
    scene.show()
    runs.follow("A", PATH)
    if state in (RunState.ORDERED, RunState.RUNNING):
        runs.start()
    if state in (RunState.RUNNING, RunState.FOREIGN, RunState.STOPPING):
        server.tell("", 1)
        runs.poll()
    if state is RunState.STOP_DUE:
        server.status = None  # a status would end it
        runs.hold()
    if state is RunState.STOPPING:
        runs.hold()
        runs.poll()
    if state is RunState.WAYPOINT:  # it lasts no longer than the next start takes to be sent
        runs.state = state
    assert runs.state is state
    server.sent.clear()
    runs.note = "before"


def make(scene, event):
    """Let an event come by itself, or as somebody presses a button."""
    runs, server = scene.controller.runs, scene.server
    orders = {
        RunEvent.AIM: lambda: runs.aim("A", 9.0, 9.0),
        RunEvent.START: runs.start,
        RunEvent.HOLD: runs.hold,
        RunEvent.STOP: runs.stop,
    }
    if event in orders:
        return orders[event]()
    if event is RunEvent.UNLINKED:
        server.there = False
    elif event is RunEvent.SILENT:
        server.status = None
    elif event is RunEvent.OVERDUE:
        scene.t += START_TIMEOUT
    elif event is RunEvent.RUN_ON:
        server.tell("", 1)
    elif event is RunEvent.ARRIVED:
        server.tell("converged", 1)
    elif event is RunEvent.ENDED:
        server.tell("unreachable", 1)
    else:
        return runs._handle(event)
    return runs.poll()


AFTER = {
    RunAction.NONE: ([], "before", 4),
    RunAction.SEND_STOP: ([Stop("held from the page")], "before", 4),
    RunAction.DROP_PATH_SEND_STOP: ([Stop("stopped from the page")], "", 0),
    RunAction.REPEAT_STOP: ([Stop("held from the page")], "before", 4),
    RunAction.SEND_NEXT_START: ([Start(goals={"A": (75.0, 100.0)})], "", 3),
    RunAction.END_PATH: ([], "the path ends here, 4 points before its end", 4),
    RunAction.REPORT_NO_RUN: ([], "the brick did not begin; does its program run with --wait?", 4),
}
"""What an action sends, the note, and how many waypoints are left then."""


@pytest.mark.parametrize(("state", "event"), TRANSITIONS, ids=lambda member: member.name)
def test_a_row_of_the_table(scene, state, event):
    reach(scene, state)
    make(scene, event)
    runs = scene.controller.runs
    expected, action = TRANSITIONS[state, event]
    sent, note, left = AFTER[action]
    if event is RunEvent.AIM:  # a new goal takes the place of the path
        note, left = "", 0
    elif event is RunEvent.START:
        sent, note = [Start(goals={"A": PATH[0]})], ""
    elif expected is RunState.WAYPOINT:
        expected = RunState.ORDERED  # the next start has been sent
    assert runs.state is expected
    assert (scene.server.sent, runs.note, runs.left) == (sent, note, left)


OTHERS = [
    pair for pair in itertools.product(RunState, RunEvent) if pair not in TRANSITIONS
]  # fmt: skip


@pytest.mark.parametrize(("state", "event"), OTHERS, ids=lambda member: member.name)
def test_what_is_not_in_the_table_changes_nothing(scene, state, event):
    reach(scene, state)
    runs = scene.controller.runs
    if event in (RunEvent.AIM, RunEvent.START):
        assert make(scene, event) == "a run is on; hold or stop it first"
    else:
        runs._handle(event, LinkState())
    assert runs.state is state
    assert (scene.server.sent, runs.note, runs.left) == ([], "before", 4)


@pytest.mark.parametrize(
    "state", [s for s in RunState if s is not RunState.WAYPOINT], ids=lambda s: s.name
)
def test_people_are_told_that_a_run_is_on(scene, state):
    reach(scene, state)
    assert scene.controller.state().running == (state in RUN_IS_ON)


def test_where_the_next_start_cannot_be_sent_the_path_waits(scene):
    reach(scene, RunState.RUNNING)
    scene.server.tell("converged", 1)
    scene.server.send = lambda message: False
    scene.controller.runs.poll()
    assert scene.controller.runs.state is RunState.IDLE
    assert "the link has just broken" in scene.controller.runs.note
    assert scene.controller.runs.left == 3


def test_a_stop_is_taken_in_every_state_and_leads_out_of_a_run():
    for state, order in itertools.product(RunState, (RunEvent.HOLD, RunEvent.STOP)):
        assert next_state(state, order) is RunState.STOP_DUE
        assert next_state(RunState.STOP_DUE, RunEvent.ENDED) is RunState.IDLE


def test_every_state_is_reached_and_left():
    reached = {RunState.IDLE}
    for _ in RunState:
        reached |= {to for (state, _), (to, _) in TRANSITIONS.items() if state in reached}
    assert reached == set(RunState)


def test_the_table_can_be_read():
    lines = transition_table().splitlines()
    assert len(lines) == len(TRANSITIONS) + 2
    assert "| IDLE | START | ORDERED |  |" in lines
    assert "| RUNNING | ARRIVED | WAYPOINT | send a start to the next waypoint |" in lines
