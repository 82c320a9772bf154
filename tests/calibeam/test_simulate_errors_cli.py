"""`calibeam simulate-errors`: the file, the page and the figures of a small simulation, and its largest error."""

import json
from pathlib import Path

import pytest

from calibeam.cli import run
from calibrate.report.error_simulation_page import PICTURES

RIG = Path(__file__).parents[2] / "rigs" / "arm-cmm-reference.toml"
WORDS = ["simulate-errors", str(RIG), "--arms", "500", "--poses", "2"]


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("errors")
    assert run([*WORDS, "--only", "joint2.*", "joint5.zero", "--out", str(folder)]) == 0
    return folder


def test_the_file_has_every_error_that_was_asked_for_and_the_page_names_the_largest(written: Path) -> None:
    said = json.loads((written / "errors.json").read_text("utf-8"))
    names = {source["name"] for source in said["sources"]}
    assert "joint5.zero" in names
    assert all(name.startswith("joint2.") for name in names - {"joint5.zero"})
    largest = max(said["sources"], key=lambda source: source["share_total"])
    assert f"Largest source</span><b>{largest['name']}</b>" in (written / "errors.html").read_text("utf-8")


def test_every_figure_stands_on_the_page_and_in_a_file_of_its_own(written: Path) -> None:
    page = (written / "errors.html").read_text("utf-8")
    for one in PICTURES:
        assert one.caption in page
        drawing = (written / f"errors-{one.name}.svg").read_text("utf-8")
        assert drawing.count("<path") > 5, one.name
