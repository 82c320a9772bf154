"""`make test` runs tests in phases, by marks and folders: no test may fall between them."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]


def phases():
    lines = [line for line in (ROOT / "Makefile").read_text().splitlines() if "-m pytest" in line]
    return [(re.search(r'-m "([^"]+)"', line)[1], re.findall(r"tests/(\w+)", line)) for line in lines if '-m "' in line]


def test_what_is_not_on_wires_is_run_wherever_it_lies():
    assert ("not endure and not wired", []) in phases()


def test_the_folder_of_every_test_on_wires_is_named(request):
    folders = {folder for marks, named in phases() if marks == "wired and not endure" for folder in named}
    conftest = next(p for p in request.config.pluginmanager.get_plugins() if hasattr(p, "WIRED"))
    assert {Path(wired).parts[0] for wired in conftest.WIRED} == folders


@pytest.mark.parametrize("path", [".ci/run", "README.md"])
def test_it_is_what_ci_and_newcomers_run(path):
    assert "make" in (ROOT / path).read_text()
    assert re.search(r"make[ \w]* test\b", (ROOT / path).read_text())
