"""Pages that browsers have open: each is built, monitored, and released."""

from __future__ import annotations

from fastapi import Request, Response
from nicegui import Client, core, ui
from nicegui import app as nice

from laptop.page.async_controller import AsyncController
from laptop.page.auth import BROWSER
from laptop.page.browser import Page
from laptop.page.build_limiter import BUILD_SLOT
from laptop.page.cards.browser_state import BrowserState, browser_name
from laptop.page.interface import RunCalls, StatusCalls, SteeringCalls
from laptop.page.pulse import Pulse
from laptop.see.serve.listening import is_loopback, own_addresses

BUILD_TIMEOUT = 60.0
"""Time that a page may take to be put together once it is its turn, s."""


class PageClients:
    """Gives each browser its page.

    Args:
        controller: the tracker's.
        pulse: of all pages.
        gate_port: of laptop.page.stop_gate.
    """

    def __init__(self, controller: AsyncController, pulse: Pulse, gate_port: int) -> None:
        self._controller, self._pulse, self._gate_port = controller, pulse, gate_port
        self._browser_states: dict[int, BrowserState] = {}  # the newest of each browser

    def serve(self) -> None:
        """Register the page and its events with NiceGUI."""
        ui.page("/", response_timeout=BUILD_TIMEOUT)(self._build)
        nice.exception_handler(404)(_unknown)
        nice.on_connect(self._connected)
        nice.on_disconnect(self._disconnected)
        nice.on_delete(self._deleted)
        core.sio.on("echo", self._echo)
        core.sio.on("stop", self._stop)

    async def _build(self) -> None:
        client, pulse = ui.context.client, self._pulse
        browser = _browser(client)
        browser_state = BrowserState(
            self._controller, browser, _name(client), age=lambda: pulse.age(client.id)
        )
        before = self._browser_states.get(browser)
        if before:  # restore its choices: browsers also reload pages by themselves
            browser_state.tool, browser_state.folds = before.tool, before.folds
        self._browser_states[browser] = browser_state
        async with client.request.scope[BUILD_SLOT]:
            await Page(browser_state, self._gate_port).build()

    async def _connected(self, client: Client) -> None:
        self._controller.pages.add(client.id)
        self._pulse.join(client.id, _browser(client), _is_local(client))
        await self._controller.call(StatusCalls.arrived)
        # The first browser steers.
        await self._controller.call(SteeringCalls.claim, _browser(client), _name(client))

    def _disconnected(self, client: Client) -> None:
        if not client.has_socket_connection:  # it may have come back meanwhile
            self._leave(client)

    def _deleted(self, client: Client) -> None:
        self._leave(client)
        for feed in self._controller.feeds.values():
            feed.masks.pop(client.id, None)

    def _leave(self, client: Client) -> None:
        self._controller.pages.discard(client.id)
        self._pulse.leave(client.id)

    def _echo(self, sid: str, t: object) -> None:
        for client in _clients(sid):
            self._pulse.on_echo(client.id, t)

    async def _stop(self, sid: str) -> str | None:
        for client in _clients(sid):
            name = await self._controller.call(SteeringCalls.name, _browser(client))
            return await self._controller.call(RunCalls.stop, name)
        return None


async def _unknown(request: Request, error: Exception) -> Response:
    return Response("There is nothing at this address.", 404, media_type="text/plain")


def _browser(client: Client) -> int:
    """Return the number of the browser that has a page open."""
    return client.request.scope[BROWSER]


def _is_local(client: Client) -> bool:
    """Return True if the browser that has a page open is on this computer."""
    address = client.request.client
    host = address.host.removeprefix("::ffff:") if address else ""
    return is_loopback(host) or host in own_addresses()


def _name(client: Client) -> str:
    """Return what a browser is, for people."""
    return browser_name(client.request.headers.get("user-agent", ""))


def _clients(sid: str) -> list[Client]:
    """Return the page, if any, that a socket belongs to: its room is named after it."""
    rooms = core.sio.rooms(sid)
    return [Client.instances[room] for room in rooms if room in Client.instances]
