"""A refusal, as people are to read it: one line that names what they need."""

from shared.arm_description import ArmError


def in_one_line(text, *words):
    """Return True if what a program wrote is one line that holds all the words, no traceback."""
    assert "Traceback" not in text, text
    assert text.count("\n") == 1, text
    assert all(word in text for word in words), text
    return True


def refused(error, *words):
    """Return True if an error that pytest caught is ours, one line that holds all the words."""
    text = str(error.value)
    assert isinstance(error.value, ArmError)
    assert "\n" not in text
    assert all(word in text for word in words), text
    return True
