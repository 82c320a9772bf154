"""Touched planes: the zeros are found within their sigma, and what a plane cannot show gets no number."""

from pathlib import Path

import msgspec
import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

from acquisition.recording import Samples
from acquisition.recording.rig import load_rig
from acquisition.recording.rig.schema import KnownAngle, KnownDistance, Noise
from benchmarks.drawn_sessions import Bench, forward, reach
from calibrate.errors import DataError
from calibrate.fit.identify.identify import identify
from calibrate.fit.identify.result import scale_alarms
from calibrate.fit.identify.wrong_file import refuse_wrong_file
from calibrate.model.sensors.known_planes import known_planes
from calibrate.model.sensors.plane import best_planes

RIG = Path(__file__).parents[4] / "rigs" / "ur5e-dual-psd.toml"
TOOL_M = np.array([0.02, -0.01, 0.12])
ZEROS_RAD = np.array([0.0, 3e-3, -2e-3, 4e-3, -3e-3, 0.0])
NOISE_M = 5e-5
HEIGHTS_M = (0.05, 0.25)
BLOCK = KnownDistance(1, 2, HEIGHTS_M[1] - HEIGHTS_M[0], 2e-5, "plane")
SEEN = ("joint2.zero", "joint3.zero", "joint4.zero", "joint5.zero")


def touched(touches, seed=2):
    """Rig and samples of touches of two level planes, one above the other, by a UR5e with wrong zeros.

    Plain products of the benchmarks: nothing of calibrate.
    """
    rng = np.random.default_rng(seed)
    goal_m = rng.uniform((0.25, -0.45, 0.0), (0.65, 0.45, 0.0), (2 * touches, 3))
    plane = np.tile([1.0, 2.0], touches)
    goal_m[:, 2] = np.array(HEIGHTS_M)[plane.astype(int) - 1] + rng.normal(0.0, NOISE_M, len(plane))
    turns = Rotation.from_rotvec([np.pi, 0.0, 0.0]) * Rotation.from_rotvec(rng.normal(0.0, 0.6, (len(plane), 3)))
    wanted = np.tile(np.eye(4), (len(plane), 1, 1))
    wanted[:, :3, :3], wanted[:, :3, 3] = turns.as_matrix(), goal_m - turns.apply(TOOL_M)
    links = Bench(RIG).links
    angles, good = reach(wanted, links, rng)
    good &= np.linalg.norm(forward(angles, links)[:, :3, 3] - wanted[:, :3, 3], axis=1) < 1e-8
    q = (np.remainder(angles + np.pi, 2.0 * np.pi) - np.pi - ZEROS_RAD)[good][:touches]
    columns = {f"q{i + 1}_rad": q[:, i] for i in range(6)}
    samples = Samples({"t_s": np.arange(len(q), dtype=float), **columns, "plane": plane[good][:touches]}, 6)
    rig = load_rig(RIG)
    tool = msgspec.structs.replace(rig.tool, point_m=tuple(TOOL_M.tolist()))
    return msgspec.structs.replace(rig, tool=tool, noise=Noise(plane_m=NOISE_M, joint_rad=1e-6)), samples


def fitted(rig, samples):
    return identify(rig, samples, rng=np.random.default_rng(1), held_out_share=0.0, bootstrap_rounds=0)


def test_zeros_are_found_within_their_sigma_by_touches_and_one_known_distance():
    rig, samples = touched(60)
    result = fitted(msgspec.structs.replace(rig, known_distances=(BLOCK,)), samples)
    assert len(samples) == 60
    found = {e.name: e for e in result.estimates}
    for name in SEEN:
        assert found[name].sigma < 1e-3, name
        assert abs(found[name].value - ZEROS_RAD[int(name[5]) - 1]) < 3.0 * found[name].sigma, name
    assert found["joint1.zero"].value is None  # a level plane may turn about the first axis
    assert not [alarm for alarm in result.alarms if "no length" in alarm]


def test_a_plane_alone_shows_neither_scale_nor_base():
    rig, samples = touched(120)
    one = samples.take(samples.columns["plane"] == 1.0)
    result = fitted(msgspec.structs.replace(rig, tolerance=None), one)
    values = {e.name: e.value for e in result.estimates}
    assert values["joint1.zero"] is None
    assert values["link1.offset"] is None
    assert values["link2.length"] is None
    assert values["link3.length"] is None
    assert any("no length" in alarm for alarm in result.alarms)


def test_planes_and_cones_together_hold_no_length_either():
    assert scale_alarms(["seat", "plane"])
    assert scale_alarms(["plane", "bar"]) == ()
    assert scale_alarms(["plane"], known_lengths=1) == ()


@pytest.mark.parametrize(
    ("tips_m", "why"),
    [
        (np.eye(3), r"plane 1: 3 row\(s\).*4 times"),
        (np.outer(np.arange(5.0), (1.0, 2.0, 0.0)), "plane 1: all touches are on one line"),
    ],
)
def test_touches_that_fix_no_plane_are_refused(tips_m, why):
    with pytest.raises(DataError, match=why):
        best_planes(tips_m, np.ones(len(tips_m), dtype=int))


SIDE_M = 0.1
CUBE = np.array(
    [(x, y, 0.0) for x in (0.0, SIDE_M) for y in (0.0, SIDE_M)]
    + [(x, y, SIDE_M) for x in (0.01, 0.09) for y in (0.02, 0.08)]
    + [(0.0, y, z) for y in (0.0, SIDE_M) for z in (0.0, SIDE_M)]
)
FACES = np.repeat([1, 2, 3], 4)


def cube_blocks(length_m, angle_rad, between=(1, 2)):
    rig = msgspec.structs.replace(
        load_rig(RIG),
        known_distances=(KnownDistance(*between, length_m, 1e-5, "plane"), KnownDistance(1, 9, 0.3, 1e-5, "plane")),
        known_angles=(KnownAngle(1, 3, angle_rad, 1e-4),),
    )
    planes = best_planes(CUBE, FACES)
    return known_planes(rig, planes.parameters, planes.start_m, planes.axes, dict.fromkeys((1, 2, 3), 0.05))


def test_faces_of_a_cube_are_as_far_apart_and_as_square_as_stated():
    distance, angle = cube_blocks(SIDE_M, np.pi / 2.0)
    assert (distance.rows, angle.rows) == (1, 1)  # plane 9 was not touched
    assert_allclose(distance.residual(np.zeros(9)), 0.0, atol=1e-9)
    assert_allclose(angle.residual(np.zeros(9)), 0.0, atol=1e-9)


@pytest.mark.parametrize("between", [(1, 2), (2, 1)])
def test_a_wrong_side_and_a_wrong_angle_are_off_in_sigmas(between):
    distance, angle = cube_blocks(SIDE_M - 1e-4, np.pi / 2.0 - 1e-3, between)
    assert_allclose(distance.residual(np.zeros(9)), 10.0)
    assert_allclose(angle.residual(np.zeros(9)), 10.0)


def test_a_face_that_leans_is_not_parallel():
    distance, _ = cube_blocks(SIDE_M, np.pi / 2.0)
    leaning = np.zeros(9)
    leaning[3] = 1e-3  # roll of plane 2: 50 um at its rms touch of 50 mm
    assert np.abs(distance.residual(leaning)).max() == pytest.approx(5.0, rel=1e-3)
    assert np.abs(distance.jacobian(np.zeros(9))[:, 3]).max() == pytest.approx(5e3, rel=1e-3)


@pytest.mark.parametrize(
    ("stated", "place"),
    [
        ({"known_distances": (KnownDistance(1, 2, 0.21, 2e-5, "plane"),)}, "known_distance"),
        ({"known_angles": (KnownAngle(1, 2, 0.05, 1e-4),)}, "known_angle"),
    ],
)
def test_what_the_touches_contradict_is_named_with_both_planes(stated, place):
    rig, samples = touched(60)
    right = msgspec.structs.replace(rig, known_distances=(BLOCK,), known_angles=(KnownAngle(1, 2, 0.0, 1e-4),))
    refuse_wrong_file(right, samples)
    with pytest.raises(DataError, match=f"{place}.*planes 1 and 2"):
        refuse_wrong_file(msgspec.structs.replace(rig, **stated), samples)


def test_a_touch_with_the_number_of_the_other_plane_is_left_out():
    rig, samples = touched(120)
    plane = samples.columns["plane"].copy()
    plane[7] = 3.0 - plane[7]
    wrong = Samples({**samples.columns, "plane": plane}, 6)
    result = fitted(msgspec.structs.replace(rig, known_distances=(BLOCK,)), wrong)
    assert [error.rows for error in result.blunders] == [(7,)]
