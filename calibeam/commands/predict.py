"""`calibeam predict`: what a model says the instruments should read at given samples, with the physics it carries."""

from pathlib import Path

from acquisition.recording.session_folder import read_csv, read_parquet
from calibeam.predicted_csv import write_predicted
from calibrate.model_file import read_model
from calibrate.physics.predicting import predict_with_physics
from calibrate.predict import Predictor


def predict_command(
    model: Path, samples: Path, *, out: Path = Path("predicted.csv"), same_session: bool = False
) -> None:
    """Predict readings with a model, each with its uncertainty.

    One row a sample, in input order: predicted reading, its sigma, and the residual where it was measured.

    Example: calibeam predict model.json samples.csv --out predicted.csv

    Parameters
    ----------
    model
        The model.json of an identification or of a diagnosis; it holds the rig.
    samples
        A samples.csv or samples.parquet with t_s and joint angles; it need not hold observations.
    out
        The CSV file to write.
    same_session
        The samples are of the recording that the model was found in: effects that are true of that session only
        (a drift in time, a bumped fixture, a slip) are applied, too.

    """
    known = read_model(model)
    rig = Predictor.of(known).rig
    read = read_parquet if samples.suffix == ".parquet" else read_csv
    found = predict_with_physics(known, read(samples, rig), same_session)
    write_predicted(out, found.columns, found.outside)
    for note in found.notes:
        print(note)
    print(f"predicted: {out}")
