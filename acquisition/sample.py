"""A settled sample as one row of the session-folder format."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from acquisition.bench import Look, Spot

Floats = NDArray[np.float64]
Cell = float | int | str | None


@dataclass(frozen=True)
class Sample:
    """What was seen at one pose, with what the session knows about it."""

    look: Look
    placement: int
    first: int
    approach: NDArray[np.int64]  # (joint,) -1, 0, +1: the way each joint last moved
    repeat: int | None
    centred: bool

    def row(self) -> dict[str, Cell]:
        """Column name -> value; names of the session-folder format, version 1, plus the sigmas of the means."""
        look = self.look
        row: dict[str, Cell] = {"t_s": look.t_s}
        row |= _numbered("q", "_rad", look.q_rad)
        row |= {"placement": self.placement, "first_psd": self.first}
        row |= _spot("psd1", look.psd1) | _spot("psd2", look.psd2)
        row |= _numbered("cmd", "_rad", look.cmd_rad)
        if look.encoder_rad is not None:
            row |= _numbered("enc", "_rad", look.encoder_rad)
        row |= {f"approach{i + 1}": int(sign) for i, sign in enumerate(self.approach)}
        row |= {"repeat": self.repeat}
        row |= _numbered("qd", "_rad_s", look.qd_rad_s)
        row |= {"settled": int(look.settled), "centred": int(self.centred)}
        return row | {f"temp_{where}_degC": value for where, value in look.temperatures_degC.items()}


def _numbered(name: str, unit: str, values: Floats) -> dict[str, Cell]:
    return {f"{name}{i + 1}{unit}": float(value) for i, value in enumerate(values)}


def _spot(face: str, spot: Spot) -> dict[str, Cell]:
    return {
        f"{face}_x_m": spot.x_m,
        f"{face}_y_m": spot.y_m,
        f"{face}_sum_v": spot.sum_v,
        f"{face}_x_sigma_m": spot.sigma_x_m,
        f"{face}_y_sigma_m": spot.sigma_y_m,
    }
