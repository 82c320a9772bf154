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


def export_text(rig: Rig, corrections: Mapping[str, float], form: ExportForm) -> str:
    """The file's text. DataError for a correction of no parameter, or an arm that the form cannot hold."""
    return FORMS[form](identified_arm(rig, corrections))


def export_model(path: Path, rig: Rig, corrections: Mapping[str, float], form: ExportForm) -> None:
    """Write the rig's arm as corrected (model_file.corrections), whole or not at all.

    DataError as `export_text`; OSError where the folder cannot be written.
    """
    text = export_text(rig, corrections, form)
    partial = path.with_name(path.name + ".partial")
    partial.write_text(text, encoding="utf-8")
    partial.replace(path)
