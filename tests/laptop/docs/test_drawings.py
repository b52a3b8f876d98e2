"""The drawings of the pages that say why: the same bytes each time, each shown by its page."""

import cv2
import pytest
from places import ROOT

from laptop.docs.drawings import DRAWINGS
from laptop.docs.drawings.picture import WIDTH

DOCS = ROOT / "laptop" / "docs"


@pytest.mark.parametrize("name", DRAWINGS)
def test_a_drawing_is_written_with_the_same_bytes_each_time(tmp_path, name):
    first, second = tmp_path / "first.png", tmp_path / "second.png"
    DRAWINGS[name](first)
    DRAWINGS[name](second)
    assert first.read_bytes().startswith(b"\x89PNG")
    assert first.read_bytes() == second.read_bytes()
    image = cv2.imread(str(first))
    height, width, _ = image.shape
    assert width == WIDTH
    assert 400 <= height <= 700
    assert (image[0] == image[0, 0]).all()  # nothing is cut at the upper edge
    assert len(first.read_bytes()) < 100_000


def test_each_page_shows_its_own():
    assert set(DRAWINGS) == {f"why-{page.stem}.png" for page in (DOCS / "why").glob("*.md")}
    for name in DRAWINGS:
        page = DOCS / "why" / f"{name.removeprefix('why-').removesuffix('.png')}.md"
        assert page.read_text("utf-8").count(f"](../pictures/{name})") == 1
        assert (DOCS / "pictures" / name).is_file()
