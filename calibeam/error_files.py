"""What an error simulation leaves in a folder."""

from pathlib import Path

from calibeam.motion.figures import write_figure
from calibeam.software import SOFTWARE
from calibrate.error_simulation.record import write_record
from calibrate.error_simulation.simulate import Simulation
from calibrate.report.error_simulation.figures import PICTURES
from calibrate.report.error_simulation.page import write_page_of


def write_simulation(folder: Path, simulation: Simulation) -> tuple[Path, ...]:
    """errors.json, errors.html, and every figure as an SVG of its own. DataError, OSError where that cannot be."""
    folder.mkdir(parents=True, exist_ok=True)
    write_record(folder / "errors.json", simulation, SOFTWARE)
    page = write_page_of(folder / "errors.html", simulation, SOFTWARE)
    figures: list[Path] = []
    for one in PICTURES:
        figures.append(folder / f"errors-{one.name}.svg")
        write_figure(figures[-1], one.width_in, one.height_in, one.painter(simulation))
    return (folder / "errors.json", page, *figures)
