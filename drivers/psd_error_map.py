"""The error map of one detector face: what it shows against where the spot truly was.

    x = x0 + gx u + cx v + px u v^2 + qx u^3        u, v the spot as shown (m) over h, half the face's length
    y = y0 + gy v + cy u + py v u^2 + qy v^3        all coefficients in metres

g is gain, c cross-talk of the axes, p and q the odd cubic terms of a cushion or barrel: a face that is symmetric about
both axes has no others up to the third order. Size to expect: Hamamatsu, S1880 and S2044 data sheets, 40 to 150 µm.
"""

import json
from dataclasses import asdict, dataclass
from enum import Enum
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]
TERMS = ("offset", "gain", "cross", "cushion", "cubic")
RANK_LIMIT = 1e-2  # of singular values of scaled columns: a grid of 4 x 4 points has 0.12, one of 3 x 3 none: u^3 = u
LEAST, MOST = 1e-9, 1e3  # m: no face is smaller than a nanometre or larger than a kilometre
FORMAT = "calibeam-psd-error-map-1"
LARGEST_BYTES = 1_000_000  # a map has a thousand; what is parsed takes many times its size


class MapStatus(Enum):
    """Why there is a map, or none."""

    GOOD = "good"
    TOO_FEW_POINTS = "too few points: each axis has 5 coefficients, and a sigma needs one point more"
    RANK_DEFICIENT = "the points do not determine all coefficients: spread them over the face, at least 4 by 4"


@dataclass(frozen=True)
class ErrorMap:
    """A measured map. Spots beyond `reach` (half lengths, of the points it was measured at) are not corrected: NaN."""

    half_length_m: float
    x_m: tuple[float, ...]  # coefficients in the order of TERMS
    y_m: tuple[float, ...]
    x_sigma_m: tuple[float, ...]
    y_sigma_m: tuple[float, ...]
    reach: float

    def __post_init__(self) -> None:
        rows = (self.x_m, self.y_m, self.x_sigma_m, self.y_sigma_m)
        sizes_ok = all(LEAST <= size <= MOST for size in (self.half_length_m, self.reach))
        if not sizes_ok or any(len(row) != len(TERMS) for row in rows):
            raise ValueError(
                f"error map: half length {self.half_length_m:g} m, reach {self.reach:g}; lengths from {LEAST:g} to "
                f"{MOST:g} and {len(TERMS)} coefficients an axis are needed"
            )
        if not all(abs(value) <= MOST for row in rows for value in row):
            raise ValueError(f"error map: a coefficient beyond {MOST:g} m")

    def correct(self, x_m: ArrayLike, y_m: ArrayLike) -> tuple[Floats, Floats]:
        """Where the spot truly is, for spots as shown, of any one shape."""
        u, v = (np.asarray(each, dtype=np.float64) / self.half_length_m for each in (x_m, y_m))
        known = (np.abs(u) <= self.reach) & (np.abs(v) <= self.reach)
        true_x, true_y = _columns(u, v) @ np.array(self.x_m), _columns(v, u) @ np.array(self.y_m)
        return np.where(known, true_x, np.nan), np.where(known, true_y, np.nan)

    def text(self) -> str:
        """The content of its file."""
        return json.dumps({"format": FORMAT, **asdict(self)}, indent=1) + "\n"

    @staticmethod
    def load(path: Path) -> "ErrorMap":
        """ValueError naming the file when it is not an error map; OSError when it cannot be read."""
        try:
            with path.open("rb") as file:
                data = file.read(LARGEST_BYTES + 1)
            if len(data) > LARGEST_BYTES:
                raise ValueError(f"larger than {LARGEST_BYTES / 1e6:g} MB")
            held: Any = json.loads(data.decode("utf-8"))
            if held.pop("format") != FORMAT:
                raise ValueError("another format")
            rows = {name: tuple(map(float, held.pop(name))) for name in ("x_m", "y_m", "x_sigma_m", "y_sigma_m")}
            return ErrorMap(float(held["half_length_m"]), **rows, reach=float(held["reach"]))
        except (ValueError, KeyError, TypeError, AttributeError, OverflowError, RecursionError) as cause:
            why = str(cause)[:120]
            raise ValueError(f"{path}: no error map of format {FORMAT} ({why}); measure one") from cause


@dataclass(frozen=True)
class MapFit:
    """A map, or why there is none; root mean square distances of the points before and after correction."""

    status: MapStatus
    map: ErrorMap | None
    before_m: float
    after_m: float


def fit_error_map(true_m: ArrayLike, shown_m: ArrayLike, half_length_m: float) -> MapFit:
    """Least squares over points (point, 2): where the spot was, and what the face showed.

    Sigmas are of the coefficients from the scatter of the points, s^2 = r.r / (n - 5) for each axis.
    """
    true, shown = np.asarray(true_m, dtype=np.float64), np.asarray(shown_m, dtype=np.float64)
    if true.ndim != 2 or true.shape[1] != 2 or true.shape != shown.shape:
        raise ValueError(f"points of shapes {true.shape} and {shown.shape}; give (point, 2) of both")
    if not (np.isfinite(true).all() and np.isfinite(shown).all()):
        raise ValueError("points that are not numbers; leave out those without light")
    before_m = _rms(shown - true) if len(true) else float("nan")
    if len(true) <= len(TERMS):
        return MapFit(MapStatus.TOO_FEW_POINTS, None, before_m, float("nan"))
    u, v = (shown / half_length_m).T
    x, y = _axis(_columns(u, v), true[:, 0]), _axis(_columns(v, u), true[:, 1])
    if x is None or y is None:
        return MapFit(MapStatus.RANK_DEFICIENT, None, before_m, float("nan"))
    reach = float(np.max(np.abs(shown))) / half_length_m * (1.0 + 1e-9)
    found = ErrorMap(half_length_m, x[0], y[0], x[1], y[1], reach)
    after_m = _rms(np.stack(found.correct(*shown.T), axis=1) - true)
    return MapFit(MapStatus.GOOD, found, before_m, after_m)


def _columns(along: Floats, across: Floats) -> Floats:
    return np.stack([np.ones_like(along), along, across, along * across**2, along**3], axis=-1)


def _axis(columns: Floats, true_m: Floats) -> tuple[tuple[float, ...], tuple[float, ...]] | None:
    size = np.linalg.norm(columns, axis=0)
    if not (size > 0.0).all():
        return None
    left, singular, right = np.linalg.svd(columns / size, full_matrices=False)
    if singular[-1] < RANK_LIMIT * singular[0]:
        return None
    found = (right.T @ ((left.T @ true_m) / singular)) / size
    residual = true_m - columns @ found
    variance = residual @ residual / (len(true_m) - len(found))
    sigma = np.sqrt(variance * np.sum((right.T / singular) ** 2, axis=1)) / size
    return tuple(map(float, found)), tuple(map(float, sigma))


def _rms(miss_m: Floats) -> float:
    return float(np.sqrt(np.mean(np.sum(miss_m**2, axis=1))))
