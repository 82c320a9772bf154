"""How good the samples of a session are so far: spots, settling, how much of the joints' ranges they have been at."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from acquisition.guided.coverage import Coverage
from acquisition.sample import Sample

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Quality:
    """For the eye; a session decides nothing by it."""

    samples: int
    unsettled: int
    settle_s: float | None  # of the last sample
    usual_settle_s: float | None  # median of all
    spots_m: Floats  # (4,) of the last sample
    sums_v: tuple[float, float]  # light on both faces
    spans_rad: Floats  # (joint,) widest way between two samples
    marks: tuple[str, ...]  # a joint's range step by step: acquisition/guided/coverage.py


class Keeper:
    """Counts; owned by one session."""

    def __init__(self, lower_rad: Floats, upper_rad: Floats) -> None:
        self._coverage = Coverage(lower_rad, upper_rad)
        self._settle_s: list[float] = []
        self._q_rad: list[Floats] = []
        self._unsettled = 0

    def add(self, sample: Sample) -> Quality:
        """One more sample; how things stand with it."""
        look = sample.look
        self._coverage.add(look.q_rad)
        self._q_rad.append(look.q_rad)
        self._unsettled += not look.settled
        if look.settle_s is not None:
            self._settle_s.append(look.settle_s)
        return Quality(
            len(self._q_rad),
            self._unsettled,
            look.settle_s,
            float(np.median(self._settle_s)) if self._settle_s else None,
            look.spots_m(),
            (look.psd1.sum_v, look.psd2.sum_v),
            np.ptp(np.array(self._q_rad), axis=0),
            tuple(self._coverage.marks(joint) for joint in range(len(look.q_rad))),
        )
