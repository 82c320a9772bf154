"""After the reveal: an oracle, other methods, and columns hidden on purpose, on one session with one effect."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pytest

from acquisition.recording import read
from benchmarks.hidden_columns import SEED, hidden_angles
from benchmarks.proof_baselines import features
from benchmarks.proof_oracle import GEOMETRY, compare, fold_of, oracle_terms
from calibeam.prove.record import Truth, truth_of
from calibeam.prove.scoring import errors_m
from calibeam.prove.unseen import tool_at, write_asked
from calibrate.diagnose.assess.diagnosis import Verdict
from calibrate.diagnose.assess.unseen_rows import splits_of
from calibrate.diagnose.record.file import write_diagnosis
from calibrate.diagnose.record.schema import DiagnosisFile
from calibrate.diagnose.search.bench import Bench
from calibrate.diagnose.search.stated_sizes import sizes_of
from calibrate.diagnose.state.fitted import Fitted, fit_geometry
from calibrate.diagnose.state.session import session_of
from simulators.conceal.case import conceal
from simulators.conceal.case_files import truth_document, write_case
from simulators.conceal.wanted import Family, Wanted

WANTED = Wanted("tracker", seed=41, defects=("encoder-eccentricity",), enr=3.0, samples=200)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("case")
    write_case(conceal(WANTED), out)
    return out / "recording"


@pytest.fixture(scope="module")
def document() -> dict[str, Any]:
    return truth_document(conceal(WANTED))


@pytest.fixture(scope="module")
def truth(document: dict[str, Any]) -> Truth:
    return truth_of(msgspec.json.encode(document))


@pytest.fixture(scope="module")
def state(folder: Path) -> Fitted:
    source = read(folder)
    return fit_geometry(session_of(source.rig, source.samples))


def test_the_oracle_fits_what_is_true(state: Fitted, truth: Truth) -> None:
    terms = oracle_terms(state, truth.defects, "tracker")
    assert terms is not None
    assert {(a.term.port.where, a.term.physics) for a in terms} == {(truth.defects[0].port, "encoder-eccentricity")}


def test_there_is_no_oracle_for_what_no_catalogue_lists(state: Fitted, truth: Truth) -> None:
    unlisted = msgspec.structs.replace(truth.defects[0], physics="unknown")
    assert oracle_terms(state, (unlisted,), "tracker") is None


def test_a_diagnosis_that_finds_nothing_gains_nothing(
    folder: Path, document: dict[str, Any], truth: Truth, tmp_path: Path
) -> None:
    silent = DiagnosisFile(1, Verdict.CONSISTENT.value, 1e-5, 1e-5, 1e-5, (), None, ())
    write_diagnosis(tmp_path / "diagnosis.json", silent)
    write_asked(document["free_space"], tmp_path / "asked.csv")
    found = compare(folder, tmp_path, tmp_path / "asked.csv", truth, "tracker")
    assert found is not None
    assert found.free_space_m is not None
    assert found.free_space_m < 1e-4  # noise of 15 um, over poses that nobody measured
    assert found.oracle_m < 0.5 * found.before_m
    gains = {b.method: b.gain for b in found.baselines}
    assert gains[GEOMETRY] == 0.0
    assert gains["diagnosis"] == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize(
    ("family", "mechanism"),
    [
        pytest.param("tracker", "wrong-gear-ratio", marks=pytest.mark.endure),  # seconds
        ("tracker", "coupled-wrist"),
        pytest.param("tracker", "unsettled", marks=pytest.mark.endure),
        ("dual-psd", "psd-gain"),
        pytest.param("dual-psd", "psd-pincushion", marks=pytest.mark.endure),
    ],
)
def test_the_true_size_has_the_name_and_the_sign_of_the_stated_one(
    family: Family, mechanism: str, tmp_path: Path
) -> None:
    """Else it would never be held against it: what is stated of the true term, fitted to plain data, is the truth."""
    case = conceal(Wanted(family, seed=47, defects=(mechanism,), enr=6.0, samples=160))
    write_case(case, tmp_path)
    source = read(tmp_path / "recording")
    state = fit_geometry(session_of(source.rig, source.samples))
    terms = oracle_terms(state, truth_of(msgspec.json.encode(truth_document(case))).defects, family)
    assert terms is not None
    stated = sizes_of(Bench(state.refitted(terms)), 0)
    for name, true in case.hidden[0].defect.figures.items():
        assert abs(stated[name].value - true) < max(4.0 * stated[name].sigma, 0.1 * abs(true))


def test_learners_are_not_given_the_answer(state: Fitted) -> None:
    """No feature is a reading as measured, nor follows the misfit by itself."""
    fold = fold_of(state, 1)
    X, names = features(fold.geometry)
    unseen = fold.geometry.held_out(fold.test)[0]
    assert len(names) == X.shape[1]
    matched = [abs(np.corrcoef(column[unseen.sample], unseen.misfit[:, 0])[0, 1]) for column in X.T]
    assert max(matched) < 0.9


def test_a_hidden_angle_is_inferred_as_well_as_stated(folder: Path) -> None:
    for hidden in hidden_angles(read(folder)):
        if hidden.rms_rad is not None and hidden.expected_rad is not None:
            assert hidden.rms_rad < 2.0 * hidden.expected_rad


def test_the_uncertainty_of_a_hidden_angle_does_not_hang_on_the_angle(folder: Path) -> None:
    """A joint column that is wrong where it is hidden changes what is missed, and not the doubt stated before."""
    recording = read(folder)
    state = fit_geometry(session_of(recording.rig, recording.samples))
    samples = np.unique(state.rows.sample[state.rows.data])
    test = splits_of(state.drivers, samples, np.random.default_rng(SEED))[0].unseen[0]
    wrong = dict(recording.samples.columns) | {"q2_rad": recording.samples.column("q2_rad").copy()}
    wrong["q2_rad"][test] += 2e-3
    samples_off = replace(recording.samples, columns=wrong)
    fair, off = (hidden_angles(replace(recording, samples=s))[1] for s in (recording.samples, samples_off))
    assert fair.rms_rad is not None
    assert off.rms_rad is not None
    assert fair.expected_rad is not None
    assert off.rms_rad > 1.5e-3 > 3.0 * fair.rms_rad
    assert off.expected_rad == pytest.approx(fair.expected_rad, rel=0.2)


def test_unseen_poses_of_geometry_alone_are_those_of_the_arm(state: Fitted) -> None:
    """At measured poses the tip is where the fit says, up to where the device stands."""
    q_rad = state.session.samples.joints()[:30]
    tip_m = tool_at(state, q_rad, np.sign(q_rad))
    assert isinstance(tip_m, np.ndarray)
    expected = state.around.expected[0][:30]
    for a, b in ((0, 7), (3, 21), (11, 29)):
        said, fitted = np.linalg.norm(tip_m[a] - tip_m[b]), np.linalg.norm(expected[a] - expected[b])
        assert said == pytest.approx(fitted, abs=1e-9)


def test_a_soft_pedestal_leans_with_the_tool(tmp_path: Path) -> None:
    """Where the tool is in the cell: a model that knows the pedestal is closer to the truth than geometry alone."""
    wanted = Wanted("tracker", seed=41, defects=("soft-pedestal",), enr=2.0, samples=200)
    write_case(conceal(wanted), tmp_path)
    hidden = truth_document(conceal(wanted))
    truth = truth_of(msgspec.json.encode(hidden))
    source = read(tmp_path / "recording")
    alone = fit_geometry(session_of(source.rig, source.samples))
    terms = oracle_terms(alone, truth.defects, "tracker")
    assert terms is not None
    asked = np.array(hidden["free_space"]["reading_rad"]), np.array(hidden["free_space"]["approach"])
    before_m, after_m = (errors_m(tool_at(s, *asked), truth.free_space) for s in (alone, alone.refitted(terms)))
    assert before_m is not None
    assert after_m is not None
    assert after_m < 0.5 * before_m
