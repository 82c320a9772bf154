"""What the chapters share: the observations behind a result, and the noise that the fit expects in each of them."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from acquisition.recording.recording import Recording
from calibrate.dual_psd_rig import dual_psd_chain
from calibrate.errors import DataError
from calibrate.noise import NoiseModel
from calibrate.observations import Observations
from calibrate.problem import whitener_of
from calibrate.read_samples import Angles, observations
from calibrate.zeros.result import ZeroResult

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Expected:
    """Noise of the observations under the joint and detector noise that was found."""

    sigma_m: Floats  # (pose, 4) one sigma of each coordinate
    from_joints_m: float  # rms over all coordinates of what the joints contribute
    from_detectors_m: float
    whitened: Floats  # (pose, 4) residual after the fit in units of its noise, uncorrelated

    @property
    def floor_m(self) -> float:
        """Rms of what no model can explain."""
        return float(np.hypot(self.from_joints_m, self.from_detectors_m))


@dataclass(frozen=True)
class Evidence:
    """A recording, what was found in it, and what belongs to both."""

    recording: Recording
    result: ZeroResult
    data: Observations
    expected: Expected | None  # None where the fit gave no finite result

    @property
    def places(self) -> tuple[int, ...]:
        """Placements that have poses, rising."""
        return tuple(sorted(set(self.data.placement.tolist())))

    @property
    def corrections(self) -> dict[str, float]:
        """What the fit corrects in the rig file, by parameter name; empty where it gave no finite result."""
        if not np.all(np.isfinite(self.result.theta)):
            return {}
        return {p.name: float(v) for p, v in zip(self.result.parameters, self.result.theta, strict=True)}


def evidence(recording: Recording, result: ZeroResult, angles: Angles) -> Evidence:
    """DataError where the result was not made from this recording with these angles."""
    data = observations(recording.samples, angles)
    if len(data) != result.n_poses:
        raise DataError(
            f"report: the result is of {result.n_poses} poses, {recording.path.name} has {len(data)} with both spots; "
            "give the recording that the result was made from, or identify again"
        )
    chain = dual_psd_chain(recording.rig, data.placement, data.first_psd)
    if [p.name for p in chain.parameters] != [p.name for p in result.parameters]:
        raise DataError(
            f"report: the result has other parameters than the rig {recording.rig.name} in {recording.path.name}; "
            "identify this recording again"
        )
    finite = np.all(np.isfinite(result.theta)) and np.all(np.isfinite(result.residual_after_m))
    return Evidence(
        recording, result, data, _expected(chain.by_joint(result.theta, data.q_rad), result, data) if finite else None
    )


def _expected(by_joint: Floats, result: ZeroResult, data: Observations) -> Expected:
    noise = result.noise
    stated = np.full((len(data), 4), noise.psd_believed_m) if data.sigma_m is None else data.sigma_m
    parts = NoiseModel(noise.joint_rad, stated * noise.psd_m / noise.psd_believed_m).parts(by_joint)
    variances = parts[:, :, range(4), range(4)]  # (2, pose, 4)
    covariance = parts.sum(axis=0)
    whitened = np.einsum("nij,nj->ni", whitener_of(covariance), result.residual_after_m)
    from_joints, from_detectors = np.sqrt(variances.mean(axis=(1, 2))).tolist()
    return Expected(np.sqrt(variances.sum(axis=0)), from_joints, from_detectors, whitened)
