"""A report as one HTML file, made of a template."""

from __future__ import annotations

import base64
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from jinja2 import Environment, FileSystemLoader, StrictUndefined

TEMPLATES = Path(__file__).with_name("templates")
"""Folder of the templates that all reports share."""
MAX_PNG = 400_000
"""Greatest size of a PNG that stays one, bytes: a larger one is a photograph, made JPEG."""


def load_templates(*folders: Path) -> Environment:
    """Return the templates in some folders; values in them are escaped."""
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
        template: it may extend `page.html`.
        values: the template's.
    """
    templates = load_templates(template.parent, TEMPLATES)
    return templates.get_template(template.name).render(values)


def data_url(picture: bytes) -> str:
    """Return the address that holds a PNG or JPEG; a large PNG as JPEG."""
    kind = "jpeg" if picture.startswith(b"\xff\xd8") else "png"
    if kind == "png" and len(picture) > MAX_PNG:
        kind, picture = "jpeg", photograph(picture, 90)
    return f"data:image/{kind};base64,{base64.b64encode(picture).decode('ascii')}"


def photograph(picture: bytes, quality: int) -> bytes:
    """Return a picture as JPEG of some quality, 0 to 100."""
    pixels: Any = cv2.imdecode(np.frombuffer(picture, np.uint8), cv2.IMREAD_COLOR)
    return cv2.imencode(".jpg", pixels, [cv2.IMWRITE_JPEG_QUALITY, quality])[1].tobytes()
