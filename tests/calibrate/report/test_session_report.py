"""The report of any session: whole, self-contained, every parameter a number with sigma or a reason, never both."""

import re
from dataclasses import replace
from html.parser import HTMLParser

import msgspec
import numpy as np
import pytest

from acquisition.recording import RecordingError
from acquisition.recording.rig import parse_rig
from acquisition.recording.samples import measured_sha256, readings_sha256
from calibrate.errors import DataError
from calibrate.model.model_file import ModelFile
from calibrate.report.elements.html import write_page
from calibrate.report.elements.verdict import Trust
from calibrate.report.evidence.session_evidence import session_evidence
from calibrate.report.sections.arm_errors import errors_chapter
from calibrate.report.sections.parameter_tables import parameters_chapter
from calibrate.report.sections.proofs import proofs_chapter
from calibrate.report.sections.recorded_data import data_chapter
from calibrate.report.session_report import session_answers, session_page
from calibrate.report.workspace.workspace_errors import session_arm

NEWER = ("alarms", "proofs", "unproven", "observability", "free_space", "bootstrap", "plan")


@pytest.fixture(scope="module")
def poses(arm_session):
    session = arm_session()
    recording = session.recording(session.positions() | session.turns())
    return recording, session.model(recording)


@pytest.fixture(scope="module")
def page(session_html) -> str:
    return session_html


def text_of(page: str) -> str:
    return re.sub(r"\s+", " ", re.sub(r"<[^>]*>", " ", re.sub(r"<(style|svg).*?</\1>", " ", page, flags=re.DOTALL)))


class Balance(HTMLParser):
    """Fails on a tag that is closed but not open."""

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []

    def handle_starttag(self, tag: str, attrs) -> None:
        if tag not in {"meta", "br"}:
            self.open.append(tag)

    def handle_startendtag(self, tag: str, attrs) -> None: ...

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag


def test_the_page_is_whole_and_fetches_nothing(page):
    balance = Balance()
    balance.feed(page)
    assert balance.open == []
    assert re.findall(r"""(?:src|href)\s*=\s*["']([^"'#][^"']*)["']""", page) == []
    assert "<script" not in page
    assert "&lt;script&gt;alert(1)&lt;/script&gt;" in page
    assert ">nan" not in page
    ids = re.findall(r'\bid="([^"]+)"', page)
    assert len(ids) == len(set(ids))


def test_every_parameter_is_a_number_with_sigma_or_a_reason(page, wire_and_positions):
    rows = re.findall(r"<tr>(.*?)</tr>", page, flags=re.DOTALL)
    for parameter in wire_and_positions[1].parameters:
        (own,) = [row for row in rows if f"<code>{parameter.name}</code>" in row]
        numbers = re.findall(r'<td class="n">[−\d.]+', own)
        assert len(numbers) == (0 if parameter.value is None else 2), own


def test_every_instrument_has_its_errors_before_and_after(page, wire_and_positions):
    evidence = session_evidence(*wire_and_positions)
    assert [r.title for r in evidence.readings] == ["Measured positions", "Wire lengths"]
    text = text_of(page)
    for readings in evidence.readings:
        assert len(readings.rows) == 40
        assert f"{readings.title} nominal 40" in text
    first = evidence.readings[0]
    model = wire_and_positions[1]
    assert np.sqrt(np.mean(first.error_after**2)) == pytest.approx(model.rms_distance_after_m, rel=1e-9)
    assert np.sqrt(np.mean(first.error_before**2)) == pytest.approx(model.rms_distance_before_m, rel=1e-3)


@pytest.mark.parametrize("assumed", ["20e-6", "4e-6"])
def test_residuals_of_a_diagnosed_model_are_whitened_by_the_noise_that_was_found(arm_session, assumed):
    session = arm_session(120)
    recording = session.recording(session.positions())
    text = recording.rig_text.replace("position_m = 20e-6", f"position_m = {assumed}")
    recording = replace(recording, rig_text=text, rig=parse_rig(text, "rig"))
    model = session.model_of_diagnosis(recording)
    assert model.noise["position_believed"] == float(assumed)
    assert model.noise["position"] == pytest.approx(20e-6, abs=3.0 * model.noise["position_sigma"])
    assert model.noise["position_sigma"] < 2e-6
    (readings,) = session_evidence(recording, model).readings
    assert 0.8 < np.sqrt(np.mean(readings.whitened**2)) < 1.1
    assert set(session.model(recording).noise) <= set(model.noise)
    assert bool(model.alarms) == (assumed == "4e-6")


def test_residuals_are_whitened_by_the_noise_that_was_found(poses):
    for readings in session_evidence(*poses).readings:
        assert 0.8 < np.sqrt(np.mean(readings.whitened**2)) < 1.1


def test_a_pose_is_reported_as_position_in_metres_and_orientation_in_radians(poses):
    position, orientation = session_evidence(*poses).readings
    assert (position.unit, orientation.unit) == ("m", "rad")
    assert np.sqrt(np.mean(position.error_after**2)) == pytest.approx(np.sqrt(3) * 20e-6, rel=0.25)
    assert np.sqrt(np.mean(orientation.error_after**2)) == pytest.approx(np.sqrt(3) * 1e-4, rel=0.25)
    text = text_of(errors_chapter(session_evidence(*poses)))
    assert "Measured poses, orientation" in text
    assert "µrad" in text


def test_proofs_by_every_split_observability_and_free_space_are_reported(page, wire_and_positions):
    model, text = wire_and_positions[1], text_of(page)
    assert model.proofs
    for proof in model.proofs:
        assert proof.split in text
    assert "Observability of the" in text
    assert "Predicted error of the target" in text


def test_a_model_from_before_these_fields_has_a_report_too(wire_and_positions):
    recording, model = wire_and_positions
    defaults = {f.name: f.default for f in msgspec.structs.fields(ModelFile)}
    old = msgspec.structs.replace(model, **{name: defaults[name] for name in NEWER})
    known = session_evidence(recording, old)
    text = text_of(proofs_chapter(known) + parameters_chapter(known))
    assert "random 20% of the rows" in text
    assert "Observability" not in text
    assert "Predicted error of the target" not in text
    assert session_answers(known).numbers[4].value is None
    assert isinstance(session_arm(known), str)


def test_a_row_left_out_is_named_with_its_fault(arm_session):
    session = arm_session()
    columns = session.positions()
    columns["y_m"][6] += 0.1
    recording = session.recording(columns)
    known = session_evidence(recording, session.model(recording))
    assert "row 7, y_m: reads" in text_of(data_chapter(known))
    assert "of 80; 1 left out as faulty" in " ".join(session_answers(known).also)


def test_the_model_of_another_recording_is_refused(arm_session, wire_and_positions):
    session = arm_session()
    other = session.recording(session.positions())
    with pytest.raises(DataError, match="it was fitted to position, wire, here are position"):
        session_evidence(other, wire_and_positions[1])
    shorter = arm_session(60)
    with pytest.raises(DataError, match="it is of 80 samples, here are 60"):
        session_evidence(shorter.recording(shorter.positions()), session.model(other))


def test_the_model_of_other_values_is_refused(arm_session):
    session = arm_session()
    recording = session.recording(session.positions())
    columns = session.positions()
    columns["x_m"][::2] += 1e-3
    with pytest.raises(DataError, match="give the model of this recording"):
        session_evidence(session.recording(columns), session.model(recording))


def test_a_model_whose_file_differs_from_its_fit_has_a_report_with_both_numbers(arm_session):
    session = arm_session()
    recording = session.recording(session.positions())
    samples, found = recording.samples, session.model(recording)
    made_of = {"readings_sha256": readings_sha256(samples), "measured_sha256": measured_sha256(samples)}
    model = msgspec.structs.replace(found, **made_of)
    known = session_evidence(recording, model)
    assert known.not_as_fitted == ()
    other = msgspec.structs.replace(model, rms_distance_after_m=0.99 * model.rms_distance_after_m)
    judged = session_answers(session_evidence(recording, other)).verdict
    assert judged.trust is not Trust.GOOD
    assert judged.reasons[0].startswith("Read from its file, the model misses positions of its own session by ")
    page = " ".join(text_of(session_page(session_evidence(recording, other))).split())
    assert " ".join(judged.reasons[0].split()) in page


def test_a_place_that_cannot_be_written_is_named(page, tmp_path):
    file = tmp_path / "file"
    file.write_text("")
    with pytest.raises((DataError, RecordingError), match="cannot be written"):
        write_page(file / "report.html", page)
