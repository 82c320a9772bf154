"""Free space: what the oracle could remove, and how much of that the diagnosis removed."""

from collections.abc import Callable
from pathlib import Path

import msgspec
import pytest

from benchmarks.proof_comparison import FILE, ComparisonFile, by_instrument, pairs_of, read_comparison, shares_of_oracle
from benchmarks.proof_oracle import Compared
from calibeam.prove.record import SCHEMA, CaseScore, DefectScore, ProofFile

Case = Callable[..., CaseScore]
Found = Callable[..., DefectScore]


def _oracle(free_space_m: float | None) -> Compared:
    return Compared(3e-5, 1e-5, free_space_m, ())


def test_a_share_of_the_squared_error(case: Case, found: Found) -> None:
    half = case((found(),), free_space_before_m=5e-5, free_space_after_m=4e-5)
    assert shares_of_oracle([(half, _oracle(3e-5))]) == [pytest.approx(9.0 / 16.0)]  # 25, 16, 9: nine sixteenths


def test_nothing_to_share_out_is_no_share(case: Case, found: Found) -> None:
    idle = case((found(),), free_space_before_m=5e-5, free_space_after_m=5e-5)
    assert shares_of_oracle([(idle, _oracle(4.9e-5)), (case((found(),)), _oracle(None))]) == []


def test_medians_by_instrument(case: Case, found: Found) -> None:
    cases = [
        case((found(),), family=family, free_space_before_m=b, free_space_after_m=2e-5)
        for family, b in (("wire", 3e-5), ("wire", 5e-5), ("wire", 9e-5), ("tracker", 2e-5))
    ]
    tracker, wire = by_instrument([(one, _oracle(1e-5)) for one in cases])
    assert (tracker.label, tracker.cases) == ("tracker", 1)
    assert (wire.cases, wire.geometry_m, wire.found_m) == (3, pytest.approx(5e-5), pytest.approx(2e-5))


def test_a_comparison_is_read_next_to_its_proof(case: Case, found: Found, tmp_path: Path) -> None:
    cases = tuple(case((found(),), name=f"case-000{i}") for i in range(3))
    proof = ProofFile(SCHEMA, "calibeam 1", 21, True, "calibeam prove", "", 60.0, cases)
    assert pairs_of(proof, read_comparison(tmp_path)) == []
    (tmp_path / FILE).write_bytes(msgspec.json.encode(ComparisonFile(1.0, {"case-0001": _oracle(1e-5)})))
    assert pairs_of(proof, read_comparison(tmp_path)) == [(cases[1], _oracle(1e-5))]
