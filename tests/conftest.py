"""Loaded before any test: the same thread setting that the program has. Marks the tests that talk in real time."""

import gc
import re
from functools import cache
from pathlib import Path
from typing import Any, TextIO

import hypothesis
import pytest

import calibeam  # noqa: F401 - sets the thread count before numpy is loaded

hypothesis.settings.register_profile("untimed", deadline=None)  # beside other work any example may take long
hypothesis.settings.load_profile("untimed")
HERE = Path(__file__).parent
# Several processes talk in real time here: beside hard work they starve, and rightly say that a device is silent. Two
# files of drivers and simulators at a time leave each other room enough, for most of their time is waiting; those of
# calibeam are whole sessions, whose emulators, readers and servo want both cores. tests/phases.py names these folders.
WIRED = (
    "calibeam/fleet/test_engine.py",
    "calibeam/guided/test_wired_guided.py",
    "calibeam/live/test_browser.py",
    "calibeam/live/test_page.py",
    "calibeam/live/test_wired_live.py",
    "calibeam/prove/test_wired.py",
    "calibeam/sessions/test_wired_motion_stops.py",
    "calibeam/sessions/test_wired_pause.py",
    "calibeam/sessions/test_wired_stops.py",
    "calibeam/sessions/test_wired_tracker.py",
    "calibeam/test_camera_cli.py",
    "calibeam/test_centre_cli.py",
    "calibeam/test_check_cli.py",
    "calibeam/test_cli.py",
    "calibeam/test_corrected_on_wires.py",
    "calibeam/test_device_faults.py",
    "calibeam/test_log_cli.py",
    "calibeam/test_modbus_session.py",
    "calibeam/test_motion_cli.py",
    "calibeam/test_psd_check_cli.py",
    "calibeam/test_same_on_wires.py",
    "calibeam/test_task_cli.py",
    "calibeam/test_torque_on_wires.py",
    "calibeam/test_wired_session.py",
    "drivers",
    "simulators/encoders",
    "simulators/faults",
    "simulators/host",
    "simulators/kpa101",
    "simulators/modbus",
    "simulators/psd_daq",
    "simulators/ur",
)


def pytest_ignore_collect(collection_path: Path, config: pytest.Config) -> bool | None:
    """A file of which `-m` takes nothing is not even imported: what is on wires is known by its path."""
    asked = str(config.getoption("markexpr"))
    if collection_path.suffix == ".py" and re.search(r"\bwired\b", asked):
        return on_wires(collection_path) == ("not wired" in asked) or None
    return None


def pytest_collection_finish() -> None:
    """What is loaded by now stays to the end: searching it for garbage time and again costs a twentieth of the time."""
    gc.collect()
    gc.freeze()
    gc.set_threshold(20_000, 20, 20)


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    for item in items:
        if on_wires(item.path):
            item.add_marker("wired")


@pytest.fixture
def bare_figures(monkeypatch: pytest.MonkeyPatch) -> None:
    """Figures of a page are painted, but not set out and written, which takes seconds a page.

    For tests of what stands beside them; whole pages are those of tests/calibrate/report.
    """

    def bare(canvas: Any, file: TextIO, **_: object) -> None:
        width, height = 72.0 * canvas.figure.get_size_inches()
        file.write(f'<svg viewBox="0 0 {width:g} {height:g}"></svg>')

    monkeypatch.setattr("matplotlib.backends.backend_svg.FigureCanvasSVG.print_svg", bare)


@cache
def on_wires(path: Path) -> bool:
    return any(path.is_relative_to(HERE / wired) for wired in WIRED)
