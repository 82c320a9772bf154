"""What the samples of a session are exposed to: all that a mechanism may depend on.

A row is one sample. Everything here is true; what a column of the recording shows is decided elsewhere.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Whole = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Scene:
    """One entry per sample, in the order of time."""

    t_s: Floats  # (row,) since the start of the session
    via_rad: Floats  # (row, n) joint angles where the last straight move to the sample began
    goal_rad: Floats  # (row, n) joint angles where it ended
    qd_rad_s: Floats  # (row, n) speed while the instrument read
    wait_s: Floats  # (row,) from the end of the last move to the reading of the instrument
    payload_kg: Floats  # (row,) carried beyond the tool
    payload_com_m: Floats  # (3,) its centre of mass in the flange frame
    placement: Whole  # (row,) fixture place, 0 without a fixture
    first_psd: Whole  # (row,) 1 or 2, 0 without a fixture
    seat: Whole  # (row,) cone, 0 when the probe is in none
    temperature_degC: Mapping[str, Floats]  # by place: "room", "joint2", "link2", "laser"
    laser_power: Floats  # (row,) against the start
    extra: Mapping[str, Floats]  # other things that are measured: "fan_rpm", "supply_bar"

    def __len__(self) -> int:
        return int(self.t_s.size)

    @property
    def last_move_rad(self) -> Floats:
        """(row, n) the last straight move of each joint."""
        return self.goal_rad - self.via_rad

    def warmed_k(self, where: str) -> Floats:
        """(row,) temperature against the start of the session."""
        return self.temperature_degC[where] - self.temperature_degC[where][0]


@dataclass(frozen=True, eq=False)
class Load:
    """What weight does to the arm, in its true pose and with its true masses."""

    torque_nm: Floats  # (row, n) of gravity about each joint's positive axis
    payload_torque_nm: Floats  # (row, n) the payload's share of it
    moment_nm: Floats  # (row, n + 1, 3) of all weight beyond the start of link i, about that start, in link i's frame
    force_n: Floats  # (row, n + 1, 3) the weight itself, same frame
    down_flange: Floats  # (row, 3) direction of gravity in the flange frame


@dataclass(frozen=True, eq=False)
class Light:
    """Light on both sensors before any distortion; last axis but one: PSD 1, PSD 2."""

    spot_m: Floats  # (row, 2, 2) in the sensor's face
    direction: Floats  # (row, 2, 3) of the arriving beam in the sensor's frame (z < 0)
    sum_v: Floats  # (row, 2) sum signal of the laser's light alone
