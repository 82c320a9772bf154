"""How the examinations of settled poses ended: faults of the file, and physics beside the geometry."""

from collections.abc import Callable

from acquisition.recording.examination import Examination, ExaminationRecord
from calibrate.diagnose.record.schema import DiagnosisFile, SmallestRecord
from calibrate.diagnose.stages import DECIDING, NOT_YET, Stage

FAULTS = Examination(
    "faults of the file",
    ("q", "readings"),
    "record settled samples (`calibeam session`), or import a table of poses with readings of an instrument",
)
PHYSICS = Examination("physics at settled poses", ("q", "readings"), FAULTS.remedy)
MEASURE_MORE = "measure more poses"
REPORT = "report the recording as a fault of the program"
SHOWN = 5  # detection limits in one sentence


def _faults(file: DiagnosisFile) -> ExaminationRecord:
    if not file.samples:
        return FAULTS.not_examined("no settled samples were recorded", expected=False)
    if failed := _failures(file, Stage.FAULTS):
        return FAULTS.not_examined(failed, remedy=REPORT)
    if file.blunders:
        return FAULTS.found("; ".join(one.says for one in file.blunders))
    return FAULTS.nothing(None, "", says="a row beyond six times the noise of the others")


def _physics(file: DiagnosisFile) -> ExaminationRecord:
    if not file.samples:
        return PHYSICS.not_examined("no settled samples were recorded", expected=False)
    if whole := [one.says for one in file.blunders if not one.rows]:
        return PHYSICS.not_examined("; ".join(whole), remedy="put the file right")
    found = [f.says for f in file.findings if f.stream is None]
    left = [u.says for u in (file.unexplained, *file.also_unexplained) if u is not None]
    if found or left:
        return PHYSICS.found("; ".join((*found, *left)))
    if failed := _failures(file, *DECIDING, Stage.DETECTION):
        few = any(one.stage == Stage.SEARCH.value and "samples" in one.reason for one in file.incomplete)
        return PHYSICS.not_examined(failed, remedy=MEASURE_MORE if few else REPORT)
    if not file.smallest:
        return PHYSICS.not_examined("these poses show no cause of the catalogue", remedy=MEASURE_MORE)
    return PHYSICS.nothing(None, "", says="; ".join(map(_limit, _hardest(file))))


def _failures(file: DiagnosisFile, *stages: Stage) -> str:
    names = {stage.value for stage in stages}
    return "; ".join(f"{one.stage}: {one.reason}" for one in file.incomplete if one.stage in names)


def _hardest(file: DiagnosisFile) -> list[SmallestRecord]:
    """Of each physics the place where it has to be largest."""
    worst: dict[str, SmallestRecord] = {}
    for one in file.smallest:
        if one.physics not in worst or one.value > worst[one.physics].value:
            worst[one.physics] = one
    return list(worst.values())[:SHOWN]


def _limit(one: SmallestRecord) -> str:
    return f"{one.physics} at {one.where}: {one.parameter} {one.value:.3g}"


POSE_EXAMINATIONS: tuple[tuple[Examination, Callable[[DiagnosisFile], ExaminationRecord]], ...] = (
    (FAULTS, _faults),
    (PHYSICS, _physics),
)


def pose_examinations(file: DiagnosisFile) -> tuple[ExaminationRecord, ...]:
    """Of a diagnosis of samples, or of a recording without any; none while it is still under way."""
    if any(one.reason == NOT_YET for one in file.incomplete):
        return ()
    return tuple(examine(file) for _, examine in POSE_EXAMINATIONS)
