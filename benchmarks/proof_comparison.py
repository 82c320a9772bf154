"""`python -m benchmarks.proof_comparison FOLDER [MOST]`: an oracle and other methods on the cases of a finished proof.

The first MOST cases with plain effects, from the folder of `calibeam prove`, whose seals are open. Prints the sums and
writes comparison.json beside proof.json; `benchmarks.proof_table` publishes both.
"""

import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path

import msgspec
import numpy as np

from benchmarks.proof_oracle import DIAGNOSIS, WORTH, Compared, compare
from calibeam.prove.page import hidden_words
from calibeam.prove.record import PLAIN, CaseScore, ProofFile, ProofRecord, truth_of
from calibeam.prove.seal import Layout
from calibeam.prove.tally import NONE, ProofFigure, percentiles
from calibeam.worker_processes import in_workers
from calibrate.errors import DataError
from calibrate.quantities import (
    length,
)

FILE = "comparison.json"
MOST = 16  # cases
JOBS = 2  # processes
ASKED = ("one", "disturbed", "three")


class ComparisonFile(ProofRecord, frozen=True):
    """Content of comparison.json: by the name of the case."""

    wall_s: float
    cases: dict[str, Compared]


Pairs = Sequence[tuple[CaseScore, Compared]]


def read_proof(folder: Path) -> ProofFile:
    return msgspec.json.decode(Layout(folder).proof.read_bytes(), type=ProofFile)


def read_comparison(folder: Path) -> ComparisonFile:
    """Nothing compared where there is no file."""
    file = folder / FILE
    return msgspec.json.decode(file.read_bytes(), type=ComparisonFile) if file.is_file() else ComparisonFile(0.0, {})


def pairs_of(proof: ProofFile, comparison: ComparisonFile) -> Pairs:
    """Cases that were compared, in the order of the proof."""
    return [(case, comparison.cases[case.name]) for case in proof.cases if case.name in comparison.cases]


def compared(folder: Path, proof: ProofFile, most: int, jobs: int) -> ComparisonFile:
    """The first `most` cases with plain effects, in worker processes; comparison.json in `folder`, too."""
    began_s = time.monotonic()
    asked = [c for c in proof.cases if _worth_it(c)][:most]
    orders = [(folder, c, proof.without) for c in asked]
    cases: dict[str, Compared] = {}
    with closing(in_workers(_compared, orders, jobs)) as coming:
        for number, (case, found) in enumerate(zip(asked, coming, strict=True), start=1):
            print(f"compared {number} of {len(asked)}", flush=True)
            if found is not None:
                cases[case.name] = found
    file = ComparisonFile(time.monotonic() - began_s, cases)
    (folder / FILE).write_bytes(msgspec.json.format(msgspec.json.encode(file), indent=1) + b"\n")
    return file


def _worth_it(case: CaseScore) -> bool:
    """Of a fainter effect there is too little to share out."""
    return case.kind in ASKED and not case.error and max(d.enr for d in case.defects) >= PLAIN


def _compared(order: tuple[Path, CaseScore, tuple[str, ...]]) -> Compared | None:
    """None where a recording cannot be fitted at all: the diagnosis has reported it already."""
    folder, case, without = order
    layout, name = Layout(folder), case.name
    truth = truth_of(layout.revealed(name).read_bytes(), without)
    try:
        return compare(layout.recording(name), layout.answer(name), layout.asked(name), truth, case.family)
    except DataError:
        return None


@dataclass(frozen=True)
class FreeSpaceLine:
    """Tool error over the workspace, of the cases of one instrument; medians, m."""

    label: str
    cases: int
    geometry_m: float
    found_m: float
    oracle_m: float

    @property
    def cells(self) -> tuple[str, ...]:
        return (self.label, str(self.cases), *map(length, (self.geometry_m, self.found_m, self.oracle_m)))


def by_instrument(pairs: Pairs) -> list[FreeSpaceLine]:
    """Of cases that have all three numbers."""
    numbers = [(case.family, three) for case, found in pairs if (three := _three_m(case, found)) is not None]
    lines: list[FreeSpaceLine] = []
    for word in sorted({family for family, _ in numbers}):
        mine = [three for family, three in numbers if family == word]
        geometry_m, found_m, oracle_m = map(float, np.median(mine, axis=0))
        lines.append(FreeSpaceLine(word, len(mine), geometry_m, found_m, oracle_m))
    return lines


def shares_of_oracle(pairs: Pairs) -> list[float]:
    """Share of the squared error over the workspace that the oracle removes and the diagnosis removed, too."""
    out: list[float] = []
    for case, found in pairs:
        three = _three_m(case, found)
        if three is not None and three[2] <= WORTH * three[0]:
            before, after, oracle = np.square(three)
            out.append(float((before - after) / (before - oracle)))
    return out


def _three_m(case: CaseScore, found: Compared) -> tuple[float, float, float] | None:
    """Tool error over the workspace: geometry alone, with what was found, oracle."""
    if case.free_space_before_m is None or case.free_space_after_m is None or found.free_space_m is None:
        return None
    return case.free_space_before_m, case.free_space_after_m, found.free_space_m


def oracle_figures(pairs: Pairs) -> tuple[ProofFigure, ...]:
    """How close the diagnosis comes to the oracle; none where nothing was compared."""
    if not pairs:
        return ()
    gains = [b.gain for _, found in pairs for b in found.baselines if b.method == DIAGNOSIS and b.gain is not None]
    held_out, removed = percentiles(gains, 50, 10), percentiles(shares_of_oracle(pairs), 50, 10)
    return (
        ProofFigure("held-out gain, share of the oracle's, median and p10", held_out, ">= 0.97, 0.85"),
        ProofFigure("tool error removed, share of the oracle's, median and p10", removed, ">= 0.9"),
    )


def by_method(pairs: Pairs) -> list[ProofFigure]:
    """All methods on the same unseen samples of the same cases: share of the oracle's gain."""
    gains: dict[str, list[float]] = {}
    for _, found in pairs:
        for score in found.baselines:
            gains.setdefault(score.method, []).extend([] if score.gain is None else [score.gain])
    return [ProofFigure(method, percentiles(mine, 50, 10), "") for method, mine in gains.items()]


def lines(pairs: Pairs) -> Iterator[str]:
    """The sums, then what each method reports of each case."""
    for figure in oracle_figures(pairs):
        yield f"{figure.label}: {figure.said}; wanted {figure.wanted}"
    for figure in by_method(pairs):
        yield f"share of the oracle's held-out gain, median and p10: {figure.label}: {figure.said}"
    for line in by_instrument(pairs):
        label, cases, geometry, found, oracle = line.cells
        yield (
            f"tool error over the workspace, {label} (n {cases}): geometry {geometry}, with what was found {found}, "
            f"oracle {oracle}"
        )
    for case, found in pairs:
        yield f"{case.name}: hidden: {hidden_words(case)}"
        for score in found.baselines:
            yield f"  {score.method}: {NONE if score.gain is None else f'{score.gain:.2f}'}; {score.says}"


def main(folder: Path, most: int = MOST) -> None:
    """Compares and prints."""
    proof = read_proof(folder)
    for line in lines(pairs_of(proof, compared(folder, proof, most, JOBS))):
        print(line)


if __name__ == "__main__":
    main(Path(sys.argv[1]), *map(int, sys.argv[2:3]))
