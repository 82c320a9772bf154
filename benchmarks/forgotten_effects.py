"""`python -m benchmarks.forgotten_effects OUT [PHYSICS ...]`: effects that the catalogue has forgotten.

One effect after the other is taken out; sessions with the mechanism behind it, plain enough, are diagnosed. It has to
be "unknown, at the right place"; the effect under another name, believed, is what this is to catch. `make mutate`.
"""

import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from calibeam.prove.prove import Plan, prove
from calibeam.prove.record import CaseScore, ProofFile
from calibeam.prove.scenario import Mix
from calibrate.errors import DataError
from simulators.conceal.wanted import Family

ENR = (2.0, 4.0)
CASES = 2
SEED = 301  # of development


@dataclass(frozen=True)
class Mutation:
    """An effect that is forgotten, and where it is met. `also`: names for the same signal, forgotten with it."""

    physics: str
    mechanism: str
    family: Family
    also: tuple[str, ...] = ()

    @property
    def without(self) -> tuple[str, ...]:
        return (self.physics, *self.also)


MUTATIONS = (
    Mutation("reading-lag", "slow-filter", "tracker"),
    Mutation("encoder-eccentricity", "encoder-eccentricity", "tracker", also=("encoder-harmonic",)),
    Mutation("backlash", "slack-drive", "dual-psd"),
    Mutation("joint-compliance", "soft-joint", "dual-psd"),
    Mutation("joint-coupling", "coupled-wrist", "dual-psd"),
    Mutation("tool-sag", "sagging-mount", "dual-psd"),
    Mutation("base-compliance", "soft-pedestal", "dual-psd"),
    Mutation("psd-nonlinearity", "psd-pincushion", "dual-psd"),
    Mutation("laser-thermal-drift", "warm-laser", "dual-psd"),
    Mutation("device-periodic", "wire-drum-out-of-round", "wire"),
)


def mutated(mutation: Mutation, out: Path) -> ProofFile:
    """A small proof without the effect, in a folder of its own."""
    mix = Mix(("one",), (mutation.family,), ENR, mutation.mechanism)
    plan = Plan(mix, SEED, CASES, jobs=1, without=mutation.without)
    return prove(out / mutation.physics, plan, lambda word: None, f"mutation: {mutation.physics}")


def caught(case: CaseScore) -> bool:
    """Located, called unknown there or unexplained, and no other name believed."""
    defect = case.defects[0]
    return defect.located and (defect.unknown_there or case.unexplained) and not case.misnamed


def report(chosen: Sequence[Mutation], out: Path) -> Iterator[str]:
    """A line for every case."""
    for mutation in chosen:
        for case in mutated(mutation, out).cases:
            said = ", ".join(f"{s.physics} at {s.where} ({s.confidence:.2f})" for s in case.said) or case.verdict
            verdict = "unknown at its place" if caught(case) else "NOT CAUGHT"
            yield f"{mutation.physics} forgotten, at {case.defects[0].port}: {verdict}; said: {said}"


def main(out: Path, names: Sequence[str]) -> int:
    """Exit code 1 where a forgotten effect got another name. DataError for a name that is not tried."""
    known = {m.physics: m for m in MUTATIONS}
    for name in names:
        if name not in known:
            raise DataError(f"{name}: not among those that are taken out; there are {', '.join(known)}")
    wrong = 0
    for line in report([known[n] for n in names] or MUTATIONS, out):
        print(line, flush=True)
        wrong += "NOT CAUGHT" in line
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1]), sys.argv[2:]))
