"""What a program has changed of this process is as before when it has ended."""

import os
import pty
import termios

import pytest

from laptop.emulator.host.host_state import HostState

ECHO = 3  # index of the local modes, see termios.tcgetattr


@pytest.fixture
def terminal():
    """Standard input is a terminal; both of its ends."""
    before = os.dup(0)
    here, there = pty.openpty()
    os.dup2(there, 0)
    os.close(there)
    yield here
    os.dup2(before, 0)
    os.close(before)


def test_the_terminal_treats_keys_as_before(terminal):
    host_state = HostState()
    modes = termios.tcgetattr(0)
    termios.tcsetattr(0, termios.TCSADRAIN, [*modes[:ECHO], 0, *modes[ECHO + 1 :]])
    host_state.restore()
    assert termios.tcgetattr(0) == modes
    os.close(terminal)


def test_a_terminal_that_was_closed_meanwhile_is_left_alone(terminal):
    host_state = HostState()
    os.close(terminal)
    host_state.restore()
