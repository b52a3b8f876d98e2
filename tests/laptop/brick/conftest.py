"""Bricks to reach by ssh."""

import pytest
from ssh_brick import SshBrick


@pytest.fixture
def ssh_brick(tmp_path, monkeypatch):
    """An SshBrick, whose laptop's home is this process's."""
    made = SshBrick(tmp_path)
    for name in ("HOME", "BRICKSERVO_STATE"):
        monkeypatch.setenv(name, made.environment[name])
    monkeypatch.delenv("SSH_AUTH_SOCK", raising=False)
    yield made
    made.close()
