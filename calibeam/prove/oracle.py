"""The oracle: geometry and exactly the terms of the catalogue that are true, refitted. What a perfect search would get.

It is told places and physics by the opened seal; sizes, and which variant of a term fits best, it finds from the data.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from calibeam.prove.equivalent import same_place
from calibeam.prove.truth import TrueDefect
from calibrate.diagnose.bench import Bench
from calibrate.diagnose.findings import named
from calibrate.diagnose.fitted import Fitted
from calibrate.diagnose.folds import splits_of
from calibrate.diagnose.line_search import refined
from calibrate.diagnose.linearised import Accepted, Unseen
from calibrate.diagnose.schema import FindingRecord
from calibrate.diagnose.score import scores
from calibrate.effects.term import Term
from calibrate.sensors.encoder_difference import NAME as ENCODER_DIFFERENCE

Floats = NDArray[np.float64]
Ints = NDArray[np.intp]

MOST_OF_ONE = 3  # terms for one mechanism
PAYS = 10.0  # of BIC, for a further term of the same mechanism
WILD = 6.0  # sigmas: rows that every method leaves out alike
LENGTHS = 3  # components of a reading that are lengths


@dataclass(frozen=True, eq=False)
class Fold:
    """Unseen samples, and the geometry that was fitted to all others."""

    train: Ints
    test: Ints
    geometry: Fitted  # of `train` alone


def fold_of(state: Fitted, seed: int) -> Fold:
    """The random split of the diagnosis, of a seed of its own. StopIteration never: every session has one."""
    samples = np.unique(state.rows.sample[state.rows.data])
    split = splits_of(state.drivers, samples, np.random.default_rng(seed))[0]
    test = split.unseen[0]
    train = np.setdiff1d(samples, test)
    return Fold(train, test, state.select(train).refitted(()))


def oracle_terms(state: Fitted, defects: Sequence[TrueDefect], family: str) -> tuple[Accepted, ...] | None:
    """The true terms with their sizes. None where the catalogue does not hold one of them.

    A mechanism may take several terms of its kind: a pinion off its axis is felt once and twice a tooth.
    """
    for defect in defects:
        taken = len(state.accepted)
        for _ in range(MOST_OF_ONE):
            fitting = [t for t in state.candidates() if _is_true(t, defect, family)]
            best = _best(state, fitting, 0.0 if len(state.accepted) == taken else PAYS)
            if best is None:
                break
            state = state.refitted((*state.accepted, best))
        if len(state.accepted) == taken:
            return None
    return state.accepted


def said_terms(state: Fitted, findings: Sequence[FindingRecord]) -> tuple[Accepted, ...] | None:
    """The terms behind the findings of a file, fitted anew. None where one of them cannot be told from its words."""
    for finding in findings:
        best = _best(state, [t for t in state.candidates() if _is_said(t, finding)], 0.0)
        if best is None:
            return None
        state = state.refitted((*state.accepted, best))
    return state.accepted


def _best(state: Fitted, fitting: Sequence[Term], least: float) -> Accepted | None:
    """The one that explains most of what is left; None where none is better than `least` of BIC, or seen at all."""
    taken = {a.term.key for a in state.accepted}
    bench = Bench(state)
    menu = bench.menu_of(tuple(t for t in fitting if t.key not in taken))
    if not menu.entries:
        return None
    gain = scores(menu).gain
    entry = int(np.argmax(gain))
    if not np.isfinite(gain[entry]) or (least > 0.0 and gain[entry] < least):
        return None
    return refined(bench, menu.terms[menu.entries[entry].term], menu.entries[entry].inner)


def _is_true(term: Term, defect: TrueDefect, family: str) -> bool:
    same = same_place(defect.port, term.port.where, family) is not None
    return same and not term.open and term.physics == defect.physics


def _is_said(term: Term, finding: FindingRecord) -> bool:
    name = named(term)
    said = (finding.where, finding.depends_on, finding.shape, finding.order, finding.physics)
    return (name.where, ",".join(name.depends_on), name.shape, name.order, name.physics) == said


def misfit_m(unseen: Sequence[Unseen], wild: NDArray[np.bool_] | None = None) -> Floats:
    """(reading,) lengths that a model misses on unseen samples, wild ones left out."""
    lengths = [u.misfit for u in unseen if u.instrument != ENCODER_DIFFERENCE]
    parts = [misfit[:, :LENGTHS] if misfit.shape[1] > 4 else misfit for misfit in lengths]
    flat = np.concatenate([p.ravel() for p in parts])
    return flat if wild is None else flat[~wild]


def wild_of(misfit: Floats) -> NDArray[np.bool_]:
    """(reading,) by the spread of the best model, for all methods alike."""
    return np.abs(misfit) > WILD * float(np.median(np.abs(misfit))) / 0.6745


def rms_m(misfit: Floats) -> float:
    return float(np.sqrt(np.mean(misfit**2)))
