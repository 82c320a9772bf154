"""The whole diagnosis of one fitted session: search, unknowns, proof, uncertainty, what to do next.

What to measure next where a cause has alternatives: other poses, a change of temperature, or a second instrument.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from calibrate.diagnose.assess.assessment import Assessed, assessed
from calibrate.diagnose.assess.diagnosis import (
    Diagnosis,
    Finding,
    Named,
    Rejected,
    RivalName,
)
from calibrate.diagnose.assess.findings import named
from calibrate.diagnose.assess.missing_columns import separated_by_time
from calibrate.diagnose.assess.unseen_rows import floors, proofs
from calibrate.diagnose.search.bench import recent_menu
from calibrate.diagnose.search.noise_law import noise_law
from calibrate.diagnose.search.searching import Search
from calibrate.diagnose.stages import Stage, Stages
from calibrate.diagnose.state.linearised import State
from calibrate.model.effects.term import Accepted, Missing

Floats = NDArray[np.float64]
Ints = NDArray[np.intp]

POSES = "measure poses that separate them (calibeam diagnose --plan-out)"
# Temperature follows time unless the arm is cooled and warmed again (mismatch catalogue, confusable by nature).
COOLED = "no pose separates them; measure on while the arm is cooled and warmed again"
WITNESS = "alike at every pose to this instrument; watch either with a second one, or measure fixed marks again"


def diagnose(
    state: State,
    rng: Generator,
    missing: Sequence[Missing] = (),
    stages: Stages | None = None,
    known: Callable[[Diagnosis], None] | None = None,
    usual: Sequence[Accepted] = (),
) -> Diagnosis:
    """Of a state with geometry fitted and no terms; `missing`: what effects of the catalogue lack in this record.
    `usual` terms are there when the search begins, and go where nothing asks for them.

    `stages` keeps what fails; `known` is called once as soon as the causes are known, with nothing beside them yet.
    """
    stages = Stages() if stages is None else stages

    def causes(found: Assessed) -> None:
        if known is not None:
            known(replace(_without_proof(found, missing), incomplete=stages.not_yet(Stage.PREDICTION)))

    found = assessed(state, rng, missing, stages, causes, usual)
    at, attempt = found.at, stages.attempt
    samples = np.unique(at.state.rows.sample[at.state.rows.data])
    wanders = attempt(Stage.NOISE, lambda: _wanders(at, rng), otherwise=False)
    rejected, invisible = attempt(Stage.REJECTED, lambda: _not_there(at), ((), ()))
    whole = replace(
        _without_proof(found, missing),
        proofs=attempt(Stage.PROOFS, lambda: proofs(state, at.state, samples, rng), ()),
        floors=attempt(Stage.FLOORS, lambda: floors(at.state, samples, at.state.rows.geometry.shape[1]), ()),
        noise_wanders=wanders,
        rejected=rejected,
        invisible=invisible,
        incomplete=stages.failed,
    )
    recent_menu.cache_clear()
    return whole


def _without_proof(found: Assessed, missing: Sequence[Missing]) -> Diagnosis:
    return Diagnosis(
        verdict=found.verdict,
        findings=found.findings,
        unexplained=found.unexplained,
        proofs=(),
        floors=(),
        lack_of_fit=found.misfit,
        noise_wanders=False,
        rejected=(),
        invisible=(),
        missing=tuple(missing),
        next=(*found.next, *to_measure(found.findings), *(to_see(where) for where in sorted(found.at.bench.blind))),
        model=found.at.state,
    )


def _wanders(at: Search, rng: Generator) -> bool:
    return noise_law(at.state.rows, at.bench.sight, at.state.drivers.t_s, rng).wanders


def _not_there(at: Search) -> tuple[tuple[Rejected, ...], tuple[Named, ...]]:
    """Rejected causes, and those that these poses do not show."""
    blind = [t for t in at.state.candidates() if t.port.where in at.bench.blind and not t.open]
    return _rejected(at), tuple(dict.fromkeys(named(term) for term in (*at.bench.menu.invisible, *blind)))


def _rejected(at: Search) -> tuple[Rejected, ...]:
    """The best candidate of every physics that is not among the accepted."""
    menu, gains = at.bench.menu, at.bench.scores.gain
    taken = {a.term.physics for a in at.state.accepted}
    best: dict[str, Rejected] = {}
    for entry in np.argsort(-gains):
        term = menu.terms[menu.entries[entry].term]
        if term.physics in taken or term.physics in best:
            continue
        gain = float(gains[entry])
        why = "these poses do not show it" if not np.isfinite(gain) else "explains too little for its parameters"
        if gain > 0.0:
            why = "not beyond what searching through noise finds"
        best[term.physics] = Rejected(named(term), gain, why)
    return tuple(best.values())


def to_see(where: str) -> str:
    """What shows a joint that next to no reading follows."""
    return (
        f"{where} is blind: next to no reading follows this joint, so that nothing in it can be found or excluded; put "
        "the target off its axis"
    )


def to_measure(findings: Sequence[Finding]) -> tuple[str, ...]:
    """One sentence for each finding and remedy."""
    out: list[str] = []
    for finding in findings:
        for remedy in (POSES, COOLED, WITNESS):
            mine = [r.name for r in finding.rivals if _remedy(finding.name, r) == remedy]
            if mine:
                others = ", ".join(dict.fromkeys(name.compared_with(finding.name) for name in mine))
                out.append(f"{finding.name.physics} at {finding.name.where} could also be {others}: {remedy}")
    return tuple(out)


def _remedy(name: Named, rival: RivalName) -> str:
    if rival.alike:
        return WITNESS
    return COOLED if separated_by_time(name, rival.name) else POSES
