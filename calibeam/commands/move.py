"""`calibeam move`: one motion, to joint readings or to a position of a task, through the gate."""

from pathlib import Path
from typing import Annotated

import numpy as np
from cyclopts import Parameter
from numpy.typing import NDArray

from acquisition.errors import TaskError
from acquisition.motion.inverse.solve import Solver
from acquisition.motion.paths.segments import By, Place, Segment
from acquisition.motion.task.task_file import read_task
from acquisition.recording.rig import Rig, load_rig
from calibeam.console import Console
from calibeam.overwriting import writes

Floats = NDArray[np.float64]


@writes("out")
def move_command(
    rig: Path,
    *,
    joints_deg: Annotated[tuple[float, ...], Parameter(show_default=False)] = (),
    task: Path | None = None,
    position: str | None = None,
    home: bool = False,
    line: bool = False,
    model: Path | None = None,
    speed: float = 1.0,
    out: Path = Path("out/plan.svg"),
    dry_run: bool = False,
    yes: bool = False,
) -> None:
    """Move the arm to a pose: planned, shown, confirmed, then executed.

    Refused where joint limits or forbidden boxes are in the way. Clear the cell first.

    The arm moves once `go` is typed. Ctrl-C rests at the next place, or brakes where that is more than a second away;
    again brakes at once, then gives up.

    For example:

    ```
    calibeam move rigs/ur5e-dual-psd.toml --joints-deg 17 -80 92 -29 29 0
    ```

    Parameters
    ----------
    rig
        The rig file: controller, limits, keep-out boxes.
    joints_deg
        Where to, as joint readings in degrees.
    task
        A task file; with --position, where to.
    position
        Of the task; it must not move with a belt.
    home
        To the rig's home_rad.
    line
        Straight, instead of by joints.
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
    if sum((bool(joints_deg), task is not None, home)) != 1:
        raise TaskError("the target is missing; give one of --joints-deg, --task with --position, --home")
    by = By.LINE if line else By.JOINTS
    place = _task_place(task, position) if task is not None else None
    target_rad = None if place is not None else _target_rad(loaded, joints_deg)

    def asked(solver: Solver, now_rad: Floats) -> list[Segment]:
        if place is not None:
            return [Segment(place.name, by, place)]
        assert target_rad is not None  # noqa: S101 - one of the two was given
        name = "home" if home else "joints"
        return [Segment(name, by, Place(name, solver.flange(target_rad), np.eye(4)), posture_rad=target_rad)]

    move_by_hand(loaded, model, asked, Agreement(out, yes, dry_run, checked_speed(speed)), Console())


def _task_place(task: Path, position: str | None) -> Place:
    if position is None:
        raise TaskError(f"--task {task}: no position of the task is named; give --position")
    place = read_task(task).graph.place(position)
    if place.coord is not None:
        raise TaskError(f"{position}: moves with a belt; only a program can go there")
    return place


def _target_rad(rig: Rig, joints_deg: tuple[float, ...]) -> Floats:
    if joints_deg:
        if len(joints_deg) != rig.n_joints:
            raise TaskError(f"--joints-deg: {len(joints_deg)} numbers, but the arm has {rig.n_joints} joints")
        return np.radians(np.array(joints_deg))
    if rig.motion.home_rad is None:
        raise TaskError(f"rig {rig.name}: [motion] has no home_rad; give --joints-deg instead")
    return np.array(rig.motion.home_rad)
