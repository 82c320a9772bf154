"""From a recorded motion to which torque was left out: the search of poses at the torques of the joints, and its record
in diagnosis.json.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from msgspec import structs
from numpy.random import Generator
from numpy.typing import NDArray

from acquisition.recording import Recording
from acquisition.recording.examination import ExaminationRecord
from acquisition.recording.rig import Rig
from calibrate.diagnose.assess import limits
from calibrate.diagnose.assess.diagnosis import Diagnosis, Finding, Verdict
from calibrate.diagnose.diagnose import diagnose
from calibrate.diagnose.motion.links_alone import torque_state
from calibrate.diagnose.motion.motion_table import MOVE, Motion, motion_of
from calibrate.diagnose.motion.torque_state import TorqueState
from calibrate.diagnose.record.schema import (
    TORQUE,
    TORQUES_IN_MOTION,
    ChangedRecord,
    DiagnosisFile,
    FindingRecord,
    IncompleteRecord,
    JointTorqueRecord,
    TorquesRecord,
)
from calibrate.diagnose.record.to_file import finding_record, unexplained_record
from calibrate.diagnose.stages import DECIDING, Stage
from calibrate.model.effect_records import EffectRecord
from calibrate.model.effects.term import Accepted, Missing
from calibrate.model.effects.torque import TORQUES, friction
from calibrate.model.torque_records import TorquesOfModel

Floats = NDArray[np.float64]

JUDGED = "last block"  # the split that a motion is judged by: single moments are half known by their neighbours


@dataclass(frozen=True, eq=False)
class TorqueDiagnosis:
    """What a motion shows; `bare` with the links alone, `model` with the terms of the findings."""

    motion: Motion
    diagnosis: Diagnosis
    bare: TorqueState
    known: TorquesOfModel | None = None  # beside which it was sought

    @property
    def model(self) -> TorqueState:
        found = self.diagnosis.model
        if not isinstance(found, TorqueState):
            raise TypeError(f"a diagnosis of {type(found).__name__}, which is no fit to torques")
        return found


def diagnose_torques(
    recording: Recording, rng: Generator, known: TorquesOfModel | None = None
) -> TorqueDiagnosis | ExaminationRecord:
    """What differs from the links that the rig file states, or from a model or simulation that is `known`.

    The record states why the torques of the recording are not examined.
    """
    motion = motion_of(recording)
    return motion if isinstance(motion, ExaminationRecord) else diagnose_motion(recording.rig, motion, rng, known)


def diagnose_motion(rig: Rig, motion: Motion, rng: Generator, known: TorquesOfModel | None = None) -> TorqueDiagnosis:
    """The same of moments of a motion."""
    bare = torque_state(rig, motion, known)
    missing: tuple[Missing, ...] = tuple(m for kind in TORQUES for m in kind.missing(bare.drivers))
    found = diagnose(bare, rng, missing, usual=usual_friction(bare))
    return TorqueDiagnosis(motion, found if known is None else _certain_changes(found, known), bare, known)


def _certain_changes(found: Diagnosis, known: TorquesOfModel) -> Diagnosis:
    """Without changes that the uncertainty of the known effects at their place may be: these entered as exact."""

    def is_certain(finding: Finding) -> bool:
        own = [e.parameters for e in known.effects if e.where == finding.name.where]
        sigmas = [(n.partition("_")[2], s.sigma or 0.0) for p in own for n, s in p.items()]
        beyond = [
            abs(size.value)
            > limits.SIZE_SIGMAS * np.hypot(size.sigma, max((s for u, s in sigmas if u == unit), default=0))
            for unit, size in ((name.partition("_")[2], size) for name, size in finding.parameters.items())
        ]
        return not beyond or any(beyond)

    findings = tuple(filter(is_certain, found.findings))
    nothing = not findings and found.verdict is Verdict.MISMATCH
    left = Verdict.UNDECIDABLE if found.unexplained else Verdict.CONSISTENT
    return replace(found, findings=findings, verdict=left if nothing else found.verdict)


def usual_friction(bare: TorqueState) -> tuple[Accepted, ...]:
    """Dry and viscous friction of every joint: a drive without any is the exception, and links alone that have to stand
    for it are no place to begin a search from.
    """
    terms = [term for kind in (friction.COULOMB, friction.VISCOUS) for term in kind.terms(bare.drivers)]
    return tuple(Accepted(term, np.zeros(1), np.zeros(0)) for term in terms)


def _examinations(found: TorqueDiagnosis | ExaminationRecord) -> tuple[ExaminationRecord, ...]:
    """How the examination of the torques ended, and the joints that took no part."""
    if isinstance(found, ExaminationRecord):
        return (found,)
    still = [j for j, column in enumerate(found.motion.torque_nm.T, start=1) if not np.isfinite(column).any()]
    left_out = (
        TORQUES_IN_MOTION.not_examined("it does not move for long enough, or has no torque", f"joint{j}", remedy=MOVE)
        for j in still
    )
    return (_ending(found), *left_out)


def _ending(found: TorqueDiagnosis) -> ExaminationRecord:
    said = found.diagnosis
    deciding = [one for one in said.incomplete if one.stage in DECIDING]
    if said.findings or said.unexplained:
        return TORQUES_IN_MOTION.found(
            "; ".join((*(f.says for f in said.findings), *(u.why for u in said.unexplained)))
        )
    if deciding:
        failed = "; ".join(f"{one.stage.value}: {one.reason}" for one in deciding)
        return TORQUES_IN_MOTION.not_examined(f"a stage failed: {failed}", remedy="report the recording as a fault")
    moved = np.isfinite(found.motion.torque_nm).any(axis=0)
    return TORQUES_IN_MOTION.nothing(float(found.model.noise_nm[moved].max()), "Nm")


def with_torques(file: DiagnosisFile, found: TorqueDiagnosis | ExaminationRecord) -> DiagnosisFile:
    """The diagnosis with what the torques show; findings of samples and streams stay in front."""
    examined = structs.replace(file, examinations=(*file.examinations, *_examinations(found)))
    return examined if isinstance(found, ExaminationRecord) else _with_findings(examined, found)


def _with_findings(file: DiagnosisFile, found: TorqueDiagnosis) -> DiagnosisFile:
    said = found.diagnosis
    findings = tuple(structs.replace(finding_record(one, None), stream=TORQUE, curve=None) for one in said.findings)
    changed = () if found.known is None else tuple(c for one in findings for c in _changed(one, found.known.effects))
    left = tuple(unexplained_record(one, None) for one in said.unexplained)
    first = left[0] if left and file.unexplained is None else file.unexplained
    verdict = said.verdict.value
    if file.samples or file.verdict == Verdict.MISMATCH.value or verdict == Verdict.CONSISTENT.value:
        verdict = file.verdict  # what a drive takes is no fault of settled poses
    return structs.replace(
        file,
        verdict=verdict,
        findings=file.findings + findings,
        unexplained=first,
        also_unexplained=(*file.also_unexplained, *(one for one in left if one is not first)),
        next=(*_to_record(said), *file.next),
        changed=(*file.changed, *changed),
        incomplete=(*file.incomplete, *_not_completed(said)),
        torques=TorquesRecord(
            found.motion.made, tuple(_joints(found)), "" if found.known is None else found.known.source
        ),
    )


def _not_completed(said: Diagnosis) -> tuple[IncompleteRecord, ...]:
    """Stages of the torques beside those of the poses, which have the same names."""
    return tuple(IncompleteRecord(f"{Stage.TORQUES.value}, {one.stage.value}", one.reason) for one in said.incomplete)


def _changed(finding: FindingRecord, effects: Sequence[EffectRecord]) -> tuple[ChangedRecord, ...]:
    """Of an effect that was known: its sigma of then is part of that of the change."""
    same = (finding.where, finding.physics, finding.order)
    was = next((e for e in effects if (e.where, e.physics, e.order) == same), None)
    out: list[ChangedRecord] = []
    for name, by in finding.parameters.items():
        before = None if was is None else was.parameters.get(name)
        if was is None or before is None or None in (by.value, by.sigma, before.value, before.sigma):
            continue
        sigma = math.hypot(by.sigma or 0.0, before.sigma or 0.0)
        out.append(ChangedRecord(f"{was.name}.{name}", before.value, by.value or 0.0, sigma))
    return tuple(out)


def _to_record(said: Diagnosis) -> tuple[str, ...]:
    """Motions in the place of poses: what separates alternatives of friction is speed."""
    shared = [f"{f.name.physics} at {f.name.where}" for f in said.findings if f.rivals]
    columns = tuple(
        dict.fromkeys(f"record {m.column}: without it {m.physics} cannot be determined" for m in said.missing)
    )
    if not shared:
        return columns
    return (*columns, f"{', '.join(shared)} could also be another cause: record the motion slower and faster, too")


def _joints(found: TorqueDiagnosis) -> list[JointTorqueRecord]:
    proofs = {one.instrument: one for one in found.diagnosis.proofs if one.split == JUDGED}
    out, noise_nm = list[JointTorqueRecord](), found.model.noise_nm
    for j in range(found.motion.torque_nm.shape[1]):
        torque = found.motion.torque_nm[:, j]
        proof = proofs.get(f"joint{j + 1}.torque")
        if not np.isfinite(torque).any():
            continue
        out.append(
            JointTorqueRecord(
                joint=j + 1,
                moments=int(np.isfinite(torque).sum()),
                torque_nm=float(np.sqrt(np.nanmean(torque**2))),
                noise_nm=float(noise_nm[j]),
                unseen_before_nm=None if proof is None else _number(proof.rms_before_m),
                unseen_after_nm=None if proof is None else _number(proof.rms_after_m),
            )
        )
    return out


def _number(value: float) -> float | None:
    return value if math.isfinite(value) else None
