"""The documentation site: opened from a folder it needs no network, its search works, and no page names a machine."""

import importlib.util
import re
import shutil
from pathlib import Path
from types import SimpleNamespace

import pytest
from mkdocs.commands.build import build
from mkdocs.config import load_config
from playwright.sync_api import sync_playwright

ROOT = Path(__file__).parents[2]
SPEC = importlib.util.spec_from_file_location("hooks", ROOT / "docs" / "hooks.py")
hooks = importlib.util.module_from_spec(SPEC)
SPEC.loader.exec_module(hooks)


@pytest.mark.parametrize(
    ("page", "script"),
    [("index.html", "javascripts/worker-of-file.js"), ("controllers/ur.html", "../javascripts/worker-of-file.js")],
)
def test_the_search_takes_its_worker_from_the_folder(page: str, script: str) -> None:
    file = SimpleNamespace(file=SimpleNamespace(dest_uri=page))
    assert hooks.on_post_page(f'<script src="{hooks.SHIM}"></script>', file) == f'<script src="{script}"></script>'
    assert (ROOT / "docs" / "javascripts" / "worker-of-file.js").exists()


@pytest.mark.endure
def test_the_site_is_searched_from_its_folder(tmp_path) -> None:
    site = tmp_path / "site"
    build(load_config(str(ROOT / "mkdocs.yml"), site_dir=str(site), strict=True))
    for page in site.rglob("*.html"):
        text = page.read_text(encoding="utf-8")
        assert str(ROOT) not in text, page
        assert not re.search(
            r'<(?:script|img)[^>]*src="?https?:|<link[^>]*rel="stylesheet"[^>]*href="?https?:', text
        ), page
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(
            executable_path=shutil.which("chromium"), args=["--no-sandbox", "--disable-gpu"]
        )
        shown = browser.new_page()
        shown.goto((site / "index.html").as_uri())
        shown.keyboard.press("s")
        shown.keyboard.type("backlash", delay=30)
        shown.wait_for_selector(".md-search-result__item", state="attached", timeout=60_000)
        browser.close()
