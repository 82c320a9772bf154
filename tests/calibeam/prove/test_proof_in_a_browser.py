"""The proof page in Chromium: no sideways scroll on a phone, no labels on top of each other, light and dark."""

import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

from calibeam.prove.page import proof_html
from calibeam.prove.record import SCHEMA, CaseScore, DefectScore, ProofFile
from tests.support.overlaps import OVERLAPS

PHYSICS = ("backlash", "encoder-eccentricity", "joint-compliance", "gear-ratio-error", "link-thermal-growth")


def test_it_fits_a_phone_and_its_labels_stand_apart(
    case: Callable[..., CaseScore], found: Callable[..., DefectScore], tmp_path: Path
) -> None:
    chromium = shutil.which("chromium")
    if chromium is None:
        pytest.skip("no chromium on the PATH (Debian: apt-get install chromium); the page is not looked at")
    from playwright.sync_api import sync_playwright

    cases = (*(case((found(physics=name),)) for name in PHYSICS), case(()), case((found(), found(named=False))))
    path = tmp_path / "proof.html"
    proof = ProofFile(SCHEMA, "calibeam 1", 21, True, "calibeam prove", "", 60.0, cases)
    path.write_text(proof_html(proof), encoding="utf-8")
    with sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=chromium, args=["--no-sandbox"])
        for width, scheme in ((1440, "light"), (390, "dark")):
            page = browser.new_page(viewport={"width": width, "height": 844}, color_scheme=scheme)
            page.goto(path.as_uri())
            page.evaluate("document.querySelectorAll('details').forEach(d => d.open = true)")
            assert page.evaluate("document.documentElement.scrollWidth") == width
            assert page.evaluate("document.querySelectorAll('svg text').length") > 5
            assert page.evaluate(OVERLAPS) == []
        browser.close()
