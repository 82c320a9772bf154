"""The bench on real wires: PSD box, encoders and controller read by pumps, the arm moved by its control process."""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from acquisition.bench import Look, Spot
from acquisition.settling import SettleRule, settled_from
from acquisition.streams import Pump
from acquisition.supervisor import Supervisor
from drivers.clock import Clock
from drivers.device import Block, Movable
from drivers.errors import DeviceStale

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Faces:
    """From photocurrents (sample, 8) A to spots: passed in, because each PSD box has its own formula."""

    spots: Callable[[Floats], Floats]  # (sample, 8) -> (sample, 4) m, psd1 x, y, psd2 x, y
    sums_v: Callable[[Floats], Floats]  # (sample, 8) -> (sample, 2) V
    dark: Callable[[NDArray[np.int64]], NDArray[np.bool_]]  # flags (sample,) -> (sample, 2) no light
    saturated: Callable[[NDArray[np.int64]], NDArray[np.bool_]]


@dataclass(frozen=True)
class Speeds:
    """How the session moves the arm."""

    speed_rad_s: float
    acceleration_rad_s2: float


@dataclass(frozen=True)
class Pumps:
    """The running readers; encoders are optional."""

    psd: Pump
    robot: Pump
    encoders: Pump | None = None


# After the controller says the motion has ended, samples still on their way were taken before: at 3 Mbaud a frame of
# ten samples arrives 11 ms after its first one.
IN_FLIGHT_S = 0.015
SILENCE_S = 0.5  # host time without a sample after which a wait gives up


@dataclass
class WiredBench:
    """Implements acquisition.bench.Bench. `place` asks a person, or the emulated world, to move the fixture."""

    arm: Movable
    pumps: Pumps
    faces: Faces
    speeds: Speeds
    supervisor: Supervisor
    clock: Clock
    place: Callable[[int], None]
    rule: SettleRule = field(default_factory=SettleRule)
    _cmd_rad: Floats = field(default_factory=lambda: np.empty(0))
    _start_s: float | None = None

    def move(self, q_rad: Floats) -> None:
        self.supervisor.check()
        self._cmd_rad = q_rad.copy()
        self.arm.move_joints(q_rad, self.speeds.speed_rad_s, self.speeds.acceleration_rad_s2)
        self.supervisor.check()

    def stop(self) -> None:
        self.arm.stop()

    def place_fixture(self, placement: int) -> None:
        self.place(placement)

    def look(self, dwell_s: float) -> Look:
        self.supervisor.check()
        called_s = self.clock.now_s()
        after_s = self._next_psd_time() + IN_FLIGHT_S
        samples = _Collected()
        while True:
            for block in self.pumps.psd.wait(max(called_s, samples.host_s), SILENCE_S):
                samples.add(block, after_s)
            self.supervisor.check()
            start_s = samples.settled_from(self.faces, self.rule)
            waited_s = samples.span_s()
            if start_s is not None and samples.last_s() - start_s >= dwell_s:
                return self._summed(samples.since(start_s, dwell_s), settled=True)
            if start_s is None and waited_s > self.rule.limit_s + dwell_s:
                return self._summed(samples.since(samples.last_s() - dwell_s, dwell_s), settled=False)

    def _next_psd_time(self) -> float:
        latest = self.pumps.psd.latest()
        if latest is None:
            latest = self.pumps.psd.wait(-np.inf, SILENCE_S)[-1]
        return float(latest.device_s[-1])

    def _summed(self, window: "_Window", *, settled: bool) -> Look:
        if self._start_s is None:
            self._start_s = float(window.device_s[0])
        dark = self.faces.dark(window.flags).mean(axis=0) > 0.5
        saturated = self.faces.saturated(window.flags).any(axis=0)
        mean = self.faces.spots(window.current_a.mean(axis=0, keepdims=True))[0]
        each = self.faces.spots(window.current_a)
        sigma = each.std(axis=0, ddof=1) / np.sqrt(len(each))
        sums_v = self.faces.sums_v(window.current_a).mean(axis=0)
        spots = [
            _spot(mean[2 * k : 2 * k + 2], sigma[2 * k : 2 * k + 2], float(sums_v[k]), bool(dark[k]), bool(saturated[k]))
            for k in range(2)
        ]
        q_rad, qd_rad_s, joint_degC = self._robot(window)
        temperatures = {f"joint{i + 1}": float(t) for i, t in enumerate(joint_degC)}
        return Look(
            host_s=float(window.host_s[-1]),
            t_s=float(window.device_s.mean()) - self._start_s,
            q_rad=q_rad,
            qd_rad_s=qd_rad_s,
            cmd_rad=self._cmd_rad.copy(),
            encoder_rad=self._encoders(window),
            psd1=spots[0],
            psd2=spots[1],
            temperatures_degC={"psd": float(np.mean(window.temperature_degC)), **temperatures},
            settled=settled,
        )

    def _robot(self, window: "_Window") -> tuple[Floats, Floats, Floats]:
        blocks = _during(self.pumps.robot, window, SILENCE_S)
        q_rad = np.concatenate([b.values["actual_q_rad"] for b in blocks])
        qd_rad_s = np.concatenate([b.values["actual_qd_rad_s"] for b in blocks])
        degC = blocks[-1].values["joint_temperature_degC"][-1]
        return q_rad.mean(axis=0), qd_rad_s.mean(axis=0), degC

    def _encoders(self, window: "_Window") -> Floats | None:
        if self.pumps.encoders is None:
            return None
        blocks = _during(self.pumps.encoders, window, SILENCE_S)
        return np.nanmean(np.concatenate([b.values["position_rad"] for b in blocks]), axis=0)


@dataclass(frozen=True)
class _Window:
    host_s: Floats
    device_s: Floats
    current_a: Floats
    flags: NDArray[np.int64]
    temperature_degC: Floats


class _Collected:
    """PSD samples taken after the arm stood, while waiting for them to settle."""

    def __init__(self) -> None:
        self._blocks: list[Block] = []
        self._from_s = -np.inf
        self.host_s = -np.inf

    def add(self, block: Block, after_s: float) -> None:
        self.host_s = float(block.host_s[-1])
        self._from_s = after_s
        if block.device_s[-1] > after_s:
            self._blocks.append(block)

    def last_s(self) -> float:
        return float(self._blocks[-1].device_s[-1]) if self._blocks else -np.inf

    def span_s(self) -> float:
        return self.last_s() - self._from_s if self._blocks else 0.0

    def settled_from(self, faces: Faces, rule: SettleRule) -> float | None:
        if not self._blocks:
            return None
        window = self._joined(self._from_s, np.inf)
        spots_m = faces.spots(window.current_a)
        dark = np.repeat(faces.dark(window.flags), 2, axis=1)
        return settled_from(window.device_s, np.where(dark, np.nan, spots_m), rule)

    def since(self, start_s: float, dwell_s: float) -> _Window:
        return self._joined(start_s, start_s + dwell_s)

    def _joined(self, from_s: float, to_s: float) -> _Window:
        device_s = np.concatenate([b.device_s for b in self._blocks])
        keep = (device_s >= from_s) & (device_s <= to_s)

        def joined(name: str) -> NDArray[np.float64]:
            return np.concatenate([b.values[name] for b in self._blocks])[keep]

        host_s = np.concatenate([b.host_s for b in self._blocks])[keep]
        flags = joined("flags").astype(np.int64)
        return _Window(host_s, device_s[keep], joined("photocurrent_a"), flags, joined("temperature_degC"))


def _spot(mean_m: Floats, sigma_m: Floats, sum_v: float, dark: bool, saturated: bool) -> Spot:
    if dark:
        return Spot(np.nan, np.nan, sum_v, np.nan, np.nan, lit=False)
    return Spot(
        float(mean_m[0]), float(mean_m[1]), sum_v, float(sigma_m[0]), float(sigma_m[1]), lit=True, saturated=saturated
    )


def _during(pump: Pump, window: _Window, timeout_s: float) -> list[Block]:
    """Blocks that arrived during the window, at least one: the arm stands still, so the next one serves as well."""
    blocks = pump.recent(float(window.host_s[0]))
    if blocks:
        return blocks
    arrived = pump.wait(float(window.host_s[0]), timeout_s)
    if not arrived:
        raise DeviceStale("no reading of the arm during the dwell; check the controller's connection")
    return arrived
