"""The shipped rig with a camera, and its world in this process."""

from pathlib import Path
from typing import Any

import pytest

from acquisition.recording.rig import Rig, load_rig, plain_rig, rig_text

RIG = Path(__file__).parents[4] / "rigs" / "ur5e-dual-psd-camera.toml"


@pytest.fixture(scope="session")
def rig() -> Rig:
    return load_rig(RIG)


@pytest.fixture(scope="session")
def plain() -> dict[str, Any]:
    return plain_rig(rig_text(RIG), str(RIG))


@pytest.fixture(scope="session")
def exact(plain: dict[str, Any]) -> dict[str, Any]:
    """The same rig whose arm, fixture and board are as drawn; lens and mount are not."""
    camera = {key: value for key, value in plain["emulation"].items() if key.startswith("camera")}
    return {**plain, "emulation": {"seed": 1, **camera}}
