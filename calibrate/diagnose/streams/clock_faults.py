"""Whether two clocks are farther apart than their devices' stamps at the host show: readings that come late.

Where two devices count from is nobody's fault, so an offset is judged against the one that the host's stamps show, with
their own scatter and what lines delay, which no stamp shows. A device without a clock carries the host's: then its own
stamps are those. A quartz is off by some 100 us/s at worst; what drifts more is a fault of its clock.

A device's clock that was set while it ran: separated from missing samples by the host's stamps, and taken out.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

from calibrate.diagnose.streams import limits
from calibrate.diagnose.streams.clock import ClockFit
from calibrate.diagnose.streams.continuity import Break, Fault
from calibrate.diagnose.streams.recorded import StreamDevice, stamps_scatter_s, start_between

Floats = NDArray[np.float64]


def judged(device: StreamDevice, faults: tuple[Break, ...]) -> tuple[tuple[Break, ...], StreamDevice]:
    """Jumps of time as what they are, and the device with its clock's steps taken out."""
    usual_s = device.track.period_s
    time_s, out = device.track.time_s.copy(), list[Break]()
    for one in faults:
        if one.fault not in (Fault.STEPPED, Fault.BACKWARDS):
            out.append(one)
            continue
        denied_s = _denied_s(device, one.last)
        if abs(denied_s - one.jump_s) < limits.DENIED_SHARE * abs(one.jump_s):
            time_s[one.last :] -= one.jump_s
            out.append(one)
        elif one.fault is Fault.BACKWARDS:
            out.append(one)
        elif not stamped_by_host(device):
            lost = round(one.jump_s / usual_s)
            out.append(replace(one, fault=Fault.MISSED, samples=lost, jump_s=0.0))
    return tuple(out), replace(device, track=replace(device.track, time_s=time_s))


def stamped_by_host(device: StreamDevice) -> bool:
    """Whether the device has no clock of its own, and carries the host's stamps for it."""
    apart = np.diff(device.track.time_s) - np.diff(device.host_s)
    return len(apart) > 0 and float(np.max(np.abs(apart))) < 1e-6


def shares_host_clock(device: StreamDevice) -> bool:
    """Whether its stamps count on the host's clock, such as those of a bus adapter without one of its own."""
    return (
        len(device.host_s) > 0 and float(np.median(np.abs(device.track.time_s - device.host_s))) < limits.SHARED_CLOCK_S
    )


def _denied_s(device: StreamDevice, at: int) -> float:
    """How far the device's clock ran ahead of the host's there."""
    t, host = device.track.time_s, device.host_s
    span_s, host_span_s = float(np.ptp(t)), float(np.ptp(host))
    step_s, host_step_s = float(np.median(np.diff(t))), 0.0
    if host_span_s <= 0.0 or span_s <= 0.0:
        return 0.0
    before, after = slice(max(0, at - limits.PROMPT_AMONG), at), slice(at, at + limits.PROMPT_AMONG)
    # Pace from both sides, where no jump is: device seconds in one of the host.
    host_step_s = _pace(host[before], host[after])
    rate = step_s / host_step_s if host_step_s > 0.0 else span_s / host_span_s
    ahead = t - rate * host
    return float(np.max(ahead[after]) - np.max(ahead[before]))


def _pace(before: Floats, after: Floats) -> float:
    """Host seconds a sample, over stretches since stamps come in bursts."""
    each = [float(np.ptp(one)) / (len(one) - 1) for one in (before, after) if len(one) > 1]
    return float(np.mean(each)) if each else 0.0


@dataclass(frozen=True)
class Late:
    """Stamps of the other device less those of the joints, of one moment, beyond what the host's stamps show."""

    late_s: float
    sigma_s: float
    drift: float | None
    drift_sigma: float | None
    p: float

    @property
    def counts(self) -> bool:
        return abs(self.late_s) > max(limits.LATE_SIGMAS * self.sigma_s, limits.LATE_S) or self.drifts

    @property
    def drifts(self) -> bool:
        if self.drift is None or self.drift_sigma is None:
            return False
        return max(limits.LATE_SIGMAS * self.drift_sigma, limits.CLOCK_DRIFT) < abs(self.drift) < limits.OTHER_PACE


def lateness(joints: StreamDevice, other: StreamDevice, fit: ClockFit) -> Late | None:
    """None where clocks or stamps show nothing."""
    other = replace(other, host_s=other.track.time_s) if shares_host_clock(other) else other
    start = start_between(joints, other)
    if fit.offset_s is None or fit.offset_sigma_s is None or start is None:
        return None
    by_stamps_s = start.offset_s + start.rate_error * (fit.middle_s - start.at_s)
    sigma_s = float(np.hypot(fit.offset_sigma_s, np.hypot(stamps_scatter_s(joints), stamps_scatter_s(other))))
    late_s = by_stamps_s - fit.offset_s
    p = float(2.0 * ndtr(-abs(late_s) / max(sigma_s, 1e-12)))
    if fit.drift is not None and fit.drift_sigma is not None:
        p = min(p, float(2.0 * ndtr(-abs(fit.drift) / max(fit.drift_sigma, 1e-15))))
    return Late(late_s, sigma_s, fit.drift, fit.drift_sigma, p)
