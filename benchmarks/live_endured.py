"""A page that is open for long: what its memory and its server's do, after collecting garbage."""

import shutil
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from playwright.sync_api import sync_playwright

from acquisition.recording.rig import Rig
from benchmarks.live_feed import LivingRig
from calibeam.live.page import PageAddress, live_page
from drivers.clock import SystemClock

MINUTES = 10.0
LOOKS = 20
WARM_SHARE = 0.25  # of the time: what is filled once, rings of a minute and compiled code, is no growth


@dataclass(frozen=True)
class Growth:
    """Bytes a minute, by a straight line through what was seen after the start; and the sizes in the end."""

    page_per_min: float
    server_per_min: float
    page_bytes: float
    server_bytes: float

    @property
    def line(self) -> str:
        return (
            f"page {self.page_bytes / 1e6:.2f} MB, {self.page_per_min / 1e3:+.1f} kB/min; "
            f"server {self.server_bytes / 1e6:.1f} MB, {self.server_per_min / 1e3:+.1f} kB/min"
        )


def watched(rig: Rig, seconds: float = 60.0 * MINUTES) -> Growth:
    """One page of Chromium, devices at full rate, a line said every second, for so long."""
    clock, seen = SystemClock(), []
    with live_page(rig, clock, PageAddress(port=0)) as page, sync_playwright() as playwright:
        living = LivingRig(rig, page.feed, clock)
        browser = playwright.chromium.launch(
            executable_path=shutil.which("chromium"), args=["--no-sandbox", "--disable-gpu"]
        )
        shown = browser.new_page(viewport={"width": 1280, "height": 900})
        with living.running():
            shown.goto(page.url)
            probe = shown.context.new_cdp_session(shown)
            begin_s = time.monotonic()
            for look in range(1, LOOKS + 1):
                while (now_s := time.monotonic() - begin_s) < look * seconds / LOOKS:
                    page.feed.said(f"{now_s:.0f} s")
                    shown.wait_for_timeout(1000.0)
                probe.send("HeapProfiler.collectGarbage")
                used = probe.send("Runtime.getHeapUsage")["usedSize"]
                seen.append((now_s / 60.0, used, _resident_bytes()))
            assert shown.locator("body").get_attribute("data-link") == "live"
        browser.close()
    return _growth(np.array(seen))


def _growth(seen: np.ndarray) -> Growth:
    """`seen` (look, 3): minutes, bytes of the page, bytes of the server."""
    warm = seen[round(WARM_SHARE * len(seen)) :]
    page, server = (float(np.polyfit(warm[:, 0], warm[:, k], 1)[0]) for k in (1, 2))
    return Growth(page, server, float(seen[-1, 1]), float(seen[-1, 2]))


def _resident_bytes() -> int:
    """Of this process (proc(5): statm, second field, in pages of 4096 bytes)."""
    return 4096 * int(Path("/proc/self/statm").read_text().split()[1])
