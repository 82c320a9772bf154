"""Sizes as a person reads them."""

import pytest

from calibrate.effects.term import Size, plain


@pytest.mark.parametrize(
    ("name", "value", "sigma", "words"),
    [
        ("compliance_rad_nm", 68e-6, 2e-6, "68 ± 2 µrad per Nm"),
        ("amplitude_rad", 1.2e-4, 4e-6, "120 ± 4 µrad"),
        ("slip_rad", 0.02, 1e-4, "20 ± 0.1 mrad"),
        ("shift_x_m", 26e-6, 1e-6, "26 ± 1 µm"),
        ("thickness_m", 1.1e-3, 1e-4, "1.1 ± 0.1 mm"),
        ("period_m", 0.25, 1e-3, "250 ± 1 mm"),
        ("expansion_per_k", 12e-6, 1e-6, "12 ± 1 µm per m and K"),
        ("scale_error_rad_per_rad", -3e-4, 1e-5, "-300 ± 10 µrad per rad"),
        ("gain_error_share", 0.01, 1e-3, "1 ± 0.1%"),
        ("scale_error_share", 2e-5, 1e-6, "20 ± 1 ppm"),
        ("delay_s", 0.004, 2e-4, "4 ± 0.2 ms"),
        ("phase_rad", 0.5235987755982988, 0.017453292519943295, "30 ± 1°"),
        ("knee_nm", 14.0, 1.0, "14 ± 1 Nm"),
        ("growth_share", 5.68e-4, 4.09e-4, "568 ± 409 ppm"),
        ("time_s", 12345.0, 99.7, "12345 ± 100 s"),
    ],
)
def test_the_unit_fits_the_size(name, value, sigma, words):
    assert plain(name, Size(value, sigma)) == words
