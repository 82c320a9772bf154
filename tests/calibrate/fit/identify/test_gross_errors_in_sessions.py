"""A blunder made in a session is named and left out, or the file is refused; the rest gives the same arm."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from acquisition.recording import Samples
from calibrate.errors import DataError
from calibrate.fit.identify.identify import identify
from calibrate.model.checks.gross_error import GrossErrorKind
from tests.calibrate.fit.identify.conftest import Session, changed, table

POSITION = ("x_m", "y_m", "z_m")


@pytest.fixture(scope="module")
def samples(ur5e_truth):
    session = Session(ur5e_truth(np.random.default_rng(5), zero_max=5e-3))
    q = session.readings(150)
    return table(q, **session.positions(q, 1e-5))


@pytest.fixture(scope="module")
def clean(rig, samples):
    return run(rig, samples)


def run(rig, samples):
    return identify(rig, samples, rng=np.random.default_rng(0), held_out_share=0.0)


def moved(samples, rows, turn, shift):
    xyz = np.stack([samples.column(c) for c in POSITION], axis=1)
    xyz[rows] = Rotation.from_rotvec(turn).apply(xyz[rows]) + shift
    return changed(samples, **dict(zip(POSITION, xyz.T, strict=True)))


def test_a_clean_session_has_no_gross_errors(clean):
    assert clean.blunders == ()


def test_a_typed_digit_is_named_and_changes_nothing(rig, samples, clean):
    y = samples.column("y_m").copy()
    y[33] += 0.1
    result = run(rig, changed(samples, y_m=y))
    (found,) = result.blunders
    assert (found.kind, found.rows, found.column) == (GrossErrorKind.WRONG_VALUE, (33,), "y_m")
    assert result.n_samples == 149
    assert result.instruments[0].rms_distance_after_m == pytest.approx(
        clean.instruments[0].rms_distance_after_m, rel=0.05
    )


def test_several_kinds_at_once_are_each_named(rig, samples):
    x, q2 = samples.column("x_m").copy(), samples.column("q2_rad").copy()
    x[5] += 0.01
    q2[80] -= 0.3
    both = changed(samples, x_m=x, q2_rad=q2)
    copied = Samples({k: np.concatenate([v, v[20:22]]) for k, v in both.columns.items()}, 6)
    found = {(b.kind, b.rows) for b in run(rig, copied).blunders}
    assert found == {
        (GrossErrorKind.WRONG_VALUE, (5,)),
        (GrossErrorKind.WRONG_VALUE, (80,)),
        (GrossErrorKind.DUPLICATED_ROWS, (150,)),
        (GrossErrorKind.DUPLICATED_ROWS, (151,)),
    }


@pytest.mark.parametrize(("turn", "shift"), [([0.0, 0.0, 1.0], [0.5, 0.0, 0.0]), ([0.0, 0.0, 1e-3], [5e-4, 0.0, 1e-3])])
def test_rows_of_another_session_are_one_gross_error(rig, samples, turn, shift):
    result = run(rig, moved(samples, slice(40, 80), turn, shift))
    rows = {row for b in result.blunders for row in b.rows}
    assert {b.kind for b in result.blunders} == {GrossErrorKind.OTHER_SESSION}
    assert rows == set(range(40, 80))
    assert result.instruments[0].rms_distance_after_m < 2.5e-5


def test_bad_rows_after_a_copied_one_keep_their_numbers(rig, samples):
    doubled = Samples({k: np.insert(v, 3, v[0]) for k, v in samples.columns.items()}, 6)
    z = doubled.column("z_m").copy()
    z[100] += 0.05
    found = {b.kind: b.rows for b in run(rig, changed(doubled, z_m=z)).blunders}
    assert found == {GrossErrorKind.DUPLICATED_ROWS: (3,), GrossErrorKind.WRONG_VALUE: (100,)}


def test_half_a_file_of_another_session_is_refused(rig, samples):
    with pytest.raises(DataError, match="do not go with the rest"):
        run(rig, moved(samples, slice(0, 70), [0.0, 0.3, 1.0], [0.5, 0.2, 0.0]))


def test_degrees_are_refused_by_name(rig, samples):
    degrees = {f"q{i}_rad": np.degrees(samples.column(f"q{i}_rad")) for i in range(1, 7)}
    with pytest.raises(DataError, match="these are degrees"):
        run(rig, changed(samples, **degrees))


def test_a_mirrored_axis_is_refused_by_name(rig, samples):
    with pytest.raises(DataError, match="determinant -1"):
        run(rig, changed(samples, y_m=-samples.column("y_m")))


def test_a_joint_of_the_other_sense_is_refused_by_name(rig, samples):
    with pytest.raises(DataError, match="column q3_rad: joint 3 turns against"):
        run(rig, changed(samples, q3_rad=-samples.column("q3_rad")))


@pytest.mark.parametrize(("off_m", "named"), [(6e-3, False), (6e-2, True)])
def test_where_all_rows_miss_by_many_times_the_noise_only_what_no_arm_does_is_named(rig, samples, off_m, named):
    """A soft arm misses some of its rows by 16 times what is usual: not the operator's fault."""
    rng = np.random.default_rng(3)
    off = {c: samples.column(c) + 3e-4 * rng.standard_normal(150) for c in POSITION}
    off["z_m"][33] += off_m
    assert [b.rows for b in run(rig, changed(samples, **off)).blunders] == ([(33,)] if named else [])
