"""Numbers as a person reads them: fitting unit, digits that the doubt allows, aligned columns."""

import math

import pytest

from calibrate.quantities import (
    DIGIT_SPACE,
    POINT_SPACE,
    TIED,
    aligned,
    angle,
    angle_with_sigma,
    counted,
    decimals_of,
    fixed,
    length,
    length_with_sigma,
    significant,
    stated,
)


@pytest.mark.parametrize(
    ("value_m", "said"),
    [(2.8046e-3, "2.80 mm"), (1.923e-6, "1.92 µm"), (-1.358e-7, "−136 nm"), (5.12e-10, "0.512 nm"), (0.0, "0 nm")],
)
def test_a_length_comes_in_the_unit_that_fits(value_m: float, said: str) -> None:
    assert length(value_m) == said.replace(" ", TIED)


def test_a_length_that_rounds_up_to_the_next_unit_takes_it() -> None:
    assert length(0.99999e-6) == f"1.00{TIED}µm"


def test_an_angle_comes_in_the_unit_that_fits() -> None:
    assert angle(5e-4) == f"500{TIED}µrad"


def test_what_is_no_number_is_a_dash() -> None:
    assert {fixed(math.nan, 2), significant(math.inf), length(math.nan)} == {"–"}


@pytest.mark.parametrize(
    ("value", "said"), [(1.8e-10, "1.8 × 10⁻¹⁰"), (3.97e5, "4.0 × 10⁵"), (46400.0, "46000"), (-0.871, "−0.87")]
)
def test_significant_digits_without_the_letter_e(value: float, said: str) -> None:
    assert significant(value, 2) == said.replace(" ", TIED)


@pytest.mark.parametrize(("sigma", "decimals"), [(0.00021, 5), (0.029, 3), (1.3, 1), (500.0, 0), (math.nan, 3)])
def test_decimals_show_two_digits_of_the_uncertainty(sigma: float, decimals: int) -> None:
    assert decimals_of(sigma) == decimals


def test_a_value_and_its_uncertainty_share_one_unit() -> None:
    assert angle_with_sigma(3.117e-6, 1.62e-7) == f"3.12{TIED}±{TIED}0.16{TIED}µrad"
    assert length_with_sigma(1.36e-7, 1.7e-8) == f"136{TIED}±{TIED}17{TIED}nm"


def test_a_chosen_length_has_no_digits_that_nobody_chose() -> None:
    assert stated(5e-6) == f"5{TIED}µm"


def test_a_column_lines_up_at_the_decimal_point() -> None:
    assert aligned(["−1.40", "0.7977", "12"]) == [
        f"−1.40{DIGIT_SPACE * 2}",
        "0.7977",
        f"12{DIGIT_SPACE * 4}{POINT_SPACE}",
    ]


def test_what_rounds_to_zero_has_no_sign():
    assert fixed(-1e-9, 2) == "0.00"
    assert fixed(-0.006, 2) == "−0.01"


@pytest.mark.parametrize(("number", "text"), [(0, "0 rows"), (1, "1 row"), (2, "2 rows")])
def test_a_counted_thing_has_its_plural(number: int, text: str) -> None:
    assert counted(number, "row") == text
