"""Compares identified zeros with the concealed truth, and prints both. The truth is opened only after the fit."""

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

from calibrate.identification.estimates import JointZero
from simulators.world.truth import read_truth


@dataclass(frozen=True)
class Revealed:
    """One joint: what was said, what is true. `deviation` is in stated sigmas, None where nothing was said."""

    joint: int
    value_rad: float | None
    sigma_rad: float | None
    truth_rad: float
    why: str | None

    @property
    def deviation(self) -> float | None:
        if self.value_rad is None or self.sigma_rad is None:
            return None
        return (self.value_rad - self.truth_rad) / self.sigma_rad


def reveal(zeros: Iterable[JointZero], truth_path: Path) -> tuple[Revealed, ...]:
    """Every joint zero against the truth file."""
    truth = read_truth(truth_path)
    return tuple(
        Revealed(zero.joint, zero.value_rad, zero.sigma_rad, truth.joint_zero_rad[zero.joint - 1], zero.why)
        for zero in zeros
    )


def print_revealed(console: Console, revealed: tuple[Revealed, ...]) -> None:
    """Identified beside true zeros."""
    table = Table(title="concealed truth, opened after the fit", title_justify="left")
    for heading in ("joint", "identified (deg)", "sigma", "truth (deg)", "off by", "in sigma"):
        table.add_column(heading, justify="right")
    for one in revealed:
        if one.value_rad is None or one.sigma_rad is None or one.deviation is None:
            table.add_row(f"J{one.joint}", "-", "-", f"{np.degrees(one.truth_rad):+.5f}", "-", "not determined")
            continue
        off_rad = one.value_rad - one.truth_rad
        table.add_row(
            f"J{one.joint}",
            f"{np.degrees(one.value_rad):+.5f}",
            f"{np.degrees(one.sigma_rad):.5f}",
            f"{np.degrees(one.truth_rad):+.5f}",
            f"{np.degrees(off_rad):+.5f}",
            f"{one.deviation:+.2f}",
        )
    console.print(table)
