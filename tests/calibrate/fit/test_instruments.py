"""From columns to blocks: every instrument of a session, alone and together, recovers what is true and no more."""

from dataclasses import replace
from pathlib import Path

import msgspec
import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

from acquisition.recording import Samples
from acquisition.recording.rig import Pose, load_rig
from acquisition.recording.rig.schema import Bar, KnownDistance
from calibrate.errors import DataError
from calibrate.fit.instruments import instruments_of
from calibrate.fit.rank.identifiability import analyse
from calibrate.fit.solvers import Status, solve
from calibrate.model.arms.catalogue import arm_of
from calibrate.model.parameters import hold

RIG = Path(__file__).parents[3] / "rigs" / "ur5e-dual-psd.toml"
TOOL = np.array([0.021, -0.012, 0.083])
TURN, SHIFT = Rotation.from_rotvec([0.3, -0.4, 2.2]), np.array([1.8, -0.6, 0.4])
PAIR = tuple(f"psd2.{a}" for a in ("x", "y", "z", "roll", "pitch", "yaw"))
DRUM = np.array([1.1, 0.9, 0.2])
N = 60


@pytest.fixture
def rig():
    rig = load_rig(RIG)
    tool = msgspec.structs.replace(rig.tool, point_m=(0.02, -0.01, 0.08))
    return msgspec.structs.replace(rig, tool=tool)


@pytest.fixture
def truth(ur5e_truth):
    return ur5e_truth(np.random.default_rng(5), zero_max=5e-3)


def random_readings(n=N, seed=6):
    return np.random.default_rng(seed).uniform(-1.8, 1.8, (n, 6))


def tips(truth, q_rad):
    return np.array([(truth.flange(q + truth.zeros) @ np.array([*TOOL, 1.0]))[:3] for q in q_rad])


def table(q_rad, **columns):
    readings = {f"q{i + 1}_rad": q_rad[:, i] for i in range(6)}
    return Samples({"t_s": np.arange(len(q_rad), dtype=float), **readings, **columns}, 6)


def position_columns(truth, q_rad, noise_m=0.0, seed=7):
    seen = TURN.inv().apply(tips(truth, q_rad) - SHIFT)
    seen = seen + np.random.default_rng(seed).normal(0, noise_m, seen.shape)
    return dict(zip(("x_m", "y_m", "z_m"), seen.T, strict=True))


def seated(rig, cones, each, seed=8):
    """Readings that put the tip of an arm built as drawn into cones (cone, 3), from many sides, by Newton steps."""
    arm, goal = arm_of(rig), np.repeat(cones, each, axis=0)
    theta, q = np.zeros(len(arm.parameters)), np.random.default_rng(seed).uniform(-1.5, 1.5, (len(goal), 6))
    for _ in range(80):
        T = arm.flange(theta, q)
        tip = T[:, :3, :3] @ np.array(rig.tool.point_m) + T[:, :3, 3]
        twist = np.swapaxes(arm.joint_twists(theta, q), 1, 2)  # (pose, joint, 6)
        J = np.swapaxes(twist[..., :3] + np.cross(twist[..., 3:], tip[:, None]), 1, 2)
        damped = J @ np.swapaxes(J, 1, 2) + 1e-8 * np.eye(3)
        step = np.swapaxes(J, 1, 2) @ np.linalg.solve(damped, (goal - tip)[..., None])
        q = q + step[..., 0].clip(-0.3, 0.3)
    good = np.linalg.norm(tip - goal, axis=1) < 1e-12
    return q[good], np.repeat(np.arange(1, len(cones) + 1), each)[good]


def fitted(instruments):
    """Fit with everything held that is not seen; status, problem and values."""
    weighting = instruments.weighting
    theta, start = instruments.start, instruments.start
    for _ in range(3):
        problem = weighting.problem(theta)
        seen = analyse(problem.jacobian(theta), problem.parameters)
        problem = problem.with_parameters(hold(problem.parameters, [c.representative for c in seen.combinations]))
        fit = solve(problem, start=start)
        start = theta = fit.theta
    return fit, problem, seen


def left_m(instruments):
    """Misfit that remains where the drawing, believed a thousand times less, no longer pulls."""
    problem = instruments.weighting.problem(instruments.start)
    problem = problem.with_parameters(tuple(replace(p, prior=1e3 * p.prior) for p in problem.parameters))
    fit = solve(problem, start=instruments.start)
    (one,) = instruments.weighting.measured
    return float(np.sqrt(np.mean(one.problem.misfit(problem.of_block(0, fit.theta)) ** 2)))


def test_exact_positions_are_explained_to_rounding_without_any_device_in_the_rig(rig, truth):
    q = random_readings()
    found = instruments_of(table(q, **position_columns(truth, q)), rig)
    assert [m.name for m in found.weighting.measured] == ["position"]
    assert left_m(found) < 1e-9


def test_a_device_in_the_rig_is_a_start_and_with_a_tolerance_a_prior(rig, truth):
    q = random_readings()
    samples = table(q, **position_columns(truth, q))
    rough = msgspec.structs.replace(rig, device=Pose((1.7, -0.5, 0.5), (0.3, -0.4, 2.1)))
    found = instruments_of(samples, rough)
    assert {p.prior for p in found.weighting.parameters if p.name.startswith("device")} == {np.inf}
    assert_allclose(found.start[[p.name for p in found.weighting.parameters].index("device.yaw")], 0.1, atol=0.02)
    tolerance = msgspec.structs.replace(rig.tolerance, device_m=0.2, device_rad=0.3)
    assumed = instruments_of(samples, msgspec.structs.replace(rough, tolerance=tolerance))
    assert [p.prior for p in assumed.weighting.parameters if p.name.startswith("device")] == [0.2] * 3 + [0.3] * 3


def test_a_target_that_nobody_states_is_found_with_the_frame(rig, truth):
    q = random_readings()
    nameless = msgspec.structs.replace(rig, tool=msgspec.structs.replace(rig.tool, point_m=None))
    found = instruments_of(table(q, **position_columns(truth, q)), nameless)
    assert found.alignment is not None
    assert found.alignment.rms_m < 0.02  # of zeros of 5 mrad at 1 m
    (chain,) = (m.problem.chain for m in found.weighting.measured)
    assert_allclose(chain.sensor.target.point_m, TOOL, atol=0.02)


def test_distances_need_no_frame(rig, truth):
    q = random_readings()
    found = instruments_of(table(q, **position_columns(truth, q)), rig, asked=("distance",))
    assert not [p for p in found.weighting.parameters if p.name.startswith("device")]
    assert left_m(found) < 1e-9
    fit, _, seen = fitted(found)
    assert fit.status is Status.CONVERGED
    assert seen.reason("joint1.zero") is not None


def test_wire_lengths_find_their_drum(rig, truth):
    q = random_readings()
    length = np.linalg.norm(tips(truth, q) - DRUM, axis=1)
    found = instruments_of(table(q, wire_m=length), rig)
    (one,) = found.weighting.measured
    assert_allclose(one.problem.chain.sensor.device.T_base_device[:3, 3], DRUM, atol=0.05)
    assert left_m(found) < 1e-9


def test_full_poses_are_explained_to_rounding(rig, truth):
    q = random_readings()
    mounted = Rotation.from_rotvec([0.1, 0.2, 3.0])
    flange = Rotation.from_matrix([truth.flange(row + truth.zeros)[:3, :3] for row in q])
    turn = (TURN.inv() * flange * mounted).as_rotvec()
    columns = dict(zip(("rx_rad", "ry_rad", "rz_rad"), turn.T, strict=True))
    found = instruments_of(table(q, **position_columns(truth, q), **columns), rig)
    assert [m.name for m in found.weighting.measured] == ["full-pose"]
    assert found.weighting.sources == ("joint", "position", "orientation")
    assert left_m(found) < 1e-9


CONES = np.array([[0.45, 0.1, 0.2], [-0.1, 0.5, 0.3], [0.3, -0.4, 0.1]])


def scale(instruments, rig):
    """The direction in which all lengths grow alike, of parameters of an arm that is as drawn."""
    lengths = {f"link{i}.{what}": value for i, j in enumerate(rig.arm.joints, 1) for what, value in named_lengths(j)}
    lengths |= dict(zip(("tool.x", "tool.y", "tool.z"), rig.tool.point_m, strict=True))
    lengths |= {f"seat{k}.{a}": value for k, cone in enumerate(CONES, 1) for a, value in zip("xyz", cone, strict=True)}
    return np.array([lengths.get(p.name, 0.0) for p in instruments.weighting.parameters])


def named_lengths(joint):
    return ("offset", joint.d_m), ("length", joint.a_m)


def seen_without_drawing(instruments):
    """What the data alone can see of lengths and zeros."""
    problem = instruments.weighting.problem(instruments.start)
    return analyse(problem.jacobian(instruments.start), tuple(replace(p, prior=np.inf) for p in problem.parameters))


def test_cones_alone_hold_no_scale(rig):
    q, seat = seated(rig, CONES, 40)
    assert len(q) > 80
    found = instruments_of(table(q, seat=seat.astype(float)), rig)
    grown = scale(found, rig)
    J = found.weighting.problem(found.start).jacobian(found.start)
    assert np.linalg.norm(J @ grown) < 1e-8 * np.linalg.norm(J, axis=0) @ np.abs(grown)
    reason = seen_without_drawing(found).reason("link2.length")
    assert reason is not None
    assert "link3.length" in reason


def test_one_known_length_gives_the_cones_their_scale(rig):
    q, seat = seated(rig, CONES, 40)
    bar_m = float(np.linalg.norm(CONES[1] - CONES[0]))
    first, second = np.flatnonzero(seat == 1)[:20], np.flatnonzero(seat == 2)[:20]
    rows = np.concatenate([np.stack([first, second], axis=1).ravel(), np.flatnonzero(seat == 3)])
    bar = np.where(np.arange(len(rows)) < 40, 1.0, np.nan)
    ends = np.where(np.isnan(bar), "", np.tile(["a", "b"], len(rows))[: len(rows)])
    samples = table(q[rows], seat=seat[rows].astype(float), bar=bar, bar_end=ends)
    found = instruments_of(samples, msgspec.structs.replace(rig, bar_list=(Bar(1, bar_m),)))
    assert [(m.name, m.problem.rows) for m in found.weighting.measured] == [("seat", len(rows)), ("bar", 20)]
    assert (
        np.abs(found.weighting.measured[1].problem.misfit(found.weighting.unweighted.of_block(1, found.start))).max()
        < 1e-9
    )
    assert seen_without_drawing(found).reason("link2.length") is None


def test_drawing_tolerance_alone_keeps_the_size_of_an_arm_in_cones(rig):
    """Noise must not shrink the arm: sigma of the joints is mapped through it, and the drawing holds the scale."""
    q, seat = seated(rig, CONES, 40)
    read = q + np.random.default_rng(9).normal(0, 3e-5, q.shape)
    fit, problem, _ = fitted(instruments_of(table(read, seat=seat.astype(float)), rig))
    names = [p.name for p in problem.parameters]
    shrunk = [fit.theta[names.index(f"link{i}.length")] / rig.arm.joints[i - 1].a_m for i in (2, 3)]
    assert np.abs(shrunk).max() < 3 * rig.tolerance.length_m / 0.39


def test_known_distances_speak_of_used_placements_only(rig, sessions):
    session = sessions(11, n=24, places=(1, 2))
    samples = spots_table(session)
    lengths = (KnownDistance(1, 2, 0.5, 2e-5), KnownDistance(1, 3, 0.5, 2e-5))
    found = instruments_of(samples, msgspec.structs.replace(rig, known_distances=lengths))
    (known,) = found.weighting.known
    assert known.rows == 1
    assert found.weighting.problem(found.start).rows == 25


def test_a_known_distance_of_two_cones_gives_the_scale(rig):
    """Whatever the drawing: one that is 1 % longer wants an arm 1 % longer. Of a cone without rows none is used."""
    q, seat = seated(rig, CONES, 40)
    longer_m = 1.01 * float(np.linalg.norm(CONES[1] - CONES[0]))
    stated = KnownDistance(1, 2, longer_m, 1e-6, "seat"), KnownDistance(1, 9, 1.0, 1e-6, "seat")
    found = instruments_of(table(q, seat=seat.astype(float)), msgspec.structs.replace(rig, known_distances=stated))
    (known,) = found.weighting.known
    problem = found.weighting.problem(found.start)
    assert (known.rows, problem.rows) == (1, len(q) + 1)
    assert problem.residual(found.start)[-1] == pytest.approx(-0.01 * longer_m / 1.01 / 1e-6)
    assert abs(problem.residual(found.start + 0.01 * scale(found, rig))[-1]) < 1e-6
    assert seen_without_drawing(found).reason("link2.length") is None


def test_sizes_of_joint_and_tracker_noise_are_both_found(rig, truth):
    q = random_readings(300)
    read = q + np.random.default_rng(10).normal(0, 3e-5, q.shape)
    found = instruments_of(table(read, **position_columns(truth, q, 40e-6)), rig)
    fit, problem, _ = fitted(found)
    factors = found.weighting.noise(problem.parameters, fit.theta)
    assumed = np.array([found.weighting.joint_rad, 20e-6])
    true = np.array([3e-5, 40e-6]) / assumed
    assert found.weighting.sources == ("joint", "position")
    assert np.all(np.abs(factors.factor - true) < 4.0 * factors.factor_sigma)
    assert np.all(factors.factor_sigma < 0.25 * factors.factor)


def test_several_instruments_at_once_share_arm_tool_and_device(rig, truth):
    q = random_readings()
    position = position_columns(truth, q)
    for column in position.values():
        column[40:] = np.nan
    length = np.linalg.norm(tips(truth, q) - SHIFT, axis=1)
    length[:30] = np.nan
    found = instruments_of(table(q, **position, wire_m=length), rig)
    weighting = found.weighting
    assert [(m.name, m.problem.rows) for m in weighting.measured] == [("position", 40), ("wire", 30)]
    names = [p.name for p in weighting.parameters]
    assert len(names) == len(set(names)) == 30 + 3 + 6
    assert weighting.problem(found.start).rows == 70
    cut = weighting.take(np.array([0, 35, 59]))
    assert [m.problem.rows for m in cut.measured] == [2, 2]


def test_rows_without_an_observation_are_reported(rig, truth):
    q = random_readings()
    position = position_columns(truth, q)
    for column in position.values():
        column[[4, 9]] = np.nan
    assert instruments_of(table(q, **position), rig).unused.tolist() == [4, 9]


def test_what_contradicts_itself_is_refused(rig, truth):
    q = random_readings(12)
    with pytest.raises(DataError, match="no row holds an observation"):
        instruments_of(table(q), rig)
    with pytest.raises(DataError, match="row 4, column 'wire_m': 0"):
        instruments_of(table(q, wire_m=np.where(np.arange(12) == 3, 0.0, 1.0)), rig)
    nameless = msgspec.structs.replace(rig, tool=msgspec.structs.replace(rig.tool, point_m=None))
    with pytest.raises(DataError, match=r"need tool\.point_m"):
        instruments_of(table(q, wire_m=np.ones(12)), nameless)
    with pytest.raises(DataError, match="bar 7 is not in the rig"):
        instruments_of(table(q, bar=np.full(12, 7.0), bar_end=np.tile(["a", "b"], 6)), rig)
    seat = np.where(np.arange(12) == 5, 2.0, 1.0)
    with pytest.raises(DataError, match="seat 2: 1 row"):
        instruments_of(table(q, seat=seat), rig)


def spots_table(session):
    names = ("psd1_x_m", "psd1_y_m", "psd2_x_m", "psd2_y_m")
    columns = dict(zip(names, session.spots_m.T, strict=True))
    place, first = session.placement.astype(float), session.first_psd.astype(float)
    return table(session.q_rad, placement=place, first_psd=first, **columns)


def test_gains_and_second_face_are_free_only_under_a_stated_tolerance(rig, sessions):
    samples = spots_table(sessions(11, n=24, places=(1, 2)))

    def free(belonging, rig):
        listed = instruments_of(samples, rig).weighting.parameters
        return {p.prior for p in listed if p.free and p.name.startswith(belonging)}

    assert free(("psd1.gain", "psd2.gain"), rig) == free(PAIR, rig) == set()
    tolerance = msgspec.structs.replace(rig.tolerance, gain=2e-3, psd2_m=5e-5, psd2_rad=1e-3)
    loose = msgspec.structs.replace(rig, tolerance=tolerance)
    assert free(("psd1.gain", "psd2.gain"), loose) == {2e-3}
    assert free(PAIR, loose) == {5e-5, 1e-3}


def test_centred_spots_may_be_used_as_lines_through_one_point(rig, sessions, ur5e_exact):
    session = sessions(21, n=40, truth=ur5e_exact(), spread=0.0, places=(1,), joint_noise=0.0, psd_noise=0.0)
    found = instruments_of(spots_table(session), rig, asked=("point",))
    assert [m.name for m in found.weighting.measured] == ["point"]
    assert left_m(found) < 1e-9
    seen = seen_without_drawing(found)
    assert seen.reason("joint1.zero") is not None
    off = sessions(11, n=24, places=(1, 2))
    with pytest.raises(DataError, match="no row has all spots within"):
        instruments_of(spots_table(off), rig, asked=("point",))
