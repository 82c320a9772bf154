"""What is found, and what speaks against taking it for the whole truth; a diagnosis adds the proof to it.

Scatter through a port's lever, misfit that repeats, a drift whose temperature was not recorded: each one says which
column is missing, and while structure is left over no name is final.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.random import Generator

from calibrate.diagnose.bench import Bench
from calibrate.diagnose.best_names import with_best_names
from calibrate.diagnose.cross_validation import predicts
from calibrate.diagnose.diagnosis import Finding, Unexplained, Verdict
from calibrate.diagnose.drifts import doubtful, suspects, untold
from calibrate.diagnose.findings import findings_of
from calibrate.diagnose.hidden_levers import TIME
from calibrate.diagnose.lack_of_fit import LackOfFit, lack_of_fit
from calibrate.diagnose.linearised import State
from calibrate.diagnose.pruning import without
from calibrate.diagnose.score import gain_of
from calibrate.diagnose.search import search
from calibrate.diagnose.searching import Search
from calibrate.diagnose.thinned import thinned
from calibrate.diagnose.unknown import with_unknowns
from calibrate.diagnose.unrecorded import Unrecorded, unrecorded
from calibrate.effects.term import Missing

SPEED = "qd"
MOTION = ("approach", "last_move")
SEVERAL = 3  # joints: one clock is simpler than slack in each


@dataclass(frozen=True, eq=False)
class Doubted:
    """A model, its findings and what is left over."""

    at: Search
    findings: tuple[Finding, ...]
    unexplained: tuple[Unexplained, ...]
    misfit: LackOfFit | None
    next: tuple[str, ...]  # columns to record

    @property
    def verdict(self) -> Verdict:
        if self.findings:
            return Verdict.MISMATCH
        return Verdict.UNDECIDABLE if self.unexplained else Verdict.CONSISTENT


def doubted(state: State, rng: Generator, missing: Sequence[Missing] = ()) -> Doubted:
    """Of a state with geometry fitted and no terms; `missing`: what effects of the catalogue lack in this record."""
    at = _predicting(with_unknowns(search(thinned(state, rng), rng)), rng)
    if at.state.samples < state.samples:
        at = at.at(Bench(state.refitted(at.state.accepted)))
    at, rivals = with_best_names(at)
    if (kept := _predicting(at, rng)) is not at:
        at, rivals = with_best_names(kept)
    scatter, misfit = unrecorded(at.bench, rng, missing), lack_of_fit(at.bench)
    speed = [m for m in missing if m.driver == SPEED]
    moving = _moving(at, speed)
    left = [*_scattered(scatter), *_repeated(misfit), *moving]
    findings = findings_of(at, rivals, predicts(at.bench, rng), final=not left)
    drifts = [(f, hidden) for f in findings if (hidden := suspects(f, missing))]
    findings = tuple(doubtful(f) if suspects(f, missing) else f for f in findings)
    lacking = [*(scatter.missing if scatter is not None else ()), *(speed if moving else ())]
    lacking += [m for _, hidden in drifts for m in hidden]
    if left and not lacking:
        lacking = list(missing)
    return Doubted(at, findings, (*left, *(untold(f, hidden) for f, hidden in drifts)), misfit, _records(lacking))


def _predicting(at: Search, rng: Generator) -> Search:
    """Without terms that do not help on rows held out, or are not worth their parameters any more, the worst first."""
    while at.state.accepted:
        wins = predicts(at.bench, rng)
        worth = np.array([gain_of(gone, at.bench.sight) for gone in at.bench.gone])
        worst = int(np.argmin(np.minimum(wins, worth)))
        if min(wins[worst], worth[worst]) > 0.0:
            return at
        at = without(at, worst)
    return at


def _scattered(found: Unrecorded | None) -> list[Unexplained]:
    if found is None:
        return []
    columns = ", ".join(dict.fromkeys(m.column for m in found.missing))
    why = "scatter that follows the lever of this port, and no recorded column"
    why += f"; not recorded: {columns}" if columns else ""
    drivers = tuple(dict.fromkeys(m.driver for m in found.missing))
    return [Unexplained(found.port.where, drivers, found.share, found.p, why)]


def _moving(at: Search, speed: Sequence[Missing]) -> list[Unexplained]:
    """Several joints that lag by the way they came: slack in each, or one clock that is late while all move."""
    lagging = [i for i, a in enumerate(at.state.accepted) if a.term.depends_on[0].startswith(MOTION)]
    if not speed or len({at.state.accepted[i].term.port.where for i in lagging}) < SEVERAL:
        return []
    lost = sum(at.bench.gone[i].squares for i in lagging)
    share = lost / (lost + at.bench.sight.rss)
    p = max(at.p.get(at.state.accepted[i].term.key, 0.0) for i in lagging)
    why = f"{len(lagging)} joints lag by the way they came: slack, or one late clock; not recorded: {speed[0].column}"
    return [Unexplained(TIME, (SPEED,), share, p, why)]


def _repeated(misfit: LackOfFit | None) -> list[Unexplained]:
    if misfit is None or not misfit.significant:
        return []
    share = max(0.0, 1.0 - 1.0 / misfit.ratio)
    return [Unexplained("", (), share, misfit.p, "misfit that comes back when a pose is repeated")]


def _records(lacking: Sequence[Missing]) -> tuple[str, ...]:
    return tuple(f"record {m.column}: without it {m.physics} cannot be told" for m in dict.fromkeys(lacking))
