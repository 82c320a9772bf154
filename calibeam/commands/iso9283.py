"""`calibeam iso9283`: a pose test to ISO 9283 as a plan, and what a recording of it shows."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import msgspec
import numpy as np
from cyclopts import App, Parameter, validators
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from acquisition.recording import Samples, read
from acquisition.recording.files import write_json
from acquisition.recording.output import csv_text, json_output, table_output, write_output
from acquisition.recording.pose_plan import (
    POSE_PLAN,
    PlannedBlock,
    PlannedPose,
    PosePlan,
    read_pose_plan,
    write_pose_plan,
)
from acquisition.recording.rig import Rig, load_rig, parse_rig
from acquisition.recording.session_folder import read_csv
from calibeam.console import Console
from calibeam.motion.cube_in_reach import CubeInReach, cube_in_reach, ways_to
from calibeam.motion.motion_inverse import MotionInverse
from calibeam.outcome import taken_back
from calibeam.overwriting import writes
from calibeam.printing.pose_test import print_pose_test
from calibeam.software import SOFTWARE
from calibrate.apply.correct import Options, Wanted, correct
from calibrate.errors import DataError
from calibrate.iso9283 import CYCLE, CYCLES, FROM_THREE_SIDES, EvaluatedTest, Plane, PoseTest, evaluate
from calibrate.model.arms.rig_arm import RigArm
from calibrate.model.model_file import ModelFile, read_model

Floats = NDArray[np.float64]
Count = Annotated[int, Parameter(validator=validators.Number(gte=2, lte=1000))]
Length = Annotated[float, Parameter(validator=validators.Number(gt=0.0))]
POSE_COLUMNS = ("x_m", "y_m", "z_m", "rx_rad", "ry_rad", "rz_rad")

STANDARD = "ISO 9283:1998, Manipulating industrial robots - Performance criteria and related test methods"
FORMULAS = {
    "AP": "7.2.1: distance of the barycentre of the attained positions from the commanded one",
    "RP": "7.2.2: mean of l + 3 S of l, l the distances from the barycentre, S with n - 1",
    "AP_a, AP_b, AP_c": "7.2.1: mean deviation about x, y, z of the base, as a rotation vector",
    "RP_a, RP_b, RP_c": "7.2.2: 3 S of these deviations",
    "vAP": "7.2.3: largest distance of the barycentres of two approaches",
    "AD": "7.3.2: mean attained distance less the commanded one",
    "RD": "7.3.3: 3 S of the attained distances",
    "dAP, dRP": "7.6: difference of AP, of RP, from those of the first set of cycles",
}

iso9283 = App(
    name="iso9283",
    help="Plan a pose test to ISO 9283, or evaluate a recording of one.\n\n"
    "Pose accuracy and repeatability, their variation by approach, distances, drift; before and after correction.\n\n"
    "For example:\n\n```\ncalibeam iso9283 plan rig.toml --out iso9283.toml\n"
    "calibeam iso9283 evaluate session --model model.json\n```",
)


class PoseTestFile(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Content of iso9283.json: m, rad, s; NaN is null."""

    schema: Literal[1]
    kind: Literal["calibeam-iso9283"]
    software: str
    standard: str
    formulas: dict[str, str]
    rig: str
    recording: str
    model: str | None
    rows: int
    frame: str
    measured: PoseTest
    predicted_accuracy_m: dict[int, tuple[float, float]]  # pose -> AP by the model, one sigma
    corrected: PoseTest | None
    notes: tuple[str, ...]


@iso9283.command
@writes(out=POSE_PLAN, corrected=POSE_PLAN)
def plan(
    rig: Path,
    *,
    out: Path = Path("iso9283.toml"),
    cycles: Count = CYCLES,
    three_sides: bool = False,
    plane: Plane = "x+",
    centre_m: tuple[float, float, float] | None = None,
    edge_m: Length | None = None,
    turn_deg: tuple[float, float, float] | None = None,
    model: Path | None = None,
    corrected: Path | None = None,
) -> None:
    """Choose the test cube and write its five poses as a pose plan.

    The largest cube tried that is in reach in front of the arm, its edges along the axes of the base. P1 is its centre,
    P2 to P5 are a tenth of a diagonal from its corners. A cycle visits P5, P4, P3, P2, P1; the visit of P1 before the
    first cycle does not count. The number of a pose is its `repeat`.

    For example:

    ```
    calibeam iso9283 plan rig.toml --out iso9283.toml --three-sides
    ```

    Parameters
    ----------
    rig
        The rig file; [tool] point_m is the point that is measured.
    out
        The pose plan to write: the joints that a controller with the drawn arm commands. Beside it, as .poses.csv, the
        five poses of the point in the base, for a controller that is given poses.
    cycles
        Visits of each pose.
    three_sides
        Also P1, P2 and P4 by three approaches, for the multi-directional variation: as the joints come when the tool
        comes along x, y, z of the base.
    plane
        Diagonal plane of the cube, by the axis of the base along which it rises (+) or falls (-).
    centre_m
        Centre of the cube in the base. Default: searched.
    edge_m
        Edge of the cube. Default: the largest that was found.
    turn_deg
        Orientation of the tool in the base: turns about fixed x, y, z. Default: down, else inclined, else level.
    model
        A model.json: also write the same poses with its corrected joint commands.
    corrected
        Where to write the plan with the corrected commands; default: iso9283-corrected.toml.

    """
    loaded = load_rig(rig)
    turn = None if turn_deg is None else Rotation.from_euler("xyz", turn_deg, degrees=True).as_matrix()
    cube = cube_in_reach(loaded, plane, None if centre_m is None else np.array(centre_m), edge_m, turn)
    sides = {number: ways_to(loaded, cube.q_rad[number - 1]) for number in FROM_THREE_SIDES} if three_sides else {}
    visits = tuple(_visits(cycles, sides))
    poses_csv = out.with_suffix(".poses.csv")
    with taken_back(out, poses_csv):
        write_pose_plan(out, _plan_of(loaded, cube, visits, cube.q_rad[[v.pose - 1 for v in visits]], "nominal"))
        _write_poses(poses_csv, cube)
    centre = ", ".join(f"{1e3 * float(x):.0f}" for x in cube.centre_m)
    print(f"cube: edge {1e3 * cube.edge_m:.0f} mm, centre {centre} mm in the base, plane {plane}")
    print(f"plan: {out}, {len(visits)} visits; poses: {poses_csv}")
    if model is not None:
        known = _model(model, loaded)
        commands, why = _corrected(known, cube, visits)
        corrected = corrected or Path("iso9283-corrected.toml")
        with taken_back(corrected):
            write_pose_plan(corrected, _plan_of(loaded, cube, visits, commands, f"corrected by {model.name}"))
        for line in why:
            print(line)
        print(f"corrected plan: {corrected}; evaluate its recording with --plan {out}")


@iso9283.command(name="evaluate")
@writes(out=json_output("calibeam-iso9283"))
def evaluate_test(
    recording: Path,
    *,
    rig: Path | None = None,
    plan: Path | None = None,
    model: Path | None = None,
    frame: Literal["fit", "model", "rig"] | None = None,
    out: Path = Path("iso9283.json"),
    json_: Annotated[bool, Parameter(name="--json")] = False,
) -> None:
    """Evaluate a recording: pose accuracy and repeatability, distances, drift.

    Rows with the same number in column `repeat` belong to one pose; without it, rows with the same joints. For a table
    with that column and positions but without joints, repeatability is reported; with --plan all figures.

    For example:

    ```
    calibeam iso9283 evaluate session --model model.json
    ```

    Parameters
    ----------
    recording
        A recording, a session folder, or with --rig a table like samples.csv.
    rig
        The rig file of a table.
    plan
        The plan of `calibeam iso9283 plan`: its poses are what was wanted. Needed where corrected commands were sent;
        without it, what was commanded counts as wanted.
    model
        A model.json: what it predicts of this test, and the test with its correction.
    frame
        How the device stands in the base: `fit` (best fit of the poses), `model` (as in the model's session), `rig` (as
        [device] states). Default: model where there is one, else fit.
    out
        Where to write the figures as JSON.
    json_
        Print the JSON on one line, and nothing else.

    """
    samples, loaded = _samples(recording, rig)
    known = None if model is None else _model(model, loaded)
    planned = None if plan is None else read_pose_plan(plan, loaded)
    found = evaluate(samples, loaded, known, planned, frame)
    file = _file(found, loaded, recording, model)
    write_json(out, file)
    if json_:
        print(msgspec.json.encode(file).decode())
    else:
        print_pose_test(Console(), found, f"figures: {out}")


def _samples(recording: Path, rig: Path | None) -> tuple[Samples, Rig]:
    """DataError for a table without its rig."""
    if rig is not None:
        loaded = load_rig(rig)
        return read_csv(recording, loaded, joints_needed=False), loaded
    if recording.suffix == ".csv" and recording.name != "samples.csv":
        raise DataError(
            f"{recording}: a table needs its rig file: give --rig, or make a session of it: calibeam import"
        )
    source = read(recording)
    return source.samples, source.rig


def _model(path: Path, rig: Rig) -> ModelFile:
    known = read_model(path)
    if known.rig.text is None:
        raise DataError(f"{path}: the rig's text is not in the file; identify again")
    its = parse_rig(known.rig.text, f"rig.toml in {path}")
    if (its.name, its.n_joints) != (rig.name, rig.n_joints):
        raise DataError(
            f"{path}: a model of rig '{its.name}' with {its.n_joints} joints, not of '{rig.name}' with {rig.n_joints}; "
            "give the model of this arm"
        )
    return known


def _file(found: EvaluatedTest, rig: Rig, recording: Path, model: Path | None) -> PoseTestFile:
    return PoseTestFile(
        1,
        "calibeam-iso9283",
        SOFTWARE,
        STANDARD,
        FORMULAS,
        rig.name,
        recording.name,
        None if model is None else model.name,
        found.rows,
        found.frame,
        found.measured,
        dict(found.predicted_m),
        found.corrected,
        found.notes,
    )


@dataclass(frozen=True)
class _Visit:
    """A pose by number, and the way each joint comes; empty: as it falls."""

    pose: int
    ways: tuple[int, ...] = ()
    counts: bool = True


def _visits(cycles: int, sides: dict[int, tuple[tuple[int, ...], ...]]) -> Iterator[_Visit]:
    yield _Visit(1, counts=False)  # so that the first cycle comes from where all others come
    for _ in range(cycles):
        yield from (_Visit(number) for number in CYCLE)
    for number, ways in sides.items():
        for _ in range(cycles):
            yield from (_Visit(number, one) for one in ways)


def _plan_of(rig: Rig, cube: CubeInReach, visits: Sequence[_Visit], q_rad: Floats, commands: str) -> PosePlan:
    purpose = (
        f"pose test after {STANDARD}; joint commands {commands}",
        f"cube: edge {cube.edge_m:.4f} m, centre {cube.centre_m.round(4).tolist()} m in the base, plane {cube.plane}",
    )
    poses = tuple(
        PlannedPose(q_rad=tuple(map(float, q)), approach=visit.ways, repeat=visit.pose if visit.counts else None)
        for visit, q in zip(visits, q_rad, strict=True)
    )
    return PosePlan(schema=1, rig=rig.name, block=(PlannedBlock(pose=poses),), purpose=purpose)


def _corrected(known: ModelFile, cube: CubeInReach, visits: Sequence[_Visit]) -> tuple[Floats, tuple[str, ...]]:
    """(visit, joint) commands, and sentences. DataError where a pose has none."""
    rig = parse_rig(known.rig.text or "", "rig.toml in the model")
    at = np.array([visit.pose - 1 for visit in visits])
    n = rig.n_joints
    sides = np.array([visit.ways or (0,) * n for visit in visits], dtype=np.float64)
    commands, says = np.empty((len(visits), n)), list[str]()
    for directed in (False, True):
        rows = np.flatnonzero(np.any(sides != 0.0, axis=1) == directed)
        if rows.size == 0:
            continue
        come = {f"approach{j + 1}": sides[rows, j] for j in range(n)} if directed else {}
        wanted = Wanted(cube.T_base_tool[at[rows]], np.full((len(rows), n), np.nan), cube.q_rad[at[rows]], come)
        found = correct(known, wanted, MotionInverse(RigArm.of_rig(rig)), Options(), len(rows))  # --cycles bounds them
        for row, why in enumerate(found.says):
            if not np.isfinite(found.q_rad[row]).all():
                raise DataError(f"P{at[rows[row]] + 1}: {why}; give another --centre-m or --edge-m")
        commands[rows] = found.q_rad
        says += list(found.notes) + [f"P{at[rows[k]] + 1}: {why}" for k, why in enumerate(found.says) if why]
    return commands, tuple(dict.fromkeys(says))


def _write_poses(path: Path, cube: CubeInReach) -> None:
    turn = Rotation.from_matrix(cube.T_base_tool[:, :3, :3]).as_rotvec()
    header = [*POSE_COLUMNS, *(f"q{j + 1}_rad" for j in range(cube.q_rad.shape[1]))]
    table = np.concatenate([cube.T_base_tool[:, :3, 3], turn, cube.q_rad], axis=1)
    # no -0.0
    write_output(path, csv_text([header, *(table.round(12) + 0.0).tolist()]), table_output(header, "table of poses"))
