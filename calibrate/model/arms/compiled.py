"""The typed face of the compiled forward kinematics (fast.py), and whether it is ready for use.

An arm states once what its parameter values mean (fixed parts, joint offsets, a constant twist for each parameter:
arms/serial.py); the loops over poses are compiled. One thread; results agree with the numpy models to 1e-12.
Compiling takes seconds, and no first call waits for it: `python -m calibrate.model.arms` (which `make` runs at set-up)
does it once, for this source, numba, Python and processor. Until then the numpy models serve. docs/decisions/0005.
"""

import sys
from dataclasses import dataclass
from functools import cache
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Self

import numpy as np
from numpy.typing import NDArray

from calibrate.model.arms.coupled_readings import uncoupled

if TYPE_CHECKING:  # the arms use this file in turn
    from calibrate.model.arms.serial import SerialArm

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]
Indices = NDArray[np.intp]

SOURCE = Path(__file__).with_name("fast.py")
PER_PART = 7  # slots of a perturbed part: shift 3, turn 3, and the angle of the joint behind it
# below, numba (0.4 to 0.5 s and 105 MB, once a process) is not worth loading: a diagnosis of 1,000 rows takes as long
# with it as without
WORTH_POSES = 3000


@dataclass(frozen=True)
class ArmConstants:
    """All that a serial arm is at one set of parameter values."""

    fixed: Floats  # (joint + 1, 4, 4) parts between the turns
    offset_rad: Floats  # (joint,) added to a reading
    moves_frame: Indices  # (param,) frame that a parameter moves
    body_twists: Floats  # (param, 6) [v; w] by a parameter in the frame that it moves
    by_reading: Floats | None = None  # (joint, joint) as SerialArm.by_reading

    @classmethod
    def of(cls, arm: "SerialArm", theta: Floats) -> Self:
        """`theta` (param,): values of the arm's own parameters."""
        return cls(
            np.ascontiguousarray(arm.fixed_parts(theta)),
            np.ascontiguousarray(arm.angle_offset_rad(theta)),
            np.array(arm.moves_frame, dtype=np.intp),
            np.ascontiguousarray(arm.body_twists(theta)),
            arm.by_reading,
        )

    def half_tangents(self, q_rad: Floats) -> Floats:
        """(pose, joint) tangent of half of every joint angle, what fast.py makes sine and cosine of."""
        half = np.add(uncoupled(self.by_reading, q_rad), self.offset_rad, order="C")
        half *= 0.5
        return np.tan(half, out=half)


def flange(arm: ArmConstants, q_rad: Floats) -> Floats:
    """T_base_flange (pose, 4, 4) for readings (pose, joint); nan where a joint is nan."""
    from calibrate.model.arms import fast

    out = np.empty((len(q_rad), 16))
    fast.flange(arm.fixed, arm.half_tangents(q_rad), out)
    return out.reshape(-1, 4, 4)


def twists(arm: ArmConstants, q_rad: Floats) -> Floats:
    """Base twists [v; w] of the flange by every parameter, (pose, 6, param)."""
    from calibrate.model.arms import fast

    out = np.empty((len(q_rad), 6, len(arm.moves_frame)))
    fast.twists(arm.fixed, arm.half_tangents(q_rad), arm.moves_frame, arm.body_twists, out)
    return out


def point_and_jacobian(arm: ArmConstants, point_m: Floats, q_rad: Floats) -> tuple[Floats, Floats]:
    """A point (3,) of the flange frame in the base, (pose, 3), and its derivative by every parameter (pose, 3, param).

    Both are views of memory that runs over the poses first.
    """
    from calibrate.model.arms import fast

    poses, columns = len(q_rad), len(arm.moves_frame)
    point, jacobian = np.empty((3, poses)), np.empty((3 * columns, poses))
    half, at = arm.half_tangents(q_rad), np.ascontiguousarray(point_m)
    fast.point_jacobian(arm.fixed, half, arm.moves_frame, arm.body_twists, at, point, jacobian)
    return point.T, jacobian.reshape(columns, 3, poses).transpose(2, 1, 0)


def perturbed_points(fixed: Floats, angle_rad: Floats, point_m: Floats, moved: Bools, slots: Floats) -> Floats:
    """(3, arm) m, the point (3,) behind the last part in the base, of arms with perturbed parts at one posture.

    p = F_0 E_0 Rz(a_1 + d_1) F_1 E_1 ... F_n E_n point; E_i = shift, then Exp(rotation vector), in the frame behind the
    part. `slots` (PER_PART part, arm): 7 i + 0 ... 5 of E_i, 7 i + 6 is d_(i+1); E_i is 1 where a part is not `moved`.
    There is no numpy twin: where numba's cache is cold the first call compiles for some seconds.
    """
    from calibrate.model.arms import fast

    by_part = slots.reshape(len(fixed), PER_PART, -1)
    half = np.tan(0.5 * (angle_rad[:, None] + by_part[: len(angle_rad), 6]))
    turn = np.sqrt(by_part[:, 3] ** 2 + by_part[:, 4] ** 2 + by_part[:, 5] ** 2)
    out = np.empty((3, slots.shape[1]))
    fast.perturbed_points(fixed, half, turn, np.tan(0.5 * turn), point_m, moved, slots, out)
    return out


def worth(poses: int) -> bool:
    """Whether a batch of that many poses should go through the compiled loops."""
    return poses >= WORTH_POSES and available()


@cache
def available() -> bool:
    """True when a call of a compiled loop starts at once. Decided at the first question, for the whole run."""
    marker = _marker()
    return marker.exists() and marker.read_text() == _processor()


def state_ready() -> None:
    """Leave the mark that `available` searches for; OSError where the folder of the source cannot be written."""
    marker = _marker()
    marker.parent.mkdir(exist_ok=True)
    marker.write_text(_processor())
    available.cache_clear()


def compile_all() -> None:
    """Call every compiled loop on one pose of an arm of one joint; numba keeps what it compiled."""
    fixed, one = np.tile(np.eye(4), (2, 1, 1)), np.zeros((1, 1))
    arm = ArmConstants(fixed, np.zeros(1), np.zeros(1, dtype=np.intp), np.zeros((1, 6)))
    flange(arm, one)
    twists(arm, one)
    point_and_jacobian(arm, np.zeros(3), one)
    perturbed_points(fixed, np.zeros(1), np.zeros(3), np.ones(2, dtype=np.bool_), np.zeros((2 * PER_PART, 1)))


def prepare() -> None:
    """Compile where it was not done yet; a message on stderr where the result cannot be kept."""
    if available():
        return
    compile_all()
    try:
        state_ready()
    except OSError as error:
        print(f"compiled loops: {error}; the numpy models serve, slower but with the same results", file=sys.stderr)


def _marker() -> Path:
    """Beside numba's own cache files, and named by what makes them stale: the source's date and size, and versions."""
    stat = SOURCE.stat()
    python = f"{sys.implementation.cache_tag}-numba{version('numba')}"
    return SOURCE.parent / "__pycache__" / f"fast-{stat.st_mtime_ns}-{stat.st_size}-{python}.ready"


def _processor() -> str:
    from llvmlite import binding

    return f"{binding.get_host_cpu_name()} {binding.get_host_cpu_features().flatten()}"
