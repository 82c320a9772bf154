"""How good both calibrations are, and what was found in each: the tables beside the parameters."""

from collections.abc import Iterator

import numpy as np

from calibrate.diagnose.schema import DiagnosisFile, FindingRecord
from calibrate.model_file import ModelFile
from calibrate.report.drift.two_calibrations import Calibration, Drift
from calibrate.report.elements import Html, table, tag
from calibrate.report.model_tests import proofs
from calibrate.report.quantities import DASH, angle, fixed, length, significant

ANGULAR = ("joint", "orientation", "joint_rad")
BELIEVED = "_believed"


def both(drift: Drift) -> Html:
    """Coverage, noise and proofs."""
    now, then = dict(_rows(drift.now)), dict(_rows(drift.then))
    names = dict.fromkeys((*now, *then))
    rows = [(name, then.get(name, DASH), now.get(name, DASH)) for name in names]
    return table(("", drift.then.label, "now"), rows, numeric=(1, 2), caption="Coverage, noise and proof, then and now")


def findings(drift: Drift) -> Html:
    """Causes that a diagnosis named then and now."""
    then, now = drift.then.diagnosis, drift.now.diagnosis
    missing = [label for label, file in (("then", then), ("now", now)) if file is None]
    if then is None or now is None:
        why = f"there is no diagnosis of {' and of '.join(missing)} here"
        return tag("p", f"Findings of a diagnosis are not compared: {why}.")
    keys = dict.fromkeys((*_by_cause(then), *_by_cause(now)))
    if not keys:
        return tag("p", "No diagnosis, neither then nor now, found physics that the model lacks.")
    rows = [(_state(k, then, now), _says(k, then), _says(k, now)) for k in keys]
    return table(("Finding", drift.then.label, "now"), rows, caption="What diagnoses found that geometry lacks")


def _rows(one: Calibration) -> Iterator[tuple[str, str]]:
    model = one.model
    yield "samples", str(model.poses)
    yield from _ranges(one)
    yield "combinations seen", f"{model.rank} of {model.free}"
    if model.observability is not None:
        yield "observability O1", significant(model.observability.o1)
    yield from _noise(model)
    for proof in proofs(model)[:1]:
        yield f"unseen {proof.instrument} readings, rms distance", length(proof.rms_distance_after_m)
    if model.free_space is not None and model.free_space.pose_p95_m is not None:
        yield "tool error over the workspace, 95 %, predicted", length(model.free_space.pose_p95_m)
    yield "software", model.software


def _ranges(one: Calibration) -> Iterator[tuple[str, str]]:
    """What the joints went through; a model alone does not say."""
    if one.recording is None or len(one.recording.samples) == 0:
        return
    spans = np.degrees(np.ptp(one.recording.samples.joints(), axis=0))
    yield "joints went through", ", ".join(f"{fixed(float(s), 0)}°" for s in spans)


def _noise(model: ModelFile) -> Iterator[tuple[str, str]]:
    for name in (n for n in model.noise if n.endswith(BELIEVED)):
        source = name.removesuffix(BELIEVED)
        found = model.noise.get(source)
        if isinstance(found, float):
            yield f"noise of {source}", angle(found) if source in ANGULAR else length(found)
    for source, says in (("joint_rad", angle), ("psd_m", length)):  # of the method for spots alone
        found = model.noise.get(source)
        if isinstance(found, float):
            yield f"noise of {source.partition('_')[0]}", says(found)


def _by_cause(file: DiagnosisFile) -> dict[tuple[str, str], FindingRecord]:
    return {(f.where, f.physics): f for f in file.findings}


def _says(key: tuple[str, str], file: DiagnosisFile) -> str:
    finding = _by_cause(file).get(key)
    return DASH if finding is None else finding.says


def _state(key: tuple[str, str], then: DiagnosisFile, now: DiagnosisFile) -> str:
    if key not in _by_cause(then):
        return "new"
    return "in both" if key in _by_cause(now) else "gone"
