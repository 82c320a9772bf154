"""A second encoder at every joint of a concealed session: what it reads, and mechanisms of machine-like size.

Where both encoders sit decides who sees the drive. "link": the controller reads the motor's side, the second encoder
the link's. "motor": the controller reads the link's side, so that the drive gives way inside its loop and the flange
knows nothing of it. "beside": both read the motor's side, and only the flange shows the drive.
"""

from collections.abc import Sequence
from typing import Any, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from simulators.conceal.chain import balanced, true_shaft_rad
from simulators.conceal.rig import TrueRig
from simulators.conceal.wanted import ConcealError, Side
from simulators.defects import Defect, Scene, Site, UnsuitedError
from simulators.defects.defect import TurnsJoint, with_size
from simulators.defects.drive import SlackDrive, SoftJoint
from simulators.defects.encoder import RADIUS_M, EccentricDisc, SecondDisc, SecondSlip

Floats = NDArray[np.float64]
COUNT_RAD = 2.0 * np.pi / (1 << 20)
NOISE_RAD = 2e-6  # one sigma: bearings of the encoder, and gears that seat anew
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
    """One mechanism of each kind, "any" for any, each of a size as drawn from SIZES. ConcealError for unknown ones."""
    out: list[Defect] = []
    for name in wanted_kinds:
        kinds = [kind for kind in SIZES if name in ("any", kind.KIND)]
        if not kinds:
            raise ConcealError(
                f"defect '{name}' has no machine-like size; there are {', '.join(k.KIND for k in SIZES)}"
            )
        kind = kinds[int(rng.integers(len(kinds)))]
        try:
            drawn = kind.draw(rng, site)
        except UnsuitedError as reason:
            raise ConcealError(f"{kind.KIND}: {reason}; take another arm, family or seed") from reason
        low, high = SIZES[kind]
        size = float(np.exp(rng.uniform(np.log(low), np.log(high))))
        out.append(with_size(drawn, size * (float(np.sign(drawn.slip_rad)) if isinstance(drawn, SecondSlip) else 1.0)))
    return out


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
