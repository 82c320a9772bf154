"""Free space: what the oracle could remove, and how much of that the diagnosis removed."""

from collections.abc import Callable

import pytest

from calibeam.prove.record import CaseScore, DefectScore
from calibeam.prove.tally import by_instrument, shares_of_oracle

Case = Callable[..., CaseScore]
Found = Callable[..., DefectScore]


def test_a_share_of_the_squared_error(case: Case, found: Found) -> None:
    half = case(
        (found(),), free_space_before_m=5e-5, free_space_after_m=4e-5, oracle_free_space_m=3e-5
    )  # 25, 16, 9: nine sixteenths
    assert shares_of_oracle([half]) == [pytest.approx(9.0 / 16.0)]


def test_nothing_to_share_out_is_no_share(case: Case, found: Found) -> None:
    idle = case((found(),), free_space_before_m=5e-5, free_space_after_m=5e-5, oracle_free_space_m=4.9e-5)
    untold = case((found(),), oracle_free_space_m=None)
    assert shares_of_oracle([idle, untold]) == []


def test_medians_by_instrument(case: Case, found: Found) -> None:
    cases = [
        case((found(),), family=family, free_space_before_m=b, free_space_after_m=2e-5, oracle_free_space_m=1e-5)
        for family, b in (("wire", 3e-5), ("wire", 5e-5), ("wire", 9e-5), ("tracker", 2e-5))
    ]
    tracker, wire = by_instrument(cases)
    assert (tracker.label, tracker.cases) == ("tracker", 1)
    assert (wire.cases, wire.geometry_m, wire.found_m) == (3, pytest.approx(5e-5), pytest.approx(2e-5))
