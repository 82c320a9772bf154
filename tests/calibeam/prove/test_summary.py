"""A proof in a few sentences: each says what its kind of case came to, and nothing is said of what there was not."""

from collections.abc import Callable

import msgspec

from calibeam.prove.page import hidden_briefly, proof_html, summary
from calibeam.prove.record import SCHEMA, CaseScore, DefectScore, NamedCause, ProofFile
from calibeam.prove.tally import faults

Case = Callable[..., CaseScore]
Found = Callable[..., DefectScore]
ALARM = NamedCause("joint2.angle", "q2", "backlash", 0.99, "", placed=False, right=False)


def _plain(text: str) -> str:
    return text.replace("\u00a0", " ").replace("\u2011", "-")


def test_every_kind_of_case_has_its_sentence(case: Case, found: Found) -> None:
    strange = msgspec.structs.replace(found(physics="unknown", named=False), unknown_there=True)
    cases = [
        case((found(),)),
        case((found(named=False),)),
        case(()),
        case((), (ALARM,)),
        case((strange,), kind="outside"),
    ]
    single, nothing, outside, wrong = map(_plain, summary(cases))
    assert "2 single causes" in single
    assert "located 100 % (34-100), named 50 %" in single
    assert nothing == "2 sessions with nothing wrong: something was reported in 50 % (9-91)."
    assert "1 mechanisms of no catalogue: located 100 %" in outside
    assert wrong.startswith("2 of 5 cases")


def test_of_what_there_was_not_nothing_is_said(case: Case, found: Found) -> None:
    said = " ".join(summary([case((found(),))]))
    assert "nothing wrong" not in said
    assert "no catalogue" not in said
    proof = ProofFile(SCHEMA, "calibeam 1", 21, True, "calibeam prove", "", 60.0, (case((found(),)),))
    page = proof_html(proof)
    assert "Several at once" not in page
    assert "false alarms" not in page
    assert "In short" in page


def test_only_a_name_that_was_trusted_is_a_wrong_name(case: Case, found: Found) -> None:
    uncertain = msgspec.structs.replace(ALARM, physics="latency", confidence=0.5)
    [fault] = faults(case((found(),), (uncertain, ALARM)))
    assert fault == "misnamed with confidence: backlash at joint2.angle"
    assert faults(case((found(),), (uncertain,))) == []


def test_a_heading_says_what_was_hidden(case: Case, found: Found) -> None:
    assert hidden_briefly(case((found(enr=1.2),))) == "backlash at joint2.angle, 1.2 x noise"
    assert hidden_briefly(case((found(), found()))) == "2 causes"
    assert hidden_briefly(case(())) == "nothing, white noise"
    assert hidden_briefly(case((found(),), withheld=("approach1",))).endswith("its column withheld")
