"""A dual-PSD session: honest rows stay, a wrong cell and a copy are named and left out."""

import numpy as np
import pytest

from acquisition.recording import Samples
from acquisition.recording.rig import load_rig
from calibrate.errors import DataError
from calibrate.fit.fit_plan import FitPlan
from calibrate.fit.identify.identify import identify, without_gross_errors
from calibrate.model.checks.gross_error import GrossErrorKind
from tests.calibrate.conftest import spot_samples
from tests.calibrate.fit.identify.conftest import changed


@pytest.fixture(scope="module")
def rig(request):
    return load_rig(request.config.rootpath / "rigs" / "ur5e-dual-psd.toml")


@pytest.fixture
def samples(sessions):
    return spot_samples(sessions(41, n=60, repeats=6))


def test_honest_spots_are_all_kept(rig, samples):
    weighting, _, gross_errors = without_gross_errors(rig, samples)
    assert gross_errors == ()
    assert weighting.measured[0].problem.rows == len(samples)


@pytest.mark.parametrize(
    ("column", "off"), [("psd2_x_m", 1e-3), pytest.param("psd1_y_m", -4e-4, marks=pytest.mark.endure), ("q3_rad", 0.05)]
)
def test_a_typed_digit_is_named_by_row_and_column(rig, samples, column, off):
    values = samples.column(column).copy()
    values[17] += off
    weighting, _, (found,) = without_gross_errors(rig, changed(samples, **{column: values}))
    assert (found.kind, found.rows) == (GrossErrorKind.WRONG_VALUE, (17,))
    assert found.column == column
    assert weighting.measured[0].problem.rows == len(samples) - 1


def test_a_copied_row_is_left_out_and_later_rows_keep_their_numbers(rig, samples):
    doubled = Samples({k: np.insert(v, 5, v[2]) for k, v in samples.columns.items()}, 6)
    x = doubled.column("psd1_x_m").copy()
    x[40] += 2e-3
    _, _, gross_errors = without_gross_errors(rig, changed(doubled, psd1_x_m=x))
    assert {(b.kind, b.rows) for b in gross_errors} == {
        (GrossErrorKind.DUPLICATED_ROWS, (5,)),
        (GrossErrorKind.WRONG_VALUE, (40,)),
    }


def test_degrees_are_refused_by_name(rig, samples):
    degrees = {f"q{i}_rad": np.degrees(samples.column(f"q{i}_rad")) for i in range(1, 7)}
    with pytest.raises(DataError, match="these are degrees"):
        without_gross_errors(rig, changed(samples, **degrees))


def test_spots_are_proved_by_every_split_and_raise_no_alarm(rig, samples):
    found = identify(rig, samples, rng=np.random.default_rng(0))
    assert [u.split for u in found.held_out] == [
        "random 20% of the rows",
        "each of 3 places in turn",
        "last 20% of the session",
    ]
    assert all(u.rms_distance_after_m < 1.2e-5 < 1e-3 < u.rms_distance_before_m for u in found.held_out)
    assert found.evidence.observability.n_free > 30
    assert found.alarms == ()


def test_a_plan_holds_and_believes_in_a_session_of_spots_alone(rig, samples):
    plan = FitPlan(schema=1, hold=("link*",), priors={"placement*": 2e-2})
    result = identify(rig, samples, rng=np.random.default_rng(0), plan=plan, held_out_share=0.0)
    by = {p.name: p for p in result.parameters}
    assert not any(p.free for name, p in by.items() if name.startswith("link"))
    assert {p.prior for name, p in by.items() if name.startswith("placement")} == {2e-2}
    # The links of the truth are not those of the drawing: held, they leave more than the stated noise.
    assert any("larger than the stated noise" in alarm for alarm in result.alarms)
