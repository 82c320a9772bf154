"""The measured readings without what the simulation's own readings miss its fitted geometry by.

Whatever the simulation already holds, named or not, cancels: what is left of the measured readings beside the
simulation's geometry is what the two differ by. Its noise is that of both. The measured joints stay, so a servo that
stopped elsewhere, or another zero of degrees, is no difference of readings. Where the probe is seated the joints are
the reading: they turn by what the simulated ones miss the cone, or the bar's length, by.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from msgspec import structs
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from acquisition.recording import Samples
from acquisition.recording.rig import Rig
from acquisition.recording.samples import ORIENTATION, POSITION, SPOTS, per_joint
from calibrate.compare.chain import Pair, columns_of
from calibrate.compare.matched import is_seated
from calibrate.diagnose.state import EffectProblem, Fitted, Session, noise_of, session_of
from calibrate.errors import DataError
from calibrate.fit.identify.session import about_of, assumed_sigma
from calibrate.fit.solvers import NEAR_START, solve
from calibrate.model.predict import Predictor
from calibrate.model.sensors import (
    encoder_difference,
    full_pose,
    position,
    spots,
    wire,
)
from calibrate.model.sensors.catalogue import kind_of, names_with
from calibrate.model.sensors.kind import Trait

Floats = NDArray[np.float64]
Ints = NDArray[np.intp]

SEATED = names_with(Trait.TOUCHED)
COLUMNS = {
    spots.KIND.name: SPOTS,
    position.KIND.name: POSITION,
    full_pose.KIND.name: POSITION,
    wire.KIND.name: wire.KIND.columns,
}  # instrument -> columns of the samples that it reads
IN_SPACE = (position.KIND.name, full_pose.KIND.name)


@dataclass(frozen=True, eq=False)
class Simulated:
    """The simulation as one fitted geometry: what its own readings are, but for what no geometry gives."""

    fitted: Fitted

    @property
    def rig(self) -> Rig:
        return self.fitted.session.rig

    @property
    def model(self) -> Predictor:
        """What it expects anywhere."""
        return predictor_of(self.fitted.session, self.fitted.geometry)

    @property
    def uncorrected(self) -> tuple[str, ...]:
        """Instruments whose readings `corrected_samples` leaves as they are."""
        taken = {*COLUMNS, *SEATED, encoder_difference.NAME}
        return tuple(m.name for m in self.fitted.session.measured if m.name not in taken)

    @property
    def values(self) -> Mapping[str, float]:
        """Parameter -> correction."""
        session = self.fitted.session
        return {p.name: float(v) for p, v in zip(session.parameters, self.fitted.geometry, strict=True)}


def of_both(rig: Rig) -> Rig:
    """The rig with the noise that a difference of two such sessions has; the joints are those of one of them.

    A simulation without noise has less: what is stated is an upper limit.
    """
    read = {name: getattr(rig.noise, name) for name in ("psd_m", "position_m", "wire_m")}
    return structs.replace(rig, noise=structs.replace(rig.noise, **{k: v * np.sqrt(2.0) for k, v in read.items() if v}))


def simulated_of(rig: Rig, samples: Samples) -> Simulated:
    """DataError where the table holds no reading to fit.

    Weighed by the noise that the rig states, whatever the readings scatter: those of a simulation may be exact, and
    a fit that takes them at that word follows the last digit along directions that nobody sees.
    """
    session = compared_session(rig, samples)
    rows = tuple(np.arange(m.problem.rows) for m in session.measured)
    whiteners = tuple(_diagonal(1.0 / assumed_sigma(m)) for m in session.measured)
    problem = EffectProblem(session, session.chain(), rows, whiteners)
    fit = solve(problem, start=session.start, damping=NEAR_START)
    noise = noise_of(problem, fit)
    return Simulated(Fitted(session, np.arange(len(samples)), problem, fit.theta, noise, fit.covariance))


def compared_session(rig: Rig, samples: Samples) -> Session:
    """Readings alone: a length that the rig states between stations was measured of the real ones, not simulated."""
    return without_known(session_of(rig, samples))


def without_known(session: Session) -> Session:
    """The session without lengths that the rig states."""
    return replace(session, weighting=replace(session.weighting, known=()))


def _diagonal(values: Floats) -> Floats:
    """(row, k, k)"""
    return values[:, :, None] * np.eye(values.shape[1])


def predictor_of(session: Session, values: Floats) -> Predictor:
    """`values` (param,) of the session's parameters."""
    named = {p.name: float(v) for p, v in zip(session.parameters, values, strict=True)}
    return Predictor(session.rig, named, about_of(session.weighting), tuple(m.name for m in session.measured))


def corrected_samples(simulated: Simulated, pair: Pair, T_simulated_measured: Floats) -> Samples:
    """The measured table; readings that the simulated one lacks are emptied, for there is nothing to compare them to.

    `T_simulated_measured` (4, 4): the measuring device of the measured recording in that of the simulated one.
    """
    measured, fitted = pair[0], simulated.fitted
    turned = T_simulated_measured[:3, :3].T  # a vector in the simulated device's axes, in the measured one's
    changed: dict[str, Floats] = {}
    for i, m in enumerate(fitted.session.measured):
        rows = m.sample_rows[:, -1]
        missed = m.problem.observed - fitted.around.expected[i]
        if m.name in SEATED:
            changed |= _turned_joints(pair, fitted, changed)
        elif m.name == encoder_difference.NAME:
            changed |= _encoders(measured, m.problem.chain.sensor.own_columns(), rows, missed)
        elif m.name in COLUMNS and all(name in measured for name in COLUMNS[m.name]):
            names = COLUMNS[m.name]
            shift = missed[:, :3] @ turned.T if m.name in IN_SPACE else missed
            readings = _so_far(changed, names, len(measured))
            readings[rows] = _stacked(measured, names)[rows] - shift
            changed |= dict(zip(names, readings.T, strict=True))
            if m.name == full_pose.KIND.name and all(name in measured for name in ORIENTATION):
                vectors = _so_far(changed, ORIENTATION, len(measured))
                vectors[rows] = _without_turn(_stacked(measured, ORIENTATION)[rows], missed[:, 3:] @ turned.T)
                changed |= dict(zip(ORIENTATION, vectors.T, strict=True))
    _refuse_nothing(changed, simulated)
    return columns_of(measured, changed)


def _refuse_nothing(changed: Mapping[str, Floats], simulated: Simulated) -> None:
    if not any(np.any(np.isfinite(values)) for values in changed.values()):
        listed = ", ".join(kind_of(m.name).noun for m in simulated.fitted.session.measured)
        raise DataError(f"no reading is in both recordings; the simulated one holds {listed}")


def _so_far(changed: Mapping[str, Floats], names: tuple[str, ...], rows: int) -> Floats:
    """(row, channel) what another instrument has put there already: positions with and without an orientation."""
    return np.stack([changed.get(name, np.full(rows, np.nan)) for name in names], axis=1)


def _stacked(samples: Samples, names: tuple[str, ...]) -> Floats:
    return np.stack([samples.column(name) for name in names], axis=1)


def _without_turn(seen_rad: Floats, missed_rad: Floats) -> Floats:
    """(row, 3) rotation vectors; of an orientation the fit expects the turn that leads from the one seen to it."""
    out = seen_rad.copy()
    good = np.all(np.isfinite(seen_rad), axis=1)
    out[good] = (Rotation.from_rotvec(-missed_rad[good]) * Rotation.from_rotvec(seen_rad[good])).as_rotvec()
    return out


def _encoders(measured: Samples, names: tuple[str, ...], rows: Ints, missed_rad: Floats) -> dict[str, Floats]:
    """Second encoders by the sense in which each counts in the measured recording; its zero stays."""
    found = encoder_difference.differences(measured)
    every = per_joint("enc", "_rad", measured.n_joints)
    if found is None:
        return {}
    out: dict[str, Floats] = {}
    for channel, name in enumerate(names):
        if name in measured and (sense := found.sense[every.index(name)]):
            values = np.full(len(measured), np.nan)
            values[rows] = measured.column(name)[rows] - sense * missed_rad[:, channel]
            out[name] = values
    return out


def _turned_joints(pair: Pair, fitted: Fitted, changed: Mapping[str, Floats]) -> dict[str, Floats]:
    """Measured joints of seated rows, by the smallest turn without what the simulated ones miss their place by."""
    n = pair[0].n_joints
    names = per_joint("q", "_rad", n)
    if all(name in changed for name in names):
        return {}
    q_rad, seated = pair[0].joints().copy(), is_seated(pair[0])
    for i, m in enumerate(fitted.session.measured):
        if m.name not in SEATED:
            continue
        missed = m.problem.observed - fitted.around.expected[i]
        by_joint = fitted.problem.chain.by_joint(fitted.around, i)
        turn = np.einsum("rjk,rk->rj", np.linalg.pinv(by_joint), missed).reshape(len(missed), -1, n)
        for pose, rows in enumerate(m.sample_rows.T):
            q_rad[rows] += np.where(seated[rows, None], turn[:, pose], 0.0)
    return dict(zip(names, q_rad.T, strict=True))
