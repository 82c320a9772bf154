"""From accepted terms to findings: sizes with sigmas, share, rivals, picture, and one finding for one cause."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from calibrate.diagnose.bench import Bench
from calibrate.diagnose.diagnosis import UNKNOWN, Finding, Named, Pulled, RivalName
from calibrate.diagnose.linearised import Accepted
from calibrate.diagnose.noise_law import curvature_of
from calibrate.diagnose.picture_driver import picture_driver
from calibrate.diagnose.rivals import Rival, confidences
from calibrate.diagnose.score import gain_of
from calibrate.diagnose.search import Search
from calibrate.effects.term import Size, Term

Floats = NDArray[np.float64]

NOT_FINAL = 0.5
LEVERAGE = 0.9  # rows that the model follows closer say nothing about the noise
INNER_STEP = 1e-3  # of the range of an inner parameter, for its difference quotient


def named(term: Term) -> Named:
    return Named(term.port.where, term.depends_on, term.shape.value, term.order, UNKNOWN if term.open else term.physics)


def findings_of(
    at: Search, rivals: Sequence[Sequence[Rival]], predicts: Floats, final: bool = True
) -> tuple[Finding, ...]:
    """Largest first. `rivals` of each term; `predicts` (term,) as calibrate/diagnose/cross_validation.py gives it.

    `final`: no structure is left without a name; while some is, no name of physics is more likely than not.
    """
    found = [_finding(at, i, rivals[i], float(predicts[i])) for i in range(len(at.state.accepted))]
    if not final:
        found = [f if f.name.physics == UNKNOWN else replace(f, confidence=NOT_FINAL * f.confidence) for f in found]
    return tuple(sorted(_one_for_one_cause(found), key=lambda f: -f.share))


def sizes_of(bench: Bench, i: int) -> dict[str, Size]:
    """Of accepted term i, everything else refitted along."""
    a = bench.state.accepted[i]
    slopes = [bench.state.columns(a.term, a.inner)]
    smooth = [j for j, spec in enumerate(a.term.inner) if not spec.discrete]
    slopes += [_by_inner(bench, a, j)[:, None] for j in smooth]
    covariance = _covariance(bench, bench.gone[i].span @ (bench.gone[i].span.T @ np.concatenate(slopes, axis=1)))
    m = len(a.coefficients)
    inner_sigma = np.zeros(len(a.inner))
    inner_sigma[smooth] = np.sqrt(np.maximum(np.diag(covariance)[m:], 0.0))
    return dict(a.term.sizes(a.coefficients, covariance[:m, :m], a.inner, inner_sigma))


def _covariance(bench: Bench, columns: Floats) -> Floats:
    """Of values with columns (row, m) that nothing else can stand in for, by what the residuals really scatter.

    Weights follow the residuals, so least squares under them is too sure of itself. Source: Huber, The behavior of
    maximum likelihood estimates under nonstandard conditions, Proc. 5th Berkeley Symp. 1, 1967 (the sandwich), whole
    observations together, residuals corrected for leverage.
    """
    rows, data = bench.state.rows, bench.state.rows.data
    size = np.maximum(np.linalg.norm(columns, axis=0), 1e-300)
    unit = columns / size
    leverage = np.minimum(np.sum(bench.sight.basis**2, axis=1), LEVERAGE)
    met = unit * (bench.sight.residual / np.sqrt(1.0 - leverage))[:, None]
    _, group = np.unique(rows.group[data], return_inverse=True)
    each = np.zeros((int(group.max()) + 1, columns.shape[1]))
    np.add.at(each, group, met[data])
    inverse = np.linalg.pinv(unit.T @ unit * curvature_of(rows), rcond=1e-10, hermitian=True)
    found = inverse @ (each.T @ each + unit[~data].T @ unit[~data]) @ inverse
    return np.asarray(found / np.outer(size, size), dtype=np.float64)


def _finding(at: Search, i: int, rivals: Sequence[Rival], predicts: float) -> Finding:
    bench, a = at.bench, at.state.accepted[i]
    belief = confidences(rivals)
    same = np.array(
        [True, *(r.term.port.where == a.term.port.where and r.term.physics == a.term.physics for r in rivals)]
    )
    explained = sum(gone.squares for gone in bench.gone)
    sizes = sizes_of(bench, i)
    p = at.p.get(a.term.key, 0.0)
    return Finding(
        name=named(a.term),
        parameters=sizes,
        share=bench.gone[i].squares / max(explained, 1e-300),
        confidence=float(belief[same].sum()) * (1.0 - p),
        p=p,
        gain=gain_of(bench.gone[i], bench.sight),
        predicts=predicts,
        says=a.term.says(sizes),
        rivals=tuple(_rival(r, float(b)) for r, b, own in zip(rivals, belief[1:], same[1:], strict=True) if not own),
        pulled=_pulled(bench, a),
    )


def _rival(rival: Rival, belief: float) -> RivalName:
    return RivalName(named(rival.term), belief, rival.margin, rival.refitted)


def _one_for_one_cause(found: Sequence[Finding]) -> list[Finding]:
    """An unknown cause at a port takes along what was named there on the same drivers: its leftovers."""
    unknown = [f for f in found if f.name.physics == UNKNOWN]
    kept = [f for f in found if f.name.physics == UNKNOWN or not any(_leftover(f, u) for u in unknown)]
    return kept


def _leftover(finding: Finding, unknown: Finding) -> bool:
    return finding.name.where == unknown.name.where and set(finding.name.depends_on) <= set(unknown.name.depends_on)


def _by_inner(bench: Bench, a: Accepted, j: int) -> Floats:
    spec = a.term.inner[j]
    step = np.zeros(len(a.inner))
    step[j] = INNER_STEP * (spec.upper - spec.lower)
    up, down = bench.state.columns(a.term, a.inner + step), bench.state.columns(a.term, a.inner - step)
    return (up - down) @ a.coefficients / (2.0 * step[j])


def _pulled(bench: Bench, a: Accepted) -> Pulled:
    """Along the component of the port where the finding is largest."""
    drivers, rows = bench.state.drivers, bench.state.rows
    driver, values = picture_driver(drivers, a.term.depends_on)
    amount = a.term.amount(drivers, a.coefficients, a.inner)
    component = int(np.argmax(np.mean(amount**2, axis=0)))
    along = amount[:, component]
    # Rows felt per unit of the amount: the contribution itself over its amount, where there is any.
    felt = bench.contribution(a)
    sample = rows.sample[rows.data]
    strength = np.bincount(sample, felt[rows.data] ** 2, len(along))
    met = np.bincount(sample, felt[rows.data] * (rows.residual + felt)[rows.data], len(along))
    share = np.full(len(along), np.nan)
    np.divide(met, strength, out=share, where=strength > 1e-6 * max(float(strength.max()), 1e-300))
    return Pulled(driver, values, share * along, along)
