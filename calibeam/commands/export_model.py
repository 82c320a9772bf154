"""`calibeam export-model`: the arm of a model in the form of another program or of its controller."""

from pathlib import Path

from acquisition.recording.rig import ArmModel, parse_rig
from calibeam.overwriting import writes
from calibrate.apply.export import FormName, export_model, form_named
from calibrate.errors import DataError
from calibrate.model.model_file import read_model
from calibrate.model.predict import rig_in_model


@writes("out")
def export_model_command(model: Path, *, to: FormName | str, out: Path | None = None) -> None:
    """Export a model to another program, or to its controller.

    The file states in µm over the workspace what it cannot carry. A form that does not suit the arm is refused: the
    rig file states its make, [arm] make = "kuka". Where each number is entered, what to verify and how to go back
    stands in docs/controllers.

    For example:

    ```
    calibeam export-model model.json --to mjcf
    calibeam export-model model.json --to kuka-mastering --out a1-a6.csv
    ```

    Parameters
    ----------
    model
        The model.json of an identification or of a diagnosis; it holds the rig.
    to
        urdf, mjcf (MuJoCo, with joint stiffness), dh-csv, ur-kinematics, ur-calibration, kuka-mastering, abb-moc,
        fanuc-mastering, json, matlab, table (nominal, correction, calibrated; degrees and mm, in the robot's signs), or
        a form that an installed package brings.
    out
        The file to write. Default: beside the model, under its name.

    """
    form, known = form_named(to), read_model(model)
    if known.rig.text is None:
        raise DataError(f"{model}: the rig's text is not in the file; identify again")
    rig = rig_in_model(parse_rig(known.rig.text, f"rig.toml in {model}"), ArmModel(known.arm_model))
    path = model.with_name(model.stem + form.suffix) if out is None else out
    path.parent.mkdir(parents=True, exist_ok=True)
    for says in export_model(path, rig, known, form):
        print(says)
    print(f"{form.name}: {path}")
