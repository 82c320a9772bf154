"""`calibeam predict`: what a model says the instruments should read at given samples."""

from pathlib import Path

from acquisition.recording.samples_csv import read_csv
from acquisition.recording.samples_parquet import read_parquet
from calibeam.predicted_csv import write_predicted
from calibrate.model_file import read_model
from calibrate.predict import Predictor, predict


def predict_command(model: Path, samples: Path, *, out: Path = Path("predicted.csv")) -> None:
    """Write one row per sample, in order: the predicted observation, and residuals where the sample holds one.

    Example: calibeam predict model.json samples.csv --out predicted.csv

    Parameters
    ----------
    model
        The model.json of an identification; it holds the rig.
    samples
        A samples.csv or samples.parquet with t_s and joint angles; it need not hold observations.
    out
        The CSV file to write.

    """
    predictor = Predictor.of(read_model(model))
    read = read_parquet if samples.suffix == ".parquet" else read_csv
    columns = predict(predictor, read(samples, predictor.rig))
    write_predicted(out, columns)
    print(f"predicted: {out}")
