"""The tool by turning one joint at a time: circles that a target describes, axes, and the tool in the flange with its
uncertainty. Source: patent US 10,065,319 and the circle-point method named in the modules.
"""

from calibrate.tool_axes.arm_prior import DEFAULT, ArmErrors, assumed_prior, prior_of_model
from calibrate.tool_axes.tool import calibrate_tool
from calibrate.tool_axes.tool_file import ArmErrorsRecord, AxisRecord, TargetRecord, ToolFile, tool_record
from calibrate.tool_axes.wrist_fit import TargetRows

__all__ = [
    "DEFAULT",
    "ArmErrors",
    "ArmErrorsRecord",
    "AxisRecord",
    "TargetRecord",
    "TargetRows",
    "ToolFile",
    "assumed_prior",
    "calibrate_tool",
    "prior_of_model",
    "tool_record",
]
