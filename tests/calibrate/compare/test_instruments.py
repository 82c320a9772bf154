"""Sessions of one motion compared by instruments whose reading is no column: 6-D targets, cones, bars."""

from dataclasses import replace

import numpy as np
import pytest
from msgspec import structs
from scipy.spatial.transform import Rotation

from acquisition.recording.samples import POSITION
from calibeam.results.comparison import compare
from calibrate.compare.chain import differences, of_rig
from calibrate.compare.corrected import corrected_samples, simulated_of
from calibrate.compare.matched import lengths_of
from calibrate.diagnose.state.fitted import fit_geometry
from calibrate.diagnose.state.session import session_of
from calibrate.model.arms.rig_arm import RigArm
from tests.calibrate.diagnose.concealed import changed, recording_of
from tests.calibrate.diagnose.mixed_sessions import full_pose, truth_of

Q = [f"q{j}_rad" for j in range(1, 7)]
TURN = [f"r{axis}_rad" for axis in "xyz"]


def apart(rig, measured, simulated):
    return {one.link: one for one in differences(of_rig(rig), (measured, simulated))}


def shifted(recording, columns):
    return replace(recording, samples=changed(recording.samples, **columns))


@pytest.fixture(scope="module")
def tracked(tmp_path_factory):
    """A 6-D target: measured with an encoder's disc off centre; simulated without, and with noise of its own."""
    wanted = {"seed": 3, "enr": 1.0, "samples": 160}
    measured, case = full_pose(tmp_path_factory.mktemp("m"), defects=("encoder-eccentricity",), **wanted)
    simulated, _ = full_pose(tmp_path_factory.mktemp("s"), defects=(), **wanted)
    rng, samples = np.random.default_rng(8), simulated.samples
    sizes = {"x_m": 1e-5, "y_m": 1e-5, "z_m": 1e-5} | dict.fromkeys(TURN, 2e-5)
    noisy = {name: samples.column(name) + rng.normal(0.0, size, len(samples)) for name, size in sizes.items()}
    return measured, shifted(simulated, noisy), truth_of(case)


@pytest.fixture(scope="module")
def probed(tmp_path_factory):
    """Cones and bars before an arm that is carried by hand."""
    simulated = recording_of(tmp_path_factory.mktemp("s"), family="cones", seed=11, samples=160, places=4)
    assert "bar" in simulated.samples
    return simulated


def test_a_6d_target_parts_in_position_and_orientation(tracked):
    measured, simulated, _ = tracked
    said = compare(measured, simulated, diagnosed=False)
    assert said.first_link == "position"
    assert {link.link for link in said.links if link.parts} == {"position", "orientation"}


@pytest.mark.endure  # daily: a 6-D target in tests/golden/test_diagnoses.py, two sessions in test_drawn_pairs.py
def test_what_a_6d_target_shows_is_named(tracked):
    measured, simulated, ((physics, port),) = tracked
    said = compare(measured, simulated)
    (finding,) = said.diagnosis.findings
    assert (finding.physics, finding.where) == (physics, port)


def test_orientations_of_one_simulation_agree_whatever_their_vectors_look_like(tracked):
    """A turn by an angle is one by the angle less a whole turn the other way round."""
    _, simulated, _ = tracked
    vectors = np.stack([simulated.samples.column(name) for name in TURN], axis=1)
    angle = np.linalg.norm(vectors, axis=1, keepdims=True)
    same = shifted(simulated, dict(zip(TURN, (vectors * (1.0 - 2.0 * np.pi / angle)).T, strict=True)))
    link = apart(simulated.rig, same.samples, simulated.samples)["orientation"]
    assert np.max(np.abs(link.own)) < 1e-9


def test_turned_joints_explain_the_turned_target(tracked):
    _, simulated, _ = tracked
    moved = changed(simulated.samples, q2_rad=simulated.samples.column("q2_rad") + 1e-3)
    link = apart(simulated.rig, moved, simulated.samples)["orientation"]
    assert np.linalg.norm(link.own - link.raw, axis=1) == pytest.approx(1e-3, rel=1e-3)


def test_a_simulation_that_is_its_own_measurement_leaves_what_its_geometry_says(tracked):
    """What the simulation holds already cancels: noise, too."""
    _, simulated, _ = tracked
    samples = simulated.samples
    fitted = simulated_of(simulated.rig, samples)
    made = corrected_samples(fitted, (samples, samples), np.eye(4))
    expected = fitted.fitted.around.expected[0]
    assert np.stack([made.column(f"{a}_m") for a in "xyz"], axis=1) == pytest.approx(expected[:, :3], abs=1e-12)
    seen = Rotation.from_rotvec(np.stack([samples.column(name) for name in TURN], axis=1))
    now = Rotation.from_rotvec(np.stack([made.column(name) for name in TURN], axis=1))
    assert (now * seen.inv()).as_rotvec() == pytest.approx(expected[:, 3:], abs=1e-8)


def test_joints_of_seated_rows_are_a_reading_and_no_link_of_their_own(probed):
    rng, samples = np.random.default_rng(5), probed.samples
    other = changed(samples, **{name: samples.column(name) + rng.normal(0.0, 4e-6, len(samples)) for name in Q})
    links = apart(probed.rig, other, samples)
    assert set(links) == {"seat", "bar"}
    assert compare(replace(probed, samples=other), probed, diagnosed=False).first_link is None


def test_a_probe_that_reads_off_in_the_cone_parts_at_the_seat(probed):
    samples = probed.samples
    wrong = changed(samples, q3_rad=samples.column("q3_rad") + 1e-4 * np.sin(samples.column("q3_rad")))
    said = compare(replace(probed, samples=wrong), probed, diagnosed=False)
    assert said.first_link == "seat"
    assert {link.link for link in said.links if link.parts} == {"seat", "bar"}


def test_what_the_simulation_misses_its_own_cones_by_does_not_count(probed):
    samples = probed.samples
    made = corrected_samples(simulated_of(probed.rig, samples), (samples, samples), np.eye(4))
    before, after = (fit_geometry(session_of(probed.rig, one)) for one in (samples, made))
    for i, m in enumerate(before.session.measured):
        missed = [np.std(state.around.expected[i] - m.problem.observed) for state in (before, after)]
        assert missed[1] < 0.05 * missed[0], m.name


def test_an_end_of_a_bar_whose_other_end_is_missing_has_no_partner(probed):
    samples = probed.samples
    a, b = lengths_of(samples)[2]
    fewer = samples.take(np.setdiff1d(np.arange(len(samples)), [a]))
    said = compare(probed, replace(probed, samples=fewer), diagnosed=False)
    assert sorted(said.only_measured_t_s) == sorted(samples.column("t_s")[[a, b]].tolist())
    assert said.matched == len(samples) - 2


@pytest.mark.endure  # daily: a wrong statement of one session, in tests/calibrate/diagnose/assess/test_stated_noise.py
def test_a_noise_stated_far_too_small_is_a_wrong_statement_of_both_sides_and_no_mismatch(tmp_path):
    """7.5 times too small: a difference of two sessions scatters by 10.6 times, more than statements are wrong by."""
    drawn = recording_of(tmp_path, family="tracker", seed=3, samples=80)
    rig = structs.replace(drawn.rig, noise=structs.replace(drawn.rig.noise, position_m=1e-6))
    one, two = (
        shifted(
            replace(drawn, rig=rig),
            {n: drawn.samples.column(n) + np.random.default_rng(seed).normal(0.0, 7.5e-6, 80) for n in POSITION},
        )
        for seed in (1, 2)
    )
    (noise,) = compare(one, two).diagnosis.noise
    assert noise.statement == "wrong"
    assert noise.stated == pytest.approx(np.sqrt(2.0) * 1e-6)


@pytest.mark.endure  # daily: a blind joint of one session, in tests/calibrate/diagnose/assess/test_blind_joints.py
def test_of_a_joint_on_whose_axis_the_target_lies_no_zero_is_reported(tmp_path):
    """The target stands a tenth of a millimetre off its axis, which a turn of the joint could explain."""
    drawn = recording_of(tmp_path, family="tracker", seed=3, samples=80)
    rig = structs.replace(drawn.rig, tool=structs.replace(drawn.rig.tool, point_m=(0.0, 0.0, 0.1)))
    arm = RigArm.of_rig(rig)
    flange = arm.frames(drawn.samples.joints())[:, -1]

    def seen(point_m, seed):
        at = flange[:, :3, :3] @ np.array(point_m) + flange[:, :3, 3]
        noise = np.random.default_rng(seed).normal(0.0, rig.noise.position_m, at.shape)
        return shifted(replace(drawn, rig=rig), dict(zip(POSITION, (at + noise).T, strict=True)))

    said = compare(seen((1e-4, 1e-4, 0.1), 1), seen((0.0, 1e-4, 0.1), 2))
    assert not [one for one in said.differences if one.where == "joint6.angle"]
    assert "the target lies on the axis of joint 6: whether its zero differs cannot be determined" in said.notes
