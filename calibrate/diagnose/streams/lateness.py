"""Whether two clocks are farther apart than their devices' stamps at the host show: readings that come late.

Where two devices count from is nobody's fault, so an offset is judged against the one that the host's stamps show, with
their own scatter and what lines delay, which no stamp shows. A device without a clock carries the host's: then its own
stamps are those. A quartz is off by some 100 us/s at worst; what drifts more is a fault of its clock.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.stats import norm

from calibrate.diagnose.streams.clock import ClockFit
from calibrate.diagnose.streams.clock_steps import shares_host_clock
from calibrate.diagnose.streams.recorded import Device, stamps_scatter_s, start_between

SIGMAS = 5.0
# What two lines may delay differently: a USB frame 1 ms, a SYNC and the answers of six encoders at 1 Mbit/s 0.8 ms.
MATTERS_S = 1.2e-3
QUARTZ = 1e-4  # s/s
OTHER_PACE = 1e-2  # s/s: no clock drifts so; an emulation runs faster than its host


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
        return abs(self.late_s) > max(SIGMAS * self.sigma_s, MATTERS_S) or self.drifts

    @property
    def drifts(self) -> bool:
        if self.drift is None or self.drift_sigma is None:
            return False
        return max(SIGMAS * self.drift_sigma, QUARTZ) < abs(self.drift) < OTHER_PACE


def lateness(joints: Device, other: Device, fit: ClockFit) -> Late | None:
    """None where clocks or stamps show nothing."""
    other = replace(other, host_s=other.track.time_s) if shares_host_clock(other) else other
    start = start_between(joints, other)
    if fit.offset_s is None or fit.offset_sigma_s is None or start is None:
        return None
    by_stamps_s = start.offset_s + start.rate_error * (fit.middle_s - start.at_s)
    sigma_s = float(np.hypot(fit.offset_sigma_s, np.hypot(stamps_scatter_s(joints), stamps_scatter_s(other))))
    late_s = by_stamps_s - fit.offset_s
    p = float(2.0 * norm.sf(abs(late_s) / max(sigma_s, 1e-12)))
    if fit.drift is not None and fit.drift_sigma is not None:
        p = min(p, float(2.0 * norm.sf(abs(fit.drift) / max(fit.drift_sigma, 1e-15))))
    return Late(late_s, sigma_s, fit.drift, fit.drift_sigma, p)
