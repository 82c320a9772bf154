"""Instrument: a probe in cones. In one seat, from whatever side, the tip is at one point; which one is unknown.

Observed at a pose: tip less seat (m), which is zero. Cones hold no scale: an arm shrunk to nothing satisfies them all.
So weights must be the joints' noise mapped through the arm (fit/noise/variance.py), and one known length is needed.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from numpy.typing import NDArray

from acquisition.recording import Samples
from acquisition.recording.rig import Rig
from acquisition.recording.samples import BAR, SEAT
from calibrate.errors import DataError
from calibrate.model.alignment import pivot
from calibrate.model.chain import About, SensorChain, Standing, Usage
from calibrate.model.checks.rough_fit import damped, median, weights
from calibrate.model.checks.witness import (
    Otherwise,
    Strain,
    Witness,
    drawn_point_m,
    filled,
)
from calibrate.model.parameters import Parameter
from calibrate.model.placement import SharedPoints, Target, point_by_twist
from calibrate.model.problem import Block, Measured
from calibrate.model.sample_table import SampleTable
from calibrate.model.sensors.kind import (
    Columns,
    Found,
    Frame,
    NoiseSource,
    SensorKind,
    Trait,
)
from calibrate.model.sensors.known_distance import distances_between

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

TIP = ("tip_x_m", "tip_y_m", "tip_z_m")
POINTS = "seat"  # parameters are seat<k>.x, ...
NOISE = NoiseSource("seat", "m", "seat_m")
SEAT_ASSUMED_M = 10e-6  # start value where the rig's [noise] states nothing; the data correct it
PLAUSIBLE_M = 0.05  # about the mean of the nominal tips: nominal arms are off by millimetres, hand-made tools by more


@dataclass(frozen=True)
class Seat(Usage):
    """Pose j sits in cone `seat[j]`. Parameters: target 3, then those of the seats."""

    target: Target
    points: SharedPoints

    unit = "m"

    @property
    def seat(self) -> Ints:
        """(pose,) number of the cone."""
        return self.points.of_pose

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return self.target.parameters + self.points.parameters

    def about(self) -> About:
        return {**self.target.about(), **self.points.about()}

    def placed(self, about: About) -> Self:
        return replace(self, target=self.target.placed(about), points=self.points.placed(about))

    def standing(self, phi: Floats, T_base_flange: Floats) -> Standing:
        return Standing(place=self.seat)

    def spot(self) -> Ints:
        return 1 + self.seat

    def select(self, rows: NDArray[np.intp]) -> Self:
        return replace(self, points=self.points.select(rows))

    def expect(self, phi: Floats, T_base_flange: Floats) -> Floats:
        return self.target.in_base(phi[:3], T_base_flange) - self.points.at_poses_m(phi[3:])

    def by_twist(self, phi: Floats, T_base_flange: Floats) -> Floats:
        return point_by_twist(self.target.in_base(phi[:3], T_base_flange))

    def by_parameter(self, phi: Floats, T_base_flange: Floats) -> Floats:
        by_seat = self.points.by_shift(np.broadcast_to(-np.eye(3), (len(self.seat), 3, 3)))
        return np.concatenate([T_base_flange[:, :3, :3], by_seat], axis=-1)


def mean_tips(tips_m: Floats, seat: Ints) -> SharedPoints:
    """The cones, each from the mean of its nominal tips (pose, 3). DataError for a seat with one pose only."""
    out: dict[int, Floats] = {}
    for k in sorted(set(seat.tolist())):
        rows = np.flatnonzero(seat == k)
        if len(rows) < 2:
            raise DataError(
                f"seat {k}: 1 row; one articulation determines nothing; take it again from other sides or remove the "
                "row"
            )
        out[k] = tips_m[rows].mean(axis=0)
    return SharedPoints(POINTS, out, seat, PLAUSIBLE_M)


FEWEST_ROWS = 12  # in seats of several rows; each seat takes three unknowns, the target three
TURNS = 25
DAMPING = 1e-6  # of the mean square of a column: where the probe leans one way the target stays nominal


@dataclass(frozen=True)
class SeatWitness:
    """Seats and target are found; a drawn target should not have to move. An arm that hardly moves satisfies them."""

    q_rad: Floats  # (row, joint)
    seat: NDArray[np.int64]  # (row,) every seat has several rows
    point_m: Floats | None  # (3,) target at its nominal place in the flange frame

    def strain(self, T_base_flange: Floats) -> Strain:
        """Target by linear least squares with every seat at the weighted mean of its tips."""
        R, t = T_base_flange[..., :3, :3], T_base_flange[..., :3, 3]
        drawn = np.zeros(3) if self.point_m is None else self.point_m
        tips, flat = R @ drawn + t, R.reshape(*t.shape[:-1], 9)
        _, of_seat = np.unique(self.seat, return_inverse=True)
        member = (of_seat == np.arange(of_seat.max() + 1)[:, None]).astype(float)  # (seat, row)
        weight, shift, distance = np.ones(t.shape[:-1]), np.zeros(3), np.zeros(t.shape[:-1])
        for _ in range(TURNS):
            share = member * weight[..., None, :]
            share /= share.sum(axis=-1, keepdims=True)
            turns = (flat - (share @ flat)[..., of_seat, :]).reshape(*t.shape[:-2], -1, 3)  # (..., 3 row, 3)
            away = (tips - (share @ tips)[..., of_seat, :]).reshape(*t.shape[:-2], -1, 1)
            weighed = np.swapaxes(np.repeat(weight, 3, axis=-1)[..., None] * turns, -1, -2)
            shift = -np.linalg.solve(damped(weighed @ turns, DAMPING), weighed @ away)
            distance = np.linalg.norm((away + turns @ shift).reshape(t.shape), axis=-1)
            weight = weights(distance)
        moved = np.linalg.norm(shift, axis=(-2, -1))
        return Strain(median(distance), 0.0 * moved if self.point_m is None else moved)

    def otherwise(self) -> Iterator[Otherwise]:
        """A cone has no reading that could be written otherwise."""
        yield from ()


def seat_sigma_m(rig: Rig) -> float:
    """One sigma of a coordinate of a seated probe, as stated or else as usual."""
    return rig.noise.seat_m or SEAT_ASSUMED_M


def predicted_tips(found: Found, T_base_flange: Floats, samples: Samples) -> Columns:
    """The probe's tip in the base; NaN in rows that are neither in a cone nor at a bar, where any are."""
    tip = found.tip_at(T_base_flange)
    named = [np.isfinite(samples.column(name)) for name in (SEAT, BAR) if name in samples]
    if named:
        tip[~np.logical_or.reduce(named)] = np.nan
    return dict(zip(TIP, tip.T, strict=True))


def _build(table: SampleTable) -> Measured | None:
    rows = table.filled(SEAT)
    if len(rows) == 0:
        return None
    seat = table.samples.integers(SEAT, 0)[rows]
    chain = SensorChain(table.arm, Seat(table.target, mean_tips(table.tips_m[rows], seat)))
    own = {NOISE.name: np.full((len(rows), 3), seat_sigma_m(table.rig))}
    return table.measured(KIND.name, chain, rows, np.zeros((len(rows), 3)), own, condition=True)


def _known_distances(table: SampleTable) -> tuple[Block, ...]:
    """Between seats with rows; between others they show nothing."""
    rows = table.filled(SEAT)
    if not table.rig.known_distances or len(rows) == 0:
        return ()
    points = mean_tips(table.tips_m[rows], table.samples.integers(SEAT, 0)[rows])
    starts = {k: points.start_m[k] for k in points.numbers}
    axes = dict.fromkeys(starts, np.eye(3))
    return distances_between(POINTS, table.rig, set(starts), points.parameters, starts, axes)


def _pivot_m(table: SampleTable) -> Floats | None:
    """(3,) the target by which every cone's tips meet."""
    rows = table.filled(SEAT)
    return None if len(rows) == 0 else pivot(table.T_base_flange[rows], table.samples.integers(SEAT, 0)[rows])[0]


def _witness(rig: Rig, samples: Samples, q_rad: Floats) -> Witness | None:
    rows, seat = filled(samples, SEAT), samples.integers(SEAT, 0)
    several = [k for k in np.unique(seat[rows]) if np.sum(seat[rows] == k) > 2]
    rows = rows[np.isin(seat[rows], several)]
    if len(rows) < FEWEST_ROWS + len(several):
        return None
    return SeatWitness(q_rad[rows], seat[rows], drawn_point_m(rig))


def _cones(found: Found, samples: Samples) -> Columns | None:
    """Where the tips should be: (row,) in the base, NaN without a cone that the model knows; None: it knows none."""
    if SEAT not in samples or not any(name.startswith(POINTS) for name in found.about):
        return None
    seat = samples.integers(SEAT, 0)
    out = np.full((len(seat), 3), np.nan)
    for k in set(seat.tolist()):
        place = cone_m(found, k)
        if place is not None:
            out[seat == k] = place
    return dict(zip(TIP, out.T, strict=True))


def cone_m(found: Found, seat: int) -> Floats | None:
    """(3,) of a cone in the base; None for one that the model does not know."""
    start = found.about.get(f"{POINTS}{seat}")
    shift = [found.values.get(f"{POINTS}{seat}.{axis}", 0.0) for axis in "xyz"]
    return None if start is None else np.array(start) + shift


KIND = SensorKind(
    name="seat",
    columns=(SEAT,),
    title="Probe in the cones",
    noun="cones",
    noise=(NOISE,),
    traits=frozenset({Trait.TARGET, Trait.CONES, Trait.TOUCHED, Trait.SCALELESS}),
    frames=(Frame(POINTS, "seat", "where the cones are", "where cone"),),
    reads=TIP,
    asks=(SEAT,),
    build=_build,
    lengths=_known_distances,
    point_m=_pivot_m,
    witness=_witness,
    predict=predicted_tips,
    observed=_cones,
    place=lambda samples: samples.integers(SEAT, 0),
)
