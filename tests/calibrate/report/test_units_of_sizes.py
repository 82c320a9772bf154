"""Sizes are told in the unit that stands in a parameter's name, the same in terminal and report."""

import pytest

from calibrate.report.diagnosis.words import size_of


@pytest.mark.parametrize(
    ("parameter", "value", "said"),
    [
        ("compliance_rad_nm", 4.59e-7, "0.459 µrad per Nm"),
        ("scale_error_rad_per_rad", 1.1e-5, "11 µrad per rad"),
        ("shift_x_m", 4.26e-6, "4.26 µm"),
        ("sag_m", 2.5e-3, "2.5 mm"),
        ("wobble_rad", 2.66e-3, "2660 µrad"),
        ("odd", 3.0, "3 (odd)"),
    ],
)
def test_a_size_is_read_with_its_unit(parameter: str, value: float, said: str) -> None:
    assert size_of(parameter, value).replace("\N{NO-BREAK SPACE}", " ") == said
