"""Weight: centres in the frame that the rig's notation means, doubt about stated masses, unknown ones."""

from dataclasses import replace

import numpy as np
import pytest
from msgspec import structs

from acquisition.recording.rig import ArmModel, Pose
from calibrate.model.effects.backlash import EFFECT as BACKLASH
from calibrate.model.effects.base_compliance import EFFECT as BASE
from calibrate.model.effects.gravity import stated_torque_nm
from calibrate.model.effects.joint_compliance import EFFECT as JOINT
from calibrate.model.effects.link_bending import EFFECT as LINK
from calibrate.model.effects.loads import MASS_SHARE, possible_rigs, stated_masses
from calibrate.model.effects.psd_gain import EFFECT as GAIN
from tests.calibrate.model.effects.conftest import full_session

NOTHING = np.zeros(0)


def weighed(drivers, mass_kg=3.0, model=ArmModel.DH, com_m=(0.02, -0.05, 0.1)):
    """The session on an arm whose links weigh this much; None: nobody knows."""
    joints = tuple(structs.replace(j, mass_kg=mass_kg, com_m=com_m) for j in drivers.rig.arm.joints)
    arm = structs.replace(drivers.rig.arm, joints=joints, model=model, flange=Pose())
    return replace(drivers, rig=structs.replace(drivers.rig, arm=arm))


@pytest.fixture(scope="module")
def drivers():
    return full_session("tracker").drivers


def term_of(effect, drivers, where, variant):
    return next(t for t in effect.terms(drivers) if t.port.where == where and t.variant == variant)


def test_a_centre_is_reported_in_the_link_frame_of_the_notation(drivers):
    """Standard Denavit-Hartenberg: at the link's end. Modified, local exponentials: where the link starts to turn."""
    com, link, pose = (0.02, -0.05, 0.1), 2, 7
    at_end = stated_masses(weighed(drivers, com_m=com))[link - 1]
    assert at_end == (3.0, link, com)
    for model in (ArmModel.MDH, ArmModel.LOCAL_POE):
        _, frame, there = stated_masses(weighed(drivers, model=model, com_m=com))[link - 1]
        B = drivers.frames[pose]
        found = B[frame, :3, :3] @ np.array(there) + B[frame, :3, 3]
        angle = drivers.q_rad[pose, link - 1] + (drivers.rig.arm.joints[link - 1].theta_offset_rad or 0.0)
        c, s = np.cos(angle), np.sin(angle)
        turned = B[link - 1, :3, :3] @ np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
        assert found == pytest.approx(turned @ np.array(com) + B[link - 1, :3, 3], abs=2e-4)


def test_corrections_hold_much_of_what_masses_are_off_by(drivers):
    """Torques of masses drawn about the stated ones, by the columns of the stated ones and of the corrections."""
    stated, rng = weighed(drivers), np.random.default_rng(0)
    arm = stated.rig.arm
    bases = [term_of(JOINT, stated, "joint2.angle", v).basis(stated, NOTHING)[:, 1] for v in ("", "masses corrected")]
    left, sigmas = [], []
    for _ in range(20):
        masses_kg = 3.0 * (1.0 + MASS_SHARE * rng.standard_normal(len(arm.joints)))
        joints = tuple(structs.replace(j, mass_kg=float(m)) for j, m in zip(arm.joints, masses_kg, strict=True))
        true = replace(stated, rig=structs.replace(stated.rig, arm=structs.replace(arm, joints=joints)))
        torque = stated_torque_nm(true, 2)
        found = [np.linalg.lstsq(X, torque, rcond=None)[0] for X in bases]
        left.append([np.linalg.norm(torque - X @ c) for X, c in zip(bases, found, strict=True)])
        sigmas.append(np.abs(found[1][1:]) / found[1][0])
    plain, corrected = np.array(left).T
    assert np.sum(corrected**2) < 0.6 * np.sum(plain**2)
    assert np.max(sigmas) < 4.0


@pytest.mark.parametrize(
    ("effect", "where"),
    [(JOINT, "joint2.angle"), (LINK, "link2.tilt"), (BASE, "base.pose")],
    ids=["joint", "link", "base"],
)
def test_springs_give_way_along_their_load_and_masses_are_not_off_by_much(drivers, effect, where):
    stated = weighed(drivers)
    plain = term_of(effect, stated, where, "")
    assert plain.plausible(np.array([1e-6]), NOTHING, 0.0)
    assert not plain.plausible(np.array([-1e-6]), NOTHING, 0.0)
    corrected = term_of(effect, stated, where, "masses corrected")
    m = corrected.basis(stated, NOTHING).shape[2]
    off = np.zeros(m)
    off[0], off[-1] = 1e-6, 2e-6
    assert corrected.plausible(off, NOTHING, 0.0)
    off[-1] = 8e-6
    assert not corrected.plausible(off, NOTHING, 0.0)


@pytest.mark.parametrize("effect", [JOINT, LINK, BASE], ids=lambda e: e.physics)
def test_without_masses_no_compliance_is_stated_unless_a_payload_tells_it(drivers, effect):
    for payload, tells in ((None, False), (drivers.payload_kg, True)):
        session = replace(weighed(drivers, mass_kg=None), payload_kg=payload)
        for term in effect.terms(session):
            if "hand" in term.variant:
                continue
            m = term.basis(session, NOTHING).shape[2]
            sizes = term.sizes(np.full(m, 1e-6), 1e-14 * np.eye(m), NOTHING, NOTHING)
            assert any("rad_nm" in name for name in sizes) == tells, term.key


def test_a_flank_that_turns_over_beyond_the_loads_of_the_session_is_no_flank(drivers):
    stated = weighed(drivers)
    term = next(t for t in BACKLASH.terms(stated) if t.depends_on == ("gravity_torque2",))
    largest = float(np.abs(stated_torque_nm(stated, 2)).max())
    assert term.plausible(np.array([1e-4]), np.array([0.2 * largest]), 0.0)
    assert not term.plausible(np.array([1e-4]), np.array([0.6 * largest]), 0.0)


def test_skew_of_a_detector_holds_no_turn_of_it():
    """A turn moves spots by (-y, x): placement and bracket take it up, and no number could be told for it."""
    drivers = full_session("dual-psd").drivers
    spot = np.nan_to_num(drivers.readouts["dual-psd"].predicted[:, :2])
    term = next(t for t in GAIN.terms(drivers) if t.port.where == "psd1.reading" and t.variant == "each axis and skew")
    basis = term.basis(drivers, NOTHING)[:, :2]
    assert basis[:, :, 2] == pytest.approx(spot[:, ::-1] / 2.0)
    mapped = np.linalg.lstsq(spot, basis[:, :, 2], rcond=None)[0]
    assert mapped == pytest.approx(mapped.T, abs=1e-9)


def test_corrections_keep_their_meaning_on_a_rig_that_states_the_mass_of_the_tool_too(drivers):
    """Sizes ask what masses that are off would do; of a tool whose mass is not stated, by a rig that states it."""
    stated = weighed(drivers)
    stated = replace(stated, rig=structs.replace(stated.rig, tool=structs.replace(stated.rig.tool, mass_kg=None)))
    term = term_of(JOINT, stated, "joint2.angle", "masses corrected")
    off = possible_rigs(stated)[-1]
    assert off.tool.mass_kg is not None
    plain, moved = term.basis(stated, NOTHING), term.basis(replace(stated, rig=off), NOTHING)
    assert moved.shape == plain.shape
    assert np.ptp(moved[:, 1, 0] - plain[:, 1, 0]) > 0.0
