"""A simulation that is a program: it gets the inputs of samples as a table and gives the readings that it expects.

The inputs stand on its standard input as CSV under the names of samples.csv, or in a file where the command holds
`{samples}`; on its standard output it writes one row a sample with the readings, under the same names. Nothing else is
asked of it, so it may be written in any language.
"""

import csv
import io
import math
import os
import shlex
import signal
import subprocess  # the user's own program, as typed on the command line
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from numpy.typing import NDArray

from acquisition.recording import Recording, Samples
from acquisition.recording.samples import BAR, BAR_END, PLANE, SEAT, cells_of, per_joint
from calibrate.apply.predicting import predict_with_physics
from calibrate.compare.matched import is_seated
from calibrate.errors import DataError
from calibrate.model.model_file import ModelFile
from calibrate.model.predict import Predictor
from calibrate.model.sensors.catalogue import SENSORS

Floats = NDArray[np.float64]

PLACE = "{samples}"
TIMEOUT_S = 60.0
SHOWN = 300  # characters of what a program that failed has written
INPUTS = ("placement", "first_psd", SEAT, PLANE, BAR, "target")  # stated of a reading, not read


@dataclass(frozen=True)
class Simulator:
    """A command line that answers with readings."""

    command: str
    timeout_s: float = TIMEOUT_S

    def readings(self, samples: Samples) -> dict[str, Floats]:
        """Column -> (row,) of every reading that the samples hold; NaN only where the samples have none either.

        DataError in one sentence where the program cannot be started, fails, hangs, or answers with another table.
        """
        _refuse_seated(samples)
        text = table_text(samples, inputs_of(samples))
        return _checked(self.command, self._answer(text), samples)

    def _answer(self, text: str) -> str:
        with TemporaryDirectory(prefix="calibeam-") as folder:
            words = _words(self.command)
            file = Path(folder) / "samples.csv"
            if asks_file := any(PLACE in word for word in words):
                file.write_text(text, encoding="utf-8")
                words = [word.replace(PLACE, str(file)) for word in words]
            code, answer, errors = self._run(words, "" if asks_file else text)
        if code:
            said = errors.strip().splitlines()
            last = said[-1][:SHOWN] if said else "without a message"
            raise DataError(f"simulator '{self.command}': it ended with code {code}: {last}")
        return answer

    def _run(self, words: list[str], text: str) -> tuple[int, str, str]:
        """In a process group of its own: what it has started ends with it."""
        pipe = subprocess.PIPE
        try:
            process = subprocess.Popen(  # noqa: S603 - that is what the user asks for, and no shell reads it
                words, stdin=pipe, stdout=pipe, stderr=pipe, encoding="utf-8", errors="replace", start_new_session=True
            )
        except OSError as why:
            raise DataError(f"simulator '{self.command}': it cannot be started: {why}") from why
        with process:
            try:
                answer, errors = process.communicate(text, timeout=self.timeout_s)
            except subprocess.TimeoutExpired:
                os.killpg(process.pid, signal.SIGKILL)
                raise DataError(
                    f"simulator '{self.command}': no answer within {self.timeout_s:g} s; it has to read all rows, "
                    "write all rows and end (--timeout-s gives it longer)"
                ) from None
            except BaseException:
                os.killpg(process.pid, signal.SIGKILL)
                raise
        return process.returncode, answer, errors


def simulated_by(simulator: Simulator, measured: Recording) -> Recording:
    """The recording as the program expects it: the same rows and rig, with its readings, and no streams."""
    samples = measured.samples
    columns = {name: samples.columns[name] for name in inputs_of(samples)} | simulator.readings(samples)
    ordered = {name: columns[name] for name in samples.names if name in columns}
    table = Samples(ordered, samples.n_joints)
    return replace(measured, path=Path(simulator.command), samples=table, streams={})


def simulated_by_model(model: ModelFile, measured: Recording) -> Recording:
    """The recording as the model predicts it, physics included. DataError where it cannot predict these samples."""
    samples = measured.samples
    _refuse_seated(samples)
    predicted = predict_with_physics(model, samples).columns
    wanted = [name for name in reading_columns(samples) if name in predicted]
    if not wanted:
        raise DataError(f"model of rig {model.rig.name}: it predicts none of the readings of {measured.path.name}")
    columns = {n: samples.columns[n] for n in inputs_of(samples)} | {n: predicted[n] for n in wanted}
    text = model.rig.text if model.rig.text is not None else measured.rig_text
    table = Samples({n: columns[n] for n in samples.names if n in columns}, samples.n_joints)
    return replace(
        measured, path=Path(f"model of {model.rig.name}"), rig=Predictor.of(model).rig, rig_text=text, samples=table,
        streams={},
    )  # fmt: skip


def _refuse_seated(samples: Samples) -> None:
    """DataError where a probe was seated: there the joints are the reading, and nobody can be asked for them."""
    if np.any(is_seated(samples)):
        raise DataError(
            "rows with a probe in a cone or at a bar: the joint angles are the reading, and no simulation can be asked "
            "for it at these poses; compare with a recording of the simulation instead"
        )
    if not any(np.any(np.isfinite(samples.column(name))) for name in reading_columns(samples)):
        raise DataError("the measured samples hold no reading to ask a simulation for")


def reading_columns(samples: Samples) -> tuple[str, ...]:
    """Columns of instruments in the samples, in their order; what is stated of a reading beside it is an input."""
    instruments = {name for kind in SENSORS for name in (*kind.columns, *kind.reads)} - {*INPUTS, BAR_END}
    instruments |= set(per_joint("enc", "_rad", samples.n_joints))
    not_simulated = ("_sum_v", "_sigma_m")  # of a detector: light and scatter, which no simulation is asked for
    return tuple(n for n in samples.names if n in instruments and not n.endswith(not_simulated))


def inputs_of(samples: Samples) -> tuple[str, ...]:
    """Columns that a simulation is given: time, joints, and every condition."""
    left = {*reading_columns(samples)}
    return tuple(n for n in samples.names if n not in left and not n.endswith(("_sum_v", "_sigma_m")))


def table_text(samples: Samples, names: tuple[str, ...]) -> str:
    """CSV with a header, the shortest text of every number, nothing where there is none."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(names)
    cells = [cells_of(name, samples.columns[name]) for name in names]
    for row in zip(*cells, strict=True):
        writer.writerow(["" if cell is None else cell for cell in row])
    return out.getvalue()


def _words(command: str) -> list[str]:
    try:
        words = shlex.split(command)
    except ValueError as why:
        raise DataError(f"simulator '{command}': {why}; quote its arguments as in a shell") from why
    if not words:
        raise DataError('simulator: no command; give one, as in --simulator "python my_sim.py"')
    return words


def _checked(command: str, text: str, samples: Samples) -> dict[str, Floats]:
    """The readings by name. DataError for a missing column, another number of rows, or what is no number."""
    rows = [row for row in csv.reader(io.StringIO(text)) if row]  # a blank line has no cells at all
    header = [name.strip() for name in rows[0]] if rows else []
    wanted = [name for name in reading_columns(samples) if np.any(np.isfinite(samples.column(name)))]
    asked = [name for name in wanted if not name.startswith("enc")]
    missing = [name for name in asked if name not in header]
    if missing:
        wrote = ", ".join(header)[:SHOWN] or "nothing"
        raise DataError(
            f"simulator '{command}': column {missing[0]} is missing from its answer; it wrote {wrote}, and the "
            f"measured readings are {', '.join(asked)}"
        )
    body = rows[1:]
    if len(body) != len(samples):
        raise DataError(
            f"simulator '{command}': {len(body)} rows for {len(samples)} samples; write one row for each, in order"
        )
    return {name: _column(command, name, header.index(name), body, samples) for name in wanted if name in header}


def _column(command: str, name: str, at: int, body: list[list[str]], samples: Samples) -> Floats:
    out = np.full(len(body), np.nan)
    read = np.isfinite(samples.column(name))
    for number, row in enumerate(body):
        cell = row[at].strip() if at < len(row) else ""
        try:
            out[number] = float(cell) if cell else math.nan
        except ValueError:
            raise DataError(
                f"simulator '{command}': row {number + 1}, column {name}: '{cell[:SHOWN]}' is no number"
            ) from None
        if read[number] and not math.isfinite(out[number]):
            raise DataError(
                f"simulator '{command}': row {number + 1}, column {name}: '{cell}', but the sample holds a reading; "
                "write the reading that is expected there"
            )
    return np.where(np.isfinite(out), out, np.nan)
