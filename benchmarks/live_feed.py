"""A rig that lives in this process: blocks of its three devices at their rates, for pages without emulators."""

import threading
from collections.abc import Generator
from contextlib import contextmanager
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from acquisition.centring.aim import BeamTarget, flange_for, reach
from acquisition.recording.rig import Rig
from acquisition.wires.psd_view import PsdView
from calibeam.live.feed import Feed
from calibrate.model.assumed_rig import AssumedRig
from drivers.clock import Clock
from drivers.device import Block
from drivers.psd_daq.messages import Flag
from drivers.psd_faces import Face, FaceKind

Floats = NDArray[np.float64]

RATES_HZ = {"psd": 1000.0, "encoders": 100.0, "robot": 500.0}
BLOCKS_HZ = 50.0  # of each device: its reader wakes so often
SUM_A, OHM = 2.1e-5, 1e5
BEFORE_M = 0.12  # of the first face, where the laser is
WANDER_RAD = np.array([8e-3, 6e-3, 9e-3, 1.2e-2, 1e-2, 2e-2])
WANDER_HZ = np.array([0.11, 0.17, 0.13, 0.19, 0.23, 0.07])


def lit_posture(rig: Rig, placement: int = 1, first: int = 1) -> Floats:
    """Joint readings whose beam strikes the middle of both faces."""
    assumed = AssumedRig(rig)
    middle = BeamTarget(first, (0.0, 0.0, 0.0, 0.0), BEFORE_M, 0.0)
    flange = flange_for(assumed.arm, assumed.fixture, assumed.T_base_psd1(placement), middle)
    return reach(assumed.arm, flange, np.array(rig.motion.home_rad), np.random.default_rng(1))


@dataclass
class LivingRig:
    """Makes blocks. `dark`: faces (1, 2) without light; `silent`: devices that send nothing."""

    rig: Rig
    feed: Feed
    clock: Clock
    dark: set[int] = field(default_factory=set[int])
    bright: set[int] = field(default_factory=set[int])
    silent: set[str] = field(default_factory=set[str])
    placement: int = 1
    url: str = ""  # of the page that it lives on

    def __post_init__(self) -> None:
        assert self.rig.fixture is not None
        self._half_m = self.rig.fixture.half_size_m
        self._assumed = AssumedRig(self.rig)
        self._middle_rad = lit_posture(self.rig, self.placement)
        self._next = dict.fromkeys(RATES_HZ, 0)
        self._rng = np.random.default_rng(2)
        self.feed.sees(PsdView((Face(FaceKind.DUO_LATERAL, 2.0 * self._half_m),) * 2, OHM))

    def posture(self, t_s: float) -> Floats:
        """Wanders slowly about the lit one."""
        return self._middle_rad + WANDER_RAD * np.sin(2.0 * np.pi * WANDER_HZ * t_s)

    def send(self, t_s: float) -> None:
        """One block of every device that is not silent; of `t_s` by their clocks."""
        for device, hz in RATES_HZ.items():
            count = round(hz / BLOCKS_HZ)
            first, self._next[device] = self._next[device], self._next[device] + count
            if device not in self.silent:
                numbers = np.arange(first, first + count)
                host_s = np.full(count, self.clock.now_s())
                self.feed.heard(device, Block(host_s, numbers / hz, numbers, self._values(device, t_s, count)))

    def _values(self, device: str, t_s: float, count: int) -> dict[str, NDArray[np.generic]]:
        q_rad = self.posture(t_s)
        if device == "psd":
            return self._psd(q_rad, count)
        name = "actual_q_rad" if device == "robot" else "position_rad"
        return {name: q_rad + self._rng.normal(0.0, 3e-6, (count, self.rig.n_joints))}

    def _psd(self, q_rad: Floats, count: int) -> dict[str, NDArray[np.generic]]:
        spots_m = self._assumed.expect(q_rad, self.placement, 1).spots_m + np.array([6e-4, -4e-4, -3e-4, 8e-4])
        share = np.clip(spots_m / self._half_m, -1.0, 1.0)
        ends = 0.5 * SUM_A * np.stack([1.0 - share, 1.0 + share], axis=1).reshape(-1)
        lit = np.repeat([0.0 if face in self.dark else 1.0 for face in (1, 2)], 4)
        noise_a = self._rng.normal(0.0, 1e-9, (count, 8))
        flags = sum(flag for face, flag in ((1, Flag.PSD1_NO_LIGHT), (2, Flag.PSD2_NO_LIGHT)) if face in self.dark)
        flags |= sum(flag for face, flag in ((1, Flag.PSD1_SATURATED), (2, Flag.PSD2_SATURATED)) if face in self.bright)
        return {"photocurrent_a": ends * lit + noise_a, "flags": np.full(count, flags)}

    @contextmanager
    def running(self) -> Generator[None]:
        """Inside, a thread sends blocks in real time."""
        done = threading.Event()

        def run() -> None:
            begin_s = self.clock.now_s()
            while not done.wait(1.0 / BLOCKS_HZ):
                self.send(self.clock.now_s() - begin_s)

        thread = threading.Thread(target=run, name="living rig", daemon=True)
        thread.start()
        try:
            yield
        finally:
            done.set()
            thread.join()
