"""The compiled loops serve only where they were compiled before, and nobody waits for the compiler."""

import subprocess
import sys

import pytest

from calibrate.model.arms import compiled as ready


@pytest.fixture
def source(tmp_path, monkeypatch):
    """A source elsewhere, never compiled."""
    path = tmp_path / "compiled.py"
    path.write_text("x = 1\n")
    monkeypatch.setattr(ready, "SOURCE", path)
    ready.available.cache_clear()
    yield path
    ready.available.cache_clear()


def test_a_source_that_was_never_compiled_is_not_available(source):
    assert not ready.available()


def test_after_the_mark_it_is_available(source):
    ready.state_ready()
    assert ready.available()


def test_a_changed_source_is_stale(source):
    ready.state_ready()
    source.write_text("x = 22\n")
    ready.available.cache_clear()
    assert not ready.available()


def test_the_mark_of_another_processor_does_not_count(source, monkeypatch):
    ready.state_ready()
    monkeypatch.setattr(ready, "_processor", lambda: "another machine's")
    ready.available.cache_clear()
    assert not ready.available()


def test_importing_calibrate_and_its_arms_loads_no_compiler():
    code = "import sys, calibrate.model.arms.catalogue, calibrate.fit.solvers; print('numba' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "False"
