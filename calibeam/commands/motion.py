"""`calibeam motion`: the motion examples on an emulated controller, with plots that a person can check."""

import json
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter
from rich.table import Table

from acquisition.errors import TaskError
from acquisition.motion.plan import Plan
from acquisition.recording.output import json_output, write_output
from acquisition.recording.rig import load_rig
from calibeam.commands.demo import RIG, ShippedRig
from calibeam.console import Console
from calibeam.emulation import Emulation
from calibeam.overwriting import writes
from drivers.clock import SystemClock


@writes("out")
def motion_command(
    *,
    out: Path = Path("out/motion"),
    rig: ShippedRig = RIG,
    only: Annotated[tuple[str, ...], Parameter(show_default=False)] = (),
    json_: Annotated[bool, Parameter(name="--json")] = False,
) -> None:
    """Run the motion examples on an emulated controller.

    Joint moves, straight lines, blends, a belt, two pins with teaching.

    Each leaves its plan (plan-NAME.svg), and beside it what the controller reported.

    For example:

    ```
    calibeam motion --out out/motion
    ```

    Parameters
    ----------
    out
        Folder for the plots and motion.json.
    rig
        The rig file; its arm has to be a UR5e, for which the examples' cells are laid out.
    only
        Some of them: joint, straight, belt, two-pins.
    json_
        Print the figures as one line of JSON.

    """
    from calibeam.motion.by_hand import draw_plan_file
    from calibeam.motion.examples import EXAMPLES, KeptSetPoints, Stage
    from calibeam.motion.figures import numbers_of, plot
    from calibeam.motion.gate_of_rig import cell_of, gate_of, solver_of
    from calibeam.motion.robot import streamed_robot

    strangers = sorted(set(only) - EXAMPLES.keys())
    if strangers:
        raise TaskError(f"--only {' '.join(strangers)}: the examples are {', '.join(EXAMPLES)}")
    loaded, clock = load_rig(rig), SystemClock()
    out.mkdir(parents=True, exist_ok=True)
    solver, figures_of = solver_of(loaded), dict[str, dict[str, float]]()

    def draw(name: str, made: Plan) -> None:
        draw_plan_file(made, cell_of(loaded), out / f"plan-{name}.svg")

    with Emulation(rig) as emulation, streamed_robot(loaded, clock, emulation.address["robot"]) as robot:
        sent = KeptSetPoints(robot.arm, clock)
        stage = Stage(robot, sent, gate_of(loaded, solver, sent, clock), solver, draw)
        for name in only or EXAMPLES:
            shown = EXAMPLES[name](stage)
            plot(shown, solver, out)
            figures_of[name] = numbers_of(shown, solver)
    figures = {"schema": 1, "kind": "calibeam-motion", "examples": figures_of}
    write_output(out / "motion.json", json.dumps(figures, indent=1) + "\n", json_output("calibeam-motion"))
    if json_:
        print(json.dumps(figures_of))
    else:
        _print(Console(), figures_of, out)


def _print(console: Console, figures_of: dict[str, dict[str, float]], out: Path) -> None:
    table = Table("example", "figure", "value", box=None)
    for name, numbers in figures_of.items():
        for what, value in numbers.items():
            metres = what.endswith(", m")
            table.add_row(name, what.removesuffix(", m"), f"{1e3 * value:.4f} mm" if metres else f"{value:.4g}")
            name = ""
    console.print(table)
    console.print(f"plots: {', '.join(str(path) for path in sorted(out.glob('*.svg')))}")
