"""Pages are put together a few at a time; nothing behind the turns hears of who waits."""

import asyncio

import pytest

from laptop.page.build_limiter import BUILD_SLOT, BuildLimiter


class FakePages:
    """Begins pages, and ends each when it is told to."""

    def __init__(self, leaves_turn=True):
        self.begun, self.sent = [], []
        self._leaves_turn = leaves_turn
        self.built, self.read = asyncio.Event(), asyncio.Event()

    async def __call__(self, scope, receive, send):
        self.begun.append(scope["number"])
        if scope["number"] == "broken":
            raise ValueError("broken")
        await self.built.wait()
        if self._leaves_turn and BUILD_SLOT in scope:
            async with scope[BUILD_SLOT]:
                pass
        await self.read.wait()
        self.sent.append(scope["number"])


async def settle():
    for _ in range(20):
        await asyncio.sleep(0)


def ask(turns, numbers, path="/", kind="http"):
    scopes = [{"type": kind, "path": path, "number": number} for number in numbers]
    return [asyncio.ensure_future(turns(scope, None, None)) for scope in scopes]


def test_a_page_that_waits_for_its_turn_has_not_begun_and_comes_in_the_end():
    async def go():
        pages = FakePages()
        asked = ask(BuildLimiter(pages, "/", 2), range(5))
        await settle()
        assert pages.begun == [0, 1]
        pages.built.set()  # their turns end, though nobody has read them yet
        await settle()
        assert pages.begun == [0, 1, 2, 3, 4]
        assert pages.sent == []
        pages.read.set()
        await asyncio.gather(*asked)
        assert pages.sent == [0, 1, 2, 3, 4]

    asyncio.run(go())


@pytest.mark.parametrize(("path", "kind"), [("/view/A/1.jpg", "http"), ("/", "websocket")])
def test_what_is_no_page_waits_for_nobody(path, kind):
    async def go():
        pages = FakePages()
        turns = BuildLimiter(pages, "/", 1)
        asked = ask(turns, range(2)) + ask(turns, ["other"], path, kind)
        await settle()
        assert pages.begun == [0, "other"]
        pages.built.set()
        pages.read.set()
        await asyncio.gather(*asked)

    asyncio.run(go())


def test_pages_that_break_or_are_never_put_together_keep_no_turn():
    async def go():
        pages = FakePages(leaves_turn=False)
        turns = BuildLimiter(pages, "/", 1)
        asked = ask(turns, ["broken", "cancelled", 1, 2])
        await settle()
        assert pages.begun == ["broken", "cancelled"]
        asked[1].cancel()
        pages.built.set()
        pages.read.set()
        ends = await asyncio.gather(*asked, return_exceptions=True)
        assert [type(end) for end in ends[:2]] == [ValueError, asyncio.CancelledError]
        assert pages.sent == [1, 2]

    asyncio.run(go())
