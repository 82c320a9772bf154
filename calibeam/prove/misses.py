"""`python -m calibeam.prove.misses proof.json`: every case in which something went wrong, one line each."""

import sys
from collections.abc import Iterator
from pathlib import Path

import msgspec

from calibeam.prove.record import CaseScore, ProofFile
from calibeam.prove.story import faults, hidden_words, said_words


def misses(proof: ProofFile) -> Iterator[str]:
    """Case, what was hidden, what was said, what is wrong with that."""
    for case in proof.cases:
        wrong = faults(case)
        if wrong:
            yield f"{_head(case)}: hidden: {hidden_words(case)}; said: {said_words(case)} [{', '.join(wrong)}]"


def _head(case: CaseScore) -> str:
    return f"{case.name} {case.kind} {case.family} {case.noise} N {case.samples}"


def main(path: Path) -> None:
    """Prints them."""
    proof = msgspec.json.decode(path.read_bytes(), type=ProofFile)
    for line in misses(proof):
        print(line)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
