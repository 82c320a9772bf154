"""What calibration changes in free space: how far the arm as drawn puts the target from where the identified has it."""

import numpy as np
from scipy.spatial.transform import Rotation

from calibrate.arms.catalogue import arm_of
from calibrate.arms.eccentric import with_discs
from calibrate.model_file import ModelFile
from calibrate.parameters import values_by_name
from calibrate.predict import Predictor

POSES = 300  # the rms settles to about 3 %
SEED = 1  # the same poses for every recording of an arm: what differs are the arms


def drawn_against_identified(model: ModelFile) -> float | None:
    """Rms distance (m) over poses drawn evenly between the joint limits, three axes together, base frames laid over.

    The target is the identified one on both arms. None where the model predicts no error in free space: then nobody
    can say what the target does. Source of the best turn: Kabsch, Acta Cryst. A32, 1976.
    """
    room = model.free_space
    if room is None or room.rms_m is None:
        return None
    known = Predictor.of(model)
    arm = with_discs(arm_of(known.rig), known.rig)
    lower, upper = (np.array([getattr(j, k) for j in known.rig.arm.joints]) for k in ("lower_rad", "upper_rad"))
    q_rad = np.random.default_rng(SEED).uniform(lower, upper, (POSES, len(lower)))
    point = np.append(room.point_m, 1.0)
    drawn = (arm.flange(values_by_name(arm.parameters, {}), q_rad) @ point)[:, :3]
    identified = (known.flange(q_rad) @ point)[:, :3]
    a, b = (points - points.mean(axis=0) for points in (identified, drawn))
    turn = Rotation.align_vectors(a, b)[0]
    return float(np.sqrt(np.mean(np.sum((turn.apply(b) - a) ** 2, axis=1))))
