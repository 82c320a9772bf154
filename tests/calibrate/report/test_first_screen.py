"""The first screen: three questions answered in words, the numbers; and every figure can be read on paper."""

import re
from dataclasses import replace
from html.parser import HTMLParser

import msgspec
import numpy as np
import pytest

from calibeam.results.session_results import accuracy_of
from calibrate.report.elements.verdict import (
    MARKS,
    Answers,
    Number,
    Trust,
    VerdictBox,
    first_screen,
)
from calibrate.report.evidence.session_evidence import session_evidence
from calibrate.report.session_report import session_answers
from calibrate.report.workspace.workspace_errors import session_room

QUESTIONS = ("How good is it now?", "Can I trust it?", "What to do?")
PAGE_MM, PANEL_MM = 182.0, 88.0  # of A4 less the margins of report.css; half of it less the gap
LEAST_PT = 7.0
MM = 72.0 / 25.4


@pytest.fixture(scope="module")
def known(arm_session):
    session = arm_session(60)
    recording = session.recording(session.positions())
    return session_evidence(recording, session.model(recording))


class Letters(HTMLParser):
    """Smallest letter of every figure as printed (pt), by its label."""

    def __init__(self) -> None:
        super().__init__()
        self.wide: list[bool] = []
        self.scale, self.label = 1.0, ""
        self.printed: dict[str, float] = {}

    def handle_starttag(self, tag: str, attrs) -> None:
        attributes = dict(attrs)
        if tag == "div":
            self.wide.append("wide" in attributes.get("class", ""))
        if tag == "svg":
            room = PAGE_MM if any(self.wide) else PANEL_MM
            self.scale = room * MM / float(attributes["viewbox"].split()[2])
            self.label = attributes["aria-label"]
        if tag == "text":
            style = attributes.get("style", "")
            size = re.search(r"(?:font-size:\s*|font:[^;]*?)([\d.]+)px", style)
            assert size is not None, style
            self.printed[self.label] = min(self.printed.get(self.label, 99.0), float(size[1]) * self.scale)

    def handle_endtag(self, tag: str) -> None:
        if tag == "div":
            self.wide.pop()


@pytest.mark.parametrize("trust", list(Trust))
def test_trust_is_reported_by_mark_and_word_not_by_colour_alone(trust):
    number = Number("now", "Identified", 1e-4, "m", "100 µm", "rms")
    page = first_screen(Answers(VerdictBox(trust, "It is so.", ("because",), ("do it",)), (number, number, number)))
    assert all(question in page for question in QUESTIONS)
    assert all(part in page for part in MARKS[trust])
    assert "because" in page
    assert "do it" in page


def test_the_tool_comes_first_then_readings_and_anywhere(known):
    answers, proof = session_answers(known), known.model.proofs[0]
    assert [n.key for n in answers.numbers] == ["tool_nominal", "tool_calibrated", "as_drawn", "now", "anywhere"]
    room = session_room(known)
    assert answers.numbers[0].value == np.sqrt(np.mean(room.drawn_m[room.supported] ** 2))
    assert answers.numbers[1].value == np.sqrt(np.mean(room.found_m[room.supported] ** 2))
    assert answers.numbers[1].value < answers.numbers[0].value
    assert [n.value for n in answers.numbers[2:]] == [
        proof.rms_distance_before_m,
        proof.rms_distance_after_m,
        known.model.free_space.pose_p95_m,
    ]


def test_a_number_that_cannot_be_reported_is_a_dash_with_its_reason(known):
    hidden = msgspec.structs.replace(known.model.free_space, pose_p95_m=None, says="something moves the target")
    model = msgspec.structs.replace(known.model, free_space=hidden)
    number = session_answers(replace(known, model=model)).numbers[4]
    assert number.value is None
    assert number.said == "–"
    assert "something moves the target" in number.about


def test_no_letter_of_a_figure_is_smaller_than_seven_points_on_paper(session_html, spots_html):
    for page in (session_html, spots_html):
        letters = Letters()
        letters.feed(page)
        assert len(letters.printed) >= 6
        small = {label: round(size, 2) for label, size in letters.printed.items() if size < LEAST_PT}
        assert small == {}


@pytest.mark.parametrize(("limit", "ends"), [("", "nominal)"), ("limited by link 6", "; limited by link 6")])
def test_a_session_ends_with_one_number_and_what_limits_it(limit, ends):
    tool = [Number(f"tool_{k}", k, 1e-4, "m", said, "") for k, said in (("nominal", "9 mm"), ("calibrated", "4 µm"))]
    other = Number("now", "unseen", 1e-5, "m", "5 µm", "")
    said = accuracy_of(Answers(VerdictBox(Trust.CARE, "It is so.", (), ()), (*tool, other), limit=limit))
    assert "4 µm" in said
    assert "5 µm" not in said
    assert said.endswith(ends)
