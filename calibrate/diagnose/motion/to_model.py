"""What was found of a motion as the part `torques` of model.json; of a recording in motion alone, as a whole one.

Bodies stand there that take the torques of the fit, since a simulation needs bodies: physical_links.py.
"""

import math
from importlib.metadata import version

import numpy as np
from msgspec import structs
from numpy.typing import NDArray

from acquisition.recording import Recording
from acquisition.recording.rig import rig_sha256
from calibrate.diagnose.assess.diagnosis import Finding
from calibrate.diagnose.motion.physical_links import is_physical, physical
from calibrate.diagnose.motion.torque_state import TorqueState, covariance_of
from calibrate.diagnose.motion.torques import TorqueDiagnosis
from calibrate.diagnose.with_model.effect_of_term import effect_names, effect_of_term, finding_of
from calibrate.fit.solvers import Status, triangle_of
from calibrate.model.arms.catalogue import arm_of
from calibrate.model.arms.inverse_dynamics import NUMBERS
from calibrate.model.effect_records import EffectParameter, EffectRecord
from calibrate.model.model_file import SCHEMA, ModelFile, RigIdentity
from calibrate.model.torque_records import TorquesOfModel

NOT_FITTED = "geometry as the rig file states it: no poses were measured; torques of a motion"
WORSE = 1.01  # times the misfit: links that no bodies have are worth a word
SOFTWARE = f"calibeam {version('calibeam')}"

Floats = NDArray[np.float64]


def torques_of_model(found: TorqueDiagnosis, source: str) -> TorquesOfModel:
    """Links, rotors and effects, those that were known with them; `source` is where they were found."""
    return torques_of_state(found.model, source, found.diagnosis.findings, found.known)


def torques_of_state(
    state: TorqueState, source: str, findings: tuple[Finding, ...] = (), known: TorquesOfModel | None = None
) -> TorquesOfModel:
    """The same of a fit."""
    problem = state.problem
    n, links, notes = problem.drivers.n_joints, state.links, list[str]()
    triangle = triangle_of(problem.whitened(problem.columns))
    bodies, _ = physical(links, triangle, problem.links.stated)
    worse = _rms(state, bodies) / max(_rms(state, links), 1e-12)
    if not is_physical(links) and worse > WORSE:
        notes.append(
            f"the links as fitted are none that bodies have; those of bodies leave {100.0 * (worse - 1.0):.0f} % more"
        )
    drivers, accepted = state.drivers, state.accepted
    covariance = covariance_of(problem, problem.jacobian(state.theta))
    own = [np.flatnonzero(problem.owner == i) for i in range(len(accepted))]
    effects = tuple(
        effect_of_term(a, name, finding_of(a, findings), drivers, covariance[np.ix_(i, i)], None)
        for a, name, i in zip(accepted, effect_names(accepted), own, strict=True)
    )
    return TorquesOfModel(
        source=source,
        links=tuple(tuple(row) for row in bodies[: n * len(NUMBERS)].reshape(n, -1).tolist()),
        rotors_kg_m2=tuple(bodies[n * len(NUMBERS) :].tolist()),
        gravity_m_s2=drivers.rig.arm.gravity_m_s2 if known is None else known.gravity_m_s2,
        effects=effects if known is None else _together(known.effects, effects),
        middle_rad=tuple(drivers.middle_rad.tolist()),
        reference_degC=() if drivers.reference_degC is None else tuple(drivers.reference_degC.tolist()),
        noise_nm=tuple(state.noise_nm.tolist()),
        moments=state.samples,
        triangle=tuple(map(tuple, _shown(state).tolist())),
        notes=tuple(notes),
    )


def _together(known: tuple[EffectRecord, ...], found: tuple[EffectRecord, ...]) -> tuple[EffectRecord, ...]:
    """What was found is a change: sizes of linear effects of one kind and place add."""
    out = {one.name: one for one in known}
    for effect in found:
        same = (effect.where, effect.physics, effect.order)
        was = next((e for e in out.values() if (e.where, e.physics, e.order) == same and not e.inner), None)
        if was is None or effect.curve is not None or len(was.coefficients) != len(effect.coefficients):
            name = effect.name
            while name in out:
                name = f"{name}-more"
            out[name] = structs.replace(effect, name=name)
            continue
        pairs = zip(was.coefficients.items(), effect.coefficients.values(), strict=True)
        sizes = {name: _sum(one, effect.parameters.get(name)) for name, one in was.parameters.items()}
        out[was.name] = structs.replace(was, coefficients={k: a + b for (k, a), b in pairs}, parameters=sizes)
    return tuple(out.values())


def _sum(one: EffectParameter, other: EffectParameter | None) -> EffectParameter:
    if other is None or one.value is None or other.value is None:
        return one
    sigma = math.hypot(one.sigma or 0.0, other.sigma or 0.0)
    return EffectParameter(one.value + other.value, sigma, one.unit)


def _shown(state: TorqueState) -> Floats:
    """(link number, link number) rows, noise 1, that hold what the motion shows of the links whatever the terms are."""
    problem, size = state.problem, state.problem.links.size
    terms = problem.jacobian(state.theta)[:, size:]
    whole = triangle_of(np.concatenate([terms, problem.whitened(problem.columns)], axis=1))
    return whole[terms.shape[1] :, terms.shape[1] :]


def _rms(state: TorqueState, links: Floats) -> float:
    """Of the torque that is left with these links and the terms as fitted."""
    misfit = state.problem.misfit_nm(state.theta) + state.problem.columns @ (links - state.links)
    return float(np.sqrt(np.mean(misfit**2)))


def model_of_motion(recording: Recording, torques: TorquesOfModel) -> ModelFile:
    """Of a recording without samples."""
    return ModelFile(
        schema=SCHEMA,
        kind="calibeam-model",
        software=SOFTWARE,
        rig=RigIdentity(recording.rig.name, rig_sha256(recording.rig_text), recording.rig_text),
        arm_model=recording.rig.arm.model.value,
        status=Status.CONVERGED.name,
        says=NOT_FITTED,
        poses=0,
        rank=0,
        free=0,
        condition=None,
        singular_values=(),
        unseen=(),
        parameters=(),
        chain={p.name: 0.0 for p in arm_of(recording.rig).parameters},
        covariance=None,
        noise={},
        repeats=None,
        held_out=None,
        rms_coordinate_before_m=0.0,
        rms_coordinate_after_m=0.0,
        rms_distance_before_m=0.0,
        rms_distance_after_m=0.0,
        instruments=(),
        torques=torques,
    )
