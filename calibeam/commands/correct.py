"""`calibeam correct`: joint commands and corrected programs that bring the real tool where it is wanted."""

import re
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from cyclopts import Parameter, validators
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from acquisition.recording.output import OutputKind, csv_text, table_output, write_output
from acquisition.recording.rig import parse_rig
from calibeam.console import Console
from calibeam.motion.motion_inverse import MotionInverse
from calibeam.outcome import PartialResult
from calibeam.overwriting import writes
from calibrate.apply.correct import (
    Corrected,
    FrameError,
    Options,
    Wanted,
    correct,
    corrected_rows,
    measured_frame,
    read_points,
    read_poses,
)
from calibrate.apply.programs import correct_program, dialect_of
from calibrate.errors import DataError
from calibrate.model.arms.rig_arm import RigArm
from calibrate.model.model_file import ModelFile, read_model
from calibrate.model.with_effects.applied import conditions_of_effects

Floats = NDArray[np.float64]

LARGEST_BYTES = 4_000_000  # a program of 20,000 targets
LONGEST = 10_000  # letters of a line; controllers end at some hundred
KRL_PAIR = (".src", ".dat")
LINE = re.compile(r"\bline (\d+)")
FRAMES_LIMIT = 1.25  # of the predicted error: from here on frames that were taught before are what limits it
LISTED = 12  # poses that are not ok, before the rest is counted
SIDES = {"positive": 1, "negative": -1}
UM = 1e6
CORRECTED = table_output(("status", "says"), "table of corrected poses")
CORRECTED_PROGRAM = OutputKind("file that can be made again", lambda _: False)  # a program has no mark of ours


@writes("out")
def correct_command(
    model: Path,
    poses: Path,
    *,
    out: Path,
    approach: Literal["positive", "negative"] | None = None,
    overshoot_deg: Annotated[float, Parameter(validator=validators.Number(gt=0.0, lte=20.0))] = 2.0,
    margin_deg: Annotated[float, Parameter(validator=validators.Number(gte=0.0))] = 1.0,
    tool: tuple[float, float, float, float, float, float] | None = None,
    frame: Annotated[tuple[str, ...], Parameter(show_default=False, consume_multiple=True)] = (),
    points: Path | None = None,
    joint_targets: bool = False,
    start: Annotated[tuple[float, ...], Parameter(show_default=False)] = (),
    condition: Annotated[tuple[str, ...], Parameter(show_default=False)] = (),
    verbose: bool = False,
) -> None:
    """Correct poses or a program, so that the real tool reaches them.

    A table of poses becomes a table of joint commands and corrected poses; in a program of URScript, KRL, RAPID or
    FANUC LS only the numbers of targets change. The predicted tool error of every pose is reported, before and after,
    with its sigma. Poses that are unreachable, near a limit or beyond the calibrated range are listed.

    For example:

    ```
    calibeam correct model.json poses.csv --out corrected.csv --approach positive --condition payload_kg=2.5
    calibeam correct model.json weld.src --out weld-corrected.src --frame 0.8 0.1 0.2 0 0 0
    ```

    Parameters
    ----------
    model
        The model.json of a diagnosis or an identification; its rig file is what the controller computes with.
    poses
        poses.csv, or a program (.script, .src, .dat, .mod, .prg, .ls); of KRL both files, .src and .dat, are taken
        if they are in the same folder.
    out
        The file to write; never the input itself.
    approach
        Let every joint arrive from one side: overshoot points are inserted before each pose.
    overshoot_deg
        Distance of an overshoot point from its pose, in every joint.
    margin_deg
        Poses with a joint nearer than this to its limit are listed.
    tool
        Tool centre point in the flange as the controller has it: x y z in m, rotation vector in rad; it is assumed
        exact. Default: the program's; else the rig file's point for the controller, the model's for the real tool.
    frame
        Frame of the poses in the base, where the program does not hold it: x y z in m, rotation vector in rad; or its
        name, with --points.
    points
        Table (.csv) of three or more points of the frame that the tool touched: x_m, y_m, z_m in the frame, q1_rad ...
        as read. The frame is fitted to them and must be entered into the controller.
    joint_targets
        Correct joint targets, too, as poses of the rig file's arm; without it they stay as they are.
    start
        Joint angles in degrees before the first pose; the nearest posture is taken. Default: middle of the range.
    condition
        A condition of all poses, as NAME=VALUE with a column of samples.csv: payload_kg=2.5, temp_arm_degC=24.
    verbose
        List every pose that is not ok, and the whole diff.

    """
    if out.resolve() == poses.resolve():
        raise DataError(f"{out}: this is the input; give another --out")
    options = Options(
        None if tool is None else _pose(tool),
        0 if approach is None else SIDES[approach],
        float(np.radians(overshoot_deg)),
        float(np.radians(margin_deg)),
        joint_targets,
    )
    console = Console(soft_wrap=True, highlight=False)
    job = _Job.of(model, start, condition)
    T_base_frame, measured = _frame(job, frame, points, options)
    job = replace(job, frame=T_base_frame)
    table = poses.suffix.lower() == ".csv"
    done = _table(job, poses, out, options) if table else _program(job, poses, out, options)
    found, names, frames, called, left, notes, diff = done
    if measured:
        console.print(measured, markup=False)
    if not table:
        _print_program(console, diff, found, names, verbose)
    needless = tuple(
        f"{c} is given; no effect of the model depends on it"
        for c in job.every
        if c not in conditions_of_effects(job.known)
    )
    taught = _taught(found, frames, called, None if points is None else job.frame)
    _print_found(console, job.known, found, names, left, taught, (*needless, *notes, *found.notes), verbose)
    console.print(f"corrected: {out}", markup=False)
    lost, count = int(np.sum(~np.isfinite(found.q_rad).all(axis=1))), len(names) + left
    if lost + left:
        why = f"; {lost} have no command" if lost else ""
        raise PartialResult(f"{count - lost - left} of {count} corrected; {lost + left} left, named above{why}")


@dataclass(frozen=True, eq=False)
class _Job:
    """What table and program have in common."""

    known: ModelFile
    n_joints: int
    near_rad: Floats | None
    every: dict[str, float]  # conditions of all poses
    frame: Floats | None
    solver: MotionInverse

    @classmethod
    def of(cls, model: Path, start: tuple[float, ...], condition: tuple[str, ...]) -> "_Job":
        known = read_model(model)
        if known.rig.text is None:
            raise DataError(f"{model}: the rig's text is not in the file; identify again")
        rig = parse_rig(known.rig.text, f"rig.toml in {model}")
        if start and len(start) != rig.n_joints:
            raise DataError(f"--start has {len(start)} angles, the arm {rig.n_joints} joints")
        near_rad = np.radians(start) if start else None
        return cls(known, rig.n_joints, near_rad, _conditions(condition), None, MotionInverse(RigArm.of_rig(rig)))


Done = tuple[
    Corrected, list[str], Floats, list[str], int, tuple[str, ...], tuple[str, ...]
]  # names, frames, theirs, how many left, notes, lines that changed


def _frame(job: _Job, given: tuple[str, ...], points: Path | None, options: Options) -> tuple[Floats | None, str]:
    """(4, 4) as stated, or as fitted to touched points, and a sentence about it."""
    if points is None:
        if not given:
            return None, ""
        try:
            x, y, z, rx, ry, rz = map(float, given)
        except ValueError:
            raise DataError(f"--frame {' '.join(given)}: six numbers, or a name together with --points") from None
        return _pose((x, y, z, rx, ry, rz)), ""
    if len(given) != 1:
        raise DataError(f"--points {points}: give the name of the frame that they lie in: --frame NAME")
    in_frame_m, q_rad = read_points(_text(points, "utf-8"), str(points), job.n_joints)
    every = {c: np.full(len(q_rad), v) for c, v in job.every.items()}
    found = measured_frame(job.known, in_frame_m, q_rad, every, options)
    place = [*found.T_base_frame[:3, 3], *Rotation.from_matrix(found.T_base_frame[:3, :3]).as_rotvec()]
    shift_um, turn_urad = UM * np.linalg.norm(found.sigma[:3]), UM * np.linalg.norm(found.sigma[3:])
    return found.T_base_frame, (
        f"frame {given[0]}: {' '.join(f'{v:.6f}' for v in place)} (m, rotation vector in rad) ± {shift_um:.2g} µm, "
        f"± {turn_urad:.2g} µrad; {len(q_rad)} points, {UM * found.rms_m:.2g} µm rms: enter it into the controller"
    )


def _table(job: _Job, poses: Path, out: Path, options: Options) -> Done:
    place = np.eye(4) if job.frame is None else job.frame
    wanted = _begun(read_poses(_text(poses, "utf-8"), str(poses), job.n_joints, place, job.every), job.near_rad)
    found = correct(job.known, wanted, job.solver, options)
    header, rows = corrected_rows(found, place)
    write_output(out, csv_text([header, *rows]), CORRECTED)
    given = tuple(
        f"column {c} is not used: the model does not depend on it"
        for c in wanted.conditions
        if c not in conditions_of_effects(job.known) and c not in job.every
    )
    names = [f"pose {row + 1}" for row in range(len(wanted))]
    called = "parts in the robot's own base" if job.frame is None else "the frame of --frame"
    return found, names, np.broadcast_to(place, (len(names), 4, 4)), [called] * len(names), 0, given, ()


def _program(job: _Job, poses: Path, out: Path, options: Options) -> Done:
    dialect = dialect_of(poses.suffix)
    if dialect is None:
        raise DataError(f"{poses}: neither a table (.csv) nor a program (.script, .src, .dat, .mod, .prg, .ls)")
    files, outs = _with_partner(poses, out)
    texts = [_text(path, "latin-1") for path in files]  # every byte has a letter, so that all of them are kept
    between = "\n" if len(files) > 1 and not texts[0].endswith("\n") else ""
    lines = (texts[0] + between).count("\n")

    def of_file(sentence: str) -> str:
        """Lines of the second file are counted from its own beginning."""
        return LINE.sub(
            lambda m: m[0] if int(m[1]) <= lines or len(files) == 1 else f"{files[1].name} line {int(m[1]) - lines}",
            sentence,
        )

    try:
        done = correct_program(
            job.known, between.join(texts), dialect, job.frame, job.near_rad, job.every, job.solver, options, poses.name
        )
    except DataError as error:
        raise DataError(of_file(str(error))) from error
    first = done.placed(len(texts[0])) if len(files) > 1 else len(done.text)
    for path, begin, end in zip(outs, (0, first + len(between)), (first, len(done.text)), strict=False):
        write_output(path, done.text[begin:end].encode("latin-1"), CORRECTED_PROGRAM)
    names = [of_file(name) for name in done.names]
    notes = [of_file(sentence) for sentence in (*done.skipped, *done.warnings)]
    if done.kept:
        notes.append(f"{len(done.kept)} joint targets kept as they are ({', '.join(done.kept[:3])}): --joint-targets")
    called = [of_file(name) for name in done.frame_names]
    return done.found, names, done.frames, called, len(done.skipped), tuple(notes), done.diff


def _with_partner(poses: Path, out: Path) -> tuple[list[Path], list[Path]]:
    """A KRL program and its data list, in this order, and where they go; of other programs the one file."""
    same_stem = {path.suffix.lower(): path for path in poses.parent.iterdir() if path.stem == poses.stem}
    files = [same_stem[end] for end in KRL_PAIR if end in same_stem]
    if poses.suffix.lower() not in KRL_PAIR or len(files) < len(KRL_PAIR):
        return [poses], [out]
    outs = [out.with_suffix(path.suffix) for path in files]
    if same := next((path for path in outs if path.resolve() in [one.resolve() for one in files]), None):
        raise DataError(f"{same}: this is the input; give another folder or name with --out")
    return files, outs


def _begun(wanted: Wanted, near_rad: Floats | None) -> Wanted:
    """With the posture before the first pose, where the table does not state one."""
    if near_rad is not None and not np.isfinite(wanted.near_rad[0]).all():
        wanted.near_rad[0] = near_rad
    return wanted


def _print_program(console: Console, diff: tuple[str, ...], found: Corrected, names: list[str], verbose: bool) -> None:
    for line in diff if verbose else diff[:LISTED]:
        console.print(line, markup=False)
    if not verbose and len(diff) > LISTED:
        console.print(f"... {len(diff) - LISTED} more lines of the diff (--verbose)", markup=False)
    for row, name in enumerate(names if verbose else names[:LISTED]):
        before, after = (_error(p.error_m[row], p.s_error_m[row]) for p in (found.before, found.after))
        console.print(f"{name}: predicted tool error {before}, corrected {after}", markup=False)
    if not verbose and len(names) > LISTED:
        console.print(f"... {len(names) - LISTED} more targets (--verbose)", markup=False)


def _error(error_m: float, sigma_m: float) -> str:
    """With its unit; of a target without a command there is none."""
    if not np.isfinite(error_m):
        return "not known (no command)"
    return f"{UM * error_m:.0f}" + (f" ± {UM * sigma_m:.0f} µm" if np.isfinite(sigma_m) else " µm")


def _print_found(
    console: Console,
    model: ModelFile,
    found: Corrected,
    names: list[str],
    left: int,
    of_frames: tuple[FrameError, ...],
    notes: tuple[str, ...],
    verbose: bool,
) -> None:
    commanded = int(np.sum(np.isfinite(found.q_rad).all(axis=1)))

    def say(text: str) -> None:
        console.print(text, markup=False)

    rms = (
        f"; predicted tool error, uncertainty included, rms: "
        f"{UM * found.before.rms_m:.0f} µm before, {UM * found.after.rms_m:.1f} µm after"
    )
    say(f"{commanded} of {len(names) + left} poses corrected{rms if commanded else ''}")
    for one in of_frames:
        if one.as_it_is_m > FRAMES_LIMIT * one.again_m:
            say(
                f"measure again: {one.name}: {UM * one.again_m:.1f} µm rms measured again with the corrected arm "
                f"(--frame NAME --points), about {UM * one.as_it_is_m:.0f} µm as taught before"
            )
    if (far_mm := 1e3 * np.nanmax(found.before.error_m, initial=0.0)) > 10.0:  # seldom is geometry off by more
        remedy = "check the mastering, and the tool of the poses: [tool] point_m of the rig file, or --tool"
        say(f"CHECK BEFORE YOU RUN IT: corrections of up to {far_mm:.0f} mm; {remedy}")
    if model.covariance is None:
        say("the model has no covariance: the predicted errors have no uncertainty")
    bad = [f"{name}: {status}: {why}" for name, status, why in zip(names, found.status, found.says, strict=True) if why]
    for line in bad if verbose else bad[:LISTED]:
        say(line)
    if not verbose and len(bad) > LISTED:
        say(f"... {len(bad) - LISTED} more (--verbose lists all; so does the column 'says')")
    for note in notes:
        say(note)


def _taught(found: Corrected, frames: Floats, names: list[str], measured: Floats | None) -> tuple[FrameError, ...]:
    """Of all frames (pose, 4, 4) but the one (4, 4) that has just been measured again."""
    if measured is not None:
        names = ["" if np.array_equal(T, measured) else name for T, name in zip(frames, names, strict=True)]
    return found.of_frames(frames, names)


def _text(path: Path, encoding: str) -> str:
    try:
        with path.open("rb") as file:
            data = file.read(LARGEST_BYTES + 1)
        if len(data) > LARGEST_BYTES or max(map(len, data.splitlines()), default=0) > LONGEST:
            raise DataError(f"{path}: larger than {LARGEST_BYTES / 1e6:g} MB, or a line of more than {LONGEST} letters")
        return data.decode(encoding)
    except FileNotFoundError as error:
        raise DataError(f"{path}: there is no such file") from error
    except UnicodeDecodeError as error:
        raise DataError(f"{path}: byte {error.start} is not UTF-8; save the file as UTF-8") from error


def _pose(six: tuple[float, ...]) -> Floats:
    T = np.eye(4)
    T[:3, 3], T[:3, :3] = six[:3], Rotation.from_rotvec(six[3:]).as_matrix()
    return T


def _conditions(given: tuple[str, ...]) -> dict[str, float]:
    out: dict[str, float] = {}
    for one in given:
        name, _, value = one.partition("=")
        try:
            out[name] = float(value)
        except ValueError:
            raise DataError(f"--condition {one}: NAME=VALUE with a number, as payload_kg=2.5") from None
        if not np.isfinite(out[name]):
            raise DataError(f"--condition {one}: the value must be finite")
    return out
