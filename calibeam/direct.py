"""The bench without wires: the same world, stepped by the session itself.

For the many sessions of benchmarks and proofs. What it leaves out is the wire: protocols, line time, threads, other processes;
world, optics, noise and settling are those of the emulators. `tests/calibeam` checks that both paths tell the same.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from acquisition.bench import Look, Spot
from acquisition.recording.rig_schema import Rig
from acquisition.settling import SettleRule, settled_from
from simulators.wire import TICK_S
from simulators.world.world import World

Floats = NDArray[np.float64]


@dataclass
class DirectBench:
    """Implements acquisition.bench.Bench over a world in this process."""

    world: World
    half_size_m: float
    speed_rad_s: float = 1.0
    acceleration_rad_s2: float = 3.0
    rate_hz: float = 1000.0
    rule: SettleRule = field(default_factory=SettleRule)
    moves: int = 0
    _cmd_rad: Floats = field(default_factory=lambda: np.empty(0))

    def __post_init__(self) -> None:
        self.world.psd_rate(self.rate_hz)
        self._cmd_rad = self.world.joints().q_rad

    @property
    def standing_rad(self) -> Floats:
        """Where the arm was last sent, (joint,)."""
        return self._cmd_rad

    def move(self, q_rad: Floats) -> None:
        """A cosine ramp from command to command, then until the arm stands."""
        start, span = self._cmd_rad, q_rad - self._cmd_rad
        largest = float(np.max(np.abs(span)))
        # Peaks of a cosine ramp of duration T over L: speed pi L / 2T, acceleration pi^2 L / 2T^2.
        duration_s = max(
            math.pi * largest / (2.0 * self.speed_rad_s),
            math.pi * math.sqrt(largest / (2.0 * self.acceleration_rad_s2)),
        )
        begin_s = self.world.time_s
        while (elapsed_s := self.world.time_s - begin_s) < duration_s:
            share = 0.5 - 0.5 * math.cos(math.pi * elapsed_s / duration_s)
            self.world.command(start + share * span)
            self.world.advance(self.world.time_s + TICK_S)
        self.world.command(q_rad)
        self._cmd_rad = q_rad.copy()
        self.moves += 1

    def look(self, dwell_s: float) -> Look:
        times: list[Floats] = []
        currents: list[Floats] = []
        start_s: float | None = None
        begin_s = self.world.time_s
        while True:
            sampled_s, sampled_a = self._sample(max(dwell_s, 2.0 * self.rule.window_s))
            times.append(sampled_s)
            currents.append(sampled_a)
            t, a = np.concatenate(times), np.concatenate(currents)
            start_s = settled_from(t, self._spots_or_nan(a), self.rule)
            late = t[-1] - begin_s > self.rule.limit_s + dwell_s
            if late or (start_s is not None and t[-1] - start_s >= dwell_s):
                first = start_s if start_s is not None else t[-1] - dwell_s
                keep = (t >= first) & (t <= first + dwell_s)
                return self._summed(t[keep], a[keep], settled=start_s is not None)

    def place_fixture(self, placement: int) -> None:
        self.world.place_fixture(placement)

    def stop(self) -> None:
        self._cmd_rad = self.world.joints().q_rad
        self.world.command(self._cmd_rad)

    def _sample(self, span_s: float) -> tuple[Floats, Floats]:
        """Advance by `span_s` in ticks; sample times (sample,) and currents (sample, 8)."""
        per_tick = max(1, round(TICK_S * self.rate_hz))
        times, currents = [], []
        for _ in range(math.ceil(span_s / TICK_S)):
            before_s = self.world.time_s
            self.world.advance(before_s + TICK_S)
            t = before_s + TICK_S * np.arange(1, per_tick + 1) / per_tick
            times.append(t)
            currents.append(self.world.photocurrents_a(t))
        return np.concatenate(times), np.concatenate(currents)

    def _spots_or_nan(self, currents_a: Floats) -> Floats:
        pairs = currents_a.reshape(-1, 4, 2)
        sums = pairs.sum(axis=2)
        with np.errstate(divide="ignore", invalid="ignore"):
            spots = self.half_size_m * (pairs[:, :, 1] - pairs[:, :, 0]) / sums
        return np.where(sums > LIT_A, spots, np.nan)

    def _summed(self, t_s: Floats, currents_a: Floats, *, settled: bool) -> Look:
        mean = self._spots_or_nan(currents_a.mean(axis=0, keepdims=True))[0]
        each = self._spots_or_nan(currents_a)
        sigma = each.std(axis=0, ddof=1) / math.sqrt(len(each))
        sums_v = currents_a.mean(axis=0).reshape(2, 4).sum(axis=1) * SUM_V_PER_A
        joints = self.world.joints()
        faces = [
            Spot(
                float(mean[2 * k]), float(mean[2 * k + 1]), float(sums_v[k]), float(sigma[2 * k]),
                float(sigma[2 * k + 1]), lit=bool(np.isfinite(mean[2 * k : 2 * k + 2]).all()),
            )
            for k in range(2)
        ]
        temperatures = {f"joint{i + 1}": float(degC) for i, degC in enumerate(joints.temperature_degC)}
        return Look(
            host_s=float(t_s[-1]), t_s=float(t_s.mean()), q_rad=joints.q_rad, qd_rad_s=joints.qd_rad_s,
            cmd_rad=self._cmd_rad.copy(), encoder_rad=self.world.link_encoders_rad(), psd1=faces[0], psd2=faces[1],
            temperatures_degC={"psd": self.world.psd_temperature_degC, **temperatures}, settled=settled,
        )


def direct_bench(rig: Rig, plain_rig: Mapping[str, Any], *, seed: int) -> DirectBench:
    """A bench over the emulated world that `seed` draws; `plain_rig` is the same file as `rig`, as the world reads it."""
    if rig.fixture is None:
        raise ValueError(f"rig {rig.name} has no [fixture]; a dual-PSD session needs one")
    world = World.from_rig(plain_rig, seed=seed, q_rad=rig.motion.home_rad)
    return DirectBench(world, rig.fixture.half_size_m, rig.motion.speed_rad_s, rig.motion.acceleration_rad_s2)


LIT_A = 1e-6  # per electrode pair; a lit face gives tens of microamperes, a dark one nanoamperes
SUM_V_PER_A = 1e4  # the emulated box's transimpedance
