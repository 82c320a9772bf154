"""`python -m benchmarks.proof_misses FOLDER`: every case in which something went wrong, one line each."""

import sys
from collections.abc import Iterator
from pathlib import Path

import msgspec

from calibeam.prove.page import hidden_words, said_words
from calibeam.prove.record import CaseScore, ProofFile
from calibeam.prove.seal import Layout
from calibeam.prove.tally import faults


def misses(proof: ProofFile) -> Iterator[str]:
    """Case, what was hidden, what was reported, what is wrong with that."""
    for case in proof.cases:
        wrong = faults(case)
        if wrong:
            yield f"{_head(case)}: hidden: {hidden_words(case)}; reported: {said_words(case)} [{', '.join(wrong)}]"


def _head(case: CaseScore) -> str:
    return f"{case.name} {case.kind} {case.family} {case.noise} N {case.samples}"


def main(folder: Path) -> None:
    """Prints them."""
    for line in misses(msgspec.json.decode(Layout(folder).proof.read_bytes(), type=ProofFile)):
        print(line)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
