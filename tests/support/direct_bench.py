"""The bench without wires: the same world, stepped by the session itself.

For the many sessions of benchmarks and proofs. What it leaves out is the wire: protocols, line time, threads, other
processes; world, optics, noise and settling are those of the emulators. tests/calibeam checks that both tell the same.

The emulated camera without a wire: its pictures are those that the emulator sends.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from acquisition.bench import Look
from acquisition.centring.camera.board import Grey
from acquisition.recording.rig import Rig
from acquisition.wires.bench import SettleRule, stretch_to_average
from acquisition.wires.psd_view import NO_LIGHT, PsdView, PsdWindow
from drivers.psd_faces import Face, FaceKind
from simulators.camera.emulator import Eye
from simulators.camera.picture import TrueCamera
from simulators.wire import TICK_S
from simulators.world.world import World

Floats = NDArray[np.float64]


class DirectEye:
    """Implements acquisition.centring.camera.board.Eye over a world in this process."""

    def __init__(self, world: World, plain_rig: Mapping[str, Any]) -> None:
        self._eye = Eye(world, plain_rig, world.truth.seed)

    @property
    def camera(self) -> TrueCamera:
        """What it truly is; for tests."""
        return self._eye.camera

    def picture(self) -> Grey:
        return self._eye.take(self._eye.scene())

    def taken(self, T_camera_board: Floats) -> Grey:
        """A picture of the board at a pose (4, 4) of its own, wherever the world has it."""
        return self._eye.take(T_camera_board)


DARK_A = 1e-6  # photocurrent below this is no light; a lit face gives tens of microamperes, a dark one nanoamperes
TRANSIMPEDANCE_V_A = 1e4


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
    _cmd_rad: Floats = field(default_factory=lambda: np.empty(0), init=False)

    def __post_init__(self) -> None:
        self.world.psd_rate(self.rate_hz)
        self._cmd_rad = self.world.joints().q_rad
        face = Face(FaceKind.DUO_LATERAL, 2.0 * self.half_size_m)
        self._view = PsdView((face, face), TRANSIMPEDANCE_V_A)

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
        samples: list[tuple[Floats, Floats]] = []
        while True:
            samples.append(self._sample(max(dwell_s, 2.0 * self.rule.window_s)))
            window = self._window(samples)
            stretch = stretch_to_average(window.device_s, self._view.each(window), dwell_s, self.rule)
            if stretch is not None:
                return self._summed(window.between(stretch.from_s, stretch.to_s), settled=stretch.settled)

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

    def _window(self, samples: list[tuple[Floats, Floats]]) -> PsdWindow:
        t_s = np.concatenate([times for times, _ in samples])
        current_a = np.concatenate([currents for _, currents in samples])
        pair_a = current_a.reshape(-1, 2, 4).sum(axis=2) / 2.0
        no_light = (pair_a < DARK_A) * np.array(NO_LIGHT)
        return PsdWindow(t_s, t_s, current_a, no_light.sum(axis=1), np.full(len(t_s), self.world.psd_temperature_degC))

    def _summed(self, window: PsdWindow, *, settled: bool) -> Look:
        psd1, psd2 = self._view.mean(window)
        joints = self.world.joints()
        temperatures = {f"joint{i + 1}": float(degC) for i, degC in enumerate(joints.temperature_degC)}
        return Look(
            host_s=float(window.host_s[-1]),
            t_s=float(window.device_s.mean()),
            q_rad=joints.q_rad,
            qd_rad_s=joints.qd_rad_s,
            cmd_rad=self._cmd_rad.copy(),
            encoder_rad=self.world.link_encoders_rad(),
            psd1=psd1,
            psd2=psd2,
            temperatures_degC={"psd": float(window.temperature_degC.mean()), **temperatures},
            settled=settled,
        )


def direct_bench(rig: Rig, plain_rig: Mapping[str, Any], *, seed: int) -> DirectBench:
    """A bench over the emulated world that `seed` draws; `plain_rig` is the same file, as the world reads it."""
    if rig.fixture is None:
        raise ValueError(f"rig {rig.name} has no [fixture]; a dual-PSD session needs one")
    world = World.from_rig(plain_rig, seed=seed, q_rad=rig.motion.home_rad)
    return DirectBench(world, rig.fixture.half_size_m, rig.motion.speed_rad_s, rig.motion.acceleration_rad_s2)
