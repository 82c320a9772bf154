"""Frames of a program, bases and work objects, measured again with the arm as it really is.

A frame that was taught with the uncorrected arm holds that arm's error about its place: corrected commands reach the
frame as it is written, not the part. It is measured from points of it that the real tool touches: the motion that
brings them best onto where the model has the tool. Source of its covariance: linear least squares.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from calibrate.apply.correct.corrected import Arms, Options, as_samples
from calibrate.apply.predicting import placed
from calibrate.errors import DataError
from calibrate.model.alignment import align
from calibrate.model.model_file import ModelFile
from calibrate.model.placement import point_by_twist

Floats = NDArray[np.float64]

FEWEST = 3
LARGEST_M = 5e-3  # that a point touched by hand is off


@dataclass(frozen=True, eq=False)
class MeasuredFrame:
    """`T_base_frame` (4, 4); `sigma` (6,) sigma of its shift in m and turn in rad; `rms_m` that the points leave."""

    T_base_frame: Floats
    sigma: Floats
    rms_m: float


def measured_frame(
    model: ModelFile, in_frame_m: Floats, q_rad: Floats, conditions: dict[str, Floats], options: Options
) -> MeasuredFrame:
    """From points (point, 3) of the frame and the joint readings (point, joint) at which the tool touches them.

    DataError for fewer than three points, or points on a line.
    """
    if len(in_frame_m) < FEWEST:
        raise DataError(f"a frame needs {FEWEST} touched points that do not lie on a line; there are {len(in_frame_m)}")
    arms = Arms.of(model, options)
    at = placed(
        model, as_samples(q_rad, conditions), point_m=arms.real_tool[:3, 3] if options.tool is not None else None
    )
    found = align(at.tip_m, in_frame_m)
    off_m = np.linalg.norm(in_frame_m @ found.T_a_b[:3, :3].T + found.T_a_b[:3, 3] - at.tip_m, axis=1)
    if off_m.max() > LARGEST_M:
        raise DataError(
            f"the frame does not fit its points: point {int(np.argmax(off_m)) + 1} is {1e3 * off_m.max():.1f} mm off, "
            f"the median {1e3 * np.median(off_m):.1f} mm; touch the points again, or correct their coordinates"
        )
    J = point_by_twist(in_frame_m @ found.T_a_b[:3, :3].T).reshape(-1, 6)
    left = (len(in_frame_m) - 2) * 3
    variance = len(in_frame_m) * found.rms_m**2 / left
    if np.isfinite(at.tip_sigma_m).all():
        variance += float(np.mean(at.tip_sigma_m**2))
    covariance = variance * np.linalg.inv(J.T @ J)
    return MeasuredFrame(found.T_a_b, np.sqrt(np.diag(covariance)), found.rms_m)
