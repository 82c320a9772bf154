"""`calibeam batch`: many recordings at once, one table and one page for a fleet of robots."""

import os
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import msgspec
from cyclopts import Parameter, validators

from calibeam.console import Console
from calibeam.fleet.recordings import PAGE, TABLE, Engine, Workers
from calibeam.outcome import PartialResult
from calibeam.overwriting import writes
from calibeam.printing.progress import progress_bar
from calibrate.errors import DataError

if TYPE_CHECKING:
    from calibeam.fleet.run import RunResult
    from calibeam.fleet.summary import Fleet


@writes("out")
def batch_command(
    folder: Path,
    *,
    out: Path = Path("out/fleet"),
    diagnose: bool = False,
    jobs: Annotated[int, Parameter(validator=validators.Number(gte=1))] | None = None,
    engine: Engine = Engine.LOKY,
    scheduler: str | None = None,
    timeout: Annotated[float, Parameter(validator=validators.Number(gte=0.0))] = 900.0,
    again: bool = False,
    robot_by_folder: bool = False,
    json: bool = False,
) -> None:
    """Identify every recording below a folder; table and drift page.

    One table of all, and a page of what drifts and which causes robots have in common.

    A file that is broken, crashes its process or never ends becomes a row with the reason. What was done stands when
    the same command runs again; only what is new or changed is done. Ends with 3 when some failed.

    For example:

    ```
    calibeam batch recordings --out out/fleet --diagnose
    calibeam batch /site/recordings --engine dask --scheduler tcp://10.0.0.5:8786
    ```

    Parameters
    ----------
    folder
        Searched with all that is below it for *.mcap and session folders.
    out
        Folder for fleet.parquet and fleet.html.
    diagnose
        Also seek missing physics: some seconds more for each.
    jobs
        Recordings at a time; default: one a core.
    engine
        loky: processes of this machine. dask: workers of a Dask cluster, by --scheduler, or of this machine.
    scheduler
        Address of a Dask scheduler; its workers need calibeam and see the files under the same paths.
    timeout
        Seconds that one recording may take; 0: no limit, with loky only.
    again
        Do all again, also what is done.
    robot_by_folder
        The first folder below names the robot; else its serial number, where the recording has one, else the rig.
    json
        Print counts, drifts, shared causes and failures on one line, and nothing else.

    """
    from calibeam.fleet.fleet_page import write_fleet_page
    from calibeam.fleet.run import RunOptions, run
    from calibeam.fleet.summary import Fleet
    from calibeam.printing.fleet import (  # with joblib, Arrow, matplotlib: only where they are wanted
        fleet_record,
        print_fleet,
    )

    workers = Workers(engine, jobs or os.cpu_count() or 1, scheduler)
    wanted = RunOptions(diagnose, again, robot_by_folder, timeout or None, workers)
    with progress_bar(Console(stderr=True)) as bar:
        task = bar.add_task("recordings", total=None)
        ran = run(folder, out, wanted, lambda done, total, _: bar.update(task, completed=done, total=total))
    fleet = Fleet(ran.rows)
    page = write_fleet_page(out / PAGE, fleet, folder.resolve().name)
    if ran.stopped and not json:
        _end(ran, fleet, out, again=again)
    if json:
        print(msgspec.json.encode(fleet_record(ran, fleet, str(out / TABLE), str(page))).decode())
    else:
        console = Console()
        print_fleet(console, ran, fleet)
        for line in (f"table: {out / TABLE}", f"page: {page}"):
            console.print(line, markup=False, highlight=False)
    _end(ran, fleet, out, again=again)


def _end(ran: "RunResult", fleet: "Fleet", out: Path, *, again: bool) -> None:
    """PartialResult where not all is well, DataError where nothing is."""
    if ran.stopped:
        how = "leave --again out to go on" if again else "the same command goes on"
        raise PartialResult(f"{ran.stopped}; recordings in {out / TABLE}: {len(ran.rows)}, left: {ran.left}; {how}")
    if fleet.bad and len(fleet.bad) == len(fleet.rows):
        raise DataError(f"none of {len(fleet.rows)} recordings could be identified; the first: {fleet.bad[0].error}")
    if fleet.bad:
        raise PartialResult(f"{len(fleet.bad)} of {len(fleet.rows)} recordings failed; the reasons are in {out / PAGE}")
