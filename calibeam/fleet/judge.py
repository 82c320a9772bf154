"""One recording of a fleet: read, identified, diagnosed where asked; whatever is wrong with it becomes its row."""

import time
from pathlib import Path
from typing import Any

import msgspec

from acquisition.recording import Recording, RecordingError, read
from acquisition.recording.rig import Rig
from calibeam.diagnosis import diagnose_recording
from calibeam.fleet.found import content_sha256
from calibeam.fleet.free_space import drawn_against_identified
from calibeam.fleet.order import Task
from calibeam.fleet.row import Cause, Outcome, Row, Zero
from calibeam.modelled import Modelled, modelled
from calibrate.diagnose.schema import DiagnosisFile
from calibrate.errors import DataError
from calibrate.model_file import Fields, ModelFile
from calibrate.report.drift.drawing import drawn_values

IMPORTED = "imported_from"  # note of a recording that was made of a session folder: its start is that of the import
OF_NOISE = ("_believed", "_sigma", "_believed_rad", "_believed_m", "_sigma_rad", "_sigma_m")
NO_SIZES = ("chi2", "dof", "p_stated", "alarm", "converged", "at_zero")  # fields of the noise that are none


def judged(task: Task) -> Row:
    """Never raises for what is in the file."""
    begun_s = time.monotonic()
    sha256 = ""
    fields: dict[str, Any]
    try:
        sha256 = content_sha256(Path(task.path))
        fields = _fields(task, read(task.path))
    except (RecordingError, DataError) as why:
        fields = {"outcome": Outcome.FAILED, "error": str(why)}
    except OSError as why:
        fields = {"outcome": Outcome.FAILED, "error": f"{task.path}: {why.strerror or why}"}
    except MemoryError:
        fields = {"outcome": Outcome.LOST, "error": "memory was short: give fewer --jobs"}
    except Exception as why:  # a fault of ours must not end a run over thousands; it is told as what it is
        fields = {"outcome": Outcome.FAILED, "error": f"a fault of this program: {type(why).__name__}: {why}"}
    return task.row(sha256=sha256, seconds=time.monotonic() - begun_s, **fields)


def _fields(task: Task, recording: Recording) -> dict[str, Any]:
    known: dict[str, Any] = {
        "rig": recording.rig.name,
        "robot_serial": recording.rig.arm.serial_number or "",
        "started_utc": task.date or ("" if IMPORTED in recording.notes else recording.started_utc),
        "complete": recording.complete,
        "samples": len(recording.samples),
    }
    if len(recording.samples) == 0 and recording.damage:
        return {
            **known,
            "outcome": Outcome.FAILED,
            "error": f"no settled sample is left: {'; '.join(recording.damage)}",
        }
    if len(recording.samples) == 0:
        return {**known, "outcome": Outcome.EMPTY, "error": "no settled sample"}
    try:
        found = modelled(recording)
        causes = _diagnosed(recording) if task.diagnose else {}
    except DataError as why:
        return {**known, "outcome": Outcome.FAILED, "error": str(why)}
    if not found.finished:
        return {**known, "outcome": Outcome.FAILED, "fit_status": found.model.status, "error": found.model.says}
    return {**known, "outcome": Outcome.IDENTIFIED, **_of_model(found, recording.rig), **causes}


def _of_model(found: Modelled, rig: Rig) -> dict[str, Any]:
    model = found.model
    before_m, after_m = _held_out(model)
    return {
        "instruments": model.instruments,
        "fit_status": model.status,
        "zeros": _zeros(model, rig),
        "noise": dict(_noise(model.noise)),
        "held_out_before_m": before_m,
        "held_out_after_m": after_m,
        "free_space_before_m": drawn_against_identified(model),
        "free_space_after_m": None if model.free_space is None else model.free_space.rms_m,
        "trust": found.verdict.trust.value,
        "says": found.verdict.sentence,
    }


def _zeros(model: ModelFile, rig: Rig) -> tuple[Zero, ...]:
    named, drawn = {p.name: p for p in model.parameters}, drawn_values(rig)
    names = ((joint, f"joint{joint}.zero") for joint in range(1, len(rig.arm.joints) + 1))
    found = ((joint, named[name], drawn[name]) for joint, name in names if name in named)
    return tuple(Zero(joint, p.value, p.sigma, p.undetermined or "determined", rad) for joint, p, rad in found)


def _noise(fields: Fields) -> list[tuple[str, float]]:
    """Source and size as found; names without their unit, which docs/fleets.md states."""
    sizes = {k: v for k, v in fields.items() if isinstance(v, float) and not k.startswith(NO_SIZES)}
    return [(k.removesuffix("_rad").removesuffix("_m"), v) for k, v in sizes.items() if not k.endswith(OF_NOISE)]


def _held_out(model: ModelFile) -> tuple[float | None, float | None]:
    """Of the first instrument under the first split, before and after."""
    first = next((p for p in model.proofs if p.instrument == model.instruments[0]), None)
    return (None, None) if first is None else (first.rms_distance_before_m, first.rms_distance_after_m)


def _diagnosed(recording: Recording) -> dict[str, Any]:
    _, file = diagnose_recording(recording)
    return {"verdict": file.verdict, "causes": _causes(file)}


def _causes(file: DiagnosisFile) -> list[dict[str, Any]]:
    return [
        msgspec.to_builtins(Cause(f.where, f.depends_on, f.shape, f.physics, f.confidence, f.share, f.says))
        for f in file.findings
    ]
