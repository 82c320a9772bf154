"""Healthy sessions of every instrument, each with a concealed truth, by the plain products of drawn_sessions."""

from collections.abc import Callable
from pathlib import Path

import msgspec
import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from acquisition.recording import Samples
from acquisition.recording.rig import Rig, load_rig
from acquisition.recording.rig.schema import Bar
from acquisition.recording.samples import ORIENTATION, POSITION, SPOTS
from benchmarks.drawn_sessions import POSITION_SIGMA_M, T_BASE_DEVICE, TARGET_M, Bench, forward, frame, reach

Floats = NDArray[np.float64]

POSES = 60
CONES_M = np.array([[0.45, 0.1, 0.25], [0.2, -0.5, 0.35], [-0.3, 0.4, 0.3]])
BAR_M = 0.4
ORIENTATION_SIGMA_RAD, WIRE_SIGMA_M, JOINT_SIGMA_RAD = 1e-4, 5e-5, 5e-6


class Drawn:
    """The bench's rig with a target, a bar, and sessions of one instrument at a time."""

    def __init__(self, rig_file: Path) -> None:
        self.bench, drawn = Bench(rig_file), load_rig(rig_file)
        tool = msgspec.structs.replace(drawn.tool, point_m=tuple(TARGET_M.tolist()))
        self.rig: Rig = msgspec.structs.replace(drawn, tool=tool, bar_list=(Bar(1, BAR_M),))

    def tracker(self, rng: Generator) -> Samples:
        """Positions of a target."""
        session = self.bench.tracker(rng, POSES)
        return _table(session.q_rad, dict(zip(POSITION, session.observed.T, strict=True)))

    def full_pose(self, rng: Generator) -> Samples:
        """Positions and orientations of a target."""
        q, flange, tool = self._moved(rng)
        mount, device = Rotation.from_rotvec(rng.normal(0.0, 1.0, 3)), frame(*T_BASE_DEVICE)
        noise = Rotation.from_rotvec(rng.normal(0.0, ORIENTATION_SIGMA_RAD, (len(q), 3)))
        turned = Rotation.from_matrix(device[:3, :3].T @ flange[:, :3, :3]) * mount * noise
        seen = (_tips(flange, tool) - device[:3, 3]) @ device[:3, :3] + rng.normal(0.0, POSITION_SIGMA_M, (len(q), 3))
        columns = np.concatenate([seen, turned.as_rotvec()], axis=1)
        return _table(q, dict(zip((*POSITION, *ORIENTATION), columns.T, strict=True)))

    def wire(self, rng: Generator) -> Samples:
        """Lengths of a wire from a drum somewhere about."""
        q, flange, tool = self._moved(rng, 2 * POSES)
        drum = np.array([1.2, -0.8, 0.1]) + rng.normal(0.0, 0.1, 3)
        length = np.linalg.norm(_tips(flange, tool) - drum, axis=1)
        return _table(q, {"wire_m": length + rng.normal(0.0, WIRE_SIGMA_M, len(q))})

    def seats(self, rng: Generator) -> Samples:
        """A probe in three cones."""
        q, good = self._reaching(rng, np.repeat(CONES_M, POSES, axis=0))
        return _table(q[good], {"seat": np.repeat(np.arange(1.0, 4.0), POSES)[good]})

    def bars(self, rng: Generator) -> Samples:
        """A bar of known length, held in many ways."""
        a = rng.uniform([0.25, -0.3, 0.15], [0.5, 0.3, 0.5], (2 * POSES, 3))
        b = a + Rotation.random(len(a), rng=rng).apply([BAR_M, 0.0, 0.0])
        q, good = self._reaching(rng, np.stack([a, b], axis=1).reshape(-1, 3))
        both = np.repeat(good.reshape(-1, 2).all(axis=1), 2)
        ends = np.tile(["a", "b"], len(a))[both]
        return _table(q[both], {"bar": np.ones(int(both.sum())), "bar_end": ends})

    def dual_psd(self, rng: Generator) -> Samples:
        """Spots on both faces, two placements."""
        session = self.bench.dual_psd(rng, POSES)
        columns = dict(zip(SPOTS, session.observed.T, strict=True))
        order = {"placement": session.placement.astype(float), "first_psd": session.first_psd.astype(float)}
        return _table(session.q_rad, {**columns, **order})

    def _moved(self, rng: Generator, poses: int = POSES) -> tuple[Floats, Floats, Floats]:
        """Readings, true flange poses, true target of an arm that moves over most of its range."""
        truth, links = self.bench.drawn_links(rng)
        angles = rng.uniform(-2.5, 2.5, (poses, len(links)))
        return angles - _zeros(truth), forward(angles, links), TARGET_M + rng.normal(0.0, 1e-3, 3)

    def _reaching(self, rng: Generator, goal_m: Floats) -> tuple[Floats, NDArray[np.bool_]]:
        """Readings with the true tip at points (row, 3), leaning any way; and which could be reached."""
        truth, links = self.bench.drawn_links(rng)
        tool = TARGET_M + rng.normal(0.0, 1e-3, 3)
        turns = Rotation.from_rotvec([np.pi, 0.0, 0.0]) * Rotation.from_rotvec(rng.normal(0.0, 0.6, (len(goal_m), 3)))
        wanted = np.tile(np.eye(4), (len(goal_m), 1, 1))
        wanted[:, :3, :3] = turns.as_matrix()
        wanted[:, :3, 3] = goal_m - turns.apply(tool)
        angles, good = reach(wanted, links, rng)
        angles = np.remainder(angles + np.pi, 2.0 * np.pi) - np.pi
        good &= np.linalg.norm(_tips(forward(angles, links), tool) - goal_m, axis=1) < 1e-8
        return angles - _zeros(truth) + rng.normal(0.0, JOINT_SIGMA_RAD, angles.shape), good


# One line for each instrument.
INSTRUMENTS: dict[str, Callable[[Drawn, Generator], Samples]] = {
    "tracker": Drawn.tracker,
    "full pose": Drawn.full_pose,
    "wire": Drawn.wire,
    "seats": Drawn.seats,
    "bars": Drawn.bars,
    "dual PSD": Drawn.dual_psd,
}


def _tips(flange: Floats, tool: Floats) -> Floats:
    return flange[:, :3, :3] @ tool + flange[:, :3, 3]


def _zeros(truth: dict[str, float]) -> Floats:
    return np.array([value for name, value in truth.items() if name.endswith(".zero")])


def _table(q_rad: Floats, columns: dict[str, NDArray[np.float64] | NDArray[np.str_]]) -> Samples:
    readings = {f"q{i + 1}_rad": q_rad[:, i] for i in range(q_rad.shape[1])}
    return Samples({"t_s": np.arange(len(q_rad), dtype=float), **readings, **columns}, q_rad.shape[1])
