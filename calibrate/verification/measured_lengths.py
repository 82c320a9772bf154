"""What a recording holds to verify an arm by: the probe's places, by cone, sphere and bar."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from acquisition.recording import Samples
from acquisition.recording.rig import Rig
from acquisition.recording.samples import BAR, SEAT
from calibrate.errors import DataError
from calibrate.predict import Predictor
from calibrate.sensors.bar import bar_pairs
from calibrate.verification.sphere import LEAST, fitted_sphere

Floats = NDArray[np.float64]
SAME_PLACE_M = 0.05  # of both ends: a bar set up again by hand is nearer to where it was than two positions are apart


@dataclass(frozen=True, eq=False)
class Length:
    """One bar measured once."""

    bar: int
    position: int  # from 1, in order of first use
    calibrated_m: float
    measured_m: float

    @property
    def error_m(self) -> float:
        """Measured less calibrated."""
        return self.measured_m - self.calibrated_m

    @property
    def says(self) -> str:
        return f"bar {self.bar}, position {self.position}"


@dataclass(frozen=True, eq=False)
class Measured:
    """Places of the probe's ball (row, 3) m in the base, by the identified arm."""

    rig: Rig
    seats: Mapping[int, Floats]
    touches: Mapping[tuple[int, int], Floats]  # sphere, series
    lengths: tuple[Length, ...]
    left_out: tuple[str, ...] = ()  # series of touches that show no sphere, and why


def measured(samples: Samples, rig: Rig, predictor: Predictor) -> Measured:
    """Sorted by artefact. DataError where there is none, or one that the rig does not know."""
    tips_m = predictor.tip_m(samples.joints())
    touches, left_out = _round(_touches(samples, rig, tips_m))
    found = Measured(rig, _seats(samples, tips_m), touches, _lengths(samples, rig, tips_m), left_out)
    if not (found.seats or found.touches or found.lengths):
        raise DataError(
            "samples: nothing to verify by; columns of it are seat, bar with bar_end, and sphere with series: "
            "`calibeam session RIG --verify` takes them" + "".join(f"; {why}" for why in left_out)
        )
    return found


def _seats(samples: Samples, tips_m: Floats) -> dict[int, Floats]:
    seat = samples.integers(SEAT, 0)
    return {k: tips_m[seat == k] for k in sorted(set(seat.tolist()) - {0})}


def _touches(samples: Samples, rig: Rig, tips_m: Floats) -> dict[tuple[int, int], Floats]:
    if "sphere" not in samples:
        return {}
    sphere = np.nan_to_num(samples.column("sphere")).astype(np.int64)
    series = np.nan_to_num(samples.column("series")).astype(np.int64) if "series" in samples else np.zeros_like(sphere)
    unknown = set(sphere.tolist()) - {0} - set(rig.spheres)
    if unknown:
        raise DataError(f"samples: sphere {min(unknown)} is not in the rig; add a [[sphere]] with its diameter")
    pairs = sorted({(s, k) for s, k in zip(sphere.tolist(), series.tolist(), strict=True) if s})
    return {(s, k): tips_m[(sphere == s) & (series == k)] for s, k in pairs}


def _round(
    touches: Mapping[tuple[int, int], Floats],
) -> tuple[dict[tuple[int, int], Floats], tuple[str, ...]]:
    """Series without those that are touches enough and yet show no sphere, and sentences of these."""
    good, bad = dict(touches), list[str]()
    for (sphere, series), touches_m in touches.items():
        try:
            if len(touches_m) >= LEAST:
                fitted_sphere(touches_m)
        except DataError as error:
            del good[sphere, series]
            bad.append(f"sphere {sphere}, series {series} left out: {error}")
    return good, tuple(bad)


def _lengths(samples: Samples, rig: Rig, tips_m: Floats) -> tuple[Length, ...]:
    bar = samples.integers(BAR, 0)
    rows = np.flatnonzero(bar)
    if len(rows) == 0:
        return ()
    if "bar_end" not in samples:
        raise DataError("samples: bars without bar_end; add the end (a or b) of each reading")
    unknown = set(bar[rows].tolist()) - set(rig.bars)
    if unknown:
        raise DataError(f"samples: bar {min(unknown)} is not in the rig; add a [[bar]] with its length")
    ends = samples.columns["bar_end"][rows]
    out: list[Length] = []
    stood: list[tuple[int, Floats]] = []
    for a, b in bar_pairs(rows, bar[rows], ends):
        number = int(bar[a])
        ends_m = tips_m[[a, b]]
        apart = [_apart_m(ends_m, other_m) if n == number else np.inf for n, other_m in stood]
        if not apart or min(apart) > SAME_PLACE_M:
            stood.append((number, ends_m))
            apart.append(0.0)
        measured_m = float(np.linalg.norm(tips_m[b] - tips_m[a]))
        out.append(Length(number, int(np.argmin(apart)) + 1, rig.bars[number].length_m, measured_m))
    return tuple(out)


def _apart_m(ends_m: Floats, other_m: Floats) -> float:
    """Of the end that is farther from where it was; a bar put there the other way round stands in the same place."""
    ways = (other_m, other_m[::-1])
    return min(float(np.linalg.norm(ends_m - way, axis=1).max()) for way in ways)
