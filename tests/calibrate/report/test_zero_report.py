"""The report: whole, self-contained, honest about what is not determined, and quiet in a browser."""

import re
from html.parser import HTMLParser

import pytest

from calibrate.identification.evidence_record import evidence_fields
from calibrate.report.evidence import evidence
from calibrate.report.sections.proofs import proofs
from calibrate.report.sections.unseen import unseen

VOID = {"meta", "br", "hr", "img", "input", "link"}


@pytest.fixture(scope="module")
def page(zero_html) -> str:
    return zero_html


class Balance(HTMLParser):
    """Fails on a tag that is closed but not open."""

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None: ...

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag


def text_of(page: str) -> str:
    return re.sub(r"\s+", " ", re.sub(r"<[^>]*>", " ", re.sub(r"<(style|svg).*?</\1>", " ", page, flags=re.DOTALL)))


def test_proofs_of_the_same_fit_have_a_chapter_where_they_were_made(identified, page):
    proved, told = evidence_fields(identified.proved.evidence), text_of(page)
    assert all(proof.split in told for proof in proved["proofs"])
    assert len(proved["proofs"]) >= 2
    assert "drawn evenly between the joint limits" in told or proved["free_space"].says in told
    assert 'href="#proofs"' in page


def test_observability_and_alarms_stand_beside_the_proofs(identified):
    proved = evidence_fields(identified.proved.evidence)
    told = text_of(proofs(proved, ["chi-square is above the noise"]))
    calm = text_of(proofs(proved, ()))
    indices = [f"O{k}" for k in range(1, 6)]
    assert " ".join(indices) in told
    assert f"the {proved['observability'].parameters} parameters" in told
    assert "chi-square is above the noise" in told
    assert "raises no alarm" in calm
    assert "raises no alarm" not in told


def test_every_element_is_closed(page: str) -> None:
    balance = Balance()
    balance.feed(page)
    assert balance.open == []


def test_nothing_is_fetched_from_anywhere(page: str) -> None:
    addresses = re.findall(r"""(?:src|href)\s*=\s*["']([^"'#][^"']*)["']""", page)
    assert addresses == []
    assert not re.search(r"@import|url\(\s*[\"']?(?!#)", page)
    assert "<script" not in page
    assert len(page) < 2_000_000


def test_a_hostile_name_is_text(page: str) -> None:
    assert "&lt;script&gt;alert(1)&lt;/script&gt;" in page


def test_every_zero_is_told_and_undetermined_ones_without_a_number(page: str, identified) -> None:
    rows = re.findall(r"<tr>(.*?)</tr>", page, flags=re.DOTALL)
    for zero in identified.zeros.zeros:
        own = [text_of(row).strip() for row in rows if text_of(row).strip().startswith(f"J{zero.joint} ")]
        assert own
        if zero.value_rad is None:
            assert "not determined" in own[0]
            assert not re.search(r"[−-]?\d+\.\d{3,}", own[0])
        else:
            assert re.search(r"\d+\.\d{3,}", own[0])


def test_all_chapters_are_there(page: str) -> None:
    text = text_of(page)
    for chapter in (
        "The rig",
        "Spots on the faces",
        "Laser centring",
        "Residuals and noise",
        "Joint zeros and rank",
        "Four-pose point constraint",
        "What the data cannot see",
        "Provenance",
    ):
        assert chapter in text
    assert page.count("<svg") >= 9


def test_rows_left_out_of_the_fit_are_named(page: str, recorded, identified) -> None:
    assert "left out of the fit" not in text_of(page)
    known = evidence(recorded, identified.zeros, "reported")
    told = text_of(unseen(known, ["row 7, psd1_x_m: 5 mm < off; check it"]))
    assert "left out of the fit" in told
    assert "row 7, psd1_x_m: 5 mm &lt; off; check it" in told
