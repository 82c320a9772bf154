"""Slips: steps in the difference of two readings of one joint that stay, with time and size.

Judged from stand to stand, because between them everything that moves adds to the difference. What may be innocent is
taken along: an error of either reading that depends on the angle (first two orders, Bai and Teo 2002), a slow drift,
the side from which the joint came, and what physics at the joint asks for (`causes_of`): a slip comes last.
The noise is what scatters from stand to stand then. Steps are found one by one, the largest first (binary
segmentation: Vostrikova 1981), each by its F statistic over all places; p from the largest of as many tests.

Physics at the joint is the torque of gravity at the pose (a soft drive), the side from which the joint came (play), and
what the diagnosis of the samples has found there. Each is a column whose size the difference itself decides, so that
nothing depends on which of the two encoders sits where.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import orth
from scipy.special import stdtr

from calibrate.diagnose.search.null import is_slow
from calibrate.diagnose.state.fitted import Fitted
from calibrate.diagnose.streams import limits
from calibrate.diagnose.streams.settling import Stand
from calibrate.diagnose.streams.track import Track, TrackCurve
from calibrate.model.effects.conditions import MOVED_RAD
from calibrate.model.effects.gravity import likely_torque_nm
from calibrate.model.effects.ports import Perturbation
from calibrate.model.sensors.encoder_difference import NAME as ENCODER_DIFFERENCE
from calibrate.model.with_effects.new_poses import carried_over, extended
from calibrate.model.with_effects.ported_chain import perturbed_frames

Floats = NDArray[np.float64]
Causes = Callable[[int, Floats], Floats]  # joint (from 1) and poses (stand, joint) to columns (stand, m)

FLAT = 1e-9  # of a column: rounding


@dataclass(frozen=True)
class Slip:
    """Joint (from 1); the reading of `track` against the other steps by `size`; between the end of one stand and the
    beginning of the next, or within one stand, found to a sample.
    """

    joint: int
    from_s: float
    to_s: float
    size_rad: float
    sigma_rad: float
    p: float


@dataclass(frozen=True)
class Slips:
    """`judged` (joint,): False where stands are too few."""

    found: tuple[Slip, ...]
    judged: tuple[bool, ...]


def slips(track: Track, other: Track, stands: Sequence[Stand], causes: Causes | None = None) -> Slips:
    """Of `track` against `other`, same channels, same clock. Within a stand a step divides it in two.

    `causes`: what else may turn a joint between the two, at any pose; None: unknown.
    """
    track = track.read()
    difference = replace(track, name="difference", values=track.values - other.curve.at(track.time_s)).read()
    at = other.curve
    found: list[Slip] = []
    judged: list[bool] = []
    for j in range(track.channels):
        pieces = _pieces(difference, at, stands, j)
        innocent = _innocent(j, pieces, causes)
        one = _of_joint(track.joint(j), pieces[:, :4], track.channels, innocent)
        judged.append(one is not None)
        found += one or []
    return Slips(tuple(sorted(found, key=lambda slip: slip.from_s)), tuple(judged))


def _pieces(difference: Track, at: TrackCurve, stands: Sequence[Stand], j: int) -> Floats:
    """(stand, 5 + joint): begin, end, mean difference, angle, side that the joint came from, angles of all joints.

    A stand with a jump in it gives two.
    """
    out: list[Floats] = []
    side, joint = 0.0, difference.joint(j) - 1
    for stand in stands:
        side = float(np.sign(stand.moved[joint])) if abs(stand.moved[joint]) > MOVED_RAD else side
        rows = difference.between(stand.from_s + limits.SLIP_EDGE_S, stand.to_s)
        if len(rows.time_s) < 4:
            continue
        d = rows.values[:, j]
        cut = _jump(d)
        for piece in (slice(0, cut), slice(cut, None)) if cut else (slice(None),):
            t = rows.time_s[piece]
            angles = np.nanmean(at.at(t), axis=0)
            out.append(np.array([t[0], t[-1], np.median(d[piece]), angles[j], side, *angles]))
    return np.array(out).reshape(-1, 5 + difference.channels)


def _innocent(j: int, pieces: Floats, causes: Causes | None) -> list[Floats]:
    """Columns (stand,) of unit size that physics may ask for; none where stands are too few."""
    if (
        causes is None
        or len(pieces) < limits.SLIP_SPARE_STANDS + limits.SLIP_PHYSICS_STANDS
        or not np.isfinite(pieces).all()
    ):
        return []
    columns = [pieces[:, 4], *causes(j + 1, pieces[:, 5:]).T]
    centred = [c - c.mean() for c in columns]
    sizes = [float(np.linalg.norm(c)) for c in centred]
    return [c / size for c, size in zip(centred, sizes, strict=True) if size > FLAT * max(1.0, max(sizes))]


def _jump(d: Floats) -> int:
    """Where the two halves of a stand differ by far more than neighbours do; 0: nowhere."""
    n = len(d)
    if n < 12:
        return 0
    cuts = np.arange(4, n - 4)
    total, sums = d.sum(), np.cumsum(d)[cuts - 1]
    apart = np.abs((total - sums) / (n - cuts) - sums / cuts)
    score = apart * np.sqrt(cuts * (n - cuts) / n)
    best = int(cuts[np.argmax(score)])
    inside = np.concatenate([d[:best] - d[:best].mean(), d[best:] - d[best:].mean()])
    return best if score.max() > 8.0 * max(float(inside.std()), 1e-12) else 0


def _of_joint(joint: int, pieces: Floats, joints: int, innocent: Sequence[Floats] = ()) -> list[Slip] | None:
    """None where stands are too few."""
    n = len(pieces)
    if n < limits.SLIP_SPARE_STANDS + 4:
        return None
    q, d, t = pieces[:, 3], pieces[:, 2], pieces[:, 0]
    level = [np.ones(n)]
    if n >= limits.SLIP_SPARE_STANDS + 9 and np.ptp(q) > 0.0:
        level += [np.sin(q), np.cos(q), np.sin(2.0 * q), np.cos(2.0 * q)]
    if n >= limits.SLIP_SPARE_STANDS + 6:
        level.append((t - t.mean()) / max(float(np.ptp(t)), 1e-12))
    level += innocent[: max(0, n - limits.SLIP_SPARE_STANDS - 4 - len(level))]
    return steps_in(joint, pieces, level, d, n * joints)


def steps_in(joint: int, pieces: Floats, level: list[Floats], d: Floats, tests: int) -> list[Slip]:
    """Steps of `d` (piece,) beyond the columns of `level`, largest first. `pieces` (piece, 2 or more): begin, end."""
    places: list[int] = []
    out: dict[int, Slip] = {}
    while len(places) < limits.MOST_SLIPS:
        base = np.stack([*level, *((np.arange(len(d)) >= k).astype(float) for k in places)], axis=1)
        best = _best(base, d, tests)
        if best is None or best[0] in places:
            break
        places.append(best[0])
        out = _sized(joint, pieces, level, d, places, tests)
    return list(out.values())


def _best(base: Floats, d: Floats, tests: int) -> tuple[int, float] | None:
    """First piece after the step, and p; None where no step is significant."""
    U = orth(base)
    residual = d - U @ (U.T @ d)
    n, k = len(d), U.shape[1] + 1
    if n - k < limits.SLIP_SPARE_STANDS - 1:
        return None
    best: tuple[int, float] | None = None
    for place in range(2, n - 1):
        step = (np.arange(n) >= place).astype(float)
        step -= U @ (U.T @ step)
        size = float(step @ step)
        if size < 0.05:
            continue
        value = float(step @ residual) / size
        left = float(np.sum((residual - value * step) ** 2)) / (n - k)
        p = tests * 2.0 * float(stdtr(n - k, -abs(value) / np.sqrt(max(left, 1e-300) / size)))
        if p < limits.SLIP_ALPHA and (best is None or p < best[1]):
            best = place, p
    return best


def _sized(
    joint: int, pieces: Floats, level: list[Floats], d: Floats, places: list[int], tests: int
) -> dict[int, Slip]:
    """All steps together, each with its sigma."""
    n = len(d)
    X = np.stack([*level, *((np.arange(n) >= k).astype(float) for k in places)], axis=1)
    inverse = np.linalg.pinv(X.T @ X)
    values = inverse @ X.T @ d
    left = max(n - X.shape[1], 1)
    variance = float(np.sum((d - X @ values) ** 2)) / left
    out: dict[int, Slip] = {}
    for i, place in enumerate(places):
        at = len(level) + i
        sigma = float(np.sqrt(variance * inverse[at, at]))
        p = min(1.0, tests * 2.0 * float(stdtr(left, -abs(values[at]) / max(sigma, 1e-300))))
        out[place] = Slip(joint, float(pieces[place - 1, 1]), float(pieces[place, 0]), float(values[at]), sigma, p)
    return out


def causes_of(fitted: Fitted) -> Causes:
    """Of a fitted session, at any poses."""
    arm, drivers = fitted.session.arm, fitted.drivers
    values = fitted.geometry[: len(arm.parameters)]

    def columns(joint: int, q_rad: Floats) -> Floats:
        frames = perturbed_frames(arm, values, q_rad, Perturbation.none(len(q_rad), q_rad.shape[1]))
        away = np.abs(q_rad[:, None, :] - drivers.q_rad[None]).max(axis=2)
        there = extended(drivers, q_rad, frames, np.argmin(away, axis=1))
        out = [likely_torque_nm(there, joint)[-len(q_rad) :]]
        for accepted in fitted.accepted:
            term = accepted.term
            mine = term.port.between_encoders or term.port.instrument == ENCODER_DIFFERENCE
            if not mine or term.port.where != f"joint{joint}.angle" or is_slow(term):
                continue
            basis = carried_over(accepted, drivers, there)
            if basis is not None:
                out += list(np.sum(basis, axis=1).T)  # the port's other joints are zero
        return np.stack(out, axis=1)

    return columns
