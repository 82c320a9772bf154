"""Quantities written with a unit become exactly the SI number that a person would write."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from acquisition.recording.files.explain import si_name, si_value, suffix_of


@pytest.mark.parametrize(
    ("key", "text", "value"),
    [
        ("sigma_m", "0.2 mm", 0.0002),
        ("sigma_m", "20um", 20e-6),
        ("sigma_m", "20 µm", 20e-6),
        ("d_m", "-1.5e2 mm", -0.15),
        ("d_m", ".3 m", 0.3),
        ("angle_rad", "0.5 mrad", 5e-4),
        ("angle_rad", "3 urad", 3e-6),
        ("angle_rad", "180 deg", math.pi),
        ("angle_rad", "3600 arcsec", math.pi / 180),
        ("dwell_s", "20 ms", 0.02),
        ("mass_kg", "400 g", 0.4),
        ("rate_hz", "1 kHz", 1000.0),
        ("speed_rad_s", "90 deg/s", math.pi / 2),
        ("gravity_m_s2", "9.81 m/s^2", 9.81),
        ("laser_power_w", "1 mW", 1e-3),
    ],
)
def test_a_quantity_becomes_si(key: str, text: str, value: float) -> None:
    assert si_value(key, text) == value


@given(st.floats(-1e6, 1e6, allow_nan=False))
def test_si_text_is_the_number_itself(value: float) -> None:
    assert si_value("a_m", f"{value!r} m") == value


@given(st.integers(-10_000_000, 10_000_000))
def test_micrometres_are_exact(count: int) -> None:
    assert si_value("a_m", f"{count} um") == float(f"{count}e-6")


def test_the_longest_suffix_names_the_unit() -> None:
    assert suffix_of("qd1_rad_s") == "rad_s"
    assert suffix_of("origin_m") == "m"
    assert suffix_of("name") is None


@pytest.mark.parametrize(
    ("written", "meant"), [("a_mm", "a_m"), ("lower_deg", "lower_rad"), ("mass_g", "mass_kg"), ("a_m", None)]
)
def test_a_key_in_another_unit_is_recognised(written: str, meant: str | None) -> None:
    assert si_name(written) == meant


def test_a_text_where_no_unit_belongs_is_refused() -> None:
    with pytest.raises(ValueError, match="stands where a number is expected"):
        si_value("gear_ratio", "3 m")
