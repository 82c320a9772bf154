"""Commands that bring the real tool to wanted poses, with a model's geometry and physics; in tables and in programs.

`corrected.correct` solves, `corrected.predicted_errors` judges any commands, `tables` reads poses.csv and makes the
rows of corrected.csv, `tool_kinematics` is forward and inverse for programs that compute; calibrate/apply/programs/
changes the literals of a program. Inverse kinematics come in as an argument: motion has the one that there is.
"""

from calibrate.apply.correct.corrected import Arms, Corrected, FrameError, Options, Wanted, correct
from calibrate.apply.correct.tables import corrected_rows, measured_frame, read_points, read_poses
from calibrate.apply.correct.tool_kinematics import ToolKinematics

__all__ = [
    "Arms",
    "Corrected",
    "FrameError",
    "Options",
    "ToolKinematics",
    "Wanted",
    "correct",
    "corrected_rows",
    "measured_frame",
    "read_points",
    "read_poses",
]
