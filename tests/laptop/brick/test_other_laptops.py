"""The brick from laptops that lack what only Linux has, over Debian's sshd."""

import pytest
from systems import lacking


@pytest.mark.long
@pytest.mark.parametrize("system", ["windows", "macos"])
def test_a_brick_is_reached_from_it(ssh_brick, system):
    home = ssh_brick.environment["HOME"]
    state = ssh_brick.environment["BRICKSERVO_STATE"]
    env = lacking(system, HOME=home, BRICKSERVO_STATE=state, USERNAME="anna")  # as Windows has it
    homing = ["run", "driver.py", "home", "--seek"]
    for words in (["install"], homing, ["run", "driver.py", "where"]):
        status, out, errors = ssh_brick.run(*words, env=env)
        assert (status, "Traceback" in errors) == (0, False), out + errors
    assert "tip at " in out
    status, out, errors = ssh_brick.run("doctor", env=env)
    assert "port A    large motor" in out, errors
    assert ssh_brick.run("forget", env=env)[0] == 0
