"""A proof in five sentences: what was found, what was said for nothing, and what it is worth."""

from collections.abc import Sequence

import numpy as np

from calibeam.prove.interval import share
from calibeam.prove.record import CaseScore
from calibeam.prove.story import faults
from calibeam.prove.tally import PLAIN, oracle_share, plain


def summary(cases: Sequence[CaseScore]) -> list[str]:
    """One sentence for each kind of case that there is."""
    return [s for s in (_single(cases), _nothing(cases), _outside(cases), _gain(cases), _faulty(cases)) if s]


def _single(cases: Sequence[CaseScore]) -> str:
    line = plain(cases, "")
    if not line.located.n:
        return ""
    return (
        f"{line.located.n} single causes of {PLAIN:g} times the noise and more: located {line.located.brief}, named "
        f"{line.named.brief}, named or among the rivals {line.among_rivals.brief}."
    )


def _nothing(cases: Sequence[CaseScore]) -> str:
    null = [c for c in cases if not c.defects]
    if not null:
        return ""
    return f"{len(null)} sessions with nothing wrong: something was said in {share(c.alarmed for c in null).brief}."


def _outside(cases: Sequence[CaseScore]) -> str:
    strange = [c for c in cases if c.kind == "outside" and all(d.enr >= PLAIN for d in c.defects)]
    if not strange:
        return ""
    found, wrong = share(c.defects[0].located for c in strange), share(c.misnamed for c in strange)
    return (
        f"{len(strange)} mechanisms of no catalogue: located {found.brief}, given a wrong name with confidence "
        f"{wrong.brief}."
    )


def _gain(cases: Sequence[CaseScore]) -> str:
    gains = [g for c in cases if (g := oracle_share(c)) is not None]
    if not gains:
        return ""
    return (
        f"On unseen samples of {len(gains)} cases the diagnosis removes {float(np.median(gains)):.2f} (median) of what "
        "an oracle removes that is told the truth."
    )


def _faulty(cases: Sequence[CaseScore]) -> str:
    wrong = sum(bool(faults(c)) for c in cases)
    return f"{wrong} of {len(cases)} cases hold something that a strict reader would not let pass; they stand first."
