"""A simulation of thirty lines: the nominal D-H arm of rig.toml, and where its reflector is. Reads and writes CSV."""

import csv
import sys

import numpy as np

A_M = [0.0, -0.425, -0.3922, 0.0, 0.0, 0.0]
ALPHA_RAD = [np.pi / 2, 0.0, 0.0, np.pi / 2, -np.pi / 2, 0.0]
D_M = [0.1625, 0.0, 0.0, 0.1333, 0.0997, 0.0996]
POINT_M = [0.02, 0.0, 0.08]


def reflector_m(q_rad):
    """(3,) in the base: Rz(q) Tz(d) Tx(a) Rx(alpha), joint after joint, then the point on the flange."""
    T = np.eye(4)
    for q, a, alpha, d in zip(q_rad, A_M, ALPHA_RAD, D_M, strict=True):
        c, s, ca, sa = np.cos(q), np.sin(q), np.cos(alpha), np.sin(alpha)
        T = T @ np.array([[c, -s * ca, s * sa, a * c], [s, c * ca, -c * sa, a * s], [0, sa, ca, d], [0, 0, 0, 1]])
    return (T @ [*POINT_M, 1.0])[:3]


def main():
    answer = csv.writer(sys.stdout)
    answer.writerow(["x_m", "y_m", "z_m"])
    for row in csv.DictReader(sys.stdin):
        answer.writerow(reflector_m([float(row[f"q{j}_rad"]) for j in range(1, 7)]))


if __name__ == "__main__":
    main()
