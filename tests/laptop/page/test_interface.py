"""What mypy says of calls from the page to the tracker."""

import pytest
from own_python import python

CALLS = """
from laptop.page.async_controller import AsyncController
from laptop.page.interface import ColourCalls, FrameCalls, PageInterface, RunCalls
from laptop.page.rpc import RpcClient


async def page(controller: AsyncController, client: RpcClient) -> None:
    why: str = await controller.call(RunCalls.aim, "A", 1.0, 2.0)
    why = await controller.call(RunCalls.start, "chain", tolerance=3.0)
    await controller.call(RunCalls.aimm, "A", 1.0, 2.0)  # misspelt
    await controller.call(RunCalls.aim, "A", "1.0", 2.0)  # wrong type
    await controller.call(RunCalls.aim, "A", 1.0)  # too few
    await controller.call_slowly(ColourCalls.rename, old="a", new="b")  # wrong name
    count: int = await controller.call(RunCalls.hold)  # wrong result
    client.call(FrameCalls.view, "A", newer="1")  # wrong name
    client.call(str.upper)  # not of the interface


class Tracker:
    def state(self) -> int:
        return 1


serves: PageInterface = Tracker()  # implements nothing of it
"""


@pytest.mark.long  # mypy reads what is imported, too
def test_mypy_finds_calls_that_are_misspelt_or_wrongly_typed(tmp_path):
    pytest.importorskip("mypy")
    file = tmp_path / "calls.py"
    file.write_text(CALLS)
    found = python("-m", "mypy", "--no-incremental", "--no-error-summary", file)
    wrong = {
        int(line.split(":")[1])
        for line in found.stdout.splitlines()
        if line.startswith(str(file)) and " error: " in line
    }
    lines = CALLS.splitlines()
    assert wrong == {n for n, line in enumerate(lines, 1) if "  # " in line}, found.stdout
