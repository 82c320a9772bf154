"""Which torque was left out: each mechanism of an arm in motion by its name, its joint and its size."""

import numpy as np
import pytest

from benchmarks.drawn_motion import Hidden, recorded
from calibrate.diagnose.assess.diagnosis import Verdict
from calibrate.diagnose.motion import diagnose_torques

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
    assert found is not None
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
    assert diagnose_torques(recording, np.random.default_rng(1)) is None
