"""The picture of a finding: the residual without it, divided by how the readings feel its port, against its driver.

The driver of a finding as numbers for the axis of its picture, also where it is computed and not recorded.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from calibrate.diagnose.assess.diagnosis import Pulled
from calibrate.diagnose.search.bench import Bench
from calibrate.model.effects.curve import cause
from calibrate.model.effects.drivers import Drivers
from calibrate.model.effects.gravity import likely_torque_nm, overturning_nm
from calibrate.model.effects.term import Accepted

Floats = NDArray[np.float64]


def pulled_back(bench: Bench, a: Accepted) -> Pulled:
    """Along the component of the port where the finding is largest."""
    drivers, rows = bench.state.drivers, bench.state.rows
    driver, values = picture_driver(drivers, a.term.depends_on)
    amount = a.term.amount(drivers, a.coefficients, a.inner)
    component = int(np.argmax(np.mean(amount**2, axis=0)))
    along = amount[:, component]
    # Rows felt per unit of the amount: the contribution itself over its amount, where there is any.
    felt = bench.contribution(a)
    sample = rows.sample[rows.data]
    strength = np.bincount(sample, felt[rows.data] ** 2, len(along))
    met = np.bincount(sample, felt[rows.data] * (rows.residual + felt)[rows.data], len(along))
    share = np.full(len(along), np.nan)
    np.divide(met, strength, out=share, where=strength > 1e-6 * max(float(strength.max()), 1e-300))
    return Pulled(driver, values, share * along, along)


def picture_driver(drivers: Drivers, names: Sequence[str]) -> tuple[str, Floats]:
    """(name, (pose,)) of the first driver that can be drawn; the order of the samples where none can."""
    for name in names:
        values = _computed(drivers, name)
        if values is not None and np.ptp(values[np.isfinite(values)]) > 0.0:
            return name, values
    return "sample", np.arange(1.0, len(drivers.t_s) + 1.0)


def _computed(drivers: Drivers, name: str) -> Floats | None:
    stem = name.rstrip("0123456789")
    number = int(name[len(stem) :] or 0)
    match stem:
        case "gravity_torque":
            return likely_torque_nm(drivers, number)
        case "overturning_moment":
            return np.linalg.norm(overturning_nm(drivers)[:, :2], axis=1)
        case "approach":
            return None if drivers.approach is None else drivers.approach[:, number - 1]
        case "spot" | "incidence" | "reading" | "first_psd":
            return _of_readout(drivers, stem, number)
        case _:
            return _recorded(drivers, name)


def _recorded(drivers: Drivers, name: str) -> Floats | None:
    """As it stands in the session, however few its levels; None where it does not."""
    try:
        values = cause(drivers, name)
    except KeyError:
        return None
    return values if np.issubdtype(values.dtype, np.number) and np.any(np.isfinite(values)) else None


def _of_readout(drivers: Drivers, stem: str, number: int) -> Floats | None:
    """Of the first instrument that has it."""
    for readout in drivers.readouts.values():
        if stem == "spot" and readout.predicted.shape[1] == 4:
            return np.hypot(*readout.predicted[:, 2 * number - 2 : 2 * number].T)
        if stem == "incidence" and readout.incidence_rad is not None:
            return readout.incidence_rad[:, number - 1]
        if stem == "first_psd" and readout.first_psd is not None:
            return readout.first_psd.astype(np.float64)
        if stem == "reading":
            return np.linalg.norm(readout.predicted, axis=1)
    return None
