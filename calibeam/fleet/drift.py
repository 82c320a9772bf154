"""Which joint zeros of which robots drift: a robust line over the dates, and what it is worth among so many.

Line: least Huber loss (threshold 1.345: 95 % efficiency in normal noise) of the zeros in units of their own sigma;
where they scatter by more than that, the scale grows with them by Huber's proposal 2, and his covariance with its
correction for few points gives the amount (Huber, Robust Statistics, 1981, ch. 7.6 to 7.8).

A few points hardly show what their sigmas are worth. So, first, all zeros of the fleet together do: the median of
their scatter, where it is more than stated, widens all sigmas. Then a sigma is uncertain by a quarter of itself, which
is worth 8 degrees of freedom (JCGM 100:2008, G.4.2), and the scatter about the line is weighed against it by its own;
Student's law gets the sum of both.

Many robots times many joints are many chances: p-values are held against each other by Holm's procedure (Scand. J.
Stat. 6, 1979), so that of a hundred fleets in which nothing drifts at most five show any drift at all.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime

import numpy as np
from numpy.typing import NDArray
from scipy import special

from calibeam.fleet.row import Row

Floats = NDArray[np.float64]

YEAR_S = 365.25 * 86400.0


@dataclass(frozen=True)
class Series:
    """Zeros of one joint of one robot, gathered from the rows of a fleet, in the order of time."""

    robot: str
    joint: int
    year: Floats  # (date,) years since 1970
    zero_rad: Floats  # (date,) drawn and correction together, less than half a turn from one date to the next
    sigma_rad: Floats  # (date,)

    @property
    def dates(self) -> int:
        """Different ones."""
        return len(set(self.year.tolist()))


def all_series(rows: Iterable[Row]) -> tuple[Series, ...]:
    """Of every robot and joint with a date and a zero; of copies of one recording the first, and none of no trust."""
    found: dict[tuple[str, int], list[tuple[float, float, float]]] = {}
    seen: set[str] = set()
    for row in rows:
        year = year_of(row.started_utc)
        if not row.good or row.trust == "no" or year is None or row.sha256 in seen:
            continue
        seen.add(row.sha256)
        for zero in row.zeros:
            if zero.value_rad is not None and zero.sigma_rad:
                found.setdefault((row.robot, zero.joint), []).append(
                    (year, zero.drawn_rad + zero.value_rad, zero.sigma_rad)
                )
    return tuple(_series(robot, joint, points) for (robot, joint), points in sorted(found.items()))


def _series(robot: str, joint: int, points: Iterable[tuple[float, float, float]]) -> Series:
    year, zero_rad, sigma_rad = np.array(sorted(points)).T
    return Series(robot, joint, year, np.unwrap(zero_rad), sigma_rad)


def year_of(started_utc: str) -> float | None:
    """Years since 1970, None for what is no ISO date."""
    try:
        started = datetime.fromisoformat(started_utc)
    except ValueError:
        return None
    return (started if started.tzinfo else started.replace(tzinfo=UTC)).timestamp() / YEAR_S


FEWEST = 3  # dates: two always lie on a line
FAMILY = 0.05  # chance that a fleet without drift shows one
HUBER = 1.345
NORMAL = 0.7102  # mean square of normal noise cut at HUBER
PRIOR_DOF = 8.0  # degrees of freedom of a sigma that is known to a quarter of itself
TURNS = 100  # of reweighting; a dozen settle
SETTLED = 1e-9  # of a weight


@dataclass(frozen=True)
class Drift:
    """A line through a series; `significant` among all series of the fleet."""

    series: Series
    slope_rad_year: float
    sigma_rad_year: float
    low_rad_year: float  # 95 % of this line alone
    high_rad_year: float
    zero_rad: float  # of the line at the first date
    p: float
    significant: bool = False

    @property
    def change_rad(self) -> float:
        """By the line, from the first date to the last."""
        return self.slope_rad_year * float(np.ptp(self.series.year))

    def line_rad(self, year: Floats) -> Floats:
        """The line at these times."""
        return self.zero_rad + self.slope_rad_year * (year - self.series.year.min())


@dataclass(frozen=True)
class Drifts:
    """Lines of all series with enough dates, the clearest first, and by what all their sigmas were widened."""

    lines: tuple[Drift, ...]
    scatter: float


def find_drifts(rows: Iterable[Row]) -> Drifts:
    """Of a fleet."""
    return find_drifts_in([series for series in all_series(rows) if series.dates >= FEWEST])


def find_drifts_in(found: Sequence[Series]) -> Drifts:
    """Of series with FEWEST different dates or more."""
    scatter = common_scatter(found)
    lines = [fit_line(series, scatter) for series in found]
    significant = holm([one.p for one in lines])
    judged = [replace(one, significant=said) for one, said in zip(lines, significant, strict=True)]
    return Drifts(tuple(sorted(judged, key=lambda one: one.p)), scatter)


def common_scatter(found: Sequence[Series]) -> float:
    """Scatter about plain lines over the sigmas: the median of all series, at least 1."""
    ratio: list[float] = []
    for series in found:
        design, wanted = _whitened(series, 1.0)
        left = wanted - design @ np.linalg.lstsq(design, wanted, rcond=None)[0]
        ratio.append(float(left @ left) / float(special.chdtri(len(wanted) - 2, 0.5)))
    return max(1.0, float(np.sqrt(np.median(ratio)))) if ratio else 1.0


def fit_line(series: Series, scatter: float = 1.0) -> Drift:
    """The robust line through a series of three dates or more; its sigmas are taken `scatter` times."""
    n, middle = len(series.year), float(series.year.mean())
    design, wanted = _whitened(series, scatter)
    dof = n - 2
    theta, weight = _huber(design, wanted, dof)
    inner = float(np.mean(weight >= 1.0))  # share of points within the threshold
    spread = float(np.sum((weight * (wanted - design @ theta)) ** 2)) / dof
    spread *= ((1.0 + 2.0 / n * (1.0 - inner) / inner) / inner) ** 2 if inner else np.inf
    widened = max(1.0, (PRIOR_DOF + dof * spread) / (PRIOR_DOF + dof))
    sigma = float(np.sqrt(widened * np.linalg.inv(design.T @ design)[1, 1]))
    slope, reach = float(theta[1]), float(special.stdtrit(PRIOR_DOF + dof, 0.975)) * sigma
    p = 2.0 * float(special.stdtr(PRIOR_DOF + dof, -abs(slope) / sigma))
    first = float(theta[0] + theta[1] * (series.year.min() - middle))
    return Drift(series, slope, sigma, slope - reach, slope + reach, first, p)


def _huber(design: Floats, wanted: Floats, dof: int) -> tuple[Floats, Floats]:
    """Values (2,) and weights (date,) of the least Huber loss, at scale 1 or more, by reweighting."""
    weight, theta = np.ones(len(wanted)), np.zeros(2)
    for _ in range(TURNS):
        root = np.sqrt(weight)
        theta = np.asarray(np.linalg.lstsq(design * root[:, None], wanted * root, rcond=None)[0], dtype=np.float64)
        off = np.abs(wanted - design @ theta)
        scale = max(1.0, float(np.sqrt(np.sum((weight * off) ** 2) / (dof * NORMAL))))
        before, weight = weight, HUBER * scale / np.maximum(off, HUBER * scale)
        if np.allclose(before, weight, rtol=0.0, atol=SETTLED):
            break
    return theta, weight


def _whitened(series: Series, scatter: float) -> tuple[Floats, Floats]:
    """Offset and slope about the mean date (date, 2), and the zeros (date,), in units of sigma."""
    sigma = scatter * series.sigma_rad
    design = np.column_stack([np.ones_like(series.year), series.year - series.year.mean()])
    return design / sigma[:, None], series.zero_rad / sigma


def holm(p: Sequence[float], family: float = FAMILY) -> list[bool]:
    """Which of these are significant, so that the chance of any false one is at most `family`."""
    order = np.argsort(p)
    said = [False] * len(p)
    for rank, index in enumerate(order.tolist()):
        if p[index] > family / (len(p) - rank):
            break
        said[index] = True
    return said
