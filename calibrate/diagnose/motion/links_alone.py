"""A motion as rigid links feel it: what drives each term at every moment, what a model or simulation expects there, and
the links alone fitted to its torques.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from acquisition.recording.rig import Rig
from calibrate.diagnose.motion.link_prior import link_prior
from calibrate.diagnose.motion.motion_table import Motion, planned_motion
from calibrate.diagnose.motion.torque_problem import TorqueProblem
from calibrate.diagnose.motion.torque_state import TorqueState, with_torque
from calibrate.errors import DataError
from calibrate.model.arms.catalogue import arm_of
from calibrate.model.arms.inverse_dynamics import torque_columns
from calibrate.model.arms.serial import SerialArm
from calibrate.model.effect_records import EffectRecord
from calibrate.model.effects.curve import TORQUE, UNKNOWN, cause, features_within
from calibrate.model.effects.term import Accepted, Shape, Term
from calibrate.model.effects.torque import MotionDrivers, at_joints, torque_terms
from calibrate.model.parameters import start_values
from calibrate.model.rigid import cross_matrix
from calibrate.model.torque_records import TorquesOfModel

Floats = NDArray[np.float64]

RATE_STEP_S = 1e-4  # of the difference quotient by time


def torque_state(rig: Rig, motion: Motion, known: TorquesOfModel | None = None) -> TorqueState:
    """The links alone, fitted; beside what a model or a simulation knows."""
    drivers, links = motion_drivers(rig, motion, known), link_prior(rig, known)
    given = () if known is None else listed_torques(known.effects, drivers)
    moment, joint = (part.astype(np.intp) for part in np.nonzero(np.isfinite(motion.torque_nm)))
    order = np.lexsort((moment, joint))
    moment, joint = moment[order], joint[order]
    observed = motion.torque_nm[moment, joint]
    columns = drivers.link_columns.reshape(*motion.q_rad.shape, -1)[moment, joint]
    spread = np.array(
        [max(float(np.std(observed[joint == j])), 1e-9) if np.any(joint == j) else 1.0 for j in range(rig.n_joints)]
    )
    whole = TorqueProblem(
        links,
        columns,
        observed,
        moment,
        joint,
        spread,
        np.full(rig.n_joints, 1e-3),
        np.ones(len(moment)),
        (),
        (),
        with_torque(drivers, links.stated, given),
        given,
    )
    start, everything = np.zeros(links.size), np.arange(len(motion.time_s))
    first = TorqueState(whole, everything, whole, start, np.inf)
    return first.refitted(()).renewed()


def planned_drivers(rig: Rig, time_s: Floats, moved: Sequence[Floats]) -> MotionDrivers:
    """Of a plan, under the load of the links that the rig file states; `moved`: angles, speeds, accelerations, jerks,
    (moment, joint) each.
    """
    return with_torque(motion_drivers(rig, planned_motion(time_s, *moved)), link_prior(rig).stated)


def expected_nm(rig: Rig, motion: Motion, known: TorquesOfModel) -> Floats:
    """(moment, joint) torques that a model or simulation expects, also of joints that stand."""
    drivers, links = motion_drivers(rig, motion, known), link_prior(rig, known).stated
    given = listed_torques(known.effects, drivers)
    drivers = with_torque(drivers, links, given)
    out = (drivers.link_columns @ links).reshape(motion.q_rad.shape)
    return np.asarray(sum((one.at(drivers) for one in given), out))


def motion_drivers(rig: Rig, motion: Motion, known: TorquesOfModel | None = None) -> MotionDrivers:
    """Without any load yet."""
    arm, gravity = arm_of(rig), np.array(rig.arm.gravity_m_s2 if known is None else known.gravity_m_s2)
    frames = arm.frames(start_values(arm.parameters), motion.q_rad)
    qd, qdd, none = motion.qd_rad_s, motion.qdd_rad_s2, np.zeros_like(motion.qd_rad_s)
    columns, of_rate, of_lean = _link_columns(arm, frames, motion, gravity)
    each, heat = range(1, rig.n_joints + 1), motion.temperature_degC
    middle_rad, reference = motion.q_rad.mean(axis=0), None if heat is None else heat.mean(axis=0)
    if known is not None and known.middle_rad:
        middle_rad = np.array(known.middle_rad)
    if known is not None and known.reference_degC and heat is not None:
        reference = np.array(known.reference_degC)
    return MotionDrivers(
        rig=rig,
        q_rad=motion.q_rad,
        t_s=motion.time_s,
        frames=frames,
        readouts={},
        approach=None,
        approach_derived=False,
        last_move_rad=none,
        qd_rad_s=qd,
        cmd_minus_q_rad=None,
        temperatures_degC={} if heat is None else {f"joint{i}": heat[:, i - 1] for i in each},
        payload_kg=None,
        payload_com_m=None,
        psd_sum_v=None,
        extra={f"qdd{i}": qdd[:, i - 1] for i in each},
        repeat=None,
        qd=qd,
        qdd_rad_s2=qdd,
        torque_nm=none,
        torque_rate_nm_s=none,
        link_columns=_with_rotors(columns, qdd),
        rate_columns=_with_rotors(of_rate, motion.jerk_rad_s3),
        lean_columns=_with_rotors(of_lean, none),
        last_link=columns[:, :, -1],
        tilted=np.zeros((*qd.shape, 2)),
        samples=motion.samples,
        still_rad_s=motion.still_rad_s,
        middle_rad=middle_rad,
        temperature_degC=heat,
        reference_degC=reference,
        begin_s=motion.begin_s,
    )


def _link_columns(arm: SerialArm, frames: Floats, motion: Motion, gravity: Floats) -> tuple[Floats, Floats, Floats]:
    """(moment, joint, link, 10) torques, their derivative by time, and (moment, joint, 2, link, 10) by a lean."""
    q, qd, qdd, jerk = motion.q_rad, motion.qd_rad_s, motion.qdd_rad_s2, motion.jerk_rad_s3
    theta, still = start_values(arm.parameters), np.zeros_like(qd)
    ahead, back = (
        torque_columns(arm.frames(theta, q + h * qd), qd + h * qdd, qdd + h * jerk, gravity)
        for h in (RATE_STEP_S, -RATE_STEP_S)
    )
    lean = [torque_columns(frames, still, still, cross_matrix(axis) @ gravity) for axis in np.eye(3)[:2]]
    columns = torque_columns(frames, qd, qdd, gravity)
    return columns, (ahead - back) / (2.0 * RATE_STEP_S), np.stack(lean, axis=2)


def _with_rotors(links: Floats, by_rotor: Floats) -> Floats:
    """(torque, link number) of links (moment, joint, ..., link, 10); each rotor turns its own joint (moment, joint)."""
    n = by_rotor.shape[1]
    own = by_rotor[:, :, None] * np.eye(n)
    own = own if links.ndim == 4 else np.repeat(own[:, :, None], links.shape[2], axis=2)
    return np.concatenate([links.reshape(own.size // n, -1), own.reshape(-1, n)], axis=1)


def listed_torques(effects: Sequence[EffectRecord], drivers: MotionDrivers) -> tuple[Accepted, ...]:
    """Each with its term; one that nothing was recorded for (friction by temperature) is left out.

    DataError where the numbers of an effect do not fit its form.
    """
    terms = torque_terms(replace(drivers, known=True))
    listed = [_accepted(one, term) for one in effects for term in terms if _is(one, term)]
    return (*listed, *(_drawn(one, one.waves, drivers) for one in effects if one.waves is not None))


def _drawn(effect: EffectRecord, waves: int, drivers: MotionDrivers) -> Accepted:
    """An unknown cause, over the range of its drivers; beyond it as at its end."""
    names = tuple(effect.depends_on.split(","))

    def law(d: MotionDrivers, inner: Floats, i: int) -> Floats:
        return features_within([cause(d, name) for name in names], [effect.range[name] for name in names], waves)

    joint, coefficients = int(effect.where.removeprefix("joint").removesuffix(TORQUE)), [*effect.coefficients.values()]
    (term,) = at_joints(drivers, UNKNOWN, Shape.SMOOTH, names, law, (), np.inf, effect.says, among=(joint,))
    return Accepted(term, np.array(coefficients, dtype=float), np.zeros(0))


def _is(effect: EffectRecord, term: Term) -> bool:
    physics = effect.listed or effect.physics
    of_term = term.port.where, term.physics, term.order, term.variant
    return (effect.where, physics, effect.order, effect.variant) == of_term and effect.waves is None


def _accepted(effect: EffectRecord, term: Term) -> Accepted:
    inner = [effect.inner.get(one.name) for one in term.inner]
    known = [one for one in inner if one is not None]
    if len(known) < len(inner):
        raise DataError(f"effect {effect.name}: inner values are missing; diagnose the recording again")
    return Accepted(term, np.array(list(effect.coefficients.values()), dtype=float), np.array(known, dtype=float))
