"""One case: said against hidden, by the words of the file formats."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from acquisition.recording.files import write_json
from calibeam.prove.concealing import Concealed
from calibeam.prove.diagnosing import Answered
from calibeam.prove.record import CaseScore, Exact, FreeSpace, TrueDefect, TrueNoise, Truth
from calibeam.prove.scenario import Scenario
from calibeam.prove.scoring import score
from calibeam.prove.seal import Layout
from calibrate.compare.comparison_file import ComparisonFile, DifferenceRecord
from calibrate.diagnose.record.file import write_diagnosis
from calibrate.diagnose.record.schema import (
    DiagnosisFile,
    FindingRecord,
    GrossErrorRecord,
    NotRecorded,
    RivalRecord,
    SizeRecord,
    UnexplainedRecord,
)
from simulators.conceal.wanted import SimulationKind, Wanted

NAME = "case-0000"
JOINT = """
[[arm.joint]]
a_m = 0.4
alpha_rad = 0.0
d_m = 0.0
theta_offset_rad = 0.0
lower_rad = -3.0
upper_rad = 3.0
"""
RIG = f"""
schema = 1
name = "two joints"
[arm]
model = "dh"
gravity_m_s2 = [0, 0, -9.81]
{JOINT}
{JOINT}
[tool]
point_m = [0.0, 0.0, 0.0]
"""
NOISE_M = 1e-5

Scored = Callable[..., CaseScore]
MakeDefect = Callable[..., TrueDefect]


@pytest.fixture
def scored(tmp_path: Path) -> Scored:
    """Of defects, findings and what else a file says."""

    def run(
        defects: tuple[TrueDefect, ...],
        *findings: FindingRecord,
        withheld: tuple[str, ...] = (),
        confused: bool = False,
        trouble: str = "",
        beside: SimulationKind | None = None,
        differences: tuple[DifferenceRecord, ...] = (),
        **more: object,
    ) -> CaseScore:
        layout = Layout(tmp_path)
        exact = _write_recording(layout.recording(NAME))
        fields: dict[str, object] = {"verdict": "mismatch" if findings else "consistent", "unexplained": None} | more
        file = DiagnosisFile(
            schema=1,
            noise_floor_m=NOISE_M,
            rms_before_m=5e-5,
            rms_after_m=1e-5,
            findings=findings,
            next=(),
            **fields,  # type: ignore[arg-type]
        )
        write_diagnosis(layout.answer(NAME) / "diagnosis.json", file)
        none: tuple[()] = ()
        said = ComparisonFile(
            1, "calibeam-comparison", "", "", "", 400, none, none, file.verdict, "", none, differences, none, none,
            None, none, none, none, file,
        )  # fmt: skip
        write_json(layout.answer(NAME) / "compare.json", said)
        truth = Truth({}, defects, withheld, TrueNoise("white", NOISE_M, NOISE_M), Exact(exact), FreeSpace())
        kind = "withheld" if withheld else "one"
        scenario = Scenario(NAME, kind, Wanted("tracker", seed=5000, confused=confused, beside=beside), trouble=trouble)
        concealed = Concealed(scenario, "", b"", 0)
        return score(layout, concealed, Answered(NAME, 1.0, ""), truth)

    return run


def _write_recording(folder: Path) -> list[list[float]]:
    rng = np.random.default_rng(1)
    exact = rng.uniform(-0.5, 0.5, (400, 3))
    seen = exact + NOISE_M * rng.standard_normal(exact.shape)
    seen[7] += 0.01  # wild: of nobody's making
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "rig.toml").write_text(RIG, encoding="utf-8")
    rows = [f"{i},{0.1},{0.2},{','.join(map(repr, row.tolist()))}" for i, row in enumerate(seen)]
    (folder / "samples.csv").write_text("\n".join(["t_s,q1_rad,q2_rad,x_m,y_m,z_m", *rows]) + "\n", encoding="utf-8")
    return exact.tolist()


def _finding(where: str, physics: str, depends_on: str = "q2", **more: object) -> FindingRecord:
    fields: dict[str, object] = {"rivals": (), "parameters": {}} | more
    return FindingRecord(
        where,
        depends_on,
        "harmonic",
        1,
        physics,
        share=1.0,
        confidence=0.99,
        says="",
        p=1e-4,
        bic_gain=100.0,
        held_out_gain=50.0,
        **fields,  # type: ignore[arg-type]
    )


def test_place_and_physics_are_named(scored: Scored, defect: MakeDefect) -> None:
    size = {"amplitude_rad": SizeRecord(1.05e-4, 4e-6)}
    case = scored((defect(),), _finding("joint2.angle", "encoder-eccentricity", parameters=size))
    [one] = case.defects
    assert (one.located, one.named, one.driver, one.among_rivals) == (True, True, True, True)
    assert [(s.name, s.inside) for s in one.sizes] == [("amplitude_rad", True)]
    assert not case.misnamed


def test_another_place_is_neither_located_nor_named(scored: Scored, defect: MakeDefect) -> None:
    case = scored((defect(),), _finding("joint3.angle", "encoder-eccentricity"))
    assert (case.defects[0].located, case.defects[0].named) == (False, False)
    assert case.misnamed


def test_a_rival_that_is_true_counts_as_said(scored: Scored, defect: MakeDefect) -> None:
    rival = RivalRecord("joint2.angle", "q2", "harmonic", 1, "encoder-eccentricity", confidence=0.4, margin=1.0)
    case = scored((defect(),), _finding("joint2.angle", "encoder-harmonic", rivals=(rival,)))
    assert (case.defects[0].named, case.defects[0].among_rivals) == (False, True)


def test_each_of_several_causes_needs_a_finding_of_its_own(scored: Scored, defect: MakeDefect) -> None:
    two = (defect(), defect("backlash", "joint4.angle"))
    case = scored(two, _finding("joint2.angle", "encoder-eccentricity"))
    assert [d.named for d in case.defects] == [True, False]


def test_a_name_is_that_of_one_cause_at_its_place(scored: Scored, defect: MakeDefect) -> None:
    two = (defect("backlash"), defect("encoder-eccentricity"))
    case = scored(two, _finding("joint2.angle", "encoder-eccentricity"))
    assert [(d.located, d.named) for d in case.defects] == [(False, False), (True, True)]


def test_unknown_may_stand_for_two_causes_at_its_place(scored: Scored, defect: MakeDefect) -> None:
    two = (defect("backlash"), defect("encoder-eccentricity"))
    case = scored(two, _finding("joint2.angle", "unknown"))
    assert [(d.located, d.named) for d in case.defects] == [(True, False), (True, False)]


def test_of_two_causes_alike_the_one_whose_driver_is_said_is_named(scored: Scored, defect: MakeDefect) -> None:
    two = (defect("joint-coupling", drivers=("q4",)), defect("joint-coupling", drivers=("q5",)))
    case = scored(two, _finding("joint2.angle", "joint-coupling", depends_on="q5"))
    assert [d.named for d in case.defects] == [False, True]


def test_all_findings_count_for_a_single_cause(scored: Scored, defect: MakeDefect) -> None:
    case = scored((defect(),), _finding("joint2.angle", "backlash"), _finding("joint2.angle", "encoder-eccentricity"))
    assert case.defects[0].named


def test_unknown_at_its_place_is_right_for_what_no_catalogue_lists(scored: Scored, defect: MakeDefect) -> None:
    case = scored((defect("unknown"),), _finding("joint2.angle", "unknown"))
    assert case.kind == "outside"
    assert case.defects[0].unknown_there
    assert not case.misnamed


@pytest.mark.parametrize(("physics", "located"), [("unknown", True), ("backlash", False)])
def test_only_what_no_catalogue_lists_may_be_left_unexplained_at_its_place(
    scored: Scored, defect: MakeDefect, physics: str, located: bool
) -> None:
    there = UnexplainedRecord("joint2.angle", "cmd_minus_q", 1e-5, 0.2, 1e-6, "scatter")
    case = scored((defect(physics),), unexplained=there)
    assert case.defects[0].located is located


def test_a_missing_column_has_to_be_named_as_uncertain(scored: Scored, defect: MakeDefect) -> None:
    lacking = (NotRecorded("approach2", "approach1 ...", "backlash"),)
    hidden = (defect("backlash"),)
    assert scored(hidden, withheld=("approach",), verdict="undecidable", not_recorded=lacking).asks_for


def test_a_missing_column_is_not_asked_for_by_calling_all_consistent(scored: Scored, defect: MakeDefect) -> None:
    lacking = (NotRecorded("approach2", "approach1 ...", "backlash"),)
    assert not scored((defect("backlash"),), withheld=("approach",), not_recorded=lacking).asks_for


def test_the_floor_is_the_noise_that_was_added(scored: Scored, defect: MakeDefect) -> None:
    case = scored((defect(),))
    assert case.floor_m == pytest.approx(NOISE_M, rel=0.05)


def test_all_stations_moved_is_a_base_moved_the_other_way_if_the_answer_states_both(
    scored: Scored, defect: MakeDefect
) -> None:
    table = defect("fixture-moved", "fixture*.pose", drivers=("t",), figures={})
    tied = RivalRecord("fixture.pose", "t", "step", None, "fixture-moved", confidence=0.5, margin=0.0)
    [alone] = scored((table,), _finding("base.pose", "base-moved", "t")).defects
    assert (alone.located, alone.named) == (True, False)
    both = scored((table,), _finding("base.pose", "base-moved", "t", rivals=(tied,)))
    assert both.defects[0].named
    assert not both.misnamed
    assert scored((table,), _finding("fixture.pose", "fixture-moved", "t")).defects[0].named


def test_a_part_of_the_cause_is_neither_its_name_nor_a_wrong_one(scored: Scored, defect: MakeDefect) -> None:
    hysteresis = defect("load-hysteresis", also=("joint-compliance",))
    case = scored((hysteresis,), _finding("joint2.angle", "joint-compliance"))
    assert (case.defects[0].located, case.defects[0].named) == (True, False)
    assert not case.misnamed


def test_a_confused_convention_is_named_by_a_fault_of_the_file_that_says_so(scored: Scored, defect: MakeDefect) -> None:
    confused = defect("rig-convention", "arm.model", drivers=(), figures={})
    fault = GrossErrorRecord("table", (), "", "the table seems to be in the other form of Denavit and Hartenberg")
    [named] = scored((confused,), confused=True, blunders=(fault,)).defects
    assert (named.located, named.named) == (True, True)
    [other] = scored((confused,), confused=True, blunders=(GrossErrorRecord("degrees", (), "", "degrees"),)).defects
    assert not other.located


def test_of_a_raised_trouble_structure_without_a_name_at_its_place_is_located(
    scored: Scored, defect: MakeDefect
) -> None:
    left = UnexplainedRecord("psd1.reading", "spot1", 1e-5, 0.5, 1e-4, "")
    spot = defect("psd-local-defect", "psd1.reading", drivers=("spot1",), figures={})
    assert scored((spot,), trouble="detector-local-defect", unexplained=left).defects[0].located
    assert not scored((spot,), unexplained=left).defects[0].located


@pytest.mark.parametrize(("rows", "located"), [((76, 77, 79), True), ((76, 77, 90), False), ((), False)])
def test_a_few_rows_that_stood_at_another_place_locate_a_shift_of_their_time(
    scored: Scored, defect: MakeDefect, rows: tuple[int, ...], located: bool
) -> None:
    shift = defect("base-moved", "base.pose", drivers=("t",), figures={"at_s": 70.0, "until_s": 80.0})
    left = UnexplainedRecord("", "time", 1e-5, 0.5, 1e-4, "rows 76 to 79 stood elsewhere")
    shots = tuple(GrossErrorRecord("bad shot", (row,), "x_m", "far away") for row in rows)
    assert scored((shift,), unexplained=left, blunders=shots).defects[0].located is located


def _difference(level: str, where: str, physics: str, side: str = "", **sizes: SizeRecord) -> DifferenceRecord:
    return DifferenceRecord(level, where, physics, sizes, side, True, 1e-4, "", (), {})


@pytest.mark.parametrize("side", ["simulated", "measured", "both"])
def test_what_the_simulation_has_too_much_is_located_on_its_side_only(
    scored: Scored, defect: MakeDefect, side: str
) -> None:
    found = _finding("joint2.angle", "encoder-eccentricity", parameters={"amplitude_rad": SizeRecord(-1.05e-4, 4e-6)})
    difference = _difference("effects", "joint2.angle", "encoder-eccentricity", side)
    case = scored((defect(),), found, beside="too-much", differences=(difference,))
    [one] = case.defects
    mine = side == "simulated"
    assert (one.located, one.named, case.misnamed) == (mine, mine, not mine)
    assert [size.inside for size in one.sizes] == [True] * mine


def test_constants_that_are_off_are_no_effect(scored: Scored, defect: MakeDefect) -> None:
    zero = defect("joint-zero-moved", "joint3.angle", drivers=(), figures={"zero_rad": 1e-3})
    link = defect("link-changed", "link2.length", drivers=(), figures={"length_m": 1e-4})
    given = _difference("joint-zeros", "joint3.angle", "joint-zero-moved", zero_rad=SizeRecord(1.01e-3, 1e-5))
    case = scored((zero, link), beside="constants", differences=(given,))
    assert [(one.located, one.named) for one in case.defects] == [(True, True), (False, False)]
    assert [size.inside for size in case.defects[0].sizes] == [True]
    assert case.holds
    effect = _finding("link2.angle", "link-bending")
    also = _difference("effects", "link2.angle", "link-bending", "measured")
    wrong = scored((zero, link), effect, beside="constants", differences=(given, also))
    assert wrong.misnamed
    assert not wrong.holds


def test_few_rows_are_no_mismatch_without_their_cause(scored: Scored, defect: MakeDefect) -> None:
    assert scored((defect(),), trouble="few-rows").holds
    assert scored((defect(),), trouble="few-rows", verdict="undecidable").holds
    assert scored((defect(),), _finding("joint2.angle", "backlash"), trouble="few-rows").holds
    assert scored((defect(),), _finding("joint3.angle", "backlash"), trouble="few-rows").holds is False
    assert scored((defect(),)).holds is None


def test_a_replay_that_was_not_made_does_not_agree(scored: Scored, defect: MakeDefect) -> None:
    assert scored((defect(),), trouble="three-targets").holds is False
