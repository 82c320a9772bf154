"""Faults of a device itself, which last for a number of cycles instead of striking outputs."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from simulators.faults.device_clock import DeviceClock
from simulators.faults.fault import Fault, FaultError, Setting, Target
from simulators.faults.light import BLINDING_GAIN, DisturbedLight


@dataclass(frozen=True)
class StateFault:
    """A kind: how it begins and ends. FaultError from `begin` when the device has nothing that it could disturb."""

    name: str
    begin: Callable[[Target, Fault, float], None]
    end: Callable[[Target, Fault], None]
    settings: Mapping[str, Setting] = field(default_factory=dict[str, Setting])


def _clock_of(target: Target) -> DeviceClock:
    if target.clock is None:
        raise FaultError("clock: this device puts no time stamps into what it sends; choose another kind")
    return target.clock


def _light_of(target: Target) -> DisturbedLight:
    if target.light is None:
        raise FaultError("this device sees no light; inject it into psd")
    return target.light


def _disturb_clock(target: Target, fault: Fault, t_s: float) -> None:
    _clock_of(target).disturb(fault, fault.settings["step_s"], fault.settings["drift"], t_s)


def _mend_clock(target: Target, fault: Fault) -> None:
    _clock_of(target).mend(fault)


def _blind(target: Target, fault: Fault, t_s: float) -> None:
    _light_of(target).disturb(fault, BLINDING_GAIN)


def _spot_off(target: Target, fault: Fault, t_s: float) -> None:
    _light_of(target).disturb(fault, 0.0)


def _mend_light(target: Target, fault: Fault) -> None:
    _light_of(target).mend(fault)


STATE_FAULTS = (
    StateFault(
        "clock",
        _disturb_clock,
        _mend_clock,
        {"step_s": Setting(0.5, -1e6, 1e6), "drift": Setting(0.0, -0.5, 0.5)},
    ),
    StateFault("saturation", _blind, _mend_light),
    StateFault("spot-off", _spot_off, _mend_light),
)
