"""Quick tracker and dual-PSD sessions of a concealed truth: plain 4x4 products and a ray, no code of calibrate.

The truth is drawn inside what is believed: links by the drawing tolerance, zeros within +-2 degrees, frames and mounts
near where they are believed. Names and units of the drawn values are the public ones of model.json.
"""

import tomllib
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

Floats = NDArray[np.float64]

ZERO_MAX_RAD = np.deg2rad(2.0)
SPOT_SIGMA_M, POSITION_SIGMA_M = 2e-6, 20e-6
PLACE_SIGMA_M, PLACE_SIGMA_RAD = 3e-3, 5e-3  # frames of fixture and device against where they are believed
TARGET_M = np.array([0.02, 0.01, 0.08])  # believed in the flange frame
T_BASE_DEVICE = ([1.5, 0.4, 0.3], [0.1, -0.2, 2.0])  # believed origin (m) and rotation vector (rad)
PARALLEL_COSINE = 0.9  # of a link's twist: there, and only there, Hayati's tilt is drawn


@dataclass(frozen=True)
class Session:
    """What was read, and what was true under the names of the parameters."""

    q_rad: Floats  # (pose, joint)
    observed: Floats  # (pose, 3) position in the device frame, or (pose, 4) spots
    placement: NDArray[np.int64]  # (pose,) of a dual PSD
    first_psd: NDArray[np.int64]
    truth: dict[str, float]


class Bench:
    """A rig file's arm with its fixture; poses that strike it are looked for once, when they are first needed."""

    def __init__(self, rig_file: Path, places: tuple[int, ...] = (1, 2)) -> None:
        rig = tomllib.loads(rig_file.read_text())
        joints = rig["arm"]["joint"]
        self.links = np.array([[j["theta_offset_rad"], j["d_m"], j["a_m"], j["alpha_rad"], 0.0] for j in joints])
        self.tolerance = rig["tolerance"]
        self.laser_origin = np.array(rig["tool"]["laser_origin_m"])
        self.laser_direction = np.array(rig["tool"]["laser_direction"])
        self.psd2 = frame(*rig["fixture"]["psd2_in_psd1"].values())
        self.places = {p["id"]: frame(*p["psd1_in_base"].values()) for p in rig["placement"] if p["id"] in places}
        self.half_m = rig["fixture"]["half_size_m"]

    def tracker(self, rng: np.random.Generator, poses: int = 40) -> Session:
        """Positions of a target at poses drawn over most of the joint range."""
        truth, links = self.drawn_links(rng)
        angles = rng.uniform(-2.5, 2.5, (poses, len(links)))
        tool, device = rng.normal(0, 1e-3, 3), _drawn_frame(rng)
        truth |= {f"tool.{a}": v for a, v in zip("xyz", tool, strict=True)} | _named("device", device)
        T = frame(*T_BASE_DEVICE) @ frame(device[:3], device[3:])
        points = forward(angles, links) @ np.append(TARGET_M + tool, 1.0)
        seen = (points[:, :3] - T[:3, 3]) @ T[:3, :3]
        nobody = np.zeros(poses, dtype=np.int64)
        seen += rng.normal(0, POSITION_SIGMA_M, seen.shape)
        return Session(angles - _zeros(truth), seen, nobody, nobody, truth)

    def dual_psd(self, rng: np.random.Generator, poses: int = 50) -> Session:
        """Spots at poses of the pool; laser mount and places a little off."""
        truth, links = self.drawn_links(rng)
        chosen = rng.permutation(len(self.pool[0]))[:poses]
        angles, place, first = (values[chosen] for values in self.pool)
        origin = self.laser_origin + rng.normal(0, 5e-4, 3)
        direction = Rotation.from_rotvec(rng.normal(0, 2e-3, 3)).apply(self.laser_direction)
        faces = {}
        for k, T in self.places.items():
            off = _drawn_frame(rng)
            truth |= _named(f"placement{k}", off)
            faces[k] = T @ frame(off[:3], off[3:])
        T = forward(angles, links)
        spots = np.array(
            [
                trace(flange, origin, direction, faces[p], self.psd2, f)
                for flange, p, f in zip(T, place, first, strict=True)
            ]
        )
        spots += rng.normal(0, SPOT_SIGMA_M, spots.shape)
        return Session(angles - _zeros(truth), spots, place, first, truth)

    def drawn_links(self, rng: np.random.Generator) -> tuple[dict[str, float], Floats]:
        sizes = [self.tolerance["length_m"]] * 2 + [self.tolerance["angle_rad"]] * 2
        off = rng.normal(0, sizes, (len(self.links), 4))
        off[np.abs(np.cos(self.links[:, 3])) < PARALLEL_COSINE, 3] = 0.0
        zeros = rng.uniform(-ZERO_MAX_RAD, ZERO_MAX_RAD, len(self.links))
        names = ("offset", "length", "twist", "tilt")
        truth = {f"link{i}.{n}": float(v) for i, row in enumerate(off, 1) for n, v in zip(names, row, strict=True)}
        truth |= {f"joint{i}.zero": float(v) for i, v in enumerate(zeros, 1)}
        return truth, self.links + np.column_stack([np.zeros(len(off)), off])

    @cached_property
    def pool(self) -> tuple[Floats, NDArray[np.int64], NDArray[np.int64]]:
        """True angles (pose, joint), placement and first PSD of poses whose beam strikes both faces as drawn."""
        rng, many, tries = np.random.default_rng(0), 160, 900
        place, first = rng.choice(list(self.places), tries), rng.choice([1, 2], tries)
        wanted = np.array([self._aimed(rng, int(p), int(f), self.half_m) for p, f in zip(place, first, strict=True)])
        angles, reached = reach(wanted, self.links, rng)
        good = np.flatnonzero(reached)[:many]
        return angles[good], place[good], first[good]

    def _aimed(self, rng: np.random.Generator, place: int, first: int, half_m: float) -> Floats:
        """(4, 4) flange pose from which the beam meets both faces off centre, at a random distance and roll."""
        faces = [self.places[place], self.places[place] @ self.psd2]
        near, far = faces[first - 1], faces[2 - first]
        spot = near @ np.array([*rng.uniform(-0.8, 0.8, 2) * half_m, 0.0, 1.0])
        other = far @ np.array([*rng.uniform(-0.8, 0.8, 2) * half_m, 0.0, 1.0])
        height = (other - spot)[:3] @ near[:3, 2]
        beam = (other - spot)[:3] - 2.0 * height * near[:3, 2]
        beam /= np.linalg.norm(beam)
        turn = Rotation.align_vectors([beam], [self.laser_direction])[0]
        turn = Rotation.from_rotvec(rng.uniform(-np.pi, np.pi) * beam) * turn
        origin = spot[:3] - rng.uniform(0.1, 0.35) * beam - turn.apply(self.laser_origin)
        return frame(origin, turn.as_rotvec())


def frame(origin_m, rotation_rad) -> Floats:
    """(4, 4) from origin and rotation vector."""
    T = np.eye(4)
    T[:3, :3] = Rotation.from_rotvec(rotation_rad).as_matrix()
    T[:3, 3] = origin_m
    return T


def forward(angles: Floats, links: Floats) -> Floats:
    """(pose, 4, 4) flange: Rz(theta) Tz(d) Tx(a) Rx(alpha) Ry(tilt) a link, by plain products."""
    T = np.tile(np.eye(4), (len(angles), 1, 1))
    for angle, (offset, d, a, alpha, tilt) in zip(angles.T, links, strict=True):
        turn = np.tile(np.eye(4), (len(angles), 1, 1))
        turn[:, 0, 0] = turn[:, 1, 1] = np.cos(angle + offset)
        turn[:, 1, 0] = np.sin(angle + offset)
        turn[:, 0, 1] = -turn[:, 1, 0]
        T = T @ turn @ frame([a, 0.0, d], [alpha, 0.0, 0.0]) @ frame([0.0] * 3, [0.0, tilt, 0.0])
    return T


def trace(flange: Floats, origin: Floats, direction: Floats, psd1: Floats, psd2: Floats, first: int) -> list[float]:
    """psd1 x, y, psd2 x, y by following the ray from face to face."""
    at, along = (flange @ np.append(origin, 1.0))[:3], flange[:3, :3] @ direction
    faces = {1: psd1, 2: psd1 @ psd2}
    found: dict[int, Floats] = {}
    for k in (first, 3 - first):
        normal, centre = faces[k][:3, 2], faces[k][:3, 3]
        at = at + along * (((centre - at) @ normal) / (along @ normal))
        found[k] = faces[k][:3, :2].T @ (at - centre)
        along = along - 2.0 * (along @ normal) * normal
    return [*found[1], *found[2]]


def reach(wanted: Floats, links: Floats, rng: np.random.Generator) -> tuple[Floats, NDArray[np.bool_]]:
    """Angles (pose, joint) for flange poses by damped Newton on difference quotients; False where it ends elsewhere."""
    n = len(links)
    q = rng.uniform(-np.pi, np.pi, (len(wanted), n))
    error = _apart(wanted, forward(q, links))
    for _ in range(60):
        step = 1e-6 * np.eye(n)
        J = np.stack([(_apart(wanted, forward(q + h, links)) - error) / 1e-6 for h in step], axis=-1)
        normal = np.swapaxes(J, 1, 2) @ J + 1e-5 * np.eye(n)
        move = -np.linalg.solve(normal, np.swapaxes(J, 1, 2) @ error[..., None])[..., 0]
        q = q + np.clip(move, -0.4, 0.4)
        error = _apart(wanted, forward(q, links))
    return q, np.linalg.norm(error, axis=1) < 1e-4


def _apart(wanted: Floats, have: Floats) -> Floats:
    turn = Rotation.from_matrix(have[:, :3, :3] @ np.swapaxes(wanted[:, :3, :3], 1, 2)).as_rotvec()
    return np.concatenate([have[:, :3, 3] - wanted[:, :3, 3], turn], axis=1)


def _drawn_frame(rng: np.random.Generator) -> Floats:
    return np.concatenate([rng.normal(0, PLACE_SIGMA_M, 3), rng.normal(0, PLACE_SIGMA_RAD, 3)])


def _named(owner: str, six: Floats) -> dict[str, float]:
    axes = ("x", "y", "z", "roll", "pitch", "yaw")
    return {f"{owner}.{a}": float(v) for a, v in zip(axes, six, strict=True)}


def _zeros(truth: dict[str, float]) -> Floats:
    return np.array([v for name, v in truth.items() if name.endswith(".zero")])
