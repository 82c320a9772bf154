"""Loaded before any test: the same thread setting that the program has. Marks the tests that talk in real time."""

from functools import cache
from pathlib import Path

import pytest

import calibeam  # noqa: F401 - sets the thread count before numpy is loaded

HERE = Path(__file__).parent
# Several processes talk in real time here: beside hard work they starve, and rightly say that a device is silent. Two
# files at a time leave each other room enough, for most of their time is waiting, but for those of ALONE: whole
# sessions, whose emulators, readers and servo want both cores.
ALONE = "calibeam"
WIRED = (
    "calibeam/guided/test_wired_guided.py",
    "calibeam/prove/test_wired.py",
    "calibeam/test_camera_cli.py",
    "calibeam/test_check_cli.py",
    "calibeam/test_cli.py",
    "calibeam/test_device_faults.py",
    "calibeam/test_log_cli.py",
    "calibeam/test_modbus_session.py",
    "calibeam/test_motion_cli.py",
    "calibeam/test_psd_check_cli.py",
    "calibeam/test_same_on_wires.py",
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


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    for item in items:
        for mark in marks_of(item.path):
            item.add_marker(mark)


@cache
def marks_of(path: Path) -> tuple[str, ...]:
    if not any(path.is_relative_to(HERE / wired) for wired in WIRED):
        return ()
    return ("wired", "alone") if path.is_relative_to(HERE / ALONE) else ("wired",)
