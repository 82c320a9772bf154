"""A diagnosis beside a known model: what is new, and which of the known values have changed by how much."""

from dataclasses import replace

from msgspec import structs

from calibrate.diagnose.diagnosis import Verdict
from calibrate.diagnose.from_recording import Diagnosed
from calibrate.diagnose.schema import ChangedRecord, DiagnosisFile, FindingRecord, KnownRecord
from calibrate.effects.since_model import RECORDING
from calibrate.physics.known import Known
from calibrate.physics.records import Effect

PARAMETER = {  # of a constant that has changed -> the parameter of model.json
    "zero_rad": "zero",
    "length_m": "length",
    "offset_m": "offset",
    "twist_rad": "twist",
    "tilt_rad": "tilt",
}


def only_new(found: Diagnosed) -> Diagnosed:
    """On the model's own recording what it could not name was there before: it is no news."""
    if found.physics is None or found.physics.diagnosis.findings:
        return found
    said = replace(found.physics.diagnosis, unexplained=(), verdict=Verdict.CONSISTENT)
    return replace(found, physics=replace(found.physics, diagnosis=said))


def beside_known(file: DiagnosisFile, known: Known) -> DiagnosisFile:
    """The record with `known` and `changed`."""
    entered = known.effects
    left = tuple(e.name for e in known.model.effects if e not in entered and not e.after)
    told = KnownRecord(known.same_recording, tuple(e.name for e in entered), left)
    changed = tuple(c for finding in file.findings for c in _changed(finding, known))
    return structs.replace(file, known=told, changed=changed)


def _changed(finding: FindingRecord, known: Known) -> tuple[ChangedRecord, ...]:
    """Empty for physics that the model does not hold: that is new, not changed."""
    effect = _effect_of(finding, known.effects)
    if effect is None and finding.depends_on != RECORDING:
        return ()
    out: list[ChangedRecord] = []
    for name, size in finding.parameters.items():
        if size.value is None or size.sigma is None:
            continue
        place = finding.where.split(".")[0]
        if effect is not None:
            was = effect.parameters.get(name)
            out.append(
                ChangedRecord(f"{effect.name}.{name}", None if was is None else was.value, size.value, size.sigma)
            )
            continue
        own = f"{place}.{PARAMETER.get(name, name)}"
        out.append(ChangedRecord(own, known.model.chain.get(own), size.value, size.sigma))
    return tuple(out)


def _effect_of(finding: FindingRecord, effects: tuple[Effect, ...]) -> Effect | None:
    """The known effect of the same physics at the same place by the same drivers."""
    same = (finding.where, finding.physics, finding.depends_on, finding.order)
    return next((e for e in effects if (e.where, e.physics, e.depends_on, e.order) == same), None)
