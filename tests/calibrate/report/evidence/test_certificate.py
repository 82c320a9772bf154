"""The report as a certificate: what the rig file states of the site, blank lines for the rest; the arm's table."""

import re
from dataclasses import replace
from datetime import date
from math import degrees
from pathlib import Path

import msgspec
import numpy as np
import pytest

from acquisition.recording.errors import RecordingError
from acquisition.recording.rig import load_rig, parse_rig, rig_text
from acquisition.recording.rig.schema import Site, SiteInstrument
from calibrate.apply.export.identified import identified_arm
from calibrate.apply.export.nominal_table import cells, nominal_table
from calibrate.model.model_file import ModelParameter
from calibrate.report.elements.html import Html, page
from calibrate.report.sections.summary import certificate

RIG = Path(__file__).parents[4] / "rigs" / "ur5e-dual-psd.toml"
SITE = """
[site]
operator = "A. Measurer"
place = "Hall 3, cell <7>"
robot = "Universal Robots UR5e"

[[site.instrument]]
name = "dual PSD"
serial_number = "17-003"
calibrated = 2026-03-01
"""


def with_site(recorded, site: Site):
    return replace(recorded, rig=msgspec.structs.replace(recorded.rig, site=site))


def test_the_rig_file_states_the_site():
    rig = parse_rig(rig_text(RIG) + SITE, "rig")
    assert rig.site.operator == "A. Measurer"
    assert rig.site.instruments == (SiteInstrument("dual PSD", "17-003", date(2026, 3, 1)),)
    assert load_rig(RIG).site == Site()


@pytest.mark.parametrize("wrong", ['operator = ""', "operater = 'x'", f'place = "{"x" * 201}"'])
def test_a_site_has_bounds_and_known_keys_only(wrong):
    with pytest.raises(RecordingError, match="site"):
        parse_rig(f"{rig_text(RIG)}\n[site]\n{wrong}\n", "rig")


def test_what_is_stated_is_printed_and_the_rest_is_a_blank_line(recorded):
    text = certificate(with_site(recorded, parse_rig(rig_text(RIG) + SITE, "rig").site))
    for stated in ("A. Measurer", "Hall 3, cell &lt;7&gt;", "Universal Robots UR5e", "17-003", "2026-03-01"):
        assert f">{stated}<" in text
    assert "print-only" not in text
    assert re.search(r"Serial number</dt><dd><span class=\"blank\"></span>", text)


def test_without_a_site_it_is_for_paper_alone(recorded):
    assert certificate(with_site(recorded, Site())).startswith('<div class="print-only">')


def test_the_head_of_a_printed_page_cannot_leave_its_string():
    text = page("t", Html(""), {}, (), "calibeam", kind="t", running='</style><script>"x')
    assert "<script" not in text
    assert r"\00003c\00002fstyle" in text


def test_calibrated_is_nominal_plus_correction_in_the_robots_signs():
    """A joint declared with sign -1 was turned round when read: the nominal offset is that of the axis as counted."""
    text = rig_text(RIG).replace("theta_offset_rad = 0.0", "theta_offset_rad = 0.25\nsign = -1", 1)
    parameters = [
        ModelParameter("joint1.zero", "rad", 0.01, 1e-4, None),
        ModelParameter("link2.length", "m", 2e-4, 1e-5, None),
        ModelParameter("joint6.zero", "rad", None, None, "no data of this kind"),
    ]
    arm = identified_arm(parse_rig(text, "rig"), {"joint1.zero": 0.01, "link2.length": 2e-4}, stated=parameters)
    shown = {words[0]: words[1:] for words in map(cells, nominal_table(arm))}
    first = [float(word.replace("\N{MINUS SIGN}", "-")) for word in shown["J1 (°)"]]
    assert first == pytest.approx(np.degrees([-0.25, 0.01, 1e-4, -0.24]), abs=5e-5)
    assert shown["a2 (mm)"] == ("\N{MINUS SIGN}425.000", "0.200", "0.010", "\N{MINUS SIGN}424.800")
    assert shown["J6 (°)"][1:] == ("not determined: no data of this kind",)


def test_the_first_screen_has_the_table_in_degrees(spots, spots_html):
    known = next(p for p in spots.model.parameters if p.name == "joint2.zero")
    rows = re.findall(r"<tr>(.*?)</tr>", spots_html, flags=re.DOTALL)
    own = next(re.sub(r"<[^>]*>", " ", row) for row in rows if ">J2 (°)<" in row)
    numbers = [float(n.replace("\N{MINUS SIGN}", "-")) for n in re.findall(r"[−-]?\d+\.\d+", own)]
    nominal, correction, sigma, calibrated = numbers
    assert correction == pytest.approx(degrees(known.value), abs=sigma)
    assert calibrated == pytest.approx(nominal + correction, abs=1e-9)
