"""From a session's samples to the witnesses that its columns allow; each wants enough rows to have a say."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from acquisition.recording.columns import ORIENTATION, POSITION, SPOTS
from acquisition.recording.rig_schema import Rig
from acquisition.recording.samples import Samples
from calibrate.blunders import (
    bar_witness,
    orientation_witness,
    position_witness,
    seat_witness,
    spots_witness,
    wire_witness,
)
from calibrate.blunders.bar_witness import BarWitness
from calibrate.blunders.orientation_witness import OrientationWitness
from calibrate.blunders.position_witness import PositionWitness
from calibrate.blunders.seat_witness import SeatWitness
from calibrate.blunders.spots_witness import SpotsWitness
from calibrate.blunders.wire_witness import WireWitness
from calibrate.blunders.witness import Witness, thinned
from calibrate.dual_psd_rig import fixture_of, laser_of

Floats = NDArray[np.float64]
Rows = NDArray[np.intp]
Builder = Callable[[Rig, Samples, Floats], Witness | None]


def witnesses_of(rig: Rig, samples: Samples, q_rad: Floats) -> tuple[Witness, ...]:
    """All that can be heard; `q_rad` (row, joint) of the samples. DataError where spots have no fixture or laser."""
    found = (build(rig, samples, q_rad) for build in BUILDERS)
    return tuple(witness for witness in found if witness is not None)


def _spots(rig: Rig, samples: Samples, q_rad: Floats) -> Witness | None:
    rows = _filled(samples, *SPOTS, "placement", "first_psd")
    place = samples.integers("placement", 0)
    many = [k for k in np.unique(place[rows]) if np.sum(place[rows] == k) >= spots_witness.FEWEST_POSES]
    rows = thinned(rows[np.isin(place[rows], many)])
    if len(rows) == 0:
        return None
    mount, fixture = laser_of(rig), fixture_of(rig)
    return SpotsWitness(
        q_rad[rows],
        _stacked(samples, SPOTS)[rows],
        place[rows],
        samples.integers("first_psd", 0)[rows],
        fixture.T_psd1_psd2,
        fixture.T_base_psd1,
        mount.origin_m,
        mount.direction,
    )


def _position(rig: Rig, samples: Samples, q_rad: Floats) -> Witness | None:
    rows = thinned(_filled(samples, *POSITION))
    if len(rows) < position_witness.FEWEST_POSES:
        return None
    return PositionWitness(q_rad[rows], _stacked(samples, POSITION)[rows], _point(rig))


def _orientation(rig: Rig, samples: Samples, q_rad: Floats) -> Witness | None:
    del rig  # which way the target sits on the flange is found
    rows = thinned(_filled(samples, *POSITION, *ORIENTATION))
    if len(rows) < orientation_witness.FEWEST_POSES:
        return None
    return OrientationWitness(q_rad[rows], _stacked(samples, ORIENTATION)[rows])


def _wire(rig: Rig, samples: Samples, q_rad: Floats) -> Witness | None:
    rows = thinned(_filled(samples, "wire_m"))
    if len(rows) < wire_witness.FEWEST_POSES:
        return None
    drum = None if rig.device is None else np.array(rig.device.origin_m)
    return WireWitness(q_rad[rows], samples.column("wire_m")[rows], _point(rig), drum)


def _seat(rig: Rig, samples: Samples, q_rad: Floats) -> Witness | None:
    rows, seat = _filled(samples, "seat"), samples.integers("seat", 0)
    several = [k for k in np.unique(seat[rows]) if np.sum(seat[rows] == k) > 2]
    rows = rows[np.isin(seat[rows], several)]
    if len(rows) < seat_witness.FEWEST_ROWS + len(several):
        return None
    return SeatWitness(q_rad[rows], seat[rows], _point(rig))


def _bar(rig: Rig, samples: Samples, q_rad: Floats) -> Witness | None:
    """Pairs of neighbouring rows that are ends of one bar; odd rows are told when the instrument is built."""
    rows = _filled(samples, "bar")
    if len(rows) < 2 or "bar_end" not in samples:
        return None
    bar, end = samples.integers("bar", 0)[rows], samples.columns["bar_end"][rows]
    rows, bar = rows[: len(rows) // 2 * 2].reshape(-1, 2), bar[: len(rows) // 2 * 2].reshape(-1, 2)
    pair = (bar[:, 0] == bar[:, 1]) & (end[0 : 2 * len(bar) : 2] != end[1 : 2 * len(bar) : 2])
    pair &= np.isin(bar[:, 0], list(rig.bars))
    kept = thinned(np.flatnonzero(pair))
    if len(kept) < bar_witness.FEWEST_PAIRS:
        return None
    length_m = np.array([rig.bars[int(k)].length_m for k in bar[kept, 0]])
    return BarWitness(q_rad[np.concatenate([rows[kept, 0], rows[kept, 1]])], length_m, _point(rig))


# One line for each instrument.
BUILDERS: tuple[Builder, ...] = (_spots, _position, _orientation, _wire, _seat, _bar)


def _filled(samples: Samples, *names: str) -> Rows:
    """Rows in which all of these columns hold a value; none where a column is absent."""
    if not all(name in samples for name in names):
        return np.zeros(0, dtype=np.intp)
    return np.flatnonzero(np.all(np.isfinite(_stacked(samples, names)), axis=1))


def _stacked(samples: Samples, names: tuple[str, ...]) -> Floats:
    return np.stack([samples.column(name) for name in names], axis=1)


def _point(rig: Rig) -> Floats | None:
    return None if rig.tool.point_m is None else np.array(rig.tool.point_m)
