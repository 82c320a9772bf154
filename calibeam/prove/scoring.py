"""Scores one case: what was said against what was hidden."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from scipy.optimize import linear_sum_assignment

from acquisition.recording import read
from calibeam.prove.concealing import Concealed
from calibeam.prove.diagnosing import Answered
from calibeam.prove.equivalent import same_name, same_place
from calibeam.prove.free_space import errors_m
from calibeam.prove.layout import Layout
from calibeam.prove.noise_floor import floor_m
from calibeam.prove.record import UNKNOWN, CaseScore, DefectScore, Said, SizeScore
from calibeam.prove.truth import TrueDefect, Truth
from calibeam.prove.unseen_file import read_unseen
from calibrate.diagnose.file import read_diagnosis
from calibrate.diagnose.schema import DiagnosisFile, FindingRecord, NameRecord

FAILED = "failed"
TIED = 0.5  # of BIC: told as equal


def score(layout: Layout, concealed: Concealed, answered: Answered, truth: Truth) -> CaseScore:
    """Of an opened seal and an answer; a diagnosis that did not end has said nothing."""
    drawn, wanted = concealed.scenario, concealed.scenario.wanted
    file = None if answered.error else read_diagnosis(layout.answer(drawn.name) / "diagnosis.json")
    own = _own(truth.defects, () if file is None else file.findings, wanted.family)
    left = _left_over(file)
    defects = tuple(_defect(d, findings, left, wanted.family) for d, findings in zip(truth.defects, own, strict=True))
    before_m, after_m = _free_space(layout.answer(drawn.name), truth)
    return CaseScore(
        name=drawn.name,
        sha256=concealed.sha256,
        kind="outside" if defects and all(d.physics == UNKNOWN for d in defects) else drawn.kind,
        family=wanted.family,
        places=wanted.places,
        samples=len(truth.exact.values_m),
        noise=wanted.noise,
        seed=wanted.seed,
        enr_wanted=wanted.enr,
        attempts=concealed.attempts,
        withheld=truth.withheld,
        verdict=FAILED if file is None else file.verdict,
        defects=defects,
        said=() if file is None else tuple(_said(f, truth, wanted.family) for f in file.findings),
        unexplained=file is not None and file.unexplained is not None,
        asks_for=file is not None and _asks_for(file, truth, defects),
        held_out_before_m=None if file is None else file.rms_before_m,
        held_out_after_m=None if file is None else file.rms_after_m,
        floor_m=floor_m(read(layout.recording(drawn.name)).samples, truth, wanted.family),
        free_space_before_m=before_m,
        free_space_after_m=after_m,
        cpu_s=answered.cpu_s,
        error=answered.error,
        path=drawn.path,
    )


def _own(
    defects: Sequence[TrueDefect], findings: Sequence[FindingRecord], family: str
) -> list[tuple[FindingRecord, ...]]:
    """For each defect the findings that may count for it: those that are not worth more to another one.

    A name is that of one cause. `unknown` may stand for several at its place: a diagnosis does not part those.
    """
    worth = np.array([[_worth(d, f, family) for f in findings] for d in defects]).reshape(len(defects), len(findings))
    rows, columns = linear_sum_assignment(worth, maximize=True)
    owner = {int(c): int(r) for r, c in zip(rows, columns, strict=True) if worth[r, c] > 0.0}
    return [
        tuple(f for c, f in enumerate(findings) if f.physics == UNKNOWN or owner.get(c, row) == row)
        for row in range(len(defects))
    ]


def _worth(defect: TrueDefect, finding: FindingRecord, family: str) -> float:
    """Named, by its own driver, before named, before located."""
    why = same_place(defect.port, finding.where, family)
    if why is None:
        return 0.0
    if finding.physics != defect.physics and not _as_good(finding, defect, why):
        return 1.0
    return 20.0 if _same_driver(defect, finding) else 10.0


def _left_over(file: DiagnosisFile | None) -> tuple[str, ...]:
    """Places of what was said to be unexplained."""
    if file is None:
        return ()
    return tuple(u.where for u in (file.unexplained, *file.also_unexplained) if u is not None)


def _defect(defect: TrueDefect, findings: Sequence[FindingRecord], left: Sequence[str], family: str) -> DefectScore:
    """Of the findings that may count for it; a cause of no catalogue may as well be `left` unexplained at its place."""
    unexplained = defect.physics == UNKNOWN and any(same_place(defect.port, w, family) is not None for w in left)
    there = [(f, why) for f in findings if (why := same_place(defect.port, f.where, family)) is not None]
    named = [(f, why) for f, why in there if f.physics == defect.physics or _as_good(f, defect, why)]
    rivals = [r for f in findings for r in f.rivals if _is(r, defect, family)]
    best, why = (named or there or [(None, "")])[0]
    return DefectScore(
        mechanism=defect.mechanism,
        physics=defect.physics,
        port=defect.port,
        depends_on=defect.drivers,
        enr=defect.enr,
        located=bool(there) or unexplained,
        equivalent=why,
        named=bool(named),
        driver=any(_same_driver(defect, f) for f, _ in named),
        among_rivals=bool(named or rivals),
        unknown_there=unexplained or any(f.physics == UNKNOWN for f, _ in there),
        sizes=() if best is None or not named or why else _sizes(defect, best),  # another place, another quantity
    )


def _as_good(finding: FindingRecord, defect: TrueDefect, why: str) -> bool:
    """A name that no reading can tell from the true one, if the answer says itself that it could be that."""
    tied = any(r.physics == defect.physics and r.margin < TIED for r in finding.rivals)
    return same_name(defect.physics, finding.physics, why) and tied


def _is(name: NameRecord, defect: TrueDefect, family: str) -> bool:
    return name.physics == defect.physics and same_place(defect.port, name.where, family) is not None


def _same_driver(defect: TrueDefect, finding: FindingRecord) -> bool:
    """At least one of the true ones: of a late clock or an arm that has not settled each joint is as good."""
    return not defect.drivers or bool(set(defect.drivers) & set(finding.depends_on.split(",")))


def _sizes(defect: TrueDefect, finding: FindingRecord) -> tuple[SizeScore, ...]:
    """Of every figure that both sides state."""
    out: list[SizeScore] = []
    for name, true in defect.figures.items():
        said = finding.parameters.get(name)
        if said is not None and said.value is not None and said.sigma:
            out.append(SizeScore(name, true, said.value, said.sigma))
    return tuple(out)


def _said(finding: FindingRecord, truth: Truth, family: str) -> Said:
    near = [(d, same_place(d.port, finding.where, family)) for d in truth.defects]
    there = [(d, why) for d, why in near if why is not None]
    return Said(
        where=finding.where,
        depends_on=finding.depends_on,
        physics=finding.physics,
        confidence=finding.confidence,
        says=finding.says,
        placed=bool(there),
        right=any(d.physics == finding.physics or _as_good(finding, d, why) for d, why in there),
    )


def _asks_for(file: DiagnosisFile, truth: Truth, defects: tuple[DefectScore, ...]) -> bool:
    """Doubt, and the missing column by name; or the right cause without it."""
    if not truth.withheld:
        return False
    if all(d.named for d in defects):
        return True
    doubts = file.verdict == "undecidable" or file.unexplained is not None
    told = [n.column for n in file.not_recorded] + list(file.next)
    return doubts and any(_stem(column) in text for column in truth.withheld for text in told)


def _stem(column: str) -> str:
    """`approach` of approach1, `temp_link` of temp_link2_degC: a rig has one for every joint."""
    return column.removesuffix("_degC").rstrip("0123456789")


def _free_space(answer: Path, truth: Truth) -> tuple[float | None, float | None]:
    before, after = read_unseen(answer / "unseen.npz")
    return errors_m(before, truth.free_space), errors_m(after, truth.free_space)
