"""A detector axis of the other sense is named by its column; missing physics or a bad row is no reason."""

import numpy as np
import pytest

from acquisition.recording import Samples
from acquisition.recording.rig import load_rig
from calibrate.errors import DataError
from calibrate.fit.identify.clean import mirrored_axes
from calibrate.fit.identify.wrong_file import refuse_wrong_file
from calibrate.model.checks.gross_error import GrossErrorKind

SPOTS = ("psd1_x_m", "psd1_y_m", "psd2_x_m", "psd2_y_m")


@pytest.fixture(scope="module")
def rig(request):
    return load_rig(request.config.rootpath / "rigs" / "ur5e-dual-psd.toml")


@pytest.fixture
def lit(sessions):
    return sessions(61, n=45)


def samples(lit, spots_m):
    columns = {f"q{i + 1}_rad": lit.q_rad[:, i] for i in range(6)} | dict(zip(SPOTS, spots_m.T, strict=True))
    columns |= {"placement": lit.placement.astype(float), "first_psd": lit.first_psd.astype(float)}
    return Samples({"t_s": np.arange(len(lit.q_rad), dtype=float), **columns}, 6)


def mirrored(lit, *axes):
    return samples(lit, lit.spots_m * np.where(np.isin(np.arange(4), axes), -1.0, 1.0))


# Daily for every axis: the first and the last.
@pytest.mark.parametrize(
    "axes", [(0,), *(pytest.param((axis,), marks=pytest.mark.endure) for axis in (1, 2)), (3,), (0, 2)]
)
def test_every_axis_is_named_by_its_column(rig, lit, axes):
    found = mirrored_axes(rig, mirrored(lit, *axes))
    assert found.kind is GrossErrorKind.MIRRORED_AXIS
    assert found.column == f"column {', '.join(SPOTS[i] for i in axes)}"


def test_such_a_file_is_refused(rig, lit):
    with pytest.raises(DataError, match="column psd2_y_m: counted the other way round"):
        refuse_wrong_file(rig, mirrored(lit, 3))


def test_a_healthy_session_and_one_of_missing_physics_are_left_alone(rig, lit):
    assert mirrored_axes(rig, mirrored(lit)) is None
    sagging = lit.spots_m + 1e-3 * np.sin(3.0 * lit.q_rad[:, 1:2])
    assert mirrored_axes(rig, samples(lit, sagging)) is None


def test_outlying_rows_do_not_hide_it(rig, lit):
    spots = lit.spots_m * np.array([-1.0, 1.0, 1.0, 1.0])
    spots[[4, 40]] += 3e-3
    assert mirrored_axes(rig, samples(lit, spots)).column == "column psd1_x_m"
