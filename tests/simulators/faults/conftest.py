"""Faults on real wires: one set of emulators for all tests, well again before each."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from acquisition.recording.rig import plain_rig, rig_text
from calibeam.pytest_plugin import start_emulators  # noqa: F401 - the fixture under test
from simulators.process import Emulators

RIG_PATH = Path(__file__).parents[3] / "rigs" / "ur5e-dual-psd.toml"


@pytest.fixture(scope="session")
def rig() -> dict[str, Any]:
    return plain_rig(rig_text(RIG_PATH), str(RIG_PATH))


@pytest.fixture(scope="session")
def running(rig, tmp_path_factory) -> Iterator[Emulators]:
    folder = tmp_path_factory.mktemp("links")
    devices = {
        **rig["devices"],
        "psd": {**rig["devices"]["psd"], "port": str(folder / "psd")},
        "encoders": {**rig["devices"]["encoders"], "channel": str(folder / "can")},
    }
    with Emulators({**rig, "devices": devices}) as emulators:
        yield emulators


@pytest.fixture
def emulators(running) -> Emulators:
    running.clear()
    return running
