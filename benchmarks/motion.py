"""A real robot in motion, KUKA KR 300: learned from one recording, proved on another that no fit has seen.

Beside the diagnosis plain least squares of links, rotors, dry and viscous friction of every joint, as in textbooks.
No mass of this robot is published; nothing of the second recording is fitted.
"""

import contextlib
import csv
import io
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from acquisition.recording import Recording, read
from acquisition.recording.examination import ExaminationRecord
from acquisition.recording.rig import Rig
from calibeam.cli import run
from calibrate.diagnose.motion import TorqueDiagnosis, expected_nm, torques_of_model
from calibrate.diagnose.motion.links_alone import torque_state
from calibrate.diagnose.motion.motion_table import Motion, motion_of
from calibrate.diagnose.motion.torques import diagnose_motion, usual_friction
from calibrate.model.effects.term import with_sigma
from calibrate.model.torque_records import TorquesOfModel

Floats = NDArray[np.float64]

COLUMNS = (
    "se1_deg..se3_deg [deg] = enc, motor1_deg..motor6_deg [deg] = q, ref1_deg..ref6_deg [deg] = cmd, "
    "torque1_motor_Nm..torque6_motor_Nm [Nm] = motor_tau"
)
# a_m, alpha in right angles, d_m, theta in right angles: KR 300 R2500 ultra, KUKA's data sheet
TABLE = (
    *((0.35, -1, 0.675, 0), (1.15, 0, 0.0, -1), (-0.041, -1, 0.0, 0)),
    *((0.0, 1, 1.0, 0), (0.0, -1, 0.0, 0), (0.0, 0, 0.24, 0)),
)
RIGHT_RAD = 1.5707963267948966
RATIOS = 1  # row of parameters.csv
HEAD = "| joint | torque of B | model of A | least squares on A | friction of A | friction of B | of the authors |"
SEED = 1


def rig_of(folder: Path, out: Path) -> Path:
    """The rig file of the recorded robot, written into a folder."""
    with (folder / "parameters.csv").open(encoding="utf-8") as file:
        ratios = list(map(float, list(csv.reader(file))[RATIOS][1:]))
    joints = [
        f"[[arm.joint]]\na_m = {a}\nalpha_rad = {al * RIGHT_RAD}\nd_m = {d}\ntheta_offset_rad = {th * RIGHT_RAD}\n"
        f"lower_rad = -3.2\nupper_rad = 3.2\ngear_ratio = {ratio}\n"
        for (a, al, d, th), ratio in zip(TABLE, ratios, strict=True)
    ]
    rig = out / "rig.toml"
    rig.write_text('schema = 1\nname = "kr300"\n[arm]\nmodel = "dh"\n' + "\n".join(joints), encoding="utf-8")
    return rig


def recording_of(folder: Path, record: str, out: Path) -> Recording:
    """Record A or B as the command line imports it. ValueError where it does not."""
    rig, path = rig_of(folder, out), out / f"{record}.mcap"
    source = str(folder / f"recorded_{record}.csv")
    command = ["import", source, "--streams", "--rig", str(rig), "--yes", "--columns", COLUMNS, "--out", str(path)]
    with contextlib.redirect_stdout(io.StringIO()):
        refused = run(command)
    if refused:
        raise ValueError(f"{source}: not imported")
    return read(path)


def motion_in(recording: Recording) -> Motion:
    """ValueError where the recording shows no torques."""
    motion = motion_of(recording)
    if isinstance(motion, ExaminationRecord):
        raise ValueError(f"{recording.path}: {motion.reason}")
    return motion


def torque_nm(motion: Motion) -> Floats:
    """(joint,) rms."""
    return rms(motion.torque_nm)


def left_nm(rig: Rig, motion: Motion, known: TorquesOfModel) -> Floats:
    """(joint,) rms of what a model leaves of a motion that it has not seen."""
    return rms(motion.torque_nm - expected_nm(rig, motion, known))


@dataclass(frozen=True, eq=False)
class PlainFit:
    """Least squares of links, rotors and the usual friction, in one step."""

    left_nm: Floats  # (joint,) rms of what it leaves of a motion that it has not seen
    friction: dict[tuple[str, str], float]  # by physics and joint<i>.torque


def left_by_least_squares_nm(rig: Rig, seen: Motion, unseen: Motion) -> Floats:
    """(joint,) rms of what least squares leaves of a motion that it has not seen."""
    return by_least_squares(rig, seen, unseen).left_nm


def by_least_squares(rig: Rig, seen: Motion, unseen: Motion) -> PlainFit:
    """Every joint by the spread of its torque, without weights."""
    bare, new = torque_state(rig, seen), torque_state(rig, unseen).whole
    full = bare.refitted(usual_friction(bare))
    problem = full.problem
    scale = 1.0 / _rms_of_joint(problem.joint, problem.observed_nm)[problem.joint]
    terms = [problem.felt(a.term.basis(problem.drivers, a.inner)) for a in full.accepted]
    columns = np.concatenate([problem.columns @ problem.links.ways, *terms], axis=1) * scale[:, None]
    size = np.maximum(np.linalg.norm(columns, axis=0), 1e-12)
    theta = np.linalg.lstsq(columns / size, problem.observed_nm * scale, rcond=1e-9)[0] / size
    other = replace(new, terms=problem.terms, sizes=problem.sizes)
    friction = {(a.term.physics, a.term.port.where): float(a.coefficients[0]) for a in problem.split(theta)[1]}
    return PlainFit(_rms_of_joint(other.joint, other.misfit_nm(theta)), friction)


def rms(values: Floats) -> Floats:
    """(joint,) of (moment, joint), where there are any."""
    return np.asarray(np.sqrt(np.nanmean(values**2, axis=0)))


def lines(folder: Path) -> Iterator[str]:
    """A line a joint; one line that says so where the recording is not there."""
    if not folder.is_dir():
        yield f"skipped: no folder {folder.name}; the real recordings are not part of the project"
        return
    with tempfile.TemporaryDirectory() as work:
        a, b = (recording_of(folder, record, Path(work)) for record in "AB")
    rig, seen, unseen = a.rig, motion_in(a), motion_in(b)
    of_a, of_b = (diagnose_motion(rig, one, np.random.default_rng(SEED)) for one in (seen, unseen))
    torque, left = torque_nm(unseen), left_nm(rig, unseen, torques_of_model(of_a, "A"))
    plain = left_by_least_squares_nm(rig, seen, unseen)
    authors = _authors(folder)
    yield of_a.motion.made
    yield HEAD
    yield "|" + "---|" * (HEAD.count("|") - 1)
    for j in range(len(torque)):
        shares = " | ".join(f"{100 * one[j] / torque[j]:.1f} %" for one in (left, plain))
        friction = " | ".join(friction_of(one, j + 1) for one in (of_a, of_b))
        yield f"| {j + 1} | {torque[j]:.0f} Nm | {shares} | {friction} | {authors[j]} |"


def friction_of(found: TorqueDiagnosis, joint: int) -> str:
    """Dry and viscous friction that was found at a joint (from 1), with one sigma."""
    mine = [f for f in found.diagnosis.findings if f.name.where == f"joint{joint}.torque"]
    each = (next(iter(f.parameters.items())) for f in mine if "friction" in f.name.physics)
    units = {"friction_nm": "Nm", "friction_nms_per_rad": "Nms"}
    return ", ".join(f"{with_sigma(size.value, size.sigma)} {units.get(name, name)}" for name, size in sorted(each))


def _authors(folder: Path) -> list[str]:
    with (folder / "parameters.csv").open(encoding="utf-8") as file:
        rows = {row[0]: row[1:] for row in csv.reader(file)}
    each = zip(rows["f_coul"], rows["f_a"], rows["f_vis"], strict=True)
    return [f"{float(coul) + float(a):.0f} Nm, {float(vis):.0f} Nms" for coul, a, vis in each]


def _rms_of_joint(joint: NDArray[np.intp], values: Floats) -> Floats:
    return np.asarray(np.sqrt(np.bincount(joint, values**2) / np.bincount(joint)))
