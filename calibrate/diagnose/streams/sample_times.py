"""When the samples of a recording were taken, on the clocks of its devices."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from acquisition.recording import Recording
from calibrate.diagnose.streams.recorded import Device
from calibrate.diagnose.streams.settling import Window

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

EVENT = "sample"  # one a sample, in their order, with `psd_from_s` and `psd_to_s`


@dataclass(frozen=True, eq=False)
class Around:
    """Where the fixture stood and which face came first, by the samples before and after a time."""

    time_s: Floats  # (sample,) rising
    placement: Ints
    first_psd: Ints

    def at(self, time_s: Floats) -> tuple[Ints, Ints]:
        """(row,) placement and first face; 0 where the sample before and the one after differ."""
        after = np.searchsorted(self.time_s, time_s)
        before, after = np.clip(after - 1, 0, None), np.clip(after, None, len(self.time_s) - 1)
        same = (self.placement[before] == self.placement[after]) & (self.first_psd[before] == self.first_psd[after])
        return np.where(same, self.placement[before], 0), np.where(same, self.first_psd[before], 0)


def sample_windows(recording: Recording) -> tuple[Window, ...] | None:
    """On the clock of the PSD box, one a sample; None where the recording does not state it."""
    told = [event.detail for event in recording.events if event.kind == EVENT]
    if not told or len(told) != len(recording.samples):
        return None
    try:
        return tuple(Window(float(one["psd_from_s"]), float(one["psd_to_s"])) for one in told)
    except (KeyError, TypeError, ValueError):
        return None


def by_host(time_s: Floats, own: Device, other: Device) -> Floats:
    """Times of `own` on the clock of `other`, by the host's stamps of both: good to what the lines delay."""
    host_s = np.interp(time_s, own.track.time_s, np.maximum.accumulate(own.host_s))
    return np.interp(host_s, np.maximum.accumulate(other.host_s), other.track.time_s)


def around(recording: Recording, windows: tuple[Window, ...] | None, spots: Device, joints: Device) -> Around | None:
    """On the clock of the joints; None where no sample states where the fixture stood.

    Without windows `t_s` counts from `host_s0`, as docs/formats.md has it.
    """
    samples = recording.samples
    if len(samples) == 0 or "placement" not in samples or "first_psd" not in samples:
        return None
    if windows is None:
        host_s = recording.host_s0 + samples.column("t_s")
        time_s = np.interp(host_s, np.maximum.accumulate(joints.host_s), joints.track.time_s)
    else:
        time_s = by_host(np.array([0.5 * (w.from_s + w.to_s) for w in windows]), spots, joints)
    order = np.argsort(time_s, kind="stable")
    placement, first = samples.integers("placement", 0), samples.integers("first_psd", 0)
    return Around(time_s[order], placement[order], first[order])
