"""`calibeam simulate-errors`: what errors of an arm make of its probe: budget, ranking, worst postures."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import msgspec
from cyclopts import Parameter, validators

from acquisition.recording.rig import Rig, load_rig
from calibeam.console import Console
from calibeam.geometry_only import read_geometry
from calibeam.overwriting import writes
from calibeam.printing.progress import progress_bar
from calibeam.printing.tables import print_error_simulation
from calibeam.software import SOFTWARE
from calibrate.error_simulation import (
    NOTHING_STATED,
    Machine,
    identified_machine,
    machine_of,
    read_error_plan,
    sources_of,
)

if TYPE_CHECKING:
    from calibrate.error_simulation import Simulation

Count = Annotated[int, Parameter(validator=validators.Number(gte=1))]


@writes("out")
def simulate_errors_command(
    rig: Path,
    *,
    errors: Path | None = None,
    only: Annotated[tuple[str, ...], Parameter(show_default=False)] = (),
    arms: Count = 1_000_000,
    poses: Count = 10,
    workers: Count = 1,
    seed: int = 1,
    out: Path | None = None,
    json_: Annotated[bool, Parameter(name="--json")] = False,
) -> None:
    """Propagate an arm's errors to its tool.

    Each error alone and all together: linear, by Monte Carlo, by Sobol indices, and the worst postures.

    For example:

    ```
    calibeam simulate-errors rigs/arm-cmm-reference.toml --errors rigs/errors/arm-cmm.toml --out out/errors
    ```

    Parameters
    ----------
    rig
        A rig file, or an identified model (model.json): its arm is then as identified.
    errors
        Which errors, by which law and how large (errors.toml); beside what the rig file assumes.
    only
        Some of the errors, by name or shell pattern: `link2.*` `joint*.zero`.
    arms
        Drawn at every pose. Memory does not grow with them.
    poses
        At which arms are drawn, all over the workspace.
    workers
        Threads that draw; the answer is the same with any number.
    seed
        Of everything that is drawn.
    out
        Folder for errors.json, errors.html and the figures as SVG; over what may be there.
    json_
        Print what stands in errors.json, on one line, and nothing else.

    """
    from calibrate.error_simulation import Asked, record_of, simulate

    machine, loaded, identified = _machine(rig)
    plan = NOTHING_STATED if errors is None else read_error_plan(errors)
    sources = sources_of(machine, loaded, plan, only, identified=identified)
    console, bar = Console(), progress_bar(Console(stderr=True))
    with bar:
        tasks = {}

        def progress(what: str, done: int, total: int) -> None:
            if what not in tasks:
                tasks[what] = bar.add_task(what, total=total)
            bar.update(tasks[what], completed=done)

        found = simulate(machine, sources, Asked(arms, poses, seed, workers), progress)
    if json_:
        print(msgspec.json.encode(record_of(found, SOFTWARE)).decode())
    else:
        print_error_simulation(console, found)
    if out is not None:
        files = write_simulation(out, found)
        if not json_:
            console.print(f"written: {', '.join(map(str, files))}", markup=False, highlight=False, soft_wrap=True)


def write_simulation(folder: Path, simulation: "Simulation") -> tuple[Path, ...]:
    """errors.json, errors.html, and every figure as an SVG of its own. DataError, OSError where that cannot be."""
    from calibeam.motion.figures import write_figure  # matplotlib takes a second to load
    from calibrate.error_simulation import write_record
    from calibrate.report.error_simulation_page import PICTURES, write_page_of

    folder.mkdir(parents=True, exist_ok=True)
    write_record(folder / "errors.json", simulation, SOFTWARE)
    page = write_page_of(folder / "errors.html", simulation, SOFTWARE)
    figures: list[Path] = []
    for one in PICTURES:
        figures.append(folder / f"errors-{one.name}.svg")
        write_figure(figures[-1], one.width_in, one.height_in, one.painter(simulation))
    return (folder / "errors.json", page, *figures)


def _machine(path: Path) -> tuple[Machine, Rig, bool]:
    if path.suffix == ".json":
        return *identified_machine(read_geometry(path)), True
    rig = load_rig(path)
    return machine_of(rig), rig, False
