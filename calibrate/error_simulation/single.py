"""Each error alone against the error of the probe: the study of Huang Kui et al., over the whole workspace.

Every source takes values between plus and minus three of its sizes, all others none; the probe's error comes from the
arm itself, not from a derivative. A phased source (eccentricity, runout) is taken over all its phases.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from calibrate.error_simulation.columns import arm_at, columns_of, probe_errors
from calibrate.error_simulation.machine import Machine
from calibrate.error_simulation.source import Source

Floats = NDArray[np.float64]

STEPS = 25  # values, an odd number: zero is one of them
SPAN = 3.0  # sizes to both sides
PHASES = 16


@dataclass(frozen=True)
class Single:
    """One source alone."""

    name: str
    group: str
    unit: str
    value: Floats  # (step,) in its unit
    rms_m: Floats  # (step,) error of the probe over the poses
    max_m: Floats  # (step,) at the worst of them
    gain: float  # rms error of the probe by a unit of the source, at no error: m/m, m/rad, m/K


def alone(machine: Machine, source: Source, q_rad: Floats) -> Single:
    """Over readings (pose, joint)."""
    columns = columns_of([source])
    arm = arm_at(machine, [source], columns, q_rad)
    size = np.sqrt(source.law.square)
    value = np.linspace(-SPAN * size, SPAN * size, STEPS)
    own, other = columns.of_source[0].tolist()
    turns = np.arange(PHASES) * (2.0 * np.pi / PHASES) if other >= 0 else np.zeros(1)
    X = np.zeros((STEPS, len(turns), columns.count))
    X[..., own] = value[:, None] * np.cos(turns)
    if other >= 0:
        X[..., other] = value[:, None] * np.sin(turns)
    nominal, square = arm.nominal_m(), np.zeros((len(q_rad), STEPS, len(turns)))
    for pose in range(len(q_rad)):
        errors = probe_errors(arm, pose, X.reshape(-1, columns.count), nominal[pose])
        square[pose] = np.sum(errors**2, axis=1).reshape(STEPS, -1)
    rms, largest = np.sqrt(square.mean(axis=(0, 2))), np.sqrt(square.max(axis=(0, 2)))
    by = source.by_column(machine.by_slot(q_rad), q_rad)
    gain = float(np.sqrt(np.mean(np.sum(by**2, axis=(1, 2)) / by.shape[2])))
    return Single(source.name, source.group, source.unit, value, rms, largest, gain)


def each_alone(machine: Machine, sources: Sequence[Source], q_rad: Floats) -> tuple[Single, ...]:
    """In the order of the sources."""
    return tuple(alone(machine, source, q_rad) for source in sources)
