"""Compares identified zeros with the concealed truth. Opened only after the fit; nothing else may read the truth."""

from dataclasses import dataclass
from pathlib import Path

from calibrate.zeros.result import ZeroResult
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


def reveal(result: ZeroResult, truth_path: Path) -> tuple[Revealed, ...]:
    """Every joint of the result against the truth file."""
    truth = read_truth(truth_path)
    return tuple(
        Revealed(zero.joint, zero.value_rad, zero.sigma_rad, truth.joint_zero_rad[zero.joint - 1], zero.why)
        for zero in result.zeros
    )
