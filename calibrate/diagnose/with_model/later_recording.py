"""A recording beside a known model: the changes that it shows, and the model fitted to it again.

Refitted: geometry and effects of the known model take new values from another recording; nothing is searched for.
"""

from dataclasses import dataclass, replace

from msgspec import structs

from acquisition.recording import Recording
from calibrate.diagnose.assess.diagnosis import Verdict
from calibrate.diagnose.from_recording import Diagnosed
from calibrate.diagnose.gross_errors import gross_errors_first
from calibrate.diagnose.record.schema import (
    ChangedRecord,
    DiagnosisFile,
    FindingRecord,
    KnownRecord,
)
from calibrate.diagnose.state.fitted import fit_geometry
from calibrate.diagnose.state.session import session_of
from calibrate.diagnose.with_model.from_diagnosis import model_of_fit
from calibrate.diagnose.with_model.known import Known, term_of, with_structure
from calibrate.errors import DataError
from calibrate.model.effect_records import EffectRecord
from calibrate.model.effects.drivers import Drivers
from calibrate.model.effects.moved import RECORDING, SIX
from calibrate.model.model_file import ModelFile
from calibrate.model.sensors import seat

OWNER = {  # first part of a place -> of the parameters of model.json, with the number of the station or cone
    "fixture": "placement",
    seat.KIND.name: seat.POINTS,
}
AXES = {"shift_x_m": "x", "shift_y_m": "y", "shift_z_m": "z"}  # of a point
POINTS = ("tool.point", f"{seat.KIND.name}.position")


def only_new(found: Diagnosed) -> Diagnosed:
    """On the model's own recording what it could not name was there before: it is no news."""
    if found.physics is None or found.physics.diagnosis.findings:
        return found
    said = replace(found.physics.diagnosis, unexplained=(), verdict=Verdict.CONSISTENT)
    return replace(found, physics=replace(found.physics, diagnosis=said))


def with_known_model(file: DiagnosisFile, known: Known, found: Diagnosed) -> DiagnosisFile:
    """The record with `known` and `changed`; `file` is of `found`."""
    entered = known.effects
    left = tuple(e.name for e in known.model.effects if e not in entered and not e.after)
    known_record = KnownRecord(known.same_recording, tuple(e.name for e in entered), left)
    findings = () if found.physics is None else found.physics.diagnosis.findings
    each = zip(file.findings, findings, strict=True)
    changed = tuple(c for record, finding in each for c in _changed(record, finding.variant, known))
    return structs.replace(file, known=known_record, changed=changed)


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


def _effect_of(finding: FindingRecord, effects: tuple[EffectRecord, ...]) -> EffectRecord | None:
    """The known effect of the same physics at the same place by the same drivers."""
    same = (finding.where, finding.physics, finding.depends_on, finding.order)
    return next((e for e in effects if (e.where, e.physics, e.depends_on, e.order) == same), None)


REFITTED = "geometry and effects of a known model fitted together to this recording"


@dataclass(frozen=True)
class Refitted:
    """The record to write, and a sentence for each effect that could not be refitted."""

    model: ModelFile
    notes: tuple[str, ...]


def refit(known: ModelFile, recording: Recording) -> Refitted:
    """Effects that hold for the known model's session only are left out of any other recording.

    DataError where the recording is wrong as a whole, or holds nothing to fit.
    """
    cleared = gross_errors_first(recording.rig, recording.samples)
    if cleared.whole_file:
        raise DataError("; besides, ".join(b.says for b in cleared.blunders if b.whole_file))
    session = session_of(recording.rig, cleared.samples)
    entering = Known(known, known.made_of(recording.samples) is not False).effects
    used, notes = _possible(tuple(e for e in entering if not e.after), fit_geometry(session).drivers)
    notes += [f"left out, true of its own session only: {e.name}" for e in known.effects if e not in entering]
    before, fit = with_structure(used, session)
    model = model_of_fit(fit, before, cleared, recording, REFITTED)
    effects = [
        structs.replace(now, physics=was.physics, listed=was.listed)
        for was, now in zip(used, model.effects, strict=False)  # what they leave behind stands after them
    ]
    return Refitted(structs.replace(model, effects=(*effects, *model.effects[len(effects) :])), tuple(notes))


def _possible(effects: tuple[EffectRecord, ...], drivers: Drivers) -> tuple[tuple[EffectRecord, ...], list[str]]:
    """Those that this recording can size, and a sentence for each other one."""
    used, notes = list[EffectRecord](), list[str]()
    for effect in effects:
        try:
            term_of(effect, drivers)
        except DataError as why:
            notes.append(f"not refitted: {why}")
        else:
            used.append(effect)
    return tuple(used), notes
