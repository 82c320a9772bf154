"""The page in a real browser: real clicks, pixels of spots, a server that goes and comes, a phone."""

import shutil
from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import replace

import numpy as np
import pytest
from playwright.sync_api import Browser, Page, ViewportSize, expect, sync_playwright

from benchmarks.live_feed import LivingRig
from calibeam.live.health import Latest
from calibeam.live.page import LivePage, PageAddress, live_page
from drivers.clock import SystemClock

DESKTOP: ViewportSize = {"width": 1280, "height": 900}
WIDE: ViewportSize = {"width": 1440, "height": 800}
PHONE: ViewportSize = {"width": 360, "height": 740}
QUIET = (
    "--no-sandbox",
    "--disable-gpu",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
)
MEASURED = (0, 87, 168)  # of live.css
LEAST_PX = 48  # a finger in a glove
expect.set_options(timeout=15_000)

# The colour in the middle of the disc that shows the light on PSD 1, at the place that the figures below tell.
SPOT = """() => {
  const section = document.querySelector("#face-1"), canvas = section.querySelector("canvas");
  const words = (name) => section.querySelector(name).textContent.replace("−", "-");
  const figure = (name) => parseFloat(words(name).replace(/[^\\d.-]/g, ""));
  const box = canvas.getBoundingClientRect(), ratio = canvas.width / box.width;
  const scale = (Math.min(box.width, box.height) - 16) / 20;
  const x = box.width / 2 + figure(".x") * scale, y = box.height / 2 - figure(".y") * scale;
  return [...canvas.getContext("2d").getImageData(Math.round(x * ratio), Math.round(y * ratio), 1, 1).data].slice(0, 3);
}"""

AWAY_RAD = np.array([1.2, 0.0, 0.0, 0.0, 0.0, 0.0])  # the beam leads past every face

# No pixel of the outermost ring is as dark as a link or joint; the floor is pale.
IN_VIEW = """() => {
  const canvas = document.querySelector("#robot"), pen = canvas.getContext("2d");
  const {width, height} = canvas;
  const rims = [[0, 0, width, 2], [0, height - 2, width, 2], [0, 0, 2, height], [width - 2, 0, 2, height]];
  const dark = (data) => {
    for (let i = 0; i < data.length; i += 4)
      if (data[i + 3] > 200 && data[i] + data[i + 1] + data[i + 2] < 330) return true;
    return false;
  };
  return !rims.some((box) => dark(pen.getImageData(...box).data));
}"""

# Some pixel of the curve's colour in the left half of the first strip.
LEFT_HALF_OF_STRIP = """() => {
  const canvas = document.querySelector("#joints"), ratio = canvas.width / canvas.getBoundingClientRect().width;
  const left = 130 * ratio, wide = (canvas.width - left) / 2;
  const data = canvas.getContext("2d").getImageData(left, 0, wide, canvas.height / 6).data;
  for (let i = 0; i < data.length; i += 4) if (data[i + 3] > 200 && data[i] < 40 && data[i + 2] > 130) return true;
  return false;
}"""

# A point of PSD 1's face beside its axes.
GROUND_OF_FACE = """() => {
  const canvas = document.querySelector("#face-1 canvas");
  const at = [0.42, 0.58].map((share, k) => Math.round(share * [canvas.width, canvas.height][k]));
  return [...canvas.getContext("2d").getImageData(...at, 1, 1).data].slice(0, 3);
}"""

SOONER = "AbortSignal.timeout = ((real) => (ms) => real(ms / 100))(AbortSignal.timeout.bind(AbortSignal))"
LATER = "performance.now = ((real) => () => real() + 7000)(performance.now.bind(performance))"


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    path = shutil.which("chromium")
    if path is None:
        pytest.skip("no chromium on the PATH (Debian: apt-get install chromium); the live page is not looked at")
    with sync_playwright() as playwright:
        running = playwright.chromium.launch(executable_path=path, args=list(QUIET))
        yield running
        running.close()


@pytest.fixture(scope="module")
def living(rig) -> Iterator[LivingRig]:
    """A rig that lives on a page; its `feed` is the page's."""
    clock = SystemClock()
    with live_page(rig, clock, PageAddress(port=0)) as page:
        living = LivingRig(rig, page.feed, clock)
        living.url = page.url
        with living.running():
            yield living


@pytest.fixture(scope="module")
def shown(browser: Browser, living: LivingRig) -> Iterator[Page]:
    """The page on a desk, live; in the end it has said nothing on its console and asked for nothing from elsewhere."""
    with browser.new_context(viewport=DESKTOP) as context:
        page = context.new_page()
        said: list[str] = []
        page.on("console", lambda message: said.append(message.text))
        page.on("pageerror", lambda error: said.append(str(error)))
        page.on("request", lambda request: said.extend([] if request.url.startswith(living.url) else [request.url]))
        page.goto(living.url)
        is_live(page)
        yield page
        assert not said


def is_live(page: Page) -> None:
    expect(page.locator("body")).to_have_attribute("data-link", "live")


def test_a_click_on_stop_reaches_the_arm(shown: Page, living: LivingRig) -> None:
    pressed: list[int] = []
    living.feed.stops_by(lambda: pressed.append(1))
    shown.click("#stop")
    expect(shown.locator("#stop-says")).to_have_text("✓ the controller confirmed the stop command")
    assert pressed == [1]
    shown.focus("#stop")
    shown.keyboard.press("Enter")
    expect(shown.locator("#stop")).not_to_have_class("sent")
    assert pressed == [1, 1]
    living.feed.stops_by(None)


def test_spots_are_drawn_where_the_light_is(shown: Page) -> None:
    expect(shown.locator("#face-1 .state")).to_contain_text("light")
    assert shown.evaluate(SPOT) == pytest.approx(MEASURED, abs=3)


def test_what_is_wrong_is_said_in_words(shown: Page, living: LivingRig) -> None:
    living.dark, living.silent = {2}, {"robot", "encoders"}
    living.feed.lost("robot", "robot: the controller closed the connection; check power and cable")
    try:
        expect(shown.locator("#face-2 .state")).to_have_text("✕ no light")
        expect(shown.locator("#devices li[data-is=lost] .says")).to_contain_text("check power and cable")
        expect(shown.locator("#devices li[data-is=stale] .says")).to_contain_text("no new sample for")
        expect(shown.locator("#devices li[data-is=live]")).to_have_count(1)
    finally:
        living.dark, living.silent = set(), set()


def test_a_dark_face_is_a_fault_only_where_light_is_expected(shown: Page, living: LivingRig) -> None:
    aimed = living.posture
    living.dark, living.posture = {1, 2}, lambda t_s: aimed(t_s) + AWAY_RAD
    try:
        for face in ("#face-1", "#face-2"):
            expect(shown.locator(f"{face} .state")).to_have_text("no light expected")
    finally:
        living.posture = aimed
    try:
        expect(shown.locator("#face-1 .state")).to_have_text("✕ no light")
    finally:
        living.dark = set()


def test_the_whole_robot_is_in_the_picture(browser: Browser, living: LivingRig) -> None:
    """Nothing but floor on the rim of the canvas; in the view of the beam there are links, whose outlines are dark."""
    with browser.new_context(viewport=WIDE) as context:
        page = context.new_page()
        page.goto(living.url)
        is_live(page)
        page.click("[data-view=beam]")
        page.wait_for_function(f"() => !({IN_VIEW})()")
        page.click("[data-view=whole]")
        page.wait_for_function(IN_VIEW)


def test_strips_are_full_from_the_first_seconds(browser: Browser, living: LivingRig) -> None:
    with browser.new_context(viewport=DESKTOP) as context:
        page = context.new_page()
        page.goto(living.url)
        is_live(page)
        page.wait_for_function(LEFT_HALF_OF_STRIP)


def test_the_page_is_dark_where_the_system_is(browser: Browser, living: LivingRig) -> None:
    grounds: list[str] = []
    for scheme in ("light", "dark"):
        with browser.new_context(viewport=DESKTOP, color_scheme=scheme) as context:
            page = context.new_page()
            page.goto(living.url)
            is_live(page)
            grounds.append(page.evaluate("getComputedStyle(document.querySelector('.robot')).backgroundColor"))
            drawn = f"({GROUND_OF_FACE})().reduce((a, b) => a + b)"
            page.wait_for_function(f"() => {drawn} {'> 600' if scheme == 'light' else '< 200'}")
    assert grounds == ["rgb(255, 255, 255)", "rgb(23, 29, 35)"]


def test_a_drag_turns_the_robot(shown: Page) -> None:
    picture = "document.querySelector('#robot').toDataURL().length"
    before = shown.evaluate(picture)
    box = shown.locator("#robot").bounding_box()
    assert box is not None
    shown.mouse.move(box["x"] + 100, box["y"] + 100)
    shown.mouse.down()
    shown.mouse.move(box["x"] + 260, box["y"] + 190, steps=4)
    shown.mouse.up()
    shown.click("[data-view=top]")
    expect(shown.locator("[data-view=top]")).to_have_attribute("aria-pressed", "true")
    assert shown.evaluate(picture) != before


def test_a_phone_has_all_of_it_without_scrolling_sideways(browser: Browser, living: LivingRig) -> None:
    with browser.new_context(viewport=PHONE, device_scale_factor=2, has_touch=True, is_mobile=True) as context:
        page = context.new_page()
        page.goto(living.url)
        is_live(page)
        assert page.evaluate("document.documentElement.scrollWidth") <= PHONE["width"]
        boxes = [button.bounding_box() for button in page.locator("button").all()]
        assert all(box is not None and min(box["width"], box["height"]) >= LEAST_PX for box in boxes)
        expect(page.locator("#stop")).to_be_in_viewport(ratio=1.0)
        page.evaluate("window.scrollTo(0, 500)")
        expect(page.locator("#stop")).to_be_in_viewport(ratio=1.0)


def test_a_stop_that_failed_stays_reported_until_one_came_after_it(browser: Browser, living: LivingRig) -> None:
    assert isinstance(living.feed, Latest)
    living.feed.stops_by(lambda: None)
    before = living.feed.stop.press("another page")
    living.feed.stop.last = replace(before, host_s=before.host_s - 60.0)
    with browser.new_context(viewport=DESKTOP) as context:
        page = context.new_page()
        page.add_init_script(SOONER)
        page.goto(living.url)
        is_live(page)
        page.route("**/stop", lambda request: None)  # stalled for ever
        page.click("#stop")
        failed, says = "✕ STOP NOT DELIVERED (no answer): press the red emergency stop now", page.locator("#stop-says")
        expect(says).to_have_text(failed)
        page.evaluate(LATER)  # long after the press, and the link was late
        living.feed.said("heard after the press")
        expect(page.locator("#log")).to_contain_text("heard after the press")
        is_live(page)
        expect(says).to_have_text(failed)
        living.feed.stop.press("a third page")
        expect(says).to_contain_text("by a third page: the controller confirmed the stop command")
    living.feed.stops_by(None)


def test_a_part_that_cannot_be_made_does_not_pass_for_live(shown: Page, living: LivingRig) -> None:
    assert isinstance(living.feed, Latest)
    where, living.feed.where = living.feed.where, object()  # pyright: ignore[reportAttributeAccessIssue]
    try:
        expect(shown.locator("body")).to_have_attribute("data-link", "late")
        expect(shown.locator("#banner")).to_contain_text("cannot make this picture")
    finally:
        living.feed.where = where
    is_live(shown)
    expect(shown.locator("#banner")).to_be_hidden()


def test_a_page_whose_server_went_says_so_and_comes_back_by_itself(browser: Browser, rig, own_address) -> None:
    with browser.new_context(viewport=DESKTOP) as context, ExitStack() as first:
        page = context.new_page()
        served: LivePage = first.enter_context(live_page(rig, SystemClock(), own_address))
        page.goto(served.url)
        is_live(page)
        first.close()
        expect(page.locator("body")).to_have_attribute("data-link", "gone")
        expect(page.locator("#banner")).to_contain_text("What you see is old")
        page.click("#stop")
        expect(page.locator("#stop-says")).to_contain_text("press the red emergency stop now")
        port = int(served.url.rpartition(":")[2].strip("/"))
        with live_page(rig, SystemClock(), replace(own_address, port=port)):
            is_live(page)
            expect(page.locator("#banner")).to_be_hidden()
