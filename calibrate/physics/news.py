"""A diagnosis beside a known model: what is new, and which of the known values have changed by how much."""

from dataclasses import replace

from msgspec import structs

from calibrate.diagnose.diagnosis import Verdict
from calibrate.diagnose.from_recording import Diagnosed
from calibrate.diagnose.schema import ChangedRecord, DiagnosisFile, FindingRecord, KnownRecord
from calibrate.effects.moved import SIX
from calibrate.effects.since_model import RECORDING
from calibrate.physics.known import Known
from calibrate.physics.records import Effect
from calibrate.sensors import seat

OWNER = {  # first part of a place -> of the parameters of model.json, with the number of the station or cone
    "fixture": "placement",
    "seat": seat.POINTS,
}
AXES = {"shift_x_m": "x", "shift_y_m": "y", "shift_z_m": "z"}  # of a point
POINTS = ("tool.point", "seat.position")


def only_new(found: Diagnosed) -> Diagnosed:
    """On the model's own recording what it could not name was there before: it is no news."""
    if found.physics is None or found.physics.diagnosis.findings:
        return found
    said = replace(found.physics.diagnosis, unexplained=(), verdict=Verdict.CONSISTENT)
    return replace(found, physics=replace(found.physics, diagnosis=said))


def beside_known(file: DiagnosisFile, known: Known, found: Diagnosed) -> DiagnosisFile:
    """The record with `known` and `changed`; `file` is of `found`."""
    entered = known.effects
    left = tuple(e.name for e in known.model.effects if e not in entered and not e.after)
    told = KnownRecord(known.same_recording, tuple(e.name for e in entered), left)
    findings = () if found.physics is None else found.physics.diagnosis.findings
    each = zip(file.findings, findings, strict=True)
    changed = tuple(c for record, finding in each for c in _changed(record, finding.variant, known))
    return structs.replace(file, known=told, changed=changed)


def _changed(finding: FindingRecord, variant: str, known: Known) -> tuple[ChangedRecord, ...]:
    """Empty for physics that the model does not hold: that is new, not changed."""
    effect = _effect_of(finding, known.effects)
    if effect is None and finding.depends_on != RECORDING:
        return ()
    out: list[ChangedRecord] = []
    for name, size in finding.parameters.items():
        if size.value is None or size.sigma is None:
            continue
        if effect is None:
            own = _own_name(finding.where, variant, name)
            was = known.model.chain.get(own)
        else:
            own, before = f"{effect.name}.{name}", effect.parameters.get(name)
            was = None if before is None else before.value
        out.append(ChangedRecord(own, was, size.value, size.sigma))
    return tuple(out)


def _own_name(where: str, variant: str, name: str) -> str:
    """Of the parameter of model.json that a constant is the change of, where it has one: "joint3.zero", "seat2.x"."""
    place, _, _ = where.partition(".")
    number = variant.rpartition(" ")[2]
    owner = f"{OWNER.get(place, place)}{number}"
    if where in POINTS:
        return f"{owner}.{AXES[name]}"
    plain = name.removesuffix("_m").removesuffix("_rad")
    return f"{owner}.{name if name in SIX else plain}"


def _effect_of(finding: FindingRecord, effects: tuple[Effect, ...]) -> Effect | None:
    """The known effect of the same physics at the same place by the same drivers."""
    same = (finding.where, finding.physics, finding.depends_on, finding.order)
    return next((e for e in effects if (e.where, e.physics, e.depends_on, e.order) == same), None)
