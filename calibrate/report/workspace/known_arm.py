"""An arm nominal and calibrated, with the doubt of the latter: all that a picture of its workspace needs."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from calibrate.arms.model import KinematicModel
from calibrate.identifiability import Identifiability
from calibrate.model_file import Covariance, Fields, FreeSpaceRecord
from calibrate.parameters import Parameter, index_of
from calibrate.sensors.catalogue import LENGTHS
from calibrate.uncertainty.free_space import FreeSpaceStatus, Scatter

Floats = NDArray[np.float64]

JOINT = "joint"


@dataclass(frozen=True)
class KnownArm:
    """A `Valued` (uncertainty/free_space.py) whose values are those that were found."""

    arm: KinematicModel
    parameters: tuple[Parameter, ...]  # of the whole fit; those of the arm are among them by name
    drawn: Floats  # (param,) nominal arm, frames and target where they fit best
    theta: Floats  # (param,) as identified
    covariance: Floats  # (param, param), zero for what was held
    seen: Identifiability
    scatter: Scatter  # of a single pose
    point_m: Floats  # (3,) the target in the flange frame, that the corrections of tool are about
    lower_rad: Floats  # (joint,) limits
    upper_rad: Floats
    q_rad: Floats  # (row, joint) of the samples that took part


def unpredicted(room: FreeSpaceRecord | None) -> str | None:
    """Why errors over the workspace cannot be determined, as the prediction in the model says; None where they can."""
    if room is None:
        return "the model holds no prediction: it has no covariance, or is of an older program"
    if room.status == FreeSpaceStatus.PREDICTED.name:
        return None
    return f"{room.says} ({'; '.join(room.undetermined)})" if room.undetermined else room.says


def scatter_of(noise: Fields) -> Scatter:
    """Of a single pose, from the noise found: of the joints, else of the instrument, in which that of the arm is."""
    found = {name: value for name, value in noise.items() if isinstance(value, float)}
    if JOINT in found:
        return Scatter(joint_rad=found[JOINT])
    return Scatter(target_m=max(found.get(source, 0.0) for source in LENGTHS))


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
