"""The picture of the live page in the documentation, taken of the page itself in headless Chromium."""

import io
import shutil
from pathlib import Path

from PIL import Image
from playwright.sync_api import sync_playwright

from acquisition.recording.rig import Rig
from benchmarks.live_feed import LivingRig
from calibeam.live.feed import Progress
from calibeam.live.page import PageAddress, live_page
from drivers.clock import SystemClock

SAID = (
    "devices checked: all good",
    "the operator has armed the robot",
    "station 1, PSD 1 first: light found",
    "pose 36 skipped: out of reach",
)
COLOURS = 96  # of the file: a third of its size, and no eye sees it
TRAIL_MS = 9000.0  # until the trails are as long as they get


def write_picture(rig: Rig, path: Path) -> None:
    """A PNG; FileNotFoundError without Chromium."""
    browser_path, clock = shutil.which("chromium"), SystemClock()
    if browser_path is None:
        raise FileNotFoundError("no chromium on the PATH (Debian: apt-get install chromium)")
    with live_page(rig, clock, PageAddress(port=0)) as page, sync_playwright() as playwright:
        living = LivingRig(rig, page.feed, clock)
        page.feed.progress(Progress("measurement", 37, 96, 1260.0, "34 µm; 12 more poses bring it under 20 µm"))
        page.feed.stands(1, 1)
        page.feed.stops_by(lambda: None)
        for line in SAID:
            page.feed.said(line)
        browser = playwright.chromium.launch(executable_path=browser_path, args=["--no-sandbox", "--disable-gpu"])
        shown = browser.new_page(viewport={"width": 1280, "height": 860})
        with living.running():
            shown.goto(page.url)
            shown.wait_for_timeout(TRAIL_MS)
            pixels = shown.screenshot()
        browser.close()
    with Image.open(io.BytesIO(pixels)) as picture:
        picture.convert("RGB").quantize(COLOURS, dither=Image.Dither.NONE).save(path, optimize=True)
