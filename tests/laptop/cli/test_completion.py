"""Completion by the Tab key: what each shell is answered."""

import pytest
from click.shell_completion import get_completion_class

from laptop.cli.main import laptop


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish", "powershell"])
def test_each_shell_has_a_script_of_its_own(shell):
    made = get_completion_class(shell)(laptop, {}, "brickservo", "_BRICKSERVO_COMPLETE")
    assert "_BRICKSERVO_COMPLETE" in made.source_template % made.source_vars()


@pytest.mark.parametrize(
    ("line", "word", "found"),
    [
        ("brickservo dr", "dr", ["draw"]),
        ("brickservo draw --tr", "--tr", ["--tracing", "--trials"]),
        ("brickservo measure ", "", ["accuracy", "arm", "camera", "pen"]),
        ('brickservo draw --text "a b" --fil', "--fil", ["--fill"]),
    ],
)
def test_powershell_is_answered_word_by_word(monkeypatch, line, word, found):
    monkeypatch.setenv("COMP_WORDS", line)
    monkeypatch.setenv("COMP_CWORD", word)
    made = get_completion_class("powershell")(laptop, {}, "brickservo", "_BRICKSERVO_COMPLETE")
    rows = [row.split("\t") for row in made.complete().splitlines()]
    assert sorted(value for value, _ in rows) == found
    assert all(text for _, text in rows), "PowerShell wants something to show"
