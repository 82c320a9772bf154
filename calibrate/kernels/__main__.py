"""`python -m calibrate.kernels`: compile every loop once, so that no later call waits for it."""

import sys

import numpy as np

from calibrate.kernels import perturbed
from calibrate.kernels.ready import available, state_ready


def compile_all() -> None:
    """Call every compiled loop on one pose of an arm of one joint; numba keeps what it compiled."""
    from calibrate.kernels import compiled

    fixed, offset, q = np.tile(np.eye(4), (2, 1, 1)), np.zeros(1), np.zeros((1, 1))
    frames, twists, point = np.zeros(1, dtype=np.intp), np.zeros((1, 6)), np.zeros(3)
    compiled.flange(fixed, offset, q, np.empty((1, 16)))
    compiled.point_jacobian(fixed, offset, frames, twists, point, q, np.empty((3, 1)), np.empty((3, 1)))
    compiled.twists(fixed, offset, frames, twists, q, np.empty((1, 6, 1)))
    device, deviation, seen, weight = np.eye(4), np.zeros(6), np.zeros((1, 3)), np.eye(3)[None].copy()
    for add_up, shape in ((True, (12, 12)), (False, (33, 1))):
        out = np.zeros(shape)
        compiled.position_rows(fixed, offset, frames, twists, point, device, deviation, q, seen, weight, out, add_up)
    _compile_error_simulation()


def _compile_error_simulation() -> None:
    """Through the typed face, so that the kinds of all arguments are those of every later call."""
    tables = np.zeros((1, 3, perturbed.CELLS + 1))
    one = np.zeros(1, dtype=np.int64)
    drawn = perturbed.DrawnColumns(one + 1, np.zeros(1), np.ones(1), tables, one, np.zeros((0, 2), dtype=np.int64))
    arm = perturbed.ArmAtPoses(np.tile(np.eye(4), (2, 1, 1)), np.zeros((1, 1)), np.zeros(3), one, one, np.ones((1, 1)))
    perturbed.count_arms(arm, drawn, arm.nominal_m(), np.ones(1), 0, 1, 1)
    perturbed.draw_block(drawn, 0, 1)


def main() -> int:
    if available():
        return 0
    compile_all()
    try:
        state_ready()
    except OSError as error:
        print(f"compiled loops: {error}; the numpy models serve, slower but with the same results", file=sys.stderr)
    return 0


if __name__ == "__main__":
    sys.exit(main())
