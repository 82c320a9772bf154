"""Samples that hold what the simulation's own geometry says, plus what measured and simulated differ by.

For the diagnosis the simulated recording takes the model's place: whatever it already holds cancels, and what is left
over is what it lacks. Noise is that of two sessions. The geometry is fitted to the simulated readings, so that the
readings stay where the instruments see them. Where the probe is seated, the joints are the reading: they are those that
were measured, less what the simulated ones miss the cone or the bar's length by.
"""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from acquisition.recording import Samples
from acquisition.recording.rig import Rig
from acquisition.recording.samples import ORIENTATION, POSITION, per_joint
from calibrate.diagnose.compare.chain import Difference, Pair, columns_of
from calibrate.diagnose.compare.seated import is_seated
from calibrate.diagnose.fitted import Fitted, fit_geometry
from calibrate.diagnose.session import session_of
from calibrate.sensors import full_pose, position, spots, wire
from calibrate.sensors.catalogue import names_with
from calibrate.sensors.kind import Trait

Floats = NDArray[np.float64]

LINK = {
    spots.KIND.name: "spots",
    position.KIND.name: position.KIND.name,
    full_pose.KIND.name: position.KIND.name,
    wire.KIND.name: wire.KIND.name,
}  # instrument -> link
SEATED = names_with(Trait.TOUCHED)
DRIVERS = ("temp_", "payload", "qd", "cmd", "approach")  # of the measured table: the cause happened there


def difference_samples(rig: Rig, pair: Pair, links: tuple[Difference, ...]) -> Samples:
    """The simulated table with the readings replaced. DataError where the simulated table holds nothing to fit."""
    fitted = fit_geometry(session_of(rig, pair[1]))
    added = {link.link: np.where(is_seated(pair[0])[:, None], link.raw, link.own) for link in links}
    changed: dict[str, Floats] = {}
    for i, m in enumerate(fitted.session.measured):
        if m.name in SEATED:
            changed |= _joints(pair, fitted, changed)
        elif LINK.get(m.name) in added:
            rows, expected = m.sample_rows[:, -1], fitted.around.expected[i]
            names = POSITION if m.name == full_pose.KIND.name else _names(links, LINK[m.name])
            readings = _so_far(changed, names, len(pair[0]))
            readings[rows] = expected[:, : len(names)] + added[LINK[m.name]][rows]
            changed |= dict(zip(names, readings.T, strict=True))
            if m.name == full_pose.KIND.name and "orientation" in added:
                turned = _turned(pair[1], rows, expected[:, 3:], added["orientation"][rows])
                vectors = _so_far(changed, ORIENTATION, len(pair[0]))
                vectors[rows] = turned
                changed |= dict(zip(ORIENTATION, vectors.T, strict=True))
    return columns_of(_with_drivers(pair[1], pair[0]), changed)


def _names(links: tuple[Difference, ...], link: str) -> tuple[str, ...]:
    return next(one.names for one in links if one.link == link)


def _so_far(changed: Mapping[str, Floats], names: tuple[str, ...], rows: int) -> Floats:
    """(row, channel) what another instrument has put there already: positions with and without an orientation."""
    return np.stack([changed.get(name, np.full(rows, np.nan)) for name in names], axis=1)


def _turned(simulated: Samples, rows: NDArray[np.intp], misfit_rad: Floats, added_rad: Floats) -> Floats:
    """(row, 3) rotation vectors of the expected orientations with the difference on top."""
    seen = np.stack([simulated.column(name)[rows] for name in ORIENTATION], axis=1)
    turns = (Rotation.from_rotvec(v) for v in (np.nan_to_num(added_rad), misfit_rad, seen))
    added, misfit, observed = turns
    return (added * misfit * observed).as_rotvec()


def _joints(pair: Pair, fitted: Fitted, changed: Mapping[str, Floats]) -> dict[str, Floats]:
    """Measured joints of seated rows, by the smallest turn without what the simulated ones miss their place by."""
    n, seated = pair[0].n_joints, is_seated(pair[0])
    names = per_joint("q", "_rad", n)
    if all(name in changed for name in names):
        return {}
    q_rad = np.where(seated[:, None], pair[0].joints(), pair[1].joints())
    for i, m in enumerate(fitted.session.measured):
        if m.name not in SEATED:
            continue
        missed = m.problem.observed - fitted.around.expected[i]
        by_joint = fitted.problem.by_joint(fitted.around, i)
        turn = np.einsum("rjk,rk->rj", np.linalg.pinv(by_joint), missed).reshape(len(missed), -1, n)
        for pose, rows in enumerate(m.sample_rows.T):
            q_rad[rows] += turn[:, pose]
    return dict(zip(names, q_rad.T, strict=True))


def _with_drivers(simulated: Samples, measured: Samples) -> Samples:
    """Columns that only the measured table has (temperatures, payload) may be the cause of the difference."""
    measured_only = {n: v for n, v in measured.columns.items() if n not in simulated and n.startswith(DRIVERS)}
    return columns_of(simulated, measured_only)
