"""`calibeam tool-axes`: where the target sits on the flange, from turning one joint at a time."""

from pathlib import Path

import msgspec
import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from acquisition.recording import Recording, read
from acquisition.recording.files import si_value, write_json
from acquisition.recording.output import json_output
from acquisition.recording.rig import Rig, rig_sha256
from acquisition.recording.samples import ORIENTATION, POSITION
from calibeam.console import Console
from calibeam.outcome import PartialResult
from calibeam.overwriting import writes
from calibeam.printing.tables import print_tool_axes
from calibeam.software import SOFTWARE
from calibrate.errors import DataError
from calibrate.model.arms.catalogue import arm_of
from calibrate.model.arms.eccentric import with_discs
from calibrate.model.model_file import ModelFile, RigIdentity, read_model
from calibrate.model.predict import Predictor
from calibrate.tool_axes import (
    DEFAULT,
    ArmErrors,
    TargetRows,
    ToolFile,
    assumed_prior,
    calibrate_tool,
    prior_of_model,
    tool_record,
)

TARGET = "target"  # column: which target of the tool a row is of, a whole number; absent: there is one
MOST_TARGETS = 1000


@writes(out=json_output("calibeam-tool"))
def tool_axes_command(
    recording: Path,
    *,
    model: Path | None = None,
    zero_sigma: str | None = None,
    length_sigma: str | None = None,
    angle_sigma: str | None = None,
    out: Path = Path("tool.json"),
    json: bool = False,
) -> None:
    """Locate the target on the flange by single-axis turns.

    Circles of single-axis rotations, axis lines, flange, then the rows of the wrist.

    The rows in which one joint alone turns are found from the joint readings. Needed are rotations of the last joint
    and of the one before it, at least 20 degrees and 5 rows each, with all joints before them left where they were.
    The target is fitted to the rows with those joints there; all other rows are a check: turn a joint before the
    wrist, too. The uncertainty includes what the arm's own errors add, as far as the rotations do not show them.

    For example:

    ```
    calibeam tool-axes session/ --out tool.json
    ```

    Parameters
    ----------
    recording
        A recording, or a session folder, with target positions x_m, y_m, z_m. With rx_rad, ry_rad, rz_rad, or with
        three targets (column target), the orientation is determined, too.
    model
        The model.json of the calibrated arm: its geometry and covariance replace the assumed errors.
    zero_sigma
        Assumed error (1 sigma) of every joint zero; without it 3 mrad.
    length_sigma
        Assumed error (1 sigma) of every length of the arm; without it the rig's [tolerance], else 0.3 mm.
    angle_sigma
        Assumed error (1 sigma) of every angle of the arm's table; without it the rig's [tolerance], else 1 mrad.
    out
        Where to write the tool.
    json
        Print what is in the file instead of tables.

    """
    source = read(recording)
    errors = errors_of(source.rig, zero_sigma, length_sigma, angle_sigma)
    found = tool_of(source, errors, model)
    write_json(out, found)
    if json:
        print(msgspec.json.encode(found).decode())
    else:
        console = Console()
        print_tool_axes(console, found)
        console.print(f"tool: {out}", markup=False)
    if found.tool_m is None:
        raise PartialResult(f"these rotations do not determine the tool: {found.undetermined}; {out} holds the axes")


def errors_of(rig: Rig, zero: str | None, length: str | None, angle: str | None) -> ArmErrors:
    """What is assumed of the arm: options, then the rig's [tolerance], then the default. DataError for no size."""
    stated, default = rig.tolerance, ArmErrors()
    given = {
        "zero_sigma_rad": _quantity("zero_sigma_rad", "--zero-sigma", zero),
        "length_sigma_m": _quantity("length_sigma_m", "--length-sigma", length),
        "angle_sigma_rad": _quantity("angle_sigma_rad", "--angle-sigma", angle),
    }
    options = {name: value for name, value in given.items() if value is not None}
    drawn = {} if stated is None else {"length_sigma_m": stated.length_m, "angle_sigma_rad": stated.angle_rad}
    usual = {name: float(getattr(default, name)) for name in given}
    sources = (
        ("options", set(options)),
        ("[tolerance] of the rig file", set(drawn) - set(options)),
        (DEFAULT, set(usual) - set(drawn) - set(options)),
    )
    return ArmErrors(**{**usual, **drawn, **options}, source=", ".join(says for says, names in sources if names))


def tool_of(recording: Recording, errors: ArmErrors, model: Path | None = None) -> ToolFile:
    """The record of tool.json. DataError without positions, or without the rotations that are needed."""
    targets = targets_of(recording)
    _refuse_coupled(recording.rig)
    calibrated = None if model is None else read_model(model)
    rig = recording.rig if calibrated is None else _rig_of(calibrated, recording)
    arm = with_discs(arm_of(rig, errors.links), rig)
    prior = assumed_prior(arm, errors.zero_sigma_rad)
    if calibrated is not None:
        prior = prior_of_model(arm, calibrated, prior)
    found = calibrate_tool(arm, targets, prior)
    identity = RigIdentity(recording.rig.name, rig_sha256(recording.rig_text), recording.rig_text)
    return tool_record(found, errors, None if model is None else model.name, identity, SOFTWARE)


def _refuse_coupled(rig: Rig) -> None:
    for number, joint in enumerate(rig.arm.joints, start=1):
        if joint.follows is not None:
            raise DataError(
                f"rig {rig.name}: joint {number} follows joint {joint.follows.joint}, which then turns two axes at "
                "once; find the target together with the arm: calibeam identify"
            )


def targets_of(recording: Recording) -> tuple[TargetRows, ...]:
    """The rows of each target, by its number. DataError without positions."""
    samples = recording.samples
    if not all(name in samples for name in POSITION):
        raise DataError(
            f"{recording.path.name}: no columns {', '.join(POSITION)}; a tool is found from positions of its target"
        )
    position_m = np.stack([samples.column(name) for name in POSITION], axis=1)
    seen = np.all(np.isfinite(position_m), axis=1)
    turned = all(name in samples for name in ORIENTATION)
    vectors = np.stack([samples.column(name) for name in ORIENTATION], axis=1) if turned else np.full((1, 3), np.nan)
    if turned and np.any(np.isfinite(vectors)):
        seen &= np.all(np.isfinite(vectors), axis=1)
    number = _numbers(recording, seen)
    q_rad = samples.joints()
    out: list[TargetRows] = []
    for k in np.unique(number[seen]).tolist():
        rows = np.flatnonzero(seen & (number == k))
        rotation = Rotation.from_rotvec(vectors[rows]).as_matrix() if np.any(np.isfinite(vectors)) else None
        out.append(TargetRows(q_rad[rows], position_m[rows], rotation, rows, int(k)))
    if not out:
        raise DataError(f"{recording.path.name}: no row has a position in {', '.join(POSITION)}")
    return tuple(out)


def _numbers(recording: Recording, seen: NDArray[np.bool_]) -> NDArray[np.int64]:
    """(row,) number of the target in the rows with a position, 0 elsewhere; 1 where there is no column."""
    samples = recording.samples
    if TARGET not in samples:
        return np.ones(len(samples), dtype=np.int64)
    values = np.where(seen, samples.column(TARGET), 0.0)
    for row in np.flatnonzero(seen).tolist():
        value = float(values[row])
        if not 0 < value < MOST_TARGETS or value != round(value):
            raise DataError(
                f"{recording.path.name}: column {TARGET}, row {row + 1}: {value:g} is no target; give a whole number "
                f"from 1 to {MOST_TARGETS - 1}"
            )
    return values.astype(np.int64)


def _rig_of(model: ModelFile, recording: Recording) -> Rig:
    rig = Predictor.of(model).rig
    if rig.n_joints != recording.rig.n_joints:
        raise DataError(
            f"model of rig {rig.name} has {rig.n_joints} joints, the recording of {recording.rig.name} has "
            f"{recording.rig.n_joints}; give the model of this arm"
        )
    return rig


def _quantity(key: str, option: str, text: str | None) -> float | None:
    """SI number of an option such as '3 mrad'; a bare number is SI."""
    if text is None:
        return None
    try:
        return float(text)
    except ValueError:
        pass
    try:
        return si_value(key, text)
    except ValueError as error:
        raise DataError(f"{option}: {error}") from None
