"""How far off its planned way an arm was, by what its controller reported; and by which rates it was streamed to."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

from acquisition.motion.paths.path import STANDING
from acquisition.motion.plan import Plan
from acquisition.motion.setpoints import PER_STRUCTURAL, SERVO_PER_STRUCTURAL, solve_rate_hz

Floats = NDArray[np.float64]
STEP_S = 0.002  # of the planned way: half a millimetre at reduced speed, so that its chords count for nothing
ROWS = 50_000  # whose frames are held at a time: 40 MB


@dataclass(frozen=True)
class Deviation:
    """Distances of the tool from its planned way, of all samples."""

    largest_m: float
    rms_m: float


def deviation(sweeps: list[tuple[Plan, Floats]]) -> Deviation | None:
    """Of plans and the readings (sample, joint) while each was followed: from the way, whatever the lag along it.

    None: nothing can be compared. A way with a belt is left out, for it was planned before the belt was read.
    """
    off_m = [_off_m(made, q_rad) for made, q_rad in sweeps if not made.carried and len(q_rad)]
    if not off_m:
        return None
    every_m = np.concatenate(off_m)
    return Deviation(float(every_m.max()), float(np.sqrt(np.mean(every_m**2))))


def _off_m(made: Plan, q_rad: Floats) -> Floats:
    tool, path = np.append(made.segments[-1].place.tool[:3, 3], 1.0), made.path()

    def tips_m(joints_rad: Floats) -> Floats:
        parts = np.array_split(joints_rad, 1 + len(joints_rad) // ROWS)
        return np.concatenate([(made.solver.arm.frames(part)[:, -1] @ tool)[:, :3] for part in parts])

    way_m = tips_m(np.array([path.at(t_s, STANDING) for t_s in np.arange(0.0, made.t_s[-1] + STEP_S, STEP_S)]))
    seen_m = tips_m(q_rad)
    nearest = np.asarray(KDTree(way_m).query(seen_m)[1])
    beside = [_from_chord_m(seen_m, way_m[np.maximum(nearest - 1, 0)], way_m[nearest]),
              _from_chord_m(seen_m, way_m[nearest], way_m[np.minimum(nearest + 1, len(way_m) - 1)])]  # fmt: skip
    out: Floats = np.min(beside, axis=0)
    return out


def _from_chord_m(seen_m: Floats, begin_m: Floats, end_m: Floats) -> Floats:
    along_m = end_m - begin_m
    share = np.sum((seen_m - begin_m) * along_m, axis=1) / np.maximum(np.sum(along_m**2, axis=1), 1e-30)
    out: Floats = np.linalg.norm(seen_m - begin_m - np.clip(share, 0.0, 1.0)[:, None] * along_m, axis=1)
    return out


def rates_text(structural_hz: float, stream_hz: float) -> str:
    """Which rates are taken, and whether the controller's cycle is fast enough for the structure."""
    solved_hz, servo_hz = solve_rate_hz(structural_hz, stream_hz), SERVO_PER_STRUCTURAL * structural_hz
    capped = "" if solved_hz == PER_STRUCTURAL * structural_hz else ", all that the stream takes"
    enough = "enough" if stream_hz >= servo_hz else "TOO SLOW: go slower, or measure structural_hz"
    return (
        f"solved at {solved_hz:g} Hz ({PER_STRUCTURAL:g} x structural_hz {structural_hz:g} Hz of the rig file"
        f"{capped}), "
        f"sent at {stream_hz:g} Hz ({SERVO_PER_STRUCTURAL:g} x: {servo_hz:g} Hz, {enough})"
    )
