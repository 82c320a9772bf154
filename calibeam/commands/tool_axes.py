"""`calibeam tool-axes`: where the target sits on the flange, from turning one joint at a time."""

from importlib.metadata import version
from pathlib import Path

import msgspec
import numpy as np
from rich.console import Console

from acquisition.recording.columns import POSITION
from acquisition.recording.read import read
from acquisition.recording.recording import Recording
from acquisition.recording.rig import rig_sha256
from calibeam.outcome import PartialResult
from calibeam.tool_table import print_tool
from calibrate.arms.catalogue import arm_of
from calibrate.errors import DataError
from calibrate.model_file import RigIdentity
from calibrate.tool_axes.tool import calibrate_tool
from calibrate.tool_axes.tool_file import ToolFile, tool_record, write_tool


def tool_axes_command(recording: Path, *, out: Path = Path("tool.json"), json: bool = False) -> None:
    """Find the target in the flange: circles of single-axis rotations, axis lines, flange, then tool by distances.

    The rows in which one joint alone turns are found from the joint readings. Needed are rotations of the last joint
    and of the one before it, at least 20 degrees and 5 rows each, with all joints before them left where they were.
    Rotations of other joints add to it.

    Example: calibeam tool-axes session/ --out tool.json

    Parameters
    ----------
    recording
        A recording, or a session folder, with target positions x_m, y_m, z_m.
    out
        Where to write the tool.
    json
        Print what is in the file instead of tables.

    """
    found = tool_of(read(recording))
    write_tool(out, found)
    if json:
        print(msgspec.json.encode(found).decode())
    else:
        console = Console()
        print_tool(console, found)
        console.print(f"tool: {out}", markup=False)
    if found.tool_m is None:
        raise PartialResult(f"these rotations do not tell the tool: {found.undetermined}; {out} holds the axes")


def tool_of(recording: Recording) -> ToolFile:
    """The record of tool.json. DataError without positions, or without the rotations that are needed."""
    samples, rig = recording.samples, recording.rig
    if not all(name in samples for name in POSITION):
        raise DataError(
            f"{recording.path.name}: no columns {', '.join(POSITION)}; a tool is found from positions of its target"
        )
    position_m = np.stack([samples.column(name) for name in POSITION], axis=1)
    rows = np.flatnonzero(np.all(np.isfinite(position_m), axis=1))
    q_rad = samples.joints()[rows]
    found = calibrate_tool(arm_of(rig), q_rad, position_m[rows], rows)
    identity = RigIdentity(rig.name, rig_sha256(recording.rig_text), recording.rig_text)
    return tool_record(found, q_rad, rows, identity, f"calibeam {version('calibeam')}")
