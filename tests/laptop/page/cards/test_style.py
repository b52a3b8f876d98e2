"""Colours of the page can be read: the contrast that WCAG 2.1 asks for, by its own formula."""

import re

import pytest
from places import ROOT

STYLE = (ROOT / "laptop/page/cards/style.css").read_text()
CARD = "#ffffff"
LEAST = 4.5
"""Of text that is not large."""


def luminance(color):
    """Relative luminance of #rrggbb (WCAG 2.1)."""
    shares = [int(color[k : k + 2], 16) / 255 for k in (1, 3, 5)]
    red, green, blue = (s / 12.92 if s <= 0.03928 else ((s + 0.055) / 1.055) ** 2.4 for s in shares)
    return 0.2126 * red + 0.7152 * green + 0.0722 * blue


def contrast(one, other):
    dark, light = sorted(map(luminance, (one, other)))
    return (light + 0.05) / (dark + 0.05)


def test_the_formula_knows_black_on_white():
    assert contrast("#000000", "#ffffff") == pytest.approx(21)


@pytest.mark.parametrize("name", ["ok", "bad", "warm"])
def test_a_state_can_be_read_on_a_card_and_white_on_it(name):
    (color,) = re.findall(rf"--{name}: (#\w{{6}});", STYLE)
    assert contrast(color, CARD) >= LEAST


@pytest.mark.parametrize("name", ["ok", "bad"])
def test_a_verdict_can_be_read_in_the_dark(name):
    (color,) = re.findall(rf"\.body--dark \.verdict\.{name} {{ color: (#\w{{6}});", STYLE)
    (card,) = re.findall(r"\.body--dark \.card { background: (#\w{6});", STYLE)
    assert contrast(color, card) >= LEAST
