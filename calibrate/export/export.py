"""An identified arm to the file of another program; a new form is one file beside this one and one line here."""

import enum
from collections.abc import Callable, Mapping
from pathlib import Path

from acquisition.recording.rig import Make, Rig
from acquisition.recording.rig.devices import RobotDriver
from calibrate.errors import DataError
from calibrate.export.dh_csv import dh_csv_text
from calibrate.export.identified import IdentifiedArm, identified_arm
from calibrate.export.json_text import json_text
from calibrate.export.mastering import abb_moc_text, fanuc_mastering_text, kuka_mastering_text
from calibrate.export.matlab import matlab_text
from calibrate.export.mjcf import mjcf_text
from calibrate.export.nominal_table import nominal_table_text
from calibrate.export.ur import ur_calibration_text, ur_kinematics_text
from calibrate.export.urdf import urdf_text
from calibrate.model_file import ModelFile, corrections
from calibrate.physics.records import Effect

COMPLIANCE = "compliance_rad_nm"


class ExportForm(enum.Enum):
    """By the word of the command line."""

    URDF = "urdf"
    DH_CSV = "dh-csv"
    UR_KINEMATICS = "ur-kinematics"  # YAML of the ROS description
    UR_CALIBRATION = "ur-calibration"  # lists of the controller's calibration.conf
    JSON = "json"
    MATLAB = "matlab"
    MJCF = "mjcf"  # MuJoCo, with joint stiffness
    KUKA_MASTERING = "kuka-mastering"
    ABB_MOC = "abb-moc"
    FANUC_MASTERING = "fanuc-mastering"
    TABLE = "table"  # nominal, correction, calibrated


FORMS: Mapping[ExportForm, Callable[[IdentifiedArm], str]] = {
    ExportForm.URDF: urdf_text,
    ExportForm.DH_CSV: dh_csv_text,
    ExportForm.UR_KINEMATICS: ur_kinematics_text,
    ExportForm.UR_CALIBRATION: ur_calibration_text,
    ExportForm.JSON: json_text,
    ExportForm.MATLAB: matlab_text,
    ExportForm.MJCF: mjcf_text,
    ExportForm.KUKA_MASTERING: kuka_mastering_text,
    ExportForm.ABB_MOC: abb_moc_text,
    ExportForm.FANUC_MASTERING: fanuc_mastering_text,
    ExportForm.TABLE: nominal_table_text,
}

SUFFIX: Mapping[ExportForm, str] = {
    ExportForm.URDF: ".urdf",
    ExportForm.DH_CSV: ".dh.csv",
    ExportForm.UR_KINEMATICS: ".kinematics.yaml",
    ExportForm.UR_CALIBRATION: ".calibration.conf",
    ExportForm.JSON: ".arm.json",
    ExportForm.MATLAB: ".m",
    ExportForm.MJCF: ".mjcf.xml",
    ExportForm.KUKA_MASTERING: ".kuka-mastering.csv",
    ExportForm.ABB_MOC: ".abb-moc.csv",
    ExportForm.FANUC_MASTERING: ".fanuc-mastering.csv",
    ExportForm.TABLE: ".table.csv",
}
MAKES: Mapping[ExportForm, Make] = {  # whose controllers a form is for
    ExportForm.UR_KINEMATICS: Make.UR,
    ExportForm.UR_CALIBRATION: Make.UR,
    ExportForm.KUKA_MASTERING: Make.KUKA,
    ExportForm.ABB_MOC: Make.ABB,
    ExportForm.FANUC_MASTERING: Make.FANUC,
}
OFFSETS = (ExportForm.KUKA_MASTERING, ExportForm.ABB_MOC, ExportForm.FANUC_MASTERING)  # hold zeros, no geometry

UNCOUPLED: Mapping[ExportForm, str] = {  # forms that cannot carry a joint that follows another one, with the reason
    ExportForm.UR_KINEMATICS: "no arm of Universal Robots has one; take another form, or correct the rig",
    ExportForm.UR_CALIBRATION: "no arm of Universal Robots has one; take another form, or correct the rig",
    ExportForm.ABB_MOC: "the rig file does not hold how its motors are coupled: offsets of motors would be guesses",
}


def export_text(rig: Rig, values: Mapping[str, float], form: ExportForm) -> str:
    """The file's text; `values` are corrections by name.

    DataError for a correction of no parameter, or an arm that the form cannot hold.
    """
    _refuse_coupled(rig, form)
    return FORMS[form](identified_arm(rig, values))


def export_model(path: Path, rig: Rig, model: ModelFile, form: ExportForm) -> tuple[str, ...]:
    """Write the arm of a model, whole or not at all. Sentences about what the file cannot carry, as they stand in it.

    `rig` is in the arm model of `model`. DataError as `export_text`, for an arm of another make than the form's, and
    where effects cannot be evaluated; OSError where the folder cannot be written.
    """
    refuse_other_make(rig, form)
    _refuse_coupled(rig, form)
    soft = _linear_compliance(rig, model) if form is ExportForm.MJCF else {}
    says = _not_carried(model, tuple(soft)) if model.effects else ()
    if form in OFFSETS:
        says = (_geometry_lost(model), *says)
    compliance = {int(e.where.removeprefix("joint").split(".")[0]): c for e, c in soft.values()}
    arm = identified_arm(
        rig, corrections(model), model.about.get("tool"), says, model.parameters, compliance, model.covariance
    )
    partial = path.with_name(path.name + ".partial")
    partial.write_text(FORMS[form](arm), encoding="utf-8")
    partial.replace(path)
    return says


def refuse_other_make(rig: Rig, form: ExportForm) -> None:
    """DataError for a form of a controller that this arm has not; a UR driver tells the make, too."""
    wanted, robot = MAKES.get(form), rig.devices.robot
    made = rig.arm.make
    if made is None and robot is not None and robot.driver is RobotDriver.UR_RTDE:
        made = Make.UR
    if wanted is None or made is wanted:
        return
    state = "not stated" if made is None else f"'{made.value}'"
    raise DataError(
        f"rig {rig.name}: {form.value} is for arms of make '{wanted.value}', and the make of this one is {state}; take "
        f'another form, or state make = "{wanted.value}" under [arm] if it is one'
    )


def _refuse_coupled(rig: Rig, form: ExportForm) -> None:
    """DataError for an arm with a joint that follows another one, where the form cannot carry that."""
    followers = [i for i, joint in enumerate(rig.arm.joints, start=1) if joint.follows is not None]
    if followers and form in UNCOUPLED:
        raise DataError(f"rig {rig.name}: joint {followers[0]} follows another joint, and {UNCOUPLED[form]}")


def _linear_compliance(rig: Rig, model: ModelFile) -> dict[str, tuple[Effect, float]]:
    """Name -> effect and rad / (N m): joints that yield in proportion to the torque of the stated masses."""
    if not all(joint.mass_kg for joint in rig.arm.joints):
        return {}
    out: dict[str, tuple[Effect, float]] = {}
    for effect in model.effects:
        compliance = effect.parameters.get(COMPLIANCE)
        plain = effect.physics == "joint-compliance" and effect.shape == "linear" and not effect.variant
        if plain and effect.holds == "always" and len(effect.coefficients) == 1 and compliance is not None:
            value = compliance.value
            if value is not None and value > 0.0:
                out[effect.name] = (effect, value)
    return out


def _not_carried(model: ModelFile, carried: tuple[str, ...]) -> tuple[str, ...]:
    from calibrate.export.not_carried import not_carried  # a third of a second of imports that few runs need

    return not_carried(model, carried).sentences


def _geometry_lost(model: ModelFile) -> str:
    from calibrate.export.not_carried import geometry_lost

    return geometry_lost(model)
