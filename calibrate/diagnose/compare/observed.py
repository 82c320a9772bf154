"""Samples that hold what the simulation's own geometry says, plus what measured and simulated differ by.

For the diagnosis the simulated recording takes the model's place: whatever it already holds cancels, and what is left
over is what it lacks. Noise is that of two sessions. The geometry is fitted to the simulated readings, so that the
readings stay where the instruments see them.
"""

import numpy as np
from numpy.typing import NDArray

from acquisition.recording.columns import ORIENTATION
from acquisition.recording.rig_schema import Rig
from acquisition.recording.samples import Samples
from calibrate.diagnose.compare.chain import Difference, Pair, columns_of
from calibrate.diagnose.fitted import fit_geometry
from calibrate.diagnose.session import session_of

Floats = NDArray[np.float64]

INSTRUMENT = {"dual-psd": "spots", "position": "position", "wire": "wire"}  # of the fit -> link of the chain
DRIVERS = ("temp_", "payload", "qd", "cmd", "approach")  # of the measured table: the cause happened there


def difference_samples(rig: Rig, pair: Pair, links: tuple[Difference, ...]) -> Samples:
    """The simulated table with the readings replaced; orientations, seats and bars are left out.

    DataError where the simulated table holds nothing to fit.
    """
    left_out = {*ORIENTATION, "seat", "bar", "bar_end"}
    kept = Samples({n: v for n, v in pair[1].columns.items() if n not in left_out}, pair[1].n_joints)
    own = {link.link: link for link in links}
    fitted = fit_geometry(session_of(rig, kept))
    changed: dict[str, Floats] = {}
    for m, expected in zip(fitted.session.measured, fitted.around.expected, strict=True):
        if INSTRUMENT.get(m.name) not in own:
            continue
        link = own[INSTRUMENT[m.name]]
        rows = m.sample_rows[:, -1]
        readings = np.full(link.own.shape, np.nan)
        readings[rows] = expected + link.own[rows]
        changed |= dict(zip(link.names, readings.T, strict=True))
    return columns_of(_with_drivers(kept, pair[0]), changed)


def _with_drivers(simulated: Samples, measured: Samples) -> Samples:
    """Columns that only the measured table has (temperatures, payload) may be the cause of the difference."""
    measured_only = {n: v for n, v in measured.columns.items() if n not in simulated and n.startswith(DRIVERS)}
    return columns_of(simulated, measured_only)
