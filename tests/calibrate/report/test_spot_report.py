"""The report of a session with spots: whole, self-contained, quiet in a browser, no number that is not determined."""

import re
from dataclasses import replace
from html.parser import HTMLParser

import msgspec
import numpy as np
import pytest

from calibeam.results.identification import Planned, identify_session, session_model
from calibrate.fit.fit_plan import parse_plan
from calibrate.fit.solvers import Status
from calibrate.report.elements.html import provenance
from calibrate.report.elements.verdict import Trust
from calibrate.report.evidence.session_evidence import session_evidence, spot_session
from calibrate.report.evidence.session_verdict import session_verdict
from calibrate.report.sections.centring import centring
from calibrate.report.sections.proofs import proofs_chapter
from calibrate.report.sections.zeros import limited_by_measurement, zeros_of
from calibrate.report.session_report import session_answers, session_page

PLAN = 'schema = 1\nmethod = "point-constraint"\nshare = 0\n'
VOID = {"meta", "br", "hr", "img", "input", "link"}


@pytest.fixture(scope="module")
def page(spots_html) -> str:
    return spots_html


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


def test_every_zero_has_a_line_and_undetermined_ones_no_number(page: str, spots) -> None:
    rows = re.findall(r"<tr>(.*?)</tr>", page, flags=re.DOTALL)
    assert [z.joint for z in zeros_of(spots)] == [1, 2, 3, 4, 5, 6]
    for zero in zeros_of(spots):
        own = [text_of(row).strip() for row in rows if text_of(row).strip().startswith(f"J{zero.joint} ")]
        assert own
        if zero.value_rad is None:
            assert "not determined" in own[0]
            assert not re.search(r"[−-]?\d+\.\d{3,}", own[0])
        else:
            assert re.search(r"\d+\.\d{3,}", own[0])


def test_all_chapters_are_there_and_the_point_constraint_only_where_it_is_asked_for(page: str) -> None:
    text = text_of(page)
    for chapter in (
        "Joint zeros",
        "The rig",
        "Spots on the faces",
        "Laser centring",
        "Errors before and after",
        "Proof and uncertainty",
        "The data",
        "Provenance",
    ):
        assert chapter in text
    assert "Point constraint" not in text
    assert page.count("<svg") >= 9


def test_the_point_constraint_stands_next_to_the_fit_where_the_plan_names_it(recorded, spots, bare_figures) -> None:
    planned = Planned(parse_plan(PLAN, "fit.toml"), PLAN)
    found = identify_session(recorded, planned)
    assert found.point_constraints is not None
    assert len(found.point_constraints.four_poses.zeros) == 6
    np.testing.assert_allclose(found.theta, spots.theta, atol=1e-9)  # the model is that of the fit
    lines = text_of(session_page(session_evidence(recorded, session_model(found, recorded, planned))))
    assert "Point constraint" in lines
    assert "Four poses at station" in lines
    assert "centred poses at station" in lines


def test_without_a_fit_that_ended_nothing_is_trusted(spots) -> None:
    for status in (Status.NOT_FINITE, Status.OUT_OF_STEPS, Status.STALLED):
        model = msgspec.structs.replace(spots.model, status=status.name, says=status.value)
        judged = session_verdict(replace(spots, model=model))
        assert judged.trust is Trust.NONE
        assert status.value in judged.sentence


def test_noise_that_did_not_settle_and_noise_that_cannot_be_distinguished_from_none_are_said(spots) -> None:
    noise = {**spots.model.noise, "settled": False, "joint_at_zero": True}
    known = replace(spots, model=msgspec.structs.replace(spots.model, noise=noise))
    assert any("did not settle" in reason for reason in session_verdict(known).reasons)
    assert "too small to be separated from none" in text_of(proofs_chapter(known))
    assert "too small to be separated from none" not in text_of(proofs_chapter(spots))


def test_a_recording_without_centring_and_origin_says_so(spots) -> None:
    bare = replace(spots.recording, events=(), notes={}, software="", host="", started_utc="")
    session = spot_session(replace(spots, recording=bare))
    assert session is not None
    assert "The recording holds no centring run." in centring(session)
    assert provenance(bare, 9, "with both spots", "calibeam").count("not stated") >= 2


def test_a_zero_that_the_drawing_limits_is_distinguished_from_one_that_the_measurement_limits(spots) -> None:
    zero = next(z for z in zeros_of(spots) if z.joint == 4)
    assert limited_by_measurement(replace(zero, sigma_rad=2e-6, measurement_sigma_rad=1.5e-6))
    assert not limited_by_measurement(replace(zero, sigma_rad=5e-4, measurement_sigma_rad=1e-6))


def test_the_first_screen_names_every_zero_that_is_not_determined(spots) -> None:
    known = session_answers(spots).known
    for zero in zeros_of(spots):
        assert any(said.startswith(f"J{zero.joint}: not determined") for said in known) == (zero.value_rad is None)


def test_notes_of_the_recording_are_text(spots) -> None:
    noted = replace(spots.recording, notes={"<b>plan": "<img src=x>"})
    page = provenance(noted, 9, "with both spots", "calibeam")
    assert "&lt;b&gt;plan" in page
    assert "<img" not in page
