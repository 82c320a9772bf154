"""The rig and session that a defect is drawn for, and which of its parts may suffer."""

from dataclasses import dataclass

import numpy as np


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
    extras: tuple[str, ...]  # columns beside the named ones

    def stay_s(self, place: int, rng: np.random.Generator) -> tuple[float, float]:
        """A moment well within a stay of the fixture at a place, and the end of that stay (s)."""
        stays = [(start_s, end_s) for at, start_s, end_s in self.stays_s if at == place]
        start_s, end_s = max(stays, key=lambda stay: stay[1] - stay[0])
        return float(start_s + rng.uniform(0.3, 0.7) * (end_s - start_s)), end_s

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
