"""The bench on real wires: PSD box, encoders and controller read by pumps, the arm moved by its control process."""

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from acquisition.bench import Look
from acquisition.motion.gated_arm import GatedArm
from acquisition.psd_view import PsdView, PsdWindow, psd_window
from acquisition.settling import SettleRule, stretch_to_average
from acquisition.streams import Pump
from acquisition.supervisor import Supervisor
from drivers.clock import Clock
from drivers.device import Block
from drivers.errors import DeviceError

Floats = NDArray[np.float64]

LATENESS_S = 2.0  # of device time looked back on, to learn how early a PSD sample can arrive at all
SOFT_S = 0.8  # within which a pause brakes at most: rigs with a gentler acceleration are braked harder
SILENCE_S = 0.5  # host time without a sample after which a wait gives up


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


@dataclass
class WiredBench:
    """Implements acquisition.bench.Bench. `place` asks a person, or the emulated world, to move the fixture."""

    arm: GatedArm
    pumps: Pumps
    view: PsdView
    speeds: Speeds
    supervisor: Supervisor
    clock: Clock
    place: Callable[[int], None]
    hurry: float = 1.0  # device seconds in one second of this program's clock
    rule: SettleRule = field(default_factory=SettleRule)
    _cmd_rad: Floats = field(default_factory=lambda: np.empty(0), init=False)
    _start_s: float | None = field(default=None, init=False)

    def move(self, q_rad: Floats) -> None:
        self.supervisor.check()
        self._cmd_rad = q_rad.copy()
        try:
            self.arm.move_joints(q_rad, self.speeds.speed_rad_s, self.speeds.acceleration_rad_s2)
        except DeviceError:
            self.supervisor.check()  # the arm was stopped because another device failed: that is the news
            raise
        self.supervisor.check()

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

    def place_fixture(self, placement: int) -> None:
        self.place(placement)

    def look(self, dwell_s: float) -> Look:
        self.supervisor.check()
        seen_s = self.clock.now_s()
        begin_s = self._psd_time(seen_s)
        blocks: list[Block] = []
        while True:
            arrived = self.pumps.psd.wait(seen_s, SILENCE_S)
            self.supervisor.check()
            seen_s = float(arrived[-1].host_s[-1])
            blocks += [block for block in arrived if block.device_s[-1] >= begin_s]
            if not blocks:
                continue
            window = psd_window(blocks).between(begin_s, np.inf)
            stretch = stretch_to_average(window.device_s, self.view.each(window), dwell_s, self.rule)
            if stretch is not None:
                look = self._summed(window.between(stretch.from_s, stretch.to_s), settled=stretch.settled)
                return replace(look, settle_s=stretch.from_s - begin_s if stretch.settled else None)

    def _psd_time(self, host_s: float) -> float:
        """What the PSD box's clock showed, or later, at `host_s`: earlier samples may be of before the motion ended.

        The promptest sample of the last seconds ties both clocks; every other one came later than it could have, by
        the line, this machine's load, or an emulator that fell behind. So the guess is late rather than early. The
        seconds are of the device: an emulator that does not keep its pace falls behind all the time, and each look
        waits for as much as it lost in them.
        """
        blocks = self.pumps.psd.recent(host_s - LATENESS_S / self.hurry) or self.pumps.psd.wait(-np.inf, SILENCE_S)
        prompt_s = min(float(block.host_s[-1]) - float(block.device_s[-1]) / self.hurry for block in blocks)
        return (host_s - prompt_s) * self.hurry

    def _summed(self, window: PsdWindow, *, settled: bool) -> Look:
        if self._start_s is None:
            self._start_s = float(window.device_s[0])
        psd1, psd2 = self.view.mean(window)
        robot = self._since(self.pumps.robot, window)
        joint_degC = robot["joint_temperature_degC"][-1] if "joint_temperature_degC" in robot else ()
        temperatures = {f"joint{i + 1}": float(t) for i, t in enumerate(joint_degC)}
        q_rad = robot["actual_q_rad"]
        qd_rad_s = robot.get("actual_qd_rad_s", np.full_like(q_rad, np.nan))  # not every register map has speeds
        return Look(
            host_s=float(window.host_s[-1]),
            t_s=float(window.device_s.mean()) - self._start_s,
            q_rad=q_rad.mean(axis=0),
            qd_rad_s=qd_rad_s.mean(axis=0),
            cmd_rad=self._cmd_rad.copy(),
            encoder_rad=self._encoders(window),
            psd1=psd1,
            psd2=psd2,
            temperatures_degC={**window.mean_temperature(), **temperatures},
            settled=settled,
            window_s=(float(window.device_s[0]), float(window.device_s[-1])),
        )

    def _encoders(self, window: PsdWindow) -> Floats | None:
        """Mean of the link-side encoders (joint,), NaN for one that did not answer."""
        if self.pumps.encoders is None:
            return None
        each = self._since(self.pumps.encoders, window)["position_rad"]
        answered = np.isfinite(each)
        count = answered.sum(axis=0)
        return np.where(count > 0, np.where(answered, each, 0.0).sum(axis=0) / np.maximum(count, 1), np.nan)

    def _since(self, pump: Pump, window: PsdWindow) -> dict[str, Floats]:
        """Every channel of the samples that arrived since the window began, at least one: the arm stands, so one that
        comes a little after the window serves as well.
        """
        begin_s = float(window.host_s[0])
        blocks = pump.recent(begin_s) or pump.wait(begin_s, SILENCE_S)
        keep = np.concatenate([block.host_s for block in blocks]) >= begin_s
        return {name: np.concatenate([block.values[name] for block in blocks])[keep] for name in blocks[0].values}
