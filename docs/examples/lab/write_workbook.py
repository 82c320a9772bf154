"""Writes lab.xlsx of the tutorial: 80 poses of an arm that differs from rig.toml, measured by a tracker.

Run it to have another sheet: `python write_workbook.py lab.xlsx 7`.
"""

import sys

import numpy as np
import openpyxl
from scipy.spatial.transform import Rotation

# The true arm: a in mm, alpha in deg, d in mm, zero in deg. Link 2 is 0.4 mm longer than in rig.toml.
TRUE_ARM = (
    (0.0, 90.0, 89.2, 0.0),
    (-425.4, 0.0, 0.0, 0.05),
    (-392.0, 0.0, 0.0, -0.08),
    (0.0, 90.0, 109.3, 0.0),
    (0.0, -90.0, 94.75, 0.0),
    (0.0, 0.0, 82.5, 0.0),
)
REFLECTOR_MM = (0.3, 50.2, 59.9)  # in the flange
TRACKER_SIGMA_MM = 0.02
POSES = 80


def measured_mm(q_deg, rng):
    """(pose, 3): the reflector in the frame of a tracker that stands two metres away."""
    point = np.tile(REFLECTOR_MM, (len(q_deg), 1))
    for j, (a_mm, alpha_deg, d_mm, zero_deg) in reversed(list(enumerate(TRUE_ARM))):
        point = Rotation.from_euler("x", alpha_deg, degrees=True).apply(point) + np.array([a_mm, 0.0, d_mm])
        point = Rotation.from_euler("z", q_deg[:, j : j + 1] + zero_deg, degrees=True).apply(point)
    seen_mm = Rotation.from_rotvec([0.2, 0.1, 2.0]).apply(point) + np.array([1000.0, 2000.0, 500.0])
    return seen_mm + rng.normal(0.0, TRACKER_SIGMA_MM, seen_mm.shape)


def write(path, seed=1):
    """One row a pose, rounded as a person would type it."""
    rng = np.random.default_rng(seed)
    q_deg = rng.uniform(-110.0, 110.0, (POSES, 6)).round(3)
    book = openpyxl.Workbook()
    book.active.append([*(f"A{joint} [deg]" for joint in range(1, 7)), "X/mm", "Y/mm", "Z/mm"])
    for row in np.hstack([q_deg, measured_mm(q_deg, rng).round(3)]).tolist():
        book.active.append(row)
    book.save(path)


if __name__ == "__main__":
    write(sys.argv[1], int(sys.argv[2]) if len(sys.argv) > 2 else 1)
