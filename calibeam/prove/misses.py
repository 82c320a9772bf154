"""`python -m calibeam.prove.misses proof.json`: every case in which something went wrong, one line each.

Also each case in words: what was hidden, what was reported, what of that is wrong.
"""

import sys
from collections.abc import Iterator
from pathlib import Path

import msgspec

from calibeam.prove.record import PLAIN, UNKNOWN, CaseScore, ProofFile


def hidden_words(case: CaseScore) -> str:
    """All that the seal held."""
    if not case.defects:
        return f"nothing, {case.noise} noise"
    each = [f"{d.mechanism} ({d.physics}) at {d.port}, {d.enr:.2g} x noise" for d in case.defects]
    kept = f"; missing column: {', '.join(case.withheld)}" if case.withheld else ""
    return ", ".join(each) + kept


def hidden_briefly(case: CaseScore) -> str:
    """The same for a heading: what, where, and how large the largest."""
    match case.defects:
        case ():
            return f"nothing, {case.noise} noise"
        case (only,):
            kept = ", its column withheld" if case.withheld else ""
            return f"{only.mechanism} at {only.port}, {only.enr:.2g} x noise{kept}"
        case several:
            return f"{len(several)} causes"


def said_words(case: CaseScore) -> str:
    """Verdict and findings."""
    if not case.said:
        return case.verdict
    each = [f"{s.physics} at {s.where} by {s.depends_on or 'nothing recorded'} ({s.confidence:.2f})" for s in case.said]
    return f"{case.verdict}: " + ", ".join(each)


def faults(case: CaseScore) -> list[str]:
    """What a strict reader would not let pass; nothing for a cause too faint to be asked for."""
    if case.error:
        return [f"failed: {case.error}"]
    out: list[str] = []
    if not case.defects:
        return out + (["false alarm"] if case.alarmed else [])
    out += [f"misnamed with confidence: {s.physics} at {s.where}" for s in case.said if s.misnamed]
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


def misses(proof: ProofFile) -> Iterator[str]:
    """Case, what was hidden, what was reported, what is wrong with that."""
    for case in proof.cases:
        wrong = faults(case)
        if wrong:
            yield f"{_head(case)}: hidden: {hidden_words(case)}; reported: {said_words(case)} [{', '.join(wrong)}]"


def _head(case: CaseScore) -> str:
    return f"{case.name} {case.kind} {case.family} {case.noise} N {case.samples}"


def main(path: Path) -> None:
    """Prints them."""
    proof = msgspec.json.decode(path.read_bytes(), type=ProofFile)
    for line in misses(proof):
        print(line)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
