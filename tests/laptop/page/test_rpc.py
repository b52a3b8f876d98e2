"""Remote calls, over a real pipe."""

import time

import pytest

from laptop.page.interface import (
    EXPOSED_METHODS,
    ORDER_LIFETIME,
    ColourCalls,
    FrameCalls,
    RunCalls,
    StatusCalls,
    exposed_method,
)
from laptop.page.rpc import RpcError
from shared.messages import Stop


def test_a_remote_call_returns_what_the_controller_says(scene, client):
    shown = scene.show()
    called = client.call(FrameCalls.view, "A")
    assert called.taken + called.age <= time.monotonic()
    again = client.call(FrameCalls.view, camera="A")
    assert again._replace(age=0, taken=0) == shown._replace(age=0, taken=0)
    assert client.call(StatusCalls.state) == scene.controller.state()
    assert client.call(StatusCalls.history) == scene.controller.history()
    assert client.call(RunCalls.aim, "A", 5.0, 6.0) == ""
    assert scene.show().aim == (5.0, 6.0)


@pytest.mark.parametrize(
    "name",
    [
        "ColourCalls._track", "StatusCalls.heartbeat", "RunCalls.poll", "RunCalls.__init__",
        "StatusCalls.cameras", "StatusCalls.frames", "aim", "RunControl.aim", "os.system",
    ],
)  # fmt: skip
def test_what_is_not_exposed_cannot_be_called(scene, client, name):
    def method():
        pass

    method.__qualname__ = name
    with pytest.raises(RpcError, match="not exposed"):
        client.call(method)


def test_every_method_of_the_interface_is_exposed_and_the_controller_has_it(scene):
    assert len(EXPOSED_METHODS) == 41
    assert {"RunCalls.aim", "ColourCalls.undo", "FrameCalls.view", "StatusCalls.state"} <= set(
        EXPOSED_METHODS
    )
    for name in EXPOSED_METHODS:
        assert callable(exposed_method(scene.controller, name))


def test_a_call_that_fails_does_no_harm(scene, client):
    with pytest.raises(RpcError, match="KeyError"):
        client.call(FrameCalls.view, "Z")
    assert client.call(StatusCalls.state) == scene.controller.state()


def test_an_order_that_has_waited_is_refused_but_for_a_stop(scene, client):
    scene.show()
    assert client.call(RunCalls.aim, "A", 5.0, 6.0) == ""
    for order in (RunCalls.start, RunCalls.hold, RunCalls.aim_at_marker, ColourCalls.undo):
        late = order.__qualname__, (), {}, time.monotonic() - ORDER_LIFETIME - 1
        client._pipe.send(late)
        answer, trouble = client._pipe.recv()
        assert (answer.startswith("the tracker stood still for"), trouble) == (True, ""), order
    assert scene.server.sent == []
    client._pipe.send(("RunCalls.stop", (), {}, time.monotonic() - 3600))
    assert client._pipe.recv() == ("", "")
    assert scene.server.sent == [Stop("stopped from the page")]
