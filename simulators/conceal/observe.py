"""A session as it would be recorded without noise: joint readings, second encoders, and the instrument.

A probe in a cone: its point is fixed, the operator chooses the posture, the encoders give the joint angles.

A second encoder at every joint, with mechanisms of machine-like size. Where both encoders sit decides which of them
shows the drive. "link": the controller reads the motor's side, the second encoder the link's. "motor": the controller
reads the link's side, so that the drive deflects inside its loop and the flange does not show it. "beside": both read
the motor's side, and only the flange shows the drive.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from simulators.arm.kinematics import forward, jacobian, reach_point, within_limits
from simulators.conceal.readings import (
    balanced,
    carried_m,
    length_m,
    position_m,
    said_rad,
    spots,
    stand,
    tip_m,
    true_shaft_rad,
)
from simulators.conceal.rig import Artefacts, Device, DualPsd, TrueRig
from simulators.conceal.wanted import ConcealError, Side
from simulators.defects import Defect, Scene, Site, UnsuitedError
from simulators.defects.defect import MovesSeat, MovesStations, TurnsJoint, with_size
from simulators.defects.drive import SlackDrive, SoftJoint
from simulators.defects.encoder import RADIUS_M, EccentricDisc, SecondDisc, SecondSlip

Floats = NDArray[np.float64]
Whole = NDArray[np.int64]
STEPS = 6  # the defects move the probe by 1e-4 m at most; the steps converge by a factor of 1e-3 each
DRAW_ROUNDS = 20


def seated_readings(
    rig: TrueRig, artefacts: Artefacts, scene: Scene, defects: Sequence[Defect], posture_rad: Floats
) -> Floats:
    """Encoder readings (row, n) with the probe truly in its cone, in the posture nearest to `posture_rad` (row, n)."""
    seat_m, cone = artefacts.seat_m[scene.seat - 1], (scene.seat <= artefacts.cones)[:, np.newaxis]
    seat_m = np.where(cone, on_their_plate(seat_m, scene, defects), seat_m)  # bars are held by hand
    return readings_at(rig, seat_m, scene, defects, posture_rad)


def on_their_plate(seat_m: Floats, scene: Scene, defects: Sequence[Defect]) -> Floats:
    """(row, 3) cones where what carries them all has taken them."""
    for defect in defects:
        if isinstance(defect, MovesStations):
            motion = defect.stations_motion(scene)
            seat_m = np.einsum("rij,rj->ri", motion[:, :3, :3], seat_m) + motion[:, :3, 3]
    return seat_m


def readings_at(rig: TrueRig, wanted_m: Floats, scene: Scene, defects: Sequence[Defect], posture_rad: Floats) -> Floats:
    """The same with cones at `wanted_m` (row, 3) in the base, before anything moves them."""
    for defect in defects:
        if isinstance(defect, MovesSeat):
            wanted_m = wanted_m + defect.seat_shift_m(scene)
    shaft_rad = posture_rad.copy()
    for _ in range(STEPS):
        stance = balanced(rig.arm, scene, defects, shaft_rad)
        here_m = tip_m(rig, stance)
        slope = jacobian(stance.frames, here_m)[:, :3]
        square = slope @ slope.swapaxes(-1, -2)
        shaft_rad = shaft_rad + np.einsum(
            "rij,ri->rj", slope, np.linalg.solve(square, (wanted_m - here_m)[..., np.newaxis])[..., 0]
        )
    return said_rad(defects, scene, shaft_rad)


def seated_tip_m(rig: TrueRig, reading_rad: Floats) -> Floats:
    """Where an arm without defects has its probe at these readings, (row, 3)."""
    flange = forward(rig.arm, reading_rad + rig.arm.zero_rad).flange
    return carried_m(rig, flange)


def seated_plan(
    rig: TrueRig, artefacts: Artefacts, poses: int, rng: np.random.Generator
) -> tuple[Floats, Whole, Whole]:
    """Postures (row, n), their seats (row,), and `linked` (row,): rows of one number stay together, in this order.

    Every holding of a bar is probed once at each end; the rest of the poses goes to the cones. 0: not linked. A holding
    of which one end cannot be reached is left out, and so are holdings beyond a third of the poses.
    """
    holdings = min(len(artefacts.held), poses // 6)
    ends = artefacts.cones + 1 + np.arange(2 * holdings)
    at_cones = rng.integers(1, artefacts.cones + 1, max(poses - ends.size, 0))
    seat = np.concatenate((at_cones, ends))
    linked = np.concatenate((np.zeros_like(at_cones), np.repeat(np.arange(1, holdings + 1), 2)))
    reading_rad = postures(rig, artefacts.seat_m, seat, rng)
    found = np.isfinite(reading_rad).all(axis=1)
    lost = np.unique(linked[~found])
    found &= (linked == 0) | ~np.isin(linked, lost)
    return reading_rad[found], seat[found], linked[found]


def shaken_rad(rig: TrueRig, reading_rad: Floats, contact_m: Floats) -> Floats:
    """Scatter of the probe in its cone: the smallest joint angles (row, n) that move it by `contact_m` (row, 3)."""
    frames = forward(rig.arm, reading_rad + rig.arm.zero_rad)
    slope = jacobian(frames, seated_tip_m(rig, reading_rad))[:, :3]
    square = slope @ slope.swapaxes(-1, -2)
    return np.einsum("rij,ri->rj", slope, np.linalg.solve(square, contact_m[..., np.newaxis])[..., 0])


def postures(rig: TrueRig, seat_m: Floats, seat: Whole, rng: np.random.Generator) -> Floats:
    """A random posture (row, n) for each seat (row,) from 1, with the probe in it and within the limits."""
    arm = rig.arm
    reading_rad = np.full((seat.size, arm.n_joints), np.nan)
    missing = np.arange(seat.size)
    for _ in range(DRAW_ROUNDS):
        start_rad = rng.uniform(arm.lower_rad, arm.upper_rad, (missing.size, arm.n_joints)) + arm.zero_rad
        joint_rad, arrived = reach_point(arm, rig.tool_point_m, seat_m[seat[missing] - 1], start_rad)
        said, inside = within_limits(arm, joint_rad)
        good = arrived & inside
        reading_rad[missing[good]] = said[good]
        missing = missing[~good]
        if not missing.size:
            break
    return reading_rad


@dataclass(frozen=True, eq=False)
class Observed:
    """Noise-free."""

    reading_rad: Floats  # (row, n) what the encoders read
    values_m: Floats  # (row, channel); for a seated probe: where a perfect arm with these readings would have its probe
    sum_v: Floats | None  # (row, 2) of a dual PSD


def observe(
    rig: TrueRig, scene: Scene, defects: Sequence[Defect], reading_rad: Floats, *, wire: bool = False
) -> Observed:
    """`reading_rad` (row, n): where a robot is sent; for a seated probe, the posture the operator holds it in."""
    instrument = rig.instrument
    if not isinstance(instrument, (DualPsd, Device)):
        said_rad = seated_readings(rig, instrument, scene, defects, reading_rad)
        return Observed(said_rad, seated_tip_m(rig, said_rad), None)
    stance = stand(rig, scene, defects, reading_rad)
    if isinstance(instrument, DualPsd):
        seen = spots(rig, instrument, scene, defects, stance)
        return Observed(reading_rad, seen.seen_m, seen.sum_v)
    measure = length_m if wire else position_m
    return Observed(reading_rad, measure(rig, instrument, scene, defects, stance), None)


COUNT_RAD = 2.0 * np.pi / (1 << 20)
NOISE_RAD = 2e-6  # one sigma: bearings of the encoder, and gears that seat again
AGAINST = 0.2  # share of encoders that count against their joint
# What maker's sheets and service engineers find on arms in use: stiffness of drives, play, centring of discs, slips.
SIZES: dict[type[Any], tuple[float, float]] = {
    SoftJoint: (2e-6, 30e-6),
    SlackDrive: (20e-6, 300e-6),
    EccentricDisc: (20e-6 * RADIUS_M, 300e-6 * RADIUS_M),
    SecondDisc: (20e-6 * RADIUS_M, 300e-6 * RADIUS_M),
    SecondSlip: (20e-6, 300e-6),
}


@runtime_checkable
class ReadsSecond(Protocol):
    """Between the shaft that a second encoder sits on and the number that it gives."""

    def second_error_rad(self, shaft_rad: Floats, scene: Scene) -> Floats:
        """Reading less true angle, (row, n)."""
        ...


def machine_like(wanted_kinds: Sequence[str], site: Site, rng: np.random.Generator) -> list[Defect]:
    """One mechanism of each kind, "any" for any, each of a size drawn from SIZES. ConcealError for unknown ones."""
    out: list[Defect] = []
    for name in wanted_kinds:
        kinds = [kind for kind in SIZES if name in ("any", kind.KIND)]
        if not kinds:
            raise ConcealError(
                f"defect '{name}' has no machine-like size; there are {', '.join(k.KIND for k in SIZES)}"
            )
        kind = kinds[int(rng.integers(len(kinds)))]
        try:
            drawn = _at_another_place(kind, {one.port for one in out}, site, rng)
        except UnsuitedError as reason:
            raise ConcealError(f"{kind.KIND}: {reason}; take another arm, family or seed") from reason
        low, high = SIZES[kind]
        size = float(np.exp(rng.uniform(np.log(low), np.log(high))))
        out.append(with_size(drawn, size * (float(np.sign(drawn.slip_rad)) if isinstance(drawn, SecondSlip) else 1.0)))
    return out


def _at_another_place(kind: type[Any], taken: set[str], site: Site, rng: np.random.Generator) -> Any:
    """One whose place is not taken. UnsuitedError where there is none."""
    for _ in range(DRAW_ROUNDS):
        if (drawn := kind.draw(rng, site)).port not in taken:
            return drawn
    raise UnsuitedError("every joint has one already")


def at_the_flange(defects: Sequence[Defect], side: Side) -> list[Defect]:
    """Those that the arm beyond its encoders has a part in."""
    mine = [d for d in defects if not isinstance(d, ReadsSecond)]
    return [d for d in mine if not isinstance(d, TurnsJoint)] if side == "motor" else mine


def second_readings_rad(
    rig: TrueRig, scene: Scene, defects: Sequence[Defect], side: Side, reading_rad: Floats, rng: np.random.Generator
) -> Floats:
    """(row, n) as recorded: any zero, any sense, whole counts, wrapped to one turn."""
    at_rad = _exact_rad(rig, scene, defects, side, reading_rad)
    n = reading_rad.shape[1]
    zero_rad, sense = rng.uniform(-np.pi, np.pi, n), np.where(rng.random(n) < AGAINST, -1.0, 1.0)
    said = sense * at_rad + zero_rad + NOISE_RAD * rng.standard_normal(at_rad.shape)
    return (np.floor(said / COUNT_RAD) * COUNT_RAD) % (2.0 * np.pi)


def over_noise(rig: TrueRig, scene: Scene, defects: Sequence[Defect], side: Side, reading_rad: Floats) -> float:
    """Rms of what these defects add to the difference of the two encoders that shows it most, over its noise."""
    added_rad = _exact_rad(rig, scene, defects, side, reading_rad) - reading_rad
    return float(added_rad.std(axis=0).max() / np.hypot(NOISE_RAD, COUNT_RAD / 12.0**0.5))


def _exact_rad(rig: TrueRig, scene: Scene, defects: Sequence[Defect], side: Side, reading_rad: Floats) -> Floats:
    """(row, n) without zero, noise and counts."""
    shaft_rad = true_shaft_rad(defects, scene, reading_rad)
    turned_rad = balanced(rig.arm, scene, defects, shaft_rad).joint_rad - rig.arm.zero_rad - shaft_rad
    at_rad = shaft_rad + {"link": 1.0, "motor": -1.0, "beside": 0.0}[side] * turned_rad
    for defect in defects:
        if isinstance(defect, ReadsSecond):
            at_rad = at_rad + defect.second_error_rad(at_rad, scene)
    return at_rad
