"""`calibeam design`: which poses to take and where, what they promise, and which causes they could separate."""

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import msgspec
import numpy as np
from cyclopts import Parameter, validators

from acquisition.recording.pose_plan import POSE_PLAN, write_pose_plan
from acquisition.recording.rig import Rig, load_rig
from calibeam.console import Console
from calibeam.overwriting import writes
from calibeam.printing.progress import progress_bar
from calibeam.software import SOFTWARE
from calibrate.report.elements.html import page_output

if TYPE_CHECKING:  # loaded when it is needed: it takes a second
    from calibrate.design import Places

Count = Annotated[int, Parameter(validator=validators.Number(gte=1))]
Progress = Callable[[str, int, int], None]

PER_BLOCK, PER_GRID_PLACE = 120, 16  # candidates: of a place and order of the rig, and of a place of the grid
DISTANCE_SIGMA_M = 20e-6  # of a distance between places, where the rig states none: docs/formats.md


@writes(out=POSE_PLAN, report=page_output("pose design"))
def design_command(
    rig: Path,
    *,
    poses: Count = 60,
    repeats: Annotated[int, Parameter(validator=validators.Number(gte=0))] = 6,
    criterion: str = "free-space",
    places: int = 0,
    candidates: Count = PER_BLOCK,
    seed: int = 1,
    out: Path = Path("plan.toml"),
    report: Path | None = None,
    json_: Annotated[bool, Parameter(name="--json")] = False,
) -> None:
    """Choose the poses of a session before it is run.

    Reachable, clear of obstacles, lit; the best of them, ordered so that drift is not mistaken for geometry.

    Prints the predicted error over the workspace, how many poses are enough, and which causes a diagnosis could find.

    For example:

    ```
    calibeam design rigs/ur5e-dual-psd.toml --out plan.toml; calibeam session RIG --plan plan.toml
    ```

    Parameters
    ----------
    rig
        The rig file; its tolerances and its noise are taken as they are.
    poses
        Readings of the plan, repeats among them.
    repeats
        Poses that are taken again, every joint from the other side.
    criterion
        free-space (predicted error of the target over the workspace), d (determinant), o1 ... o5.
    places
        Also report how many stations of the fixture are worth it (up to so many), where they are, and whether distances
        between them are needed. Takes a minute; the plan stays with the places of the rig.
    candidates
        For each place and order of the faces.
    seed
        Of everything that is drawn.
    out
        Where to write the plan: `calibeam session RIG --plan` takes it.
    report
        Where to write a page with the curve and the isolability matrix.
    json_
        Print the figures as one line of JSON, and nothing else.

    """
    from calibeam.motion.reachable_poses import candidates_of
    from calibeam.printing.design import print_design
    from calibrate.design import DesignOptions, design, information_of, record_of, seen_by

    loaded, rng, console = load_rig(rig), np.random.default_rng(seed), Console()
    with progress_bar(Console(stderr=True)) as bar:
        tasks = {}

        def progress(what: str, done: int, total: int) -> None:
            if what not in tasks:
                tasks[what] = bar.add_task(what, total=total)
            bar.update(tasks[what], completed=done)

        offered = candidates_of(loaded, candidates, rng, lambda done, total: progress("candidates", done, total))
        found = information_of(loaded, offered, rng)
        made = design(loaded, offered, found, DesignOptions(poses, repeats, criterion, seed), progress)
        write_pose_plan(out, made.plan)  # before anything else can go wrong
        seen = seen_by(loaded, offered, made.taken, rng)
        spread = _places(loaded, poses, places, rng, progress) if places else ()
    if report is not None:
        from calibrate.report.pose_design_page import write_page_of

        write_page_of(report, loaded, made, seen, spread, SOFTWARE)
    if json_:
        print(msgspec.json.encode(record_of(loaded, made, seen, spread, SOFTWARE)).decode())
        return
    print_design(console, loaded, made, seen, spread)
    for line in (f"plan: {out}", "" if report is None else f"report: {report}"):
        if line:
            console.print(line, markup=False, highlight=False, soft_wrap=True)


def _places(rig: Rig, poses: int, most: int, rng: np.random.Generator, progress: Progress) -> "tuple[Places, ...]":
    """Of the rig's own places and of a grid about them."""
    from calibeam.motion.reachable_poses import candidates_of, with_grid
    from calibrate.design import choose_places, information_of
    from calibrate.errors import DataError

    if rig.fixture is None or not rig.placements:
        raise DataError(
            f"rig {rig.name}: --places asks where the fixture should stand, but the rig file has no [fixture] "
            "with a [[placement]]; add them"
        )
    wide = with_grid(rig)
    offered = candidates_of(wide, PER_GRID_PLACE, rng, lambda done, total: progress("places", done, total))
    found = information_of(wide, offered, rng)
    stated_m = (d.sigma_m for d in rig.known_distances if d.of == "placement")
    sigma_m = min(stated_m, default=DISTANCE_SIGMA_M)
    return choose_places(found, offered, wide.placement_list, poses, sigma_m, most)
