"""What a motion shows, in the record that diagnosis.json holds."""

import math

import numpy as np
from msgspec.structs import replace

from calibrate.diagnose.assess.diagnosis import Diagnosis, Verdict
from calibrate.diagnose.motion.torques import TorqueDiagnosis
from calibrate.diagnose.record.schema import DiagnosisFile, JointTorqueRecord, TorquesRecord
from calibrate.diagnose.record.to_file import finding_record, unexplained_record

STREAM = "torque"
JUDGED = "last block"  # the split that a motion is judged by: single moments are half known by their neighbours


def with_torques(file: DiagnosisFile, found: TorqueDiagnosis | None) -> DiagnosisFile:
    """The diagnosis with what the torques show; findings of samples and streams stay in front."""
    if found is None:
        return file
    said = found.diagnosis
    findings = tuple(replace(finding_record(one, None), stream=STREAM, curve=None) for one in said.findings)
    left = tuple(unexplained_record(one, None) for one in said.unexplained)
    first = left[0] if left and file.unexplained is None else file.unexplained
    verdict = said.verdict.value
    if file.verdict == Verdict.MISMATCH.value or verdict == Verdict.CONSISTENT.value:
        verdict = file.verdict
    return replace(
        file,
        verdict=verdict,
        findings=file.findings + findings,
        unexplained=first,
        also_unexplained=(*file.also_unexplained, *(one for one in left if one is not first)),
        next=(*_to_record(said), *file.next),
        torques=TorquesRecord(found.motion.made, tuple(_joints(found))),
    )


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
    out: list[JointTorqueRecord] = []
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
                noise_nm=float(found.model.problem.sigma_nm[j]),
                unseen_before_nm=None if proof is None else _number(proof.rms_before_m),
                unseen_after_nm=None if proof is None else _number(proof.rms_after_m),
            )
        )
    return out


def _number(value: float) -> float | None:
    return value if math.isfinite(value) else None
