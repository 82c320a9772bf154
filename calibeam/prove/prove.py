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
from calibeam.prove.record import SCHEMA, CaseScore, ProofFile, ProofRecord, Truth, truth_of
from calibeam.prove.scenario import DEVELOPMENT, Mix
from calibeam.prove.scoring import score
from calibeam.prove.seal import Layout, fingerprint, open_seal
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

    @property
    def words(self) -> str:
        """All that a case depends on."""
        return f"{self.mix}, seed {self.seed}, {self.cases} cases and {self.wired} over wires, without {self.without}"


class Slice(ProofRecord, frozen=True):
    """Cases that were sealed, diagnosed and opened together."""

    hashes: str  # all that were published by then
    wall_s: float
    cases: tuple[CaseScore, ...]


class Begun(ProofRecord, frozen=True):
    """slices.json: what is finished of a proof."""

    of: str  # all of the plan that a case depends on
    slices: tuple[Slice, ...] = ()

    @property
    def cases(self) -> tuple[CaseScore, ...]:
        return tuple(case for one in self.slices for case in one.cases)


SLICE = 40  # cases in a slice: no more is lost by an interruption


def prove(out: Path, plan: Plan, tell: Tell, command: str, *, resume: bool = False) -> ProofFile:
    """Everything, and proof.json in `out`; to `resume` goes on after the last whole slice there.

    DataError where `out` holds something already, or to be resumed nothing of this plan; PartialResult by Ctrl-C.
    """
    _refuse_unlisted(plan.without)
    layout, begun = (Layout(out), _begun(out, plan)) if resume else (fresh(out), Begun(plan.words))
    with ending_early(out, tell, f"{SLICE} cases at a time are finished: go on with --resume") as count:
        numbers = range(plan.cases + plan.wired)[::-1] if plan.wired else range(plan.cases)  # sessions on wires first
        for at in range(len(begun.cases), len(numbers), SLICE):
            done = _slice(layout, plan, numbers[at : at + SLICE], begun, tell, count)
            begun = msgspec.structs.replace(begun, slices=(*begun.slices, done))
            layout.slices.write_bytes(msgspec.json.encode(begun))
    return _whole(layout, plan, begun, command)


def _begun(out: Path, plan: Plan) -> Begun:
    path = Layout(out).slices
    try:
        begun = msgspec.json.decode(path.read_bytes(), type=Begun)
    except (OSError, msgspec.DecodeError) as why:
        raise DataError(f"{path}: nothing to resume ({why}); begin the proof without --resume") from why
    if begun.of != plan.words:
        raise DataError(f"{out}: begun with other options ({begun.of}); resume it with these, or give another --out")
    return begun


@contextmanager
def ending_early(out: Path, tell: Tell, how: str) -> Generator[Tell]:
    """PartialResult instead of KeyboardInterrupt, with the last count that was reported by what is yielded.

    `how` it goes on.
    """
    last = "nothing was finished"

    def count(word: str) -> None:
        nonlocal last
        last = word
        tell(word)

    try:
        yield count
    except KeyboardInterrupt as why:
        raise PartialResult(f"{interruption(why)}; {last}; the files are kept in {out}; {how}") from why


def _slice(layout: Layout, plan: Plan, numbers: Sequence[int], begun: Begun, tell: Tell, count: Tell) -> Slice:
    began_s, total, before = time.monotonic(), plan.cases + plan.wired, len(begun.cases)
    for number in numbers:
        layout.clear(f"case-{number:04d}")  # of a slice that was interrupted
    concealed: list[Concealed] = []
    with closing(conceal_cases(layout, plan.mix, plan.seed, plan.cases, plan.jobs, numbers)) as coming:
        for one in coming:
            concealed.append(one)
            count(f"concealed {before + len(concealed)} of {total}")
    concealed.sort(key=lambda one: one.scenario.name)
    published = publish(layout, concealed, begun.slices[-1].hashes if begun.slices else "")
    tell(f"SHA-256 of {layout.hashes.name}, which seals {before + len(concealed)} of {total} cases: {published}")
    answered: list[Answered] = []
    names = [c.scenario.name for c in concealed]
    with closing(diagnose_cases(layout, names, plan.jobs, plan.without)) as answers:
        for answer in answers:
            answered.append(answer)
            count(f"diagnosed {before + len(answered)} of {total}")
    for one in concealed:
        if one.scenario.trouble == REPLAYED:
            reconciled(layout, one.scenario.name, layout.replayed(one.scenario.name))
    truths = [_opened(layout, c, plan.without) for c in concealed]
    scored = [score(layout, c, a, t) for c, a, t in zip(concealed, answered, truths, strict=True)]
    return Slice(layout.hashes.read_text(encoding="utf-8"), time.monotonic() - began_s, tuple(scored))


def _whole(layout: Layout, plan: Plan, begun: Begun, command: str) -> ProofFile:
    published = fingerprint(layout.hashes.read_bytes())
    wall_s, cases = sum(one.wall_s for one in begun.slices), tuple(sorted(begun.cases, key=lambda one: one.name))
    developed = plan.seed < DEVELOPMENT
    proof = ProofFile(SCHEMA, SOFTWARE, plan.seed, developed, command, published, wall_s, cases, plan.without)
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
