"""From accepted terms to findings: sizes with sigmas, share, rivals, picture, and one finding for one cause.

Several names at one place of a machine that is sound elsewhere: pieces of one law that nobody has listed.
Sines of a joint's angle and its torque build up any function of the pose, so a few of them that fit prove little.
Faults that have nothing to do with each other are spread over a machine; three of them at one joint and next to none
anywhere else are one cause.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.stats import poisson

from calibrate.diagnose.bench import Bench
from calibrate.diagnose.diagnosis import UNKNOWN, Finding, Named, RivalName
from calibrate.diagnose.linearised import Accepted
from calibrate.diagnose.pulled_back import pulled_back
from calibrate.diagnose.rivals import Rival, confidences
from calibrate.diagnose.score import gain_of, orthonormal
from calibrate.diagnose.searching import Search
from calibrate.diagnose.stated_sizes import sizes_of
from calibrate.diagnose.unknown_cause import unknown_cause
from calibrate.effects.term import Term

Floats = NDArray[np.float64]

NOT_FINAL = 0.5  # of the confidence in a name that may be the rest of something else
ALIKE = 1e-6  # sine between what two names can make of the readings
LEFTOVER = 0.1  # of what an unknown cause explains: a curve may leave so much of a law that it only resembles

SEVERAL = 3  # two may share a joint
BY_CHANCE = 0.01  # that so many faults meet at one of the places
UNSEEN = 0.5  # of a fault, for those elsewhere that are too small to be found (Jeffreys' prior of a Poisson rate)


def named(term: Term) -> Named:
    return Named(term.port.where, term.depends_on, term.shape.value, term.order, UNKNOWN if term.open else term.physics)


def findings_of(
    at: Search, rivals: Sequence[Sequence[Rival]], predicts: Floats, final: bool = True
) -> tuple[Finding, ...]:
    """Largest first. `rivals` of each term; `predicts` (term,) as calibrate/diagnose/doubt.py gives it.

    All that is unknown at one port is one finding. `final`: no structure is left without a name; while some is, no
    name of physics is more likely than not.
    """
    accepted = at.state.accepted
    unnamed = _unnamed(at)
    taken = {i for group in unnamed for i in group}
    names = [_finding(at, i, rivals[i], float(predicts[i])) for i in range(len(accepted)) if i not in taken]
    unknown = [unknown_cause(at, group, predicts) for group in unnamed]
    names = [f if final and _final(f, unknown) else replace(f, confidence=NOT_FINAL * f.confidence) for f in names]
    explained = max(sum(f.share for f in (*names, *unknown)), 1e-300)
    found = [replace(f, share=f.share / explained) for f in (*_no_leftovers(names, unknown), *unknown)]
    return tuple(sorted(found, key=lambda f: -f.share))


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
    """Whether a name says what it does beside unknown causes: it explains enough, and by drivers of its own.

    A cause that is in no catalogue need not act through one port only.
    """
    drivers = set(finding.name.depends_on)
    return not any(finding.share < LEFTOVER * u.share or drivers <= set(u.name.depends_on) for u in unknown)


def _finding(at: Search, i: int, rivals: Sequence[Rival], predicts: float) -> Finding:
    """Its share as a square, not divided by that of all."""
    bench, a = at.bench, at.state.accepted[i]
    belief = confidences(rivals)
    same = np.array(
        [True, *(r.term.port.where == a.term.port.where and r.term.physics == a.term.physics for r in rivals)]
    )
    sizes = sizes_of(bench, i)
    p = at.p.get(a.term.key, 0.0)
    return Finding(
        name=named(a.term),
        parameters=sizes,
        share=bench.gone[i].squares,
        confidence=float(belief[same].sum()) * (1.0 - p),
        p=p,
        gain=gain_of(bench.gone[i], bench.sight),
        predicts=predicts,
        says=a.term.says(sizes),
        rivals=tuple(
            _rival(bench, a, r, float(b))
            for r, b, own in zip(rivals, belief[1:], same[1:], strict=True)
            if not own or (r.term.order, r.term.depends_on) != (a.term.order, a.term.depends_on)
        ),
        pulled=pulled_back(bench, a),
    )


def _rival(bench: Bench, own: Accepted, rival: Rival, belief: float) -> RivalName:
    other = rival.accepted
    inner = own.inner if other.term.inner == own.term.inner else other.inner  # both were fitted, hence not quite equal
    pair = ((own.term, own.inner), (other.term, inner))
    alike = _alike(*(orthonormal(bench.state.columns(term, values)) for term, values in pair))
    return RivalName(named(rival.term), belief, rival.margin, rival.refitted, alike, rival.plausible)


def _alike(one: Floats, other: Floats) -> bool:
    """Whether two orthonormal bases (row, rank) span the same."""
    return one.shape == other.shape and bool(np.linalg.norm(other - one @ (one.T @ other)) < ALIKE)


def _no_leftovers(names: Sequence[Finding], unknown: Sequence[Finding]) -> list[Finding]:
    """An unknown cause at a port takes along what was named there on the same drivers."""
    return [f for f in names if not any(_leftover(f, u) for u in unknown)]


def _leftover(finding: Finding, unknown: Finding) -> bool:
    return finding.name.where == unknown.name.where and set(finding.name.depends_on) <= set(unknown.name.depends_on)


def pieces(accepted: Sequence[Accepted], places: int) -> list[tuple[int, ...]]:
    """Groups of accepted names at one port that are no names but one unknown cause; `places` where a fault could be."""
    found: dict[str, list[int]] = {}
    for i, a in enumerate(accepted):
        if not a.term.open and all(map(_of_pose, a.term.depends_on)):
            found.setdefault(a.term.port.where, []).append(i)
    names = sum(not a.term.open for a in accepted)
    return [tuple(group) for group in found.values() if _meet_too_often(len(group), names - len(group), places)]


def _meet_too_often(here: int, elsewhere: int, places: int) -> bool:
    """Whether so many names at one of the places are no chance, at the rate of all others."""
    rate = (elsewhere + UNSEEN) / max(places - 1, 1)
    return here >= SEVERAL and float(poisson.sf(here - 1, rate)) * places < BY_CHANCE


def _of_pose(driver: str) -> bool:
    return driver.startswith("gravity_torque") or (driver[0] == "q" and driver[1:].isdigit())
