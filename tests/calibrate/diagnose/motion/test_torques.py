"""Which torque was left out: each mechanism of an arm in motion by its name, its joint and its size."""

from dataclasses import replace

import numpy as np
import pytest
from msgspec import structs

from acquisition.recording.examination import NOT_EXAMINED, ExaminationRecord
from acquisition.recording.rig.schema import Follows
from benchmarks.drawn_motion import Hidden, recorded, with_more
from calibeam.results.diagnosis import without_samples
from calibrate.diagnose.assess import assessment
from calibrate.diagnose.assess.assessment import thinned
from calibrate.diagnose.assess.diagnosis import Verdict
from calibrate.diagnose.limits import MOST_SEARCH_ROWS
from calibrate.diagnose.motion import TorqueDiagnosis, diagnose_torques, with_torques
from calibrate.diagnose.motion.links_alone import torque_state
from calibrate.diagnose.motion.motion_table import motion_of
from calibrate.diagnose.search.bench import Bench
from calibrate.diagnose.search.port_process import places_of

OF_ITS_SIZE = 0.02

LAWS = {
    "dry friction": (Hidden(coulomb={3: 2.0}), "coulomb-friction", "joint3.torque", {"friction_nm": 2.0}),
    "grease": (Hidden(viscous={2: 5.0}), "viscous-friction", "joint2.torque", {"friction_nms_per_rad": 5.0}),
    "friction by load": (Hidden(loaded={2: 0.1}), "load-friction", "joint2.torque", {"friction_share": 0.1}),
    "a hose": (Hidden(spring={4: 3.0}), "joint-spring", "joint4.torque", {"stiffness_nm_per_rad": 3.0}),
    "current offset": (Hidden(offset={5: 0.7}), "torque-offset", "joint5.torque", {"offset_nm": 0.7}),
    "late torque": (Hidden(delay={2: 0.01}), "torque-delay", "joint2.torque", {"delay_s": 0.01}),
    "a leaning base": (Hidden(lean_rad=(0.01, 0.0)), "gravity-direction", "base.lean", {"lean_x_rad": 0.01}),
}


def diagnosed(hidden, **more):
    found = diagnose_torques(recorded(hidden, **more), np.random.default_rng(1))
    assert isinstance(found, TorqueDiagnosis)
    return found.diagnosis


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=[pytest.mark.endure] * (name != "dry friction")) for name in LAWS]
)
def test_a_mechanism_is_named_at_its_joint_with_its_size(name):
    hidden, physics, where, truth = LAWS[name]
    findings = [f for f in diagnosed(hidden).findings if f.share > 0.01]
    assert [(f.name.physics, f.name.where) for f in findings] == [(physics, where)]
    for parameter, true in truth.items():
        size = findings[0].parameters[parameter]
        assert abs(size.value - true) < OF_ITS_SIZE * true
        assert abs(size.value - true) < 4.0 * size.sigma


def found_beside(hidden, joint, law):
    found = diagnose_torques(with_more(recorded(hidden), joint, law), np.random.default_rng(1))
    assert isinstance(found, TorqueDiagnosis)
    return {(f.name.physics, f.name.where): f for f in found.diagnosis.findings if f.share > 0.01}


def test_stiction_is_named_although_a_joint_is_slow_only_about_its_turns():
    found = found_beside(Hidden(), 3, lambda q, qd: 2.0 * np.exp(-((qd / 0.06) ** 2)) * np.sign(qd))
    (stiction,) = found.values()
    assert set(found) == {("stribeck-friction", "joint3.torque")}
    assert stiction.parameters["speed_rad_s"].value == pytest.approx(0.06, rel=0.05)
    assert stiction.parameters["friction_nm"].value == pytest.approx(2.0, rel=0.05)


def test_ripple_is_named_although_most_of_it_is_faster_than_the_low_pass():
    found = found_beside(Hidden(), 4, lambda q, qd: 1.5 * np.sin(2.0 * 101.0 * q))
    assert set(found) == {("gear-ripple", "joint4.torque")}
    ripple = found["gear-ripple", "joint4.torque"]
    assert (ripple.name.order, ripple.parameters["amplitude_nm"].value) == (2, pytest.approx(1.5, rel=OF_ITS_SIZE))


def test_friction_that_changes_as_the_joint_turns_is_unknown_and_takes_no_spring_along():
    uneven = found_beside(Hidden(spring={4: 3.0}), 4, lambda q, qd: (1.5 + np.sin(2.0 * q)) * np.sign(qd))
    assert set(uneven) == {("unknown", "joint4.torque"), ("joint-spring", "joint4.torque")}
    assert uneven["unknown", "joint4.torque"].name.depends_on == ("q4", "qd4")


@pytest.mark.endure
@pytest.mark.parametrize(
    ("hidden", "physics"), [(Hidden(payload_kg=1.0), "payload"), (Hidden(scale={2: 0.05}), "torque-constant")]
)
def test_what_the_links_could_nearly_be_is_named_within_its_sigma(hidden, physics):
    (found,) = [f for f in diagnosed(hidden).findings if f.share > 0.01]
    assert found.name.physics == physics
    true = 1.0 if physics == "payload" else 0.05
    size = next(iter(found.parameters.values()))
    assert abs(size.value - true) < 4.0 * size.sigma


def test_several_mechanisms_stand_side_by_side():
    said = diagnosed(Hidden(coulomb={1: 1.5, 4: 0.8}, viscous={1: 3.0}))
    assert said.verdict is Verdict.MISMATCH
    found = {(f.name.physics, f.name.where) for f in said.findings if f.share > 0.01}
    assert found == {
        ("coulomb-friction", "joint1.torque"),
        ("viscous-friction", "joint1.torque"),
        ("coulomb-friction", "joint4.torque"),
    }
    unseen = {p.instrument: p for p in said.proofs if p.split == "last block"}
    assert unseen["joint1.torque"].rms_after_m < 0.1 * unseen["joint1.torque"].rms_before_m


def test_torques_of_the_links_alone_are_no_finding_above_the_noise():
    """What is left of a sound arm is a finding of a few thousandths of a newton metre at most."""
    for finding in diagnosed(Hidden()).findings:
        assert max(abs(size.value) for size in finding.parameters.values()) < 0.01


def test_standing_joints_show_no_torque():
    recording = recorded(Hidden(), length_s=2.0)
    values = recording.streams["robot"].values
    values["actual_q_rad"][:] = values["actual_q_rad"][0]
    assert_not_examined(diagnose_torques(recording, np.random.default_rng(1)))


def test_a_slow_log_in_short_pieces_shows_nothing_and_raises_nothing():
    recording = recorded(Hidden(), length_s=4.0)
    stream = recording.streams["robot"]
    for rows in (np.arange(0, 600, 50), np.arange(0, 1800, 50), np.arange(0, 1)):
        few = replace(
            stream,
            host_s=stream.host_s[rows],
            device_s=stream.device_s[rows],
            sequence=stream.sequence[rows],
            values={name: values[rows] for name, values in stream.values.items()},
        )
        found = diagnose_torques(replace(recording, streams={"robot": few}), np.random.default_rng(1))
        assert_not_examined(found)


def test_torques_of_another_device_are_brought_to_the_clock_of_the_joints():
    recording = recorded(Hidden(coulomb={3: 2.0}))
    stream = recording.streams["robot"]
    joints, torque = (replace(stream, channels=stream.channels[k : k + 1]) for k in (0, 1))
    joints = replace(joints, values={"actual_q_rad": stream.values["actual_q_rad"]})
    values = {"joint_torque_nm": stream.values["joint_torque_nm"]}
    torque = replace(torque, values=values, sequence=stream.sequence.copy(), device_s=stream.device_s + 0.5)
    both = replace(recording, streams={"robot": joints, "drives": torque})
    found = diagnose_torques(both, np.random.default_rng(1))
    assert isinstance(found, TorqueDiagnosis)
    assert [f.name.physics for f in found.diagnosis.findings if f.share > 0.01] == ["coulomb-friction"]


def assert_not_examined(found, reason=""):
    assert isinstance(found, ExaminationRecord)
    assert found.outcome == NOT_EXAMINED
    assert found.expected
    assert reason in found.reason
    assert found.remedy


def test_torques_of_an_arm_whose_joint_follows_another_one_are_not_examined():
    recording = recorded(Hidden())
    joints = list(recording.rig.arm.joints)
    joints[2] = structs.replace(joints[2], follows=Follows(2, -1.0))
    rig = structs.replace(recording.rig, arm=structs.replace(recording.rig.arm, joints=tuple(joints)))
    assert_not_examined(diagnose_torques(replace(recording, rig=rig), np.random.default_rng(1)), "joint 3 follows")


def test_every_torque_of_a_motion_is_searched():
    """More than a search of poses works on: single moments at random would cut the memory of the noise."""
    recording = recorded(Hidden())
    motion = motion_of(recording)
    assert not isinstance(motion, ExaminationRecord)
    state = torque_state(recording.rig, motion, None)
    assert int(state.rows.data.sum()) > MOST_SEARCH_ROWS
    assert thinned(state, np.random.default_rng(1)) is state


def test_a_stage_of_the_torques_that_fails_is_named_in_the_file(monkeypatch):
    def failing(*_):
        raise np.linalg.LinAlgError("SVD did not converge")

    monkeypatch.setattr(assessment, "_unseen_squares", failing)
    found = diagnose_torques(recorded(Hidden(), length_s=6.0), np.random.default_rng(1))
    nothing = without_samples(recorded(Hidden(), length_s=2.0).rig, "")
    file = with_torques(nothing, found)
    assert file.incomplete
    assert all(one.stage.startswith("torques in motion, ") for one in file.incomplete)
    assert all("did not converge" in one.reason for one in file.incomplete)


@pytest.mark.endure
def test_a_delay_is_found_in_a_long_motion_too():
    (found,) = diagnosed(Hidden(delay={2: 0.01}), length_s=120.0).findings
    assert found.name.physics == "torque-delay"
    assert found.parameters["delay_s"].value == pytest.approx(0.01, rel=OF_ITS_SIZE)


def test_an_unknown_cause_is_sought_at_the_joints_alone() -> None:
    """What a load or a leaning base does at one joint alone would be a second name for the torque of that joint."""
    recording = recorded(Hidden(), length_s=5.0)
    motion = motion_of(recording)
    assert motion is not None
    places = {port.where for port, _ in places_of(Bench(torque_state(recording.rig, motion)))}
    assert places == {f"joint{i}.torque" for i in range(1, recording.rig.n_joints + 1)}
