"""What the samples of a session are exposed to, all that a mechanism may depend on, and what one is drawn for.

A row is one sample. Everything here is true; what a column of the recording shows is decided elsewhere.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field

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
    payload_com_m: Floats  # (3,) or (row, 3) its centre of mass in the flange frame
    placement: Whole  # (row,) fixture place, 0 without a fixture
    first_psd: Whole  # (row,) 1 or 2, 0 without a fixture
    seat: Whole  # (row,) cone, 0 when the probe is in none
    temperature_degC: Mapping[str, Floats]  # by place: "room", "joint2", "link2", "laser"
    laser_power: Floats  # (row,) against the start
    extra: Mapping[str, Floats]  # other things that are measured: "fan_rpm", "supply_bar"
    rest_degC: Mapping[str, float] = field(default_factory=dict[str, float])  # see `warmed_k`
    moved_rad: Floats | None = None  # (row, n) last move where it is known by itself; None: from via to goal
    asked_rad: Floats | None = None  # (row, n) what the controller still asks for: command less reading
    laser_sum_v: Floats | None = None  # (row, 2) sum signal of the laser alone where it was recorded

    def __len__(self) -> int:
        return int(self.t_s.size)

    @property
    def last_move_rad(self) -> Floats:
        """(row, n) the last straight move of each joint."""
        return self.goal_rad - self.via_rad if self.moved_rad is None else self.moved_rad

    def warmed_k(self, where: str) -> Floats:
        """(row,) temperature against the one at which the rig is nominal; where none is stated, against the start."""
        degC = self.temperature_degC[where]
        return degC - self.rest_degC.get(where, float(degC[0]))


@dataclass(frozen=True, eq=False)
class Light:
    """Light on both sensors before any distortion; last axis but one: PSD 1, PSD 2."""

    spot_m: Floats  # (row, 2, 2) in the sensor's face
    direction: Floats  # (row, 2, 3) of the arriving beam in the sensor's frame (z < 0)
    sum_v: Floats  # (row, 2) sum signal of the laser's light alone


class UnsuitedError(ValueError):
    """The rig or session has nothing that could suffer from the mechanism."""


@dataclass(frozen=True)
class Site:
    """The rig and session that a defect is drawn for."""

    n_joints: int
    instrument: str  # "dual-psd", "position", "wire", "seat"
    loaded: tuple[int, ...]  # joints, from 1, that gravity can turn
    torque_nm: tuple[float, ...]  # (n,) standard deviation of gravity's torque over the session
    gear_ratio: tuple[float, ...]  # motor turns per joint turn; empty: an arm without drives
    link_length_m: tuple[float, ...]  # (n + 1,) link 0 is what stands before joint 1
    sweep_rad: tuple[float, ...]  # (n,) range that each joint covers
    usual_rad: tuple[tuple[float, float], ...]  # (n,) where the middle eight tenths of its samples lie
    places: tuple[int, ...]
    stays_s: tuple[tuple[int, float, float], ...]  # place, from, until: the fixture stands there
    seats: tuple[int, ...]
    half_size_m: float
    duration_s: float
    pushed: tuple[float, ...] = ()  # (n,) share of the samples in which gravity turns the joint forwards

    def stay_s(self, place: int, rng: np.random.Generator) -> tuple[float, float]:
        """A moment well within a stay of the fixture at a place, and the end of that stay (s)."""
        stays = [(start_s, end_s) for at, start_s, end_s in self.stays_s if at == place]
        start_s, end_s = max(stays, key=lambda stay: stay[1] - stay[0])
        return float(start_s + rng.uniform(0.3, 0.7) * (end_s - start_s)), end_s

    def middle_s(self, rng: np.random.Generator) -> float:
        """A moment in the middle half of the session."""
        return float(rng.uniform(0.25, 0.75) * self.duration_s)

    def any_joint(self, rng: np.random.Generator) -> int:
        """A joint, from 1, that turns far enough in this session for its own errors to show."""
        return int(rng.choice([joint for joint in range(1, self.n_joints + 1) if self.sweep_rad[joint - 1] > 0.5]))

    def loaded_joint(self, rng: np.random.Generator) -> int:
        """A joint that gravity can turn. UnsuitedError if there is none."""
        if not self.loaded:
            raise UnsuitedError("gravity turns no joint of this arm")
        return int(rng.choice(self.loaded))

    def geared_joint(self, rng: np.random.Generator) -> int:
        """A joint behind a gear. UnsuitedError for an arm without drives."""
        if not self.gear_ratio:
            raise UnsuitedError("the arm has no gears")
        return self.any_joint(rng)

    def long_link(self, rng: np.random.Generator, *, carrying: bool = False) -> int:
        """A link, from 1, longer than 0.1 m (and with weight to carry). UnsuitedError if there is none."""
        long = [link for link in range(1, self.n_joints) if self.link_length_m[link] > 0.1]
        if not long or (carrying and not self.loaded):
            raise UnsuitedError("no link is longer than 0.1 m, or none carries weight")
        return int(rng.choice(long))
