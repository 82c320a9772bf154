"""The process that reads recordings for one worker: a task a line on standard input, a row a line on standard output.

Whatever a recording does to it, to crash, to hang, to eat all memory, does it to this process alone. It ends with the
worker (end of input, even in the middle of a task), and when nothing was asked for a while. Each recording is read,
identified, and diagnosed where asked; what is wrong with it stands in its row.
"""

import faulthandler
import os
import queue
import sys
import threading
import time
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from acquisition.recording import Recording, RecordingError, read
from acquisition.recording.rig import Rig
from calibeam.fleet.recordings import content_sha256
from calibeam.fleet.row import Cause, Outcome, Row, Task, Zero
from calibeam.results.diagnosis import diagnose_recording
from calibeam.results.identification import JudgedModel, identify_and_judge
from calibrate.diagnose.record.schema import DiagnosisFile
from calibrate.errors import DataError
from calibrate.model.alignment import aligned_difference
from calibrate.model.arms.catalogue import arm_of
from calibrate.model.arms.eccentric import with_discs
from calibrate.model.model_file import Fields, ModelFile
from calibrate.model.parameters import values_by_name
from calibrate.model.predict import Predictor
from calibrate.report.drift import drawn_values

IMPORTED = "imported_from"  # note of a recording that was made of a session folder: its start is that of the import
OF_NOISE = ("_believed", "_sigma", "_believed_rad", "_believed_m", "_sigma_rad", "_sigma_m")
NO_SIZES = ("chi2", "dof", "p_stated", "alarm", "converged", "at_zero")  # fields of the noise that are none


def judge_recording(task: Task) -> Row:
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
    except Exception as why:  # a fault of ours must not end a run over thousands; it is reported as what it is
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
        found = identify_and_judge(recording)
        causes = _diagnosed(recording) if task.diagnose else {}
    except DataError as why:
        return {**known, "outcome": Outcome.FAILED, "error": str(why)}
    if not found.finished:
        return {**known, "outcome": Outcome.FAILED, "fit_status": found.model.status, "error": found.model.says}
    return {**known, "outcome": Outcome.IDENTIFIED, **_of_model(found, recording.rig), **causes}


def _of_model(found: JudgedModel, rig: Rig) -> dict[str, Any]:
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


POSES = 300  # the rms settles to about 3 %
SEED = 1  # the same poses for every recording of an arm: what differs are the arms


def drawn_against_identified(model: ModelFile) -> float | None:
    """Rms distance (m) over poses drawn evenly between the joint limits, three axes together, base frames laid over.

    The target is the identified one on both arms. None where the model predicts no error over the workspace: then it is
    unknown what the target does.
    """
    room = model.free_space
    if room is None or room.rms_m is None:
        return None
    known = Predictor.of(model)
    arm = with_discs(arm_of(known.rig), known.rig)
    lower, upper = (np.array([getattr(j, k) for j in known.rig.arm.joints]) for k in ("lower_rad", "upper_rad"))
    q_rad = np.random.default_rng(SEED).uniform(lower, upper, (POSES, len(lower)))
    point = np.append(room.point_m, 1.0)
    drawn = (arm.flange(values_by_name(arm.parameters, {}), q_rad) @ point)[:, :3]
    identified = (known.flange(q_rad) @ point)[:, :3]
    return float(np.sqrt(np.mean(np.sum(aligned_difference(identified, drawn) ** 2, axis=1))))


IDLE_S = 120.0  # a Dask cluster stays up after a run: nothing of ours shall
READY = b"ready\n"


def main() -> None:
    """Answer until the input ends."""
    answers = os.fdopen(os.dup(1), "wb", buffering=0)
    os.dup2(2, 1)  # whatever a library prints is no answer
    faulthandler.enable()
    tasks: queue.SimpleQueue[bytes] = queue.SimpleQueue()
    threading.Thread(target=_listen, args=(tasks,), daemon=True).start()
    answers.write(READY)
    while True:
        try:
            line = tasks.get(timeout=IDLE_S)
        except queue.Empty:
            return
        row = judge_recording(msgspec.json.decode(line, type=Task))
        answers.write(msgspec.json.encode(row) + b"\n")


def _listen(tasks: "queue.SimpleQueue[bytes]") -> None:
    for line in sys.stdin.buffer:
        tasks.put(line)
    os._exit(0)  # the worker is gone, and nobody waits for what is being computed


if __name__ == "__main__":
    main()
