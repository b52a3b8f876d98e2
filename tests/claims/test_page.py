"""The claim of the page: how pictures find their frames, what the table says, and no browser."""

import sys

import cv2
import pytest
from click.testing import CliRunner
from page_tracker import a_browser

from tests.claims import page, page_pictures
from tests.claims.__main__ import claims
from tests.claims.page import GoalAttempt, PageResult, Viewers


def test_a_picture_is_as_old_as_its_frame_when_it_is_on_the_screen(tmp_path):
    (tmp_path / "track.csv").write_text("frame,t,marker,u,v,confidence\n7,50.0,effector,1,2,1\n")
    drawn = [
        (1050.08, "http://127.0.0.1:7780/view/A/7.jpg"),
        (1050.1, "http://127.0.0.1:7780/view/A/8.jpg"),  # of a frame that nobody tells of
    ]
    assert page._behind(tmp_path, drawn, 1000.0) == pytest.approx([0.08], abs=1e-3)


def test_the_table_has_a_row_for_each_number_of_pages():
    runs = [
        GoalAttempt(True, 4, 5.0, 1.0, "goal 1: reached"),
        GoalAttempt(True, 8, 9.0, 3.0, "goal 2: reached"),
        GoalAttempt(False, 60, 60.0, 90.0, "goal 3: not reached"),
    ]
    shown = PageResult(
        Viewers(5), 1, 30.0, [0.03] * 19 + [0.05], 4.0, [0.1] * 19 + [0.2], runs, 0.8
    )
    none = PageResult(Viewers(0), 1, 29.0, [0.03], 0.0, [], runs[:1], 1.0)
    frozen = PageResult(Viewers(1, frozen=True), 1, 29.0, [0.03], 0.0, [], runs[:1], 1.0)
    assert page.table([none, shown, none, frozen]) == [
        ["0", "29.0", "30/30", "", "", "2 of 2", "4/4", "5.0/5.0", "1.0/1.0", "1.00"],
        ["5", "30.0", "30/50", "4.0", "100/200", "2 of 3", "8/8", "9.0/9.0", "3.0/3.0", "0.80"],
        ["1, frozen", "29.0", "30/30", "", "", "1 of 1", "4/4", "5.0/5.0", "1.0/1.0", "1.00"],
    ]
    assert page.failures([none, shown]) == ["pages 5, seed 1, goal 3: not reached"]


@pytest.mark.parametrize("name", ["page", "page-faults", "stop"])
def test_without_a_browser_it_says_what_to_install(monkeypatch, name):
    monkeypatch.setattr(page.shutil, "which", lambda name: None)
    result = CliRunner().invoke(claims, [name])
    assert result.exit_code == 1
    assert "there is no chromium to open the pages; install it" in result.output


def test_without_playwright_it_says_how_to_have_it(monkeypatch):
    monkeypatch.setattr(page.shutil, "which", lambda name: "/usr/bin/" + name)
    monkeypatch.setitem(sys.modules, "playwright.sync_api", None)
    result = CliRunner().invoke(claims, ["page", "--seeds", "1:2"])
    assert result.exit_code == 1
    assert "playwright, which opens the pages, is not installed; write uv run --group browser" in (
        result.output
    )


@pytest.mark.claims
def test_a_picture_of_the_page_is_taken(tmp_path):
    with a_browser() as browser:
        (file,) = page_pictures._lost(browser, tmp_path)
    assert file.name == "page-lost.jpg"
    assert cv2.imread(str(file)).shape == (940, 1440, 3)
