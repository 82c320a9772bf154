"""Asks the oracle and other methods about some of the cases, in worker processes, after the seals are open."""

from collections.abc import Callable, Sequence
from contextlib import closing

import msgspec

from calibeam.prove.comparison import Compared, compare
from calibeam.prove.layout import Layout
from calibeam.prove.record import CaseScore
from calibeam.prove.truth import Truth
from calibeam.worker_processes import in_workers
from calibrate.errors import DataError

ASKED = ("one", "disturbed", "three")
VISIBLE = 0.6  # effect over noise: of less there is too little to share out


def compared_cases(
    layout: Layout,
    cases: Sequence[CaseScore],
    truths: Sequence[Truth],
    most: int,
    jobs: int,
    tell: Callable[[str], None],
) -> list[CaseScore]:
    """All cases, the first `most` of those with plain effects with what others make of them."""
    fit = [i for i, c in enumerate(cases) if _worth_it(c)][:most]
    out = list(cases)
    if not fit:
        return out
    orders = [(layout, cases[i].name, truths[i], cases[i].family) for i in fit]
    with closing(in_workers(_compared, orders, jobs)) as coming:
        for number, (i, found) in enumerate(zip(fit, coming, strict=True), start=1):
            tell(f"compared {number} of {len(fit)}")
            if found is not None:
                out[i] = msgspec.structs.replace(
                    out[i],
                    oracle_before_m=found.before_m,
                    oracle_m=found.oracle_m,
                    oracle_free_space_m=found.free_space_m,
                    baselines=found.baselines,
                )
    return out


def _worth_it(case: CaseScore) -> bool:
    return case.kind in ASKED and not case.error and max(d.enr for d in case.defects) >= VISIBLE


def _compared(order: tuple[Layout, str, Truth, str]) -> Compared | None:
    """None where a recording cannot be fitted at all: the diagnosis has said so already."""
    layout, name, truth, family = order
    try:
        return compare(layout.recording(name), layout.answer(name), layout.asked(name), truth, family)
    except DataError:
        return None
