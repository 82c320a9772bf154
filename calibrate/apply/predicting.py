"""Expected readings of the instruments with the physics of a model, and their uncertainty.

One sigma of a prediction is that of the covariance of geometry, frames and effects together, mapped through the
readings, and of the conditions that a row lacks; the instrument's own noise is apart.

The robot's own base frame is the one that lies best on the arm itself, wherever in the world the arm stands. A device
of unknown place does not show where the base is, nor a first joint how the base is turned beside its zero. As in the
predicted error over the workspace (fit/accuracy.py) such a motion of everything is no error of the arm.

Readings of a model's own recording less what its effects add are what a fit of geometry alone needs.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import msgspec
import numpy as np
from msgspec import structs
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from acquisition.recording import Samples
from calibrate.fit.weighting import Weighting
from calibrate.model.effects.ports import Perturbation, Port
from calibrate.model.model_file import ModelFile, not_as_fitted
from calibrate.model.predict import (
    Columns,
    Predictor,
    less_cones,
    readings,
    residuals,
)
from calibrate.model.rigid import cross_matrix, inverse, transform
from calibrate.model.sensors.catalogue import kind_of
from calibrate.model.with_effects.acting import (
    Acting,
    frames_under,
    moved_columns,
)
from calibrate.model.with_effects.applied import Applied, effects_at
from calibrate.model.with_effects.chain import Chain, twists_by_arm
from calibrate.model.with_effects.ported_chain import offsets

Floats = NDArray[np.float64]
Ints = NDArray[np.intp]

POSTURES = 500  # the motion that lies best settles to about 2 %
XYZ = ("x_m", "y_m", "z_m")
SEED = 1  # of the postures: the same model always has the same frame


@dataclass(frozen=True, eq=False)
class OwnFrame:
    """Of a model at its values: the tip at postures drawn evenly within the limits of the joints."""

    known: Predictor
    q_rad: Floats  # (posture, joint)
    tip_m: Floats  # (posture, 3)
    twist: Floats  # (6, 3 posture) motion that lies best on displacements of the tip
    T_base_flange: Floats  # (posture, 4, 4)

    @classmethod
    def of(cls, predictor: Predictor) -> "OwnFrame":
        joints = predictor.rig.arm.joints
        low, high = np.array([j.lower_rad for j in joints]), np.array([j.upper_rad for j in joints])
        q_rad = np.random.default_rng(SEED).uniform(low, high, (POSTURES, len(joints)))
        flange = predictor.flange(q_rad)
        tip_m = predictor.measured_at(flange)
        rigid = np.concatenate([np.tile(np.eye(3), (POSTURES, 1, 1)), -cross_matrix(tip_m)], axis=2)
        pinv = np.asarray(np.linalg.pinv(rigid.reshape(-1, 6)), dtype=np.float64)
        return cls(predictor, q_rad, tip_m, pinv, flange)

    def back(self, other: Predictor) -> Floats:
        """(4, 4) that brings the arm at values near the known ones best onto the known one, to first order."""
        if other is self.known:
            return np.eye(4)
        v = self.twist @ (other.measured_at(other.flange(self.q_rad)) - self.tip_m).ravel()
        return transform(-v[:3], -v[3:])

    def flange_back(self, other: Predictor, back: Floats) -> Floats:
        """(4, 4) in the flange that brings it best onto the known one, behind `back` of the same values.

        A target does not show where the flange is that it is mounted on, nor a last joint how it is turned beside its
        zero: such a constant motion is no error of the arm, either.
        """
        if other is self.known:
            return np.eye(4)
        return mean_motion(back @ other.flange(self.q_rad), self.T_base_flange)


def mean_motion(T_from: Floats, T_to: Floats) -> Floats:
    """(4, 4) C with T_from C nearest to T_to (pose, 4, 4): the mean turn, and the mean shift seen from the first frame.

    Source of the mean turn: M. Moakher, Means and averaging in the group of rotations, SIAM J. Matrix Anal. Appl. 24
    (2002) 1: the orthogonal matrix nearest to the sum.
    """
    between = inverse(T_from) @ T_to
    out = np.eye(4)
    out[:3, :3] = Rotation.from_matrix(between[:, :3, :3]).mean().as_matrix()
    out[:3, 3] = between[:, :3, 3].mean(axis=0)
    return out


At = Callable[[Predictor, Perturbation], Columns]

PLACED = ("x", "y", "z", "about_x", "about_y", "about_z", "tip_x", "tip_y", "tip_z")
STEP = 1e-6  # m, rad or a factor: readings are linear over it, and 1e-10 of a derivative is lost to rounding


@dataclass(frozen=True, eq=False)
class Predicted:
    """`columns` (row,) as in predicted.csv; `outside` names of drivers of each row; `notes` sentences for a person."""

    columns: Columns
    outside: tuple[str, ...]
    notes: tuple[str, ...]


def predict_with_physics(model: ModelFile, samples: Samples, same_session: bool = False) -> Predicted:
    """`same_session`: the rows are of the recording that the effects were found in, whose clock they share.

    DataError for a model without its rig, and for rows at which an effect of the model cannot be evaluated.
    """
    predictor = Predictor.of(model)
    applied = effects_at(model, predictor, samples, same_session)
    notes = (*applied.notes, *_of_left(model))
    return Predicted(_with_sigma(model, predictor, samples, applied), applied.outside, notes)


def left_m(model: ModelFile) -> float:
    """Of a coordinate, what rows that the fit has not seen show beyond its sigma."""
    return model.left_m or 0.0


def _of_left(model: ModelFile) -> tuple[str, ...]:
    if left_m(model) == 0.0:
        return ()
    return (
        f"rows that the fit had not seen are missed by {1e6 * left_m(model):.2g} µm a coordinate beyond noise and its "
        "own uncertainty; every sigma of a position contains it",
    )


def as_fitted(model: ModelFile, samples: Samples, misfits: Sequence[tuple[str, Ints, Floats]]) -> ModelFile:
    """The model, with an alarm for each instrument that its file does not predict in its own session as the fit does.

    `misfits` of each instrument: its name, rows of `samples` (reading,) and what the fit leaves there (reading, k).
    """
    file = msgspec.json.decode(msgspec.json.encode(structs.replace(model, covariance=None)), type=ModelFile)
    columns, alarms = predict_with_physics(file, samples, same_session=True).columns, list[str]()
    for name, rows, misfit in misfits:
        reads = kind_of(name).reads
        read = [columns[f"r_{c}"][rows] for c in reads if f"r_{c}" in columns]
        if len(read) != misfit.shape[1]:
            continue  # such readings have no columns in a prediction
        part = kind_of(name).quantities[0].part  # a turn is no difference of columns
        alarms.append(not_as_fitted(name, _rms(misfit[:, part]), _rms(np.stack(read, axis=1)[:, part])))
    return structs.replace(model, alarms=(*model.alarms, *filter(None, alarms))) if any(alarms) else model


def _rms(values: Floats) -> float:
    return float(np.sqrt(np.mean(values**2)))


def _with_sigma(model: ModelFile, predictor: Predictor, samples: Samples, applied: Applied) -> Columns:
    """t_s, predicted columns, `s_...`, `r_...`."""
    flange = _flange(predictor, applied, samples.joints())

    def reading(predictor: Predictor, by: Perturbation) -> Columns:
        frames = flange(predictor, by)
        read, moved = readings(predictor, frames, samples), moved_columns(by)
        return {c: v + moved[c] if c in moved else v for c, v in read.items()}

    def at(predictor: Predictor, by: Perturbation) -> Columns:
        """A tip in a cone that the model knows is read from the cone: where both stand in the base, nobody sees."""
        read = reading(predictor, by)
        return less_cones(predictor, read, samples)

    by = applied.by
    read = reading(predictor, by)
    variance = _variance(model, predictor, applied, at, tuple(read))
    left = {c: left_m(model) ** 2 for c in XYZ}
    sigma = {
        f"s_{c}": np.where(np.isfinite(read[c]), np.sqrt(np.maximum(v, 0.0) + left.get(c, 0.0)), np.nan)
        for c, v in variance.items()
    }
    return {"t_s": samples.column("t_s")} | read | sigma | residuals(predictor, read, samples)


def _flange(predictor: Predictor, applied: Applied, q_rad: Floats) -> Callable[[Predictor, Perturbation], Floats]:
    """(row, 4, 4) of the flange at any perturbation, and at values so near that it moves by the chain's derivative."""
    arm, at_shafts = predictor.arm, predictor.at_shafts(q_rad)
    theta, frames = predictor.values_of(arm.parameters), frames_under(predictor, q_rad, applied.by)
    twists = twists_by_arm(arm, theta, at_shafts, applied.by, frames)

    def at(other: Predictor, by: Perturbation) -> Floats:
        if by is applied.by and np.array_equal(other.at_shafts(q_rad), at_shafts):
            return offsets(twists @ (other.values_of(arm.parameters) - theta)) @ frames[:, -1]
        return frames_under(other, q_rad, by)[:, -1]

    return at


def _variance(
    model: ModelFile, predictor: Predictor, applied: Applied, at: At, columns: tuple[str, ...]
) -> dict[str, Floats]:
    """Column -> (row,) by the covariance of the model, and by conditions that are missing or beyond their range."""
    out = _of_values(model, predictor, applied.found, applied.by, at, columns)
    for port, amount in applied.uncertain:
        for c, felt in _felt(at, predictor, applied.by, port, amount).items():
            out[c] = out[c] + felt**2
    return out


def _of_values(
    model: ModelFile, predictor: Predictor, found: Sequence[Acting], by: Perturbation, at: At, columns: tuple[str, ...]
) -> dict[str, Floats]:
    """Column -> (row,) variance by the covariance of the model; NaN where the model has none."""
    rows = len(by.joints_rad)
    if model.covariance is None:
        return {c: np.full(rows, np.nan) for c in columns}
    own = {name: (one.port, one.by_value[..., j]) for one in found for j, name in enumerate(one.names)}
    slopes: list[Columns] = []
    for name in model.covariance.names:
        if name in own:
            port, basis = own[name]
            slopes.append(_felt(at, predictor, by, port, basis))
        else:
            start = predictor.values.get(name, 0.0)
            moved = [{**predictor.values, name: start + s * STEP} for s in (1.0, -1.0)]
            up, down = (at(replace(predictor, values=values), by) for values in moved)
            slopes.append({c: (up[c] - down[c]) / (2.0 * STEP) for c in columns})
    C = np.array(model.covariance.rows, dtype=np.float64)
    out: dict[str, Floats] = {}
    for c in columns:
        J = np.nan_to_num(np.stack([slope[c] for slope in slopes], axis=1)) if slopes else np.zeros((rows, 0))
        out[c] = np.einsum("ni,ij,nj->n", J, C, J) if slopes else np.zeros(rows)
    return out


def _felt(at: At, predictor: Predictor, by: Perturbation, port: Port, amount: Floats) -> Columns:
    """Column -> (row,) change of the reading by what is added at a port (row, width), to first order."""
    largest = float(np.max(np.abs(amount), initial=0.0))
    if largest == 0.0:
        return {c: np.zeros(len(amount)) for c in at(predictor, by)}
    scale = STEP / largest
    up, down = (at(predictor, by.plus(port, s * scale * amount)) for s in (1.0, -1.0))
    return {c: (up[c] - down[c]) / (2.0 * scale) for c in up}


@dataclass(frozen=True, eq=False)
class Placed:
    """Where the arm holds flange and tip in its base, each row with one sigma; `outside`, `notes` as in `Predicted`.

    Sigmas are of the robot's own frame (`OwnFrame`) or of the world, as asked.
    """

    T_base_flange: Floats  # (row, 4, 4)
    flange_sigma: Floats  # (row, 6) m along x, y, z of the base, rad about them; NaN without a covariance
    tip_m: Floats  # (row, 3)
    tip_sigma_m: Floats  # (row, 3)
    outside: tuple[str, ...]
    notes: tuple[str, ...]


def flange_with_physics(model: ModelFile, samples: Samples) -> tuple[Floats, Applied]:
    """(row, 4, 4) with the effects of the model beyond their session, and what these are there, without what is unknown
    of them. DataError as above.
    """
    predictor = Predictor.of(model)
    applied = effects_at(model, predictor, samples, same_session=False, with_open=False)
    return _flange(predictor, applied, samples.joints())(predictor, applied.by), applied


def placed(
    model: ModelFile,
    samples: Samples,
    same_session: bool = False,
    *,
    in_world: bool = False,
    point_m: Floats | None = None,
    own_flange: bool = False,
) -> Placed:
    """Flange and tip with the effects of the model, at joints and conditions of samples. DataError as above.

    `in_world`: sigmas contain how far it is known where the base stands. `point_m` (3,): a point of the flange in place
    of the model's tip; `own_flange`: sigmas of flange and point do not contain where the target is mounted on it.
    """
    predictor = Predictor.of(model)
    own = None if in_world else OwnFrame.of(predictor)
    applied = effects_at(model, predictor, samples, same_session)
    flange = _flange(predictor, applied, samples.joints())
    T = flange(predictor, applied.by)

    def tip_at(predictor: Predictor, T: Floats) -> Floats:
        return predictor.tip_at(T) if point_m is None else T[:, :3, :3] @ point_m + T[:, :3, 3]

    def at(predictor: Predictor, by: Perturbation) -> Columns:
        back = np.eye(4) if own is None else own.back(predictor)
        now = back @ flange(predictor, by)
        mounted = now @ own.flange_back(predictor, back) if own is not None and own_flange else now
        turn = Rotation.from_matrix(mounted[:, :3, :3] @ np.swapaxes(T[:, :3, :3], 1, 2)).as_rotvec()
        tip_m = tip_at(predictor, now if point_m is None else mounted)
        table = np.concatenate([mounted[:, :3, 3], turn, tip_m], axis=1)
        return dict(zip(PLACED, table.T, strict=True))

    variance = _variance(model, predictor, applied, at, PLACED)
    sigma = np.sqrt(np.maximum(np.stack([variance[c] for c in PLACED], axis=1), 0.0))
    sigma[:, [0, 1, 2, 6, 7, 8]] = np.hypot(sigma[:, [0, 1, 2, 6, 7, 8]], left_m(model))
    notes = (*applied.notes, *_of_left(model))
    return Placed(T, sigma[:, :6], tip_at(predictor, T), sigma[:, 6:], applied.outside, notes)


def without_effects(weighting: Weighting, theta: Floats, samples: Samples, model: ModelFile) -> Weighting:
    """The same instruments at the values (param,) of a model, readings less what its effects add to them.

    `samples` are those of the recording that the model was made of. DataError where an effect cannot be evaluated.
    """
    if not model.effects:
        return weighting
    predictor = Predictor.of(model)
    by, q = effects_at(model, predictor, samples, same_session=True, with_open=False).by, samples.joints()
    unknowns, nothing = weighting.unweighted.unknowns, Perturbation.none(len(samples), samples.n_joints)
    chain = Chain(predictor.arm, predictor.at_shafts(q), weighting.measured, unknowns)
    plain, moved = (chain.under(theta, one).expected for one in (nothing, by))
    return replace(
        weighting,
        measured=tuple(
            replace(m, problem=replace(m.problem, observed=m.problem.observed - (b - a)))
            for m, a, b in zip(weighting.measured, plain, moved, strict=True)
        ),
    )
