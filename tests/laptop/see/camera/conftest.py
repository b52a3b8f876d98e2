"""Cameras to open: webcams that are plugged in by tests, and videos."""

from functools import partial

import pytest

# (What OpenCV makes is imported late: an old Python, which leaves these tests out, reads this.)


@pytest.fixture
def webcam(monkeypatch):
    """Opens a webcam on FakeCaptures; ends them all."""
    from captures import fake_webcam

    with fake_webcam(monkeypatch) as plug:
        yield plug


@pytest.fixture
def video(tmp_path):
    """Writes a video of numbered frames."""
    from numbered_frames import write_video

    return partial(write_video, tmp_path)
