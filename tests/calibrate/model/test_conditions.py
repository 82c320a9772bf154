"""Cones state a condition, not a reading: what turns arm and cones together is unseen, whatever noise is left."""

from pathlib import Path

import msgspec
import numpy as np
import pytest

from acquisition.recording import Samples
from acquisition.recording.rig import load_rig
from calibrate.fit.identify.identify import identify
from calibrate.fit.instruments import instruments_of
from calibrate.fit.rank.identifiability import analyse
from calibrate.fit.solvers import Status
from calibrate.model.arms.catalogue import arm_of
from calibrate.model.arms.link_tolerance import FREE
from calibrate.model.parameters import start_values

NOISE_M = 8e-6
POINT_M = np.array([0.02, -0.01, 0.08])
CONES_M = np.array([[0.45, 0.1, 0.2], [0.2, 0.45, 0.35], [-0.3, 0.35, 0.3]])


@pytest.fixture(scope="module")
def rig():
    drawn = load_rig(Path(__file__).parents[3] / "rigs" / "ur5e-dual-psd.toml")
    tool = msgspec.structs.replace(drawn.tool, point_m=tuple(POINT_M))
    return msgspec.structs.replace(drawn, tool=tool, tolerance=None)


@pytest.fixture(scope="module")
def cones(rig):
    """The tip of a nominal arm in three cones from many sides, by Newton steps; with noise of the seat."""
    arm, rng = arm_of(rig), np.random.default_rng(4)
    seat = np.repeat(np.arange(3), 60)
    goal = CONES_M[seat] + rng.normal(0.0, NOISE_M, (len(seat), 3))
    theta, q = start_values(arm.parameters), rng.uniform(-1.5, 1.5, (len(seat), 6))
    for _ in range(80):
        T = arm.flange(theta, q)
        tip = T[:, :3, :3] @ POINT_M + T[:, :3, 3]
        twist = np.swapaxes(arm.joint_twists(theta, q), 1, 2)
        J = np.swapaxes(twist[..., :3] + np.cross(twist[..., 3:], tip[:, None]), 1, 2)
        q = q + (np.linalg.pinv(J, rcond=0.02) @ (goal - tip)[..., None])[..., 0].clip(-0.3, 0.3)
    good = np.linalg.norm(tip - goal, axis=1) < 1e-9
    readings = {f"q{i + 1}_rad": q[good, i] for i in range(6)}
    return Samples({"t_s": np.arange(good.sum(), dtype=float), **readings, "seat": seat[good] + 1.0}, 6)


@pytest.fixture(scope="module")
def problem(rig, cones):
    instruments = instruments_of(cones, rig, arm=arm_of(rig, FREE))
    return instruments.weighting.problem(instruments.start), instruments.start


def test_readings_are_moved_by_about_the_noise_to_where_every_cone_is_met(problem):
    joint, start = problem
    (before,), (after,) = joint.blocks, joint.fulfilled(start).blocks
    assert np.abs(before.misfit(start)).max() > NOISE_M
    assert np.abs(after.misfit(start)).max() < 1e-12
    assert 0.0 < np.abs(after.q_rad - before.q_rad).max() < 50.0 * NOISE_M  # rad over m: some levers are short


def test_the_turn_of_arm_and_cones_looks_seen_in_noise_and_is_not_where_the_condition_holds(problem):
    joint, start = problem
    noisy = analyse(joint.jacobian(start), joint.parameters)
    there = analyse(joint.fulfilled(start).jacobian(start), joint.parameters)
    assert noisy.reason("joint1.zero") is None
    assert "joint1.zero + seat" in there.reason("joint1.zero")
    assert there.rank == noisy.rank - 1


def test_cones_alone_come_to_an_end_and_tell_no_number_for_what_turns_or_grows_with_them(rig, cones):
    result = identify(rig, cones, rng=np.random.default_rng(1), held_out_share=0.0)
    assert result.status in (Status.CONVERGED, Status.RANK_DEFICIENT)
    lines = {e.name: e.value for e in result.estimates}
    assert [lines[n] for n in ("joint1.zero", "joint6.zero", "link2.length", "link3.length")] == [None] * 4
    assert lines["joint3.zero"] is not None


def test_readings_are_left_alone_where_there_is_something_to_read(rig, cones):
    q = cones.joints()
    tips = arm_of(rig).flange(start_values(arm_of(rig).parameters), q)[:, :3, 3]
    seen = dict(zip(("x_m", "y_m", "z_m"), tips.T, strict=True))
    instruments = instruments_of(Samples({**cones.columns, **seen}, 6).take(np.arange(30)), rig)
    joint = instruments.weighting.problem(instruments.start)
    for before, after in zip(joint.blocks, joint.fulfilled(instruments.start).blocks, strict=True):
        assert (after is before) == (not before.condition)
