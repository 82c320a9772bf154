"""From a session's samples to the witnesses that its columns allow; each wants enough rows to count."""

import numpy as np
from numpy.typing import NDArray

from acquisition.recording import Samples
from acquisition.recording.rig import Rig
from calibrate.blunders.witness import Witness
from calibrate.sensors.catalogue import SENSORS

Floats = NDArray[np.float64]


def witnesses_of(rig: Rig, samples: Samples, q_rad: Floats) -> tuple[Witness, ...]:
    """All that can be heard; `q_rad` (row, joint) of the samples. DataError where spots have no fixture or laser."""
    found = (kind.witness(rig, samples, q_rad) for kind in SENSORS)
    return tuple(witness for witness in found if witness is not None)
