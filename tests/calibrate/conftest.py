"""A dual-PSD session drawn from a concealed truth, with formulas of its own: plain 4x4 products and ray tracing.

Nothing here uses calibrate, so that agreement means something.
"""

import math
import tomllib
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from acquisition.recording import Samples

RIG = tomllib.loads((Path(__file__).parents[2] / "rigs" / "ur5e-dual-psd.toml").read_text())
UR5E = np.array([[j["d_m"], j["a_m"], j["alpha_rad"]] for j in RIG["arm"]["joint"]])  # all theta offsets are zero
LASER_ORIGIN = np.array(RIG["tool"]["laser_origin_m"])
LASER_DIRECTION = np.array(RIG["tool"]["laser_direction"])
HALF_SIZE = RIG["fixture"]["half_size_m"]
PLACES = {k["id"]: tuple(k["psd1_in_base"].values()) for k in RIG["placement"]}
PSD2 = tuple(RIG["fixture"]["psd2_in_psd1"].values())
SPOTS = ("psd1_x_m", "psd1_y_m", "psd2_x_m", "psd2_y_m")
LENGTH_SIGMA, ANGLE_SIGMA = RIG["tolerance"]["length_m"], RIG["tolerance"]["angle_rad"]


def pose(origin, rotation):
    T = np.eye(4)
    T[:3, :3] = Rotation.from_rotvec(rotation).as_matrix()
    T[:3, 3] = origin
    return T


def axis_turn(axis, angle):
    vector = np.zeros(3)
    vector["xyz".index(axis)] = angle
    return pose([0, 0, 0], vector)


@dataclass(eq=False)
class Truth:
    """What the session truly was; `links` rows: d, a, alpha, tilt."""

    zeros: np.ndarray
    links: np.ndarray
    places: dict
    psd2: np.ndarray
    laser_origin: np.ndarray
    laser_direction: np.ndarray

    def flange(self, angles):
        T = np.eye(4)
        for angle, (d, a, alpha, tilt) in zip(angles, self.links, strict=True):
            T = T @ axis_turn("z", angle) @ pose([0, 0, d], [0, 0, 0]) @ pose([a, 0, 0], [0, 0, 0])
            T = T @ axis_turn("x", alpha) @ axis_turn("y", tilt)
        return T

    def spots(self, angles, place, first):
        """psd1 x, y, psd2 x, y by following the ray."""
        T = self.flange(angles)
        p, d = T[:3, :3] @ self.laser_origin + T[:3, 3], T[:3, :3] @ self.laser_direction
        faces = {1: self.places[place], 2: self.places[place] @ self.psd2}
        out = {}
        for k in (first, 3 - first):
            centre, normal = faces[k][:3, 3], faces[k][:3, 2]
            p = p + d * ((centre - p) @ normal) / (d @ normal)
            out[k] = [(p - centre) @ faces[k][:3, 0], (p - centre) @ faces[k][:3, 1]]
            d = d - 2.0 * (d @ normal) * normal
        return np.array(out[1] + out[2])


@dataclass
class Session:
    truth: Truth
    q_rad: np.ndarray
    first_psd: np.ndarray
    placement: np.ndarray
    spots_m: np.ndarray
    repeat: np.ndarray


def draw_truth(rng, zero_max=0.0349):
    links = np.column_stack([UR5E, np.zeros(6)])
    links[:, :2] += rng.normal(0, LENGTH_SIGMA, (6, 2))
    links[:, 2:] += rng.normal(0, ANGLE_SIGMA, (6, 2))
    links[np.abs(np.cos(UR5E[:, 2])) < 0.9, 3] = 0.0  # between crossing axes a tilt is part of the joint's zero
    places = {
        k: pose(np.array(o) + rng.normal(0, 3e-3, 3), r) @ pose([0, 0, 0], rng.normal(0, 0.0087, 3))
        for k, (o, r) in PLACES.items()
    }
    tilt = rng.normal(0, 2e-3, 2)
    direction = Rotation.from_rotvec([tilt[0], 0, tilt[1]]).apply(LASER_DIRECTION)
    origin = LASER_ORIGIN + rng.normal(0, 5e-4, 3)
    return Truth(rng.uniform(-zero_max, zero_max, 6), links, places, pose(*PSD2), origin, direction)


def exact_truth():
    """Everything as drawn, zeros too; a new one each time, since it can be changed."""
    places = {k: pose(*v) for k, v in PLACES.items()}
    return Truth(np.zeros(6), np.column_stack([UR5E, np.zeros(6)]), places, pose(*PSD2), LASER_ORIGIN, LASER_DIRECTION)


def wanted_flange(truth, rng, place, first, aim, standoff):
    """Flange pose whose beam meets the two faces at `aim` (psd1 x, y, psd2 x, y) from `standoff`, rolled at random."""
    faces = {1: truth.places[place], 2: truth.places[place] @ truth.psd2}
    points = {k: (faces[k] @ np.array([*aim[2 * k - 2 : 2 * k], 0, 1]))[:3] for k in (1, 2)}
    n, c = faces[first][:3, 2], points[first]
    image = points[3 - first] - 2.0 * ((points[3 - first] - c) @ n) * n
    d = (image - c) / np.linalg.norm(image - c)
    onto, _ = Rotation.align_vectors([d], [truth.laser_direction])
    R = (Rotation.from_rotvec(rng.uniform(-math.pi, math.pi) * d) * onto).as_matrix()
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = R, c - standoff * d - R @ truth.laser_origin
    return T


def solve_angles(truth, wanted, rng):
    """Angles (pose, 6) that reach `wanted` (pose, 4, 4) by damped Newton from random starts; nan where they do not."""
    q = rng.uniform(-math.pi, math.pi, (len(wanted), 6))
    q[:, 1] = rng.uniform(-2.6, -0.3, len(wanted))
    q[:, 2] = rng.uniform(0.3, 2.6, len(wanted)) * rng.choice([-1, 1], len(wanted))
    for _ in range(60):
        T, J = np.broadcast_to(np.eye(4), (len(wanted), 4, 4)), []
        for i, (d, a, alpha, tilt) in enumerate(truth.links):
            J.append((T[:, :3, 2], T[:, :3, 3]))
            tail = pose([a, 0, d], [alpha, 0, 0]) @ axis_turn("y", tilt)
            turn = np.zeros((len(wanted), 4, 4))
            turn[:, 0, 0] = turn[:, 1, 1] = np.cos(q[:, i])
            turn[:, 1, 0], turn[:, 0, 1] = np.sin(q[:, i]), -np.sin(q[:, i])
            turn[:, 2, 2] = turn[:, 3, 3] = 1.0
            T = T @ turn @ tail
        shift = wanted[:, :3, 3] - T[:, :3, 3]
        turn_error = Rotation.from_matrix(wanted[:, :3, :3] @ np.swapaxes(T[:, :3, :3], 1, 2)).as_rotvec()
        error = np.concatenate([shift, turn_error], axis=1)
        jacobian = np.stack([np.concatenate([np.cross(z, T[:, :3, 3] - o), z], axis=1) for z, o in J], axis=-1)
        damped = np.swapaxes(jacobian, 1, 2) @ jacobian + 1e-6 * np.eye(6)
        step = np.linalg.solve(damped, np.swapaxes(jacobian, 1, 2) @ error[..., None])[..., 0]
        q = q + np.clip(step, -0.4, 0.4)
    q = (q + math.pi) % (2 * math.pi) - math.pi
    q[np.linalg.norm(error, axis=1) > 1e-6] = np.nan
    return q


def draw_session(
    seed, n=90, places=(1, 2, 3), truth=None, joint_noise=3e-6, psd_noise=2e-6, spread=0.85, repeats=0, orders=(1, 2)
):
    """Settled samples: random order, stand-off, roll and spots up to `spread` of the faces; `repeats` poses twice."""
    rng = np.random.default_rng(seed)
    truth = draw_truth(rng) if truth is None else truth
    many = 6 * n
    place, first = rng.choice(places, many), rng.choice(orders, many)
    aim = rng.uniform(-spread, spread, (many, 4)) * HALF_SIZE
    wanted = np.array(
        [wanted_flange(truth, rng, *row, rng.uniform(0.10, 0.35)) for row in zip(place, first, aim, strict=True)]
    )
    angles = solve_angles(truth, wanted, rng)
    good = np.flatnonzero(np.isfinite(angles[:, 0]))[:n]
    assert len(good) == n, f"only {len(good)} of {n} poses reached"
    again = np.concatenate([good, good[:repeats]])
    repeat = np.full(len(again), -1)
    repeat[:repeats] = repeat[n:] = np.arange(repeats)
    true_angles, place, first = angles[again], place[again], first[again]
    q_rad = true_angles - truth.zeros - rng.normal(0, joint_noise, true_angles.shape)
    spots = np.array([truth.spots(*row) for row in zip(true_angles, place, first, strict=True)])
    return Session(truth, q_rad, first, place, spots + rng.normal(0, psd_noise, spots.shape), repeat)


def spot_samples(session, *, sigma_m=None, q_rad=None):
    """The session as a table of samples; `q_rad` (pose, joint): other readings than those that were drawn."""
    columns = dict(zip(SPOTS, session.spots_m.T, strict=True))
    if sigma_m is not None:
        columns |= {name.replace("_m", "_sigma_m"): np.full(len(session.q_rad), sigma_m) for name in SPOTS}
    whole = {"placement": session.placement, "first_psd": session.first_psd, "repeat": session.repeat}
    columns |= {name: values.astype(float) for name, values in whole.items()}
    readings = session.q_rad if q_rad is None else q_rad
    columns |= {f"q{i}_rad": column for i, column in enumerate(readings.T, start=1)}
    return Samples({"t_s": np.arange(len(readings), dtype=float), **columns}, 6)


@pytest.fixture(scope="session")
def sessions():
    """Sessions by keyword, drawn once: sessions(seed, n=..., ...)."""
    drawn = {}

    def get(seed, **options):
        key = (seed, tuple(sorted(options.items())))
        if key not in drawn:
            drawn[key] = draw_session(seed, **options)
        return drawn[key]

    return get


@pytest.fixture(scope="session")
def ur5e_truth():
    return draw_truth


@pytest.fixture(scope="session")
def ur5e_exact():
    return exact_truth
