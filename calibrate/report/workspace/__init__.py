"""The error of the tool over the workspace: nominal, then calibrated, with its uncertainty."""

from calibrate.report.workspace.workspace_errors import session_arm, session_room, tool_numbers

__all__ = ["session_arm", "session_room", "tool_numbers"]
