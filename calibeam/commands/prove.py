"""`calibeam prove`: hide physics in emulated sessions, diagnose them blindly, open the seals, and count."""

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter
from rich.table import Table

from calibeam.console import Console
from calibeam.prove.loop import prove_loop, summary
from calibeam.prove.page import hidden_words, said_words
from calibeam.prove.prove import Plan, prove
from calibeam.prove.raised import TROUBLES
from calibeam.prove.record import CaseScore, ProofFile
from calibeam.prove.scenario import DEVELOPMENT, KINDS, Kind, Mix
from calibeam.prove.tally import (
    OF_TROUBLES,
    Share,
    TallyLine,
    at_once,
    between_encoders,
    by,
    by_effect,
    by_enr,
    by_fault,
    by_motion,
    by_trouble,
    faults,
    figures,
)
from calibrate.errors import DataError
from simulators.conceal.wanted import FAMILIES, Family

PUBLISHED_SEED = 20261128  # of the table in docs/figures.md; its cases were not examined while the diagnosis was made
DEVELOPED_SEED = 1


def prove_command(
    *,
    cases: int = 60,
    seed: int | None = None,
    out: Path = Path("out/proof"),
    family: Annotated[tuple[Family, ...], Parameter(show_default=False)] = FAMILIES,
    kind: Annotated[tuple[Kind, ...], Parameter(show_default=False)] = KINDS,
    enr: tuple[float, float] | None = None,
    mechanism: str | None = None,
    jobs: int = 2,
    without: Annotated[tuple[str, ...], Parameter(show_default=False)] = (),
    wire: int = 0,
    resume: Annotated[bool, Parameter(negative=())] = False,
    loop: Annotated[bool, Parameter(negative=())] = False,
    publish: bool = False,
    json: bool = False,
) -> None:
    """Test the diagnosis on sessions with hidden physics.

    Physics is hidden in emulated sessions, diagnosed in processes that cannot see it, then revealed and counted.

    For example:

    ```
    calibeam prove --cases 300 --out out/proof
    ```

    Parameters
    ----------
    cases
        How many sessions.
    seed
        Everything is drawn from it. Below 1000: development, no figure for the public. Default: that of the
        published table with --publish, else 1.
    out
        Folder for recordings, seals, answers, proof.json and proof.html; has to be empty.
    family
        Instruments; default: all.
    kind
        Kinds of cases; default: all in their shares.
    enr
        Smallest and largest effect over noise.
    mechanism
        One mechanism by name, in cases with one effect (python -m simulators.conceal --list); a trouble by name, in
        cases of the kind `raised`.
    jobs
        Processes at a time.
    without
        Physics to take out of the catalogue: then its cases have to be called unknown, at the right place.
    wire
        Further cases whose recordings come over emulated wires: a minute each, two cores.
    resume
        Go on with the proof in --out that an interruption has ended; with the same options otherwise.
    loop
        Reconcile each case with the simulation of its rig file instead: how far off it is on unseen rows, before, after
        geometry and after physics. Takes --cases, --wire, --seed, --jobs and --out, and no other option.
    publish
        Refuse what no published table may be made of.
    json
        Print nothing but the path of proof.json.

    """
    console = Console(stderr=json)
    if loop:
        _loop(console, out, (cases, wire), DEVELOPED_SEED if seed is None else seed, jobs, json=json)
        return
    seed = seed if seed is not None else PUBLISHED_SEED if publish else DEVELOPED_SEED
    mix = Mix(kind, family, enr, mechanism)
    if "raised" in kind and mechanism is not None and mechanism not in TROUBLES:
        raise DataError(f"--mechanism {mechanism}: no trouble of the kind raised; there are {', '.join(TROUBLES)}")
    if publish and seed < DEVELOPMENT:
        raise DataError(f"seed {seed} is reserved for development; publish with --seed {DEVELOPMENT} or above")
    if publish and without:
        raise DataError("--without: a published table needs the whole catalogue; leave out --without or --publish")
    if publish and mix != Mix(KINDS, FAMILIES):
        raise DataError("a published table holds all kinds of cases; leave out --family, --kind, --enr and --mechanism")
    if cases < 1 or jobs < 1 or wire < 0:
        raise DataError(f"--cases {cases} --jobs {jobs} --wire {wire}: give 1 or more cases and jobs, wire 0 or more")
    plan = Plan(mix, seed, cases, jobs, without, wire)
    proof = prove(out, plan, lambda word: _tell(console, word), " ".join(["calibeam", *sys.argv[1:]]), resume=resume)
    _print_proof(console, proof)
    console.print(f"proof: {out / 'proof.json'}\npage: {out / 'proof.html'}", markup=False, highlight=False)
    if json:
        print(out / "proof.json")


def _print_proof(console: Console, proof: ProofFile) -> None:
    """All sums; each case stands in the file and on the page. Of motions, those with a fault come first."""
    cases = proof.cases
    for case in cases:
        if case.kind == "motion" and (wrong := faults(case)):
            words = f"{case.name}: hidden {hidden_words(case)}; reported {said_words(case)}: {'; '.join(wrong)}"
            console.print(words, markup=False, highlight=False)
    for title, lines in (
        ("one hidden effect, by effect over noise", by_enr(cases)),
        ("effect over noise >= 0.6, by instrument", by(cases, lambda c: c.family)),
        ("effect over noise >= 0.6, by the way of the recording", by(cases, lambda c: c.path)),
        ("several at once", [at_once(cases, "three"), at_once(cases, "eighteen")]),
        ("effect over noise >= 0.6, by mechanism", by_effect(cases)),
        ("faults of motion, stamps and second encoders, in streams", by_fault(cases)),
        ("between the two encoders of a joint", between_encoders(cases)),
        ("torques of recorded motions", by_motion(cases)),
    ):
        if any(line.located.n for line in lines):
            console.print(_lines(title, lines))
    if troubles := by_trouble(cases):
        console.print(_troubles(troubles))
    console.print(_figures(cases))
    for case in cases:
        if case.error:
            console.print(f"{case.name}: {case.error}", markup=False, highlight=False)


def _lines(title: str, lines: Sequence[TallyLine]) -> Table:
    table = Table(title=title, title_justify="left")
    for heading in ("", "n", "located", "named", "or among alternatives", "others reported, a case"):
        table.add_column(heading)
    for line in lines:
        if line.located.n:
            shares = (share.brief for share in line.shares)
            table.add_row(line.label, str(line.located.n), *shares, line.others)
    return table


def _troubles(lines: Sequence[tuple[str, tuple[Share, ...]]]) -> Table:
    table = Table("", *OF_TROUBLES, title="troubles that were met on real robots", title_justify="left")
    for label, (count, *shares) in lines:
        table.add_row(label, str(count.k), *(share.brief for share in shares))
    return table


def _figures(cases: Sequence[CaseScore]) -> Table:
    table = Table(title="uncertainty and proof", title_justify="left")
    for heading in ("", "measured", "wanted"):
        table.add_column(heading)
    for figure in figures(cases):
        table.add_row(figure.label, figure.said, figure.wanted)
    return table


def _loop(console: Console, out: Path, counts: tuple[int, int], seed: int, jobs: int, *, json: bool) -> None:
    cases, wired = counts
    if cases < 0 or wired < 0 or cases + wired < 1 or jobs < 1:
        raise DataError(f"--cases {cases} --wire {wired} --jobs {jobs}: give at least one case and one job")
    file = prove_loop(out, cases, wired, seed, jobs, lambda word: _tell(console, word))
    for line in summary(file.cases):
        _tell(console, line)
    for one in (one for one in file.cases if one.failure):
        _tell(console, f"{one.name}: {one.failure}")
    _tell(console, f"table: {out / 'loop.md'}")
    if json:
        print(out / "loop.json")


def _tell(console: Console, word: str) -> None:
    console.print(word, markup=False, highlight=False)
