"""Instrument: laser on the flange, beam reflected from one PSD face to the other, in either order.

Observed at a pose: psd1_x, psd1_y, psd2_x, psd2_y (m). Spots are those of the planes, not of the finite faces, so
that a servo can predict them off the face too; `lit` has what light would really fall.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from calibrate.errors import DataError
from calibrate.model.chain import Standing, Usage
from calibrate.model.optics import laser
from calibrate.model.optics import laser as optics
from calibrate.model.optics.laser import LaserMount, Strike
from calibrate.model.parameters import Parameter
from calibrate.model.rigid import (
    adjoint,
    inverse,
    pose_offset,
    pose_offset_twists,
)

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

PLACE_PLAUSIBLE_M = 0.05  # a fixture set down by hand where the rig file has it
PLACE_PLAUSIBLE_RAD = 0.2
PAIR_PLAUSIBLE_M = 1e-3  # PSD 2 in PSD 1: a machined bracket
PAIR_PLAUSIBLE_RAD = 0.02
GAIN_PLAUSIBLE = 0.05
AXES = ("x", "y", "z", "roll", "pitch", "yaw")  # shifts, then rotation vector, in the frame's own axes
GAINS = ("psd1.gain_x", "psd1.gain_y", "psd2.gain_x", "psd2.gain_y")
PAIR_FIRST = laser.N_PARAMETERS + len(GAINS)  # column of PSD 2 in PSD 1
N_FIXED = PAIR_FIRST + len(AXES)  # columns before the placements
AIMED = 0.8  # of the half face: where new poses are brought to


@dataclass(frozen=True)
class Fixture:
    """The nominal dual-PSD fixture, and where it is assumed to have stood."""

    half_size_m: float
    T_psd1_psd2: Floats  # (4, 4)
    T_base_psd1: dict[int, Floats]  # placement id -> (4, 4)


@dataclass(frozen=True)
class PairTolerance:
    """One sigma of PSD 2 in PSD 1, about its own axes."""

    length_sigma_m: float
    angle_sigma_rad: float
    assumed: bool = False  # nobody's statement (Parameter.assumed)


@dataclass(frozen=True)
class DualPsd(Usage):
    """Sensor over a data set in which pose j used `placement[j]` and struck `first_psd[j]` first.

    Parameters: laser mount 4, PSD gains 4 and PSD 2 in PSD 1 6 (held unless a prior frees them), each placement 6.
    """

    mount: LaserMount
    fixture: Fixture
    placement: Ints  # (pose,)
    first_psd: Ints  # (pose,) 1 or 2
    gain_prior: float | None = None  # one sigma of the four gains; None: exact, held
    pair_prior: PairTolerance | None = None  # of PSD 2 in PSD 1; None: exact, held

    unit = "m"

    def __post_init__(self) -> None:
        unknown = set(self.placement.tolist()) - set(self.fixture.T_base_psd1)
        if unknown:
            known = ", ".join(map(str, sorted(self.fixture.T_base_psd1)))
            raise DataError(f"placement {sorted(unknown)[0]} is not in the rig (known: {known}); add a [[placement]]")
        odd = np.flatnonzero((self.first_psd != 1) & (self.first_psd != 2))
        if len(odd):
            raise DataError(f"first_psd of pose {odd[0]} is {self.first_psd[odd[0]]}; it must be 1 or 2")

    @cached_property
    def places(self) -> tuple[int, ...]:
        """Placement ids in the order of their parameters."""
        return tuple(sorted(self.fixture.T_base_psd1))

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return self._parameters

    @cached_property
    def _parameters(self) -> tuple[Parameter, ...]:
        gains = tuple(_held_unless(name, "1", GAIN_PLAUSIBLE, self.gain_prior, start=1.0) for name in GAINS)
        used = set(self.placement.tolist())
        places = tuple(
            Parameter(
                f"placement{k}.{a}",
                "m" if i < 3 else "rad",
                PLACE_PLAUSIBLE_M if i < 3 else PLACE_PLAUSIBLE_RAD,
                free=k in used,
            )
            for k in self.places
            for i, a in enumerate(AXES)
        )
        return self.mount.parameters + gains + _pair_parameters(self.pair_prior) + places

    def select(self, rows: NDArray[np.intp]) -> Self:
        return replace(self, placement=self.placement[rows], first_psd=self.first_psd[rows])

    def strike(self, phi: Floats, T_base_flange: Floats) -> Strike:
        """Geometry of light at every pose, before the gains."""
        return optics.strike(self.mount.beam(phi[:4], T_base_flange), self.unfolded(phi)[self.group])

    def leans(self, phi: Floats, T_base_flange: Floats) -> Floats:
        """(pose, 2, 2) x, y that the arriving beam travels along face 1, 2 per depth: tangent of its incidence."""
        linear = self.unfolded(phi)[self.group][..., :3, :3]
        along = (linear @ self.mount.beam(phi[:4], T_base_flange).direction[:, None, :, None])[..., 0]
        return along[..., :2] / np.abs(along[..., 2:])

    def lit(self, phi: Floats, T_base_flange: Floats) -> NDArray[np.bool_]:
        """(pose, 2) True where light falls on the face of PSD 1, PSD 2."""
        return optics.is_lit(self.strike(phi, T_base_flange), self.first_psd, self.fixture.half_size_m)

    def standing(self, phi: Floats, T_base_flange: Floats) -> Standing:
        facing = np.clip(np.abs(self.strike(phi, T_base_flange).facing), 0.0, 1.0)
        return Standing(np.arccos(facing), self.leans(phi, T_base_flange), self.first_psd, self.placement)

    def spot(self) -> Ints:
        return 2 * self.placement + self.first_psd

    def aims(self, k: int, rng: Generator) -> Floats:
        """Random points of both faces."""
        edge_m = AIMED * self.fixture.half_size_m
        return rng.uniform(-edge_m, edge_m, (len(self.placement), k))

    def met(self, phi: Floats, T_base_flange: Floats) -> NDArray[np.bool_]:
        return np.asarray(self.lit(phi, T_base_flange).all(axis=1), dtype=np.bool_)

    def beam(self, phi: Floats, T_base_flange: Floats) -> tuple[Floats, Floats]:
        light = self.mount.beam(phi[:4], T_base_flange)
        return light.origin_m, light.direction

    def expect(self, phi: Floats, T_base_flange: Floats) -> Floats:
        return self.strike(phi, T_base_flange).spots_m.reshape(-1, 4) * phi[4:8]

    def by_twist(self, phi: Floats, T_base_flange: Floats) -> Floats:
        hit = self.strike(phi, T_base_flange)
        return optics.by_twist(hit.slope, hit.continuation_m).reshape(-1, 4, 6) * phi[4:8, None]

    def by_parameter(self, phi: Floats, T_base_flange: Floats) -> Floats:
        hit = self.strike(phi, T_base_flange)
        twist = optics.by_twist(hit.slope, hit.continuation_m).reshape(-1, 4, 6)
        gain = phi[4:8, None]
        out = np.zeros((len(T_base_flange), 4, len(self.parameters)))
        out[:, :, 0:4] = gain * self._by_mount(hit, T_base_flange)
        out[:, range(4), range(4, 8)] = hit.spots_m.reshape(-1, 4)
        if self.pair_prior is not None:
            by_pair = twist.reshape(-1, 2, 2, 6) @ self.pair_motions(phi)[self.group]
            out[:, :, 8:14] = gain * by_pair.reshape(-1, 4, 6)
        columns = N_FIXED + 6 * self.at_place[:, None, None] + np.arange(6)  # a pose sees its own place only
        by_place = -gain * (twist @ self.place_twists(phi)[self.at_place])  # the beam moves by the opposite
        np.put_along_axis(out, np.broadcast_to(columns, by_place.shape), by_place, axis=2)
        return out

    def place_twists(self, phi: Floats) -> Floats:
        """(place, 6, 6) base twists of the fixture at each place by the six parameters of that place."""
        return pose_offset_twists(self._drawn[1:], phi[N_FIXED:].reshape(-1, 6))

    def pair_motions(self, phi: Floats) -> Floats:
        """(2 place, face, 6, 6) base twists by which the incoming beam seems to move, by six parameters of PSD 2.

        As each face sees it; rows are those of `group`.
        """
        pair, *places = self._placed(phi)
        pair_twists = pose_offset_twists(self.fixture.T_psd1_psd2, phi[8:14])
        seen = np.stack([_beam_motions(pair, first) @ pair_twists for first in (1, 2)])  # (order, face, 6, 6)
        to_base = np.stack([adjoint(T) for T in places])
        return (to_base[:, None, None] @ seen).reshape(-1, 2, 6, 6)

    def T_base_psd1(self, phi: Floats, place: int) -> Floats:
        """(4, 4) where the fixture stands according to phi."""
        first = N_FIXED + 6 * self.places.index(place)
        return self.fixture.T_base_psd1[place] @ pose_offset(phi[first : first + 6])

    def T_psd1_psd2(self, phi: Floats) -> Floats:
        """(4, 4) PSD 2 in PSD 1 according to phi."""
        return self.fixture.T_psd1_psd2 @ pose_offset(phi[8:14])

    @cached_property
    def at_place(self) -> Ints:
        """(pose,) index of the placement among `places`."""
        return np.searchsorted(np.array(self.places), self.placement)

    @cached_property
    def group(self) -> Ints:
        """(pose,) row of `unfolded`: placement and order together."""
        return 2 * self.at_place + self.first_psd - 1

    def unfolded(self, phi: Floats) -> Floats:
        """(2 place, face, 4, 4) maps from the base to the faces as the unreflected beam sees them."""
        placed = self._placed(phi)
        orders = [optics.unfolded_faces(placed[1:], placed[0], first) for first in (1, 2)]
        return np.stack(orders, axis=1).reshape(-1, 2, 4, 4)

    @cached_property
    def _drawn(self) -> Floats:
        """(1 + place, 4, 4) PSD 2 in PSD 1, then where the fixture is assumed to have stood."""
        return np.stack([self.fixture.T_psd1_psd2, *(self.fixture.T_base_psd1[k] for k in self.places)])

    def _placed(self, phi: Floats) -> Floats:
        """(1 + place, 4, 4) the same according to phi: `T_psd1_psd2`, then `T_base_psd1` of each place, at once."""
        deviation = phi[PAIR_FIRST:].reshape(-1, 6)
        offset = np.broadcast_to(np.eye(4), (len(deviation), 4, 4)).copy()
        offset[:, :3, :3] = Rotation.from_rotvec(deviation[:, 3:]).as_matrix()
        offset[:, :3, 3] = deviation[:, :3]
        return self._drawn @ offset

    def _by_mount(self, hit: Strike, T_base_flange: Floats) -> Floats:
        across = T_base_flange[:, :3, :3] @ np.stack([self.mount.u, self.mount.v], axis=-1)  # (pose, 3, 2)
        return (optics.by_beam(hit).reshape(-1, 4, 2, 3) @ across[:, None]).reshape(-1, 4, 4)


def _beam_motions(T_psd1_psd2: Floats, first_psd: int) -> Floats:
    """(2, 6, 6) how the incoming beam seems to face 1, 2 to move, when PSD 2 moves by a twist; PSD 1 frame.

    PSD 2 struck second: the reflected beam seems to move by the opposite, so the incoming one by its mirror image.
    PSD 2 struck first: the incoming beam seems to move by the opposite; PSD 1 sees a mirror N that moves, N l going
    over into exp(e) N exp(-e) l, which is to first order l moving by Ad(N) e - e.
    """
    if first_psd == 1:
        return np.stack([np.zeros((6, 6)), -adjoint(optics.MIRROR_Z)])
    mirror = T_psd1_psd2 @ optics.MIRROR_Z @ inverse(T_psd1_psd2)
    return np.stack([adjoint(mirror) - np.eye(6), -np.eye(6)])


def _pair_parameters(tolerance: PairTolerance | None) -> tuple[Parameter, ...]:
    length, angle = (None, None) if tolerance is None else (tolerance.length_sigma_m, tolerance.angle_sigma_rad)
    sizes = [("m", PAIR_PLAUSIBLE_M, length)] * 3 + [("rad", PAIR_PLAUSIBLE_RAD, angle)] * 3
    pair = (_held_unless(f"psd2.{a}", *size) for a, size in zip(AXES, sizes, strict=True))
    return tuple(replace(p, assumed=tolerance is not None and tolerance.assumed) for p in pair)


def _held_unless(name: str, unit: str, plausible: float, prior: float | None, start: float = 0.0) -> Parameter:
    """Known exactly, hence held, unless a prior sigma states how well it is known."""
    if prior is None:
        return Parameter(name, unit, plausible, start=start, free=False)
    return Parameter(name, unit, max(plausible, prior), start=start, prior=prior)
