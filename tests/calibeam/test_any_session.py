"""Which method a session asks for: joint zeros alone, or the whole arm."""

import msgspec
import numpy as np
import pytest

from acquisition.recording.rig_schema import KnownDistance
from acquisition.recording.samples import Samples
from calibeam.any_session import asks_for_zeros

SPOTS = {name: np.zeros(3) for name in ("psd1_x_m", "psd1_y_m", "psd2_x_m", "psd2_y_m")}
ANGLES = {"t_s": np.arange(3.0)} | {f"q{i}_rad": np.zeros(3) for i in range(1, 7)}
LENGTH = KnownDistance(1, 2, 0.4, 2e-5)


@pytest.mark.parametrize(
    ("columns", "known", "zeros"),
    [
        (SPOTS, (), True),
        (SPOTS, (LENGTH,), False),
        (SPOTS | {"x_m": np.zeros(3)}, (), False),
        (SPOTS | {"wire_m": np.full(3, np.nan)}, (), True),
        ({"x_m": np.zeros(3)}, (), False),
    ],
    ids=["spots alone", "a known distance gives the scale", "a tracker beside", "an empty wire column", "a tracker"],
)
def test_joint_zeros_alone_are_asked_for_where_spots_are_all_there_is(rig, columns, known, zeros):
    told = msgspec.structs.replace(rig, known_distances=known)
    assert asks_for_zeros(told, Samples(ANGLES | columns, 6)) is zeros
