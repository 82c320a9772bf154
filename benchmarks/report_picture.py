"""The picture of a report's first screen in the documentation, taken of the page itself in headless Chromium."""

import io
import shutil
import sys
from pathlib import Path

from PIL import Image
from playwright.sync_api import sync_playwright

COLOURS = 64  # of the file: a third of its size, without a visible difference
WIDTH_PX, HEIGHT_PX = 1280, 860


def write_picture(report: Path, path: Path) -> None:
    """A PNG of the top of an HTML file; FileNotFoundError without Chromium."""
    browser_path = shutil.which("chromium")
    if browser_path is None:
        raise FileNotFoundError("no chromium on the PATH (Debian: apt-get install chromium)")
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=browser_path, args=["--no-sandbox", "--disable-gpu"])
        shown = browser.new_page(viewport={"width": WIDTH_PX, "height": HEIGHT_PX})
        shown.goto(report.resolve().as_uri())
        pixels = shown.screenshot()
        browser.close()
    with Image.open(io.BytesIO(pixels)) as picture:
        picture.convert("RGB").quantize(COLOURS, dither=Image.Dither.NONE).save(path, optimize=True)


if __name__ == "__main__":
    write_picture(Path(sys.argv[1]), Path(sys.argv[2]))
