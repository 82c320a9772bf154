"""`calibeam predict`: what the instruments should read by a model at given samples, with the physics it carries.

predicted.csv has one row per sample, the shortest text of every number, nothing where there is none.
"""

import math
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from acquisition.recording import Samples, read
from acquisition.recording.output import csv_text, table_output, write_output
from acquisition.recording.rig import Rig
from acquisition.recording.session_folder import read_csv, read_parquet
from calibeam.overwriting import writes
from calibrate.apply.predicting import predict_with_physics
from calibrate.errors import DataError
from calibrate.model.model_file import read_model
from calibrate.model.predict import Predictor

PREDICTED = table_output(("outside",), "table of predictions")


def write_predicted(path: Path, columns: Mapping[str, NDArray[np.float64]], outside: Sequence[str]) -> None:
    """Write columns (row,), NaN as an empty cell, and the drivers of each row that are beyond their recorded range.

    OutputError, OSError as `write_output`.
    """
    rows = (
        [*("" if math.isnan(value) else repr(value) for value in row), beyond]
        for *row, beyond in zip(*(values.tolist() for values in columns.values()), outside, strict=True)
    )
    write_output(path, csv_text([[*columns, "outside"], *rows]), PREDICTED)


def _table(path: Path, rig: Rig) -> Samples:
    """The samples of a table or a recording. SamplesError, RecordingError; DataError for an arm of other joints."""
    if path.is_dir() or path.suffix == ".mcap":
        samples = read(path).samples
        if samples.n_joints != rig.n_joints:
            raise DataError(
                f"{path}: samples of {samples.n_joints} joints, but the model's arm has {rig.n_joints}; "
                "give the model of this arm"
            )
        return samples
    return read_parquet(path, rig) if path.suffix == ".parquet" else read_csv(path, rig)


@writes(out=PREDICTED)
def predict_command(
    model: Path, samples: Path, *, out: Path = Path("predicted.csv"), same_session: bool = False
) -> None:
    """Predict readings with a model, each with its uncertainty.

    One row a sample, in input order: predicted reading, its sigma, and the residual where it was measured.

    For example:

    ```
    calibeam predict model.json samples.csv --out predicted.csv
    ```

    Parameters
    ----------
    model
        The model.json of an identification or of a diagnosis; it holds the rig.
    samples
        A samples.csv or samples.parquet with t_s and joint angles, a recording or a session folder; it need not hold
        observations.
    out
        The CSV file to write.
    same_session
        The samples are of the recording that the model was found in: effects that are true of that session only
        (a drift in time, a bumped fixture, a slip) are applied, too.

    """
    known = read_model(model)
    rig = Predictor.of(known).rig
    found = predict_with_physics(known, _table(samples, rig), same_session)
    write_predicted(out, found.columns, found.outside)
    for note in found.notes:
        print(note)
    print(f"predicted: {out}")
