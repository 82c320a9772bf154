"""What was found of a motion as the part `torques` of model.json; of a recording in motion alone, as a whole one.

Bodies stand there that take the torques of the fit, since a simulation needs bodies: physical_links.py.
"""

from importlib.metadata import version

import numpy as np
from numpy.typing import NDArray

from acquisition.recording import Recording
from acquisition.recording.rig import rig_sha256
from calibrate.diagnose.motion.physical_links import is_physical, physical
from calibrate.diagnose.motion.torque_state import TorqueState, covariance_of
from calibrate.diagnose.motion.torques import TorqueDiagnosis
from calibrate.diagnose.with_model.effect_of_term import effect_names, effect_of_term, finding_of
from calibrate.fit.solvers import Status, triangle_of
from calibrate.model.arms.catalogue import arm_of
from calibrate.model.arms.inverse_dynamics import NUMBERS
from calibrate.model.model_file import SCHEMA, ModelFile, RigIdentity
from calibrate.model.torque_records import TorquesOfModel

NOT_FITTED = "geometry as the rig file states it: no poses were measured; torques of a motion"
WORSE = 1.01  # times the misfit: links that no bodies have are worth a word
SOFTWARE = f"calibeam {version('calibeam')}"

Floats = NDArray[np.float64]


def torques_of_model(found: TorqueDiagnosis, source: str) -> TorquesOfModel:
    """Links, rotors and effects; `source` is where they were found."""
    state, problem = found.model, found.model.problem
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
        effect_of_term(a, name, finding_of(a, found.diagnosis.findings), drivers, covariance[np.ix_(i, i)], None)
        for a, name, i in zip(accepted, effect_names(accepted), own, strict=True)
    )
    return TorquesOfModel(
        source=source,
        links=tuple(tuple(row) for row in bodies[: n * len(NUMBERS)].reshape(n, -1).tolist()),
        rotors_kg_m2=tuple(bodies[n * len(NUMBERS) :].tolist()),
        gravity_m_s2=drivers.rig.arm.gravity_m_s2,
        effects=effects,
        middle_rad=tuple(drivers.middle_rad.tolist()),
        reference_degC=() if drivers.reference_degC is None else tuple(drivers.reference_degC.tolist()),
        noise_nm=tuple(problem.sigma_nm.tolist()),
        moments=state.samples,
        triangle=tuple(map(tuple, _shown(state).tolist())),
        notes=tuple(notes),
    )


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
