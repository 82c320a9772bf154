"""tool.json: a tool found by turning one axis at a time, with its uncertainty, version 2. docs/formats.md has the keys.

Angles are rad, lengths m.
"""

from typing import Literal

import msgspec
import numpy as np
from numpy.typing import NDArray

from calibrate.model.model_file import RigIdentity
from calibrate.tool_axes.arm_prior import ArmErrors
from calibrate.tool_axes.circle import AxisFound
from calibrate.tool_axes.orientation import FlangeSeen, Orientation
from calibrate.tool_axes.tool import TargetFound, ToolCalibration

Floats = NDArray[np.float64]
Numbers = tuple[float, ...]


class FlangeRecord(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The flange at the readings `q_rad`, in the device's frame."""

    q_rad: Numbers
    origin_m: Numbers
    z: Numbers
    origin_sigma_m: Numbers
    z_sigma_rad: float


class AxisRecord(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """One joint's circle."""

    target: int
    joint: int
    rows: tuple[int, int]  # first and last, from 1
    span_rad: float
    status: str
    centre_m: Numbers
    centre_sigma_m: Numbers | None
    direction: Numbers
    direction_sigma_rad: float | None
    radius_m: float
    radius_sigma_m: float | None
    scatter_m: float


class TargetRecord(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """One target in the flange."""

    target: int
    point_m: Numbers | None
    sigma_m: Numbers | None
    instrument_sigma_m: Numbers | None
    arm_sigma_m: Numbers | None
    by_axes_m: Numbers
    rows_used: tuple[int, ...]  # from 1


class OrientationRecord(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The tool's axes in the flange."""

    rotation_rad: Numbers
    sigma_rad: Numbers
    frame: str


class ArmErrorsRecord(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """What was assumed of the arm's own errors, one sigma."""

    zero_sigma_rad: float
    length_sigma_m: float
    angle_sigma_rad: float
    source: str
    model: str | None
    widened_by: float


class ToolFile(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Content of tool.json; the module's text explains each field."""

    schema: Literal[2]
    kind: Literal["calibeam-tool"]
    software: str
    rig: RigIdentity
    trust: str
    status: str
    says: str
    undetermined: str | None
    cautions: tuple[str, ...]
    tool_m: Numbers | None
    tool_sigma_m: Numbers | None
    orientation: OrientationRecord | None
    orientation_undetermined: str | None
    arm_errors: ArmErrorsRecord
    position_noise_m: float
    turn_noise_rad: float | None
    other_rows: int
    other_rows_rms_m: float | None
    targets: tuple[TargetRecord, ...]
    flange: FlangeRecord | None
    axes: tuple[AxisRecord, ...]


def tool_record(
    found: ToolCalibration, errors: ArmErrors, model: str | None, rig: RigIdentity, software: str
) -> ToolFile:
    """The record to write; `errors` were assumed of the arm, beside those of the `model` file, if there is one."""
    targets = tuple(_target(t) for t in found.targets)
    return ToolFile(
        schema=2,
        kind="calibeam-tool",
        software=software,
        rig=rig,
        trust=found.trust,
        status=found.status.name,
        says=found.status.value,
        undetermined=found.why,
        cautions=found.cautions,
        tool_m=targets[0].point_m,
        tool_sigma_m=targets[0].sigma_m,
        orientation=_orientation(found.orientation),
        orientation_undetermined=found.orientation_why,
        arm_errors=ArmErrorsRecord(
            errors.zero_sigma_rad, errors.length_sigma_m, errors.angle_sigma_rad, errors.source, model, found.widened
        ),
        position_noise_m=found.noise.position_m,
        turn_noise_rad=None if found.targets[0].rows.rotation is None else found.noise.turn_rad,
        other_rows=found.other_rows,
        other_rows_rms_m=found.other_rms_m,
        targets=targets,
        flange=_flange(found.flange),
        axes=tuple(_axis(axis, target) for target in found.targets for axis in target.axes),
    )


def _target(target: TargetFound) -> TargetRecord:
    return TargetRecord(
        target.rows.number,
        _or_none(target.point_m),
        _or_none(target.sigma_m),
        _or_none(target.instrument_sigma_m),
        _or_none(target.arm_sigma_m),
        _numbers(target.by_axes_m),
        tuple((target.rows.in_file[target.used] + 1).tolist()),
    )


def _orientation(found: Orientation | None) -> OrientationRecord | None:
    if found is None:
        return None
    return OrientationRecord(_numbers(found.rotation_rad), _numbers(found.sigma_rad), found.frame)


def _flange(seen: FlangeSeen | None) -> FlangeRecord | None:
    if seen is None:
        return None
    T = seen.T_device_flange
    return FlangeRecord(
        _numbers(seen.q_rad), _numbers(T[:3, 3]), _numbers(T[:3, 2]), _numbers(seen.origin_sigma_m), seen.z_sigma_rad
    )


def _axis(axis: AxisFound, target: TargetFound) -> AxisRecord:
    circle, segment, file_rows = axis.circle, axis.segment, target.rows.in_file
    determined = bool(np.all(np.isfinite(circle.covariance)))
    return AxisRecord(
        target.rows.number,
        segment.joint,
        (int(file_rows[segment.rows[0]]) + 1, int(file_rows[segment.rows[-1]]) + 1),
        segment.span_rad(target.rows.q_rad),
        circle.status.name,
        _numbers(circle.centre_m),
        _numbers(circle.centre_sigma_m) if determined else None,
        _numbers(circle.normal),
        circle.normal_sigma_rad if determined else None,
        circle.radius_m,
        circle.radius_sigma_m if determined else None,
        circle.scatter_m,
    )


def _or_none(values: Floats | None) -> Numbers | None:
    return None if values is None else _numbers(values)


def _numbers(values: Floats) -> Numbers:
    return tuple(float(v) for v in values)
