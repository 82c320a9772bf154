"""From a session folder to findings, for sessions of the concealed bench; truth is opened by the test alone."""

import json
from dataclasses import replace

import numpy as np
import pytest

from acquisition.recording import read
from calibrate.diagnose.assess.diagnosis import Verdict
from calibrate.diagnose.from_recording import diagnose_samples, runs_of
from calibrate.diagnose.record.to_file import file_of
from calibrate.diagnose.state.fitted import fit_geometry
from calibrate.diagnose.state.session import session_of
from calibrate.diagnose.with_model.from_diagnosis import model_of_diagnosis
from calibrate.model.checks.gross_error import GrossErrorKind
from simulators.conceal.case import conceal
from simulators.conceal.case_files import write_case
from simulators.conceal.wanted import Wanted
from tests.calibrate.diagnose.concealed import changed, recording_of


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("tracker")


@pytest.fixture(scope="module")
def recording(folder):
    return recording_of(
        folder, family="tracker", seed=31, samples=120, arm="irb120", defects=("encoder-eccentricity",), enr=2.0
    )


@pytest.fixture(scope="module")
def found(recording):
    return diagnose_samples(recording.rig, recording.samples, np.random.default_rng(1))


def test_the_concealed_defect_is_found_where_it_is(found, folder):
    (hidden,) = json.loads((folder / "sealed" / "truth.json").read_text())["defects"]
    assert found.physics.diagnosis.verdict is Verdict.MISMATCH
    largest = found.physics.diagnosis.findings[0]
    assert largest.name.where == hidden["port"]
    candidates = {largest.name.physics, *(rival.name.physics for rival in largest.rivals)}
    assert hidden["physics"] in candidates


def test_free_space_is_predicted_better_with_the_physics(found):
    change = found.physics.free_space
    assert change.before_m > change.after_m > 0.0


def test_the_file_says_the_same(found, recording):
    file = file_of(found, recording)
    assert file.verdict == "mismatch"
    assert file.findings[0].where == found.physics.diagnosis.findings[0].name.where
    assert file.rms_after_m < file.rms_before_m
    curve = file.findings[0].curve
    assert len(curve.values) == len(curve.residual) == len(curve.fitted) == file.samples


def test_a_file_that_is_wrong_as_a_whole_is_undecidable_and_says_why(recording):
    turned = changed(recording.samples, q2_rad=-recording.samples.column("q2_rad"))
    found = diagnose_samples(recording.rig, turned, np.random.default_rng(1))
    file = file_of(found, recording)
    assert (file.verdict, file.findings, file.rms_before_m) == ("undecidable", (), None)
    assert file.blunders[0].rows == ()
    assert "q2" in file.next[0]


@pytest.mark.endure  # three seconds
def test_a_table_by_the_other_convention_of_denavit_and_hartenberg_is_named(tmp_path):
    write_case(conceal(Wanted("wire", 3, samples=80, confused=True)), tmp_path)
    recording = read(tmp_path / "recording")
    (fault,) = diagnose_samples(recording.rig, recording.samples, np.random.default_rng(1)).blunders
    assert (fault.kind, fault.whole_file) == (GrossErrorKind.TABLE_CONVENTION, True)


def test_an_arm_that_stays_far_off_its_readings_has_no_findings(recording):
    columns = dict(recording.samples.columns)
    order = [f"q{joint}_rad" for joint in (3, 1, 2, 5, 6, 4)]  # columns that somebody has mixed up
    mixed = replace(
        recording.samples, columns=columns | {f"q{i + 1}_rad": columns[name] for i, name in enumerate(order)}
    )
    found = diagnose_samples(recording.rig, mixed, np.random.default_rng(1))
    assert found.physics is None
    assert found.blunders[-1].kind is GrossErrorKind.ANOTHER_ARM
    assert found.blunders[-1].whole_file


def one_joint(folder, wave_rad, rows=80):
    """A joint on a bench that carries a target 0.4 m off its axis, and turns by a wave more than it reads."""
    rng = np.random.default_rng(5)
    q = rng.uniform(-3.0, 3.0, rows)
    turned = q + wave_rad * np.sin(2.0 * q)
    seen = 0.4 * np.stack([np.cos(turned), np.sin(turned), np.zeros(rows)], axis=1)
    seen = seen + np.array([1.0, 0.5, 0.01]) + rng.normal(0.0, 2e-5, (rows, 3))
    folder.mkdir()
    (folder / "rig.toml").write_text(ONE_JOINT)
    lines = [
        f"{k},{angle!r},{x!r},{y!r},{z!r}"
        for k, (angle, (x, y, z)) in enumerate(zip(q.tolist(), seen.tolist(), strict=True))
    ]
    (folder / "samples.csv").write_text("\n".join(["t_s,q1_rad,x_m,y_m,z_m", *lines]) + "\n")
    return read(folder)


ONE_JOINT = """schema = 1
name = "bench-joint"

[arm]
model = "local-poe"

[[arm.joint]]
origin_m = [0.0, 0.0, 0.0]
rotation_rad = [0.0, 0.0, 0.0]
lower_rad = -3.2
upper_rad = 3.2

[arm.flange]
origin_m = [0.0, 0.0, 0.014]
rotation_rad = [0.0, 0.0, 0.0]

[tool]
point_m = [0.4, 0.0, 0.0]

[noise]
position_m = 2e-5
"""


def test_a_single_joint_reaches_by_its_tool(tmp_path):
    """Readings 2 mm beside it are far from its flange, which is 14 mm long, and near its target."""
    recording = one_joint(tmp_path / "bench", wave_rad=8e-3)
    found = diagnose_samples(recording.rig, recording.samples, np.random.default_rng(1))
    assert [one.kind for one in found.blunders] == []
    (largest, *_) = found.physics.diagnosis.findings
    assert largest.name.where.startswith("joint1")


def test_a_single_joint_whose_readings_are_another_ones_is_no_joint_of_this_rig(tmp_path):
    recording = one_joint(tmp_path / "bench", wave_rad=0.05)
    found = diagnose_samples(recording.rig, recording.samples, np.random.default_rng(1))
    assert found.blunders[-1].kind is GrossErrorKind.ANOTHER_ARM
    assert "reach of 0.4" in found.blunders[-1].says


def test_readings_that_err_one_after_another_are_no_gross_errors_of_single_readings(tmp_path):
    """Neither rule has a name for what stood elsewhere for a while: the session is not consistent for all that."""
    recording = recording_of(tmp_path, family="tracker", seed=33, samples=120, arm="irb120")
    plain = diagnose_samples(recording.rig, recording.samples, np.random.default_rng(1)).physics.diagnosis
    assert plain.verdict is Verdict.CONSISTENT
    z_m = recording.samples.column("z_m").copy()
    z_m[50:54] += [2e-3, -3e-3, 2.5e-3, -2e-3]
    found = diagnose_samples(
        recording.rig, changed(recording.samples, z_m=z_m), np.random.default_rng(1)
    ).physics.diagnosis
    assert found.verdict is Verdict.UNDECIDABLE
    assert "rows 51 to 54" in found.unexplained[0].why


@pytest.mark.endure  # daily: what was seated again, below; not that it comes back
def test_a_fixture_that_was_knocked_and_carried_on_stands_as_before_when_it_comes_back(tmp_path):
    """Station 1 is visited first and last; the knock at its first visit is no gross error and no lasting move."""
    wanted = {"family": "dual-psd", "seed": 7, "samples": 120, "places": 3, "defects": ("bumped-fixture",), "enr": 6.0}
    recording = recording_of(tmp_path, **wanted)
    diagnosed = diagnose_samples(recording.rig, recording.samples, np.random.default_rng(1))
    found = diagnosed.physics
    (finding,) = found.diagnosis.findings
    assert (finding.name.physics, finding.name.where) == ("fixture-moved", "fixture.pose")
    assert finding.says.startswith("The fixture at station 1 moved")
    assert finding.says.endswith("until it was taken away")
    (term,) = found.model.accepted
    moved = np.any(term.term.basis(found.model.drivers, term.inner) != 0.0, axis=(1, 2))
    t_s, station = recording.samples.column("t_s"), recording.samples.column("placement")
    first_visit = (station == 1) & (t_s < t_s[station == 2].min())
    assert moved.any()
    assert not np.any(moved & ~first_visit)
    left = model_of_diagnosis(diagnosed, recording).effects
    assert [effect.holds for effect in left] == ["session"]  # nothing of it stays for later ones


def test_gross_errors_here_and_there_are_no_run():
    rng = np.random.default_rng(0)
    hits = sum(bool(runs_of(np.sort(rng.choice(200, 10, replace=False)), 200)) for _ in range(2000))
    assert hits <= 4  # one in a thousand at most
    assert [run.tolist() for run, _ in runs_of(np.array([3, 50, 51, 52, 53, 120]), 200)] == [[50, 51, 52, 53]]


def test_of_a_handful_of_samples_nothing_is_sought_and_nothing_claimed(recording):
    few = diagnose_samples(recording.rig, recording.samples.take(np.arange(15)), np.random.default_rng(1))
    assert few.physics is None
    assert "measure more poses" in few.why_not
    file = file_of(few, recording)
    assert (file.verdict, file.findings) == ("undecidable", ())
    assert [one.stage for one in file.incomplete] == ["search"]


def test_of_fewer_than_twenty_rows_a_plain_cause_is_named_but_not_for_certain(tmp_path):
    """Its rows leave one coordinate of the tracker to the geometry alone, whose weight once hid every cause."""
    wanted = {"family": "tracker", "arm": "ur5", "defects": ("soft-joint",), "enr": 9.0, "at_least": 6.0}
    recording = recording_of(tmp_path, seed=10, samples=19, **wanted)
    hidden = json.loads((tmp_path / "sealed" / "truth.json").read_bytes())["defects"][0]
    few = diagnose_samples(recording.rig, recording.samples, np.random.default_rng(1))
    (found,) = few.physics.diagnosis.findings
    assert (found.name.physics, found.name.where) == ("joint-compliance", hidden["port"])
    assert 0.0 < found.confidence < 0.5
    assert "unknown causes" in [one.stage for one in file_of(few, recording).incomplete]


def test_few_rows_without_a_cause_are_not_called_consistent(tmp_path):
    recording = recording_of(tmp_path, family="tracker", arm="ur5", seed=6, samples=19)
    few = diagnose_samples(recording.rig, recording.samples, np.random.default_rng(1))
    assert few.physics.diagnosis.findings == ()
    assert few.physics.diagnosis.verdict is Verdict.UNDECIDABLE


def test_an_instrument_may_have_all_its_rows_held_out(tmp_path):
    """A bar measured in one go is gone when that part of the session is: the rest is still judged."""
    recording = recording_of(tmp_path, family="cones", seed=72, samples=160)
    fitted = fit_geometry(session_of(recording.rig, recording.samples))
    bars = np.unique(next(m for m in fitted.session.measured if m.name == "bar").sample_rows)
    rest = np.setdiff1d(fitted.active, bars)
    unseen = fitted.select(rest[20:]).refitted(()).held_out(np.sort(np.concatenate([bars, rest[:20]])))
    assert [u.instrument for u in unseen] == ["seat"]
    assert np.all(np.isfinite(unseen[0].whitened))


def test_a_bumped_tracker_may_as_well_be_a_moved_base_and_no_pose_tells(tmp_path):
    wanted = {"family": "tracker", "seed": 9, "defects": ("bumped-device",), "enr": 1.5, "samples": 160}
    recording = recording_of(tmp_path, **wanted)
    found = diagnose_samples(recording.rig, recording.samples, np.random.default_rng(0)).physics.diagnosis
    (finding,) = found.findings
    assert (finding.name.physics, finding.name.where) == ("device-drift", "device.pose")
    (other,) = (r for r in finding.rivals if r.name.physics == "base-moved")
    assert other.alike
    assert abs(other.margin) < 0.5
    assert finding.confidence == pytest.approx(0.5, abs=0.1)
    assert any("alike at every pose" in lines for lines in found.next)


@pytest.mark.parametrize(
    ("family", "mechanism", "physics", "where"),
    [
        ("tracker", "reseated-target", "tool-moved", "tool.point"),
        pytest.param("dual-psd", "reseated-laser", "laser-moved", "laser.direction", marks=pytest.mark.endure),
    ],
)
def test_what_was_seated_again_is_named_with_its_size(tmp_path, family, mechanism, physics, where):
    recording = recording_of(tmp_path, family=family, seed=24, samples=160, defects=(mechanism,), enr=2.0)
    truth = json.loads((tmp_path / "sealed" / "truth.json").read_bytes())["defects"][0]["figures"]
    diagnosed = diagnose_samples(recording.rig, recording.samples, np.random.default_rng(1))
    (found,) = diagnosed.physics.diagnosis.findings
    assert (found.name.physics, found.name.where, found.name.depends_on) == (physics, where, ("t",))
    sizes = found.parameters
    assert abs(sizes["time_s"].value - truth["at_s"]) < 3.0 * sizes["time_s"].sigma
    if family == "tracker":
        shift = np.array([sizes[f"shift_{axis}_m"].value for axis in "xyz"])
        sigma = max(sizes[f"shift_{axis}_m"].sigma for axis in "xyz")
        assert abs(np.linalg.norm(shift) - truth["shift_m"]) < 3.0 * sigma


@pytest.mark.endure  # daily: what no catalogue holds, in test_search.py
def test_a_spring_that_is_uneven_over_a_turn_has_no_name(tmp_path):
    """With waves of up to two a turn it was an error of the encoder, certainly."""
    spring = ("outside-uneven-spring",)
    recording = recording_of(tmp_path, family="tracker", seed=1, samples=200, defects=spring, enr=3.0)
    diagnosed = diagnose_samples(recording.rig, recording.samples, np.random.default_rng(1))
    (found,) = diagnosed.physics.diagnosis.findings
    assert (found.name.physics, found.name.where) == ("unknown", "joint2.angle")
    assert set(found.name.depends_on) == {"gravity_torque2", "q2"}
