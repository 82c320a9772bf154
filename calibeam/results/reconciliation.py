"""A simulation brought to agree with a recording: compared, diagnosed, replayed with what was found, compared again.

Rows are split by pose: the diagnosis sees three quarters, and how far the simulation is away, before and after, is
measured on the others. The two comparisons take all rows. reconcile.json, version 1, is described in docs/formats.md.
"""

from dataclasses import dataclass, replace
from pathlib import Path

import msgspec
import numpy as np
from numpy.typing import NDArray

from acquisition.recording import Recording, Samples, readings_sha256
from acquisition.recording.rig import parse_rig
from calibeam.results.diagnosis import diagnose_recording
from calibeam.results.identification import Planned, identify_session, session_model
from calibeam.simulation.replayed_recording import Replayed, replay
from calibeam.software import SOFTWARE
from calibrate.compare.compare_recordings import compare
from calibrate.compare.comparison_file import ComparisonFile
from calibrate.compare.corrected import corrected_samples, simulated_of
from calibrate.compare.fit_to_simulation import device_between
from calibrate.compare.matched import match
from calibrate.compare.reconciled_rows import (
    AGREES,
    QUANTITIES,
    UNSEEN,
    AllRowsRecord,
    ReconcileFile,
    enough,
    on_all_rows,
    on_unseen_rows,
    poses_of,
    refuse_unread,
    set_alike_by,
    split,
    stated_m_of,
    verdict_text,
    what_remains,
    what_was_left_out,
)
from calibrate.diagnose import limits
from calibrate.diagnose.from_recording import Diagnosed
from calibrate.diagnose.record.schema import DiagnosisFile
from calibrate.diagnose.state import session_of
from calibrate.diagnose.with_model import model_of_diagnosis, model_of_fit
from calibrate.errors import DataError
from calibrate.fit.fit_plan import FitPlan
from calibrate.model.model_file import ModelFile
from calibrate.model.placement import TARGETS
from calibrate.quantities import counted, length

Ints = NDArray[np.int64]
FRAME_ROWS = 3  # of a tracker, for its frame
BUILT = ("joint", "link", "psd")  # parameters of what a rig file states as built; where things stand is fitted


@dataclass(frozen=True, eq=False)
class Brought:
    """What was found of the seen rows, and the simulation with it."""

    diagnosis: DiagnosisFile
    model: ModelFile
    simulated: Replayed
    after: ComparisonFile


@dataclass(frozen=True, eq=False)
class Reconciled:
    """All that is written; `brought` None: too few rows."""

    file: ReconcileFile
    before: ComparisonFile | None  # None: not even the frame of a device can be found
    measured: Recording  # the rows that both have
    brought: Brought | None


def reconcile(measured: Recording, simulation: Recording | str, name: str, *, seed: int = 0) -> Reconciled:
    """`simulation`: its recording of the same plan, or the text of its rig file; `name` as a person knows it.

    Too few rows to diagnose and to keep some unseen are a result, too. DataError where the two cannot be compared.
    """
    refuse_unread(measured.samples)
    if len(measured.samples) < FRAME_ROWS:
        return _of_few(measured, (), name, seed, None)
    measured, simulated, seen, unseen = _sides(measured, simulation, name, seed)
    before = compare(measured, simulated, SOFTWARE)
    if not enough(seen, unseen):
        alike = set_alike_by(measured, simulated, np.arange(len(measured.samples)))
        found = tuple(on_all_rows(measured.samples, alike, stated_m_of(measured.rig)))
        return _of_few(measured, found, name, seed, before)
    part = replace(measured, samples=measured.samples.take(seen), streams={}, events=())
    found, diagnosis = diagnose_recording(part)
    model = _timed(model_of_diagnosis(found, part), measured.samples)
    geometry = _timed(_geometry(found, part), measured.samples)
    replayed = replay(measured, model, seed=seed, noise_found=True)
    plain = replay(measured, geometry, noisy=False).exact
    if isinstance(simulation, Recording):
        plain = _geometry_alone(measured, simulated, seen)
    after = compare(measured, _as_recording(measured, replayed.samples, "simulated.mcap"), SOFTWARE)
    unseen_records, rows = on_unseen_rows(
        measured.samples,
        (set_alike_by(measured, simulated, seen), plain, replayed.exact),
        unseen,
        diagnosis,
        stated_m_of(measured.rig),
    )
    remains = tuple(what_remains(unseen_records, rows, diagnosis, after))
    agrees = not remains
    file = ReconcileFile(
        1,
        "calibeam-reconciliation",
        SOFTWARE,
        measured.path.name,
        name,
        "agree" if agrees else "differ",
        verdict_text(unseen_records, before, remains),
        seed,
        len(seen),
        tuple(unseen.tolist()),
        unseen_records,
        rows,
        tuple(what_was_left_out(before, diagnosis, isinstance(simulation, Recording))),
        remains,
        diagnosis.next,
        tuple(dict.fromkeys((*before.notes, *replayed.notes, *after.notes))),
    )
    return Reconciled(file, before, measured, Brought(diagnosis, model, replayed, after))


def _of_few(
    measured: Recording, found: tuple[AllRowsRecord, ...], name: str, seed: int, before: ComparisonFile | None
) -> Reconciled:
    """What all rows show without a diagnosis: how far apart the two are, and whether noise alone may do it."""
    beyond = [one for one in found if one.stated_m is not None and one.low_m > AGREES * one.stated_m]
    poses, needed = int(poses_of(measured.samples).max()) + 1, round(limits.FEWEST_FOR_NAMES / (1.0 - UNSEEN))
    rows = f"{counted(len(measured.samples), 'row')} in {counted(poses, 'pose')}"
    open_ = f"{rows}: what the simulation lacks cannot be decided; about {needed} poses are needed"
    far = "; ".join(
        f"{one.instrument} {length(one.rms_m)} rms ({length(one.low_m)} to {length(one.high_m)})" for one in found
    )
    verdict = "differ" if beyond else "undecided"
    says = "Simulation and recording differ by more than the stated noise" if beyond else "It cannot be decided"
    says += " with so few rows whether simulation and recording agree" * (not beyond) + (f": {far}." if far else ".")
    file = ReconcileFile(
        1, "calibeam-reconciliation", SOFTWARE, measured.path.name, name, verdict, says, seed, 0, (), (), (), (),
        (open_,), (f"measure at least {needed} poses",), before.notes if before else (), found,
    )  # fmt: skip
    return Reconciled(file, before, measured, None)


def _sides(
    measured: Recording, simulation: Recording | str, name: str, seed: int
) -> tuple[Recording, Recording, Ints, Ints]:
    """Both with the same rows, and which of them are seen and unseen."""
    if isinstance(simulation, Recording):
        rows = match(measured.samples, simulation.samples, None)
        here = replace(measured, samples=measured.samples.take(rows.measured), events=())
        there = replace(simulation, samples=simulation.samples.take(rows.simulated), events=())
        return here, there, *split(here.samples, seed)
    seen, unseen = split(measured.samples, seed)
    here = replace(measured, events=())
    drawn = replace(here, rig=parse_rig(simulation, name), rig_text=simulation)
    part = replace(drawn, samples=here.samples.take(seen) if enough(seen, unseen) else here.samples)
    plan_used = Planned(FitPlan(schema=1, hold=_stated(part), share=0.0, splits=()))
    model = session_model(identify_session(part, plan_used), part, plan_used)
    exact = replay(drawn, model, noisy=False).exact
    return here, _as_recording(drawn, exact, name), seen, unseen


def _stated(drawn: Recording) -> tuple[str, ...]:
    """Parameters that the rig file states: arm and pair of detectors, and the targets on it that have a point.

    Were the detectors fitted, they would bend by millimetres to make up for an arm that is another one.
    """
    stated = (*BUILT, *(f"{TARGETS}{k}." for k in drawn.rig.targets))
    stated = (*stated, "tool.") if drawn.rig.tool.point_m is not None else stated
    return tuple(p.name for p in session_of(drawn.rig, drawn.samples).parameters if p.name.startswith(stated))


def _geometry(found: Diagnosed, part: Recording) -> ModelFile:
    if found.physics is None:
        raise DataError("the whole file is wrong; how is in diagnosis.json")
    alone = found.physics.geometry
    return model_of_fit(alone, alone, found.cleared, part, "geometry alone")


def _geometry_alone(measured: Recording, simulated: Recording, seen: Ints) -> Samples:
    """The simulated readings with the geometry of the seen rows: what no geometry gives stays as simulated."""
    pair = measured.samples, simulated.samples
    own = simulated_of(simulated.rig, pair[1])
    without = replace(measured, samples=corrected_samples(own, pair, device_between(own, pair)))
    part = replace(without, samples=without.samples.take(seen), streams={}, events=())
    free = Planned(FitPlan(schema=1, share=0.0, splits=()))
    model = session_model(identify_session(part, free), part, free)
    exact = replay(without, model, noisy=False).exact
    names = [name for one in QUANTITIES.values() for name in one if name in exact]
    kept = {n: exact.column(n) + measured.samples.column(n) - without.samples.column(n) for n in names}
    return Samples({**exact.columns, **kept}, exact.n_joints)


def _timed(model: ModelFile, samples: Samples) -> ModelFile:
    """The model as one of the whole session, whose clock and temperatures its rows share."""
    return msgspec.structs.replace(model, readings_sha256=readings_sha256(samples))


def _as_recording(source: Recording, samples: Samples, name: str) -> Recording:
    return replace(source, path=Path(name), samples=samples, streams={}, events=())
