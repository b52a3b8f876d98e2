"""Formulas and drawings as vector graphics inside a page."""

from __future__ import annotations

import base64
import io
import re

from markupsafe import Markup
from matplotlib import rc_context
from matplotlib.figure import Figure

FORMULA_SIZE = 12.0
"""Size of a formula's letters, pt."""


def formula(tex: str) -> Markup:
    """Return a formula, set by matplotlib, as an image that holds itself.

    Args:
        tex: in TeX's notation, as far as matplotlib knows it.
    """
    figure = Figure(figsize=(0.1, 0.1))
    figure.text(0, 0, f"${tex}$", fontsize=FORMULA_SIZE)
    with rc_context({"mathtext.fontset": "dejavuserif"}):
        drawn = svg(figure, tight=True)
    width = float(re.search(r'<svg[^>]*? width="([\d.]+)pt"', drawn)[1])  # type: ignore[index]
    return Markup('<img class="formula" alt="{}" style="width: {:.1f}pt" src="{}">').format(
        tex, width, data_url(drawn)
    )


def matrix(a: str, b: str, c: str, d: str) -> str:
    """Return a matrix of two rows, [a b] and [c d], in TeX as matplotlib knows it."""
    return rf"\genfrac{{[}}{{]}}{{0}}{{0}}{{{a}\quad {b}}}{{{c}\quad {d}}}"


def svg(figure: Figure, tight: bool = False, transparent: bool = True) -> str:
    """Return a figure as the text of an SVG, the same text for the same figure.

    Args:
        figure: to be converted.
        tight: cut off the empty margin.
        transparent: without a background.
    """
    out = io.BytesIO()
    with rc_context({"svg.hashsalt": "brickservo"}):
        figure.savefig(
            out,
            format="svg",
            bbox_inches="tight" if tight else None,
            pad_inches=0.02,
            metadata={"Date": None, "Creator": None},
            transparent=transparent,
        )
    return out.getvalue().decode("utf-8")


def data_url(drawn: str) -> str:
    """Return an SVG as an address that holds it."""
    return "data:image/svg+xml;base64," + base64.b64encode(drawn.encode("utf-8")).decode("ascii")
