"""The controller as the page's process sees it."""

import asyncio
import threading

from page_scene import run

from laptop.page import async_controller, report


def test_a_report_is_drawn_once_and_beside_the_loop_that_serves_pages(
    scene, client, monkeypatch, tmp_path
):
    scene.show()
    scene.controller.runs.start()
    run(scene, 1)
    drawn = []

    def render(group, runs):
        assert runs.parent == tmp_path
        drawn.append(threading.current_thread().name)
        return "a report"

    monkeypatch.setattr(report, "render", render)
    far = async_controller.AsyncController(client._pipe, client._pipe, {}, tmp_path)

    async def ask():
        return await asyncio.gather(*(far.report(number) for number in (None, 1, 1, 2)))

    *found, missing = asyncio.run(ask())
    assert {text for _, text in found} == {"a report"}
    assert missing is None
    assert drawn == ["drawer_0"]
    far._reports.clear()  # as more runs would do
    asyncio.run(far.report(1))
    assert len([*tmp_path.glob("*-track")]) == 1, "one folder for one run"
