"""Search for bricks: those that announce themselves by mDNS, or take ssh on a cable's own network.

A card with ev3dev announces its `_sftp-ssh._tcp` with its home in a TXT record. Where a computer
shares its network over a cable, bricks get addresses of 10.42.0.0/24 and the like; there each
address is asked for ssh. Over USB without sharing, and over Bluetooth, there are addresses of
169.254.0.0/16, too many to ask: mDNS finds those.
"""

from __future__ import annotations

import asyncio
import contextlib
import ipaddress
import socket
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from typing import Any

import asyncssh
import ifaddr
from zeroconf import Error as ZeroconfError
from zeroconf import ServiceStateChange, Zeroconf
from zeroconf.asyncio import AsyncServiceBrowser, AsyncServiceInfo, AsyncZeroconf

from laptop.brick import BrickProblem
from laptop.brick.connection import BrickAddress, fingerprint
from laptop.brick.known_hosts import DEFAULT_PORT

SERVICES = "_sftp-ssh._tcp.local.", "_ssh._tcp.local.", "_workstation._tcp.local."
EV3DEV_KEY = b"ev3dev.robot.home"
"""Key of the TXT record that marks ev3dev among other computers."""
EV3DEV_NAME = "ev3dev"
"""Part of the name of a brick that nobody has given another name; not all announce the mark."""

SHARED = tuple(map(ipaddress.ip_network, ("10.42.0.0/16", "192.168.137.0/24", "192.168.2.0/24")))
"""Networks in which Linux, Windows and macOS share theirs over a cable; the sharer is x.x.x.1."""

MAX_NAMES, MAX_FOUND, MAX_LETTERS = 500, 100, 63
"""Greatest number of announcements that are asked, of bricks among them, of letters of a name."""

LISTENING_TIME = 3.0
"""Time of listening for answers by mDNS, s."""
ASKING_TIMEOUT = 1.0
"""Longest time until a brick on a cable takes a connection, s."""
KEY_TIMEOUT = 20.0
"""Longest time until a brick, a slow computer, shows its host key, s."""


@dataclass(frozen=True)
class FoundBrick:
    """A brick that is there.

    Args:
        name: its own name, without `.local`; "" if it was found by its address alone.
        address: address where it takes ssh.
        how: text of how it was found, for people.
        key: fingerprint of its host key; "" if it has shown none.
    """

    name: str
    address: BrickAddress
    how: str
    key: str = ""


async def find() -> list[FoundBrick]:
    """Return all bricks that are there, each once, by name and address.

    Raises:
        BrickProblem: the network cannot be listened to.
    """
    try:
        announced, asked = await asyncio.gather(_announced(), _resolved())
    except OSError as error:
        raise BrickProblem(
            f"cannot listen to the network: {error.strerror or error}; is this computer in one?"
        ) from None
    known = {brick.address for brick in announced}
    found = announced + [brick for brick in asked if brick.address not in known]
    keys = await asyncio.gather(*(_key(brick.address) for brick in found))
    with_keys = [replace(brick, key=key) for brick, key in zip(found, keys, strict=True)]
    return sorted(_each_once(with_keys), key=lambda brick: (brick.name, str(brick.address)))


async def _announced() -> list[FoundBrick]:
    """Return the bricks that announce themselves."""
    names: dict[str, str] = {}

    def on_change(
        zeroconf: Zeroconf, service_type: str, name: str, state_change: ServiceStateChange
    ) -> None:
        if state_change is not ServiceStateChange.Removed and len(names) < MAX_NAMES:
            names[name] = service_type

    async with AsyncZeroconf() as network:
        browser = AsyncServiceBrowser(network.zeroconf, list(SERVICES), handlers=[on_change])
        await asyncio.sleep(LISTENING_TIME)
        asked = [_ask(network.zeroconf, service, name) for name, service in names.items()]
        found = [brick for answer in await asyncio.gather(*asked) for brick in answer]
        await browser.async_cancel()
    return found[:MAX_FOUND]


async def _ask(network: Zeroconf, service: str, name: str) -> list[FoundBrick]:
    """Return the bricks of one announcement; none if there is no answer."""
    with contextlib.suppress(ZeroconfError, ValueError):  # a name that is none
        info = AsyncServiceInfo(service, name)
        if await info.async_request(network, 1000 * LISTENING_TIME):
            return _bricks(info, service)
    return []


def _bricks(info: Any, service: str) -> list[FoundBrick]:
    """Return the brick of one announcement, once for each of its addresses."""
    host = (info.server or "").removesuffix(".").removesuffix(".local")[:MAX_LETTERS]
    if EV3DEV_KEY not in info.properties and EV3DEV_NAME not in host.lower():
        return []
    port = DEFAULT_PORT if service.startswith("_workstation") else info.port or DEFAULT_PORT
    return [
        FoundBrick(host, BrickAddress(address, port), "announces itself")
        for address in info.parsed_scoped_addresses()
        if not address.startswith("fe80") or "%" in address
    ]


async def _resolved() -> list[FoundBrick]:
    """Return the computers that accept ssh on a network that this one shares over a cable."""
    places = list(_neighbours(_own_addresses()))
    accepts = await asyncio.gather(*(_accepts_ssh(place) for place in places))
    return [
        FoundBrick("", BrickAddress(place), "takes ssh on a cable")
        for place, is_there in zip(places, accepts, strict=True)
        if is_there
    ]


def _own_addresses() -> list[str]:
    return [str(ip.ip) for adapter in ifaddr.get_adapters() for ip in adapter.ips if ip.is_IPv4]


def _neighbours(own: Iterable[str]) -> Iterable[str]:
    """Return all addresses that a computer of these addresses may have given over a cable."""
    for text in own:
        address = ipaddress.ip_address(text)
        first, *others = ipaddress.ip_network(f"{address}/24", strict=False).hosts()
        if address == first and any(address in network for network in SHARED):
            yield from map(str, others)


async def _accepts_ssh(place: str) -> bool:
    with contextlib.suppress(OSError, asyncio.TimeoutError):
        _, writer = await asyncio.wait_for(
            asyncio.open_connection(place, DEFAULT_PORT, family=socket.AF_INET), ASKING_TIMEOUT
        )
        writer.close()
        return True
    return False


async def _key(address: BrickAddress) -> str:
    """Return the fingerprint of a brick's host key, "" if it shows none."""
    with contextlib.suppress(OSError, asyncssh.Error, asyncio.TimeoutError):
        key = await asyncio.wait_for(
            asyncssh.get_server_host_key(address.host, address.port, config=None), KEY_TIMEOUT
        )
        return fingerprint(key) if key else ""
    return ""


def _each_once(found: list[FoundBrick]) -> list[FoundBrick]:
    """Return one of all addresses of a brick, as key and name show: the first, IPv4 before IPv6.

    Cards that are copies of one another have one key. But bricks see to it that they announce
    different names, and one brick is not twice in the same network of a cable or radio.
    """
    chosen: list[FoundBrick] = []
    for brick in sorted(found, key=lambda one: (":" in one.address.host, not one.name)):
        if not any(_is_same(brick, other) for other in chosen):
            chosen.append(brick)
    return chosen


def _is_same(one: FoundBrick, other: FoundBrick) -> bool:
    """Return True if both are the same brick."""
    if one.address == other.address:
        return True
    names = {one.name, other.name} - {""}
    return (
        bool(one.key)
        and one.key == other.key
        and len(names) < 2
        and not _are_neighbours(one.address.host, other.address.host)
    )


def _are_neighbours(host: str, other: str) -> bool:
    """Return True if these are addresses of IPv4 in one network of 256."""
    return ":" not in host + other and host.rpartition(".")[0] == other.rpartition(".")[0]


def report(
    found: list[FoundBrick], last: BrickAddress | None, report_line: Callable[[str], None]
) -> None:
    """Report the bricks, and what to type where two have one name.

    Args:
        found: the bricks.
        last: address of the last one that was used; None: none was.
        report_line: called with each line.
    """
    for brick in found:
        is_last = last is not None and brick.address == replace(last, user=brick.address.user)
        mark = "  (the last one)" if is_last else ""
        key = brick.key or "it shows no key"
        report_line(f"{brick.name or '?':12} {brick.address!s:22} {brick.how}, {key}{mark}")
    keys = [brick.key for brick in found if brick.key]
    if len(keys) > len(set(keys)):
        report_line(
            "several bricks have one key, so their cards are copies of one another; to make another"
            " key, type on all but one: sudo rm /etc/ssh/ssh_host_*; sudo dpkg-reconfigure "
            "openssh-server"
        )
    names = [brick.name for brick in found]
    for name in sorted({name for name in names if name and names.count(name) > 1}):
        report_line(same_name(name, found))


def same_name(name: str, found: list[FoundBrick]) -> str:
    """Return what to do where several bricks have one name, for people."""
    places = [f"--brick {brick.address}" for brick in found if brick.name == name]
    return (
        f"{len(places)} bricks are called {name}: say which by {' or '.join(places)}; to name one "
        "anew, type sudo hostnamectl set-hostname NAME on it"
    )


NO_BRICK = (
    "no brick is to be seen; is it on, and on this computer's cable or network? Give the address "
    "on its screen: --brick 10.42.0.3"
)
"""Text for people where no brick is found."""
