"""Coarse aim by camera: onto the faces from where the board is in view, and named ends where it is not."""

from pathlib import Path

import numpy as np
import pytest

from acquisition.centring.aim import BeamTarget
from acquisition.centring.camera.board import Board, Grey, Sight, board_poses
from acquisition.centring.camera.model import drawn
from acquisition.centring.navigator import Navigator
from acquisition.centring.search import Aim, Aimed
from acquisition.errors import RefusedMotionError
from acquisition.motion.kinematics import apart, transform
from acquisition.recording.rig import load_rig, plain_rig, rig_text
from benchmarks import coarse_aim
from calibeam.learner import FittedLearner
from tests.acquisition.conftest import true_fixture
from tests.support.direct_bench import DirectEye, direct_bench

RIG = Path(__file__).parents[3] / "rigs" / "ur5e-dual-psd-camera.toml"
CENTRES = (0.0, 0.0, 0.0, 0.0)


@pytest.fixture(scope="module")
def camera_rig():
    return load_rig(RIG)


@pytest.fixture(scope="module")
def camera_plain():
    return plain_rig(rig_text(RIG), str(RIG))


def sight_of(rig, eye, model=None) -> Sight:
    board = rig.camera.board
    on_fixture = transform(board.in_psd1.origin_m, board.in_psd1.rotation_rad)
    return Sight(eye, model or drawn(rig.camera), Board(board), on_fixture)


class Blind:
    def picture(self) -> Grey:
        return np.full((720, 960), 90, dtype=np.uint8)


def test_from_where_the_board_is_in_view_both_spots_come_onto_the_faces(camera_rig, camera_plain) -> None:
    """The benchmark in small: one world with zeros off by up to 2 deg."""
    _, runs = coarse_aim.run(camera_rig, camera_plain, starts=2, seed=5)
    assert [run.aim.aimed for run in runs] == [Aimed.LIT] * 2


def test_what_the_camera_does_not_see_is_said_and_nothing_moves(camera_rig, camera_plain) -> None:
    bench, learner = direct_bench(camera_rig, camera_plain, seed=3), FittedLearner(camera_rig)
    aim = Aim(bench, sight_of(camera_rig, Blind()), learner.arm, learner.optics)
    home_rad = bench.standing_rad
    found = aim.run(BeamTarget(1, CENTRES, 0.2, 0.0), home_rad, learner.T_base_fixture(1), np.random.default_rng(1))
    assert found.aimed is Aimed.UNSEEN
    assert bench.moves == 0


def test_where_a_box_is_in_the_way_of_one_posture_another_is_taken(camera_rig, camera_plain) -> None:
    bench, learner = direct_bench(camera_rig, camera_plain, seed=3), FittedLearner(camera_rig)

    class Boxed:
        """The gate lets no motion through but the third."""

        moves = 0

        def move(self, q_rad: np.ndarray) -> None:
            self.moves += 1
            if self.moves < 3:
                raise RefusedMotionError("the arm would come within 3 mm of the keep-out box 'post'")
            bench.move(q_rad)

        def look(self, dwell_s: float):
            return bench.look(dwell_s)

    home_rad, T, rng = bench.standing_rad, learner.T_base_fixture(1), np.random.default_rng(1)

    class Seeing:
        def fixture(self, arm, q_rad, T_base_fixture) -> np.ndarray:
            return T

    target = BeamTarget(1, CENTRES, 0.2, 0.0)
    found = Aim(Boxed(), Seeing(), learner.arm, learner.optics).run(target, home_rad, T, rng)  # type: ignore[arg-type]
    assert found.aimed is not Aimed.UNREACHABLE
    assert found.target.roll_rad != 0.0
    assert found.motions >= 1

    class Walled(Boxed):
        def move(self, q_rad: np.ndarray) -> None:
            raise RefusedMotionError("the arm would come within 3 mm of the keep-out box 'post'")

    stuck = Aim(Walled(), Seeing(), learner.arm, learner.optics).run(target, home_rad, T, rng)  # type: ignore[arg-type]
    assert stuck.aimed is Aimed.UNREACHABLE
    np.testing.assert_array_equal(stuck.q_rad, home_rad)


def test_of_two_poses_that_look_alike_the_one_that_was_assumed_is_taken(camera_rig, camera_plain) -> None:
    """A small board seen flat on: its mirror twin fits the corners as well."""
    eye = DirectEye(direct_bench(camera_rig, camera_plain, seed=1).world, camera_plain)
    flat = transform((0.02, 0.01, 0.45), (np.pi - 0.2, 0.0, 0.0))
    picture = eye.taken(flat)
    seen = Board(camera_rig.camera.board).find(picture)
    assert seen is not None
    poses = board_poses(drawn(camera_rig.camera), seen)
    assert len(poses) == 2
    turned = [apart(T, poses[0][0])[1] for T, _ in poses]
    assert turned[1] > 0.1  # they are two indeed

    class Once:
        def picture(self) -> Grey:
            return picture

    learner = FittedLearner(camera_rig)
    q_rad = np.array(camera_rig.motion.home_rad)
    sight = sight_of(camera_rig, Once())
    board = camera_rig.camera.board
    to_fixture = np.linalg.inv(transform(board.in_psd1.origin_m, board.in_psd1.rotation_rad))
    before = learner.arm.flange(q_rad) @ drawn(camera_rig.camera).T_flange_camera
    for T, _ in poses:
        assumed = before @ T @ to_fixture
        assert apart(sight.fixture(learner.arm, q_rad, assumed), assumed)[1] < 1e-9


class EventLog:
    def __init__(self) -> None:
        self.events = []

    def sample(self, sample) -> None: ...

    def event(self, kind, detail) -> None:
        self.events.append((kind, detail))


def test_a_session_finds_a_fixture_by_camera_that_stands_far_from_where_the_rig_file_has_it(
    camera_rig, camera_plain
) -> None:
    """60 mm and 12 deg off: the beam misses all, and the camera sees by how much. No search is needed."""
    world = coarse_aim.measured_world(camera_rig, camera_plain, np.random.default_rng(8))
    learner, bench, log = world.learner, world.bench, EventLog()

    class Astray(FittedLearner):
        def T_base_fixture(self, placement: int) -> np.ndarray:
            off = transform((0.05, -0.03, 0.02), (0.1, 0.15, -0.1))
            return super().T_base_fixture(placement) @ off

    astray = Astray(camera_rig)
    sight = sight_of(camera_rig, world.eye, world.model)
    navigator = Navigator(bench, astray, log, bench.standing_rad, 1, sight)
    bench.move(bench.standing_rad)
    navigator.find(world.placement, 1, 0.0)
    kinds = [kind for kind, _ in log.events]
    assert "search" not in kinds
    assert all(bench.look(0.01).lit(1))
    assert apart(astray.T_base_fixture(world.placement), true_fixture(bench, world.placement))[0] > 0.04
    assert learner is not astray


def test_without_sight_of_the_board_the_session_searches(camera_rig, camera_plain) -> None:
    bench, learner, log = direct_bench(camera_rig, camera_plain, seed=3), FittedLearner(camera_rig), EventLog()
    navigator = Navigator(bench, learner, log, bench.standing_rad, 1, sight_of(camera_rig, Blind()))
    navigator.find(1, 1, 0.0)
    kinds = [kind for kind, _ in log.events]
    assert kinds[-1] == "centring"
    assert ("aim", {"aimed": "UNSEEN", "motions": 0}) in log.events or "search" not in kinds
