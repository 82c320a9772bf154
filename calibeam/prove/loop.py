"""The loop, concealed: worlds with wrong geometry and hidden physics, a simulation from their rig file, `reconcile`.

Each case is reconciled by the command itself, in a process that gets a recording and a rig file and no key. Only then
are the seals opened.
"""

import os
import subprocess
import sys
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing
from functools import partial
from pathlib import Path

import msgspec

from calibeam.prove.concealing import Concealed, conceal_cases, publish
from calibeam.prove.diagnosing import bare_environment
from calibeam.prove.prove import Tell, ending_early, fresh
from calibeam.prove.record import Truth, truth_of
from calibeam.prove.scenario import Kind, Mix
from calibeam.prove.seal import Layout, open_seal
from calibeam.results.reconciliation import AGREES, ReconcileFile
from calibeam.software import SOFTWARE
from calibrate.diagnose.file import read_diagnosis
from calibrate.diagnose.schema import DiagnosisFile
from simulators.conceal.wanted import Family

KINDS: tuple[Kind, ...] = ("one", "three", "outside", "none")
FAMILIES: tuple[Family, ...] = ("dual-psd", "tracker", "wire")  # cones read no length
HEAD = ("case", "kind", "family", "hidden", "found", "before", "after geometry", "after physics", "verdict", "failure")


class LoopCase(msgspec.Struct, frozen=True):
    """One case; numbers are rms over noise on unseen rows, of the instrument that is worst at the end."""

    name: str
    kind: str
    family: str
    hidden: tuple[str, ...]  # physics at port
    found: tuple[str, ...]
    before: float | None
    geometry: float | None
    after: float | None
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


def prove_loop(out: Path, cases: int, seed: int, jobs: int, tell: Tell) -> LoopFile:
    """Everything; loop.json and loop.md in `out`. DataError where it holds something; PartialResult by Ctrl-C."""
    layout = fresh(out)
    with ending_early(out, tell, "the keys of its seals are never written") as count:
        with closing(conceal_cases(layout, Mix(KINDS, FAMILIES), seed, cases, jobs)) as coming:
            concealed = sorted(coming, key=lambda one: one.scenario.name)
        published = publish(layout, concealed)
        tell(f"SHA-256 of {layout.hashes.name}, which seals all {cases} cases: {published}")
        errors: list[str] = []
        names = [one.scenario.name for one in concealed]
        with ThreadPoolExecutor(jobs) as pool:
            for error in pool.map(partial(_reconciled, layout), names):
                errors.append(error)
                count(f"reconciled {len(errors)} of {cases}")
        told = [_told(layout, one, error) for one, error in zip(concealed, errors, strict=True)]
    told.sort(key=lambda one: (not one.failure, one.name))
    file = LoopFile(1, "calibeam-loop", SOFTWARE, seed, published, tuple(told))
    (out / "loop.json").write_bytes(msgspec.json.format(msgspec.json.encode(file), indent=1) + b"\n")
    (out / "loop.md").write_text(table_text(file.cases), encoding="utf-8")
    return file


def _reconciled(layout: Layout, name: str) -> str:
    """What went wrong; empty where nothing did."""
    recording = layout.recording(name).absolute()
    words = ["reconcile", str(recording), "--simulation", str(recording / "rig.toml")]
    layout.answers.mkdir(parents=True, exist_ok=True)
    done = subprocess.run(  # noqa: S603 - our own interpreter and our own command
        [sys.executable, "-m", "calibeam", *words, "--out", str(layout.answer(name).absolute())],
        capture_output=True,
        text=True,
        env=bare_environment(os.environ),
        cwd=layout.answers,
        check=False,
    )
    return "" if done.returncode == 0 else " ".join(done.stderr.split()) or f"ended with code {done.returncode}"


def _told(layout: Layout, one: Concealed, error: str) -> LoopCase:
    """With the seal open."""
    name, wanted = one.scenario.name, one.scenario.wanted
    truth = truth_of(open_seal(layout.seal(name).read_bytes(), one.key, one.sha256))
    hidden = tuple(f"{d.physics} at {d.port}" for d in truth.defects)
    folder = layout.answer(name)
    if error:
        return LoopCase(name, one.scenario.kind, wanted.family, hidden, (), None, None, None, "", error)
    file = msgspec.json.decode((folder / "reconcile.json").read_bytes(), type=ReconcileFile)
    diagnosis = read_diagnosis(folder / "diagnosis.json")
    found = tuple(f"{f.physics} at {f.where}" for f in diagnosis.findings)
    worst = max(file.unseen, key=lambda u: u.after)
    failure = "; ".join(_failures(truth, diagnosis, worst.after))
    far = worst.before, worst.geometry, worst.after
    return LoopCase(name, one.scenario.kind, wanted.family, hidden, found, *far, file.verdict, failure)


def _failures(truth: Truth, diagnosis: DiagnosisFile, after: float) -> list[str]:
    """What should not be; a cause that no catalogue lists may have any name, but has to leave no more than noise."""
    hidden = {(d.port, d.physics) for d in truth.defects}
    found = {(f.where, f.physics) for f in diagnosis.findings}
    out = [f"{after:.2f} times the noise remain"] if not after <= AGREES else []
    out += [f"not named: {physics} at {port}" for port, physics in sorted(hidden - found) if physics != "unknown"]
    if not hidden and found:
        out.append("something found where nothing is hidden")
    return out


def table_text(cases: Sequence[LoopCase]) -> str:
    """A Markdown table in the order given."""
    rows = [
        (
            one.name,
            one.kind,
            one.family,
            ", ".join(one.hidden) or "nothing",
            ", ".join(one.found) or "nothing",
            *("-" if value is None else f"{value:.3g}" for value in (one.before, one.geometry, one.after)),
            one.verdict or "-",
            one.failure.replace("|", "/") or "none",
        )
        for one in cases
    ]
    return "\n".join("| " + " | ".join(row) + " |" for row in (HEAD, ("---",) * len(HEAD), *rows)) + "\n"
