"""The block of sockets as the page describes it: closed, as large, and a ball rests where the page says."""

import runpy
import struct
from pathlib import Path

import numpy as np

SCRIPT = Path(__file__).parents[2] / "docs" / "examples" / "sockets" / "socket_block.py"
BLOCK = runpy.run_path(str(SCRIPT))


def test_the_surface_is_closed_and_encloses_block_less_cones():
    triangles = BLOCK["block"](50.0, 10.0)
    corners = np.round(triangles, 9) + 0.0
    edges = [tuple(map(tuple, t[[i, (i + 1) % 3]])) for t in corners for i in range(3)]
    assert len(set(edges)) == len(edges)
    assert {(b, a) for a, b in edges} == set(edges)
    volume = np.einsum("ni,ni->n", triangles[:, 0], np.cross(triangles[:, 1], triangles[:, 2])).sum() / 6.0
    cone = np.pi * 5.0 / 3.0 * (6.0**2 + 6.0 * 1.0 + 1.0**2)
    np.testing.assert_allclose(volume, 100.0 * 50.0 * 15.0 - 2.0 * cone, rtol=1e-4)


def test_a_ball_touches_the_cone_alone_with_its_centre_above_the_top():
    triangles = BLOCK["block"](50.0, 10.0)
    weights = np.random.default_rng(2).dirichlet(np.ones(3), (len(triangles), 200))
    points = np.einsum("nki,nij->nkj", weights, triangles).reshape(-1, 3)
    for x in (-25.0, 25.0):
        away = np.linalg.norm(points - [x, 0.0, 5.0 * np.sqrt(2.0) - 6.0], axis=1)
        nearest = points[np.argmin(away)]
        assert abs(away.min() - 5.0) < 0.01
        assert abs(np.hypot(nearest[0] - x, nearest[1]) - 5.0 / np.sqrt(2.0)) < 0.1


def test_the_file_holds_every_triangle():
    triangles = BLOCK["block"](50.0, 10.0)
    content = BLOCK["stl"](triangles)
    assert struct.unpack_from("<I", content, 80) == (len(triangles),)
    assert len(content) == 84 + 50 * len(triangles)
    np.testing.assert_allclose(np.frombuffer(content, "<f4", 9, 84 + 12).reshape(3, 3), triangles[0], atol=1e-5)
