"""Errors of the target over the workspace, nominal and calibrated, where the data support a statement.

The nominal error is the distance between both arms, the best rigid motion between them left out, with the uncertainty
of the calibrated one; the calibrated error is that uncertainty alone, J C J' (law of propagation, JCGM 100:2008,
5.1.2), with the scatter of a single pose. A pose is supported where no joint is beyond the angles that it had in the
session, and where the prediction leans on the data no harder than at the poses of the session: beyond the largest
leverage of the data lies hidden extrapolation (Montgomery, Peck, Vining, Introduction to Linear Regression Analysis,
5th ed. 2012, ch. 3.8). The outermost hundredth of the session at either end does not count: a lone pose far off
supports nothing.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from calibrate.diagnose.record.schema import DiagnosisFile
from calibrate.fit.accuracy import (
    FreeSpaceStatus,
    PoseScatter,
    Workspace,
    free_space_error,
    target_by_parameter,
    variance_of_scatter,
)
from calibrate.fit.rank import Identifiability, analyse_along, in_plain_words
from calibrate.model.alignment import aligned_difference
from calibrate.model.arms.rig_arm import limits_of
from calibrate.model.chain import KinematicModel
from calibrate.model.model_file import Covariance, Fields, WorkspaceErrorRecord
from calibrate.model.parameters import Parameter, index_of, without_assumed
from calibrate.model.rigid import cross_matrix
from calibrate.model.sensors.catalogue import LENGTHS
from calibrate.quantities import DASH, length
from calibrate.report.elements.verdict import Number
from calibrate.report.evidence.session_evidence import SessionEvidence

Floats = NDArray[np.float64]

JOINT = "joint"


@dataclass(frozen=True)
class KnownArm:
    """A `Valued` (fit/accuracy.py) whose values are those that were found."""

    arm: KinematicModel
    parameters: tuple[Parameter, ...]  # of the whole fit; those of the arm are among them by name
    drawn: Floats  # (param,) nominal arm, frames and target where they fit best
    theta: Floats  # (param,) as identified
    covariance: Floats  # (param, param), zero for what was held
    seen: Identifiability
    scatter: PoseScatter  # of a single pose
    point_m: Floats  # (3,) the target in the flange frame, that the corrections of tool are about
    lower_rad: Floats  # (joint,) limits
    upper_rad: Floats
    q_rad: Floats  # (row, joint) of the samples that took part


def unpredicted(room: WorkspaceErrorRecord | None) -> str | None:
    """Why errors over the workspace cannot be determined, by the prediction in the model; None where they can."""
    if room is None:
        return "the model holds no prediction: it has no covariance, or is of an older program"
    if room.status == FreeSpaceStatus.PREDICTED.name:
        return None
    return f"{room.says} ({'; '.join(room.undetermined)})" if room.undetermined else room.says


def scatter_of(noise: Fields) -> PoseScatter:
    """Of a single pose, from the noise found: of the joints, else of the instrument, in which that of the arm is."""
    found = {name: value for name, value in noise.items() if isinstance(value, float)}
    if JOINT in found:
        return PoseScatter(joint_rad=found[JOINT])
    return PoseScatter(target_m=max(found.get(source, 0.0) for source in LENGTHS))


def whole_covariance(record: Covariance | None, parameters: tuple[Parameter, ...]) -> Floats:
    """(param, param) the covariance of a model.json among all parameters; NaN where there is none.

    What the file holds of effects is left out: these are parameters of the geometry.
    """
    if record is None:
        return np.full((len(parameters), len(parameters)), np.nan)
    column = index_of(parameters)
    out = np.zeros((len(parameters), len(parameters)))
    known = [k for k, name in enumerate(record.names) if name in column]
    own = [column[record.names[k]] for k in known]
    out[np.ix_(own, own)] = np.array(record.rows)[np.ix_(known, known)]
    return out


Bools = NDArray[np.bool_]

POSES_LOG2 = 12  # drawn within the angles of the session: some eight a cell
REACH_LOG2 = 14  # within the limits, for the outline alone
ROUNDING = 1e-9  # of the largest leverage
OUTERMOST = 0.01  # of the poses, at either end


@dataclass(frozen=True)
class Room:
    """Poses drawn evenly between the angles of the session, and where the joint limits would let the arm go."""

    q_rad: Floats  # (pose, joint)
    points_m: Floats  # (pose, 3) of the target in the base, as identified
    supported: Bools  # (pose,)
    drawn_m: Floats  # (pose,) error of the nominal arm, one sigma, three axes together
    found_m: Floats  # (pose,) as identified
    reach_m: Floats  # (pose, 3) of the target at poses between the limits
    session_m: Floats  # (row, 3) of the target at the poses of the session
    limited_by: tuple[str, ...] = ()  # parameters without a number that make most of the error as identified
    if_known_m: float = 0.0  # rms over the supported poses that would remain if these were known


def room_of(known: KnownArm) -> Room:
    """The same poses every time."""
    sequence = even_points(2**REACH_LOG2, known.arm.n_joints)
    session = known.q_rad
    q_rad = between(sequence[: 2**POSES_LOG2], *np.quantile(session, (OUTERMOST, 1.0 - OUTERMOST), axis=0))
    points, slopes = target_by_parameter(known.arm, known, known.point_m, q_rad)
    rigid = np.asarray(np.linalg.lstsq(_rigid(points), slopes.reshape(-1, slopes.shape[-1]), rcond=None)[0], float)
    here = _variance(known, points, slopes, rigid)
    at_session, session_slopes = target_by_parameter(known.arm, known, known.point_m, session)
    leverage = float(np.quantile(_variance(known, at_session, session_slopes, rigid), 1.0 - OUTERMOST))
    variance = here + variance_of_scatter(known.arm, known, points, q_rad, known.scatter)
    return Room(
        q_rad,
        points,
        here <= (1.0 + ROUNDING) * leverage,
        np.sqrt(_apart(known, points, q_rad) ** 2 + variance),
        np.sqrt(variance),
        target_at(known, known.theta, between(sequence, known.lower_rad, known.upper_rad)),
        at_session,
    )


def even_points(count: int, dimensions: int) -> Floats:
    """(count, dimensions) points that fill the unit cube evenly: multiples, modulo 1, of powers of the number g with
    g^(d+1) = g + 1.

    Source: Roberts, The unreasonable effectiveness of quasirandom sequences, 2018; of this kind Niederreiter, Random
    Number Generation and Quasi-Monte Carlo Methods, 1992, ch. 3.
    """
    g = 2.0
    for _ in range(64):
        g = (1.0 + g) ** (1.0 / (dimensions + 1))
    return np.mod(0.5 + np.outer(np.arange(count), g ** -np.arange(1.0, dimensions + 1.0)), 1.0)


def between(sequence: Floats, lower: Floats, upper: Floats) -> Floats:
    """(pose, joint) numbers of the unit cube between limits (joint,), which may be equal."""
    return lower + sequence * (upper - lower)


def target_at(known: KnownArm, theta: Floats, q_rad: Floats) -> Floats:
    """(pose, 3) the target in the base for values (param,)."""
    column = index_of(known.parameters)
    own = [column[p.name] for p in known.arm.parameters]
    tool = [theta[column[name]] if name in column else 0.0 for name in ("tool.x", "tool.y", "tool.z")]
    T = known.arm.flange(theta[own], q_rad)
    return T[:, :3, :3] @ (known.point_m + np.array(tool)) + T[:, :3, 3]


def _rigid(points_m: Floats) -> Floats:
    """(3 pose, 6) what a motion of everything does to the points."""
    shift = np.broadcast_to(np.eye(3), (len(points_m), 3, 3))
    return np.concatenate([shift, -cross_matrix(points_m)], axis=2).reshape(-1, 6)


def _variance(known: KnownArm, points_m: Floats, slopes: Floats, rigid: Floats) -> Floats:
    """(pose,) of the target, three axes together: the covariance, and what is guessed for want of data."""
    J = slopes - (_rigid(points_m) @ rigid).reshape(slopes.shape)
    seen, column = known.seen, index_of(known.parameters)
    guessed = np.sum((J[..., [column[name] for name in seen.names]] @ seen.unseen) ** 2, axis=(1, 2))
    sure = np.einsum("nip,pq,niq->n", J, known.covariance, J, optimize=True)
    return np.maximum(sure, 0.0) + guessed


def _apart(known: KnownArm, points_m: Floats, q_rad: Floats) -> Floats:
    """(pose,) distance between the nominal and the calibrated arm, best put on each other."""
    return np.linalg.norm(aligned_difference(points_m, target_at(known, known.drawn, q_rad)), axis=1)


SESSION = "the poses between the joint angles of the session"
NOMINAL, CALIBRATED, WITH_PHYSICS = "nominal", "calibrated", "with physics"
EVERY = 8  # of the supported poses: enough for a mean
MATTERS = 0.95  # of the variance that remains with one parameter known: below, this parameter is named
MOST = 0.5  # of the error that remains with all of them known: above, they are not the reason for its size


def session_arm(evidence: SessionEvidence) -> KnownArm | str:
    """The arm with its uncertainty, or why no error over the workspace can be determined."""
    problem, model, theta = evidence.problem, evidence.model, evidence.theta
    rig, room = evidence.recording.rig, model.free_space
    with_physics = room is None and model.session is not None and model.covariance is not None
    why = None if with_physics else unpredicted(room)
    if why is not None:
        return why
    stated = model.about.get("tool", rig.tool.point_m or (0.0, 0.0, 0.0))[:3] if room is None else room.point_m
    lower, upper = limits_of(rig)
    known = KnownArm(
        evidence.arm,
        problem.parameters,
        evidence.drawn,
        theta,
        whole_covariance(model.covariance, problem.parameters),
        analyse_along(problem.fulfilled(theta), theta, without_assumed(problem.parameters)),
        scatter_of(model.noise),
        np.array(stated),
        lower,
        upper,
        evidence.q_rad,
    )
    if not with_physics:
        return known
    asked = Workspace(lower, upper, known.point_m)
    found = free_space_error(evidence.arm, known, known.seen, asked, np.random.default_rng(0))
    return f"{found.status.value} ({'; '.join(found.undetermined)})" if found.rms_m is None else known


def session_room(evidence: SessionEvidence) -> Room | str:
    """Errors of the tool over the workspace, or why none can be determined. About half a second."""
    known = session_arm(evidence)
    if isinstance(known, str):
        return known
    arm = {p.name for p in evidence.arm.parameters}
    return limited(
        known, room_of(known), [p.name for p in evidence.model.parameters if p.value is None and p.name in arm]
    )


def limited(known: KnownArm, room: Room, undetermined: Sequence[str]) -> Room:
    """With the undetermined parameters that make most of the error, if any do.

    A known parameter takes its part of the covariance of all others away (Schur complement).
    """
    column, q_rad = index_of(known.parameters), room.q_rad[room.supported][::EVERY]
    points, slopes = target_by_parameter(known.arm, known, known.point_m, q_rad)
    rigid = np.asarray(np.linalg.lstsq(_rigid(points), slopes.reshape(-1, slopes.shape[-1]), rcond=None)[0], float)
    scatter = variance_of_scatter(known.arm, known, points, q_rad, known.scatter)

    def variance(names: Sequence[str]) -> float:
        k, C = [column[name] for name in names], known.covariance
        left = C - C[:, k] @ np.linalg.pinv(C[np.ix_(k, k)]) @ C[k]
        return float(np.mean(_variance(replace(known, covariance=left), points, slopes, rigid) + scatter))

    whole = variance(())
    names = tuple(name for name in undetermined if variance((name,)) < MATTERS * whole)
    left_m = float(np.sqrt(variance(names)))
    return replace(room, limited_by=names, if_known_m=left_m) if names and left_m < MOST * np.sqrt(whole) else room


def limit_of(room: Room | str) -> str:
    """What makes most of the calibrated error, and what would be left without it; empty where nothing does alone."""
    if isinstance(room, str) or not room.limited_by:
        return ""
    named = " and ".join(in_plain_words(name) for name in room.limited_by)
    return f"limited by {named}: measured in another way, {length(room.if_known_m)} would be left"


def tool_numbers(room: Room | str, diagnosis: DiagnosisFile | None = None) -> Iterator[Number]:
    """Over the workspace, where the data support a statement: nominal arm, calibrated, and with the physics found.

    What missing physics adds to geometry alone is what the diagnosis predicts: independent of the uncertainty of the
    geometry, hence added in quadrature.
    """
    if isinstance(room, str):
        why = f"is not determined: {room}"
        yield Number("tool_nominal", NOMINAL, None, "m", DASH, why)
        yield Number("tool_calibrated", CALIBRATED, None, "m", DASH, why)
        return
    nominal, found = (float(np.sqrt(np.mean(e[room.supported] ** 2))) for e in (room.drawn_m, room.found_m))
    missed = _missed_by_geometry(diagnosis)
    calibrated = float(np.hypot(found, missed))
    where = f"Rms over {SESSION}; calibrated: one sigma, predicted."
    if room.limited_by:
        named = " and ".join(in_plain_words(name) for name in room.limited_by)
        where += (
            f" Nearly all of the calibrated error is the assumed tolerance of {named}, which these readings do not "
            f"determine: with known values it would be {length(room.if_known_m)}."
        )
    yield Number("tool_nominal", NOMINAL, nominal, "m", length(nominal), f"{where} The base is put where it fits best.")
    yield Number("tool_calibrated", CALIBRATED, calibrated, "m", length(calibrated), where)
    if missed > 0.0:
        about = f"{where} The physics found by the diagnosis accounts for {length(missed)} of it."
        yield Number("tool_physics", WITH_PHYSICS, found, "m", length(found), about)


def _missed_by_geometry(diagnosis: DiagnosisFile | None) -> float:
    """In m, rms over the workspace; 0 where no diagnosis has it."""
    change = None if diagnosis is None or not diagnosis.findings else diagnosis.free_space
    return 0.0 if change is None else float(np.sqrt(max(change.rms_before_m**2 - change.rms_after_m**2, 0.0)))
