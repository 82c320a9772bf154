"""What a session leaves and shows: samples (one row each), events, progress; and who learns the arm from them.

The learner betters the assumed rig during a session. It is passed in, because it rests on the kinematic models.
"""

import enum
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass
from typing import Any, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from acquisition.bench import ArmReading, Look, Spot
from acquisition.centring.aim import AssumedArm, FixtureOptics
from acquisition.session.plan import PoseKey

Floats = NDArray[np.float64]
Cell = float | int | str | None


NO_CELLS: Mapping[str, Cell] = {}


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
        """Column name -> value, as `row_of`, plus the sigmas of the means."""
        read: dict[str, Cell] = {"placement": self.placement, "first_psd": self.first}
        read |= _spot("psd1", self.look.psd1) | _spot("psd2", self.look.psd2)
        return row_of(self.look, self.approach, self.repeat, read, {"centred": int(self.centred)})


def row_of(
    look: ArmReading,
    approach: NDArray[np.int64],
    repeat: int | None,
    read: Mapping[str, Cell],
    done: Mapping[str, Cell] = NO_CELLS,
) -> dict[str, Cell]:
    """Column name -> value; names of the session-folder format, version 1. `read`: what the instrument has read;
    `done`: how the pose was taken, beside what every session knows of it.
    """
    row: dict[str, Cell] = {"t_s": look.t_s, **_numbered("q", "_rad", look.q_rad), **read}
    row |= _numbered("cmd", "_rad", look.cmd_rad)
    if look.encoder_rad is not None:
        row |= _numbered("enc", "_rad", look.encoder_rad)
    row |= {f"approach{i + 1}": int(sign) for i, sign in enumerate(approach)}
    row |= {"repeat": repeat, **_numbered("qd", "_rad_s", look.qd_rad_s), "settled": int(look.settled), **done}
    return row | {f"temp_{where}_degC": value for where, value in look.temperatures_degC.items()}


def sample_of(row: Mapping[str, Cell], n_joints: int) -> Sample:
    """The sample that an earlier part of a session kept as this row; what a row does not hold is missing or empty."""

    def joints(name: str, unit: str) -> Floats:
        return np.array([_number(row.get(f"{name}{i}{unit}")) for i in range(1, n_joints + 1)])

    q_rad, encoder_rad, placement = joints("q", "_rad"), joints("enc", "_rad"), row.get("placement")
    look = Look(
        host_s=np.nan,
        t_s=_number(row["t_s"]),
        q_rad=q_rad,
        qd_rad_s=joints("qd", "_rad_s"),
        cmd_rad=joints("cmd", "_rad"),
        encoder_rad=encoder_rad if np.isfinite(encoder_rad).any() else None,
        psd1=_spot_of(row, "psd1"),
        psd2=_spot_of(row, "psd2"),
        temperatures_degC={},
        settled=bool(row.get("settled", 1)),
    )
    approach = np.nan_to_num(joints("approach", "")).astype(np.int64)
    repeat = row.get("repeat")
    first, number = int(_number(row.get("first_psd"))), int(_number(placement))
    return Sample(look, number, first, approach, None if repeat is None else int(repeat), bool(row.get("centred")))


def _number(cell: Cell) -> float:
    return np.nan if cell is None or isinstance(cell, str) else float(cell)


def _spot_of(row: Mapping[str, Cell], face: str) -> Spot:
    x_m, y_m, sum_v, sigma_x_m, sigma_y_m = (
        _number(row.get(f"{face}_{name}")) for name in ("x_m", "y_m", "sum_v", "x_sigma_m", "y_sigma_m")
    )
    return Spot(x_m, y_m, sum_v, sigma_x_m, sigma_y_m, lit=bool(np.isfinite(x_m)))


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


class Learner(Protocol):
    """What is known now."""

    @property
    def arm(self) -> AssumedArm: ...

    @property
    def optics(self) -> FixtureOptics: ...

    def T_base_fixture(self, placement: int) -> Floats: ...

    def learn(self, samples: list[Sample]) -> None:
        """Refit arm, laser mount and places to all samples so far."""
        ...


class Events(Protocol):
    """Where what happens is noted."""

    def event(self, kind: str, detail: Mapping[str, Any]) -> None: ...


Kept = TypeVar("Kept", contravariant=True)


class Journal(Events, Protocol[Kept]):
    """The recording, or a test's list."""

    def sample(self, sample: Kept) -> None: ...


def key_detail(key: PoseKey, look: Look) -> dict[str, Any]:
    """Of the event "sample": which pose it is, and when it was read, so that the streams show what happened about."""
    detail: dict[str, Any] = {"pose": asdict(key)}
    if look.window_s is not None:
        detail |= {"psd_from_s": look.window_s[0], "psd_to_s": look.window_s[1]}
    return detail


class Phase(enum.Enum):
    """What the arm is doing, in a word for a person."""

    PLACE = "fixture"
    AIM = "alignment"
    CENTRE = "centring"
    COLLECT = "measurement"
    REPEAT = "repeats"


@dataclass(frozen=True)
class Progress:
    """Poses of the plan, those of earlier parts of the session among them."""

    phase: Phase
    done: int
    total: int
    skipped: int
    placement: int
    first: int  # face that the beam strikes first

    @property
    def left(self) -> int:
        """Poses still to be taken."""
        return max(0, self.total - self.done - self.skipped)


Tell = Callable[[Progress], None]


def silent(progress: Progress) -> None:
    """For a session without a display."""
