"""An identified arm to the file of another program; a new form is one file beside this one and one line here."""

import enum
from collections.abc import Callable, Mapping
from pathlib import Path

from acquisition.recording.rig import Rig
from calibrate.export.dh_csv import dh_csv_text
from calibrate.export.identified import IdentifiedArm, identified_arm
from calibrate.export.json_text import json_text
from calibrate.export.matlab import matlab_text
from calibrate.export.ur import ur_calibration_text, ur_kinematics_text
from calibrate.export.urdf import urdf_text
from calibrate.model_file import ModelFile, corrections


class ExportForm(enum.Enum):
    """By the word of the command line."""

    URDF = "urdf"
    DH_CSV = "dh-csv"
    UR_KINEMATICS = "ur-kinematics"  # YAML of the ROS description
    UR_CALIBRATION = "ur-calibration"  # lists of the controller's calibration.conf
    JSON = "json"
    MATLAB = "matlab"


FORMS: Mapping[ExportForm, Callable[[IdentifiedArm], str]] = {
    ExportForm.URDF: urdf_text,
    ExportForm.DH_CSV: dh_csv_text,
    ExportForm.UR_KINEMATICS: ur_kinematics_text,
    ExportForm.UR_CALIBRATION: ur_calibration_text,
    ExportForm.JSON: json_text,
    ExportForm.MATLAB: matlab_text,
}


def export_text(rig: Rig, values: Mapping[str, float], form: ExportForm) -> str:
    """The file's text; `values` are corrections by name.

    DataError for a correction of no parameter, or an arm that the form cannot hold.
    """
    return FORMS[form](identified_arm(rig, values))


def export_model(path: Path, rig: Rig, model: ModelFile, form: ExportForm) -> tuple[str, ...]:
    """Write the arm of a model, whole or not at all. Sentences about what the file cannot carry, as they stand in it.

    `rig` is in the arm model of `model`. DataError as `export_text`, and where effects cannot be evaluated; OSError
    where the folder cannot be written.
    """
    says = _not_carried(model) if model.effects else ()
    text = FORMS[form](identified_arm(rig, corrections(model), model.about.get("tool"), says))
    partial = path.with_name(path.name + ".partial")
    partial.write_text(text, encoding="utf-8")
    partial.replace(path)
    return says


def _not_carried(model: ModelFile) -> tuple[str, ...]:
    from calibrate.export.not_carried import not_carried  # a third of a second of imports that few runs need

    return not_carried(model).sentences
