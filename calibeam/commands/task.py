"""`calibeam task`: a task of one's own, taught by placing the arm, then run through the gate."""

from pathlib import Path
from typing import Annotated, Literal

from cyclopts import Parameter

from acquisition.recording.rig import load_rig
from calibeam.console import Console


def task_command(
    action: Literal["teach", "run"],
    task: Path,
    *,
    rig: Annotated[Path, Parameter(name="--rig")],
    out: Path | None = None,
    poses: Path | None = None,
    model: Path | None = None,
    speed: float = 1.0,
    dry_run: bool = False,
    yes: bool = False,
) -> None:
    """Teach a task by placing the arm, or run its program.

    A task file holds named transforms, positions as equations between them, and a program of MOVE, GRASP, RELEASE, READ
    and FOR; the documentation's page on motion describes it. Teaching moves nothing: place the arm by its pendant, by
    hand guiding, or with `calibeam jog` in another terminal. A run is refused before anything moves where the
    program lacks something, with what supplies it. Clear the cell first.

    For example:

    ```
    calibeam task teach cell.toml --rig rig.toml --out taught.toml
    calibeam task run taught.toml --rig rig.toml
    ```

    Parameters
    ----------
    action
        `teach`: place the arm at each position of the file's [[teach]] in turn. `run`: run the program.
    task
        The task file.
    rig
        The rig file: controller, limits, keep-out boxes, camera.
    out
        teach: the taught task file, TASK-taught.toml if not given. run: folder for the drawings of the plans, out/task.
    poses
        teach: recorded poses instead of placing the arm now, a CSV of `at` and `q1_deg` or `q1_rad` onwards.
    model
        The model.json of an identification, for its corrected kinematics; else the rig file's.
    speed
        run: share of the rig's speeds, up to 1.
    dry_run
        run: plan and draw up to the first READ only.
    yes
        run: do not ask before moving.

    """
    from calibeam.motion.by_hand import checked_speed
    from calibeam.motion.task_by_hand import run_by_hand, teach_by_hand

    loaded, console = load_rig(rig), Console()
    if action == "teach":
        teach_by_hand(loaded, task, out or task.with_name(f"{task.stem}-taught.toml"), poses, model, console)
    else:
        share = checked_speed(speed)
        run_by_hand(loaded, task, out or Path("out/task"), model, share, console, dry=dry_run, yes=yes)
