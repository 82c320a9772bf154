"""The bench on real wires: PSD box, encoders and controller read by pumps, the arm moved by its control process.

Readings have settled when two neighbouring short windows of the spots agree within their noise, judged by the PSD
box's own sample times, so that the rule is the same whether the world runs in real time or faster.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from acquisition.bench import ArmReading, Look
from acquisition.motion.under_way import GatedArm
from acquisition.wires.psd_view import PsdView, PsdWindow, psd_window
from acquisition.wires.streams import Pump, Supervisor
from drivers.clock import Clock
from drivers.device import Block
from drivers.errors import DeviceError

Floats = NDArray[np.float64]
SAMPLES_FOR_A_MEAN = 3


@dataclass(frozen=True)
class SettleRule:
    """Windows of `window_s`; agreement within `sigmas` of their noise, but never finer than `floor_m`."""

    window_s: float = 0.02
    sigmas: float = 4.0
    floor_m: float = (
        1e-6  # below the reading noise of a window at 1 kHz (2 µm / sqrt(20) = 0.45 µm, two windows, 1.5 sigma)
    )
    limit_s: float = 1.0  # of device time; then the sample is taken and marked as not settled


@dataclass(frozen=True)
class Stretch:
    """The device time to average over."""

    from_s: float
    to_s: float
    settled: bool


def stretch_to_average(device_s: Floats, spots_m: Floats, dwell_s: float, rule: SettleRule) -> Stretch | None:
    """`dwell_s` of the samples so far, from where they have settled; the last ones when they do not; None: wait on.

    At least one window, and SAMPLES_FOR_A_MEAN of a slow or halting box: a single sample has no sigma.
    """
    dwell_s = max(dwell_s, rule.window_s)
    last_s = float(device_s[-1])
    start_s = settled_from(device_s, spots_m, rule)
    if start_s is not None:
        later_s = device_s[device_s >= start_s]
        if len(later_s) < SAMPLES_FOR_A_MEAN or last_s - start_s < dwell_s:
            return None
        return Stretch(start_s, max(start_s + dwell_s, float(later_s[SAMPLES_FOR_A_MEAN - 1])), settled=True)
    if last_s - float(device_s[0]) > rule.limit_s + dwell_s and len(device_s) >= SAMPLES_FOR_A_MEAN:
        return Stretch(min(last_s - dwell_s, float(device_s[-SAMPLES_FOR_A_MEAN])), last_s, settled=False)
    return None


def settled_from(device_s: Floats, spots_m: Floats, rule: SettleRule) -> float | None:
    """Start (device time, s) of the first pair of windows that agree; None while there is none.

    `spots_m` (sample, 4), NaN where dark: a dark coordinate agrees with a dark one only.
    """
    period_s = float(np.median(np.diff(device_s))) if device_s.size > 1 else 0.0
    size = max(4, round(rule.window_s / period_s)) if period_s > 0.0 else 0
    if size == 0 or device_s.size < 2 * size:
        return None
    for start in range(0, device_s.size - 2 * size + 1, size):
        if _agree(spots_m[start : start + size], spots_m[start + size : start + 2 * size], rule):
            return float(device_s[start])
    return None


def _agree(one: Floats, two: Floats, rule: SettleRule) -> bool:
    dark_one, dark_two = np.isnan(one).any(axis=0), np.isnan(two).any(axis=0)
    if np.any(dark_one != dark_two):
        return False
    lit = ~dark_one
    if not np.any(lit):
        return True
    # From neighbouring samples, so that a slow ringing does not count as noise and hide itself (von Neumann 1941).
    jumps = np.concatenate([np.diff(one[:, lit], axis=0), np.diff(two[:, lit], axis=0)])
    noise_m = np.sqrt(jumps.var(axis=0) / 2.0) * np.sqrt(2.0 / len(one))
    apart_m = np.abs(one[:, lit].mean(axis=0) - two[:, lit].mean(axis=0))
    return bool(np.all(apart_m <= np.maximum(rule.sigmas * noise_m, rule.floor_m)))


LATENESS_S = 2.0  # of device time looked back on, to learn how early a PSD sample can arrive at all
SOFT_S = 0.8  # within which a pause brakes at most: rigs with a gentler acceleration are braked harder
DEGC = "_degC"
SILENCE_S = 0.5  # host time without a sample after which a wait gives up


@dataclass(frozen=True)
class Speeds:
    """How the session moves the arm."""

    speed_rad_s: float
    acceleration_rad_s2: float


@dataclass(frozen=True)
class Pumps:
    """The running readers; encoders are optional."""

    instrument: Pump
    robot: Pump
    encoders: Pump | None = None


@dataclass
class ArmOnWires:
    """What every bench on wires does, whatever its instrument: move the arm, stop it, read it."""

    arm: GatedArm
    pumps: Pumps
    speeds: Speeds
    supervisor: Supervisor
    clock: Clock
    hurry: float = 1.0  # device seconds in one second of this program's clock
    further: Mapping[str, Pump] = field(default_factory=dict[str, Pump])  # further instruments, by name
    _cmd_rad: Floats = field(default_factory=lambda: np.empty(0), init=False)
    _start_s: float | None = field(default=None, init=False)

    def move(self, q_rad: Floats) -> None:
        """Go there and stand still. RefusedMotionError before anything moves; DeviceError."""
        self.supervisor.check()
        try:
            self.arm.move_joints(q_rad, self.speeds.speed_rad_s, self.speeds.acceleration_rad_s2)
        except DeviceError:
            self.supervisor.check()  # the arm was stopped because another device failed: that is the news
            raise
        self._cmd_rad = q_rad.copy()
        self.supervisor.check()

    def _reading(
        self, host_s: Floats, now_s: float, temperatures_degC: Mapping[str, float], start_s: float, *, settled: bool
    ) -> ArmReading:
        """The arm, and further instruments, while the window (sample,) of the instrument was read. `now_s`: by the
        instrument's clock; `start_s`: that of the session, if this is its first reading; `temperatures_degC`: by the
        instrument.
        """
        self._start_s = start_s if self._start_s is None else self._start_s
        begin_s = float(host_s[0])
        robot = since(self.pumps.robot, begin_s)
        joint_degC = robot["joint_temperature_degC"][-1] if "joint_temperature_degC" in robot else ()
        temperatures = {f"joint{i + 1}": float(t) for i, t in enumerate(joint_degC)}
        q_rad = robot["actual_q_rad"]
        qd_rad_s = robot.get("actual_qd_rad_s", np.full_like(q_rad, np.nan))  # not every register map has speeds
        return ArmReading(
            host_s=float(host_s[-1]),
            t_s=now_s - self._start_s,
            q_rad=q_rad.mean(axis=0),
            qd_rad_s=qd_rad_s.mean(axis=0),
            cmd_rad=self._cmd_rad.copy(),
            encoder_rad=encoders_since(self.pumps.encoders, begin_s),
            temperatures_degC={**temperatures_degC, **temperatures, **further_temperatures(self.further)},
            settled=settled,
        )

    def stop(self) -> None:
        self.arm.stop()

    def rests_in_s(self) -> float:
        """Host time (s) until the motion under way ends, at most; 0: none is under way."""
        return self.arm.rests_in_s() / self.hurry

    @property
    def ease_s(self) -> float:
        """Host time (s) that `ease` takes from full speed."""
        return self.speeds.speed_rad_s / self._soft_rad_s2 / self.hurry

    def ease(self) -> None:
        """As `stop`, with the deceleration that every motion ends with."""
        self.arm.stop(self._soft_rad_s2)

    @property
    def _soft_rad_s2(self) -> float:
        return max(self.speeds.acceleration_rad_s2, self.speeds.speed_rad_s / SOFT_S)

    def hold(self) -> None:
        """As `stop`, and no motion is accepted any more."""
        self.arm.hold()


@dataclass(kw_only=True)
class WiredBench(ArmOnWires):
    """Implements acquisition.bench.Bench. `place` asks a person, or the emulated world, to move the fixture."""

    view: PsdView
    place: Callable[[int], None]
    rule: SettleRule = field(default_factory=SettleRule)

    def place_fixture(self, placement: int) -> None:
        self.place(placement)

    def look(self, dwell_s: float) -> Look:
        self.supervisor.check()
        seen_s = self.clock.now_s()
        begin_s = device_time(self.pumps.instrument, seen_s, self.hurry)
        blocks: list[Block] = []
        while True:
            arrived = self.pumps.instrument.wait(seen_s, SILENCE_S)
            self.supervisor.check()
            seen_s = float(arrived[-1].host_s[-1])
            blocks += [block for block in arrived if block.device_s[-1] >= begin_s]
            if not blocks:
                continue
            window = psd_window(blocks).between(begin_s, np.inf)
            stretch = stretch_to_average(window.device_s, self.view.each(window), dwell_s, self.rule)
            if stretch is not None:
                settle_s = stretch.from_s - begin_s if stretch.settled else None
                return self._summed(window.between(stretch.from_s, stretch.to_s), settle_s)

    def _summed(self, window: PsdWindow, settle_s: float | None) -> Look:
        psd1, psd2 = self.view.mean(window)
        from_s, to_s = float(window.device_s[0]), float(window.device_s[-1])
        now_s, degC = float(window.device_s.mean()), window.mean_temperature()
        reading = self._reading(window.host_s, now_s, degC, from_s, settled=settle_s is not None)
        return Look(**vars(reading), psd1=psd1, psd2=psd2, window_s=(from_s, to_s), settle_s=settle_s)


def device_time(pump: Pump, host_s: float, hurry: float) -> float:
    """What a device's clock showed, or later, at `host_s`: earlier samples may be of before the motion ended.

    The promptest sample of the last seconds ties both clocks; every other one came later than it could have, by
    the line, this machine's load, or an emulator that fell behind. So the guess is late rather than early. The
    seconds are of the device: an emulator that does not keep its pace falls behind all the time, and each look
    waits for as much as it lost in them.
    """
    blocks = pump.recent(host_s - LATENESS_S / hurry) or pump.wait(-np.inf, SILENCE_S)
    prompt_s = min(float(block.host_s[-1]) - float(block.device_s[-1]) / hurry for block in blocks)
    return (host_s - prompt_s) * hurry


def encoders_since(pump: Pump | None, begin_s: float) -> Floats | None:
    """Mean of the link-side encoders (joint,), NaN for one that did not answer; None: there are none."""
    if pump is None:
        return None
    each = since(pump, begin_s)["position_rad"]
    answered = np.isfinite(each)
    count = answered.sum(axis=0)
    return np.where(count > 0, np.where(answered, each, 0.0).sum(axis=0) / np.maximum(count, 1), np.nan)


def further_temperatures(pumps: Mapping[str, Pump]) -> dict[str, float]:
    """The newest of every temperature that further instruments measure: by their names, or name and channel."""
    found: dict[str, float] = {}
    for name, pump in pumps.items():
        block = pump.latest()
        for channel, values in () if block is None else block.values.items():
            if channel.endswith(DEGC) and values.ndim == 1 and np.isfinite(values[-1]):
                found[name if channel == f"temperature{DEGC}" else f"{name}_{channel.removesuffix(DEGC)}"] = float(
                    values[-1]
                )
    return found


def since(pump: Pump, begin_s: float) -> dict[str, Floats]:
    """Every channel of the samples that arrived since the window began (host time), at least one: the arm stands, so
    one that comes a little after the window serves as well.
    """
    blocks = pump.recent(begin_s) or pump.wait(begin_s, SILENCE_S)
    keep = np.concatenate([block.host_s for block in blocks]) >= begin_s
    return {name: np.concatenate([block.values[name] for block in blocks])[keep] for name in blocks[0].values}
