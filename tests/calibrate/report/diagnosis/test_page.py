"""The pages of a diagnosis: everything of the file is on them, in one HTML that needs nothing else."""

import re
from types import SimpleNamespace

import msgspec
import numpy as np
import pytest

from calibrate.diagnose.record.schema import (
    CurveRecord,
    DiagnosisFile,
    FindingRecord,
    FloorRecord,
    FreeSpaceRecord,
    GrossErrorRecord,
    LackOfFitRecord,
    NameRecord,
    NoiseRecord,
    NotRecorded,
    RejectedRecord,
    RigRecord,
    RivalRecord,
    SizeRecord,
    SmallestRecord,
    SplitRecord,
    UnexplainedRecord,
)
from calibrate.errors import DataError
from calibrate.model.model_file import ModelParameter
from calibrate.report.diagnosis.diagnosis_page import (
    beyond_model,
    chapters_of,
    contents_of,
    inserted,
)
from calibrate.report.diagnosis.finding_page import (
    chain_figure,
    chain_of,
    interval_words,
    size_words,
)
from calibrate.report.diagnosis.words import missing_lines, verdict_words

Q = np.linspace(-1.5, 1.5, 60)
CURVE = CurveRecord(
    "q3", "rad", tuple(Q.tolist()), (None, *(1e-4 * np.sin(Q[1:])).tolist()), tuple((1e-4 * np.sin(Q)).tolist())
)
COMPLIANCE = ("joint3.angle", "gravity_torque3", "linear", None, "joint-compliance")
FINDING = FindingRecord(
    "joint3.angle",
    "q3",
    "harmonic",
    1,
    "encoder-eccentricity",
    parameters={"amplitude_rad": SizeRecord(1.1e-4, 4e-6), "phase_rad": SizeRecord(0.4, 0.03)},
    share=0.83,
    confidence=0.9,
    says="Joint 3 reads off by <110> µrad",
    rivals=(RivalRecord(*COMPLIANCE, confidence=0.1, margin=4.4),),
    p=1e-9,
    bic_gain=80.0,
    held_out_gain=70.0,
    curve=CURVE,
)
FILE = DiagnosisFile(
    schema=1,
    verdict="mismatch",
    noise_floor_m=2.1e-6,
    rms_before_m=4.1e-5,
    rms_after_m=2.2e-6,
    findings=(FINDING,),
    unexplained=UnexplainedRecord("joint5.angle", "", 1e-6, 0.2, 0.003, "scatter without a column"),
    next=("encoder-eccentricity at joint3.angle could also be another: measure more",),
    rig=RigRecord("irb", "0"),
    samples=60,
    splits=(SplitRecord("random", "dual-psd", 12, 0, 4.1e-5, 2.2e-6, 0.9, 0.99),),
    floors=(FloorRecord("dual-psd", 2.1e-6, "scatter within repeats"),),
    free_space=FreeSpaceRecord(2e-4, 8e-6, 300),
    lack_of_fit=LackOfFitRecord(15, 0.98, 0.5, False),
    rejected=(RejectedRecord("joint4.angle", "q4", "sign", None, "backlash", bic_gain=-3.0, why="too little"),),
    invisible=(NameRecord("psd1.reading", "incidence1", "smooth", None, "psd-cover-glass"),),
    confusable=((NameRecord(*COMPLIANCE), NameRecord("joint3.angle", "q3", "linear", None, "gear-ratio-error"), 0.98),),
    not_recorded=(NotRecorded("payload", "payload_kg", "payload-compliance"),),
    blunders=(GrossErrorRecord("bad shot", (8,), "x_m", "row 8, x_m: far off; measure it again"),),
)


@pytest.fixture(scope="module")
def text():
    return "".join(chapters_of(FILE, 6))


@pytest.mark.parametrize(
    "said",
    [
        "Joint 3 reads off by &lt;110&gt; µrad",
        "110.0 ± 4.0 µrad".replace(" ", "\N{NO-BREAK SPACE}"),
        "joint-compliance at joint3.angle",
        "scatter without a column",
        "payload_kg",
        "backlash at joint4.angle",
        "psd-cover-glass at psd1.reading",
        "row 8, x_m: far off",
        "0.980",
        "What to do",
    ],
)
def test_everything_that_was_said_is_on_the_pages(text, said):
    assert said in text


def test_every_heading_of_the_contents_has_its_chapter(text):
    assert set(contents_of(FILE)) <= set(re.findall(r'<section id="([^"]*)"', text))


def test_the_place_is_marked_in_the_chain_and_nowhere_else():
    drawn = chain_figure("1", "psd2.reading", chain_of(6, ("dual-psd",)))
    assert drawn.count("reading</text>") == 1
    assert "PSD 2" in drawn
    assert "device" not in drawn


@pytest.mark.parametrize(
    ("name", "size", "said"),
    [
        ("phase_rad", SizeRecord(np.pi / 2, np.pi / 180), "90.0 ± 1.0 °"),
        ("shift_x_m", SizeRecord(2e-5, 1e-6), "20.0 ± 1.0 µm"),
        ("compliance_rad_nm", SizeRecord(6.8e-5, 2e-6), "68.0 ± 2.0 µrad per Nm"),
        ("drift_s_per_s", SizeRecord(-4e-4, 2e-6), "\N{MINUS SIGN}400.0 ± 2.0 µs per s"),
        ("frequency_hz", SizeRecord(7.0, 0.02), "7.000 ± 0.020 Hz"),
        ("expansion_per_k", SizeRecord(1.2e-5, 1e-6), "12.0 ± 1.0 µm per m and K"),
        ("order", SizeRecord(None, 1.0), "\N{EN DASH}"),
    ],
)
def test_sizes_have_a_unit_that_fits(name, size, said):
    assert size_words(name, size).replace("\N{NO-BREAK SPACE}", " ") == said


def test_an_interval_holds_95_of_100_sizes():
    said = interval_words("compliance_rad_nm", SizeRecord(6.8e-5, 2e-6)).replace("\N{NO-BREAK SPACE}", " ")
    assert said == "64.1 to 71.9 µrad per Nm"
    assert interval_words("samples_count", SizeRecord(20.0, 0.0)) == "\N{EN DASH}"


def test_the_largest_size_that_a_machine_shows_stands_next_to_it(text):
    assert "a machine shows at most" not in text
    known = msgspec.structs.replace(FILE, findings=(msgspec.structs.replace(FINDING, plausible_to=3e-4),))
    assert "300 µrad" in "".join(chapters_of(known, 6)).replace("\N{NO-BREAK SPACE}", " ")


def test_the_verdict_says_whether_noise_is_what_remains():
    lines = msgspec.structs.replace(FILE, unexplained=None, also_unexplained=())
    assert verdict_words(lines).endswith("what remains is noise.")
    assert "stays without a name" in verdict_words(FILE)


def test_pages_go_before_the_last_chapter_of_another_report():
    rig = SimpleNamespace(name="irb", arm=SimpleNamespace(joints=(None,) * 6))
    contents, chapters = inserted({"a": "A", "provenance": "P"}, ["first", "last"], FILE, rig)
    assert list(contents) == ["a", *contents_of(FILE), "provenance"]
    assert (chapters[0], chapters[-1]) == ("first", "last")
    assert len(chapters) == 2 + len(contents_of(FILE))


def test_a_diagnosis_of_another_rig_is_refused():
    with pytest.raises(DataError, match="of rig 'irb', the recording of 'other'"):
        inserted({}, [], FILE, SimpleNamespace(name="other"))


def noise(statement, times):
    words = f"noise of the spots is {times} × the stated value" if statement == "wrong" else ""
    stated = None if times is None else 1e-6
    return NoiseRecord("dual-psd", "", "m", stated, 2.1e-6, times, None, statement, words)


def test_noise_is_said_only_where_it_is_stated_and_what_is_wrong_with_the_statement():
    quiet = msgspec.structs.replace(FILE, unexplained=None, verdict="consistent", findings=())
    wrong = msgspec.structs.replace(quiet, noise=(noise("wrong", 2.1),))
    assert "2.1 × the stated value" in verdict_words(wrong)
    unstated = msgspec.structs.replace(quiet, noise=(noise("absent", None),))
    assert "beyond the noise" not in verdict_words(unstated)
    found = msgspec.structs.replace(FILE, unexplained=None, noise=(noise("absent", None),))
    assert "remains is noise" not in verdict_words(found)


def test_every_split_is_compared_with_the_noise():
    last = SplitRecord("last block", "dual-psd", 12, 0, 4.1e-5, 6.3e-6, 0.9, 0.99)
    lines = msgspec.structs.replace(FILE, unexplained=None, splits=(*FILE.splits, last))
    assert "missed by 3 times the noise" in verdict_words(lines)


SMALLEST = SmallestRecord(
    "joint3.angle", "payload_torque3", "linear", None, "payload-compliance", "compliance_rad_nm", 1e-6
)


def test_a_cause_is_never_both_tested_and_not_tested():
    """Another recorded column can show physics of which one column is missing."""
    consistent = msgspec.structs.replace(FILE, verdict="consistent", findings=(), unexplained=None)
    both = msgspec.structs.replace(consistent, smallest=(SMALLEST,))
    page = "".join(chapters_of(both, 6))
    assert "Not tested: columns that are missing" not in page
    assert "payload_kg" in page
    assert missing_lines(both) == ["tested in part: payload compliance (column payload_kg is missing)"]
    other = msgspec.structs.replace(SMALLEST, physics="joint-compliance")
    neither = msgspec.structs.replace(consistent, smallest=(other,))
    assert "Not tested: columns that are missing" in "".join(chapters_of(neither, 6))
    assert missing_lines(neither) == ["not tested: payload compliance (column payload_kg is missing)"]


def test_no_cause_is_confused_with_itself():
    third, fourth = (NameRecord("joint3.angle", "q3", "harmonic", n, "encoder-harmonic") for n in (3, 4))
    file = msgspec.structs.replace(FILE, confusable=((third, fourth, 0.99),))
    assert "Cannot be separated" not in "".join(chapters_of(file, 6))
    assert "Cannot be separated with these poses: 1 pair of causes" in "".join(chapters_of(FILE, 6))


def with_parameters(model, names):
    found = tuple(ModelParameter(name, "rad", 1e-4, 1e-5, None) for name in names)
    return msgspec.structs.replace(model, parameters=found)


@pytest.mark.endure  # a whole diagnosis of second encoders for one sentence
def test_discs_that_the_calibrated_arm_holds_are_no_findings_about_it(spots):
    file = msgspec.structs.replace(FILE, unexplained=None)
    discs = with_parameters(spots.model, ["joint3.disc_sine", "joint3.disc_cosine"])
    left, held = beyond_model(file, discs)
    assert (left.verdict, left.findings, held) == ("consistent", (), file.findings)
    page = "".join(chapters_of(left, 6, held))
    assert "part of the calibrated arm already" in page
    assert "Recording and model agree" in page
    half = with_parameters(spots.model, ["joint3.disc_sine", "joint2.disc_sine", "joint2.disc_cosine"])
    assert beyond_model(file, half) == (file, ())


def test_what_else_was_found_still_differs(spots):
    discs = with_parameters(spots.model, ["joint3.disc_sine", "joint3.disc_cosine"])
    soft = msgspec.structs.replace(FINDING, where="joint2.angle", physics="joint-compliance")
    left, held = beyond_model(msgspec.structs.replace(FILE, findings=(FINDING, soft)), discs)
    assert (left.verdict, left.findings, held) == ("mismatch", (soft,), (FINDING,))
