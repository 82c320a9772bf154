"""Coarse aim by the camera: from anywhere where it sees the board, do both spots come onto the faces?

Every world has its own arm (zeros off by up to 2 deg), fixture, lens, mount and board, and measures its camera first,
as a person on site would. Starts: board anywhere in the picture, 0.12 to 0.5 m away, tilted by up to 50 deg, any roll.
"""

from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from acquisition.centring.aim import BeamTarget, reach
from acquisition.centring.camera.board import Board, Sight
from acquisition.centring.camera.measuring import CameraMeasuring, MeasuredCamera
from acquisition.centring.camera.model import CameraFit, CameraModel
from acquisition.centring.search import Aim, Aimed, CameraAim, Found, Search
from acquisition.errors import UnreachableError
from acquisition.motion.kinematics import inverse, transform
from acquisition.recording.rig import Rig, load_rig, plain_rig, rig_text
from acquisition.session.records import Sample
from calibeam.learner import FittedLearner
from tests.support.direct_bench import DirectBench, DirectEye, direct_bench

Floats = NDArray[np.float64]

STARTS_A_WORLD = 4
DISTANCE_M = (0.12, 0.5)
TILT_RAD = np.deg2rad(50.0)
IN_PICTURE = 0.8  # of half the picture in which the board's middle may be
STAND_OFF_M = 0.2


@dataclass(frozen=True)
class Run:
    """One start: how the aim ended, and what the search made of what was left dark."""

    aim: CameraAim
    found: bool
    search_motions: int


@dataclass(frozen=True)
class World:
    """One rig with its measured camera."""

    bench: DirectBench
    learner: FittedLearner
    eye: DirectEye
    placement: int
    measured: MeasuredCamera
    model: CameraModel | None  # that is aimed by


def run(
    rig: Rig, plain: Mapping[str, Any], starts: int = 200, seed: int = 40_000, *, by_beam: bool = True
) -> tuple[list[World], list[Run]]:
    """Worlds and runs; orders alternate. `by_beam`: the camera is measured against the beam, too, as it is on site."""
    rng = np.random.default_rng(seed)
    worlds: list[World] = []
    runs: list[Run] = []
    while len(runs) < starts:
        world = measured_world(rig, plain, rng)
        world = world if by_beam else replace(world, model=world.measured.calibration.model)
        worlds.append(world)
        if world.model is None:
            continue
        left = min(STARTS_A_WORLD, starts - len(runs))
        runs += [
            aim_from(rig, world, start, 1 + k % 2, rng)
            for k, start in enumerate(islice(_starts(rig, world, rng), left))
        ]
    return worlds, runs


def measured_world(rig: Rig, plain: Mapping[str, Any], rng: np.random.Generator) -> World:
    """A new world whose camera was measured before a fixture of its own place."""
    bench, learner = direct_bench(rig, plain, seed=int(rng.integers(2**31))), FittedLearner(rig)
    eye, placement = DirectEye(bench.world, plain), int(rng.choice(list(rig.placements)))
    bench.place_fixture(placement)
    assert rig.camera is not None
    measured = CameraMeasuring(bench, learner, eye, rig.camera, Unheard()).run(placement)
    return World(bench, learner, eye, placement, measured, measured.model)


class Unheard:
    """A journal that nobody reads."""

    def sample(self, sample: Sample) -> None: ...

    def event(self, kind: str, detail: Mapping[str, Any]) -> None: ...


def _starts(rig: Rig, world: World, rng: np.random.Generator) -> Iterator[Floats]:
    """Joint readings from where the board is in the picture."""
    assert rig.camera is not None
    model = world.model
    assert model is not None
    on_fixture = transform(rig.camera.board.in_psd1.origin_m, rig.camera.board.in_psd1.rotation_rad)
    T_base_board = world.learner.T_base_fixture(world.placement) @ on_fixture
    board = Board(rig.camera.board)
    while True:
        T = _anywhere(model.size_px, model.matrix_px[0, 0], rng)
        try:
            q_rad = reach(
                world.learner.arm,
                T_base_board @ inverse(T) @ inverse(model.T_flange_camera),
                world.bench.standing_rad,
                rng,
            )
        except UnreachableError:
            continue
        world.bench.move(q_rad)
        if board.find(world.eye.picture()) is not None:
            yield q_rad


def _anywhere(size_px: tuple[int, int], focal_px: float, rng: np.random.Generator) -> Floats:
    """T_camera_board (4, 4): anywhere in the picture, at any distance, tilt and roll of a start."""
    depth_m = rng.uniform(*DISTANCE_M)
    middle = rng.uniform(-IN_PICTURE, IN_PICTURE, 2) * 0.5 * np.array(size_px) / focal_px
    azimuth, tilt = rng.uniform(-np.pi, np.pi), rng.uniform(0.0, TILT_RAD)
    tilted = Rotation.from_rotvec(tilt * np.array([np.cos(azimuth), np.sin(azimuth), 0.0]))
    rolled = Rotation.from_rotvec([0.0, 0.0, rng.uniform(-np.pi, np.pi)])
    T = np.eye(4)
    T[:3, :3] = (tilted * rolled).as_matrix() @ np.diag([1.0, -1.0, -1.0])  # the board faces the camera
    T[:3, 3] = depth_m * np.append(middle, 1.0)
    return T


def aim_from(rig: Rig, world: World, q_rad: Floats, first: int, rng: np.random.Generator) -> Run:
    """The coarse aim from a start, the fixture believed where the rig file has it; then the search if it is dark."""
    assert rig.camera is not None
    model = world.model
    assert model is not None
    on_fixture = transform(rig.camera.board.in_psd1.origin_m, rig.camera.board.in_psd1.rotation_rad)
    sight = Sight(world.eye, model, Board(rig.camera.board), on_fixture)
    learner, target = world.learner, BeamTarget(first, (0.0, 0.0, 0.0, 0.0), STAND_OFF_M, 0.0)
    T = learner.T_base_fixture(world.placement)
    aim = Aim(world.bench, sight, learner.arm, learner.optics).run(target, q_rad, T, rng)
    if aim.aimed is Aimed.LIT:
        return Run(aim, True, 0)
    result = Search(world.bench, learner.arm, learner.optics, aim.T_base_fixture, first).run(aim.q_rad)
    return Run(aim, result.found is Found.BOTH, result.motions)


def lines(path: Path, starts: int = 200) -> Iterator[str]:
    """The benchmark's table."""
    rig = load_rig(path)
    plain = plain_rig(rig_text(path), str(path))
    yield from table(*run(rig, plain, starts))
    _, runs = run(rig, plain, starts // 4, by_beam=False)
    lit = sum(run.aim.aimed is Aimed.LIT for run in runs)
    yield f"by lens and hand-eye alone, without the beam: {lit}/{len(runs)}"


def table(worlds: list[World], runs: list[Run]) -> Iterator[str]:
    fits = [world.measured.fit for world in worlds if world.measured.fit is not None]
    yield (
        f"camera measured in {len(fits)} of {len(worlds)} worlds, from {min(fit.views for fit in fits)} views and "
        f"{min(fit.lit for fit in fits)} poses with light or more; medians: corners "
        f"{_median(fits, 'reprojection_px'):.2f} px, board over the views {1e3 * _median(fits, 'board_m'):.1f} mm, "
        f"{1e3 * _median(fits, 'board_rad'):.0f} mrad, "
        f"beam before the camera {1e3 * _median(fits, 'beam_m'):.2f} mm and {1e3 * _median(fits, 'beam_rad'):.1f} mrad"
    )
    lit = [run for run in runs if run.aim.aimed is Aimed.LIT]
    motions = [run.aim.motions for run in lit]
    yield (
        f"both spots on the faces by the camera alone: {len(lit)}/{len(runs)}; motions median "
        f"{np.median(motions):.0f}, p90 {np.percentile(motions, 90):.0f}, max {max(motions)}"
    )
    ends = Counter(run.aim.aimed.name for run in runs if run.aim.aimed is not Aimed.LIT)
    yield from (f"    {name}: {count}" for name, count in sorted(ends.items()))
    yield f"with the search after it: {sum(run.found for run in runs)}/{len(runs)}"


def _median(fits: list[CameraFit], name: str) -> float:
    return float(np.median([getattr(fit, name) for fit in fits]))
