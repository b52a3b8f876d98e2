"""The channels between processes: each stands in the table; where they lead if nothing is told."""

import os
import re

import pytest

from shared import state


@pytest.mark.parametrize(
    "name",
    [
        *(state.STATE, state.ARM, state.PLAN, state.LOCK),
        *(state.PAIRING_FILE, state.MARKERS_FILE, state.TRACKER_FILE),
        *(state.LIVE_FOLDER, state.CLOCK_FILE, state.BRICK_FOLDER, state.MOTORS_FILE),
        *(state.JOBS_FOLDER, state.JOB_STATUS_FILE, state.JOB_ORDERS_FILE),
        state.LEARNED_FOLDER,
    ],
)
def test_every_channel_is_in_the_table(name):
    assert re.search(r"^    " + re.escape(name) + r"/?,? ", state.__doc__, re.MULTILINE)


def test_no_test_takes_the_arms_that_somebody_has_calibrated_here():
    assert not os.path.exists(os.path.join(state.state_folder(), state.OWN_ARMS_FOLDER))
    assert state.state_folder() != os.path.expanduser("~/.brickservo")


def test_the_state_folder_is_as_told_or_in_the_home(monkeypatch):
    monkeypatch.setenv(state.STATE, "there")
    assert state.state_folder() == "there"
    monkeypatch.delenv(state.STATE)
    assert state.state_folder() == os.path.expanduser("~/.brickservo")


def test_the_arm_is_as_told_or_the_planar_one(monkeypatch):
    monkeypatch.setenv(state.ARM, "geared")
    assert state.default_arm() == "geared"
    monkeypatch.delenv(state.ARM)
    assert (state.default_arm(), state.default_arm("spatial")) == ("planar", "spatial")
