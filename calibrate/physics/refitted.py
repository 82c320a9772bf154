"""The structure of a known model, geometry and effects, fitted to another recording: values anew, nothing searched."""

from dataclasses import dataclass

from msgspec import structs

from acquisition.recording import Recording, readings_sha256
from calibrate.diagnose.blunders_first import blunders_first
from calibrate.diagnose.fitted import fit_geometry
from calibrate.diagnose.session import session_of
from calibrate.effects.drivers import Drivers
from calibrate.errors import DataError
from calibrate.model_file import ModelFile
from calibrate.physics.from_diagnosis import model_of_fit
from calibrate.physics.known import Known, term_of, with_structure
from calibrate.physics.records import Effect

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
    cleared = blunders_first(recording.rig, recording.samples)
    if cleared.whole_file:
        raise DataError("; besides, ".join(b.says for b in cleared.blunders if b.whole_file))
    session = session_of(recording.rig, cleared.samples)
    entering = Known(known, known.readings_sha256 == readings_sha256(recording.samples)).effects
    used, notes = _possible(tuple(e for e in entering if not e.after), fit_geometry(session).drivers)
    notes += [f"left out, true of its own session only: {e.name}" for e in known.effects if e not in entering]
    before, fit = with_structure(used, session)
    model = model_of_fit(fit, before, cleared, recording, REFITTED)
    effects = [
        structs.replace(now, physics=was.physics, listed=was.listed)
        for was, now in zip(used, model.effects, strict=False)  # what they leave behind stands after them
    ]
    return Refitted(structs.replace(model, effects=(*effects, *model.effects[len(effects) :])), tuple(notes))


def _possible(effects: tuple[Effect, ...], drivers: Drivers) -> tuple[tuple[Effect, ...], list[str]]:
    """Those that this recording can size, and a sentence for each other one."""
    used, notes = list[Effect](), list[str]()
    for effect in effects:
        try:
            term_of(effect, drivers)
        except DataError as why:
            notes.append(f"not refitted: {why}")
        else:
            used.append(effect)
    return tuple(used), notes
