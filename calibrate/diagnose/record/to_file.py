"""From a diagnosis to the record of it that diagnosis.json holds."""

import math
from importlib.metadata import version

import numpy as np
from msgspec import structs
from numpy.typing import NDArray

from acquisition.recording import Recording
from acquisition.recording.rig import rig_sha256
from calibrate.diagnose.assess.detection_limits import Smallest, isolability, smallest_visible
from calibrate.diagnose.assess.diagnosis import (
    Diagnosis,
    Finding,
    Named,
    Pulled,
    Rejected,
    RivalName,
    Unexplained,
    Verdict,
)
from calibrate.diagnose.assess.findings import named
from calibrate.diagnose.assess.stated_noise import NoiseFound
from calibrate.diagnose.assess.unseen_rows import Floor, HeldOutProof
from calibrate.diagnose.from_recording import Diagnosed, Physics
from calibrate.diagnose.record.pose_examinations import pose_examinations
from calibrate.diagnose.record.schema import (
    SCHEMA,
    CurveRecord,
    DiagnosisFile,
    FindingRecord,
    FloorRecord,
    FreeSpaceRecord,
    GrossErrorRecord,
    IncompleteRecord,
    LackOfFitRecord,
    NameRecord,
    NoiseRecord,
    NotRecorded,
    RejectedRecord,
    RigRecord,
    RivalRecord,
    SizeRecord,
    SmallestRecord,
    SplitRecord,
    UnexplainedRecord,
)
from calibrate.diagnose.search.bench import Bench
from calibrate.diagnose.stages import Incomplete, Stage, Stages
from calibrate.diagnose.state.fitted import Fitted
from calibrate.model.checks.gross_error import GrossError
from calibrate.model.effects.catalogue import EFFECTS
from calibrate.model.effects.term import Form, Size
from calibrate.model.effects.torque import TORQUES

Floats = NDArray[np.float64]

SOFTWARE = f"calibeam {version('calibeam')}"
JUDGED = "random"  # the split whose rms stands at the top of the file
DERIVED_APPROACH = "approach: from the order of the samples"
ANGULAR = ("angle", "tilt", "twist", "direction")


def file_of(diagnosed: Diagnosed, recording: Recording) -> DiagnosisFile:
    """The record to write, with how the examinations of the samples ended."""
    file = _file(diagnosed, recording)
    return structs.replace(file, examinations=pose_examinations(file))


def _file(diagnosed: Diagnosed, recording: Recording) -> DiagnosisFile:
    rig = RigRecord(recording.rig.name, rig_sha256(recording.rig_text))
    gross_errors = tuple(map(_gross_error, diagnosed.blunders))
    if diagnosed.physics is None:
        return DiagnosisFile(
            schema=SCHEMA,
            verdict=Verdict.UNDECIDABLE.value,
            noise_floor_m=None,
            rms_before_m=None,
            rms_after_m=None,
            findings=(),
            unexplained=None,
            next=tuple(f"put the file right: {b.column}: {b.remedy}" for b in diagnosed.blunders if b.whole_file),
            software=SOFTWARE,
            rig=rig,
            samples=len(recording.samples),
            blunders=gross_errors,
            incomplete=tuple(map(_incomplete, diagnosed.incomplete)),
        )
    return _with_physics(diagnosed.physics, rig, gross_errors)


def _with_physics(physics: Physics, rig: RigRecord, gross_errors: tuple[GrossErrorRecord, ...]) -> DiagnosisFile:
    said = physics.diagnosis
    judged = _judged(said)
    floor = next((f for f in said.floors if judged is not None and f.instrument == judged.instrument), None)
    after_m = None if judged is None else judged.rms_after_m
    first, *others = [unexplained_record(u, after_m) for u in said.unexplained] or [None]
    drivers, misfit, change = physics.geometry.drivers, said.lack_of_fit, physics.free_space
    bench, limits = Bench(physics.geometry), _limits(physics.model)
    stages = Stages(list(said.incomplete))
    early = any(one.not_reached for one in said.incomplete)  # written before them: only what is known
    sizes = () if early else stages.attempt(Stage.DETECTION, lambda: smallest_visible(bench), ())
    confusable = () if early else stages.attempt(Stage.CONFUSABLE, lambda: _confusable(bench), ())
    return DiagnosisFile(
        schema=SCHEMA,
        verdict=said.verdict.value,
        noise_floor_m=None if floor is None else _number(floor.rms_m),
        rms_before_m=None if judged is None else _number(judged.rms_before_m),
        rms_after_m=None if judged is None else _number(judged.rms_after_m),
        findings=tuple(finding_record(f, limits.get(f.name)) for f in said.findings),
        unexplained=first,
        next=said.next,
        software=SOFTWARE,
        rig=rig,
        samples=physics.geometry.samples,
        noise_floor_source="" if floor is None else floor.source,
        noise_wanders=said.noise_wanders,
        also_unexplained=tuple(u for u in others if u is not None),
        splits=tuple(map(split_record, said.proofs)),
        floors=tuple(map(_floor, said.floors)),
        free_space=None if change is None else FreeSpaceRecord(change.before_m, change.after_m, change.poses),
        lack_of_fit=None
        if misfit is None
        else LackOfFitRecord(misfit.groups, misfit.ratio, misfit.p, misfit.significant),
        rejected=tuple(map(_rejected, said.rejected)),
        invisible=tuple(map(_name, dict.fromkeys((*said.invisible, *(s.name for s in sizes if not s.plausible))))),
        smallest=tuple(_smallest(s) for s in sizes if s.plausible),
        confusable=confusable,
        not_recorded=tuple(dict.fromkeys(NotRecorded(m.driver, m.column, m.physics) for m in said.missing)),
        derived=(DERIVED_APPROACH,) if drivers.approach_derived else (),
        blunders=gross_errors,
        incomplete=tuple(map(_incomplete, stages.failed)),
        noise=tuple(map(_noise, said.noise)),
    )


def _incomplete(one: Incomplete) -> IncompleteRecord:
    return IncompleteRecord(one.stage.value, one.reason)


def _judged(said: Diagnosis) -> HeldOutProof | None:
    """Of the instrument with the most observations, on the first split that there is."""
    asked = [p for p in said.proofs if p.split == JUDGED] or list(said.proofs)
    return max(asked, key=lambda p: p.observations, default=None)


def _limits(model: Fitted) -> dict[Named, float]:
    """By name, of the causes in the model whose form states one; an unknown cause may be of any size."""
    known = [a.term for a in model.accepted if isinstance(a.term, Form) and not a.term.open]
    return {named(term): term.limit for term in known}


def finding_record(finding: Finding, plausible_to: float | None) -> FindingRecord:
    """One cause as it is written."""
    return FindingRecord(
        *_words(finding.name),
        parameters={name: _size(size) for name, size in finding.parameters.items()},
        share=finding.share,
        confidence=finding.confidence,
        says=finding.says,
        rivals=tuple(map(_rival, finding.rivals)),
        p=finding.p,
        bic_gain=finding.gain,
        held_out_gain=finding.predicts,
        explains=next((e.explains for e in (*EFFECTS, *TORQUES) if e.physics == finding.name.physics), ""),
        plausible_to=plausible_to,
        curve=None if finding.pulled is None else _curve(finding.pulled, finding.name.where),
    )


def _rival(rival: RivalName) -> RivalRecord:
    return RivalRecord(*_words(rival.name), confidence=rival.confidence, margin=rival.margin, plausible=rival.plausible)


def _curve(pulled: Pulled, where: str) -> CurveRecord:
    unit = "rad" if where.endswith(ANGULAR) else "m"
    return CurveRecord(pulled.driver, unit, _numbers(pulled.values), _numbers(pulled.residual), _numbers(pulled.fitted))


def unexplained_record(found: Unexplained, rms_m: float | None) -> UnexplainedRecord:
    """Structure without a name as it is written; `rms_m` of what is left."""
    size = None if rms_m is None else _number(math.sqrt(max(found.share, 0.0)) * rms_m)
    return UnexplainedRecord(found.where, ",".join(found.depends_on), size, found.share, found.p, found.why)


def split_record(proof: HeldOutProof) -> SplitRecord:
    """One proof as the file states it."""
    low, high = proof.removed
    before_m, after_m = _number(proof.rms_before_m), _number(proof.rms_after_m)
    return SplitRecord(
        proof.split, proof.instrument, proof.observations, proof.wild, before_m, after_m, _number(low), _number(high)
    )


def _floor(floor: Floor) -> FloorRecord:
    return FloorRecord(floor.instrument, _number(floor.rms_m), floor.source)


def _noise(found: NoiseFound) -> NoiseRecord:
    return NoiseRecord(
        instrument=found.instrument,
        quantity=found.quantity,
        unit=found.unit,
        stated=found.stated,
        found=_number(found.found),
        times=None if found.times is None else _number(found.times),
        times_sigma=None if found.times_sigma is None else _number(found.times_sigma),
        statement=found.statement.value,
        says=found.says,
        supports=found.supports,
        opposes=found.opposes,
    )


def _rejected(rejected: Rejected) -> RejectedRecord:
    return RejectedRecord(*_words(rejected.name), bic_gain=_number(rejected.gain), why=rejected.why)


def _smallest(found: Smallest) -> SmallestRecord:
    return SmallestRecord(*_words(found.name), parameter=found.parameter, value=found.value)


def _confusable(bench: Bench) -> tuple[tuple[NameRecord, NameRecord, float], ...]:
    """Causes that these poses could not separate by their nature, whatever the data."""
    pairs = isolability(bench.menu).confusable()
    out = {(named(a), named(b)): r2 for a, b, r2 in pairs if named(a) != named(b)}
    return tuple((_name(a), _name(b), r2) for (a, b), r2 in out.items())


def _gross_error(error: GrossError) -> GrossErrorRecord:
    return GrossErrorRecord(error.kind.value, tuple(row + 1 for row in error.rows), error.column, error.says)


def _name(name: Named) -> NameRecord:
    return NameRecord(*_words(name))


def _words(name: Named) -> tuple[str, str, str, int | None, str]:
    return name.where, ",".join(name.depends_on), name.shape, name.order, name.physics


def _size(size: Size) -> SizeRecord:
    """No number for what the data do not determine."""
    sigma = _number(size.sigma)
    return SizeRecord(None if sigma is None else _number(size.value), sigma)


def _numbers(values: Floats) -> tuple[float | None, ...]:
    return tuple(map(_number, values.tolist()))


def _number(value: float) -> float | None:
    """JSON has no word for what is not a number."""
    return value if math.isfinite(value) else None
