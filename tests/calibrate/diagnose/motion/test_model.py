"""A model that one motion has made: what it expects of another motion, what it finds changed there, and as bodies of
MuJoCo.
"""

from pathlib import Path

import mujoco
import numpy as np
import pytest

from acquisition.recording import Recording
from benchmarks.drawn_motion import Hidden, recorded, with_more
from calibrate.apply.export import export_model, form_named
from calibrate.diagnose.motion import TorqueDiagnosis, diagnose_torques, expected_nm, model_of_motion, torques_of_model
from calibrate.diagnose.motion.links_alone import motion_drivers
from calibrate.diagnose.motion.motion_table import Motion, motion_of
from calibrate.diagnose.motion.physical_links import is_physical, physical
from calibrate.model.model_file import ModelFile, read_model, write_model
from calibrate.model.torque_records import TorquesOfModel

MARCH = Hidden(coulomb={3: 4.0, 2: 2.0}, viscous={1: 6.0}, spring={4: 3.0})
NOW = Hidden(coulomb={3: 6.0, 2: 1.0}, viscous={1: 6.0}, spring={4: 3.0}, payload_kg=1.0)
WAVE_NM = 3.0
NOISE_NM = 0.0285  # of 0.1 Nm a reading at 500 Hz, behind the low pass of 20 Hz


@pytest.fixture(scope="module")
def model(tmp_path_factory: pytest.TempPathFactory) -> ModelFile:
    """As it stands in its file."""
    recording = recorded(MARCH, seed=4)
    found = diagnose_torques(recording, np.random.default_rng(1))
    assert isinstance(found, TorqueDiagnosis)
    path = tmp_path_factory.mktemp("model") / "model.json"
    write_model(path, model_of_motion(recording, torques_of_model(found, "march.mcap")))
    return read_model(path)


@pytest.fixture(scope="module")
def torques(model: ModelFile) -> TorquesOfModel:
    """Of that model."""
    assert model.torques is not None
    return model.torques


def motion(recording: Recording) -> Motion:
    """Of a recording that holds one."""
    found = motion_of(recording)
    assert isinstance(found, Motion)
    return found


def test_the_torques_of_another_motion_are_expected_to_the_noise(torques: TorquesOfModel) -> None:
    other = recorded(MARCH, seed=2)
    seen = motion(other)
    misfit = expected_nm(other.rig, seen, torques) - seen.torque_nm
    assert np.sqrt(np.nanmean(misfit**2, axis=0)) == pytest.approx(NOISE_NM, rel=0.15)


def test_what_has_changed_since_is_found_beside_the_model_with_both_sigmas(torques: TorquesOfModel) -> None:
    found = diagnose_torques(recorded(NOW, seed=2), np.random.default_rng(1), torques)
    assert isinstance(found, TorqueDiagnosis)
    sizes = {(f.name.physics, f.name.where): next(iter(f.parameters.values())) for f in found.diagnosis.findings}
    changes = {"joint3.torque": 2.0, "joint2.torque": -1.0}
    assert set(sizes) == {*(("coulomb-friction", where) for where in changes), ("payload", "tool.load")}
    assert sizes["payload", "tool.load"].value == pytest.approx(1.0, abs=0.01)
    for where, change in changes.items():
        assert sizes["coulomb-friction", where].value == pytest.approx(change, abs=0.01)


def test_nothing_has_changed_where_nothing_has(torques: TorquesOfModel) -> None:
    found = diagnose_torques(recorded(MARCH, seed=3), np.random.default_rng(1), torques)
    assert isinstance(found, TorqueDiagnosis)
    assert found.diagnosis.findings == ()


def test_mujoco_takes_the_same_torques_with_the_exported_arm(model: ModelFile, tmp_path: Path) -> None:
    path = tmp_path / "arm.xml"
    rig = recorded(MARCH, length_s=2.0).rig
    export_model(path, rig, model, form_named("mjcf"))
    arm = mujoco.MjModel.from_xml_path(str(path))
    data, seen = mujoco.MjData(arm), motion(recorded(NOW, seed=2))
    assert model.torques is not None
    expected = expected_nm(rig, seen, model.torques)
    turning = np.abs(np.abs(motion_drivers(rig, seen).senses) - 1.0) > 1e-3  # there friction has passed the low pass
    moved = np.isfinite(seen.torque_nm) & ~turning
    for k in range(0, len(expected), 10):
        data.qpos[:], data.qvel[:], data.qacc[:] = seen.q_rad[k], seen.qd_rad_s[k], seen.qdd_rad_s2[k]
        mujoco.mj_inverse(arm, data)
        assert data.qfrc_inverse[moved[k]] == pytest.approx(expected[k, moved[k]], abs=0.02)


def test_bodies_are_found_that_take_the_torques_of_links_that_no_body_has() -> None:
    """A mass that no motion of one vertical axis shows is below zero."""
    links = np.zeros(11)
    links[[0, 4, 5, 6, 10]] = -3.0, 1.0, 1.0, 1.0, 0.5
    seen = np.zeros((2, 11))
    seen[0, [6, 10]] = 100.0  # its tensor about the axis and its rotor show together
    seen[1, 1] = 100.0
    assert not is_physical(links)
    bodies, rise = physical(links, seen, np.zeros(11))
    assert is_physical(bodies)
    assert rise == pytest.approx(0.0, abs=1e-2)
    assert seen @ bodies == pytest.approx(seen @ links, abs=0.1)


def wave(q: np.ndarray, qd: np.ndarray) -> np.ndarray:
    """No order of the motor."""
    return WAVE_NM * np.sin(5.0 * q)


def test_a_cause_without_a_name_is_expected_again(tmp_path: Path) -> None:
    """A wave of the joint's own angle that is no order of the motor, found at one motion and expected at another."""
    first, second = (with_more(recorded(Hidden(), seed=seed), 2, wave) for seed in (1, 2))
    found = diagnose_torques(first, np.random.default_rng(1))
    assert isinstance(found, TorqueDiagnosis)
    (effect,) = torques_of_model(found, "wave").effects
    assert (effect.physics, effect.where, effect.depends_on) == ("unknown", "joint2.torque", "q2")
    seen = motion(second)
    misfit = expected_nm(second.rig, seen, torques_of_model(found, "wave")) - seen.torque_nm
    q2 = motion(first).q_rad[:, 1]
    inside = (seen.q_rad[:, 1] > q2.min()) & (seen.q_rad[:, 1] < q2.max())
    assert np.sqrt(np.nanmean(misfit[inside, 1] ** 2)) < 0.15 * WAVE_NM
