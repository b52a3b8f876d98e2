"""Bricks to reach by ssh."""

import pytest


@pytest.fixture
def ssh_brick(tmp_path, monkeypatch):
    """An SshBrick, whose laptop's home is this process's."""
    from ssh_brick import SshBrick  # not above: an old Python has no asyncssh

    made = SshBrick(tmp_path)
    for name in ("HOME", "BRICKSERVO_STATE"):
        monkeypatch.setenv(name, made.environment[name])
    monkeypatch.delenv("SSH_AUTH_SOCK", raising=False)
    yield made
    made.close()
