"""tool.json: a tool found by turning one axis at a time, with its doubt, version 1. docs/formats.md explains every key.

Angles are rad, lengths m.
"""

from pathlib import Path
from typing import Literal

import msgspec
import numpy as np
from numpy.typing import NDArray

from calibrate.model_file import RigIdentity
from calibrate.tool_axes.tool import ToolCalibration
from calibrate.tool_axes.wrist import AxisFound

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


class ToolFile(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Content of tool.json; the module's text explains each field."""

    schema: Literal[1]
    kind: Literal["calibeam-tool"]
    software: str
    rig: RigIdentity
    status: str
    says: str
    tool_m: Numbers | None
    tool_sigma_m: Numbers | None
    undetermined: str | None
    by_axes_m: Numbers
    distance_rms_m: float
    flange: FlangeRecord
    axes: tuple[AxisRecord, ...]


def tool_record(
    found: ToolCalibration, q_rad: Floats, file_rows: NDArray[np.intp], rig: RigIdentity, software: str
) -> ToolFile:
    """The record to write. `q_rad` (row, joint) it was found from, which stand at `file_rows` (row,), from 0."""
    flange = found.flange
    return ToolFile(
        schema=1,
        kind="calibeam-tool",
        software=software,
        rig=rig,
        status=found.status.name,
        says=found.status.value,
        tool_m=None if found.tool_m is None else _numbers(found.tool_m),
        tool_sigma_m=None if found.tool_sigma_m is None else _numbers(found.tool_sigma_m),
        undetermined=found.why,
        by_axes_m=_numbers(found.by_axes_m),
        distance_rms_m=found.distance_rms_m,
        flange=FlangeRecord(
            _numbers(flange.q_rad),
            _numbers(flange.T_device_flange[:3, 3]),
            _numbers(flange.T_device_flange[:3, 2]),
            _numbers(flange.origin_sigma_m),
            flange.z_sigma_rad,
        ),
        axes=tuple(_axis(axis, q_rad, file_rows) for axis in found.axes),
    )


def write_tool(path: Path, tool: ToolFile) -> None:
    """Write tool.json, whole or not at all. OSError where the folder cannot be written."""
    path.parent.mkdir(parents=True, exist_ok=True)
    partial = path.with_name(path.name + ".partial")
    partial.write_bytes(msgspec.json.format(msgspec.json.encode(tool), indent=1) + b"\n")
    partial.replace(path)


def _axis(axis: AxisFound, q_rad: Floats, file_rows: NDArray[np.intp]) -> AxisRecord:
    circle, segment = axis.circle, axis.segment
    told = bool(np.all(np.isfinite(circle.covariance)))
    return AxisRecord(
        segment.joint,
        (int(file_rows[segment.rows[0]]) + 1, int(file_rows[segment.rows[-1]]) + 1),
        segment.span_rad(q_rad),
        circle.status.name,
        _numbers(circle.centre_m),
        _numbers(circle.centre_sigma_m) if told else None,
        _numbers(circle.normal),
        circle.normal_sigma_rad if told else None,
        circle.radius_m,
        circle.radius_sigma_m if told else None,
        circle.scatter_m,
    )


def _numbers(values: Floats) -> Numbers:
    return tuple(float(v) for v in values)
