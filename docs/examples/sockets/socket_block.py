"""Writes a block with two conical sockets for a ball as STL, in mm: `python socket_block.py block.stl 50 10`.

Numbers: distance of the sockets, diameter of the ball. Each socket sits in the middle of a square of that distance; its
cone has 90 degrees, so that the ball rests on a ring, and a flat bottom that the ball does not reach.
"""

import struct
import sys

import numpy as np

HEIGHT_MM = 15.0
SEGMENTS = 96  # of a circle; a multiple of 8, so that the corners of the square are among the directions
RIM = 0.6  # radius of the cone's rim over the ball's diameter: the ball touches at 0.354
BOTTOM = 0.1  # radius of its flat bottom over the ball's diameter


def block(distance_mm, ball_mm):
    """Triangles (n, 3, 3) with corners counter-clockwise from outside; the top is z = 0."""
    return np.concatenate([half(-1.0, distance_mm, ball_mm), half(1.0, distance_mm, ball_mm)])


def half(side, distance_mm, ball_mm):
    angle = np.arange(SEGMENTS) * 2.0 * np.pi / SEGMENTS
    round_ = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    square = round_ / np.abs(round_).max(axis=1, keepdims=True) * distance_mm / 2.0
    rim_mm, bottom_mm = RIM * ball_mm, BOTTOM * ball_mm
    deep_mm = rim_mm - bottom_mm  # 90 degrees: as deep as the radius falls
    rings = [
        at(square, -HEIGHT_MM),
        at(square, 0.0),
        at(rim_mm * round_, 0.0),
        at(bottom_mm * round_, -deep_mm),
    ]
    middle = np.array([0.0, 0.0, -deep_mm]), np.array([0.0, 0.0, -HEIGHT_MM])
    out = []
    for i in range(SEGMENTS):
        j = (i + 1) % SEGMENTS
        inner = int(np.isclose(square[[i, j], 0], -side * distance_mm / 2.0).all())  # where both halves meet is no wall
        for lower, upper in zip(rings[inner:-1], rings[1 + inner :], strict=True):
            out += [(lower[i], lower[j], upper[j]), (lower[i], upper[j], upper[i])]
        out += [(rings[-1][i], rings[-1][j], middle[0]), (rings[0][j], rings[0][i], middle[1])]
    return np.array(out) + np.array([side * distance_mm / 2.0, 0.0, 0.0])


def at(points, z):
    return np.column_stack([points, np.full(len(points), z)])


def stl(triangles):
    """Binary STL: 80 bytes, the count, and 50 bytes a triangle."""
    normal = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    rows = np.concatenate([normal[:, None], triangles], axis=1).reshape(-1, 12).astype("<f4")
    return bytes(80) + struct.pack("<I", len(rows)) + b"".join(row.tobytes() + bytes(2) for row in rows)


if __name__ == "__main__":
    name, distance, ball = sys.argv[1], float(sys.argv[2]), float(sys.argv[3])
    if not 1.5 * ball <= distance:
        sys.exit(f"{distance:g} mm: the sockets of a ball of {ball:g} mm need {1.5 * ball:g} mm at least")
    if ball > HEIGHT_MM:
        sys.exit(f"{ball:g} mm: the block of {HEIGHT_MM:g} mm holds balls up to {HEIGHT_MM:g} mm; change HEIGHT_MM")
    with open(name, "wb") as file:
        file.write(stl(block(distance, ball)))
