"""The oracle and other methods on the unseen samples of a revealed case: who removes how much, and what do they report?

The oracle refits geometry and exactly the true terms of the catalogue: what a perfect search would get. It gets places
and physics from the opened seal; sizes, and which variant of a term fits best, it finds from the data.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from acquisition.recording import read
from benchmarks.proof_baselines import Method, features, installed
from calibeam.prove.record import ProofRecord, TrueDefect, Truth
from calibeam.prove.scoring import errors_m, same_place
from calibeam.prove.unseen import read_asked, tool_at
from calibrate.diagnose.assess.findings import (
    named,
)
from calibrate.diagnose.assess.unseen_rows import (
    splits_of,
)
from calibrate.diagnose.record.file import (
    read_diagnosis,
)
from calibrate.diagnose.record.schema import (
    DiagnosisFile,
    FindingRecord,
)
from calibrate.diagnose.search.bench import (
    Bench,
)
from calibrate.diagnose.search.line_search import (
    refined,
)
from calibrate.diagnose.search.score import (
    scores,
)
from calibrate.diagnose.state.fitted import (
    Fitted,
    fit_geometry,
)
from calibrate.diagnose.state.linearised import (
    Accepted,
    UnseenMisfits,
)
from calibrate.diagnose.state.session import (
    session_of,
)
from calibrate.fit.noise.scatter import (
    sigma_about_zero,
)
from calibrate.model.effects.term import (
    Term,
)
from calibrate.model.sensors.encoder_difference import (
    NAME as ENCODER_DIFFERENCE,
)

Floats = NDArray[np.float64]
Ints = NDArray[np.intp]

MOST_OF_ONE = 3  # terms for one mechanism
PAYS = 10.0  # of BIC, for a further term of the same mechanism
OUTLIER_SIGMAS = 6.0  # sigmas: rows that every method leaves out alike
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
    """The terms behind the findings of a file, fitted again. None where the words of one are of no term."""
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


def misfit_m(unseen: Sequence[UnseenMisfits], outlying: NDArray[np.bool_] | None = None) -> Floats:
    """(reading,) lengths that a model misses on unseen samples, wild ones left out."""
    lengths = [u.misfit for u in unseen if u.instrument != ENCODER_DIFFERENCE]
    parts = [misfit[:, :LENGTHS] if misfit.shape[1] > 4 else misfit for misfit in lengths]
    flat = np.concatenate([p.ravel() for p in parts])
    return flat if outlying is None else flat[~outlying]


def outlying_of(misfit: Floats) -> NDArray[np.bool_]:
    """(reading,) by the spread of the best model, for all methods alike."""
    return np.abs(misfit) > OUTLIER_SIGMAS * sigma_about_zero(misfit)


def rms_m(misfit: Floats) -> float:
    return float(np.sqrt(np.mean(misfit**2)))


SEED = 3  # of the split
DIAGNOSIS = "diagnosis"  # among the methods
GEOMETRY = "geometry only"
WORTH = 0.9  # of the error: an oracle that leaves more has nothing to share out


class BaselineScore(ProofRecord, frozen=True):
    """Another method on the same unseen samples; 1: all that the oracle removes, 0: none."""

    method: str
    rms_m: float | None
    gain: float | None
    says: str  # what it answers to "where and why"


class Compared(ProofRecord, frozen=True):
    """Of one case, all on the same unseen samples."""

    before_m: float  # geometry alone
    oracle_m: float
    free_space_m: float | None  # of the oracle; None where its terms do not hold at other poses
    baselines: tuple[BaselineScore, ...]


def compare(recording: Path, answer: Path, asked: Path, truth: Truth, family: str) -> Compared | None:
    """None where the catalogue does not hold what was hidden, so that there is no oracle.

    `asked`: the poses at which the truth has the place of the tool.
    """
    source = read(recording)
    state = fit_geometry(session_of(source.rig, source.samples))
    terms = oracle_terms(state, truth.defects, family)
    if not terms:
        return None
    fold = fold_of(state, SEED)
    plain = fold.geometry.held_out(fold.test)
    known = state.select(fold.train).refitted(terms).held_out(fold.test)
    outlying = outlying_of(misfit_m(known))
    before_m, oracle_m = rms_m(misfit_m(plain, outlying)), rms_m(misfit_m(known, outlying))
    rest = _Rest(fold, plain, outlying, before_m, oracle_m)
    scores = [BaselineScore(GEOMETRY, before_m, _gain(before_m, before_m, oracle_m), "no place and no cause")]
    scores += [_rival(m, rest) for m in installed()]
    scores += _diagnosed(state, read_diagnosis(answer / "diagnosis.json"), rest)
    free_space_m = errors_m(tool_at(state.refitted(terms), *read_asked(asked)), truth.free_space)
    return Compared(before_m, oracle_m, free_space_m, tuple(scores))


@dataclass(frozen=True, eq=False)
class _Rest:
    """What everybody is measured by."""

    fold: Fold
    plain: tuple[UnseenMisfits, ...]  # misses of geometry alone
    outlying: NDArray[np.bool_]
    before_m: float
    oracle_m: float

    def score(self, method: str, left: Sequence[UnseenMisfits], says: str) -> BaselineScore:
        rms = rms_m(misfit_m(left, self.outlying))
        return BaselineScore(method, rms, _gain(rms, self.before_m, self.oracle_m), says)


def _diagnosed(state: Fitted, file: DiagnosisFile, rest: _Rest) -> list[BaselineScore]:
    """The terms of the blind diagnosis, refitted without the unseen samples like everything else here."""
    terms = said_terms(state, file.findings)
    if terms is None:
        return []
    left = state.select(rest.fold.train).refitted(terms).held_out(rest.fold.test) if terms else rest.plain
    return [rest.score(DIAGNOSIS, left, "; ".join(f.says for f in file.findings) or file.verdict)]


def _rival(method: Method, rest: _Rest) -> BaselineScore:
    """Each instrument learnt by itself, in sigmas of its own."""
    X, names = features(rest.fold.geometry)
    left: list[UnseenMisfits] = []
    says = ""
    for seen, unseen in zip(rest.fold.geometry.held_out(rest.fold.train), rest.plain, strict=True):
        scale = sigma_about_zero(seen.misfit, axis=0)
        learnt = method.learn(X[seen.sample], _tame(seen.misfit / scale), X[unseen.sample], names)
        missed = unseen.misfit - learnt.predicted * scale
        left.append(UnseenMisfits(unseen.instrument, unseen.sample, missed, unseen.whitened))
        says = says or learnt.says
    return rest.score(method.name, left, says)


def _tame(misfit: Floats) -> Floats:
    """Gross errors cut to six sigmas: the learners have no robust loss, and are not to lose by that."""
    return np.clip(misfit, -6.0, 6.0)


def _gain(rms: float, before_m: float, oracle_m: float) -> float | None:
    """1: as good as the oracle, 0: no better than geometry, negative: worse."""
    if oracle_m > WORTH * before_m:
        return None
    return (before_m**2 - rms**2) / (before_m**2 - oracle_m**2)
