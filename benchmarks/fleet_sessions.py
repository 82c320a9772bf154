"""A fleet of emulated robots before a laser tracker, recorded on several dates: made in milliseconds a recording.

Each robot is one concealed world (simulators.conceal); a date has its own noise. A zero that drifts is a reading that
wanders: what the encoder says is less by what the zero has gained.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path

import numpy as np

from acquisition.recording import RecordingWriter
from acquisition.recording.session_folder import read_folder
from simulators.conceal.case import Case, conceal
from simulators.conceal.case_files import write_case
from simulators.conceal.wanted import Wanted

DATES = ("2025-11-03", "2026-02-11", "2026-05-20", "2026-08-30")
AXES = ("x_m", "y_m", "z_m")
HOST_S = 1000.0


@dataclass(frozen=True)
class Robot:
    """One robot of the fleet."""

    serial: str
    seed: int
    drift_rad_year: Mapping[int, float] = field(default_factory=dict[int, float])  # joint (from 1) -> of its zero
    defects: tuple[str, ...] = ()
    enr: float = 3.0


class OverClock:
    """A clock for a session that is over."""

    def now_s(self) -> float:
        return HOST_S


def write_fleet(folder: Path, robots: Sequence[Robot], dates: Sequence[str] = DATES, samples: int = 60) -> list[Path]:
    """`folder`/SERIAL/DATE.mcap for every robot and date; returns the paths."""
    paths: list[Path] = []
    for robot in robots:
        wanted = Wanted("tracker", robot.seed, defects=robot.defects, enr=robot.enr, samples=samples, arm="irb120")
        case = conceal(wanted)
        plain = folder / ".plain" / robot.serial
        write_case(case, plain)
        for number, date in enumerate(dates):
            path = folder / robot.serial / f"{date}.mcap"
            path.parent.mkdir(parents=True, exist_ok=True)
            _write(path, plain / "recording", case, robot, date, np.random.default_rng([robot.seed, number]))
            paths.append(path)
    return paths


def _write(path: Path, plain: Path, case: Case, robot: Robot, date: str, rng: np.random.Generator) -> None:
    source = read_folder(plain)
    started = datetime.fromisoformat(date).replace(tzinfo=UTC)
    year = (started - datetime.fromisoformat(DATES[0]).replace(tzinfo=UTC)).days / 365.25
    seen = case.exact.values_m + case.sigma_m * rng.standard_normal(case.exact.values_m.shape)
    text = source.rig_text.replace("[arm]\n", f'[arm]\nserial_number = "{robot.serial}"\n', 1)
    with RecordingWriter(path, rig_text=text, software="calibeam", clock=OverClock(), started_utc=started) as writer:
        for row, position in zip(source.samples.rows(), seen, strict=True):
            for joint, drift in robot.drift_rad_year.items():
                row[f"q{joint}_rad"] = float(row[f"q{joint}_rad"] or 0.0) - drift * year
            writer.sample({**row, **dict(zip(AXES, position.tolist(), strict=True))})
