"""Sums: every hidden cause counts once, every alarm counts, and shares carry their doubt."""

from collections.abc import Callable

import pytest

from calibeam.prove.page import OTHER_PLACE, confusion
from calibeam.prove.record import CaseScore, DefectScore, NamedCause, SizeScore
from calibeam.prove.tally import Share, by_effect, by_enr, by_trouble, faults, figures, plain, share

Case = Callable[..., CaseScore]
Found = Callable[..., DefectScore]


def _said(physics: str = "backlash", *, right: bool = False, confidence: float = 0.99) -> NamedCause:
    return NamedCause("joint2.angle", "q2", physics, confidence, "", placed=right, right=right)


def test_wilson_interval_of_none_in_ten() -> None:
    """Newcombe, Statistics in Medicine 17, 1998, table I gives 0 / 20 as 0 to 0.1611."""
    assert Share(0, 20).interval == pytest.approx((0.0, 0.1611), abs=1e-4)
    assert Share(81, 263).interval == pytest.approx((0.2553, 0.3662), abs=1e-4)


def test_a_share_of_nothing_is_no_number() -> None:
    assert str(share([])) == "-"


def test_causes_count_in_their_bin(case: Case, found: Found) -> None:
    lines = {line.label: line for line in by_enr([case((found(enr=0.4),)), case((found(enr=3.0, named=False),))])}
    assert (lines["0.3 - 0.6"].named.k, lines["0.3 - 0.6"].named.n) == (1, 1)
    assert (lines["2 - 5"].named.k, lines["2 - 5"].located.k) == (0, 1)


def test_what_else_was_said_is_counted_by_case_and_not_by_mechanism(case: Case, found: Found) -> None:
    cases = [case((found(),), (_said(right=True), _said("reading-lag")))]
    assert plain(cases, "").others == "1.00"
    assert [line.others for line in by_effect(cases)] == ["-"]


def test_a_finding_in_mere_noise_is_a_false_alarm(case: Case) -> None:
    table = {f.label: f.said for f in figures([case(), case(said=(_said(),))])}
    assert table["false alarms, white noise"].startswith("50\u00a0% ")
    assert faults(case(said=(_said(),)))
    assert not faults(case())


def test_structure_that_is_claimed_in_mere_noise_is_a_false_alarm(case: Case) -> None:
    claimed = case(unexplained=True)
    assert claimed.alarmed
    assert faults(claimed) == ["false alarm"]


def test_of_faint_causes_each_name_has_to_be_right_however_uncertain(case: Case, found: Found) -> None:
    faint = found(enr=0.2)
    cases = [case((faint,), (_said(confidence=0.4), _said(right=True), _said("unknown")))]
    table = {f.label: f.said for f in figures(cases)}
    assert table["faint (0.15 - 0.3): what is named is right"].startswith("50\u00a0% ")


def test_a_name_that_is_trusted_is_not_said_to_be_unknown(case: Case, found: Found) -> None:
    outside = found(physics="unknown", named=False)
    for said, share_said in (((), "100\u00a0% "), ((_said(),), "0\u00a0% ")):
        table = {f.label: f.said for f in figures([case((outside,), said, kind="outside", unexplained=True)])}
        assert table["outside: reported as unknown"].startswith(share_said)


def test_a_confident_name_for_what_no_catalogue_lists_is_a_fault(case: Case, found: Found) -> None:
    outside = found(physics="unknown", named=False)
    assert case((outside,), (_said(),), kind="outside").misnamed
    assert not case((outside,), (_said(confidence=0.5),), kind="outside").misnamed
    assert not case((outside,), (_said("unknown", right=True),), kind="outside").misnamed


def test_a_faint_cause_need_not_be_found(case: Case, found: Found) -> None:
    assert not faults(case((found(enr=0.2, located=False, named=False),)))
    assert faults(case((found(enr=0.8, located=False, named=False),)))


def test_a_stated_size_has_to_hold() -> None:
    assert SizeScore("play_rad", 1e-4, 1.1e-4, 0.6e-5).inside
    assert not SizeScore("play_rad", 1e-4, 1.3e-4, 1e-5).inside


def test_the_right_name_at_another_place_is_not_on_the_diagonal(case: Case, found: Found) -> None:
    hidden, said, counts = confusion([case((found(located=False, named=False),), (_said("backlash"),))])
    assert hidden == ["backlash"]
    assert counts[0, said.index("backlash")] == 0
    assert counts[0, said.index(OTHER_PLACE)] == 1


def test_the_confusion_matrix_has_right_answers_on_its_diagonal(case: Case, found: Found) -> None:
    cases = [
        case((found(),), (_said(right=True),)),
        case((found(named=False),), (_said("reading-lag"),)),
        case(),
    ]
    hidden, said, counts = confusion(cases)
    assert hidden == ["backlash", "nothing"]
    assert counts[0, said.index("backlash")] == 1
    assert counts[0, said.index("reading-lag")] == 1
    assert counts[1, said.index("nothing")] == 1
    assert counts.sum() == len(cases)


def test_troubles_count_causes_alarms_and_wrong_names_of_half_confidence(case: Case, found: Found) -> None:
    spot = "detector-local-defect"
    cases = [
        case((found(named=False),), trouble=spot, holds=True),
        case((found(located=False, named=False),), (_said(confidence=0.6),), trouble=spot),
        case((), (_said(confidence=0.3),), trouble="room-temperature"),
        case((found(),), (_said(),)),
    ]
    [(label, first), (other, null)] = by_trouble(cases)
    assert (label, other) == (spot, "room-temperature")
    assert [share.k for share in first] == [2, 1, 0, 0, 1, 0, 1]
    assert [(share.k, share.n) for share in null] == [(1, 3), (0, 0), (0, 0), (0, 0), (0, 1), (1, 1), (0, 0)]
