"""The page of real recordings: found, left over and inferred, set by set, and what failed is said."""

from collections.abc import Callable

import msgspec
import pytest

from benchmarks.hidden_columns import HiddenAngle, HiddenColumn, RealScore, real_html
from calibrate.diagnose.record.schema import DiagnosisFile, FindingRecord, UnexplainedRecord

SAYS = "joint 2 bends under gravity"


@pytest.fixture
def found() -> Callable[..., DiagnosisFile]:
    def make(*physics: str) -> DiagnosisFile:
        findings = tuple(
            FindingRecord("joint2.angle", "tau2", "linear", None, word, {}, 30.0, 0.99, "", (), 1e-3, 20.0, 20.0)
            for word in physics
        )
        left = UnexplainedRecord("link3.offset", "q4", 1e-5, 0.2, 0.01, "something follows q4")
        said = tuple(msgspec.structs.replace(f, says=SAYS) for f in findings)
        return DiagnosisFile(1, "mismatch", 1e-5, 4e-4, 3e-4, said, left, ())

    return make


def test_a_set_says_what_was_found_what_is_left_and_what_was_inferred(found: Callable[..., DiagnosisFile]) -> None:
    angles = (
        HiddenAngle(1, 3, 1.2e-4, 1.1e-4, 2, (0.5, -1.0, 1.5)),
        HiddenAngle(2, 0, None, None, 5),
    )
    course = HiddenColumn("temp_room_degC", "link2.length", "unknown", 0.93, "")
    file = found("joint-compliance")
    page = real_html([RealScore("ur5", 900, "", file, angles, (course,), found())], "calibeam 1")
    text = page.replace("\u00a0", " ")
    assert SAYS in text
    assert "400 µm" in text
    assert "300 µm" in text
    assert "Unexplained: something follows q4" in text
    assert "120 µrad" in text
    assert "correlation 0.93" in text
    assert "Diagnosed once more without temp_room_degC: mismatch." in text
    assert 'href="ur5.html"' in text
    assert text.count("<svg") == 1


def test_the_same_without_the_column_is_said_to_be_the_same(found: Callable[..., DiagnosisFile]) -> None:
    page = real_html([RealScore("a", 900, "", found("backlash"), (), (), found("backlash"))], "calibeam 1")
    assert "without temp_room_degC: the same." in page
    assert "nothing was inferred of the temperature" in page


def test_a_set_that_failed_says_why() -> None:
    page = real_html([RealScore("torn", 4, "DataError: too few", None, (), ())], "calibeam 1")
    assert "failed: DataError: too few" in page
