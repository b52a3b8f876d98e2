"""A report as one HTML file that needs nothing else: on a phone, in the dark, without a network."""

from __future__ import annotations

import base64
from collections.abc import Sequence
from html import escape
from string import Template
from typing import Any

import cv2
import numpy as np

PHOTO = 400_000
"""A PNG larger than this is a photograph, bytes: a tenth as large as JPEG."""


def document(
    title: str,
    good: bool,
    verdict: str,
    headline: str,
    facts: str,
    table: str,
    note: str,
    body: str,
) -> str:
    """The text of the file.

    Args:
        title, verdict, headline, facts, note: plain text; good: their mood.
        table, body: HTML.
    """
    return _PAGE.substitute(
        title=escape(title),
        mood="good" if good else "bad",
        verdict=escape(verdict),
        headline=escape(headline),
        facts=escape(facts),
        table=table,
        note=escape(note),
        body=body,
    )


def section(heading: str, caption: str, picture: bytes) -> str:
    """A section with a picture, a PNG."""
    kind = "png"
    if len(picture) > PHOTO:
        kind, picture = "jpeg", photograph(picture, 90)
    data = base64.b64encode(picture).decode("ascii")
    return (
        f'<section><h2>{escape(heading)}</h2><figure><img alt="{escape(heading)}" '
        f'src="data:image/{kind};base64,{data}">'
        f"<figcaption>{escape(caption)}</figcaption></figure></section>"
    )


def photograph(picture: bytes, quality: int) -> bytes:
    """A picture as JPEG."""
    pixels: Any = cv2.imdecode(np.frombuffer(picture, np.uint8), cv2.IMREAD_COLOR)
    return cv2.imencode(".jpg", pixels, [cv2.IMWRITE_JPEG_QUALITY, quality])[1].tobytes()


def table(headings: Sequence[str], rows: Sequence[str]) -> str:
    """A table of rows in HTML."""
    head = "".join(f"<th>{escape(heading)}</th>" for heading in headings)
    return f"<table><thead><tr>{head}</tr></thead><tbody>{''.join(rows)}</tbody></table>"


def cells(texts: Sequence[str]) -> str:
    """Cells of a row."""
    return "".join(f"<td>{escape(text)}</td>" for text in texts)


def figures(values: Sequence[float], form: str) -> str:
    """Numbers side by side."""
    return " ".join(form.format(value) for value in values).replace("-", "\u2212")


_PAGE = Template("""<!doctype html>
<html lang="en">
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>$title</title>
<style>
:root { color-scheme: light dark; --ink: #1a1a1a; --quiet: #5b6167; --paper: #f6f7f9; --card: #fff;
  --line: #d3dae1; --good: #00734f; --bad: #b3430a; --code: #eceff3; }
@media (prefers-color-scheme: dark) { :root { --ink: #e9ecef; --quiet: #a3abb3; --paper: #14171a;
  --card: #1d2125; --line: #363c43; --good: #3ecf9a; --bad: #ff9256; --code: #2a2f35; } }
* { box-sizing: border-box; }
body { margin: 0 auto; padding: 1.5rem clamp(.8rem, 3vw, 2.5rem) 4rem; max-width: 76rem;
  background: var(--paper); color: var(--ink);
  font: clamp(16px, .55vw + 13px, 20px)/1.55 system-ui, "Segoe UI", Roboto, sans-serif; }
header { border-left: .45rem solid var(--good); padding: .2rem 0 .2rem 1.1rem;
  margin: 1rem 0 2rem; }
header.bad { border-color: var(--bad); }
header p { margin: .3rem 0 0; font-size: 1.15em; }
header p.facts { font-size: .85em; color: var(--quiet); overflow-wrap: anywhere; }
h1 { margin: 0; font-size: clamp(1.7rem, 4vw, 2.6rem); line-height: 1.15; }
h1 small { display: block; font-size: .42em; font-weight: 600; letter-spacing: .06em;
  color: var(--quiet); text-transform: uppercase; }
h2 { font-size: 1.3em; margin: 2.6rem 0 .7rem; line-height: 1.25; }
.wide { overflow-x: auto; border: 1px solid var(--line); border-radius: .6rem;
  background: var(--card); }
table { border-collapse: collapse; width: 100%; font-size: .92em;
  font-variant-numeric: tabular-nums; }
th, td { padding: .5em .8em; text-align: right; white-space: nowrap; }
th:nth-child(-n+3), td:nth-child(-n+3) { text-align: left; }
th { color: var(--quiet); font-weight: 600; font-size: .88em; }
tr + tr td, tbody tr:first-child td { border-top: 1px solid var(--line); }
tr.rival td { color: var(--quiet); border-top-style: dashed; }
td.yes { color: var(--good); font-weight: 700; }
td.no { color: var(--bad); font-weight: 700; }
.note, figcaption { color: var(--quiet); font-size: .9em; max-width: 58rem; }
figure { margin: 0; }
img { display: block; width: 100%; height: auto; background: #fff;
  padding: clamp(.2rem, 1vw, .8rem); border: 1px solid var(--line); border-radius: .6rem; }
figcaption { margin-top: .6rem; }
details { border: 1px solid var(--line); border-radius: .6rem; background: var(--card);
  margin: .5rem 0; padding: .1rem 1rem; }
details .wide { border: 0; margin-bottom: .8rem; }
details table { font-size: .82em; }
summary { cursor: pointer; padding: .55rem 0; }
code, pre { background: var(--code); border-radius: .35rem; padding: .1em .35em; font-size: .92em; }
pre { padding: .8em 1em; overflow-x: auto; }
li { margin: .25rem 0; }
</style>
<header class="$mood"><h1><small>BrickServo: the camera guides the arm</small>$verdict</h1>
<p>$headline</p><p class="facts">$facts</p></header>
<div class="wide">$table</div>
<p class="note">$note</p>
$body
</html>
""")
