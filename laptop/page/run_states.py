"""The run protocol of the page as a state machine: its states, its events, and one table of both.

What is not in the table is ignored; an order that is not in it is refused.
"""

from __future__ import annotations

from enum import Enum
from typing import NamedTuple


class RunState(Enum):
    """State of the run protocol, with its meaning for people."""

    IDLE = "no run is on"
    ORDERED = "a start is sent, the brick has not begun yet"
    RUNNING = "the run that was ordered here is on"
    WAYPOINT = "a waypoint of the path is reached, the next start is due"
    FOREIGN = "a run is on that was not ordered here, or before the link was lost"
    STOP_DUE = "a stop is sent, to be repeated if the brick still runs"
    STOPPING = "the brick still runs and is told to stop with every status"


class RunEvent(Enum):
    """Event of the run protocol, with its meaning for people; the first four are orders."""

    AIM = "somebody sets the goal"
    START = "somebody presses Start, and the start is sent"
    HOLD = "somebody presses Hold"
    STOP = "somebody presses STOP"
    UNLINKED = "no brick is connected"
    SILENT = "the brick is connected and has said nothing (of the run that was ordered)"
    OVERDUE = "the brick has said nothing of the run for too long"
    RUN_ON = "the brick says that a run is on"
    ARRIVED = "the ordered run has converged, and the path goes on"
    ENDED = "the brick's last run has a verdict"
    NEXT_SENT = "the next start is sent"
    NEXT_NOT_SENT = "the next start could not be sent"


class RunAction(Enum):
    """Action of a transition, with its meaning for people."""

    NONE = ""
    SEND_STOP = "send the stop"
    DROP_PATH_SEND_STOP = "give up the path, send the stop"
    REPEAT_STOP = "send the stop again if the status is a new one"
    SEND_NEXT_START = "send a start to the next waypoint"
    END_PATH = "tell how many waypoints are left, if any"
    REPORT_NO_RUN = "tell that the brick did not begin"


class Transition(NamedTuple):
    """Next state after an event, and the action on the way."""

    state: RunState
    action: RunAction = RunAction.NONE


_S, _E, _A = RunState, RunEvent, RunAction

TRANSITIONS: dict[tuple[RunState, RunEvent], Transition] = {
    (_S.IDLE, _E.AIM): Transition(_S.IDLE),
    (_S.IDLE, _E.START): Transition(_S.ORDERED),
    (_S.IDLE, _E.RUN_ON): Transition(_S.FOREIGN),
    (_S.ORDERED, _E.UNLINKED): Transition(_S.IDLE, _A.END_PATH),
    (_S.ORDERED, _E.OVERDUE): Transition(_S.IDLE, _A.REPORT_NO_RUN),
    (_S.ORDERED, _E.RUN_ON): Transition(_S.RUNNING),
    (_S.ORDERED, _E.ARRIVED): Transition(_S.WAYPOINT, _A.SEND_NEXT_START),
    (_S.ORDERED, _E.ENDED): Transition(_S.IDLE, _A.END_PATH),
    (_S.RUNNING, _E.UNLINKED): Transition(_S.IDLE, _A.END_PATH),
    (_S.RUNNING, _E.ARRIVED): Transition(_S.WAYPOINT, _A.SEND_NEXT_START),
    (_S.RUNNING, _E.ENDED): Transition(_S.IDLE, _A.END_PATH),
    (_S.WAYPOINT, _E.NEXT_SENT): Transition(_S.ORDERED),
    (_S.WAYPOINT, _E.NEXT_NOT_SENT): Transition(_S.IDLE),
    (_S.FOREIGN, _E.UNLINKED): Transition(_S.IDLE),
    (_S.FOREIGN, _E.SILENT): Transition(_S.IDLE),
    (_S.FOREIGN, _E.ENDED): Transition(_S.IDLE),
    (_S.STOP_DUE, _E.AIM): Transition(_S.STOP_DUE),
    (_S.STOP_DUE, _E.START): Transition(_S.ORDERED),
    (_S.STOP_DUE, _E.RUN_ON): Transition(_S.STOPPING, _A.REPEAT_STOP),
    (_S.STOP_DUE, _E.ENDED): Transition(_S.IDLE),
    (_S.STOPPING, _E.UNLINKED): Transition(_S.STOP_DUE),
    (_S.STOPPING, _E.SILENT): Transition(_S.STOP_DUE),
    (_S.STOPPING, _E.RUN_ON): Transition(_S.STOPPING, _A.REPEAT_STOP),
    (_S.STOPPING, _E.ENDED): Transition(_S.IDLE),
    # A stop is taken in every state.
    **{(state, _E.HOLD): Transition(_S.STOP_DUE, _A.SEND_STOP) for state in RunState},
    **{(state, _E.STOP): Transition(_S.STOP_DUE, _A.DROP_PATH_SEND_STOP) for state in RunState},
}
"""Transition of each state and event; a pair that is missing changes nothing."""

RUN_IS_ON = {_S.ORDERED, _S.RUNNING, _S.WAYPOINT, _S.FOREIGN, _S.STOPPING}
"""States in which people are told that a run is on."""

ORDERED_HERE = {_S.ORDERED, _S.RUNNING, _S.WAYPOINT}
"""States in which a run is on that was ordered here."""


def next_state(state: RunState, event: RunEvent) -> RunState:
    """Return the state after an event; the same one if the table has no such row."""
    return TRANSITIONS.get((state, event), Transition(state)).state


def transition_table() -> str:
    """Return the table of transitions as Markdown, one row for each."""
    rows = ["| state | event | next state | action |", "|---|---|---|---|"]
    for (state, event), (following, action) in TRANSITIONS.items():
        rows.append(f"| {state.name} | {event.name} | {following.name} | {action.value} |")
    return "\n".join(rows)
