"""`calibeam identify`: the arm of a recording or session folder, by whatever instruments it holds."""

from pathlib import Path

from rich.console import Console

from acquisition.recording.read import read
from calibeam.any_session import identify_session, only_spots, write_session_model
from calibeam.identification import identify_recording, write_identified
from calibeam.session_table import print_identification
from calibeam.terminal import print_identified
from calibrate.export.export import ExportForm, export_model
from calibrate.model_file import corrections, read_model

SUFFIX = {
    ExportForm.URDF: ".urdf",
    ExportForm.DH_CSV: ".dh.csv",
    ExportForm.UR_KINEMATICS: ".kinematics.yaml",
    ExportForm.UR_CALIBRATION: ".calibration.conf",
    ExportForm.JSON: ".arm.json",
    ExportForm.MATLAB: ".m",
}


def identify_command(recording: Path, *, out: Path = Path("model.json"), export: tuple[ExportForm, ...] = ()) -> None:
    """Identify the arm: blunders of the file, rank and what cannot be determined first, then numbers with their sigma.

    Spots of the dual PSD alone give joint zeros; positions, wire, cones, bars, full poses (several at once) the arm.

    Example: calibeam identify out/demo/recording.mcap --out model.json

    Parameters
    ----------
    recording
        A recording, or a session folder with rig.toml and samples.csv.
    out
        Where to write the model.
    export
        Also write the arm for another program, beside the model: urdf, dh-csv, ur-kinematics, ur-calibration, json,
        matlab.

    """
    source, console = read(recording), Console()
    if only_spots(source.samples):
        identified = identify_recording(source)
        write_identified(identified, source, out)
        print_identified(console, identified)
    else:
        result = identify_session(source)
        write_session_model(result, source, out)
        print_identification(console, result)
    console.print(f"model: {out}", markup=False)
    for form in export:
        beside = out.with_name(out.stem + SUFFIX[form])
        export_model(beside, source.rig, corrections(read_model(out)), form)
        console.print(f"{form.value}: {beside}", markup=False)
