"""A six-axis arm before a tracker: angles, positions and flange poses, by plain products of 4 x 4 matrices."""

from dataclasses import dataclass

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from calibrate.model.checks.gross_error import Shots

# d, a, alpha of a UR5 (Universal Robots, "DH Parameters for calculations of kinematics and dynamics")
UR5 = np.array(
    [
        [0.089159, 0.0, np.pi / 2],
        [0.0, -0.425, 0.0],
        [0.0, -0.39225, 0.0],
        [0.10915, 0.0, np.pi / 2],
        [0.09465, 0.0, -np.pi / 2],
        [0.0823, 0.0, 0.0],
    ]
)
POINT = np.array([0.02, -0.03, 0.06])
NOISE = 2e-5


def flange(q, table=UR5):
    T = np.broadcast_to(np.eye(4), (len(q), 4, 4))
    for angle, (d, a, alpha) in zip(q.T, table, strict=True):
        link = np.zeros((len(q), 4, 4))
        link[:, :3, :3] = (
            Rotation.from_rotvec(angle[:, None] * [0, 0, 1]) * Rotation.from_rotvec([alpha, 0, 0])
        ).as_matrix()
        link[:, 0, 3], link[:, 1, 3], link[:, 2, 3], link[:, 3, 3] = a * np.cos(angle), a * np.sin(angle), d, 1.0
        T = T @ link
    return T


@dataclass
class Scene:
    """A session in front of a tracker of unknown place, by an arm a little beside its drawing."""

    q_rad: np.ndarray
    position_m: np.ndarray
    turn: Rotation
    shift_m: np.ndarray
    table: np.ndarray

    def expect(self, q):
        T = flange(q, self.table)
        return self.turn.apply(T[:, :3, :3] @ POINT + T[:, :3, 3]) + self.shift_m

    def shots(self):
        columns = ("x_m", "y_m", "z_m")
        sigma = np.full(3, NOISE)
        return Shots(
            np.arange(len(self.q_rad)), columns, self.q_rad, self.position_m, sigma, lambda _rows, q: self.expect(q)
        )


@pytest.fixture
def scene():
    """Fit already done: `shots` predict with the true arm."""
    rng = np.random.default_rng(5)
    q = rng.uniform(-2.4, 2.4, (120, 6))
    table = UR5 + rng.normal(0.0, 1e-3, UR5.shape)
    made = Scene(q, np.empty((0, 3)), Rotation.from_rotvec([0.3, -0.8, 2.1]), np.array([2.0, -1.0, 0.4]), table)
    made.position_m = made.expect(q) + rng.normal(0.0, NOISE, (120, 3))
    return made
