"""What the models of real recordings are worth on rows that neither search nor fit has seen. No truth is known.

Every fifth of fifty blocks in time is kept away; the rest is identified and diagnosed, and the model files of both
predict: single rows beside their neighbours would be half seen. Nominal is the arm of the data sheet, with device and
target fitted to these very rows. One line a fold, as docs/real-data.md shows them.
"""

import tempfile
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from acquisition.recording import Recording, read
from calibeam.results.diagnosis import diagnose_recording
from calibeam.results.identification import identify_session, session_model
from calibrate.apply.predicting import predict_with_physics
from calibrate.diagnose.with_model.from_diagnosis import model_of_diagnosis
from calibrate.model.model_file import ModelFile, read_model, write_model

BLOCKS, FOLDS = 50, 5
XYZ = ("x_m", "y_m", "z_m")
HEAD = "| set | rows seen, unseen | fold | nominal | geometry | model | ratio | own rows, mean vector | CPU | found |"


def lines(data: Path) -> Iterator[str]:
    """Of every session folder in `data`; one line that says so where there is none."""
    folders = sorted(path.parent for path in data.glob("*/rig.toml")) if data.is_dir() else []
    if not folders:
        yield f"skipped: no session folders in {data.name}; the real recordings are not part of the project"
        return
    yield HEAD
    yield "|" + "---|" * (HEAD.count("|") - 1)
    for folder in folders:
        recording = read(folder)
        for fold in range(FOLDS):
            yield _line(recording, fold, folder.name)


def _line(recording: Recording, fold: int, name: str) -> str:
    known, asked = apart(recording, fold)
    nominal = 1e6 * identify_session(asked).instruments[0].rms_distance_before_m
    geometry = rms_um(errors_m(session_model(identify_session(known), known), asked))
    before = time.process_time()
    found, file = diagnose_recording(known)
    cpu_s = time.process_time() - before
    model = through_a_file(model_of_diagnosis(found, known))
    physics, own = rms_um(errors_m(model, asked)), errors_m(model, known)
    mean = ", ".join(f"{1e6 * v:.1f}" for v in np.mean(own, axis=0))
    names = [f"{f.physics} {f.where} {f.confidence:.2f}" for f in file.findings]
    names += [] if file.unexplained is None else [f"unexplained: {file.unexplained.says.split(';')[0]}"]
    return (
        f"| `{name}` | {len(known.samples)}, {len(asked.samples)} | {fold} | {nominal:.0f} µm | {geometry:.1f} µm | "
        f"{physics:.1f} µm | {physics / geometry:.3f} | {rms_um(own):.1f} ({mean}) µm | {cpu_s:.0f} s | "
        f"{'; '.join(names)} |"
    )


def apart(recording: Recording, fold: int) -> tuple[Recording, Recording]:
    """Rows that are fitted to, and those that are kept away."""
    block = np.arange(len(recording.samples)) * BLOCKS // len(recording.samples)
    rows = np.flatnonzero(block % FOLDS != fold), np.flatnonzero(block % FOLDS == fold)
    known, asked = (replace(recording, samples=recording.samples.take(some)) for some in rows)
    return known, asked


def through_a_file(model: ModelFile) -> ModelFile:
    """As a user reads it."""
    with tempfile.TemporaryDirectory() as folder:
        write_model(Path(folder) / "model.json", model)
        return read_model(Path(folder) / "model.json")


def errors_m(model: ModelFile, recording: Recording) -> NDArray[np.float64]:
    """(row, 3) measured minus predicted."""
    predicted = predict_with_physics(model, recording.samples, same_session=True).columns
    return np.stack([recording.samples.column(c) - predicted[c] for c in XYZ], axis=1)


def rms_um(errors_m: NDArray[np.float64]) -> float:
    """Of the distances."""
    return float(1e6 * np.sqrt(np.mean(np.sum(errors_m**2, axis=1))))
