"""What is found, and what speaks against taking it for the whole truth; a diagnosis adds the proof to it.

Scatter through a port's lever, misfit that repeats, a drift whose temperature was not recorded: each one names which
column is missing, and while structure is left over no name is final.

Each accepted term by the name that a full refit likes best; of names that the data cannot separate, that of
the fewest drivers and of the lowest harmonic (numbers are paid for by BIC already).

The search compares candidates by linear scores, which are off by some units of BIC where robust weights or inner values
would settle elsewhere.

Does each term predict rows that the fit has not seen, whole blocks in time and whole regions of the workspace, for a
row beside its neighbours is half seen: exact for the linearised model, without a refit. By the rule of one standard
error a shorter model that predicts hardly worse is taken: Breiman et al., Classification and regression trees, 1984,
section 3.4.3.
Errors of a fold that was left out are (I - H_ff)^-1 r_f. Source: Cook, Weisberg, Residuals and Influence in Regression,
1982, section 2.2 (several rows deleted).

Which samples of a long session the search works on: its cost grows with their number, what it can show but slowly.
The model that is found is fitted to all of them afterwards.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from calibrate.diagnose.assess import limits
from calibrate.diagnose.assess.diagnosis import (
    UNKNOWN,
    Finding,
    Unexplained,
    Verdict,
)
from calibrate.diagnose.assess.findings import bare_findings, findings_of, named
from calibrate.diagnose.assess.lack_of_fit import LackOfFit, lack_of_fit
from calibrate.diagnose.assess.missing_columns import TIME, drift_not_determined, suspects
from calibrate.diagnose.assess.rivals import Rival, price, rivals_of
from calibrate.diagnose.assess.unknown import with_unknowns
from calibrate.diagnose.assess.unrecorded import Unrecorded, unrecorded
from calibrate.diagnose.assess.unseen_rows import blocks, regions, units
from calibrate.diagnose.search import limits as search_limits
from calibrate.diagnose.search.bench import Bench
from calibrate.diagnose.search.pruning import without
from calibrate.diagnose.search.score import gain_of
from calibrate.diagnose.search.search import search
from calibrate.diagnose.search.searching import Search
from calibrate.diagnose.stages import Stage, Stages
from calibrate.diagnose.state.linearised import State
from calibrate.diagnose.time_left import TimeLeft, time_left
from calibrate.model.effects.term import Accepted, Missing

SPEED = "qd"
MOTION = ("approach", "last_move")
LOADS = ("payload", "gravity_torque")


Rivals = tuple[tuple[Rival, ...], ...]

Floats = NDArray[np.float64]

RIDGE = 1e-9  # keeps a direction that only one fold knows finite

Ints = NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class Assessed:
    """A model, its findings and what is left over."""

    at: Search
    findings: tuple[Finding, ...]
    unexplained: tuple[Unexplained, ...]
    misfit: LackOfFit | None
    next: tuple[str, ...]  # columns to record
    undecided: bool = False  # a stage that decides has failed

    @property
    def verdict(self) -> Verdict:
        if self.findings:
            return Verdict.MISMATCH
        return Verdict.UNDECIDABLE if self.unexplained or self.undecided else Verdict.CONSISTENT


def assessed(
    state: State,
    rng: Generator,
    missing: Sequence[Missing] = (),
    stages: Stages | None = None,
    known: Callable[[Assessed], None] | None = None,
    usual: Sequence[Accepted] = (),
) -> Assessed:
    """Of a state with geometry fitted and no terms; `missing`: what effects of the catalogue lack in this record;
    `usual`: terms that the search begins with.

    `stages` keeps what fails; `known` is called once as soon as the causes are known, before alternatives and sizes.
    """
    stages = Stages() if stages is None else stages
    few = _found(state, rng, stages, usual)
    at = _of_all(few, state)
    if known is not None:
        known(Assessed(at, bare_findings(at), (), None, (), undecided=True))
    nameless = tuple(() for _ in few.state.accepted)
    few, rivals = stages.attempt(Stage.ALTERNATIVES, lambda: _named_best(few), (few, nameless))
    whole = at if at.keys == few.keys else _of_all(few, state)
    at = stages.attempt(Stage.ALTERNATIVES, lambda: _renewed(whole), whole)
    scatter = stages.attempt(Stage.SCATTER, lambda: unrecorded(at.bench, rng, missing), None)
    misfit = stages.attempt(Stage.REPEATS, lambda: lack_of_fit(at.bench), None)
    lasting = stages.attempt(Stage.TIME, lambda: time_left(at.bench, rng), None)
    speed = [m for m in missing if m.driver == SPEED]
    lagging = _lagging(at) if speed else []
    moving = _moving(at, speed, lagging)
    left = [*_scattered(scatter), *_repeated(misfit), *_lasting(lasting), *moving]
    final = not left and not stages.undecided
    drifting = {i: hidden for i, a in enumerate(at.state.accepted) if (hidden := suspects(named(a.term), missing))}
    would = {scatter.port.where} if scatter is not None and scatter.missing else set[str]()
    unsized = {*drifting, *lagging, *(i for i, a in enumerate(at.state.accepted) if a.term.port.where in would)}
    weighed = not any(m.driver in LOADS for m in missing)
    findings = stages.attempt(
        Stage.SIZES, lambda: findings_of(at, rivals, predicts(at.bench), final, unsized, weighed), bare_findings(at)
    )
    where = {at.state.accepted[i].term.port.where: hidden for i, hidden in drifting.items()}
    drifts = [(f, where[f.name.where]) for f in findings if f.name.where in where and f.name.physics == UNKNOWN]
    lacking = [*(scatter.missing if scatter is not None else ()), *(speed if moving else ())]
    lacking += [m for _, hidden in drifts for m in hidden]
    if left and not lacking:
        lacking = list(missing)
    unexplained = (*left, *(drift_not_determined(f, hidden) for f, hidden in drifts))
    return Assessed(at, findings, unexplained, misfit, records(lacking), stages.undecided)


def _found(state: State, rng: Generator, stages: Stages, usual: Sequence[Accepted]) -> Search:
    """Every cause, of samples enough to see them; where a stage fails, what the stages before it have found."""
    few = stages.attempt(Stage.SEARCH, lambda: thinned(state, rng), state)
    begun = few.refitted(usual) if usual else few
    at = stages.attempt(Stage.SEARCH, lambda: search(begun, rng), Search(Bench(few), rng))
    at = stages.attempt(Stage.UNKNOWN, lambda: with_unknowns(at), at)
    return stages.attempt(Stage.PREDICTION, lambda: _predicting(at), at)


def _of_all(at: Search, state: State) -> Search:
    """The same model fitted to all samples."""
    return at.at(Bench(state.refitted(at.state.accepted))) if at.state.samples < state.samples else at


def _renewed(at: Search) -> Search:
    return at.at(Bench(at.state.renewed())) if at.state.accepted else at


def _named_best(at: Search) -> tuple[Search, Rivals]:
    at, rivals = with_best_names(at)
    kept = _predicting(at)
    return (at, rivals) if kept is at else with_best_names(kept)


def _predicting(at: Search) -> Search:
    """Without terms that do not help on rows held out, or are not worth their parameters any more, the worst first."""
    while at.state.accepted:
        wins = predicts(at.bench)
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
    why += f"; missing column: {columns}" if columns else ""
    drivers = tuple(dict.fromkeys(m.driver for m in found.missing))
    return [Unexplained(found.port.where, drivers, found.share, found.p, why)]


def _lagging(at: Search) -> list[int]:
    """Terms by which several joints lag by the way they came: slack in each, or one clock that is late while all move;
    none where few do.
    """
    lagging = [i for i, a in enumerate(at.state.accepted) if a.term.depends_on[0].startswith(MOTION)]
    return lagging if len({at.state.accepted[i].term.port.where for i in lagging}) >= limits.LAGGING_JOINTS else []


def _moving(at: Search, speed: Sequence[Missing], lagging: Sequence[int]) -> list[Unexplained]:
    """What only the speed of the joints would show of `lagging` terms."""
    if not lagging:
        return []
    lost = sum(at.bench.gone[i].squares for i in lagging)
    share = lost / (lost + at.bench.sight.rss)
    p = max(at.p.get(at.state.accepted[i].term.key, 0.0) for i in lagging)
    why = (
        f"{len(lagging)} joints lag behind their direction of approach: slack, or one late clock; missing column: "
        f"{speed[0].column}"
    )
    return [Unexplained(TIME, (SPEED,), share, p, why)]


def _repeated(misfit: LackOfFit | None) -> list[Unexplained]:
    if misfit is None or not misfit.significant:
        return []
    share = max(0.0, 1.0 - 1.0 / misfit.ratio)
    return [Unexplained("", (), share, misfit.p, "misfit that comes back when a pose is repeated")]


def _lasting(found: TimeLeft | None) -> list[Unexplained]:
    if found is None:
        return []
    return [Unexplained("", ("t",), max(0.0, 1.0 - 1.0 / found.ratio), found.p, found.what)]


def records(lacking: Sequence[Missing]) -> tuple[str, ...]:
    """One sentence for each column to record."""
    return tuple(f"record {m.column}: without it {m.physics} cannot be determined" for m in dict.fromkeys(lacking))


def with_best_names(at: Search) -> tuple[Search, Rivals]:
    """The search with names exchanged, and the alternatives of each term in it."""
    for _ in range(limits.NAMING_ROUNDS):
        rivals = _rivals(at.bench)
        changed = _exchanged(at, rivals)
        if changed is None:
            return at, rivals
        at = changed
    return at, _rivals(at.bench)


def _rivals(bench: Bench) -> Rivals:
    return tuple(() if a.term.open else rivals_of(bench, i) for i, a in enumerate(bench.state.accepted))


def _exchanged(at: Search, rivals: Rivals) -> Search | None:
    """With the first name exchanged that has a better one; None if there is none."""
    for i, (own, mine) in enumerate(zip(at.state.accepted, rivals, strict=True)):
        class_ = [(0.0, own), *((r.margin, r.accepted) for r in mine if r.refitted and r.plausible)]
        class_ = [(margin + price(at.bench, a.term), a) for margin, a in class_]
        least = min(margin for margin, _ in class_)
        near = [c for c in class_ if c[0] <= least + limits.NAMES_TIED]
        best = min(near, key=lambda c: (len(c[1].term.depends_on), c[1].term.order or 1, *_rank(at, c, least, own)))[1]
        if best is own:
            continue
        bench = Bench(at.state.refitted([best if j == i else a for j, a in enumerate(at.state.accepted)]))
        dearer = price(at.bench, best.term) - price(at.bench, own.term)
        if bench.bic + dearer <= at.bench.bic + limits.NAMES_TIED:
            return replace(at.at(bench), p=at.p | {best.term.key: at.p.get(own.term.key, 0.0)})
    return None


def _rank(at: Search, candidate: tuple[float, Accepted], least: float, own: Accepted) -> tuple[float, int]:
    """By margin; a hair's breadth is no reason: what nothing separates is named in the catalogue's order."""
    margin, accepted = candidate
    if margin <= least + search_limits.BETTER:
        return least, at.bench.menu.place_of(accepted.term)
    return (margin - search_limits.BETTER if accepted is own else margin), 0


def predicts(bench: Bench) -> Floats:
    """(term,) squares of unseen rows that each accepted term saves, in variances of the noise, less one standard error;
    below zero it only fitted noise. The lesser of what it saves on blocks in time and on regions of the workspace.

    Beside a model of another recording that recording counts, too: many rows of the new one bend a model until it
    predicts them well, at the cost of all that was known. It is not held out, so each value costs two (Akaike 1974).
    """
    rows, data = bench.state.rows, np.flatnonzero(bench.state.rows.data)
    out, known = np.full(len(bench.gone), np.inf), np.zeros(len(bench.gone))
    for parts, count in ((blocks(bench.state.drivers), limits.FOLDS), (regions(bench.state.drivers), limits.REGIONS)):
        part = parts[rows.sample[data]]
        folds, met = [data[part % count == fold] for fold in range(count)], np.unique(part)
        whole = _unseen_squares(bench.sight.basis, bench.sight.residual, folds, bench.geometry)
        for i, gone in enumerate(bench.gone):
            # The span of the model without a term: the complement of what only the term spans.
            basis = bench.sight.basis - gone.span @ (gone.span.T @ bench.sight.basis)
            without = bench.sight.residual + gone.span @ gone.part
            saved = np.bincount(part, (_unseen_squares(basis, without, folds, bench.geometry) - whole)[data])[met]
            out[i] = min(out[i], np.sum(saved) - np.std(saved) * np.sqrt(len(saved)))
            gained = float(np.sum(without[rows.stated] ** 2) - np.sum(bench.sight.residual[rows.stated] ** 2))
            known[i] = max(gained - 2.0 * gone.cost, 0.0)
    return out + known


def _unseen_squares(basis: Floats, residual: Floats, folds: Sequence[Ints], geometry: Floats) -> Floats:
    """(row,) squared errors of rows left out. `basis` may be an orthonormal one less some directions.

    In units of how well `geometry` (row, rank), orthonormal, predicts a fold from the others: what no other row
    determines is no fault of a term, but where a term runs away beyond the rows that it was fitted to, it is.
    """
    out, p = np.zeros(len(residual)), basis.shape[1]
    for fold in folds:
        # (I - Q Q')^-1 r = r + Q (I - Q' Q)^-1 Q' r: a fold has more rows than the model has directions.
        Q = basis[fold]
        error = residual[fold] + Q @ np.linalg.solve((1.0 + RIDGE) * np.eye(p) - Q.T @ Q, Q.T @ residual[fold])
        # With G = U s V': U (1 - sqrt(1 - s^2)) U' = G V / (1 + sqrt(1 - s^2)) V' G'. The eigenvalues of G' G are s^2;
        # unlike the singular values of G they converge where columns are zero or next to it.
        G = geometry[fold]
        square, V = np.linalg.eigh(G.T @ G)
        out[fold] = (error - G @ (V @ (V.T @ (G.T @ error) / (1.0 + np.sqrt(np.maximum(1.0 - square, 0.0)))))) ** 2
    return out


def thinned(state: State, rng: Generator) -> State:
    """The state itself, or fitted to samples drawn at random; repeats stay together."""
    samples = np.unique(state.rows.sample[state.rows.data])
    most = state.most_search_rows * len(samples) // max(int(state.rows.data.sum()), 1)
    if len(samples) <= most:
        return state
    label = units(state.drivers)[samples]
    names, count = np.unique(label, return_counts=True)
    order = rng.permutation(len(names))
    kept = names[order[np.cumsum(count[order]) <= most]]
    return state.select(samples[np.isin(label, kept)]).refitted(())
