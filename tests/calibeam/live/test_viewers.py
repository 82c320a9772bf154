"""A page that is slow gets the newest of each kind, never a queue."""

import asyncio

from calibeam.live.stopping import Viewer, Viewers


def test_what_was_not_sent_is_replaced_by_what_is_newer() -> None:
    async def look() -> list[str]:
        viewer = Viewer(room=2)
        viewer.post("rig", "r")
        viewer.post("now", "1")
        first = [await viewer.next(), await viewer.next()]
        for number in range(2, 1000):
            viewer.post("now", str(number))
        viewer.post("state", "s")
        viewer.taken(2)
        return [*first, await viewer.next(), await viewer.next()]

    assert asyncio.run(look()) == ["r", "1", "999", "s"]


def test_nothing_is_sent_to_a_page_that_has_taken_nothing() -> None:
    async def look() -> bool:
        viewer = Viewer(room=1)
        viewer.post("now", "1")
        await viewer.next()
        viewer.post("now", "2")
        waiting = asyncio.ensure_future(viewer.next())
        for _ in range(5):
            await asyncio.sleep(0)
        held = not waiting.done()
        viewer.taken()
        assert await waiting == "2"
        return held

    assert asyncio.run(look())


def test_the_beat_rests_while_nobody_looks(clock) -> None:
    async def look() -> list[bool]:
        viewers, viewer = Viewers(clock), Viewer()
        states = [viewers.some.is_set()]
        viewers.add(viewer)
        states.append(viewers.some.is_set())
        viewers.taken(viewer, 1)
        viewers.remove(viewer)
        return [*states, viewers.some.is_set(), viewers.newest_s == clock.now_s()]

    assert asyncio.run(look()) == [False, True, False, True]
