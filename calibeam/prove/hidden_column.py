"""A column hidden: what the diagnosis infers of a cause it was not told, against the column that we kept.

A cause that is not recorded can only be met as something that changes with time; if the inferred course over time is
that of the hidden column, the diagnosis saw the cause through the arm.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from acquisition.recording import Samples
from calibrate.diagnose.schema import CurveRecord, DiagnosisFile

Floats = NDArray[np.float64]

FEWEST = 20  # points of a curve


@dataclass(frozen=True)
class HiddenColumn:
    """One inferred course over time against the hidden one."""

    column: str
    where: str
    physics: str
    correlation: float  # of the inferred course and the hidden column
    says: str


def against_hidden(file: DiagnosisFile, samples: Samples, column: str) -> tuple[HiddenColumn, ...]:
    """Every finding that depends on time; none where the diagnosis inferred nothing slow."""
    out: list[HiddenColumn] = []
    for finding in file.findings:
        curve = finding.curve
        if curve is None or "t" not in finding.depends_on.split(","):
            continue
        r = _correlation(curve, samples, column)
        if r is not None:
            out.append(HiddenColumn(column, finding.where, finding.physics, r, finding.says))
    return tuple(out)


def _correlation(curve: CurveRecord, samples: Samples, column: str) -> float | None:
    """None for a curve of a few points, or one that does not change."""
    pairs = [(t, y) for t, y in zip(curve.values, curve.fitted, strict=True) if t is not None and y is not None]
    if len(pairs) < FEWEST:
        return None
    t_s, course = np.array(pairs).T
    recorded_s, hidden = samples.column("t_s"), samples.column(column)
    good = np.isfinite(hidden)
    order = np.argsort(recorded_s[good], kind="stable")
    there = np.interp(t_s, recorded_s[good][order], hidden[good][order])
    if np.ptp(course) == 0.0 or np.ptp(there) == 0.0:
        return None
    return float(np.corrcoef(course, there)[0, 1])
