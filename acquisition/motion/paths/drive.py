"""The drive transform D(r) = T(r) Ra(r) Ro(r): straight from one pose to another, turning about two axes at once.

The approach vector turns by r theta about k = (-sin psi, cos psi, 0), and the tool by r phi about the approach vector.
Source: R. Paul, Robot Manipulators, 1981, ch. 5.7; lecture chapter 8, "Cartesian motion".
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Drive:
    """From P1 (r = 0) to P2 (r = 1), in the coordinates of P1."""

    shift_m: Floats  # (3,) x, y, z
    psi_rad: float
    theta_rad: float  # 0 to pi
    phi_rad: float

    def at(self, r: float) -> Floats:
        """D(r), (4, 4); beyond 0 and 1 it goes straight on."""
        T = np.eye(4)
        T[:3, :3] = _tilt(self.psi_rad, r * self.theta_rad) @ _spin(r * self.phi_rad)
        T[:3, 3] = r * self.shift_m
        return T


def drive_between(P1: Floats, P2: Floats) -> Drive:
    """The drive that leads from P1 to P2, both (4, 4) in the same coordinates."""
    n1, o1, a1, p1 = (P1[:3, i] for i in range(4))
    n2, o2, a2, p2 = (P2[:3, i] for i in range(4))
    shift = p2 - p1
    along_n, along_o = float(n1 @ a2), float(o1 @ a2)
    psi = math.atan2(along_o, along_n)
    theta = math.atan2(math.hypot(along_n, along_o), float(a1 @ a2))
    s, c, v = math.sin(psi), math.cos(psi), 1.0 - math.cos(theta)
    second = np.array([-s * c * v, c * c * v + math.cos(theta), -s * math.sin(theta)])  # y of P1 after the tilt
    sine = second @ np.array([n1 @ n2, o1 @ n2, a1 @ n2])
    cosine = second @ np.array([n1 @ o2, o1 @ o2, a1 @ o2])
    shift_m = np.array([n1 @ shift, o1 @ shift, a1 @ shift])
    return Drive(shift_m, psi, theta, math.atan2(float(sine), float(cosine)))


def _tilt(psi_rad: float, theta_rad: float) -> Floats:
    """(3, 3) turn by theta about (-sin psi, cos psi, 0)."""
    s, c = math.sin(psi_rad), math.cos(psi_rad)
    st, ct = math.sin(theta_rad), math.cos(theta_rad)
    v = 1.0 - ct
    return np.array(
        [
            [s * s * v + ct, -s * c * v, c * st],
            [-s * c * v, c * c * v + ct, s * st],
            [-c * st, -s * st, ct],
        ]
    )


def _spin(phi_rad: float) -> Floats:
    """(3, 3) turn about z."""
    s, c = math.sin(phi_rad), math.cos(phi_rad)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
