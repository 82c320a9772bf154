"""How the examinations of a comparison and of a reconciliation ended."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from msgspec import structs

from acquisition.recording import Recording
from acquisition.recording.examination import Examination, ExaminationRecord
from calibrate.compare.comparison_file import ComparisonFile, DifferenceRecord, Level
from calibrate.compare.encoder_zeros import ZERO, ZeroChange
from calibrate.compare.reconciled_rows import AGREES, ReconcileFile
from calibrate.diagnose.assess import Verdict
from calibrate.diagnose.record.schema import TORQUES_IN_MOTION
from calibrate.diagnose.streams import devices_of

READINGS = Examination(
    "readings of the samples",
    ("q", "readings"),
    "give a recording of the simulation with the same poses, --simulator or --simulated-model",
)
CAUSES = Examination("causes of what differs", ("q", "readings"), "measure more poses, and leave --no-diagnose out")
STREAMS = Examination(
    "streams", ("device_s", "q", "enc", "cmd"), "give two recordings with streams (.mcap) of the same motion"
)
SECOND_ZEROS = Examination(
    "offset of the second encoders",
    ("enc", "q"),
    "give two recordings with both encoders of the joints over ten seconds or more of motion",
)
POSES = Examination("settled poses", ("q", "readings"), "record settled samples, and measure more poses")
IN_SAMPLES = frozenset((Level.RIG, Level.JOINT_ZEROS, Level.LINKS, Level.ENCODER_ZEROS, Level.FRAMES, Level.JOINTS))
WITHOUT_READING = ("command", "joints")  # links of the chain that no instrument shows
DIFFER = "differ"  # verdict of a reconciliation
WITHOUT_STREAMS = "not both of the two have streams"
IN_CAUSES = frozenset((Level.EFFECTS, Level.UNEXPLAINED))


@dataclass(frozen=True, eq=False)
class Compared:
    """The file and what it was made of; `simulated` None: a description of torques alone."""

    file: ComparisonFile
    measured: Recording
    simulated: Recording | None
    zeros: Sequence[ZeroChange] = ()

    def differences(self, levels: frozenset[Level]) -> Sequence[DifferenceRecord]:
        values = {level.value for level in levels}
        return [one for one in self.file.differences if one.decides and one.level in values and one.physics != ZERO]

    def has(self, device: str) -> bool:
        return any(device in devices_of(one) for one in (self.measured, self.simulated) if one is not None)

    def both_have(self, device: str) -> bool:
        return self.simulated is not None and all(device in devices_of(r) for r in (self.measured, self.simulated))


def _readings(asked: Compared) -> ExaminationRecord:
    if not asked.file.matched or not asked.file.links:
        held = len(asked.measured.samples) > 0
        why = "no rows of the two were compared" if held else "no settled samples were recorded"
        return READINGS.not_examined(why, expected=held and asked.simulated is not None)
    found = asked.differences(IN_SAMPLES)
    if found:
        return READINGS.found("; ".join(one.says for one in found))
    apart = [one for one in asked.file.links if one.parts]
    if apart:
        return READINGS.found("; ".join(f"{one.link} differ by {one.rms_own:.3g} {one.unit} (rms)" for one in apart))
    noise = [
        (one.instrument, one.noise if one.noise is not None else one.rms_coordinate_after, one.unit)
        for one in asked.file.readings
    ] or [(one.link, one.scatter, one.unit) for one in asked.file.links if one.link not in WITHOUT_READING]
    known = [(name, value, unit) for name, value, unit in noise if np.isfinite(value)]
    if not known:
        return READINGS.not_examined("the two share no reading")
    if len({unit for _, _, unit in known}) > 1:
        return READINGS.nothing(None, "", says="; ".join(f"{name} {value:.3g} {unit}" for name, value, unit in known))
    return READINGS.nothing(max(value for _, value, _ in known), known[0][2])


def _causes(asked: Compared) -> ExaminationRecord:
    found = asked.differences(IN_CAUSES)
    if found:
        return CAUSES.found("; ".join(one.says for one in found))
    diagnosis = asked.file.diagnosis
    if diagnosis is None:
        undecided = asked.file.verdict == Verdict.UNDECIDABLE.value
        why = asked.file.says if asked.file.matched and undecided else "no cause was sought beside the samples"
        return CAUSES.not_examined(why, expected=asked.file.matched > 0)
    failed = "; ".join(f"{one.stage}: {one.reason}" for one in diagnosis.incomplete)
    if failed:
        return CAUSES.not_examined(failed)
    limits = "; ".join(f"{s.physics} at {s.where}: {s.parameter} {s.value:.3g}" for s in diagnosis.smallest[:3])
    if not limits:
        return CAUSES.not_examined("these poses show no cause of the catalogue")
    return CAUSES.nothing(None, "", says=limits)


def _streams(asked: Compared) -> ExaminationRecord:
    found = asked.differences(frozenset((Level.STREAMS,)))
    if found:
        return STREAMS.found("; ".join(one.says for one in found))
    both = asked.simulated is not None and bool(asked.measured.streams and asked.simulated.streams)
    compared = [one for one in asked.file.streams if one.noise is not None and one.parts is not None]
    if not compared:
        status = "; ".join(f"{one.stream}: {one.status}" for one in asked.file.streams)
        why = f"no stream of the two shows one motion{f' ({status})' if status else ''}" if both else WITHOUT_STREAMS
        return STREAMS.not_examined(why, expected=both)
    worst = max(compared, key=lambda one: one.noise or 0.0)
    return STREAMS.nothing(worst.noise, worst.unit)


def _second_zeros(asked: Compared) -> ExaminationRecord:
    found = [one.says for one in asked.file.differences if one.physics == ZERO]
    if found:
        return SECOND_ZEROS.found("; ".join(found))
    if not asked.both_have("encoders"):
        return SECOND_ZEROS.not_examined("not both of the two have second encoders", expected=asked.has("encoders"))
    if not asked.zeros:
        return SECOND_ZEROS.not_examined("in one of the two the offsets are not determined")
    return SECOND_ZEROS.nothing(max(one.limit_rad for one in asked.zeros), "rad")


def _torques(asked: Compared) -> ExaminationRecord:
    compared = asked.file.torques
    if compared is None:
        held = "torque" in devices_of(asked.measured)
        why = "no description of the simulation's torques was given" if held else "no torques were recorded"
        remedy = "give --simulation FILE (URDF or MJCF)" if held else ""
        return TORQUES_IN_MOTION.not_examined(why, expected=False, remedy=remedy)
    if asked.file.verdict != Verdict.CONSISTENT.value:
        return TORQUES_IN_MOTION.found(asked.file.says)
    return TORQUES_IN_MOTION.nothing(max(one.noise_nm for one in compared.joints), "Nm")


COMPARE_EXAMINATIONS: tuple[tuple[Examination, Callable[[Compared], ExaminationRecord]], ...] = (
    (READINGS, _readings),
    (CAUSES, _causes),
    (STREAMS, _streams),
    (SECOND_ZEROS, _second_zeros),
    (TORQUES_IN_MOTION, _torques),
)


def with_examinations(
    file: ComparisonFile, measured: Recording, simulated: Recording | None, zeros: Sequence[ZeroChange] = ()
) -> ComparisonFile:
    """The comparison with how each examination ended; `zeros`: of the second encoders, between the two."""
    asked = Compared(file, measured, simulated, zeros)
    return structs.replace(file, examinations=tuple(examine(asked) for _, examine in COMPARE_EXAMINATIONS))


def examined(file: ReconcileFile, torques: ExaminationRecord | object) -> ReconcileFile:
    """The reconciliation with how its two examinations ended. `torques`: why those took no part, where they did not."""
    return structs.replace(file, examinations=(_of_poses(file), _of_torques(file, torques)))


RECONCILE_EXAMINATIONS = (POSES, TORQUES_IN_MOTION)


def _of_poses(file: ReconcileFile) -> ExaminationRecord:
    if file.unseen:
        worst = max(file.unseen, key=lambda one: one.noise_m)
        left = "; ".join(file.remains)
        return POSES.found(left) if left else POSES.nothing(AGREES * worst.noise_m, "m")
    if file.all_rows and file.verdict == DIFFER and not file.torques:
        return POSES.found(file.says)
    why = "; ".join(file.remains) if file.all_rows or not file.torques else "no settled samples were recorded"
    return POSES.not_examined(why or "too few rows", expected=not file.torques or bool(file.all_rows))


def _of_torques(file: ReconcileFile, left_out: ExaminationRecord | object) -> ExaminationRecord:
    if isinstance(left_out, ExaminationRecord):
        return left_out
    left = "; ".join(one for one in file.remains if "orque" in one)
    noise_nm = max((one.noise_nm for one in file.torques), default=0.0)
    return TORQUES_IN_MOTION.found(left) if left else TORQUES_IN_MOTION.nothing(AGREES * noise_nm, "Nm")
