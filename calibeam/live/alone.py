"""Where the rig says so, a session ends like by STOP when no page answers any more: docs/decisions/0028.

In a thread of its own, so that a server that hangs is noticed as a page that is gone.
"""

import threading
from collections.abc import Generator
from contextlib import contextmanager

from calibeam.live.stopping import Stop
from calibeam.live.viewers import Viewers
from drivers.clock import Clock

LOOK_S = 0.1
AGAIN_S = 1.0  # after a STOP that the controller did not take


def overdue(viewers: Viewers, limit_s: float, now_s: float) -> bool:
    """Whether there was a page once, and none has answered for so long."""
    return viewers.newest_s is not None and now_s - viewers.newest_s > limit_s


@contextmanager
def watched_pages(stop: Stop, viewers: Viewers, limit_s: float | None, clock: Clock) -> Generator[None]:
    """Inside, STOP is pressed when pages are overdue, until it is delivered; never without a limit."""
    if limit_s is None:
        yield
        return
    done = threading.Event()

    def watch() -> None:
        wait_s = LOOK_S
        while not done.wait(wait_s):
            wait_s = LOOK_S
            if stop.ready and overdue(viewers, limit_s, clock.now_s()):
                if stop.press(f"no page has answered for {limit_s:.3g} s").delivered:
                    return
                wait_s = AGAIN_S

    watcher = threading.Thread(target=watch, name="watch live pages", daemon=True)
    watcher.start()
    try:
        yield
    finally:
        done.set()
        watcher.join()
