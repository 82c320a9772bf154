"""Sums of a proof: shares by kind of case, by effect over noise, by instrument, by effect, by fault.

Shares have the interval of Wilson, J. Am. Stat. Assoc. 22, 1927, whose level also holds near 0 and 1.
"""

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.stats import binomtest

from calibeam.prove.raised import SURE, TROUBLES
from calibeam.prove.record import PLAIN, UNKNOWN, CaseScore, DefectScore

LEVEL = 0.95
NO_BREAK = "\u00a0"
TO = "\u2011"  # a hyphen at which no line ends


@dataclass(frozen=True)
class Share:
    """k of n."""

    k: int
    n: int

    @property
    def value(self) -> float:
        return self.k / self.n if self.n else math.nan

    @property
    def interval(self) -> tuple[float, float]:
        """95 % interval; (0, 1) where n is 0."""
        if not self.n:
            return (0.0, 1.0)
        found = binomtest(self.k, self.n).proportion_ci(LEVEL, method="wilson")
        return (float(found.low), float(found.high))

    @property
    def brief(self) -> str:
        """Without n; each half stays together where a line is short."""
        if not self.n:
            return "-"
        low, high = self.interval
        return f"{100 * self.value:.0f}{NO_BREAK}% ({100 * low:.0f}{TO}{100 * high:.0f})"

    def __str__(self) -> str:
        return self.brief if not self.n else f"{self.brief[:-1]}, n{NO_BREAK}{self.n})"


def share(hits: Iterable[bool]) -> Share:
    """How many are true."""
    counted = list(hits)
    return Share(sum(counted), len(counted))


BINS = (0.0, 0.15, 0.3, 0.6, 1.0, 2.0, 5.0, np.inf)  # effect over noise
CONFIDENCES = (0.3, 0.5, 0.8, 0.95, np.inf)
SINGLE = ("one", "disturbed")
NONE = "-"  # no case of that kind


@dataclass(frozen=True)
class TallyLine:
    """One line of a table about hidden causes."""

    label: str
    located: Share
    named: Share
    among_rivals: Share
    spurious: float | None  # findings beyond one for each hidden cause, a case; None: of causes, not of cases

    @property
    def shares(self) -> tuple[Share, Share, Share]:
        return (self.located, self.named, self.among_rivals)

    @property
    def others(self) -> str:
        return NONE if self.spurious is None else f"{self.spurious:.2f}"


@dataclass(frozen=True)
class ProofFigure:
    """One number of the proof and what it should be."""

    label: str
    said: str
    wanted: str


def by_enr(cases: Sequence[CaseScore]) -> list[TallyLine]:
    """Cases with one effect that a catalogue may list."""
    ones = [c for c in cases if c.kind in SINGLE]
    return [
        _line(f"{low:g} - {high:g}" if high < np.inf else f"> {low:g}", [c for c in ones if low <= _enr(c) < high])
        for low, high in pairwise(BINS)
    ]


def by(cases: Sequence[CaseScore], what: Callable[[CaseScore], str]) -> list[TallyLine]:
    """Plain single effects, grouped by a word about the case."""
    ones = [c for c in cases if c.kind in SINGLE and _enr(c) >= PLAIN]
    return [_line(word, [c for c in ones if what(c) == word]) for word in sorted({what(c) for c in ones})]


def plain(cases: Sequence[CaseScore], label: str) -> TallyLine:
    """Plain single effects, all together."""
    return _line(label, [c for c in cases if c.kind in SINGLE and _enr(c) >= PLAIN])


def by_effect(cases: Sequence[CaseScore]) -> list[TallyLine]:
    """Plain effects, single or several at once, by mechanism."""
    kept = [c for c in cases if c.kind in (*SINGLE, "three", "eighteen")]
    words = sorted({d.mechanism for c in kept for d in c.defects})
    out: list[TallyLine] = []
    for word in words:
        hits = [d for c in kept for d in c.defects if d.mechanism == word and d.enr >= PLAIN]
        if hits:
            out.append(_of(word, hits, None))
    return out


def at_once(cases: Sequence[CaseScore], kind: str) -> TallyLine:
    """Several effects at once: each counts."""
    return _line(kind, [c for c in cases if c.kind == kind])


def between_encoders(cases: Sequence[CaseScore]) -> list[TallyLine]:
    """Mechanisms of machine-like size between the two encoders of a joint."""
    ones = [c for c in cases if c.kind == "encoders" and c.defects]
    words = sorted({c.defects[0].mechanism for c in ones})
    return [_line(word, [c for c in ones if c.defects[0].mechanism == word]) for word in words]


OF_TROUBLES = ("cases", "located", "named", "asks for the column", "misnamed (>= 0.5)", "false alarms", "holds besides")


def by_trouble(cases: Sequence[CaseScore]) -> list[tuple[str, tuple[Share, ...]]]:
    """Of the kind `raised`, one line each: its name, and shares as in OF_TROUBLES; the first of all such cases."""
    raised = [c for c in cases if c.trouble]
    each = [(word, [c for c in raised if c.trouble == word]) for word in TROUBLES]
    return [(word, _shares_of_trouble(mine, len(raised))) for word, mine in each if mine]


def _shares_of_trouble(cases: Sequence[CaseScore], all_cases: int) -> tuple[Share, ...]:
    hidden = [d for c in cases for d in c.defects]
    return (
        Share(len(cases), all_cases),
        share(d.located for d in hidden),
        share(d.named for d in hidden),
        share(c.asks_for for c in cases if c.withheld),
        share(any(s.misnamed_from(SURE) for s in c.said) for c in cases),
        share(c.alarmed for c in cases if not c.defects),
        share(c.holds for c in cases if c.holds is not None),
    )


def by_fault(cases: Sequence[CaseScore]) -> list[TallyLine]:
    """Faults of motion, stamps and second encoders, found in streams."""
    ones = [c for c in cases if c.kind == "streams" and c.defects]
    words = sorted({c.defects[0].mechanism for c in ones})
    return [_line(word, [c for c in ones if c.defects[0].mechanism == word]) for word in words]


def by_motion(cases: Sequence[CaseScore]) -> list[TallyLine]:
    """Torques of recorded motions: those that can be seen, those that cannot, and the former by arm, way and mechanism.

    What is reported beside what is hidden is counted of all cases of a line.
    """
    moved = [c for c in cases if c.kind == "motion"]
    groups = [(word, [c for c in moved if word in (c.family, c.path)]) for word in sorted(_words(moved))]
    of_kinds = sorted({d.mechanism for d in _visible(moved)})
    return [
        _of(f"effect over noise >= {PLAIN:g}", _visible(moved), _others(moved)),
        _of(f"below {PLAIN:g}", [d for c in moved for d in c.defects if d.enr < PLAIN], None),
        *(_of(word, _visible(some), _others(some)) for word, some in groups),
        *(_of(kind, [d for d in _visible(moved) if d.mechanism == kind], None) for kind in of_kinds),
    ]


def _words(cases: Sequence[CaseScore]) -> set[str]:
    return {word for c in cases for word in (c.family, c.path)}


def _visible(cases: Sequence[CaseScore]) -> list[DefectScore]:
    return [d for c in cases for d in c.defects if d.enr >= PLAIN]


def _others(cases: Sequence[CaseScore]) -> float | None:
    """Findings where nothing is hidden, a case."""
    return float(np.mean([sum(not s.placed for s in c.said) for c in cases])) if cases else None


def of_motion(cases: Sequence[CaseScore]) -> list[ProofFigure]:
    """Of recorded motions; nothing where there are none."""
    moved = [c for c in cases if c.kind == "motion"]
    if not moved:
        return []
    outside = [d for d in _visible(moved) if d.physics == UNKNOWN]
    sizes = [s.inside for c in moved for d in c.defects for s in d.sizes]
    left = [c.torque_over_noise for c in moved if c.torque_over_noise is not None]
    return [
        ProofFigure(
            "motion: nothing hidden, nothing found", str(share(not c.alarmed for c in _quiet(moved))), ">= 94 %"
        ),
        ProofFigure(
            "motion: no catalogue lists it, unknown at its joint",
            str(share(d.unknown_there for d in outside)),
            ">= 90 %",
        ),
        ProofFigure("motion: stated sizes within 1.96 sigma", str(share(sizes)), "93 - 97 %"),
        ProofFigure("motion: unseen torque over noise, median and p90", percentiles(left), "<= 1.05, 1.15"),
        ProofFigure("motion: findings where nothing is hidden, a case", f"{_others(moved):.2f}", "<= 0.1"),
    ]


def _quiet(cases: Sequence[CaseScore]) -> list[CaseScore]:
    return [c for c in cases if not c.defects]


def figures(cases: Sequence[CaseScore]) -> list[ProofFigure]:
    """The rest of what was promised."""
    null = [c for c in cases if c.kind == "none"]
    outside = [c for c in cases if c.kind == "outside" and all(d.enr >= PLAIN for d in c.defects)]
    withheld = [c for c in cases if c.kind == "withheld" and all(d.enr >= PLAIN for d in c.defects)]
    faint = [s for c in cases if c.kind in SINGLE and 0.15 <= _enr(c) < 0.3 for s in c.said if s.physics != UNKNOWN]
    sizes = [s for c in cases for d in c.defects for s in d.sizes]
    out = [
        ProofFigure(f"false alarms, {noise} noise", str(share(c.alarmed for c in null if c.noise == noise)), wanted)
        for noise, wanted in (("white", "<= 6 %"), ("heavy", "<= 6 %"), ("wandering", "<= 8 %"))
    ]
    healthy = [c for c in cases if c.kind == "streams" and not c.defects]
    out.append(ProofFigure("false alarms, healthy streams", str(share(c.alarmed for c in healthy)), "none"))
    return [
        *out,
        ProofFigure("faint (0.15 - 0.3): what is named is right", str(share(s.right for s in faint)), "all"),
        *of_motion(cases),
        *_calibration(cases),
        ProofFigure("outside: place right", str(share(c.defects[0].located for c in outside)), ">= 90 %"),
        ProofFigure("outside: reported as unknown", str(share(_said_unknown(c) for c in outside)), ">= 90 %"),
        ProofFigure("outside: misnamed with confidence", str(share(c.misnamed for c in outside)), "<= 5 %"),
        ProofFigure(
            "withheld: names the missing column", str(share(c.asks_for and not c.misnamed for c in withheld)), ">= 95 %"
        ),
        ProofFigure(
            "withheld: reported as consistent", str(share(c.verdict == "consistent" for c in withheld)), "none"
        ),
        ProofFigure("stated sizes within 1.96 sigma", str(share(s.inside for s in sizes)), "93 - 97 %"),
        ProofFigure("diagnoses that failed", str(share(c.verdict == "failed" for c in cases)), "none"),
        *_ratios(cases),
    ]


def _calibration(cases: Sequence[CaseScore]) -> Iterable[ProofFigure]:
    """Whether a confidence is a share of names that are right."""
    names = [s for c in cases for s in c.said if s.physics != UNKNOWN]
    for low, high in pairwise(CONFIDENCES):
        mine = [s for s in names if low <= s.confidence < high]
        mean = f"{100.0 * float(np.mean([s.confidence for s in mine])):.0f}{NO_BREAK}%" if mine else NONE
        label = f"names of confidence {low:g} to {min(high, 1.0):g}: right"
        yield ProofFigure(label, str(share(s.right for s in mine)), f"as stated: {mean}")


def _ratios(cases: Sequence[CaseScore]) -> Iterable[ProofFigure]:
    floor = [c.held_out_after_m / c.floor_m for c in cases if c.held_out_after_m and c.floor_m and c.kind in SINGLE]
    yield ProofFigure("held-out / noise floor, median and p90", percentiles(floor, 50, 90), "<= 1.05, 1.15")
    free = [c for c in cases if c.free_space_before_m and c.free_space_after_m and c.kind in (*SINGLE, "three")]
    found = [c for c in free if c.said]
    ratio = [(c.free_space_after_m or 0.0) / (c.free_space_before_m or 1.0) for c in found]
    yield ProofFigure(
        "tool error over the workspace, after / before, where something was found", percentiles(ratio), ""
    )
    yield ProofFigure("tool error worse by more than a tenth", str(share(r > 1.1 for r in ratio)), "")
    yield ProofFigure("seconds a case (CPU), median and p90", percentiles([c.cpu_s for c in cases]), "<= 5")


def faults(case: CaseScore) -> list[str]:
    """What a strict reader would not let pass; nothing for a cause too faint to be asked for."""
    if case.error:
        return [f"failed: {case.error}"]
    out: list[str] = []
    if not case.defects:
        return out + (["false alarm"] if case.alarmed else [])
    out += [f"misnamed with confidence: {s.physics} at {s.where}" for s in case.said if s.misnamed]
    if case.kind == "motion":
        out += [f"nothing is hidden there: {s.physics} at {s.where}" for s in case.said if not (s.placed or s.misnamed)]
    if case.kind == "withheld":
        return out + ([] if case.asks_for else ["does not name the missing column"])
    for d in case.defects:
        if d.enr < PLAIN:
            continue
        if not d.located:
            out.append(f"{d.mechanism} not located")
        elif d.physics == UNKNOWN and not (d.unknown_there or case.unexplained):
            out.append(f"{d.mechanism} not reported as unknown")
        elif d.physics != UNKNOWN and not d.named:
            out.append(f"{d.mechanism} not named" + (", an alternative" if d.among_rivals else ""))
    return out


def _said_unknown(case: CaseScore) -> bool:
    """And nothing else reported as certain beside it."""
    return not case.misnamed and (case.unexplained or all(d.unknown_there for d in case.defects))


def _line(label: str, cases: Sequence[CaseScore]) -> TallyLine:
    spurious = [max(0, len(c.said) - sum(d.located for d in c.defects)) for c in cases]
    return _of(label, [d for c in cases for d in c.defects], float(np.mean(spurious)) if spurious else 0.0)


def _of(label: str, defects: Sequence[DefectScore], spurious: float | None) -> TallyLine:
    return TallyLine(
        label,
        share(d.located for d in defects),
        share(d.named for d in defects),
        share(d.among_rivals for d in defects),
        spurious,
    )


def _enr(case: CaseScore) -> float:
    return case.defects[0].enr if case.defects else 0.0


def percentiles(values: Sequence[float], *which: float) -> str:
    """Two percentiles (median and p90 by default) and of how many values."""
    if not values:
        return NONE
    low, high = np.percentile(values, which or (50, 90))
    return f"{low:.3g}, {high:.3g} (n {len(values)})"
