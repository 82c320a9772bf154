"""The number of the first screen that holds wherever the arm works."""

from calibrate.model_file import FreeSpaceRecord
from calibrate.report.answers import Number
from calibrate.report.quantities import DASH, length

NAME = "Anywhere"
MOSTLY = 0.9  # of the error of a single pose, by the doubt of the parameters: the rest adds in quadrature


def anywhere(room: FreeSpaceRecord | None) -> Number:
    """What 95 % of all poses between the joint limits stay below, one sigma, as predicted; or why it is not told."""
    if room is None or room.pose_p95_m is None:
        why = "not predicted" if room is None else f"not determined: {room.says}"
        return Number("anywhere", NAME, None, "m", DASH, why)
    about = "one sigma of a single pose, in 95 % of the workspace; predicted, as far as the model is right"
    if room.p95_m is not None and room.p95_m > MOSTLY * room.pose_p95_m:
        about += "; nearly all of it is what these data leave open of the arm's geometry"
    return Number("anywhere", NAME, room.pose_p95_m, "m", length(room.pose_p95_m), about)
