"""The picture of a finding: the residual without it, divided by how the readings feel its port, against its driver."""

import numpy as np

from calibrate.diagnose.bench import Bench
from calibrate.diagnose.diagnosis import Pulled
from calibrate.diagnose.linearised import Accepted
from calibrate.diagnose.picture_driver import picture_driver


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
