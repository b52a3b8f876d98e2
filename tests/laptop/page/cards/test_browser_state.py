"""The choices of one browser: what it orders is done, or it is told why not."""

import asyncio

import pytest

from laptop.page.cards.browser_state import BrowserState
from laptop.page.interface import ColourCalls, DrawCalls, RunCalls, SteeringCalls
from laptop.page.rpc import RpcError

ORDERS = {"order": RunCalls.stop, "draw": DrawCalls.start, "edit": ColourCalls.undo}


class Failing:
    """A tracker that lets steer, and then fails."""

    state = None

    async def call(self, method, *args):
        if method is SteeringCalls.claim:
            return ""
        raise RpcError("BadJob: too long")

    call_slowly = call


@pytest.mark.parametrize("order", ORDERS)
def test_an_order_in_which_the_tracker_fails_is_told(order):
    browser_state = BrowserState(Failing())
    reported = []
    browser_state.warn = reported.append
    assert not asyncio.run(getattr(browser_state, order)(ORDERS[order]))
    assert reported == ["the tracker could not do this (BadJob: too long); look, then do it again"]
