"""Which readings a table of samples holds: the same again is told from others, whatever file they came in."""

import hashlib

import numpy as np

from acquisition.recording.samples import Samples


def readings_sha256(samples: Samples) -> str:
    """Of the joint angles in their order, hexadecimal; what else is said of the rows does not count."""
    return hashlib.sha256(np.ascontiguousarray(samples.joints(), dtype="<f8").tobytes()).hexdigest()
