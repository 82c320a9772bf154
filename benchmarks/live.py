"""What the live page costs: CPU time of its server thread with none, one and several pages, devices at full rate."""

import subprocess
import sys
import threading
import time
from dataclasses import dataclass

from acquisition.recording.rig import Rig
from benchmarks.live_feed import LivingRig
from calibeam.live.page import PageAddress, live_page
from drivers.clock import SystemClock

SECONDS = 20.0
VIEWERS = (0, 1, 4, 8)


@dataclass(frozen=True)
class Cost:
    """Share of one core that the page's thread took, and messages a second that each page got."""

    viewers: int
    share: float
    hz: tuple[float, ...]

    @property
    def line(self) -> str:
        rates = "" if not self.hz else f", {min(self.hz):.1f} to {max(self.hz):.1f} messages/s each"
        return f"{self.viewers} pages: {100.0 * self.share:.2f} % of a core{rates}"


def run(rig: Rig, viewers: tuple[int, ...] = VIEWERS, seconds: float = SECONDS) -> list[Cost]:
    """One server, its devices at the rates of the rig, so many pages one after the other."""
    clock = SystemClock()
    with live_page(rig, clock, PageAddress(port=0)) as page:
        living = LivingRig(rig, page.feed, clock)
        page.feed.stands(1, 1)
        with living.running():
            return [_cost(page.url, count, seconds) for count in viewers]


def _cost(url: str, viewers: int, seconds: float) -> Cost:
    server = next(thread for thread in threading.enumerate() if thread.name == "live page")
    spent = time.pthread_getcpuclockid(server.ident or 0)
    if viewers == 0:
        begin_s = time.clock_gettime(spent)
        time.sleep(seconds)
        return Cost(0, (time.clock_gettime(spent) - begin_s) / seconds, ())
    command = [sys.executable, "-m", "benchmarks.live_viewers", url, str(viewers), str(seconds)]
    begin_s = time.clock_gettime(spent)
    counts = subprocess.run(command, capture_output=True, text=True, check=True, timeout=seconds + 60.0).stdout.split()
    share = (time.clock_gettime(spent) - begin_s) / seconds
    return Cost(viewers, share, tuple(int(count) / seconds for count in counts))
