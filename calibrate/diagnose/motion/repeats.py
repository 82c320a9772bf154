"""The scatter of torques between repeats of one and the same motion: noise that needs no model.

Moments of a repeat are those of its set-points, shifted to where its angles are nearest to those of the first one. A
repeat whose angles differ all the same (it was paused, or ran unevenly) takes no part.
"""

from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray

from acquisition.recording import Recording
from acquisition.recording.examination import ExaminationRecord
from acquisition.recording.motion_plan import MOTION_EVENT
from calibrate.diagnose.motion.motion_table import STILL_SHARE, Run, filtered_of
from calibrate.diagnose.streams import devices_of

Floats = NDArray[np.float64]

STEP_S = 0.02
EDGES_S = 0.5  # of a repeat that are left out at both ends: the first begins from a stand, the last ends in one
SHIFTS = 5  # steps of Gauss-Newton
WINDOW_S = 0.5  # in which what stamps leave of a shift is taken to be one
SLOWEST_RAD_S = 1e-3  # of all joints together: where they rest no shift shows
ALIKE_RAD = 0.01  # rms of a joint's angle between repeats that count: it changes the torque of gravity by 1 %


@dataclass(frozen=True, eq=False)
class RepeatScatter:
    """`rms_nm` (joint,), NaN of a joint without torque."""

    rms_nm: Floats
    used: int
    repeats: int


def scatter_of_repeats(recording: Recording) -> RepeatScatter | None:
    """None where no motion was finished, no torques were recorded, or fewer than two repeats are alike."""
    event = next((one for one in recording.events if one.kind == MOTION_EVENT), None)
    made, joints = filtered_of(recording), devices_of(recording).get("joints")
    if event is None or isinstance(made, ExaminationRecord) or joints is None:
        return None
    length_s, repeats = float(event.detail["length_s"]), int(event.detail["repeats"])
    motion_s, host_s = np.array(event.detail["motion_s"]), np.array(event.detail["host_s"])
    grid_s = np.arange(EDGES_S, length_s - EDGES_S, STEP_S)
    parts: list[tuple[Floats, Floats]] = []
    for run, k in product(made.runs, range(repeats)):
        at_s = np.interp(np.interp(grid_s + k * length_s, motion_s, host_s), joints.host_s, joints.track.time_s)
        if at_s[0] < run.time_s[0] + EDGES_S or at_s[-1] > run.time_s[-1] - EDGES_S:
            continue
        first = parts[0][0] if parts else _at(run, run.q_rad, at_s)
        at_s = _along(run, at_s, first)
        q = _at(run, run.q_rad, at_s)
        if float(np.max(np.sqrt(np.mean((q - first) ** 2, axis=0)))) < ALIKE_RAD:
            parts.append((q, _at(run, run.torque_nm, at_s)))
    if len(parts) < 2:
        return None
    speed = np.abs(np.gradient(parts[0][0], STEP_S, axis=0))
    variance = np.var(np.array([torque for _, torque in parts]), axis=0, ddof=1)
    moving = np.where(speed > STILL_SHARE * speed.max(axis=0), variance, np.nan)
    measured = np.isfinite(moving).any(axis=0)
    rms = np.full(moving.shape[1], np.nan)
    rms[measured] = np.sqrt(np.nanmean(moving[:, measured], axis=0))
    return RepeatScatter(rms, len(parts), repeats)


def _along(run: Run, at_s: Floats, first: Floats) -> Floats:
    """(moment,) when this repeat is where the first one was: Gauss-Newton over the angles about each moment."""
    from scipy.ndimage import uniform_filter1d  # as the low pass: a diagnosis of poses starts sooner without

    window = round(WINDOW_S / STEP_S)
    for _ in range(SHIFTS):
        off, qd = _at(run, run.q_rad, at_s) - first, _at(run, run.qd_rad_s, at_s)
        along, speed = (uniform_filter1d(np.sum(each, axis=1), window) for each in (off * qd, qd**2))
        at_s = at_s - np.clip(along / np.maximum(speed, SLOWEST_RAD_S**2), -WINDOW_S, WINDOW_S)
    return at_s


def _at(run: Run, values: Floats, at_s: Floats) -> Floats:
    return np.stack([np.interp(at_s, run.time_s, column) for column in values.T], axis=1)
