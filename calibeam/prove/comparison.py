"""Oracle and rivals on the unseen samples of one revealed case: who removes how much, and what do they say?"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from acquisition.recording import read
from calibeam.prove.baselines.features import features
from calibeam.prove.baselines.method import Method
from calibeam.prove.baselines.methods import installed
from calibeam.prove.free_space import errors_m
from calibeam.prove.oracle import Fold, fold_of, misfit_m, oracle_terms, rms_m, said_terms, wild_of
from calibeam.prove.record import DIAGNOSIS, BaselineScore
from calibeam.prove.truth import Truth
from calibeam.prove.unseen_file import read_asked
from calibeam.prove.unseen_poses import tool_at
from calibrate.diagnose.file import read_diagnosis
from calibrate.diagnose.fitted import Fitted, fit_geometry
from calibrate.diagnose.linearised import Unseen
from calibrate.diagnose.schema import DiagnosisFile
from calibrate.diagnose.session import session_of

Floats = NDArray[np.float64]

SEED = 3  # of the split
GEOMETRY = "geometry only"
WORTH = 0.9  # of the error: an oracle that leaves more has nothing to share out


@dataclass(frozen=True)
class Compared:
    """Of one case, all on the same unseen samples."""

    before_m: float
    oracle_m: float
    free_space_m: float | None  # of the oracle; None where its terms say nothing of other poses
    baselines: tuple[BaselineScore, ...]


def compare(recording: Path, answer: Path, asked: Path, truth: Truth, family: str) -> Compared | None:
    """None where the catalogue does not hold what was hidden, so that there is no oracle.

    `asked`: the poses at which the truth says where the tool is.
    """
    source = read(recording)
    state = fit_geometry(session_of(source.rig, source.samples))
    terms = oracle_terms(state, truth.defects, family)
    if not terms:
        return None
    fold = fold_of(state, SEED)
    plain = fold.geometry.held_out(fold.test)
    known = state.select(fold.train).refitted(terms).held_out(fold.test)
    wild = wild_of(misfit_m(known))
    before_m, oracle_m = rms_m(misfit_m(plain, wild)), rms_m(misfit_m(known, wild))
    rest = _Rest(fold, plain, wild, before_m, oracle_m)
    scores = [BaselineScore(GEOMETRY, before_m, _gain(before_m, before_m, oracle_m), "no place and no cause")]
    scores += [_rival(m, rest) for m in installed()]
    scores += _diagnosed(state, read_diagnosis(answer / "diagnosis.json"), rest)
    free_space_m = errors_m(tool_at(state.refitted(terms), *read_asked(asked)), truth.free_space)
    return Compared(before_m, oracle_m, free_space_m, tuple(scores))


@dataclass(frozen=True, eq=False)
class _Rest:
    """What everybody is measured by."""

    fold: Fold
    plain: tuple[Unseen, ...]  # misses of geometry alone
    wild: NDArray[np.bool_]
    before_m: float
    oracle_m: float

    def score(self, method: str, left: Sequence[Unseen], says: str) -> BaselineScore:
        rms = rms_m(misfit_m(left, self.wild))
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
    left: list[Unseen] = []
    says = ""
    for seen, unseen in zip(rest.fold.geometry.held_out(rest.fold.train), rest.plain, strict=True):
        scale = np.median(np.abs(seen.misfit), axis=0) / 0.6745
        learnt = method.learn(X[seen.sample], _tame(seen.misfit / scale), X[unseen.sample], names)
        missed = unseen.misfit - learnt.predicted * scale
        left.append(Unseen(unseen.instrument, unseen.sample, missed, unseen.whitened))
        says = says or learnt.says
    return rest.score(method.name, left, says)


def _tame(misfit: Floats) -> Floats:
    """Wild rows cut to six sigmas: the learners have no robust loss, and are not to lose by that."""
    return np.clip(misfit, -6.0, 6.0)


def _gain(rms: float, before_m: float, oracle_m: float) -> float | None:
    """1: as good as the oracle, 0: no better than geometry, negative: worse."""
    if oracle_m > WORTH * before_m:
        return None
    return (before_m**2 - rms**2) / (before_m**2 - oracle_m**2)
