"""The examples of docs/python.md run, top to bottom, over an emulated recording."""

import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from benchmarks.fleet_sessions import Robot, write_fleet

PAGE = Path(__file__).parents[2] / "docs" / "python.md"
BLOCKS = re.findall(r"^```python\n(.*?)^```", PAGE.read_text(encoding="utf-8"), re.DOTALL | re.MULTILINE)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    where = tmp_path_factory.mktemp("notebook")
    (path,) = write_fleet(where, [Robot("A-1", 41)], ("2025-11-03",))
    path.rename(where / "recording.mcap")
    return where


@pytest.fixture(scope="module")
def names(folder):
    """What stands after the first example, as in a notebook."""
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        space = {}
        exec(compile(BLOCKS[0], str(PAGE), "exec"), space)
    return space


def test_the_first_example_is_ten_lines_and_leaves_its_files(names, folder):
    assert len([line for line in BLOCKS[0].splitlines() if line]) <= 10
    assert (folder / "errors.png").read_bytes().startswith(b"\x89PNG")
    assert "<svg" in (folder / "report.html").read_text(encoding="utf-8")


@pytest.mark.parametrize("block", BLOCKS[1:], ids=[block.splitlines()[0][:40] for block in BLOCKS[1:]])
def test_an_example_runs(names, folder, block, monkeypatch):
    monkeypatch.chdir(folder)
    exec(compile(block, str(PAGE), "exec"), names)


def test_what_is_printed_is_what_was_found(names):
    model = names["model"]
    zero_rad, sigma_rad = model.zeros()[2]
    assert abs(zero_rad) > 10.0 * sigma_rad
    assert model.zeros()[1] == (None, None)
    assert "joint 1 zero: not determined" in str(model)
    assert "60 samples" in str(names["session"])
    assert np.allclose(np.linalg.det(model.flange(np.zeros(6))[0, :3, :3]), 1.0)
    with pytest.raises(KeyError, match=r"joint2\.zero"):
        model["joint2.nought"]


def test_importing_calibeam_loads_no_library():
    script = "import sys, calibeam; print([n for n in ('numpy', 'scipy', 'msgspec', 'matplotlib') if n in sys.modules])"
    result = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, timeout=60, check=True)
    assert result.stdout.strip() == "[]"
