"""The pictures of the page: taken in a real browser, of real runs on an emulated brick.

python -m tests.claims.page_pictures FOLDER

With the word "sizes" after it others, for who changes the page: its states in windows of all SIZES,
light and dark.
"""

from __future__ import annotations

import argparse
import itertools
import re
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

from laptop.emulator.scene.scene import Scene
from laptop.emulator.scene.scene_constants import read_scene
from laptop.measure.demo.processes import wait_for_page
from shared.arm_description import Arm, ArmError, find_arm, read_arm
from tests.claims.page import browser, start_tracker
from tests.claims.page_rig import on_page, start_button

WINDOW = {"width": 1440, "height": 940}
PHONE = {"width": 390, "height": 844}
PHONE_SCALE = 1.2
"""Pixels of the picture per pixel of the phone's layout."""
SIZES = (1280, 720), (1366, 768), (844, 390), (390, 844)
"""Windows into which the page must fit, px: laptops, and a phone held sideways and upright."""
QUALITY = 85
"""Of the JPEGs."""
PATIENCE = 120_000.0
"""What has not come by then never does, ms."""
ON_THE_WAY = 2500.0
"""Into a run after so long there is something to see of it, ms."""
RESIZING_TIME = 700.0
"""And so long after a window's size has changed, ms."""
SETTLING_TIME = 1000.0
"""After so long plots and fonts have come, ms."""
GOALS = ((-0.7, 0.9), (0.9, 0.5))
"""Postures whose tips are aimed at in the plane, rad."""
DRAWING = "spirograph"
"""Drawn on the page."""
HALF_DRAWN = re.compile(r"Drawing: [56]\d %")
"""What the page says when a picture is taken of it."""
GOALS_IN_SPACE = ((0.5, 0.9, -0.6), (-0.5, 0.6, -0.9), (0.2, 0.5, -0.3))
"""And in space; the last one in one picture only: the other shows what the way there taught."""


def take(folder: Path) -> Iterator[Path]:
    """Take all pictures; yield each file as soon as it is there.

    Raises:
        NoBrowser: pages cannot be opened.
        ArmError: a program fails.
    """
    with browser() as made:
        folder.mkdir(parents=True, exist_ok=True)
        yield from _plane(made, folder)
        yield from _lost(made, folder)
        yield from _space(made, folder)
        yield from _draw(made, folder)


def _plane(made: Any, folder: Path) -> Iterator[Path]:
    arm = read_arm(find_arm("planar"))
    with _page(made, arm, 1) as page:
        yield _shot(page, folder, "page-first")
        _aim(page, arm, GOALS[0])
        _start(page)
        page.wait_for_timeout(ON_THE_WAY)
        yield _shot(page, folder, "page", 0.0)
        _arrive(page)
        yield _shot(page, folder, "page-arrived")
        known = page.context.storage_state()
        context = made.new_context(
            viewport=PHONE, storage_state=known, device_scale_factor=PHONE_SCALE, has_touch=True
        )
        phone = context.new_page()
        phone.goto(page.url)
        phone.wait_for_selector("[data-marker=effector]", state="attached")
        yield _shot(phone, folder, "page-phone")
        context.close()


def _lost(made: Any, folder: Path) -> Iterator[Path]:
    arm = read_arm(find_arm("planar"))
    with _page(made, arm, 1, ("--effector", "disc:blue"), awaited="goal") as page:
        page.get_by_text("Tip's marker lost").wait_for()
        yield _shot(page, folder, "page-lost")


def _space(made: Any, folder: Path) -> Iterator[Path]:
    arm = read_arm(find_arm("spatial"))
    with _page(made, arm, 2) as page:
        for goal in GOALS_IN_SPACE[:-1]:
            _aim(page, arm, goal)
            _start(page)
            _arrive(page)
        _aim(page, arm, GOALS_IN_SPACE[-1], cameras="A")
        page.locator(".picture").nth(1).locator("[data-hint]").wait_for(state="attached")
        yield _shot(page, folder, "page-two")


def _draw(made: Any, folder: Path) -> Iterator[Path]:
    with _page(made, read_arm(find_arm("planar")), 1) as page:
        _begin_drawing(page)
        page.locator(".job-word", has_text=HALF_DRAWN).wait_for()
        yield _shot(page, folder, "page-draw", 0.0)
        page.locator(".compared").wait_for()
        yield _shot(page, folder, "page-drawn")


def _begin_drawing(page: Any) -> None:
    page.get_by_role("tab", name="Draw").click()
    page.get_by_role("button", name="Look around").click()
    page.locator(".job-word", has_text="look around: done").wait_for()
    page.get_by_role("button", name=DRAWING).click()
    page.locator("[data-drawing=good]").first.wait_for(state="attached")
    start = page.locator(".draws:enabled", has_text="Start")
    start.wait_for()
    start.click()
    page.locator(".job-word", has_text="Drawing: ").wait_for()


def take_sizes(folder: Path) -> Iterator[Path]:
    """Take pictures of the page's states, in each of the sizes, light and dark.

    Raises:
        NoBrowser: pages cannot be opened.
        ArmError: a program fails.
    """
    arm = read_arm(find_arm("planar"))
    with browser() as made:
        folder.mkdir(parents=True, exist_ok=True)
        with _page(made, arm, 1) as page:
            yield from _sizes(page, folder, "idle")
            goals = itertools.cycle(GOALS)
            yield from _sizes(page, folder, "running", lambda: _keep_running(page, arm, goals))
            start_button(page).wait_for()  # a run's end: beside it nothing is drawn
            _begin_drawing(page)
            yield from _sizes(page, folder, "drawing")
        with _page(made, arm, 1, ("--effector", "disc:blue"), awaited="goal") as page:
            page.get_by_text("Tip's marker lost").wait_for()
            yield from _sizes(page, folder, "lost")
        with _page(made, read_arm(find_arm("spatial")), 2) as page:
            yield from _sizes(page, folder, "two")


def _sizes(
    page: Any, folder: Path, state: str, prepare: Callable[[], None] = lambda: None
) -> Iterator[Path]:
    for (width, height), scheme in itertools.product(SIZES, ("light", "dark")):
        page.set_viewport_size({"width": width, "height": height})
        page.emulate_media(color_scheme=scheme)
        prepare()
        page.wait_for_timeout(RESIZING_TIME)
        file = folder / f"{state}-{width}x{height}-{scheme}.png"
        page.screenshot(path=str(file))
        yield file


def _keep_running(page: Any, arm: Arm, goals: Iterator[Sequence[float]]) -> None:
    """Begin another run where the last one has ended."""
    if start_button(page).count():
        _aim(page, arm, next(goals))
        _start(page)


@contextmanager
def _page(
    made: Any, arm: Arm, cameras: int, words: Sequence[str] = (), awaited: str = "effector"
) -> Iterator[Any]:
    """The page of a tracker on so many synthetic cameras, once it shows a marker and a brick."""
    with ExitStack() as stack:
        _, _, tracker = start_tracker(stack, arm, *words, cameras=cameras)
        context = made.new_context(viewport=WINDOW)
        stack.callback(context.close)
        page = context.new_page()
        page.set_default_timeout(PATIENCE)
        page.goto(wait_for_page(tracker))
        page.wait_for_selector(f"[data-marker={awaited}]", state="attached")
        page.get_by_text("emulated brick").first.wait_for()
        page.locator(".verdict", has_text="Ready").wait_for()
        yield page


def _aim(page: Any, arm: Arm, posture: Sequence[float], cameras: str = "AB") -> None:
    """Click where the tip is seen in that posture, in the picture of each camera."""
    pictures = page.locator(".picture img")
    for k, camera in enumerate(cameras[: pictures.count()]):
        tip = Scene(arm, read_scene("", camera)).truth(posture)["effector"]
        page.mouse.click(*on_page(pictures.nth(k), *tip))
    page.locator("[data-aim]").first.wait_for(state="attached")


def _start(page: Any) -> None:
    start_button(page).wait_for()
    page.get_by_role("button", name="Start").click()
    page.locator(".verdict", has_text="On its way").wait_for()


def _arrive(page: Any) -> None:
    start_button(page).wait_for()
    verdict = page.locator(".verdict").inner_text()
    if not verdict.startswith("Arrived"):
        raise ArmError(f"a run ended with '{verdict}'; take the pictures on a quiet computer")


def _shot(page: Any, folder: Path, name: str, settling: float = SETTLING_TIME) -> Path:
    page.mouse.move(1, 1)  # what it lies on may be explained
    page.wait_for_timeout(settling)
    file = folder / f"{name}.jpg"
    page.screenshot(path=str(file), type="jpeg", quality=QUALITY)
    return file


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("which", nargs="?", choices=("readme", "sizes"), default="readme")
    told = parser.parse_args()
    for _file in (take_sizes if told.which == "sizes" else take)(told.folder):
        print(_file)
