"""Where the shipped rig files are: `rigs/` of a checkout, or copies in an installed package; what a rig leaves open."""

from pathlib import Path

from acquisition.recording.rig import Rig
from calibrate.errors import DataError

CHECKOUT = Path(__file__).parents[1] / "rigs"
INSTALLED = Path(__file__).parent / "rigs"  # made by the wheel: pyproject.toml, force-include
RIGS = INSTALLED if INSTALLED.is_dir() else CHECKOUT
ROBOTS = {"ur5e": "ur5e-tracker", "irb120": "irb120-modbus"}  # who asks for a robot gets it with these devices


def rig_path(given: Path) -> Path:
    """A rig file by its path, or a shipped one with its devices by name: `ur5e`. DataError for a name of none."""
    if given.suffix or (given.exists() and not given.is_dir()):  # a pipe is fine
        return given
    shipped = {path.stem: path for path in sorted(RIGS.glob("*.toml"))}
    shipped |= {robot: shipped[rig] for robot, rig in ROBOTS.items() if rig in shipped}
    if str(given) not in shipped:
        raise DataError(f"{given}: no rig file, and none is shipped under this name: {', '.join(shipped)}")
    return shipped[str(given)]


SEVERAL = 3  # targets that show how the flange lies


def of_one_point(rig: Rig) -> str:
    """What a session with one target leaves open, for a person before it is taken.

    Empty where several targets show how the flange lies, or detectors or a probe stand in place of targets. The size is
    that of docs/correct.md, measured by benchmarks/promised.py.
    """
    if rig.fixture is not None or rig.tool.probe_diameter_m is not None or len(rig.targets) >= SEVERAL:
        return ""
    return (
        "one target shows where it is itself, not how the flange is turned: a tool 150 mm beside it is then known to "
        "some 0.5 mm; for other tools put three targets of measured places on it ([[target]] with point_sigma_m), or "
        "teach them again after the correction"
    )
