"""What a planned motion of all joints would show of their torques: sigmas of the torque catalogue before it is run.

The columns are those of the diagnosis of a recorded motion: links (base parameters follow from the priors), dry and
viscous friction, rotors, springs, a payload, leaning gravity. Noise is independent from moment to moment; the moments
are as many as the diagnosis takes. Source: Swevers et al., Optimal robot excitation and identification, IEEE Trans.
Robotics and Automation 13(5), 1997 (covariance of the parameters as the measure of a trajectory).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from acquisition.recording.motion_plan import MotionPlan
from acquisition.recording.rig import Rig
from calibrate.diagnose.motion import LOOSE, link_prior, moments_in, planned_drivers
from calibrate.errors import DataError
from calibrate.model.effects.term import Form
from calibrate.model.effects.torque import friction, masses_and_springs

Floats = NDArray[np.float64]

MOMENTS = 200  # of one repeat: twenty on the fastest wave of ten
NOISE_SHARE = 0.05  # of a joint's expected torque (rms), where no noise is given
LEAST_SHARE = 0.01  # of the largest joint's: a joint that carries next to nothing is not measured the better for it
ALIASED = 0.1  # of the loose prior: a sigma beyond it comes from the prior, not from the motion
KINDS = (
    friction.COULOMB,
    friction.VISCOUS,
    masses_and_springs.SPRING,
    masses_and_springs.PAYLOAD,
    masses_and_springs.GRAVITY,
)
SIZES = ("friction_nm", "friction_nms_per_rad", "stiffness_nm_per_rad", "mass_kg", "lean_x_rad", "lean_y_rad")
ROTOR = "rotor_kg_m2"


@dataclass(frozen=True, eq=False)
class TorqueInformation:
    """Of one motion. `sigma`: by place ("joint1.torque", "tool.load") and parameter; NaN: not determined."""

    sigma: dict[tuple[str, str], float]
    torque_nm: Floats  # (joint,) rms of the stated links
    peak_nm: Floats  # (joint,) largest of the same
    noise_nm: Floats  # (joint,)
    score: float  # mean logarithm of all sigmas, the lower the better: units only shift it, loose priors bound it


def torque_information(rig: Rig, plan: MotionPlan, noise_nm: float | None = None) -> TorqueInformation:
    """Of the motion as planned. DataError where neither noise nor masses are stated."""
    t_s = (np.arange(MOMENTS) + 0.5) * plan.length_s / MOMENTS
    drivers = planned_drivers(rig, t_s, [plan.at(t_s, k) for k in range(4)])
    loads = np.sqrt(np.mean(drivers.torque_nm**2, axis=0))
    noise = _noise(rig, loads, noise_nm)
    moment, joint = np.nonzero(np.abs(drivers.qd) >= drivers.still_rad_s)
    rows = moments_in(plan.total_s) / MOMENTS
    weight = np.sqrt(rows) / noise[joint]
    links, n = np.linalg.norm(link_prior(rig).ways, axis=1), rig.n_joints
    names = [("", f"link{k}") for k in range(len(links) - n)] + [(f"joint{i + 1}.torque", ROTOR) for i in range(n)]
    columns = [drivers.link_columns.reshape(*drivers.qd.shape, -1)[moment, joint]]
    for term in (one for kind in KINDS for one in kind.terms(drivers) if isinstance(one, Form)):
        columns.append(term.basis(drivers, np.zeros(0))[moment, joint])
        names += [(term.port.where, name) for name in term.names]
    whitened = np.concatenate(columns, axis=1) * weight[:, None]
    acts = np.maximum(np.count_nonzero(whitened, axis=0), 1)
    felt = np.sqrt(np.sum(whitened**2, axis=0) / acts / rows)  # of one unit at one moment, in sigmas
    loose = np.array([bool(place) for place, _ in names])
    with np.errstate(divide="ignore"):
        prior = np.where(loose, LOOSE / felt, np.concatenate([links, np.ones(len(names) - len(links))]))
    sigma = _sigmas(whitened, prior)
    sigmas = {
        name: float(sigma[k]) if sigma[k] < ALIASED * prior[k] else float("nan")
        for k, name in enumerate(names)
        if name[1] in (*SIZES, ROTOR)
    }
    wanted = [k for k, name in enumerate(names) if name in sigmas and np.isfinite(prior[k])]
    peak = np.max(np.abs(drivers.torque_nm), axis=0)
    return TorqueInformation(sigmas, loads, peak, noise, float(np.mean(np.log(sigma[wanted]))))


def _noise(rig: Rig, loads_nm: Floats, noise_nm: float | None) -> Floats:
    """(joint,) Nm of one moment."""
    if noise_nm is not None:
        return np.full(rig.n_joints, noise_nm)
    if not np.max(loads_nm) > 0.0:
        raise DataError(
            f"rig {rig.name}: no joint has a mass_kg, so the noise of its torque cannot be assumed; give "
            "--torque-noise-nm, or state the masses of the links"
        )
    return np.maximum(NOISE_SHARE * loads_nm, LEAST_SHARE * np.max(loads_nm))


def _sigmas(whitened: Floats, prior: Floats) -> Floats:
    """(parameter,) of the posterior; infinite where the prior is: such a column is nought."""
    known = np.isfinite(prior)
    scaled = whitened[:, known] * prior[known]
    _, s, Vt = np.linalg.svd(np.linalg.qr(scaled, mode="r"), full_matrices=True)
    spread = np.ones(len(Vt))
    spread[: len(s)] = 1.0 / (1.0 + s**2)
    out = np.full(len(prior), np.inf)
    out[known] = prior[known] * np.sqrt(spread @ Vt**2)
    return out
