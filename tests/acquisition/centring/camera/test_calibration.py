"""Lens and mount from a tour: found where the views tell them, named where they do not."""

from dataclasses import replace

import msgspec
import numpy as np
import pytest

from acquisition.centring.camera import measuring
from acquisition.centring.camera.board import Board
from acquisition.centring.camera.calibration import CameraStatus, calibrate_camera, hand_eye
from acquisition.centring.camera.model import CameraFit, drawn, read_model, write_model
from acquisition.errors import AcquisitionError
from acquisition.motion.kinematics import apart, inverse, transform
from benchmarks.coarse_aim import measured_world
from tests.support.direct_bench import DirectEye


@pytest.fixture(scope="module")
def toured(rig, exact):
    """(views, calibration, the true camera) of a tour on a rig whose arm is as drawn."""
    kept = {}
    plain_calibrate = measuring.calibrate_camera

    def keep(views, start):
        kept["views"] = views
        return plain_calibrate(views, start)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(measuring, "calibrate_camera", keep)
        world = measured_world(rig, exact, np.random.default_rng(3))
    return kept["views"], world.measured.calibration, world.eye.camera


def test_lens_and_mount_are_found(toured) -> None:
    _, found, truth = toured
    assert found.status is CameraStatus.CALIBRATED
    assert found.model.matrix_px[0, 0] == pytest.approx(truth.focal_px, rel=0.01)
    assert found.model.matrix_px[:2, 2] == pytest.approx(truth.centre_px, abs=5.0)
    off_m, off_rad = apart(found.model.T_flange_camera, truth.T_flange_camera)
    assert off_m < 2e-3
    assert off_rad < 5e-3
    assert found.fit.reprojection_px < 0.3
    assert found.fit.board_m < 1e-3


def _poses(rng: np.random.Generator, count: int, turn_rad: float) -> np.ndarray:
    return np.array([transform(rng.normal(0.0, 0.5, 3), rng.normal(0.0, turn_rad, 3)) for _ in range(count)])


def _seen(T_base_flange: np.ndarray, mount: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """T_camera_board of a board that stands anywhere."""
    return inverse(T_base_flange @ mount) @ _poses(rng, 1, 1.0)[0]


@pytest.mark.parametrize("seed", range(20))
@pytest.mark.parametrize(("count", "turn_rad"), [(5, 1.0), (10, 0.7), (12, 2.5)])
def test_the_mount_comes_out_exactly_of_exact_poses(seed: int, count: int, turn_rad: float) -> None:
    rng = np.random.default_rng(seed)
    mount, T_base_flange = _poses(rng, 1, 1.5)[0], _poses(rng, count, turn_rad)
    off_m, off_rad = apart(hand_eye(T_base_flange, _seen(T_base_flange, mount, rng)), mount)
    assert off_m < 1e-10
    assert off_rad < 1e-10


def test_half_turns_between_views_do_no_harm() -> None:
    rng = np.random.default_rng(4)
    half = [transform(rng.normal(0.0, 0.5, 3), turn) for turn in np.pi * np.vstack([np.eye(3), -np.eye(3)])]
    T_base_flange, mount = np.array([np.eye(4), *half, *_poses(rng, 3, 0.7)]), _poses(rng, 1, 1.5)[0]
    assert apart(hand_eye(T_base_flange, _seen(T_base_flange, mount, rng)), mount) == pytest.approx(
        (0.0, 0.0), abs=1e-9
    )


def test_the_mount_is_off_by_about_what_the_pictures_are() -> None:
    """Over 200 tours of ten views, 1 mm and 2 mrad off each: rms within what ten views leave of these."""
    off = []
    for seed in range(200):
        rng = np.random.default_rng(seed)
        mount, T_base_flange = transform((0.05, 0.0, 0.08), (0.1, 0.2, 1.5)), _poses(rng, 10, 0.7)
        noise = np.array([transform(rng.normal(0.0, 1e-3, 3), rng.normal(0.0, 2e-3, 3)) for _ in T_base_flange])
        off.append(apart(hand_eye(T_base_flange, _seen(T_base_flange, mount, rng) @ noise), mount))
    rms_m, rms_rad = np.sqrt(np.mean(np.square(off), axis=0))
    assert 2e-4 < rms_m < 3e-3
    assert 5e-4 < rms_rad < 3e-3


def test_turns_about_one_axis_have_no_mount() -> None:
    T_base_flange = np.array([transform((0.1 * k, 0.0, 0.0), (0.0, 0.0, 0.3 * k)) for k in range(9)])
    with pytest.raises(ValueError, match=r"turned 0\.000 rad about a second axis, not 0\.3; take views from more"):
        hand_eye(T_base_flange, _seen(T_base_flange, np.eye(4), np.random.default_rng(1)))


def test_few_views_are_refused(rig, toured) -> None:
    assert calibrate_camera(toured[0][:5], drawn(rig.camera)).status is CameraStatus.TOO_FEW_VIEWS


def test_a_flange_that_turned_about_one_axis_only_does_not_tell_the_mount(rig, toured) -> None:
    first = toured[0][0]
    turned = [
        replace(v, T_base_flange=first.T_base_flange @ transform((0, 0, 0), (0, 0, 0.1 * k)))
        for k, v in enumerate(toured[0])
    ]
    found = calibrate_camera(turned, drawn(rig.camera))
    assert found.status is CameraStatus.TOO_LITTLE_TURN
    assert found.model is None


def test_a_board_with_another_gap_is_no_lens(rig, toured) -> None:
    wrong = [
        replace(v, seen=replace(v.seen, points_m=v.seen.points_m + 0.003 * np.sign(v.seen.points_m))) for v in toured[0]
    ]
    assert calibrate_camera(wrong, drawn(rig.camera)).status is CameraStatus.POOR_LENS


def test_a_board_that_was_moved_on_the_way_is_inconsistent(rig, toured) -> None:
    moved = [
        replace(v, T_base_flange=transform((0.05 * (k % 3), 0, 0), (0.1 * (k % 2), 0, 0)) @ v.T_base_flange)
        for k, v in enumerate(toured[0])
    ]
    found = calibrate_camera(moved, drawn(rig.camera))
    assert found.status is CameraStatus.INCONSISTENT
    assert found.model is None


def test_the_file_brings_the_camera_back(rig, toured, tmp_path) -> None:
    model, path = toured[1].model, tmp_path / "camera.json"
    write_model(path, model, toured[1].fit, rig.name, "test")
    back = read_model(path, rig.camera)
    np.testing.assert_allclose(back.matrix_px, model.matrix_px)
    np.testing.assert_allclose(back.T_flange_camera, model.T_flange_camera, atol=1e-12)
    np.testing.assert_allclose(back.distortion, model.distortion)


def test_a_file_that_is_not_there_or_of_another_camera_is_refused_with_the_remedy(rig, toured, tmp_path) -> None:
    path = tmp_path / "camera.json"
    with pytest.raises(AcquisitionError, match="calibeam camera"):
        read_model(path, rig.camera)
    write_model(path, toured[1].model, CameraFit(9, 0.1, 1e-3, 1e-3), rig.name, "test")
    with pytest.raises(AcquisitionError, match="960 x 720; wanted is calibeam-camera, 1, 640 x 720"):
        read_model(path, msgspec.structs.replace(rig.camera, width_px=640))


@pytest.mark.parametrize("dictionary", ["aruco-4x4-50", "apriltag-36h11"])
def test_the_board_is_found_in_pictures_of_either_dictionary(rig, exact, dictionary: str) -> None:
    from tests.support.direct_bench import direct_bench

    other = {**exact, "camera": {**exact["camera"], "board": {**exact["camera"]["board"], "dictionary": dictionary}}}
    bench = direct_bench(rig, other, seed=1)
    eye = DirectEye(bench.world, other)
    board = Board(msgspec.structs.replace(rig.camera.board, dictionary=dictionary))
    picture = eye.taken(transform((0.01, 0.0, 0.2), (np.pi - 0.3, 0.0, 0.0)))
    seen = board.find(picture)
    assert seen is not None
    assert len(seen.pixels) == 16


def test_a_board_that_its_dictionary_cannot_have_is_refused(rig) -> None:
    with pytest.raises(ValueError, match="lower first_id"):
        Board(msgspec.structs.replace(rig.camera.board, first_id=47))
