"""The centring runs of a session, from the events of its recording."""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from acquisition.recording import Event

Floats = NDArray[np.float64]

KIND = "centring"


@dataclass(frozen=True)
class Trace:
    """One run of the centring servo, from first look to last."""

    placement: int
    first_psd: int
    strategy: str
    status: str
    tolerance_m: float
    error_m: Floats  # (look,) largest of the four distances from the target; NaN where a face was dark
    probes: int  # of the steps, those that only measure

    @property
    def steps(self) -> int:
        """Motions after the first look."""
        return max(0, len(self.error_m) - 1)


@dataclass(frozen=True)
class Traces:
    """All runs of a session."""

    runs: tuple[Trace, ...]
    unreadable: int  # centring events that do not hold what a run is made of

    def by_tolerance(self) -> dict[float, tuple[Trace, ...]]:
        """Runs that wanted the same, the finest first."""
        wanted = sorted({run.tolerance_m for run in self.runs})
        return {tolerance: tuple(r for r in self.runs if r.tolerance_m == tolerance) for tolerance in wanted}


def traces_of(events: Iterable[Event]) -> Traces:
    """Never fails: what cannot be read is counted."""
    found = [_trace(event.detail) for event in events if event.kind == KIND]
    return Traces(tuple(t for t in found if t is not None), sum(t is None for t in found))


def _trace(detail: Mapping[str, Any]) -> Trace | None:
    try:
        spots = np.array(
            [[math.nan if v is None else float(v) for v in look] for look in detail["spots_m"]], dtype=np.float64
        ).reshape(-1, 4)
        target = np.array(detail["target_m"], dtype=np.float64).reshape(4)
        tolerance_m = float(detail["tolerance_m"])
        if not (np.all(np.isfinite(target)) and 0.0 < tolerance_m < math.inf):
            return None
        return Trace(
            int(detail["placement"]),
            int(detail["first_psd"]),
            str(detail["strategy"]),
            str(detail["status"]),
            tolerance_m,
            np.abs(spots - target).max(axis=1) if len(spots) else np.empty(0),
            sum(purpose == "probe" for purpose in detail["purpose"]),
        )
    except (KeyError, TypeError, ValueError):
        return None
