"""What a recording shows of the arm that the controller computes with: one sentence, and that arm as a rig file."""

from pathlib import Path

import msgspec
import numpy as np
from scipy.spatial.transform import Rotation

from acquisition.recording import Finding, Recording
from acquisition.recording.check_recording import Problem, Severity
from acquisition.recording.examination import Examination, ExaminationRecord
from acquisition.recording.output import toml_output, write_output
from acquisition.recording.rig import ArmModel, Rig
from acquisition.recording.samples import CONTROLLER
from calibeam.new_rig.drawn import rig_file_text
from calibrate.diagnose.record.schema import DiagnosisFile
from calibrate.errors import DataError
from calibrate.fit.controller_arm import FEWEST, ROUNDING, ControllerArm, ControllerPoses, controller_arm
from calibrate.model.arms.convert import convert, pose_of
from calibrate.model.rigid import transform
from calibrate.quantities import angle, angle_with_sigma, counted, length, length_with_sigma

RIG_FILE = toml_output(("schema", "arm"), "rig file")
CONTROLLER_ARM = Examination(
    "arm of the controller",
    CONTROLLER,
    f"record the robot with its tool poses (controller_x_m … controller_rz_rad) in {FEWEST} or more different poses",
)
UNRELATED_M = 1e-3  # no arm leaves as much; angles and poses of other times do
REMEDY = "record poses that turn the tool about two axes that are not parallel"
MOST = 8  # differences in one sentence


def arm_of_controller(recording: Recording) -> ControllerArm | None:
    """None where the recording holds no poses of the controller, or too few."""
    return arm_of_poses(recording.rig, ControllerPoses.of(recording))


def arm_of_poses(rig: Rig, poses: ControllerPoses | None) -> ControllerArm | None:
    return None if poses is None or len(poses.q_rad) < FEWEST else controller_arm(rig, poses)


def controller_findings(found: ControllerArm | None) -> tuple[Finding, ...]:
    """One where arm, base or tool of the controller are not those of the rig file."""
    if found is not None and found.left_m > UNRELATED_M:
        return (Finding(Problem.CONTROLLER_ARM, found.source, _unrelated(found), Severity.INFORMATION),)
    if found is None or not (found.parts or found.other_tool):
        return ()
    severity = Severity.WARNING if found.parts else Severity.INFORMATION
    return (Finding(Problem.CONTROLLER_ARM, found.source, sentence(found), severity),)


def _unrelated(found: ControllerArm) -> str:
    return (
        f"the controller's poses do not belong to the joint angles beside them: {length(found.left_m, 2)} (rms) are "
        "left with any arm; record both at the same time, in the units stated"
    )


def controller_examination(recording: Recording, found: ControllerArm | None) -> ExaminationRecord:
    """How the comparison of the controller's arm with that of the rig file ended."""
    findings = controller_findings(found)
    if findings:
        return CONTROLLER_ARM.found("; ".join(f.says for f in findings), findings[0].where)
    if found is not None:
        return CONTROLLER_ARM.nothing(max(found.left_m, ROUNDING), "m", found.source)
    poses = ControllerPoses.of(recording)
    if poses is not None:
        why = f"{len(poses.q_rad)} different poses of the controller's tool, fewer than {FEWEST}"
        return CONTROLLER_ARM.not_examined(why, poses.source)
    if ControllerPoses.recorded(recording):
        return CONTROLLER_ARM.not_examined("no valid pose of the controller's tool")
    return CONTROLLER_ARM.not_examined("no poses of the controller's tool were recorded", expected=False)


def with_controller(file: DiagnosisFile, recording: Recording) -> DiagnosisFile:
    """With how the examination of the controller's arm ended."""
    ending = controller_examination(recording, arm_of_controller(recording))
    return msgspec.structs.replace(file, examinations=(*file.examinations, ending))


def controller_notes(recording: Recording) -> tuple[str, ...]:
    """The same for results of a fit: only where the arm or its base differs, which `correct` has to know."""
    return tuple(f.says for f in controller_findings(arm_of_controller(recording)) if f.severity is Severity.WARNING)


def sentence(found: ControllerArm) -> str:
    """What differs, with one sigma."""
    tool = _tool(found)
    m, rad = (max(value, ROUNDING) for value in (found.left_m, found.left_rad))
    left = f"{found.poses} poses agree with it to {length(m, 2)} and {angle(rad, 2)} (rms)"
    if found.left_out:
        left += f"; {found.left_out} outlying poses not used"
    if not found.parts:
        return f"the controller computes with the arm of the rig file, but with another tool: {tool}; {left}"
    largest = sorted(found.differences, key=lambda d: -abs(d.value) / max(d.sigma, 1e-12))[:MOST]
    named = [
        f"{d.name} {(length_with_sigma if d.unit == 'm' else angle_with_sigma)(d.value, d.sigma)}" for d in largest
    ]
    more = len(found.differences) - len(named)
    rest = f" and {more} more" if more else ""
    unknown = f"; not determined: {counted(len(found.undetermined), 'number')}" if found.undetermined else ""
    tools = f"; {tool}" if found.other_tool else ""
    if not named:
        return (
            "the controller computes with another arm or base than the rig file, of which these poses determine no "
            f"number; record poses in which every joint turns{tools}; {left}"
        )
    return (
        f"the controller computes with another arm than the rig file: {', '.join(named)}{rest} (controller less rig "
        f"file){unknown}{tools}; {left}; `calibeam check --controller-arm` writes it as a rig file"
    )


def _tool(found: ControllerArm) -> str:
    """Where its tool is, each number with its sigma, and none that these poses do not determine."""
    point, turn = found.T_flange_tool[:3, 3], Rotation.from_matrix(found.T_flange_tool[:3, :3]).as_euler("xyz")
    sigma, open_ = found.tool_sigma, "not determined"
    if sigma is None:
        at = ", ".join(f"{1e3 * v:z.3f}" for v in point.tolist())
        turned = ", ".join(f"{v:z.2f}" for v in np.degrees(turn).tolist())
        return f"its tool is stated by it at {at} mm in the flange, turned by {turned}° about x, y, z"
    along, about = (sigma[:3].tolist(), sigma[3:].tolist())
    at = ", ".join(length_with_sigma(v, s) if np.isfinite(s) else open_ for v, s in zip(point, along, strict=True))
    turned = ", ".join(angle_with_sigma(v, s) if np.isfinite(s) else open_ for v, s in zip(turn, about, strict=True))
    if not np.any(np.isfinite(along)):
        return f"the place of its tool is not determined ({REMEDY})"
    says = f"its tool is at {at} in the flange (x, y, z), turned by {turned} about x, y, z"
    return says if np.all(np.isfinite(sigma)) else f"{says} ({REMEDY})"


def write_controller_arm(rig: Rig, found: ControllerArm | None, source: Path, path: Path) -> None:
    """The rig file. DataError where `source` does not show that arm, OSError where it cannot be written."""
    if found is None:
        raise DataError(
            f"{source}: it does not show the controller's arm; record the robot with its tool poses, or give "
            f"the columns {', '.join(CONTROLLER)} in {FEWEST} or more different poses"
        )
    if found.left_m > UNRELATED_M:
        raise DataError(f"{source}: {_unrelated(found)}")
    write_output(path, controller_rig_text(rig, found), RIG_FILE)


def controller_rig_text(rig: Rig, found: ControllerArm) -> str:
    """A rig file with the controller's arm as `local-poe`, its base included, and the point of its tool.

    DataError for an arm whose reported angles are coupled.
    """
    if any(joint.follows is not None for joint in rig.arm.joints):
        raise DataError(f"rig {rig.name}: its angles are coupled (`follows`), the controller's arm is not written")
    arm = convert(rig.arm, ArmModel.LOCAL_POE, found.theta).arm
    first = arm.joints[0]
    base = found.T_base @ transform(first.origin_m or np.zeros(3), first.rotation_rad or np.zeros(3))
    pose = pose_of(base)
    joints = (msgspec.structs.replace(first, origin_m=pose.origin_m, rotation_rad=pose.rotation_rad), *arm.joints[1:])
    notes = (
        f"The arm that the controller of {rig.name} computes with, from {found.poses} poses of {found.source}",
        *(f"{d.name}: {d.value!r} {d.unit} more than in the rig file, sigma {d.sigma:.2g}" for d in found.differences),
        *(f"not determined: {why}" for why in found.undetermined),
    )
    point = [float(v) for v in found.T_flange_tool[:3, 3]]
    return rig_file_text(f"{rig.name}-controller", "local-poe", joints, arm.flange, notes, point)
