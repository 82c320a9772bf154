"""Pages without a browser, in a process of their own: `python -m benchmarks.live_viewers URL COUNT SECONDS`."""

import asyncio
import sys
import time

from websockets.asyncio.client import connect

TAKE = 3  # as in link.js


async def look(host: str, for_s: float) -> int:
    """Messages that came, acknowledged as the page does."""
    count, end_s = 0, time.monotonic() + for_s
    async with connect(f"ws://{host}/feed", origin=f"http://{host}", compression=None) as socket:
        while time.monotonic() < end_s:
            await socket.recv()
            count += 1
            if count % TAKE == 0:
                await socket.send(str(TAKE))
    return count


async def look_all(url: str, viewers: int, for_s: float) -> list[int]:
    host = url.removeprefix("http://").partition("/")[0]
    return await asyncio.gather(*(look(host, for_s) for _ in range(viewers)))


if __name__ == "__main__":
    counts = asyncio.run(look_all(sys.argv[1], int(sys.argv[2]), float(sys.argv[3])))
    print(*counts)
