"""The page: watch, pick, aim, start, stop; a web page, in a process of its own.

It knows nothing but what a `Door` to the tracker's desk answers.  Who has the token gets in, and
only from pages of ours: what another page makes a browser send here is refused at the gate.
"""

from __future__ import annotations

import asyncio
import base64
import csv
import hmac
import io
import math
import socket
import time
from collections import OrderedDict, deque
from collections.abc import Awaitable, Callable, Mapping, Sequence
from html import escape
from http.cookies import CookieError, SimpleCookie
from multiprocessing.connection import Connection
from typing import Any
from urllib.parse import parse_qs

import uvicorn
from fastapi import FastAPI, Response
from nicegui import app as nice
from nicegui import core, events, ui

from laptop.desk import (
    EFFECTOR,
    HISTORY,
    METHODS,
    MODES,
    ROWS,
    SAMPLE,
    TOLERANCES,
    VERDICTS,
    Door,
    Mark,
    Sample,
    Shown,
    State,
)
from laptop.watching import GOAL, Point

LARGEST = 64 * 1024
"""Bytes of a message from a browser; ours need a few hundred."""
FRAMES, ALTOGETHER = 20.0, 30.0
"""Pictures per second of a camera that one browser gets, and all of them: more show nobody more,
and browsers on this machine take the tracker's time."""
PLOTS = 1.0
"""Plots are drawn anew every so many s for each browser."""
UNSEEN = 1.0
"""A picture that a browser has not shown so long after it was sent, s, is given up."""
AT_HAND = 40
"""Pictures of a camera that browsers may still fetch."""
CLICK = 5.0
"""A pointer that moves less than this, px of the picture, has clicked."""

Scope = Mapping[str, Any]
Receive = Callable[[], Awaitable[Any]]
Send = Callable[[Any], Awaitable[None]]


# The gate


class Gate:
    """Lets nobody in without the token, nor from elsewhere.

    The address with the token gives a cookie, and is left at once; from then on the cookie is
    asked for, with everything.

    Args:
        inside: the ASGI application behind it.
        token: the secret.
        hosts: HOST:PORT by which browsers may call it.
    """

    def __init__(self, inside: Any, token: str, hosts: Sequence[str]) -> None:
        self._inside = inside
        self._token = token
        self._hosts = frozenset(hosts)
        self._origins = frozenset(f"http://{host}" for host in hosts)
        # Cookies know no ports: two pages on one machine would take each other's away.
        self._cookie = f"brickservo-{hosts[0].rpartition(':')[2]}"

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """One request or connection, see ASGI."""
        if scope["type"] == "lifespan":
            await self._inside(scope, receive, send)
            return
        headers = {
            key.decode("latin-1"): value.decode("latin-1") for key, value in scope["headers"]
        }
        why = self._refusal(scope, headers)
        if why is None and scope["type"] == "http" and self._asks_for_cookie(scope):
            await self._welcome(send)
        elif why is None and self._is_known(headers):
            await self._inside(scope, receive, send if scope["type"] != "http" else _shut(send))
        elif scope["type"] == "websocket":
            await receive()
            await send({"type": "websocket.close", "code": 1008})
        else:
            # What may follow the head is not even thrown away.
            await _say(send, 403, why or NO_TOKEN, connection="close")

    def _refusal(self, scope: Scope, headers: Mapping[str, str]) -> str | None:
        """Why a request is not even looked at, or None."""
        if headers.get("host", "").lower() not in self._hosts:
            return "This page is not to be reached by that name."
        origin = headers.get("origin")
        if origin is None and scope["type"] == "websocket":
            return "No browser connects like that."
        if origin is not None and origin.lower() not in self._origins:
            return "Another page has no business here."
        if scope["type"] == "http" and scope["method"] not in ("GET", "HEAD"):
            return "There is nothing to be sent here."
        return None

    def _asks_for_cookie(self, scope: Scope) -> bool:
        given = parse_qs(scope["query_string"].decode("latin-1")).get("token", [])
        return any(self._is_token(token) for token in given)

    def _is_known(self, headers: Mapping[str, str]) -> bool:
        try:
            cookie = SimpleCookie(headers.get("cookie", "")).get(self._cookie)
        except CookieError:
            return False
        return cookie is not None and self._is_token(cookie.value)

    def _is_token(self, text: str) -> bool:
        return hmac.compare_digest(text.encode("utf-8", "replace"), self._token.encode())

    async def _welcome(self, send: Send) -> None:
        cookie = f"{self._cookie}={self._token}; Path=/; HttpOnly; SameSite=Lax"
        await _say(send, 303, "", location="/", set_cookie=cookie)


NO_TOKEN = (
    "Open the address that the tracker prints: it holds a token, without which nobody gets in. "
    "Each start of the tracker has a new one."
)

_MANNERS = {
    # Nothing comes from elsewhere, nothing goes there, and no other page shows this one in itself.
    "content-security-policy": "default-src 'self' 'unsafe-inline' 'unsafe-eval' data: blob:; "
    "frame-ancestors 'none'; base-uri 'self'; form-action 'none'",
    "x-frame-options": "DENY",
    "x-content-type-options": "nosniff",
    "referrer-policy": "no-referrer",
}


def _headers(more: Mapping[str, str]) -> list[tuple[bytes, bytes]]:
    return [
        (key.replace("_", "-").encode(), value.encode())
        for key, value in {**_MANNERS, **more}.items()
    ]


async def _say(send: Send, status: int, text: str, **headers: str) -> None:
    headers.update(content_type="text/plain; charset=utf-8", cache_control="no-store")
    await send({"type": "http.response.start", "status": status, "headers": _headers(headers)})
    await send({"type": "http.response.body", "body": text.encode()})


def _shut(send: Send) -> Send:
    """Adds to every answer what keeps other pages out."""

    async def say(message: Any) -> None:
        if message["type"] == "http.response.start":
            message = {**message, "headers": [*message["headers"], *_headers({})]}
        await send(message)

    return say


# What all browsers share


class Feed:
    """One camera's pictures, asked for once however many browsers look.

    Args:
        desk: asks it.
        camera: its name.
    """

    def __init__(self, desk: Desk, camera: str) -> None:
        self._desk = desk
        self.camera = camera
        self.shown: OrderedDict[int, Shown] = OrderedDict()
        self.masks: dict[str, str] = {}  # whose pixels are to be shown, per browser
        self._asked = -math.inf
        self._lock = asyncio.Lock()

    @property
    def newest(self) -> Shown | None:
        """The newest picture that is here."""
        return next(reversed(self.shown.values())) if self.shown else None

    async def refresh(self) -> Shown | None:
        """The newest picture there is."""
        async with self._lock:
            if time.monotonic() - self._asked > 0.8 / ALTOGETHER:
                self._asked = time.monotonic()
                newest = self.newest
                masks = tuple(set(self.masks.values()))
                index = newest.index if newest else -1
                shown = await self._desk.ask("view", self.camera, index, masks)
                if shown:
                    self.shown[shown.index] = shown
                    while len(self.shown) > AT_HAND:
                        self.shown.popitem(last=False)
        return self.newest


class Desk:
    """The tracker's desk, seen from here: never blocks, and what many ask is asked once.

    Args:
        pipe: to it.
    """

    def __init__(self, pipe: Connection) -> None:
        self._door = Door(pipe)
        self.feeds: dict[str, Feed] = {}
        self.state: State | None = None
        self.past: deque[Sample] = deque(maxlen=round(HISTORY / SAMPLE))
        self.pages: set[str] = set()  # of browsers, by NiceGUI's id
        self._looked = -math.inf
        self._lock = asyncio.Lock()

    @property
    def pace(self) -> float:
        """Between two pictures of a camera for one browser, s."""
        return max(1 / FRAMES, len(self.pages) / ALTOGETHER)

    async def ask(self, question: str, *args: Any) -> Any:
        """See `laptop.desk.Door.ask`."""
        return await asyncio.to_thread(self._door.ask, question, *args)

    async def look(self) -> State:
        """The newest state and history."""
        async with self._lock:
            if self.state is None or time.monotonic() - self._looked > SAMPLE / 2:
                self._looked = time.monotonic()
                self.state = await self.ask("state")
                for eye in self.state.eyes:
                    self.feeds.setdefault(eye.camera, Feed(self, eye.camera))
                last = self.past[-1].t if self.past else -math.inf
                self.past.extend(await self.ask("history", last))
        return self.state


def csv_of(samples: Sequence[Sample]) -> str:
    """The history as CSV: t, error, components, joints in degrees, condition, moves, cameras."""
    rows = sorted({row for sample in samples for row in sample.e})
    joints = max((len(sample.q) for sample in samples), default=0)
    cameras = sorted({name for sample in samples for name in sample.ages})
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(
        ["t", "error_px"]
        + [f"e_{row}_px" for row in rows]
        + [f"q{n}_deg" for n in range(1, joints + 1)]
        + ["condition", "moves"]
        + [f"{what}_{name}" for name in cameras for what in ("age_ms", "fps")]
    )
    for sample in samples:
        angles = [math.degrees(angle) for angle in sample.q]
        numbers: list[float | None] = [sample.t, sample.error]
        numbers += [sample.e.get(row) for row in rows]
        numbers += [*angles, *[None] * (joints - len(angles)), sample.condition, sample.moves]
        for name in cameras:
            age = sample.ages.get(name)
            numbers += [None if age is None else 1000 * age, sample.rates.get(name)]
        writer.writerow(["" if n is None else f"{n:.10g}" for n in numbers])
    return out.getvalue()


# Overlays


_INK = {EFFECTOR: "#ffd60a", GOAL: "#40e0ff"}
_OTHERS = ("#7dff8a", "#ff9df5", "#b9a5ff")


def ink(name: str, names: Sequence[str]) -> str:
    """The colour of a marker's overlay."""
    others = [other for other in names if other not in _INK]
    return _INK.get(name) or _OTHERS[others.index(name) % len(_OTHERS)]


def overlay(
    shown: Shown,
    mask: str = "",
    windows: bool = True,
    drag: Sequence[Point] = (),
    box: bool = False,
) -> str:
    """What is drawn over a picture, as SVG in its pixels.

    Args:
        mask: the marker whose pixels are to be shown, or "".
        drag: what the pointer draws just now, px; `box`: a rectangle, else a path.
    """
    k = shown.width / 640
    names = [mark.name for mark in shown.marks]
    parts = []
    if png := shown.masks.get(mask):
        data = base64.b64encode(png).decode()
        parts.append(
            f'<rect width="{shown.width}" height="{shown.height}" fill="#000" opacity=".55"/>'
            f'<image width="{shown.width}" height="{shown.height}" opacity=".95" '
            f'href="data:image/png;base64,{data}"/>'
        )
    parts.append(
        f'<g transform="translate(.5 .5)" style="--k:{k:g}" fill="none" stroke-linecap="round">'
    )
    if len(shown.trail) > 1:
        parts.append(_line(shown.trail, "#ffd60a", 1.6 * k, "opacity='.75'"))
    if shown.aim:
        if shown.ahead:
            way = [shown.aim, *shown.ahead]
            dashes = f"stroke-dasharray='{5 * k:g} {5 * k:g}'"
            parts.append(_line(way, "#ff5ca8", 2 * k, dashes))
            parts += [_dot(u, v, 3 * k, "#ff5ca8") for u, v in shown.ahead]
        parts.append(_target(*shown.aim, k))
    for mark in shown.marks:
        color = ink(mark.name, names)
        if windows and mark.window:
            left, top, right, bottom = mark.window
            parts.append(
                f'<rect x="{left:.1f}" y="{top:.1f}" width="{right - left:.1f}" '
                f'height="{bottom - top:.1f}" stroke="{color}" stroke-width="{k:g}" '
                f'stroke-dasharray="{3 * k:g} {4 * k:g}" opacity=".8"/>'
            )
        parts.append(_marked(mark, color, shown, k))
    if len(drag) > 1:
        if box:
            (u0, v0), (u1, v1) = drag[0], drag[-1]
            parts.append(
                f'<rect x="{min(u0, u1):.1f}" y="{min(v0, v1):.1f}" width="{abs(u1 - u0):.1f}" '
                f'height="{abs(v1 - v0):.1f}" stroke="#fff" stroke-width="{1.5 * k:g}" '
                f'stroke-dasharray="{4 * k:g}"/>'
            )
        else:
            parts.append(_line(drag, "#ff5ca8", 2.5 * k))
    return "".join([*parts, "</g>"])


def _line(points: Sequence[Point], color: str, width: float, more: str = "") -> str:
    way = " ".join(f"{u:.1f},{v:.1f}" for u, v in points)
    return f'<polyline points="{way}" stroke="{color}" stroke-width="{width:g}" {more}/>'


def _dot(u: float, v: float, radius: float, color: str) -> str:
    return f'<circle cx="{u:.1f}" cy="{v:.1f}" r="{radius:g}" fill="{color}"/>'


def _target(u: float, v: float, k: float) -> str:
    rings = "".join(
        f'<circle r="{9 * k:g}" stroke="{color}" stroke-width="{width * k:g}"/>'
        f'<path d="M{-15 * k:g},0H{15 * k:g}M0,{-15 * k:g}V{15 * k:g}" stroke="{color}" '
        f'stroke-width="{width * k:g}"/>'
        for color, width in (("#000a", 5), ("#ff5ca8", 2.4))
    )
    return f'<g data-aim="{u:.1f},{v:.1f}" transform="translate({u:.1f} {v:.1f})">{rings}</g>'


def _marked(mark: Mark, color: str, shown: Shown, k: float) -> str:
    if mark.u is None or mark.v is None:
        return ""
    radius = mark.radius or 10 * k
    shapes = "".join(
        f'<circle r="{radius:.1f}" stroke="{tone}" stroke-width="{width * k:g}"/>'
        f'<path d="M{-5 * k:g},0H{5 * k:g}M0,{-5 * k:g}V{5 * k:g}" stroke="{tone}" '
        f'stroke-width="{width * k:g}"/>'
        for tone, width in (("#000a", 4.5), (color, 2))
    )
    text = mark.name
    if mark.confidence is not None:
        text += f" {mark.confidence:.2f}" + (f" {mark.why}" if mark.why else "")
    size = 14 * k
    right = mark.u + radius + 6 * k + 0.58 * size * len(text) < shown.width
    below = mark.v - radius - size < 0
    label = (
        f'<text x="{(radius + 5 * k) * (1 if right else -1):.1f}" '
        f'y="{(radius + size) if below else -radius * 0.6:.1f}" '
        f'text-anchor="{"start" if right else "end"}" font-weight="600" '
        f'fill="{color}" stroke="#000c" stroke-width="{3.2 * k:g}" paint-order="stroke" '
        f'font-family="Roboto, sans-serif">{escape(text)}</text>'
    )
    return (
        f'<g data-marker="{escape(mark.name)}" data-frame="{shown.index}" '
        f'transform="translate({mark.u:.2f} {mark.v:.2f})">{shapes}{label}</g>'
    )


# One browser


LOOK, AIM, PICK, ADD, REMOVE = "look", "aim", "pick", "add", "remove"
TOOLS = {
    AIM: ("Aim", "ads_click", "Click the goal; drag a path for the tip to follow."),
    PICK: ("Pick", "colorize", "Click a marker, or drag a box into it: this is its colour."),
    ADD: ("Add", "add_circle", "Click what the marker's colour should take in, too."),
    REMOVE: ("Remove", "remove_circle", "Click what is wrongly taken for the marker."),
}
"""What a click in the picture does: name, icon, explanation."""

STYLE = """
:root { --ok: #2e9e5b; --bad: #d92d3a; --warm: #d97b00; }
body { font-size: 16px; }
.nicegui-content { padding: 0; max-width: none; }
.bar { display: flex; flex-wrap: wrap; align-items: center; gap: .5rem 1rem; width: 100%; }
.q-header { background: #10243a !important; color: #fff; padding: .5rem 1rem; }
.word { font-size: 1.35rem; font-weight: 700; letter-spacing: .01em; }
.pill { border-radius: 99px; padding: .2rem .75rem; font-size: .95rem; font-weight: 600;
        background: #ffffff22; white-space: nowrap; }
.pill.ok { background: var(--ok); } .pill.warm { background: var(--warm); }
.stop { font-size: 1.5rem !important; font-weight: 800 !important; min-width: 10rem;
        min-height: 3.4rem; border: 3px solid #fff8; letter-spacing: .08em; }
.desk { display: grid; grid-template-columns: minmax(0, 1fr) 23rem; gap: 1rem; padding: 1rem;
        width: 100%; align-items: start; }
.pictures { display: grid; grid-template-columns: repeat(auto-fit, minmax(min(100%, 26rem), 1fr));
            gap: 1rem; width: 100%; }
.pictures.one .picture { max-width: calc((100vh - 13rem) * 4 / 3); margin: 0 auto; }
.picture img { display: block; }
.picture { position: relative; border-radius: .6rem; overflow: hidden; background: #000;
           width: 100%; min-height: 8rem; }
.picture .aiming { cursor: crosshair; touch-action: none; }
.caption { position: absolute; top: 0; left: 0; right: 0; padding: .3rem .7rem; font-size: .9rem;
           color: #fff; background: linear-gradient(#000b, #0000); pointer-events: none;
           font-variant-numeric: tabular-nums; }
.lost { position: absolute; left: .6rem; right: .6rem; bottom: .6rem; pointer-events: none;
        display: flex; flex-direction: column; gap: .4rem; }
.lost > div { background: #b3121fee; color: #fff; border-radius: .5rem; padding: .4rem .8rem;
              font-size: 1.05rem; line-height: 1.3; }
.lost > .doubt { background: #8a5a00ee; }
.side { display: flex; flex-direction: column; gap: 1rem; }
.card { border-radius: .6rem; padding: .9rem 1rem; width: 100%; background: #fff;
        border: 1px solid #0002; display: flex; flex-direction: column; gap: .6rem; }
.body--dark .card { background: #1c2733; border-color: #fff2; }
.body--light { background: #f1f4f7; } .body--dark { background: #0f161e; }
.card h2 { font-size: .85rem; font-weight: 700; letter-spacing: .06em; text-transform: uppercase;
           line-height: 1.2; margin: 0; opacity: .75; }
.verdict { font-size: 1.3rem; font-weight: 650; line-height: 1.25; }
.verdict.ok { color: var(--ok); } .verdict.bad { color: var(--bad); }
.body--dark .verdict.ok { color: #55d68a; } .body--dark .verdict.bad { color: #ff7a83; }
.error { font-size: 2.4rem; font-weight: 700; font-variant-numeric: tabular-nums; line-height: 1; }
.quiet { opacity: .8; font-size: .95rem; line-height: 1.35; }
.mono { font-family: ui-monospace, monospace; font-size: .85rem; overflow-wrap: anywhere;
        user-select: all; background: #8882; border-radius: .3rem; padding: .4rem .5rem; }
.go { font-size: 1.15rem !important; min-height: 3rem; flex: 1; }
.tools { width: 100%; } .tools .q-btn { flex: 1; padding: .3rem; }
.plots { display: grid; grid-template-columns: repeat(auto-fit, minmax(min(100%, 17rem), 1fr));
         gap: .6rem; width: 100%; }
.plot { height: 10.5rem; width: 100%; }
table.facts { border-collapse: collapse; width: 100%; table-layout: fixed; font-size: .95rem;
              font-variant-numeric: tabular-nums; }
table.facts td { padding: .15rem 0; vertical-align: top; overflow-wrap: anywhere; }
table.facts td:first-child { opacity: .75; padding-right: .8rem; width: 6.2rem; }
.body--dark .q-btn--flat, .body--dark .q-btn--outline { --q-primary: #86bcff; }
.picture text { font-size: calc(14px * var(--k)); }
.pictures:not(.one) .picture text { font-size: calc(21px * var(--k)); }
:focus-visible { outline: 3px solid #ff9f0a !important; outline-offset: 2px; }
@media (max-width: 60rem) {
  .desk { grid-template-columns: minmax(0, 1fr); padding: .5rem; gap: .5rem; }
  .side { display: contents; }
  .picture text, .pictures:not(.one) .picture text { font-size: calc(24px * var(--k)); }
  .later { order: 1; }
  .stop { min-width: 7rem; flex: 1; }
  .word { display: none; }
  .q-header { padding: .4rem .5rem; }
}
"""


class Picture:
    """One camera in one browser: the newest picture that it has time for, and what is clicked."""

    def __init__(self, view: Page, camera: str) -> None:
        self._view = view
        self.camera = camera
        self._sent: int | None = None  # what it was sent and has not shown yet
        self._last = -math.inf  # when that was
        self.shown: Shown | None = None  # what the browser shows
        self._drawn = ""
        self._drag: list[Point] = []
        with ui.element("div").classes("picture"):
            self.image = ui.interactive_image(
                events=["pointerdown", "pointermove", "pointerup", "pointercancel"], sanitize=False
            )
            self.image.classes("aiming w-full").on_mouse(self._on_pointer)
            self.image.on("loaded", self._on_loaded)
            self.image.props(f'alt="camera {camera}"')
            self._caption = ui.label().classes("caption")
            self._lost = ui.element("div").classes("lost").props("role=status aria-live=polite")
        self._told: list[tuple[str, str, str]] = []

    async def refresh(self) -> None:
        """Send the newest picture once the browser has shown the last one."""
        feed = self._view.desk.feeds[self.camera]
        if self._view.paused:
            if self.shown:
                self._draw(self.shown)
            return
        if time.monotonic() - self._last < (UNSEEN if self._sent else self._view.desk.pace):
            return
        shown = await feed.refresh()
        if shown is None or (self._sent is None and self.shown and shown.index <= self.shown.index):
            return
        self._sent, self._last = shown.index, time.monotonic()
        self.image.set_source(f"/view/{self.camera}/{shown.index}.jpg")
        self._draw(shown)

    def _draw(self, shown: Shown) -> None:
        view = self._view
        drawn = overlay(shown, view.mask, view.windows, self._drag, view.tool != AIM)
        if drawn != self._drawn:
            self._drawn = drawn
            self.image.set_content(drawn)
        lost = [
            (mark.name, mark.why, mark.advice)
            for mark in shown.marks
            if mark.why and not (mark.name == GOAL and shown.aim)
        ]
        if lost != self._told:
            self._told = lost
            self._lost.clear()
            with self._lost:
                for name, why, advice in lost:
                    what = f"{name} lost: {why}" if why != "doubtful" else f"{name} {why}"
                    then = f". {advice[:1].upper()}{advice[1:]}." if advice else "."
                    ui.label(what + then).classes("doubt" if why == "doubtful" else "")

    def describe(self, state: State) -> None:
        """The camera in a line."""
        eye = next(eye for eye in state.eyes if eye.camera == self.camera)
        facts = [f"{eye.camera}", eye.source, f"{eye.rate:.0f} fps"]
        if eye.age is not None:
            facts.append(f"{1000 * eye.age:.0f} ms")
        if eye.trouble:
            facts.append(eye.trouble)
        if self._view.paused:
            facts.append("paused")
        self._caption.set_text(" · ".join(facts))

    async def _on_loaded(self, event: events.GenericEventArguments) -> None:
        if self._sent is None:
            return
        self.shown = self._view.desk.feeds[self.camera].shown.get(self._sent, self.shown)
        self._sent = None
        await self.refresh()

    async def pin(self) -> None:
        """Keep what is shown, to pick in it."""
        if self.shown:
            self._view.tell(await self._view.desk.ask("pin", self.camera, self.shown.index))

    async def _on_pointer(self, event: events.MouseEventArguments) -> None:
        if self.shown is None:
            return
        point = (
            min(max(event.image_x - 0.5, 0.0), self.shown.width - 1.0),
            min(max(event.image_y - 0.5, 0.0), self.shown.height - 1.0),
        )
        if event.type == "pointerdown" and event.button == 0:
            self._drag = [point]
        elif event.type == "pointermove" and self._drag:
            self._drag.append(point)
        elif event.type == "pointercancel":
            self._drag = []
        elif event.type == "pointerup" and self._drag:
            drag, self._drag = [*self._drag, point], []
            clicked = all(math.dist(drag[0], where) < CLICK for where in drag)
            await self._view.clicked(self.camera, self.shown.index, drag[:1] if clicked else drag)


class Plot:
    """The last minute of something, as lines."""

    def __init__(self, title: str, log: bool = False) -> None:
        quiet = {"color": "#8a94a0", "fontSize": 12}
        grid = {"lineStyle": {"color": "#8a94a033"}}
        self._lines: list[str] = []
        self.chart = ui.echart(
            {
                "animation": False,
                "title": {"text": title, "left": 0, "top": 0,
                          "textStyle": {"color": "#8a94a0", "fontSize": 14}},
                "legend": {"right": 0, "top": 0, "textStyle": quiet, "itemWidth": 14,
                           "itemHeight": 8},
                "grid": {"left": 44, "right": 8, "top": 30, "bottom": 22},
                "xAxis": {"type": "value", "min": -HISTORY, "max": 0, "axisLabel":
                          {**quiet, ":formatter": "v => v + ' s'"}, "splitLine": grid},
                "yAxis": {"type": "log" if log else "value", "scale": True, "axisLabel": quiet,
                          "splitLine": grid, "splitNumber": 3, "axisLine": {"show": False},
                          "axisTick": {"show": False}},
                "color": ["#e8590c", "#1c7ed6", "#37b24d", "#ae3ec9", "#f59f00", "#0ca678"],
                "series": [],
            }
        ).classes("plot")  # fmt: skip

    def show(self, lines: Mapping[str, Sequence[tuple[float, float | None]]]) -> None:
        """Draw lines by name, of (s before now, value)."""
        options = self.chart.options
        options["legend"]["show"] = len(lines) > 1
        options["series"] = [
            {"name": name, "type": "line", "showSymbol": False, "data": points,
             "lineStyle": {"width": 2}}
            for name, points in lines.items()
        ]  # fmt: skip
        self.chart.update()


class Page:
    """One browser's page."""

    def __init__(self, desk: Desk) -> None:
        self.desk = desk
        self.tool = AIM
        self.mask = ""
        self.windows = True
        self.paused = False
        self._pictures: dict[str, Picture] = {}
        self._marker = EFFECTOR
        self._facts = ""
        self._plot_next = -math.inf

    async def build(self) -> None:
        """Everything on it."""
        self.desk.pages.add(ui.context.client.id)
        await self.desk.ask("opened")
        state = await self.desk.look()
        ui.add_css(STYLE)
        ui.colors(primary="#1c62ad", positive="#23814a", negative="#c8101c")
        self._dark = ui.dark_mode(None)
        self._header()
        several = len(state.eyes) > 1
        with ui.element("main").classes("desk"):
            with ui.element("div").classes("side"):
                with ui.element("div").classes("pictures" + " one" * (not several)):
                    for eye in state.eyes:
                        self._pictures[eye.camera] = Picture(self, eye.camera)
                self._plots_card()
            with ui.element("div").classes("side"):
                self._drive_card(several)
                self._click_card()
                self._state_card()
        ui.keyboard(self._on_escape, ignore=[], repeating=False)
        ui.keyboard(self._on_key, ignore=["input", "select", "textarea"], repeating=False)
        ui.timer(0.5 / FRAMES, self._refresh)
        ui.timer(SAMPLE, self._describe)
        ui.timer(PLOTS, self._plot)
        self._show_state(state)

    # Parts

    def _header(self) -> None:
        with ui.header(), ui.element("div").classes("bar"):
            ui.label("BrickServo").classes("word")
            self._brick = ui.label().classes("pill").mark("brick")
            ui.space()
            ui.button(icon="dark_mode", on_click=self._toggle_dark).props(
                'flat round color=white aria-label="dark or light"'
            ).tooltip("dark or light (D)")
            self._stop = (
                ui.button("STOP", on_click=self.stop)
                .props('color=negative unelevated aria-label="STOP the arm (Escape)"')
                .classes("stop")
                .tooltip("stop the arm (Escape)")
            )

    def _drive_card(self, several: bool) -> None:
        with ui.element("section").classes("card").props('aria-label="drive"'):
            ui.html("<h2>Drive</h2>", sanitize=False)
            with ui.element("div").props("role=status aria-live=polite"):
                self._verdict = ui.label().classes("verdict").mark("verdict")
                self._reason = ui.label().classes("quiet")
            with ui.row().classes("items-end gap-3"):
                self._error = ui.label().classes("error").mark("error")
                self._run = ui.label().classes("quiet")
            self._goal = ui.label().classes("quiet")
            with ui.row().classes("w-full gap-2 no-wrap"):
                self._start = (
                    ui.button("Start", icon="play_arrow", on_click=self.start)
                    .props("color=positive unelevated")
                    .classes("go")
                    .tooltip("to the goal (S)")
                )
                self._hold = (
                    ui.button("Hold", icon="pause", on_click=self.hold)
                    .props("outline")
                    .classes("go")
                    .tooltip("halt here; Start goes on (H)")
                )
            self._to_marker = ui.button(
                "Aim at the goal marker", on_click=self._aim_at_marker
            ).props("flat dense no-caps icon=my_location")
            with ui.expansion("How", icon="tune").classes("w-full").props("dense"):
                self._method = ui.select(list(METHODS), value=METHODS[0], label="method")
                self._mode = ui.select(list(MODES), value=MODES[0], label="mode")
                self._rows = ui.select(list(ROWS), value=ROWS[0], label="rows of two cameras")
                self._rows.set_visibility(several)
                self._tolerance = ui.number(
                    "tolerance, px", value=5.0, min=TOLERANCES[0], max=TOLERANCES[1], step=0.5
                )
                for choice in (self._method, self._mode, self._rows, self._tolerance):
                    choice.classes("w-full").props("dense")

    def _click_card(self) -> None:
        with ui.element("section").classes("card").props('aria-label="a click in the picture"'):
            ui.html("<h2>A click in the picture</h2>", sanitize=False)
            self._tool = (
                ui.toggle({tool: name for tool, (name, _, _) in TOOLS.items()}, value=AIM)
                .props("no-caps unelevated spread toggle-color=primary")
                .classes("tools")
                .on_value_change(self._on_tool)
            )
            self._explained = ui.label(TOOLS[AIM][2]).classes("quiet")
            self._which = (
                ui.select([EFFECTOR, GOAL], value=EFFECTOR, label="of the marker (or a new name)",
                          new_value_mode="add-unique", with_input=True)
                .classes("w-full").props("dense")
                .on_value_change(self._on_which)
            )  # fmt: skip
            self._which.set_visibility(False)
            with ui.row().classes("w-full gap-2 items-center"):
                self._undo = ui.button("Undo", icon="undo", on_click=self._undo_colour).props(
                    "flat dense no-caps"
                )
                self._pause = ui.button(
                    "Pause", icon="pause_circle", on_click=self._toggle_pause
                ).props("flat dense no-caps")
                self._masked = ui.checkbox("Mask", on_change=self._on_mask).props("dense")
                ui.checkbox("Windows", value=True, on_change=self._on_windows).props("dense")

    def _state_card(self) -> None:
        with ui.element("section").classes("card later").props('aria-label="state"'):
            ui.html("<h2>State</h2>", sanitize=False)
            self._note = ui.label().classes("quiet")
            self._invite = ui.element("div")
            with self._invite:
                ui.label("On the brick, type one of").classes("quiet")
                self._commands = ui.column().classes("w-full gap-1")
            self._table = ui.html("", sanitize=False).classes("w-full")

    def _plots_card(self) -> None:
        with ui.element("section").classes("card later").props('aria-label="the last minute"'):
            with ui.row().classes("w-full items-center gap-2"):
                ui.html("<h2>The last minute</h2>", sanitize=False)
                ui.space()
                self._plotting = ui.checkbox("Run", value=True).props("dense")
                ui.button(
                    "CSV", icon="download", on_click=lambda: ui.download.from_url("/history.csv")
                ).props("flat dense no-caps")
            with ui.element("div").classes("plots"):
                self._plots = [
                    Plot("error, px"),
                    Plot("components, px"),
                    Plot("joints, degrees"),
                    Plot("steps, condition"),
                    Plot("frame age, ms"),
                    Plot("frames per second"),
                ]

    # What is shown

    async def _refresh(self) -> None:
        await asyncio.gather(*(picture.refresh() for picture in self._pictures.values()))

    async def _describe(self) -> None:
        self._show_state(await self.desk.look())

    def _show_state(self, state: State) -> None:
        for picture in self._pictures.values():
            picture.describe(state)
        status = state.status if state.brick else None
        verdict = status.verdict if status else None
        if state.running:
            words, tone = ("On its way." if verdict == "" else "Starting ..."), ""
        elif status is None:
            words = "The emulated brick is coming ..." if state.own else "No brick is connected."
            tone = ""
        else:
            words = VERDICTS.get(status.verdict, f"{status.verdict}.")
            tone = {"converged": "ok", "ready": "", "stopped": ""}.get(status.verdict, "bad")
        if state.running and state.left:
            words = f"Along the path, {state.left} points to go."
        self._verdict.set_text(words)
        self._verdict.classes(remove="ok bad", add=tone)
        self._reason.set_text(status.reason if status else "")
        known = status is not None and status.error is not None
        self._error.set_text(f"{status.error:.1f} px" if status and known else "– px")
        self._run.set_text(
            f"run {status.run}, {status.moves} moves" if status and status.run else ""
        )
        self._goal.set_text("Goal: " + goal_text(state))
        self._to_marker.set_visibility(bool(state.aims) and GOAL in state.markers)
        self._start.set_enabled(state.brick is not None and not state.running)
        self._hold.set_enabled(state.running)
        self._undo.set_enabled(state.undoable > 0)
        self._brick.set_text(brick_text(state))
        self._brick.classes(remove="ok warm", add="ok" if state.brick else "warm")
        self._note.set_text(state.note)
        self._invite.set_visibility(state.brick is None and not state.own)
        names = list(state.markers)
        if self._which.options != [*dict.fromkeys([EFFECTOR, GOAL, *names, self._marker])]:
            self._which.set_options([*dict.fromkeys([EFFECTOR, GOAL, *names, self._marker])])
        facts = facts_of(state)
        if facts != self._facts:
            self._facts = facts
            self._table.set_content(facts)
            self._commands.clear()
            with self._commands:
                for command in state.commands:
                    ui.label(f"{command} --wait").classes("mono")

    async def _plot(self) -> None:
        if not self._plotting.value or time.monotonic() < self._plot_next:
            return
        self._plot_next = time.monotonic() + PLOTS * (len(self.desk.pages) - 0.5)
        past = list(self.desk.past)
        if not past:
            return
        now = past[-1].t
        times = [round(sample.t - now, 2) for sample in past]

        def lines(
            values: Callable[[Sample], Mapping[str, float | None]],
        ) -> dict[str, list[tuple[float, float | None]]]:
            rows = [values(sample) for sample in past]
            names = dict.fromkeys(name for row in rows for name in row)
            return {
                name: [
                    (t, None if (value := row.get(name)) is None else round(value, 3))
                    for t, row in zip(times, rows, strict=True)
                ]
                for name in names
            }

        for plot, values in zip(
            self._plots,
            (
                lambda s: {"error": s.error},
                lambda s: s.e,
                lambda s: {f"q{n}": math.degrees(q) for n, q in enumerate(s.q, 1)},
                lambda s: {"steps": float(s.moves), "condition": s.condition},
                lambda s: {n: age and 1000 * age for n, age in s.ages.items()},
                lambda s: s.rates,
            ),
            strict=True,
        ):
            plot.show(lines(values))

    # What is done

    def tell(self, why: str) -> None:
        """Say why something was not done; "" for nothing."""
        if why:
            ui.notify(why, type="warning", position="bottom", timeout=6000, multi_line=True)

    async def clicked(self, camera: str, index: int, points: Sequence[Point]) -> None:
        """A click at a point, or a drag along some, in a picture."""
        if self.tool == AIM:
            if len(points) > 1:
                why = await self.desk.ask("follow", camera, list(points))
            else:
                why = await self.desk.ask("aim", camera, *points[0])
        else:
            where = (*points[0], *points[-1]) if len(points) > 1 else points[0]
            why = await self.desk.ask(self.tool, self._marker, camera, index, where)
            if not why:
                ui.notify(f"{self._marker}: kept", type="positive", position="bottom", timeout=1500)
        self.tell(why)

    async def start(self) -> None:
        """Start a run."""
        tolerance = self._tolerance.value
        if tolerance is None:
            self.tell("tolerance: write a number of px, e.g. 5")
            return
        orders = self._method.value, self._mode.value, self._rows.value, float(tolerance)
        self.tell(await self.desk.ask("start", *orders))

    async def hold(self) -> None:
        """Halt."""
        self.tell(await self.desk.ask("hold"))

    async def stop(self) -> None:
        """STOP."""
        self.tell(await self.desk.ask("stop"))

    async def _aim_at_marker(self) -> None:
        self.tell(await self.desk.ask("aim_at_marker"))

    async def _undo_colour(self) -> None:
        self.tell(await self.desk.ask("undo"))

    async def _toggle_pause(self) -> None:
        self.paused = not self.paused
        self._pause.set_text("Go on" if self.paused else "Pause")
        self._pause.set_icon("play_circle" if self.paused else "pause_circle")
        if self.paused:
            for picture in self._pictures.values():
                await picture.pin()

    def _toggle_dark(self) -> None:
        # The first time it is as the system has it; then the other way round.
        self._dark.set_value(self._dark.value is not True)

    def _on_tool(self, event: events.ValueChangeEventArguments) -> None:
        self.tool = event.value
        self._explained.set_text(TOOLS[self.tool][2])
        self._which.set_visibility(self.tool != AIM)

    def _on_which(self, event: events.ValueChangeEventArguments) -> None:
        self._marker = str(event.value or EFFECTOR)
        self._on_mask()

    def _on_mask(self) -> None:
        self.mask = self._marker if self._masked.value else ""
        for feed in self.desk.feeds.values():
            feed.masks.pop(ui.context.client.id, None)
            if self.mask:
                feed.masks[ui.context.client.id] = self.mask

    def _on_windows(self, event: events.ValueChangeEventArguments) -> None:
        self.windows = event.value

    async def _on_escape(self, event: events.KeyEventArguments) -> None:
        if event.action.keydown and event.key.escape:
            await self.stop()

    async def _on_key(self, event: events.KeyEventArguments) -> None:
        modified = event.modifiers.ctrl or event.modifiers.alt or event.modifiers.meta
        if not event.action.keydown or modified:
            return
        key = event.key.name.lower()
        if key in "1234" and len(key) == 1:
            self._tool.set_value(list(TOOLS)[int(key) - 1])
        elif key == "s":
            await self.start()
        elif key == "h":
            await self.hold()
        elif key == "p":
            await self._toggle_pause()
        elif key == "u":
            await self._undo_colour()
        elif key == "m":
            self._masked.set_value(not self._masked.value)
        elif key == "d":
            self._toggle_dark()


def goal_text(state: State) -> str:
    """Where the tip is to go, for people."""
    if state.aims:
        where = [f"{u:.0f}, {v:.0f}" for u, v in state.aims.values()]
        if len(state.eyes) > 1:
            where = [f"{name} {text}" for name, text in zip(state.aims, where, strict=True)]
        path = f", then {state.left} more" if state.left else ""
        return "pixel " + " and ".join(where) + path
    return "the goal marker" if GOAL in state.markers else "none yet; click one in the picture"


def brick_text(state: State) -> str:
    """Whether there is a brick, for people."""
    if state.brick is None:
        return "emulated brick is coming" if state.own else "no brick connected"
    return "emulated brick" if state.own else f"brick {state.brick.removeprefix('::ffff:')}"


def facts_of(state: State) -> str:
    """The state as a table in HTML."""
    rows = []
    if state.round_trip is not None:
        rows.append(("link", f"{1000 * state.round_trip:.1f} ms round trip"))
    for eye in state.eyes:
        age = "" if eye.age is None else f", {1000 * eye.age:.0f} ms old"
        rows.append((f"camera {eye.camera}", f"{eye.rate:.0f} fps{age}, {eye.dropped} dropped"))
    rows += [(name, look) for name, look in state.markers.items()]
    rows.append(("colours in", state.file))
    cells = "".join(f"<tr><td>{escape(a)}</td><td>{escape(b)}</td></tr>" for a, b in rows)
    return f'<table class="facts">{cells}</table>'


# The server


def serve(pipe: Connection, listener: socket.socket, token: str, hosts: Sequence[str]) -> None:
    """Serve the page until the process ends.

    Args:
        pipe: to the tracker's desk.
        listener: bound already.
        token: lets a browser in.
        hosts: HOST:PORT by which browsers may call it.
    """
    desk = Desk(pipe)
    app = FastAPI(docs_url=None, redoc_url=None, openapi_url=None)

    @app.get("/view/{camera}/{index}.jpg")
    def view(camera: str, index: int) -> Response:
        feed = desk.feeds.get(camera)
        shown = feed and feed.shown.get(index)
        if not shown:
            return Response(status_code=404)
        fresh = {"cache-control": "private, max-age=60"}
        return Response(shown.jpeg, media_type="image/jpeg", headers=fresh)

    @app.get("/history.csv")
    def history() -> Response:
        named = {"content-disposition": "attachment; filename=history.csv"}
        return Response(csv_of(list(desk.past)), media_type="text/csv", headers=named)

    async def root() -> None:
        await Page(desk).build()

    def forget(client: Any) -> None:
        desk.pages.discard(client.id)
        for feed in desk.feeds.values():
            feed.masks.pop(client.id, None)

    nice.on_delete(forget)
    # Its own socket would take every origin; and what is polled is posted, which the gate refuses.
    core.sio.eio.cors_allowed_origins = [f"http://{host}" for host in hosts]
    core.sio.eio.transports = ["websocket"]
    nice.config.socket_io_js_transports = ["websocket"]
    ui.run_with(
        app,
        root=root,
        title="BrickServo",
        dark=None,
        language="en-US",
        reconnect_timeout=10.0,
        message_history_length=200,
        tailwind=False,
        show_welcome_message=False,
    )
    gate = Gate(app, token, hosts)
    config = uvicorn.Config(
        gate,
        log_level="critical",  # addresses hold the token
        access_log=False,
        ws="wsproto",
        ws_max_size=LARGEST,
        server_header=False,
    )
    uvicorn.Server(config).run(sockets=[listener])
