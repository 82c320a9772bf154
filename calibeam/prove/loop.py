"""The loop, concealed: worlds with wrong geometry and hidden physics, a simulation from their rig file, `reconcile`.

Each case is reconciled by the command itself, in a process that gets a recording and a rig file and no key. Only then
are the seals opened.
"""

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing
from itertools import repeat
from pathlib import Path

import msgspec
import numpy as np

from calibeam.prove.concealing import Concealed, conceal_cases, publish
from calibeam.prove.diagnosing import reconciled
from calibeam.prove.prove import Tell, ending_early, fresh
from calibeam.prove.record import Truth, truth_of
from calibeam.prove.scenario import Kind, Mix
from calibeam.prove.scoring import added_noise_m
from calibeam.prove.seal import Layout, open_seal
from calibeam.software import SOFTWARE
from calibrate.compare.reconciled_rows import AGREES, ReconcileFile
from calibrate.diagnose.record.file import read_diagnosis
from calibrate.diagnose.record.schema import DiagnosisFile
from simulators.conceal.wanted import Family

SHARES: dict[Kind, float] = {"one": 0.35, "three": 0.25, "encoders": 0.2, "outside": 0.1, "none": 0.1}
FAMILIES: tuple[Family, ...] = ("dual-psd", "tracker", "wire")  # cones read no length
HEAD = (
    *("case", "kind", "family", "recorded", "hidden", "found"),
    *("before", "after geometry", "after physics", "by its own noise", "verdict", "failure"),
)


class LoopCase(msgspec.Struct, frozen=True):
    """One case; numbers are rms over noise on unseen rows. The noise is what was really added to these very rows, which
    the seal holds; `said` is `after` with the noise that the reconciliation itself works with.
    """

    name: str
    kind: str
    family: str
    path: str  # in process or on wires
    hidden: tuple[str, ...]  # physics at port
    found: tuple[str, ...]
    before: float | None
    geometry: float | None
    after: float | None
    said: float | None
    verdict: str
    failure: str  # empty: none


class LoopFile(msgspec.Struct, frozen=True):
    """Content of loop.json, failures first."""

    schema: int
    kind: str
    software: str
    seed: int
    sha256: str  # of hashes.txt, which seals all cases
    cases: tuple[LoopCase, ...]


def prove_loop(out: Path, cases: int, wired: int, seed: int, jobs: int, tell: Tell) -> LoopFile:
    """Everything; loop.json and loop.md in `out`. `wired`: further cases, recorded over emulated wires.

    DataError where `out` holds something; PartialResult by Ctrl-C.
    """
    total = cases + wired
    layout, mix = fresh(out), Mix(tuple(SHARES), FAMILIES, shares=SHARES)
    with ending_early(out, tell, "its keys are never written: begin it again with another --out") as count:
        with closing(conceal_cases(layout, mix, seed, cases, jobs, range(total))) as coming:
            concealed = sorted(coming, key=lambda one: one.scenario.name)
        published = publish(layout, concealed)
        tell(f"SHA-256 of {layout.hashes.name}, which seals all {total} cases: {published}")
        errors: list[str] = []
        names = [one.scenario.name for one in concealed]
        with ThreadPoolExecutor(jobs) as pool:
            for error in pool.map(reconciled, repeat(layout), names, map(layout.answer, names)):
                errors.append(error)
                count(f"reconciled {len(errors)} of {total}")
        loop_cases = [_loop_case(layout, one, error) for one, error in zip(concealed, errors, strict=True)]
    loop_cases.sort(key=lambda one: (not one.failure, one.name))
    file = LoopFile(1, "calibeam-loop", SOFTWARE, seed, published, tuple(loop_cases))
    (out / "loop.json").write_bytes(msgspec.json.format(msgspec.json.encode(file), indent=1) + b"\n")
    text = "".join(f"{line}\n" for line in summary(file.cases)) + "\n" + table_text(file.cases)
    (out / "loop.md").write_text(text, encoding="utf-8")
    return file


def _loop_case(layout: Layout, one: Concealed, error: str) -> LoopCase:
    """With the seal open."""
    name, kind, family, path = one.scenario.name, one.scenario.kind, one.scenario.wanted.family, one.scenario.path
    truth = truth_of(open_seal(layout.seal(name).read_bytes(), one.key, one.sha256))
    hidden = tuple(f"{d.physics} at {d.port}" for d in truth.defects)
    folder = layout.answer(name)
    if error:
        return LoopCase(name, kind, family, path, hidden, (), None, None, None, None, "", error)
    file = msgspec.json.decode((folder / "reconcile.json").read_bytes(), type=ReconcileFile)
    diagnosis = read_diagnosis(folder / "diagnosis.json")
    found = tuple(f"{f.physics} at {f.where}" for f in diagnosis.findings)
    worst = max(file.unseen, key=lambda u: u.after)
    added_m = added_noise_m(layout, name, truth, family, file.unseen_rows)
    far = worst.before_m / added_m, worst.geometry_m / added_m, worst.after_m / added_m, worst.after
    failure = "; ".join(_failures(truth, diagnosis, worst.after_m / added_m))
    return LoopCase(name, kind, family, path, hidden, found, *far, file.verdict, failure)


def _failures(truth: Truth, diagnosis: DiagnosisFile, after: float) -> list[str]:
    """What should not be; a cause that no catalogue lists may have any name, but has to leave no more than noise."""
    hidden = {(d.port, d.physics) for d in truth.defects}
    found = {(f.where, f.physics) for f in diagnosis.findings}
    out = [f"{after:.2f} times the noise remain"] if not after <= AGREES else []
    out += [f"not named: {physics} at {port}" for port, physics in sorted(hidden - found) if physics != "unknown"]
    if not hidden and found:
        out.append("something found where nothing is hidden")
    return out


def summary(cases: Sequence[LoopCase]) -> list[str]:
    """Sentences: how far simulation and recording are apart at the end, and whether the verdicts hold."""
    ended = [one for one in cases if one.after is not None]
    groups = {"a cause of no catalogue": [c for c in ended if c.kind == "outside"]}
    groups = {"everything else": [c for c in ended if c.kind != "outside"], **groups}
    out = [f"cases: {len(cases)}, {len(ended)} reconciled, {sum(not c.failure for c in cases)} without a failure"]
    for what, group in groups.items():
        if group:
            far = np.array([c.after for c in group], dtype=np.float64)
            out.append(
                f"{what} ({len(group)}): after physics {np.median(far):.3f} times the noise in the median, "
                f"{np.quantile(far, 0.9):.3f} in nine of ten, {far.max():.3f} at most"
            )
    early = sum(c.verdict == "agree" and c.after is not None and c.after > AGREES for c in ended)
    quiet = [c for c in ended if not c.hidden]
    agree = sum(c.verdict == "agree" for c in ended)
    out.append(f"verdict agree: {agree}, of these {early} above {AGREES} times the noise")
    out.append(f"nothing hidden ({len(quiet)}): nothing found in {sum(not c.found for c in quiet)}")
    return out


def table_text(cases: Sequence[LoopCase]) -> str:
    """A Markdown table in the order given."""
    rows = [
        (
            one.name,
            one.kind,
            one.family,
            one.path,
            ", ".join(one.hidden) or "nothing",
            ", ".join(one.found) or "nothing",
            *("-" if value is None else f"{value:.3g}" for value in (one.before, one.geometry, one.after, one.said)),
            one.verdict or "-",
            one.failure.replace("|", "/") or "none",
        )
        for one in cases
    ]
    return "\n".join("| " + " | ".join(row) + " |" for row in (HEAD, ("---",) * len(HEAD), *rows)) + "\n"
