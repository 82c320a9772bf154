"""A diagnosis beside a model: what the calibrated arm holds already is no finding about it.

`calibeam identify` fits the discs of encoders where the rig file states `eccentricity_rad`; a diagnosis starts from an
arm without them, and finds the same discs as causes.
"""

import msgspec

from calibrate.arms.eccentric import COSINE, SINE
from calibrate.diagnose.schema import DiagnosisFile, FindingRecord
from calibrate.model_file import ModelFile

DISC = "encoder-eccentricity"


def beyond_model(file: DiagnosisFile, model: ModelFile) -> tuple[DiagnosisFile, tuple[FindingRecord, ...]]:
    """The diagnosis without what the model's geometry holds, and these findings; agreement where nothing else is left.

    A model with effects is of a diagnosis itself, and its findings stay.
    """
    held = () if model.effects else tuple(f for f in file.findings if _holds(model, f))
    if not held:
        return file, ()
    left = tuple(f for f in file.findings if f not in held)
    agree = file.verdict == "mismatch" and not left and file.unexplained is None and not file.also_unexplained
    verdict = "consistent" if agree else file.verdict
    # the error of geometry alone is that of an arm without discs, which is not the arm of this report
    return msgspec.structs.replace(file, findings=left, verdict=verdict, free_space=None), held


def _holds(model: ModelFile, finding: FindingRecord) -> bool:
    """Whether both coefficients of the joint's disc have numbers."""
    if finding.physics != DISC:
        return False
    joint = finding.where.partition(".")[0]
    known = {p.name for p in model.parameters if p.value is not None}
    return {f"{joint}.{SINE}", f"{joint}.{COSINE}"} <= known
