"""Drawings from a grammar of SVG are drawn as a browser shows them."""

import pytest
from as_a_browser import differences, page_of
from page_tracker import a_browser
from svg_grammar import drawing


@pytest.fixture(scope="module")
def shown():
    with a_browser() as browser, page_of(browser) as shown:
        yield shown


@pytest.mark.long
@pytest.mark.parametrize("seed", range(9000, 9012))
def test_a_drawing_is_as_a_browser_shows_it(shown, seed):
    differ = [kind for kind, differs, _, _ in differences(drawing(seed), shown) if differs]
    assert differ == []
