"""The first sentence of a session's report: how good the arm is now, whether to trust it, and what to do next.

A pattern in the residuals is found by analysis of variance, by joint angle and by order. One factor at a time: rows
sorted by it into groups of equal size, F of the spread of the group means over the spread within groups. Source:
Fisher; Draper, Smith, Applied Regression Analysis, 3rd ed. 1998, ch. 23 (one-way analysis).
"""

from collections.abc import Iterator
from dataclasses import dataclass
from math import isfinite

import numpy as np
from numpy.typing import NDArray
from scipy.special import fdtrc

from calibrate.diagnose.record.schema import DiagnosisFile, SplitRecord, no_better_with_physics, of_poses
from calibrate.fit.accuracy import Alarm, checks_nothing
from calibrate.fit.solvers import Status
from calibrate.model.model_file import Fields, ModelFile, UnseenRows
from calibrate.model.sensors.catalogue import SOURCES, kind_of
from calibrate.quantities import counted, significant
from calibrate.report.elements.verdict import (
    AGAIN,
    MORE_POSES,
    NOISIER,
    TO_PROVE,
    UNCHECKED,
    UNPROVED,
    WORSE_UNSEEN,
    ReasonForCare,
    Trust,
    VerdictBox,
)
from calibrate.report.evidence.model_tests import (
    Repeated,
    ScatterTest,
    proofs,
    repeated,
    scatter,
)
from calibrate.report.evidence.session_evidence import SessionEvidence

Floats = NDArray[np.float64]

GROUPS = 12
FEWEST = 5  # rows in a group: a mean of fewer is mostly its own noise
CLEAR_P = 1e-4  # of chance alone: some dozen factors are looked at, so a pattern must be rarer than one in a thousand


@dataclass(frozen=True)
class Pattern:
    """Group means along one factor."""

    factor: str  # "J3", "order in the session"
    middle: Floats  # (group,) median of the factor
    mean: Floats  # (group, k) of the residual
    sigma: Floats  # (group, k) of the mean, from the scatter within the groups
    f: float  # spread of the means over what scatter alone would give: near 1 without a pattern
    p: float  # probability of such an F by chance
    share: float  # of the residual's sum of squares that the group means explain

    @property
    def clear(self) -> bool:
        """Whether chance is no explanation."""
        return self.p < CLEAR_P


def pattern(factor: str, values: Floats, residual: Floats) -> Pattern | None:
    """Of residuals (row, k) along `values` (row,). None with too few rows, or where the factor or residual stands."""
    n, k = residual.shape
    groups = min(GROUPS, n // FEWEST)
    if groups < 2 or np.ptp(values) == 0.0:
        return None
    parts = np.array_split(np.argsort(values, kind="stable"), groups)
    size = np.array([len(rows) for rows in parts])
    mean = np.stack([residual[rows].mean(axis=0) for rows in parts])
    between = float(np.sum(size[:, None] * (mean - residual.mean(axis=0)) ** 2))
    within = np.sum([np.sum((residual[rows] - mean[i]) ** 2, axis=0) for i, rows in enumerate(parts)], axis=0)
    if float(np.sum(within)) <= 0.0:
        return None
    dof, rest = k * (groups - 1), k * (n - groups)
    f = between / dof / (float(np.sum(within)) / rest)
    sigma = np.sqrt(within / (n - groups) / size[:, None])
    middle = np.array([np.median(values[rows]) for rows in parts])
    total = between + float(np.sum(within))
    return Pattern(factor, middle, mean, sigma, f, float(fdtrc(dof, rest, f)), between / total)


def patterns(q_rad: Floats, order: Floats, residual: Floats) -> tuple[Pattern, ...]:
    """Along every joint (row, joint), then along the order of the rows (row,)."""
    factors = [(f"J{j}", q) for j, q in enumerate(q_rad.T, start=1)]
    found = [pattern(name, values, residual) for name, values in (*factors, ("order in the session", order))]
    return tuple(p for p in found if p is not None)


MANY_LEFT_OUT = 0.05  # of the rows: beyond, it is worth asking what went wrong while measuring
NO_BETTER = 0.95  # of the error of the nominal arm on unseen rows: above, the identification has gained nothing
WORTH_SAYING = 0.1  # of what remains: a pattern of less changes no decision
FAILED = (Status.NOT_FINITE.name, Status.OUT_OF_STEPS.name, Status.STALLED.name)


def session_verdict(evidence: SessionEvidence, diagnosis: DiagnosisFile | None = None) -> VerdictBox:
    """From model and recording; the thresholds are those at the top of this file and of verdict.py."""
    model = evidence.model
    for_care = [*_reasons(evidence), *_reasons_of_rank(evidence), *_reasons_of_diagnosis(diagnosis, model)]
    reasons = tuple(says for says, _ in for_care)
    advice = tuple(dict.fromkeys((*(do for _, do in for_care if do), *_harmless(scatter(model), model.noise))))
    if model.status in FAILED:
        return VerdictBox(Trust.NONE, f"No usable model: {model.says}.", reasons, (AGAIN, *advice))
    if checks_nothing(evidence.spare):
        return VerdictBox(Trust.NONE, f"{UNCHECKED} Do not use this model.", reasons, (MORE_POSES, *advice))
    first = next(iter(proofs(model)), None)
    if model.session is None and first is None:  # a diagnosis keeps its proof in diagnosis.json
        sentence = f"{_how_good(evidence, first, diagnosis)} {UNPROVED} Do not use this model."
        return VerdictBox(Trust.NONE, sentence, (UNPROVED, *reasons), (TO_PROVE, *advice))
    if first is not None and first.rms_distance_after_m > NO_BETTER * first.rms_distance_before_m:
        keep = "Keep the nominal values; find out what is wrong with arm, instrument or poses, and measure again."
        return VerdictBox(
            Trust.NONE, f"{_how_good(evidence, first, diagnosis)} Do not use this model.", reasons, (keep, *advice)
        )
    if not for_care:
        ready = "Correct poses and programs with it (`calibeam correct`), or export it (`calibeam export-model`)."
        return VerdictBox(
            Trust.GOOD, f"{_how_good(evidence, first, diagnosis)} What remains is noise.", (), (ready, *advice)
        )
    return VerdictBox(Trust.CARE, f"{_how_good(evidence, first, diagnosis)} Use it, with care.", reasons, advice)


def worst_pattern(evidence: SessionEvidence) -> Pattern | None:
    """The clear pattern that holds most of what the first instrument leaves."""
    clear = [p for p in patterns_of(evidence, 0) if p.clear]
    return max(clear, key=lambda p: p.share, default=None)


def patterns_of(evidence: SessionEvidence, index: int) -> tuple[Pattern, ...]:
    """Of one of the readings; an observation of two poses counts at its first."""
    readings = evidence.readings[index]
    rows = readings.rows[:, 0]
    return patterns(evidence.recording.samples.joints()[rows], rows.astype(np.float64), readings.after)


def _how_good(evidence: SessionEvidence, proof: UnseenRows | None, diagnosis: DiagnosisFile | None) -> str:
    readings = evidence.readings[0]
    noun = kind_of(readings.instrument).noun
    for split in _proved(evidence.model, diagnosis):
        if split.instrument == readings.instrument and split.rms_after_m is not None and split.rms_before_m is not None:
            return (
                f"The calibrated arm misses {noun} that the fit has not seen by {readings.says(split.rms_after_m)} rms "
                f"of a coordinate; geometry alone misses them by {readings.says(split.rms_before_m)}."
            )
    if proof is None:
        after, before = (float(np.sqrt(np.mean(e**2))) for e in (readings.error_after, readings.error_before))
        return (
            f"The calibrated arm misses the {noun} it was fitted to by {readings.says(after)} rms distance; "
            f"the nominal arm misses them by {readings.says(before)}."
        )
    return (
        f"The calibrated arm misses {noun} that the fit has not seen by "
        f"{readings.says(proof.rms_distance_after_m)} rms distance; "
        f"the nominal arm misses them by {readings.says(proof.rms_distance_before_m)}."
    )


def _proved(model: ModelFile, diagnosis: DiagnosisFile | None) -> tuple[SplitRecord, ...]:
    """Of a model with physics: its proof stands in the diagnosis that it is of."""
    return () if diagnosis is None or model.session is None else diagnosis.splits


def _reasons(evidence: SessionEvidence) -> Iterator[ReasonForCare]:
    model, recording = evidence.model, evidence.recording
    for says in evidence.not_as_fitted:
        yield (
            says,
            "Report the difference with the recording; the numbers here are those of the file.",
        )
    if model.status == Status.AT_BOUND.name:
        yield (
            f"{Status.AT_BOUND.value}.",
            ("The table of parameters below names it; check its nominal value in the rig file."),
        )
    yield from _reasons_of_scatter(scatter(model), repeated(model))
    yield from _noisy_sources(model.noise)
    if model.noise.get("settled") is False:
        yield "The size of the noise did not settle, and every sigma is a guess.", "Measure more poses."
    worst = worst_pattern(evidence)
    if worst is not None and worst.share > WORTH_SAYING:
        along = "changes in the session" if worst.factor.startswith("order") else f"follows {worst.factor}"
        yield (
            f"What remains {along} ({worst.share:.0%} of it, F = {significant(worst.f)}): the model lacks something.",
            "The figures along the joints, below, show where physics is missing; `calibeam diagnose` finds what it is.",
        )
    yield from _reasons_of_proofs(proofs(model))
    share = evidence.left_out / max(len(recording.samples), 1)
    if share > MANY_LEFT_OUT:
        yield (
            f"{evidence.left_out} of {len(recording.samples)} rows were left out as faulty.",
            "Find out what went wrong with the rows that were left out; they are listed below.",
        )
    if not recording.complete:
        yield "The recording was cut short; what is in it is good, but the plan was not finished.", "Finish the plan."
    for damage in recording.damage:
        yield f"The file is damaged: {damage}.", "Keep the file as it is, and record again if you can."


def _reasons_of_rank(evidence: SessionEvidence) -> Iterator[ReasonForCare]:
    """Combinations of the arm's own parameters that other poses would separate; what no pose could is no fault."""
    arm = {p.name for p in evidence.arm.parameters}
    weak = [u for u in evidence.model.unseen if not u.structural and len(u.members) > 1 and arm & set(u.members)]
    if weak:
        yield (
            f"{counted(len(weak), 'combination')} of parameters of the arm cannot be separated with these poses.",
            "Measure more different poses: `calibeam design` chooses them.",
        )


def _reasons_of_diagnosis(found: DiagnosisFile | None, model: ModelFile) -> Iterator[ReasonForCare]:
    """What the diagnosis of the same recording opposes; nothing where it agrees or was not made, or where the model
    is of a diagnosis and holds the physics that it found.
    """
    if found is None or found.verdict == "consistent" or (found.verdict == "mismatch" and model.session):
        return
    if found.verdict == "mismatch":
        causes = counted(len(of_poses(found)), "cause")
        no_better = no_better_with_physics(found) if found.findings else ""
        yield (
            f"Geometry alone does not explain the readings: the diagnosis found {causes}"
            + (f", but {no_better}." if no_better else "."),
            "Measure more poses (`calibeam design` chooses them): they decide whether the causes belong into the model."
            if no_better
            else "Use the model with the physics, which `calibeam diagnose --model-out` writes.",
        )
        return
    yield (
        "The diagnosis is not conclusive: something may be there that the recorded columns do not explain.",
        "See the chapter on what the model lacks; record the missing columns it names.",
    )


def _reasons_of_scatter(found: ScatterTest | None, repeats: Repeated | None) -> Iterator[ReasonForCare]:
    if found is None:
        return
    if found.alarm is Alarm.ABOVE_STATED:
        yield (
            f"What remains is {significant(found.factor)} times the assumed noise: the instruments are worse "
            "than that, or the arm does something that the model lacks.",
            "Measure some poses several times (column repeat): only that separates noise from missing physics."
            if repeats is None
            else "",
        )
    if found.alarm is Alarm.NO_REDUNDANCY:
        yield f"{Alarm.NO_REDUNDANCY.value}.", "Measure more poses."
    if repeats is not None and repeats.alarm is Alarm.LACK_OF_FIT and repeats.ratio is not None:
        yield (
            f"Repeated poses scatter less than the model misses them (F = {significant(repeats.ratio)}): "
            "physics is missing from the model.",
            "The figures along the joints, below, show where physics is missing; `calibeam diagnose` finds what it is.",
        )


def _harmless(found: ScatterTest | None, noise: Fields) -> Iterator[str]:
    """An alarm that makes no number worse: sigmas are of the scatter found."""
    if found is not None and found.alarm is Alarm.BELOW_STATED:
        yield (
            f"What remains is only {significant(found.factor)} times the assumed noise: put the noise that "
            f"was found into [noise] of the rig file{_as_keys(noise)}."
        )


def _as_keys(noise: Fields) -> str:
    """The sizes found, as a rig file has them: of keys that hold one number."""
    keys = {"joint": "joint_rad", **{name: source.key for name, source in SOURCES.items() if source.key == f"{name}_m"}}
    found = [f"{key} = {noise[name]:.2g}" for name, key in keys.items() if isinstance(noise.get(name), float)]
    return f": {', '.join(found)}" if found else ""


def _noisy_sources(noise: Fields) -> Iterator[ReasonForCare]:
    """Which of several sources is worse than assumed."""
    names = [n.removesuffix("_believed") for n in noise if n.endswith("_believed")]
    for name in names if len(names) > 1 else ():
        found, assumed = noise.get(name), noise.get(f"{name}_believed")
        if isinstance(found, float) and isinstance(assumed, float) and found > NOISIER * assumed > 0.0:
            times = significant(found / assumed)
            yield f"The noise of {name} is {times} times the assumed one.", f"Check the instrument: {name}."


def _reasons_of_proofs(found: tuple[UnseenRows, ...]) -> Iterator[ReasonForCare]:
    reported = set[str]()
    for proof in found:
        # Rows elsewhere than the others are missed by what these leave open, too: no fault of the model, and an error.
        if proof.split in reported or not isfinite(proof.chi_after) or proof.chi_after <= WORSE_UNSEEN:
            continue
        reported.add(proof.split)
        predicted = proof.chi_predicted
        sigmas = "" if predicted is None else f" ({significant(predicted)} times what noise and sigmas predict)"
        yield (
            f"Unseen rows ({proof.split}) are missed by {significant(proof.chi_after)} times the noise{sigmas}.",
            "Check that nothing moved during the session, and measure where the arm will work.",
        )
