"""The concealed proof: conceal, publish the hashes, diagnose blindly, open the seals, score."""

import time
from collections.abc import Callable, Generator, Sequence
from contextlib import closing, contextmanager
from dataclasses import dataclass
from pathlib import Path

import msgspec

from calibeam.outcome import PartialResult, interruption
from calibeam.prove.concealing import Concealed, conceal_cases, publish
from calibeam.prove.diagnosing import Answered, diagnose_cases, reconciled
from calibeam.prove.page import write_proof_page
from calibeam.prove.raised import REPLAYED
from calibeam.prove.record import SCHEMA, ProofFile, Truth, truth_of
from calibeam.prove.scenario import DEVELOPMENT, Mix
from calibeam.prove.scoring import score
from calibeam.prove.seal import Layout, open_seal
from calibeam.software import SOFTWARE
from calibrate.errors import DataError
from calibrate.model.effects.catalogue import EFFECTS

Tell = Callable[[str], None]


@dataclass(frozen=True)
class Plan:
    """What is proved, and how much of it."""

    mix: Mix
    seed: int
    cases: int
    jobs: int
    without: tuple[str, ...] = ()  # physics that is taken out of the catalogue, to see what is reported then
    wired: int = 0  # further cases, whose recordings come over emulated wires


def prove(out: Path, plan: Plan, tell: Tell, command: str) -> ProofFile:
    """Everything, and proof.json in `out`. DataError where `out` holds something already; PartialResult by Ctrl-C."""
    _refuse_unlisted(plan.without)
    layout = fresh(out)
    with ending_early(out, tell, "the keys of its seals are never written") as count:
        return _proved(layout, plan, tell, count, command)


@contextmanager
def ending_early(out: Path, tell: Tell, reason: str) -> Generator[Tell]:
    """PartialResult instead of KeyboardInterrupt, with the last count that was reported by what is yielded.

    `reason`: why it cannot be continued.
    """
    last = "nothing was finished"

    def count(word: str) -> None:
        nonlocal last
        last = word
        tell(word)

    try:
        yield count
    except KeyboardInterrupt as why:
        raise PartialResult(
            f"{interruption(why)}; {last}; the files are kept in {out}, but a proof cannot be continued, because "
            f"{reason}; start it again with another --out"
        ) from why


def _proved(layout: Layout, plan: Plan, tell: Tell, count: Tell, command: str) -> ProofFile:
    began_s, total = time.monotonic(), plan.cases + plan.wired
    concealed: list[Concealed] = []
    with closing(conceal_cases(layout, plan.mix, plan.seed, plan.cases, plan.jobs, plan.wired)) as coming:
        for one in coming:
            concealed.append(one)
            count(f"concealed {len(concealed)} of {total}")
    concealed.sort(key=lambda one: one.scenario.name)
    published = publish(layout, concealed)
    tell(f"SHA-256 of {layout.hashes.name}, which seals all {total} cases: {published}")
    answered: list[Answered] = []
    names = [c.scenario.name for c in concealed]
    with closing(diagnose_cases(layout, names, plan.jobs, plan.without)) as answers:
        for answer in answers:
            answered.append(answer)
            count(f"diagnosed {len(answered)} of {total}")
    for one in concealed:
        if one.scenario.trouble == REPLAYED:
            reconciled(layout, one.scenario.name, layout.replayed(one.scenario.name))
    truths = [_opened(layout, c, plan.without) for c in concealed]
    scored = [score(layout, c, a, t) for c, a, t in zip(concealed, answered, truths, strict=True)]
    proof = ProofFile(
        SCHEMA,
        SOFTWARE,
        plan.seed,
        plan.seed < DEVELOPMENT,
        command,
        published,
        time.monotonic() - began_s,
        tuple(scored),
        plan.without,
    )
    layout.proof.write_bytes(msgspec.json.format(msgspec.json.encode(proof), indent=1) + b"\n")
    write_proof_page(layout.page, proof)
    return proof


def _refuse_unlisted(without: Sequence[str]) -> None:
    known = sorted({e.physics for e in EFFECTS})
    for name in without:
        if name not in known:
            raise DataError(f"--without {name}: no physics of the catalogue; there are {', '.join(known)}")


def fresh(out: Path) -> Layout:
    """An empty folder. DataError where it holds something."""
    if out.exists() and any(out.iterdir()):
        raise DataError(f"{out}: the folder is not empty; a proof starts from nothing, give another --out")
    out.mkdir(parents=True, exist_ok=True)
    return Layout(out)


def _opened(layout: Layout, concealed: Concealed, without: Sequence[str]) -> Truth:
    """From now on the truth lies in clear beside the answer."""
    name = concealed.scenario.name
    content = open_seal(layout.seal(name).read_bytes(), concealed.key, concealed.sha256)
    path = layout.revealed(name)
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(content)
    return truth_of(content, without)
