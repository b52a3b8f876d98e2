"""A report as one HTML file, made of a template."""

from __future__ import annotations

import base64
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import cv2
import numpy as np
from jinja2 import Environment, FileSystemLoader, StrictUndefined

TEMPLATES = Path(__file__).with_name("templates")
MAX_PNG = 400_000
"""A PNG larger than this is a photograph, bytes: a tenth as large as JPEG."""


class Illustration(NamedTuple):
    """A picture and its texts; `source` is its address, a data URL that holds it."""

    heading: str
    caption: str
    source: str


class StepTable(NamedTuple):
    """Every step of one run, to be unfolded.

    title     the run in a line
    reason    of its verdict, or ""
    notes     (s, text) of what happened between steps
    headings  of the columns
    rows      of texts
    """

    title: str
    reason: str
    notes: Sequence[tuple[float, str]]
    headings: Sequence[str]
    rows: Sequence[Sequence[str]]


def load_templates(*folders: Path) -> Environment:
    """Return the templates in some folders; what is put into them is escaped."""
    return Environment(
        loader=FileSystemLoader(folders),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )


def render_report(template: Path, **values: Any) -> str:
    """Return a report as the text of an HTML file.

    Args:
        template: extends `report.html`, and may use `parts.html`.
        values: the template's and those of `report.html`, see there.
    """
    templates = load_templates(template.parent, TEMPLATES)
    return templates.get_template(template.name).render(values)


def illustration(heading: str, caption: str, picture: bytes) -> Illustration:
    """Return a PNG with its texts."""
    kind = "png"
    if len(picture) > MAX_PNG:
        kind, picture = "jpeg", photograph(picture, 90)
    data = base64.b64encode(picture).decode("ascii")
    return Illustration(heading, caption, f"data:image/{kind};base64,{data}")


def photograph(picture: bytes, quality: int) -> bytes:
    """Return a picture as JPEG of some quality, 0 to 100."""
    pixels: Any = cv2.imdecode(np.frombuffer(picture, np.uint8), cv2.IMREAD_COLOR)
    return cv2.imencode(".jpg", pixels, [cv2.IMWRITE_JPEG_QUALITY, quality])[1].tobytes()


def figures(values: Sequence[float], form: str) -> str:
    """Return numbers side by side, each in a form such as "{:.1f}"."""
    return " ".join(form.format(value) for value in values).replace("-", "\u2212")
