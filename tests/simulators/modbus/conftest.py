"""The shipped Modbus rig, with a world that follows every set-point at once."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from acquisition.recording.rig import plain_rig, rig_text

RIG_PATH = Path(__file__).parents[3] / "rigs" / "irb120-modbus.toml"


class FollowingWorld:
    """Stands where it was commanded one tick ago."""

    n_joints = 6

    def __init__(self) -> None:
        self.time_s = 0.0
        self.now_rad = self.next_rad = np.zeros(6)
        self.speed_rad_s = np.zeros(6)

    def command(self, q_rad: np.ndarray) -> None:
        self.next_rad = np.array(q_rad, dtype=float)

    def advance(self, until_s: float) -> None:
        self.speed_rad_s = (self.next_rad - self.now_rad) / (until_s - self.time_s)
        self.now_rad, self.time_s = self.next_rad, until_s

    def joints(self) -> Any:
        class State:
            q_rad, qd_rad_s = self.now_rad, self.speed_rad_s
            torque_nm, temperature_degC = np.arange(6.0), np.full(6, 30.0)

        return State


@pytest.fixture(scope="session")
def rig() -> dict[str, Any]:
    return plain_rig(rig_text(RIG_PATH), str(RIG_PATH))
