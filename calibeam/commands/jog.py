"""`calibeam jog`: a small step by hand, of one joint or of the tool along an axis, through the gate."""

from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from acquisition.errors import TaskError
from acquisition.motion.inverse.solve import Solver
from acquisition.motion.kinematics import transform
from acquisition.motion.paths.segments import By, Place, Segment
from acquisition.recording.rig import load_rig
from calibeam.console import Console
from calibeam.overwriting import writes

Floats = NDArray[np.float64]

AXES = "xyz"
LARGEST_MM, LARGEST_DEG = 100.0, 30.0  # a step by hand; what is further is a motion: `calibeam move`


@writes("out")
def jog_command(
    rig: Path,
    *,
    joint: int | None = None,
    axis: Literal["x", "y", "z"] | None = None,
    by_deg: float | None = None,
    by_mm: float | None = None,
    tool: bool = False,
    model: Path | None = None,
    speed: float = 0.3,
    out: Path = Path("out/plan.svg"),
    dry_run: bool = False,
    yes: bool = False,
) -> None:
    """Step one joint, or move the flange along an axis, slowly.

    The flange is shifted or turned along an axis; every step passes the same checks as a move. Clear the cell
    first.

    For example:

    ```
    calibeam jog rigs/ur5e-dual-psd.toml --axis z --by-mm 5
    ```

    Parameters
    ----------
    rig
        The rig file: controller, limits, keep-out boxes.
    joint
        Which joint, from 1; with --by-deg.
    axis
        Along which axis to shift (--by-mm), or about which to turn (--by-deg).
    by_deg
        How far to turn, up to 30.
    by_mm
        How far to shift, up to 100.
    tool
        The axis is the flange's own, not the base's.
    model
        The model.json of an identification, for its corrected kinematics; else the nominal arm.
    speed
        Share of the rig's speeds, up to 1.
    out
        The picture of the plan.
    dry_run
        Plan and draw only.
    yes
        Do not ask before moving.

    """
    from calibeam.motion.by_hand import Agreement, checked_speed, move_by_hand

    loaded = load_rig(rig)
    if (joint is None) == (axis is None) or (by_deg is None) == (by_mm is None) or None not in (joint, by_mm):
        raise TaskError("what to jog is missing; give --joint N --by-deg A, or --axis x|y|z with --by-mm or --by-deg")
    if abs(by_mm or 0.0) > LARGEST_MM or abs(by_deg or 0.0) > LARGEST_DEG:
        raise TaskError(f"a jog is at most {LARGEST_MM:.0f} mm or {LARGEST_DEG:.0f}°; use calibeam move")
    if joint is not None and not 1 <= joint <= loaded.n_joints:
        raise TaskError(f"--joint {joint}: the arm has joints 1 to {loaded.n_joints}")

    def asked(solver: Solver, now_rad: Floats) -> list[Segment]:
        if joint is not None:
            target_rad = now_rad + np.radians(by_deg or 0.0) * (np.arange(now_rad.size) == joint - 1)
            place = Place(f"joint {joint}", solver.flange(target_rad), np.eye(4))
            return [Segment(place.name, By.JOINTS, place, posture_rad=target_rad)]
        step = np.array([float(letter == axis) for letter in AXES])
        shift, turn = step * 1e-3 * (by_mm or 0.0), step * np.radians(by_deg or 0.0)
        place = Place(f"axis {axis}", stepped(solver.flange(now_rad), shift, turn, tool=tool), np.eye(4))
        return [Segment(place.name, By.LINE, place)]

    move_by_hand(loaded, model, asked, Agreement(out, yes, dry_run, checked_speed(speed)), Console())


def stepped(T_base_flange: Floats, shift_m: Floats, turn_rad: Floats, *, tool: bool) -> Floats:
    """The flange (4, 4) shifted, and turned about its own origin, along axes of its own or of the base."""
    if tool:
        return T_base_flange @ transform(shift_m, turn_rad)
    out = T_base_flange.copy()
    out[:3, :3] = transform(rotation_rad=turn_rad)[:3, :3] @ T_base_flange[:3, :3]
    out[:3, 3] += shift_m
    return out
