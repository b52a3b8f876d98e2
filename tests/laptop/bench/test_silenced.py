"""Scripts that a bench runs: nobody hears them, and nobody types for them."""

import io
import os
import sys

import pytest

from laptop.bench.bench import silenced


class Terminal(io.StringIO):
    """A keyboard on which somebody has typed."""

    def isatty(self):
        return True


def test_what_scripts_say_is_discarded(capsys):
    with silenced():
        print("heard?")
        print("heard?", file=sys.stderr)
    assert capsys.readouterr() == ("", "")


@pytest.mark.parametrize("keyboard", [Terminal("typed\n"), io.StringIO("typed\n"), None])
def test_scripts_have_the_same_keyboard_whatever_the_bench_has(monkeypatch, keyboard):
    monkeypatch.setattr(sys, "stdin", keyboard)
    with silenced():
        assert not os.isatty(sys.stdin.fileno())
        assert sys.stdin.read() == ""
    assert sys.stdin is keyboard
