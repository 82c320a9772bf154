"""Sizes as a person reads them."""

import pytest

from calibrate.model.effects.term import Size, plain


@pytest.mark.parametrize(
    ("name", "value", "sigma", "words"),
    [
        ("compliance_rad_nm", 68e-6, 2e-6, "68.0 ± 2.0 µrad per Nm"),
        ("amplitude_rad", 1.2e-4, 4e-6, "120.0 ± 4.0 µrad"),
        ("slip_rad", 0.02, 1e-4, "20.00 ± 0.10 mrad"),
        ("shift_x_m", 26e-6, 1e-6, "26.0 ± 1.0 µm"),
        ("thickness_m", 1.1e-3, 1e-4, "1.10 ± 0.10 mm"),
        ("period_m", 0.25, 1e-3, "250.0 ± 1.0 mm"),
        ("expansion_per_k", 12e-6, 1e-6, "12.0 ± 1.0 µm per m and K"),
        ("scale_error_rad_per_rad", -3e-4, 1e-5, "-300 ± 10 µrad per rad"),
        ("gain_error_share", 0.01, 1e-3, "1.00 ± 0.10%"),
        ("scale_error_share", 2e-5, 1e-6, "20.0 ± 1.0 ppm"),
        ("delay_s", 0.004, 2e-4, "4.00 ± 0.20 ms"),
        ("phase_rad", 0.5235987755982988, 0.017453292519943295, "30.0 ± 1.0°"),
        ("knee_nm", 14.0, 1.0, "14.0 ± 1.0 Nm"),
        ("growth_share", 5.68e-4, 4.09e-4, "568 ± 409 ppm"),
        ("time_s", 12345.0, 99.7, "12345 ± 100 s"),
        ("shift_x_m", 0.3475e-6, 108e-6, "0 ± 108 µm"),
        ("shift_y_m", -0.2e-6, 22e-6, "0 ± 22 µm"),
        ("shift_z_m", 68.58e-6, 19.2e-6, "69 ± 19 µm"),
    ],
)
def test_the_unit_fits_the_size(name, value, sigma, words):
    assert plain(name, Size(value, sigma)) == words
