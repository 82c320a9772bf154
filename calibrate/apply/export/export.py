"""An identified arm to the file of another program; a new form is one function beside this file and one line here.

Forms of installed packages are entry points of the group `calibeam.exports`.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

from acquisition.recording.files import cleaned
from acquisition.recording.output import OutputKind, text_output, write_output
from acquisition.recording.rig import Make, Rig
from acquisition.recording.rig.devices import RobotDriver
from calibrate.apply.export.controllers import (
    ABB,
    FANUC,
    KUKA,
    abb_moc_text,
    fanuc_mastering_text,
    kuka_mastering_text,
    refused,
    ur_calibration_text,
    ur_kinematics_text,
    without_ratio,
)
from calibrate.apply.export.dh_table import dh_csv_text, matlab_text
from calibrate.apply.export.identified import IdentifiedArm, identified_arm
from calibrate.apply.export.nominal_table import json_text, nominal_table_text
from calibrate.apply.export.robot_description import mjcf_text, urdf_text
from calibrate.errors import DataError
from calibrate.fit.fit_plan import ZEROS_ONLY_COMMAND
from calibrate.model.effect_records import EffectRecord
from calibrate.model.model_file import ModelFile, corrections
from calibrate.plug_ins import EXPORTS, loaded

COMPLIANCE = "compliance_rad_nm"


@dataclass(frozen=True, kw_only=True)
class ExportForm:
    """A form of file that an arm can be exported in: one of FORMS, or brought by an installed package.

    `text` gives the whole file; it should hold `IdentifiedArm.sign` and each sentence of `not_carried`, and may raise
    DataError for an arm that it cannot hold.
    """

    name: str  # the word of the command line
    suffix: str  # of the file beside the model
    text: Callable[[IdentifiedArm], str]
    mark: str = ""  # stands near the beginning of each file of this form; "": an older file needs --force
    make: Make | None = None  # whose controllers it is for; None: any
    offsets: bool = False  # it holds zeros, no geometry
    springs: bool = False  # it carries joints that yield in proportion to their torque
    uncoupled: str = ""  # why it cannot carry a joint that follows another one; "": it can


NO_OFFSETS = f"every offset is empty: beside free lengths and axes no zero is determined; {ZEROS_ONLY_COMMAND}"
TOGETHER = f"identified together with lengths and axes; {ZEROS_ONLY_COMMAND}"
NO_UR = "no arm of Universal Robots has one; take another form, or correct the rig"
GUESSED = "the rig file does not hold how its motors are coupled: offsets of motors would be guesses"
FORMS: tuple[ExportForm, ...] = (
    ExportForm(name="urdf", suffix=".urdf", text=urdf_text, mark="Identified by calibeam. m and rad"),
    ExportForm(name="dh-csv", suffix=".dh.csv", text=dh_csv_text, mark="table, identified by calibeam"),
    ExportForm(  # YAML of the ROS description
        name="ur-kinematics",
        suffix=".kinematics.yaml",
        text=ur_kinematics_text,
        mark="rad; roll, pitch, yaw",
        make=Make.UR,
        uncoupled=NO_UR,
    ),
    ExportForm(  # lists of the controller's calibration.conf
        name="ur-calibration",
        suffix=".calibration.conf",
        text=ur_calibration_text,
        mark="true = drawn + delta",
        make=Make.UR,
        uncoupled=NO_UR,
    ),
    ExportForm(name="json", suffix=".arm.json", text=json_text, mark='"kind": "calibeam-arm"'),
    ExportForm(name="matlab", suffix=".m", text=matlab_text, mark="% Identified by calibeam"),
    ExportForm(
        name="mjcf", suffix=".mjcf.xml", text=mjcf_text, mark="Identified by calibeam. m, rad, kg", springs=True
    ),
    ExportForm(
        name="kuka-mastering",
        suffix=".kuka-mastering.csv",
        text=kuka_mastering_text,
        mark=KUKA,
        make=Make.KUKA,
        offsets=True,
    ),
    ExportForm(
        name="abb-moc",
        suffix=".abb-moc.csv",
        text=abb_moc_text,
        mark=ABB,
        make=Make.ABB,
        offsets=True,
        uncoupled=GUESSED,
    ),
    ExportForm(
        name="fanuc-mastering",
        suffix=".fanuc-mastering.csv",
        text=fanuc_mastering_text,
        mark=FANUC,
        make=Make.FANUC,
        offsets=True,
    ),
    ExportForm(name="table", suffix=".table.csv", text=nominal_table_text, mark="# Nominal, correction, calibrated"),
)
# The words of FORMS, for the command line: what a help page lists and a shell completes before anything is loaded.
FormName = Literal[
    "urdf",
    "dh-csv",
    "ur-kinematics",
    "ur-calibration",
    "json",
    "matlab",
    "mjcf",
    "kuka-mastering",
    "abb-moc",
    "fanuc-mastering",
    "table",
]


def form_named(name: str) -> ExportForm:
    """The form of this word, of ours or of an installed package. DataError with the list of all for another word."""
    own = next((form for form in FORMS if form.name == name), None)
    if own is not None:  # nothing is looked up, and no package can take the place of a form of ours
        return own
    brought = loaded(EXPORTS, ExportForm)
    found = next((form for form in brought if form.name == name), None)
    if found is None:
        known = ", ".join(form.name for form in (*FORMS, *brought))
        raise DataError(f"no form of export is called '{name}'; choose one of {known}")
    return found


def export_text(rig: Rig, values: Mapping[str, float], form: ExportForm) -> str:
    """The file's text; `values` are corrections by name.

    DataError for a correction of no parameter, or an arm that the form cannot hold.
    """
    _refuse_coupled(rig, form)
    return cleaned(form.text(identified_arm(rig, values)))


def export_model(path: Path, rig: Rig, model: ModelFile, form: ExportForm) -> tuple[str, ...]:
    """Write the arm of a model, whole or not at all. Sentences about what the file cannot carry, as they stand in it.

    `rig` is in the arm model of `model`. DataError as `export_text`, for an arm of another make than the form's, and
    where effects cannot be evaluated; OutputError, OSError as `write_output`.
    """
    refuse_other_make(rig, form)
    _refuse_coupled(rig, form)
    soft = _linear_compliance(rig, model) if form.springs else {}
    says = _not_carried(model, tuple(soft)) if model.effects else ()
    with_links = any(name.startswith("link") and value != 0.0 for name, value in model.chain.items())
    if form.offsets:
        says = (*_not_in_offsets(model, with_links=with_links), *says)
    if form.text is abb_moc_text:
        says = (*says, *without_ratio(rig))
    compliance = {int(e.where.removeprefix("joint").split(".")[0]): c for e, c in soft.values()}
    arm = identified_arm(
        rig, corrections(model), model.about.get("tool"), says, model.parameters, compliance, model.covariance
    )
    arm = replace(arm, dh_table=model.dh_table, torques=model.torques)
    if form.offsets and with_links:
        says = (*says, NO_OFFSETS if all(refused(zero) for zero in arm.zeros) else TOGETHER)
        arm = replace(arm, not_carried=says)
    write_output(path, cleaned(form.text(arm)), export_output(form))
    return says


def export_output(form: ExportForm) -> OutputKind:
    """The kind of file that a form makes."""
    return text_output(form.mark, f"{form.name} export") if form.mark else OutputKind(form.name, lambda _: False)


def refuse_other_make(rig: Rig, form: ExportForm) -> None:
    """DataError for a form of a controller that this arm has not; a UR driver gives the make, too."""
    wanted, robot = form.make, rig.devices.robot
    made = rig.arm.make
    if made is None and robot is not None and robot.driver is RobotDriver.UR_RTDE:
        made = Make.UR
    if wanted is None or made is wanted:
        return
    state = "not stated" if made is None else f"'{made.value}'"
    raise DataError(
        f"rig {rig.name}: {form.name} is for arms of make '{wanted.value}', and the make of this one is {state}; take "
        f'another form, or state make = "{wanted.value}" under [arm] if it is one'
    )


def _refuse_coupled(rig: Rig, form: ExportForm) -> None:
    """DataError for an arm with a joint that follows another one, where the form cannot carry that."""
    followers = [i for i, joint in enumerate(rig.arm.joints, start=1) if joint.follows is not None]
    if followers and form.uncoupled:
        raise DataError(f"rig {rig.name}: joint {followers[0]} follows another joint, and {form.uncoupled}")


def _linear_compliance(rig: Rig, model: ModelFile) -> dict[str, tuple[EffectRecord, float]]:
    """Name -> effect and rad / (N m): joints that yield in proportion to the torque of the stated masses."""
    if not all(joint.mass_kg for joint in rig.arm.joints):
        return {}
    out: dict[str, tuple[EffectRecord, float]] = {}
    for effect in model.effects:
        compliance = effect.parameters.get(COMPLIANCE)
        plain = effect.physics == "joint-compliance" and effect.shape == "linear" and not effect.variant
        if plain and effect.holds == "always" and len(effect.coefficients) == 1 and compliance is not None:
            value = compliance.value
            if value is not None and value > 0.0:
                out[effect.name] = (effect, value)
    return out


def _not_carried(model: ModelFile, carried: tuple[str, ...]) -> tuple[str, ...]:
    from calibrate.apply.export.not_carried import not_carried  # a third of a second of imports that few runs need

    return not_carried(model, carried).sentences


def _not_in_offsets(model: ModelFile, *, with_links: bool) -> tuple[str, ...]:
    """What the nominal arm with the zeros of the model is off: from a whole model, or from the measured points."""
    from calibrate.apply.export.not_carried import geometry_lost, left_by_zeros

    return (geometry_lost(model),) if model.effects or with_links else left_by_zeros(model)
