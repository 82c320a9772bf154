"""Reports in Chromium, from files: the plain one without a word on the console, the interactive one drawn; both alone.

One browser for all, since starting it is what takes time.
"""

import re
import shutil

import pytest

from calibrate.report.elements.html import Html, page
from calibrate.report.evidence.session_evidence import session_evidence
from calibrate.report.figures.plots import interactive_chapter
from calibrate.report.figures.session_figures import session_figures
from tests.support.overlaps import OVERLAPS

MOST_PAGES = 8
SOFTWARE_GL = ("--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader")


@pytest.fixture(scope="module")
def browser():
    path = shutil.which("chromium")
    if path is None:
        pytest.skip("no chromium on the PATH (Debian: apt-get install chromium); the pages are not looked at")
    from playwright.sync_api import sync_playwright

    with sync_playwright() as driver:
        chromium = driver.chromium.launch(executable_path=path, args=list(SOFTWARE_GL))
        yield chromium
        chromium.close()


@pytest.fixture
def tab(browser):
    """A page that remembers what it asked for, and what went wrong in it."""
    opened = browser.new_page(viewport={"width": 480, "height": 640})  # small, since software draws it
    asked, wrong, said = list[str](), list[str](), list[str]()
    opened.on("request", lambda request: asked.append(request.url))
    opened.on("pageerror", lambda error: wrong.append(str(error)))
    opened.on("console", lambda message: said.append(message.text))
    yield opened, asked, wrong, said
    opened.close()


def test_the_plain_report_is_quiet_and_asks_for_nothing(tab, spots_html, tmp_path):
    opened, asked, wrong, said = tab
    path = tmp_path / "report.html"
    path.write_text(spots_html, encoding="utf-8")
    opened.goto(path.as_uri())
    assert opened.get_by_text("Can I trust it?").is_visible()
    assert len(opened.screenshot()) > 20_000
    assert asked == [path.as_uri()]
    assert wrong == said == []


def test_the_interactive_report_is_drawn_from_the_file_alone(tab, wire_and_positions, tmp_path):
    opened, asked, wrong, _ = tab  # WebGL in software says on the console that it is slow
    path = tmp_path / "report.html"
    chapter = interactive_chapter(session_figures(session_evidence(*wire_and_positions)))
    path.write_text(page("an arm", Html(""), {}, (chapter,), "calibeam", kind="t", scripts=True), encoding="utf-8")
    opened.goto(path.as_uri())
    opened.wait_for_selector("#plot-space canvas", state="attached")
    opened.wait_for_selector("#plot-residuals .scatterlayer .trace", state="attached")
    assert asked == [path.as_uri()]
    assert wrong == []


@pytest.mark.parametrize("which", [pytest.param("spots_html", marks=pytest.mark.endure), "session_html"])
def test_labels_do_not_overlap_and_no_page_scrolls_sideways(browser, request, tmp_path, which):
    path = tmp_path / "report.html"
    path.write_text(request.getfixturevalue(which), encoding="utf-8")
    for width, scheme in ((1440, "light"), (390, "dark")):
        opened = browser.new_page(viewport={"width": width, "height": 844}, color_scheme=scheme)
        opened.goto(path.as_uri())
        opened.evaluate("document.querySelectorAll('details').forEach(d => d.open = true)")
        assert opened.evaluate("document.documentElement.scrollWidth") == width
        assert opened.evaluate(OVERLAPS) == []
        opened.close()


def test_paper_and_ink_change_with_the_scheme(browser, tmp_path, spots_html):
    path = tmp_path / "report.html"
    path.write_text(spots_html, encoding="utf-8")
    shown = {}
    for scheme in ("light", "dark"):
        opened = browser.new_page(color_scheme=scheme)
        opened.goto(path.as_uri())
        read = "() => ['color', 'backgroundColor'].map(p => getComputedStyle(document.querySelector('main'))[p])"
        shown[scheme] = opened.evaluate(read)
        opened.close()
    assert shown["light"] == shown["dark"][::-1] or set(shown["light"]).isdisjoint(shown["dark"])
    assert shown["dark"][0] != shown["dark"][1]


def test_a_printed_report_has_at_most_eight_pages(browser, tmp_path, spots_html):
    path = tmp_path / "report.html"
    path.write_text(spots_html, encoding="utf-8")
    opened = browser.new_page()
    opened.goto(path.as_uri())
    printed = opened.pdf(prefer_css_page_size=True)
    opened.close()
    counts = [int(n) for n in re.findall(rb"/Count (\d+)", printed)]
    assert 2 <= max(counts) <= MOST_PAGES
