"""From accepted terms to findings: sizes with sigmas, share, alternatives, picture, and one finding for one cause.

Several names at one place of a machine that is sound elsewhere: pieces of one law that nobody has listed.
Sines of a joint's angle and its torque build up any function of the pose, so a few of them that fit prove little.
Faults that have nothing to do with each other are spread over a machine; three of them at one joint and next to none
anywhere else are one cause.

Of all open terms at one port a finding gives place, drivers, and how much of it these poses show. A curve's
coefficients are shared out between it, its neighbours and geometry as priors please; their size is no size of anything.
What only the curve explains is one: felt at the readings, divided by how they feel the port.
"""

import re
from collections.abc import Collection, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.special import pdtrc

from calibrate.diagnose.assess import limits
from calibrate.diagnose.assess.diagnosis import (
    NAMED,
    NOT_FINAL,
    PLACED,
    UNKNOWN,
    Finding,
    Named,
    RivalName,
)
from calibrate.diagnose.assess.pulled_back import pulled_back
from calibrate.diagnose.assess.rivals import Rival, confidences
from calibrate.diagnose.search.bench import Bench
from calibrate.diagnose.search.port_process import lever
from calibrate.diagnose.search.score import (
    Removed,
    gain_of,
    orthonormal,
    removed,
)
from calibrate.diagnose.search.searching import Search
from calibrate.diagnose.search.stated_sizes import sizes_of
from calibrate.model.effects.curve import unit_of
from calibrate.model.effects.term import (
    Accepted,
    Shape,
    Size,
    Term,
    plain,
)

Floats = NDArray[np.float64]

NO_SIZE = ("phase", "time", "period", "degree", "order")  # words of parameters for where or when, not how much
WEIGHTS = ("gravity_torque", "overturning_moment", "payload")
OF_ANGLES = re.compile(r"(q|gravity_torque)\d+")
SPEED = re.compile(r"qd\d+")


def named(term: Term) -> Named:
    return Named(term.port.where, term.depends_on, term.shape.value, term.order, UNKNOWN if term.open else term.physics)


def findings_of(
    at: Search,
    rivals: Sequence[Sequence[Rival]],
    predicts: Floats,
    final: bool = True,
    unsized: Collection[int] = (),
    weighed: bool = True,
) -> tuple[Finding, ...]:
    """Largest first. `rivals` of each term; `predicts` (term,) as `calibrate/diagnose/assess/assessment.py` gives it.

    All that is unknown at one port is one finding. `final`: no structure is left without a name; while some is, no
    name of physics is more likely than not. `unsized`: terms that a column which was not recorded would explain; their
    names are alternatives only. `weighed`: all that the arm carries is stated and recorded.
    """
    accepted = at.state.accepted
    unnamed = _unnamed(at)
    taken = {i for group in unnamed for i in group}
    closed = [i for i in range(len(accepted)) if i not in taken]
    names = [_finding(at, i, rivals[i], float(predicts[i])) for i in closed]
    unknown = [unknown_cause(at, group, predicts) for group in unnamed]
    loads = [f for f in names if _by_weight(f.name)]
    slight = [any(_misweighed(f, load, weighed) for load in loads) for f in names]
    not_final = [less or not (final and _final(f, unknown)) for f, less in zip(names, slight, strict=True)]
    names = [f.weakened(NOT_FINAL) if less else f for f, less in zip(names, not_final, strict=True)]
    sure = [
        i not in unsized and f.confidence >= limits.LEAST_CONFIDENCE and _sized(f)
        for i, f in zip(closed, names, strict=True)
    ]
    names = [f if ok else _unsure(at, i, f, predicts) for i, f, ok in zip(closed, names, sure, strict=True)]
    explained = max(sum(f.share for f in (*names, *unknown)), 1e-300)
    found = [replace(f, share=f.share / explained) for f in (*_no_leftovers(names, unknown), *unknown)]
    return tuple(sorted(found, key=lambda f: -f.share))


def _sized(finding: Finding) -> bool:
    """Whether its size is certain to be one: a name of nothing in particular is none. Of several sizes, as of a move,
    each may be vague and all together plain; those that the data do not determine decide nothing.
    """
    sized = [size for name, size in finding.parameters.items() if not name.startswith(NO_SIZE)]
    return len(sized) != 1 or not abs(sized[0].value) < limits.SIZE_SIGMAS * sized[0].sigma < np.inf


def _unsure(at: Search, i: int, finding: Finding, predicts: Floats) -> Finding:
    """The unknown cause in the place of a name that is hardly likely, or of no certain size. The name stays among what
    it could be; all names together are no more likely than not.
    """
    found, assessed = unknown_cause(at, (i,), predicts), finding.weakened(NOT_FINAL)
    rivals = (RivalName(assessed.name, assessed.confidence, 0.0, refitted=True), *assessed.rivals)
    left = max(found.confidence - sum(rival.confidence for rival in rivals), 0.0)
    return replace(found, confidence=left, rivals=rivals, variant=finding.variant)


def bare_findings(at: Search) -> tuple[Finding, ...]:
    """What is known as soon as the causes are: names and shares, no sizes, and no name more likely than not."""
    found = [_bare(at, i) for i in range(len(at.state.accepted))]
    explained = max(sum(f.share for f in found), 1e-300)
    return tuple(sorted((replace(f, share=f.share / explained) for f in found), key=lambda f: -f.share))


def _bare(at: Search, i: int) -> Finding:
    a = at.state.accepted[i]
    name, p = named(a.term), at.p.get(a.term.key, 0.0)
    return Finding(
        name=name,
        parameters={},
        share=at.bench.gone[i].squares,
        confidence=NOT_FINAL * (1.0 - p),
        p=p,
        gain=gain_of(at.bench.gone[i], at.bench.sight),
        predicts=float("nan"),
        says=f"{name.physics} at {name.where}, depends on {' and '.join(name.depends_on)}: size not determined",
        rivals=(),
        pulled=None,
    )


def _unnamed(at: Search) -> list[list[int]]:
    """Accepted terms that are no names, by port."""
    accepted, places = at.state.accepted, {term.port.where for term in at.bench.menu.terms}
    loose = {i for i, a in enumerate(accepted) if a.term.open}
    loose |= {i for group in pieces(accepted, len(places)) for i in group}
    ports = dict.fromkeys(accepted[i].term.port.where for i in sorted(loose))
    return [[i for i in sorted(loose) if accepted[i].term.port.where == where] for where in ports]


def _final(finding: Finding, unknown: Sequence[Finding]) -> bool:
    """Whether a name stands beside unknown causes: it explains enough, and by drivers of its own.

    A cause that is in no catalogue need not act through one port only.
    """
    return not any(
        finding.share < limits.CURVE_LEFTOVER * u.share or (_within(finding.name, u.name) and not _jumps(finding, u))
        for u in unknown
    )


def _jumps(finding: Finding, unknown: Finding) -> bool:
    """Whether a named step is no piece of an unknown curve over the same time: it explains more, and no curve jumps."""
    return finding.name.shape == Shape.STEP.value and finding.share > unknown.share


def _within(name: Named, unknown: Named) -> bool:
    """Whether an unknown cause may hold a name's drivers: weight is a function of the angles of the joints."""
    by_angles = name.where == unknown.where and all(OF_ANGLES.fullmatch(driver) for driver in unknown.depends_on)
    return _by_its_drivers(name, unknown) or (by_angles and _by_weight(name))


def _misweighed(finding: Finding, load: Finding, weighed: bool) -> bool:
    """Whether a cause may be what the weights behind a greater one are off by."""
    here = finding.name.where == load.name.where and all(OF_ANGLES.fullmatch(name) for name in finding.name.depends_on)
    unknown = not weighed and _by_weight(finding.name) and finding.share < limits.LOAD_SHARE * load.share
    return unknown or (here and finding.share < limits.LOAD_SHARE**2 * load.share)


def _by_weight(name: Named) -> bool:
    return any(driver.startswith(WEIGHTS) for driver in name.depends_on)


def _finding(at: Search, i: int, rivals: Sequence[Rival], predicts: float) -> Finding:
    """Its share as a square, not divided by that of all."""
    bench, a = at.bench, at.state.accepted[i]
    posterior = confidences(bench, a.term, rivals)
    same = np.array(
        [True, *(r.term.port.where == a.term.port.where and r.term.physics == a.term.physics for r in rivals)]
    )
    sizes = sizes_of(bench, i)
    p = at.p.get(a.term.key, 0.0)
    return Finding(
        name=named(a.term),
        parameters=sizes,
        share=bench.gone[i].squares,
        confidence=NAMED * float(posterior[same].sum()) * (1.0 - p),
        p=p,
        gain=gain_of(bench.gone[i], bench.sight),
        predicts=predicts,
        says=a.term.says(sizes),
        rivals=tuple(
            _rival(bench, a, r, NAMED * float(b) * (1.0 - p))
            for r, b, own in zip(rivals, posterior[1:], same[1:], strict=True)
            if not own or (r.term.order, r.term.depends_on) != (a.term.order, a.term.depends_on)
        ),
        pulled=pulled_back(bench, a),
        variant=a.term.variant,
    )


def _rival(bench: Bench, own: Accepted, rival: Rival, posterior: float) -> RivalName:
    other = rival.accepted
    inner = own.inner if other.term.inner == own.term.inner else other.inner  # both were fitted, hence not quite equal
    pair = ((own.term, own.inner), (other.term, inner))
    alike = _alike(*(orthonormal(bench.state.columns(term, values)) for term, values in pair))
    return RivalName(named(rival.term), posterior, rival.margin, rival.refitted, alike, rival.plausible)


def _alike(one: Floats, other: Floats) -> bool:
    """Whether two orthonormal bases (row, rank) span the same."""
    return one.shape == other.shape and bool(np.linalg.norm(other - one @ (one.T @ other)) < limits.SAME_EFFECT)


def _no_leftovers(names: Sequence[Finding], unknown: Sequence[Finding]) -> list[Finding]:
    """An unknown cause at a port takes along what was named there on the same drivers."""
    return [f for f in names if not any(_leftover(f, u) for u in unknown)]


def _leftover(finding: Finding, unknown: Finding) -> bool:
    here = finding.name.where == unknown.name.where
    return here and _by_its_drivers(finding.name, unknown.name) and not _jumps(finding, unknown)


def _by_its_drivers(name: Named, unknown: Named) -> bool:
    """Whether it depends on nothing but what an unknown cause depends on; friction turns with the sense of motion, what
    does not is no part of it.
    """
    speeds = {driver for driver in unknown.depends_on if SPEED.fullmatch(driver)}
    return speeds <= set(name.depends_on) <= set(unknown.depends_on)


def pieces(accepted: Sequence[Accepted], places: int) -> list[tuple[int, ...]]:
    """Groups of accepted names at one port that are no names but one unknown cause; `places` where a fault could be."""
    found: dict[str, list[int]] = {}
    for i, a in enumerate(accepted):
        if not a.term.open and all(map(_of_pose, a.term.depends_on)):
            found.setdefault(a.term.port.where, []).append(i)
    names = sum(not a.term.open for a in accepted)
    return [tuple(group) for group in found.values() if _meet_too_often(len(group), names - len(group), places)]


def _meet_too_often(here: int, at_others: int, places: int) -> bool:
    """Whether so many names at one of the places are no chance, at the rate of all others."""
    rate = (at_others + limits.UNSEEN_FAULTS) / max(places - 1, 1)
    return here >= limits.FAULTS_AT_ONE_PLACE and float(pdtrc(here - 1, rate)) * places < limits.FAULTS_BY_CHANCE


def _of_pose(driver: str) -> bool:
    return driver.startswith("gravity_torque") or (driver[0] == "q" and driver[1:].isdigit())


def unknown_cause(at: Search, group: Sequence[int], predicts: Floats) -> Finding:
    """One finding for the accepted open terms `group`, all of one port, the largest one first in the picture.

    `predicts` (term,) as `calibrate/diagnose/assess/assessment.py` gives it. The share is a square, not divided by that
    of all findings.
    """
    bench = at.bench
    gone = removed(bench.state, bench.sight, tuple(group))
    mine = [bench.state.accepted[i] for i in sorted(group, key=lambda i: -bench.gone[i].squares)]
    p = max(at.p.get(a.term.key, 0.0) for a in mine)
    name, size = _unnamed_size(bench, mine[0], gone)
    where, drivers = mine[0].term.port.where, tuple(dict.fromkeys(d for a in mine for d in a.term.depends_on))
    return Finding(
        name=Named(where, drivers, mine[0].term.shape.value, None, UNKNOWN),
        parameters={name: size},
        share=gone.squares,
        confidence=PLACED * (1.0 - p),
        p=p,
        gain=gain_of(gone, bench.sight),
        predicts=float(sum(predicts[i] for i in group)),
        says=f"Unknown cause at {where}, depends on {' and '.join(drivers)}: shows as {plain(name, size)} rms",
        rivals=(),
        pulled=pulled_back(bench, mine[0]),
    )


def _unnamed_size(bench: Bench, largest: Accepted, gone: Removed) -> tuple[str, Size]:
    """Root mean square at the port that only these terms explain, noise taken out, its name with its unit."""
    port, component = largest.term.port, _component(bench, largest)
    felt = float(np.linalg.norm(lever(bench, port, component)))
    left = max(bench.sight.rss / max(bench.sight.data, 1), 1e-300)
    shown = float(np.sqrt(max(gone.squares - len(gone.part) * left, 0.0)))
    # Each of the directions has the noise of a row: so has the length of them all, to first order.
    return f"rms_{unit_of(port, component)}", Size(shown / max(felt, 1e-300), float(np.sqrt(left)) / max(felt, 1e-300))


def _component(bench: Bench, accepted: Accepted) -> int:
    """Of the port, the one through which the readings feel the term most."""
    amount = accepted.term.amount(bench.state.drivers, accepted.coefficients, accepted.inner)
    moved = np.flatnonzero(np.any(amount != 0.0, axis=0))
    sample = np.maximum(bench.state.rows.sample, 0)
    felt = [float(np.linalg.norm(lever(bench, accepted.term.port, int(c)) * amount[sample, c])) for c in moved]
    return int(moved[int(np.argmax(felt))]) if len(moved) else 0
