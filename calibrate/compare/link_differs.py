"""Whether a link of the chain parts: its own difference against the noise that both sessions may have.

A difference against its own scatter, whatever noise was assumed: means that are not zero, rows that hang together.

Mean: Student's t. Neighbours: von Neumann's ratio of mean square successive difference to variance (Ann. Math.
Stat. 12, 1941) with its normal limit; noise of one sample knows nothing of the sample before.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2, norm
from scipy.stats import t as student

from acquisition.recording import Samples
from acquisition.recording.rig import Rig
from acquisition.recording.samples import SPOTS
from calibrate.compare.chain import (
    READINGS,
    Difference,
    Pair,
    columns_of,
)
from calibrate.model.predict import Predictor
from calibrate.model.sensors import bar
from calibrate.model.sensors.catalogue import SENSORS

Floats = NDArray[np.float64]

FEWEST_ROWS = 12  # rows of a channel


def scatter_of(own: Floats) -> Floats:
    """(channel,) sigma of a row from its neighbours: slow differences do not count; NaN for too few."""
    return np.array([_scatter(c[np.isfinite(c)]) for c in own.T])


def chance_of_structure(own: Floats) -> float:
    """Of white noise of any size looking like this in any channel; 1 where rows are too few."""
    each = [_chance(channel[np.isfinite(channel)]) for channel in own.T]
    return float(min(1.0, len(each) * min(each, default=1.0)))


def _scatter(x: Floats) -> float:
    return float(np.sqrt(0.5 * np.mean(np.diff(x) ** 2))) if len(x) > 1 else float("nan")


def _chance(x: Floats) -> float:
    n = len(x)
    if n < FEWEST_ROWS:
        return 1.0
    spread = float(x.std(ddof=1))
    if spread <= 1e-12 * float(np.max(np.abs(x))):
        return 0.0 if np.any(x != 0.0) else 1.0  # one and the same difference in every row
    mean = 2.0 * float(student.sf(abs(float(x.mean())) / spread * np.sqrt(n), n - 1))
    ratio = float(np.sum(np.diff(x) ** 2)) / float(np.sum((x - x.mean()) ** 2))
    below = (2.0 - ratio) / np.sqrt(4.0 * (n - 2) / (n**2 - 1))
    return 2.0 * min(mean, float(norm.sf(below)), 0.5)


ALARM = 1e-3  # over all links
FEWEST = 10  # of degrees of freedom of repeats
SMALLEST = float(np.finfo(float).tiny)  # no probability is zero
ROUNDING = 1e-9  # rad or m: below, two files of one number
COMMAND = "command"
JOINTS = (COMMAND, "joints", "encoders")  # links that are angles of every joint
NUDGE_RAD = 1e-6  # of a joint, for its lever on the readings


@dataclass(frozen=True)
class JudgedLink:
    """One link over the matched samples, judged; `own`: without what the links in front explain. Times are those of
    the measured samples.
    """

    link: str
    unit: str
    rows: int
    rms_raw: float
    rms_own: float
    largest_own: float
    largest_column: str
    largest_t_s: float
    noise: float | None  # one sigma of a difference; None: unknown
    noise_from: str
    p: float | None
    parts: bool
    first_t_s: float | None  # from where it is beyond its noise
    mean_own: tuple[float, ...]
    scatter: float  # from row to row: the noise that was found


def judged(differences: tuple[Difference, ...], model: Predictor, pair: Pair) -> tuple[JudgedLink, ...]:
    """In the order of the chain."""
    sent = any(one.link == COMMAND for one in differences)
    each = (_judged(one, model, pair, len(differences)) for one in differences)
    return tuple(_as_input(one) if one.link == "joints" and not sent else one for one in each)


def _as_input(one: JudgedLink) -> JudgedLink:
    """Without set-points the joints are where each arm stood, which the links behind them take into account."""
    return replace(one, parts=False, first_t_s=None)


def _judged(one: Difference, model: Predictor, pair: Pair, links: int) -> JudgedLink:
    own, good, t_s = one.own, np.isfinite(one.own), pair[0].column("t_s")
    sigma, where = _noise(one, model, pair)
    at_row, at_channel = np.unravel_index(int(np.nanargmax(np.abs(own))), own.shape)
    largest = float(np.abs(own[at_row, at_channel]))
    p, first = None, None
    if one.link == COMMAND:  # where each was sent, a servo's corrections included: what follows is asked of the links
        beyond, parts = np.zeros(own.shape, dtype=bool), False
    elif sigma is None:
        p = max(min(1.0, links * chance_of_structure(own)), SMALLEST)
        beyond, parts = np.abs(own) > 4.0 * scatter_of(own), p < ALARM and largest > ROUNDING
    else:
        p = min(1.0, links * float(chi2.sf(float(np.nansum((own / sigma) ** 2)), int(good.sum()))))
        p = min(p, links * _in_means(own, sigma, good))
        p = max(min(p, links * chance_of_structure(own)), SMALLEST)
        parts = p < ALARM and largest > ROUNDING
        beyond = np.abs(own) > 4.0 * sigma
    if parts:
        rows = np.flatnonzero(np.any(beyond & good, axis=1))
        first = float(t_s[rows[0] if len(rows) else np.flatnonzero(good.any(axis=1))[0]])
    scatter = scatter_of(own)
    scatter = scatter[np.isfinite(scatter)]
    return JudgedLink(
        one.link,
        one.unit,
        int(good.any(axis=1).sum()),
        float(np.sqrt(np.nanmean(one.raw**2))),
        float(np.sqrt(np.nanmean(own**2))),
        largest,
        one.names[int(at_channel)],
        float(t_s[at_row]),
        None if sigma is None else float(np.median(sigma[good])),
        where,
        p,
        parts,
        first,
        tuple(float(v) for v in np.nanmean(own, axis=0)),
        float(np.median(scatter)) if len(scatter) else 0.0,
    )


def _in_means(own: Floats, sigma: Floats, good: NDArray[np.bool_]) -> float:
    """Chance of the channels' means: a small shift of all rows that no single row shows."""
    count = good.sum(axis=0)
    seen = count > 0
    mean = np.nansum(own, axis=0)[seen] / count[seen]
    of_mean = np.sqrt(np.nansum(np.where(good, sigma, 0.0) ** 2, axis=0)[seen]) / count[seen]
    return float(chi2.sf(float(np.sum((mean / of_mean) ** 2)), int(seen.sum())))


def _noise(one: Difference, model: Predictor, pair: Pair) -> tuple[Floats | None, str]:
    """(row, channel) sigma of a difference, and where it is from."""
    repeats = _from_repeats(one, pair)
    if repeats is not None:
        return np.broadcast_to(repeats, one.own.shape), "repeated poses"
    joint = _joint_noise(model.rig, pair[0].n_joints)
    if one.link in JOINTS:
        if one.link == COMMAND:
            return None, "a set-point has none"
        return np.broadcast_to(np.sqrt(2.0) * joint, one.own.shape), "assumed, and one count of the encoders"
    noise = model.rig.noise
    stated_m = {"spots": noise.psd_m, **{k.name: getattr(noise, k.noise[0].key, None) for k in SENSORS}}
    ends_m = None if noise.seat_m is None else np.sqrt(2.0) * noise.seat_m
    assumed = ends_m if one.link == bar.KIND.name else stated_m.get(one.link)
    if assumed is None and one.link == "spots":
        stated = _stated(pair)
        if stated is not None:
            return stated, "scatter within the samples"
    if assumed is None:
        return None, "unknown"
    return np.sqrt(2.0) * np.hypot(assumed, _through_joints(one, model, pair)), "assumed, of reading and joints"


def _through_joints(one: Difference, model: Predictor, pair: Pair) -> Floats:
    """(row, channel) what the joints' assumed noise does to a reading, by differences of the model."""
    joint = _joint_noise(model.rig, pair[0].n_joints)
    explained = next(reading.by_joints for reading in READINGS if reading.link == one.link)
    total = np.zeros(one.own.shape)
    for j, sigma in enumerate(joint):
        name = f"q{j + 1}_rad"
        nudged = columns_of(pair[1], {name: pair[1].column(name) + NUDGE_RAD})
        total += (sigma * explained(model, (nudged, pair[1])) / NUDGE_RAD) ** 2
    return np.sqrt(np.nan_to_num(total))


def _joint_noise(rig: Rig, joints: int) -> Floats:
    counts = [joint.encoder_counts for joint in rig.arm.joints]
    count = np.array([2.0 * np.pi / c / np.sqrt(12.0) if c else 1e-7 for c in counts[:joints]])
    return np.hypot(count, rig.noise.joint_rad or 0.0)


def _stated(pair: Pair) -> Floats | None:
    names = [name.removesuffix("_m") + "_sigma_m" for name in SPOTS]
    if not all(name in samples for samples in pair for name in names):
        return None
    both = [np.stack([samples.column(name) for name in names], axis=1) for samples in pair]
    sigma = np.hypot(*both)
    return np.where(sigma > 0.0, sigma, np.nan)


def _from_repeats(one: Difference, pair: Pair) -> Floats | None:
    """(channel,) scatter of the own difference within groups of repeats; None for too few."""
    group = _groups(pair[0])
    squares, freedom = np.zeros(one.own.shape[1]), 0
    for label in np.unique(group[group >= 0]):
        rows = one.own[(group == label) & np.all(np.isfinite(one.own), axis=1)]
        if len(rows) > 1:
            squares += np.sum((rows - rows.mean(axis=0)) ** 2, axis=0)
            freedom += len(rows) - 1
    return np.sqrt(squares / freedom) if freedom >= FEWEST and np.all(squares > 0.0) else None


def _groups(samples: Samples) -> NDArray[np.int64]:
    return samples.integers("repeat", -1)
