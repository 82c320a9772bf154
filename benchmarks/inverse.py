"""Inverse kinematics in batch: how many of random reachable poses are solved, how exactly, and in what time."""

import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from acquisition.motion.inverse.closed_form import closed_form
from acquisition.recording.rig import load_rig
from benchmarks.many_poses import solve_many
from calibrate.model.arms.catalogue import dh_rows
from calibrate.model.arms.dh import DhArm, DhLink
from calibrate.model.arms.link_tolerance import HELD_NOMINAL
from calibrate.model.arms.rig_arm import RigArm

POSES = 10_000
OFF = 1e-3  # m and rad, one sigma of every parameter of a calibrated arm here
QUARTER = np.pi / 2.0
# ABB product specification IRB 120, 3HAC035960.
IRB120 = tuple(
    DhLink(theta, d, a, alpha)
    for theta, d, a, alpha in (
        (0.0, 0.290, 0.0, -QUARTER),
        (-QUARTER, 0.0, 0.270, 0.0),
        (0.0, 0.0, 0.070, -QUARTER),
        (0.0, 0.302, 0.0, QUARTER),
        (0.0, 0.0, 0.0, -QUARTER),
        (np.pi, 0.072, 0.0, 0.0),
    )
)
IRB120_RANGE_DEG = ((-165, 165), (-110, 110), (-110, 70), (-160, 160), (-120, 120), (-180, 180))


def lines(rig: Path) -> Iterator[str]:
    """One line an arm and state."""
    loaded = load_rig(rig)
    lower, upper = (np.array([getattr(j, f"{side}_rad") for j in loaded.arm.joints]) for side in ("lower", "upper"))
    yield "arm      parameters off by   solved of 10,000   worst pose error m   us a pose (processor time)"
    for name, rows, low, up in (
        ("IRB 120", IRB120, *np.radians(np.array(IRB120_RANGE_DEG, dtype=float)).T),
        ("UR5e", dh_rows(loaded.arm), lower, upper),
    ):
        for off in (0.0, OFF):
            yield f"{name:8s} {off:8g} m, rad   {_measured(rows, low, up, off)}"


def _measured(rows: tuple[DhLink, ...], lower: np.ndarray, upper: np.ndarray, off: float) -> str:
    model, rng = DhArm(rows, HELD_NOMINAL), np.random.default_rng(1)
    nominal = RigArm.of(model, np.zeros(len(model.parameters)), lower, upper)
    arm = RigArm.of(model, off * rng.normal(size=len(model.parameters)), lower, upper)
    T = arm.frames(rng.uniform(lower, upper, (POSES, 6)))[:, -1]
    starts = closed_form(nominal)
    begin_s = time.process_time()
    solved = solve_many(arm, T, np.zeros(6), starts, rng)
    spent_s = time.process_time() - begin_s
    worst = np.abs(arm.frames(solved.q_rad[solved.found])[:, -1] - T[solved.found]).max()
    return f"{int(solved.found.sum()):10d}        {worst:12.1e}       {1e6 * spent_s / POSES:12.1f}"
