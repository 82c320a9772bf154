"""A device's clock that was set while it ran: separated from missing samples by the host's stamps, and taken out."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from calibrate.diagnose.streams.continuity import Break, Fault
from calibrate.diagnose.streams.recorded import Device

Floats = NDArray[np.float64]

BESIDE = 50  # samples on either side, of which the promptest stamp counts
SHARED_S = 0.5  # between a stamp of the bus and the reader's: no epoch of a foreign clock is so near by chance
SHARE = 0.5  # of a jump that the host's stamps must deny


def judged(device: Device, faults: tuple[Break, ...]) -> tuple[tuple[Break, ...], Device]:
    """Jumps of time as what they are, and the device with its clock's steps taken out."""
    usual_s = device.track.period_s
    time_s, out = device.track.time_s.copy(), list[Break]()
    for one in faults:
        if one.fault not in (Fault.STEPPED, Fault.BACKWARDS):
            out.append(one)
            continue
        denied_s = _denied_s(device, one.last)
        if abs(denied_s - one.jump_s) < SHARE * abs(one.jump_s):
            time_s[one.last :] -= one.jump_s
            out.append(one)
        elif one.fault is Fault.BACKWARDS:
            out.append(one)
        elif not stamped_by_host(device):
            lost = round(one.jump_s / usual_s)
            out.append(replace(one, fault=Fault.MISSED, samples=lost, jump_s=0.0))
    return tuple(out), replace(device, track=replace(device.track, time_s=time_s))


def stamped_by_host(device: Device) -> bool:
    """Whether the device has no clock of its own, and carries the host's stamps for it."""
    apart = np.diff(device.track.time_s) - np.diff(device.host_s)
    return len(apart) > 0 and float(np.max(np.abs(apart))) < 1e-6


def shares_host_clock(device: Device) -> bool:
    """Whether its stamps count on the host's clock, such as those of a bus adapter without one of its own."""
    return len(device.host_s) > 0 and float(np.median(np.abs(device.track.time_s - device.host_s))) < SHARED_S


def _denied_s(device: Device, at: int) -> float:
    """How far the device's clock ran ahead of the host's there."""
    t, host = device.track.time_s, device.host_s
    span_s, host_span_s = float(np.ptp(t)), float(np.ptp(host))
    step_s, host_step_s = float(np.median(np.diff(t))), 0.0
    if host_span_s <= 0.0 or span_s <= 0.0:
        return 0.0
    before, after = slice(max(0, at - BESIDE), at), slice(at, at + BESIDE)
    # Pace from both sides, where no jump is: device seconds in one of the host.
    host_step_s = _pace(host[before], host[after])
    rate = step_s / host_step_s if host_step_s > 0.0 else span_s / host_span_s
    ahead = t - rate * host
    return float(np.max(ahead[after]) - np.max(ahead[before]))


def _pace(before: Floats, after: Floats) -> float:
    """Host seconds a sample, over stretches since stamps come in bursts."""
    each = [float(np.ptp(one)) / (len(one) - 1) for one in (before, after) if len(one) > 1]
    return float(np.mean(each)) if each else 0.0
