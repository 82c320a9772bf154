"""Cases of a finished proof of motions, fitted by other methods to the moments that calibeam's own fit has seen.

All learn from the first 70 % of the same moments and are judged on the rest: calibeam from the rig file, the same
program from mujoco.sysid (rival_sysid.py) with exactly the parameters of what is hidden, and with all it has, and
plain least squares of base parameters with dry and viscous friction of every joint.

Noise is that which was added, as the low pass of the moments lets it through. mujoco.sysid neither learns from nor is
judged by moments about a turn, where friction is not of full size behind that low pass.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass, replace
from pathlib import Path

import msgspec
import numpy as np
from numpy.typing import NDArray

from acquisition.recording import read
from acquisition.recording.examination import ExaminationRecord
from acquisition.recording.rig import Rig
from benchmarks.motion import SEED, by_least_squares, rms
from benchmarks.proof_comparison import read_proof
from benchmarks.rival_sysid import every_key, fitted, inverse_nm, keys_of, sysid
from calibeam.prove.record import UNKNOWN, TrueDefect, Truth, truth_of
from calibeam.prove.scoring import PASSED
from calibeam.prove.seal import Layout
from calibeam.worker_processes import in_workers
from calibrate.diagnose.motion import reconcile_motion
from calibrate.diagnose.motion.links_alone import motion_drivers
from calibrate.diagnose.motion.motion_table import Motion, motion_of
from calibrate.diagnose.motion.unseen_motion import motion_in_two

Floats = NDArray[np.float64]

METHODS = ("calibeam", "mujoco.sysid, the right parameters", "mujoco.sysid, all parameters", "least squares")
JOBS = 2  # processes
CLOSE = 0.1  # of the true size
RINGS = 0.005  # of the friction
HEAD = "| method | unseen torque over noise, median and p90 | in its model | error of the size, median | within 10 % |"


@dataclass(frozen=True)
class Answer:
    """Of one method to one case."""

    over_noise: float  # rms over the joints
    errors: tuple[float | None, ...]  # of each hidden mechanism with a size, share of it; None: not in its model


def lines(folder: Path) -> Iterator[str]:
    """A row a method; one line where there is no finished proof."""
    if not Layout(folder).proof.is_file():
        yield f"skipped: no proof.json in {folder}; make one with `calibeam prove --kind motion --out {folder}`"
        return
    sysid()
    cases = [case for case in read_proof(folder).cases if case.kind == "motion" and not case.error]
    with closing(in_workers(answers_of, [(folder, case.name) for case in cases], JOBS)) as coming:
        answers = list(coming)
    yield f"{len(answers)} cases"
    yield from table(answers)


def table(answers: Sequence[Mapping[str, Answer]]) -> Iterator[str]:
    """Markdown, of all cases."""
    yield HEAD
    yield "|" + "---|" * (HEAD.count("|") - 1)
    for method in METHODS:
        mine = [case[method] for case in answers]
        middle, high = np.percentile([one.over_noise for one in mine], [50, 90])
        errors = [error for one in mine for error in one.errors]
        known = [error for error in errors if error is not None]
        error = f"{100.0 * np.median(known):.0f} %" if known else "-"
        within = f"{sum(error <= CLOSE for error in known)} of {len(errors)}"
        yield f"| {method} | {middle:.2f}, {high:.1f} | {len(known)} of {len(errors)} | {error} | {within} |"


def answers_of(order: tuple[Path, str]) -> dict[str, Answer]:
    """By method, of a case in the folder of its proof. ValueError where its recording shows no torques in motion."""
    layout, name = Layout(order[0]), order[1]
    recording, truth = read(layout.recording(name)), truth_of(layout.revealed(name).read_bytes())
    found, motion = reconcile_motion(recording, None, np.random.default_rng(SEED)), motion_of(recording)
    if isinstance(found, ExaminationRecord) or isinstance(motion, ExaminationRecord):
        raise ValueError(f"{recording.path}: no torques in motion; make the proof again")
    rig, (seen, unseen) = recording.rig, motion_in_two(motion)
    sigma_nm = PASSED * np.array(truth.torque_sigma_nm)
    left = np.full(rig.n_joints, np.nan)
    left[[one.joint - 1 for one in found.joints]] = [one.after_nm for one in found.joints]
    named = {(f.name.physics, f.name.where): f.parameters for f in found.found.diagnosis.findings}

    def by_calibeam(defect: TrueDefect) -> dict[str, float]:
        sizes = named.get((defect.physics, defect.port), {})
        return {key: size.value for key, size in sizes.items()}

    plain = by_least_squares(without_masses(rig), seen, unseen)

    def by_plain(defect: TrueDefect) -> dict[str, float] | None:
        size = plain.friction.get((defect.physics, defect.port))
        return None if size is None else dict.fromkeys(defect.figures, size)

    right = [key for defect in truth.defects for key in keys_of(defect, rig.n_joints)]
    lists = zip(METHODS[1:3], (right, every_key(rig.n_joints)), strict=True)
    return {
        METHODS[0]: _answer(truth, left / sigma_nm, by_calibeam),
        **{method: _by_sysid(rig, seen, unseen, truth, keys) for method, keys in lists},
        METHODS[3]: _answer(truth, plain.left_nm / sigma_nm, by_plain),
    }


def _by_sysid(rig: Rig, seen: Motion, unseen: Motion, truth: Truth, keys: Sequence[str]) -> Answer:
    sigma_nm, (seen, unseen) = PASSED * np.array(truth.torque_sigma_nm), (full_friction(rig, m) for m in (seen, unseen))
    fit = fitted(rig, seen, sigma_nm, keys)
    left_nm = rms(unseen.torque_nm - inverse_nm(fit.model, unseen))
    return _answer(truth, left_nm / sigma_nm, lambda defect: fit.figures(defect, rig.n_joints))


def full_friction(rig: Rig, motion: Motion) -> Motion:
    """Without the torques about turns: friction of MuJoCo does not pass the low pass that those have passed."""
    ringing = np.abs(np.abs(motion_drivers(rig, motion).senses) - 1.0) > RINGS
    return replace(motion, torque_nm=np.where(ringing, np.nan, motion.torque_nm))


def _answer(truth: Truth, ratios: Floats, found: Callable[[TrueDefect], dict[str, float] | None]) -> Answer:
    errors = (size_error(one, found(one)) for one in truth.defects if one.physics != UNKNOWN)
    return Answer(float(np.sqrt(np.nanmean(np.square(ratios)))), tuple(errors))


def size_error(defect: TrueDefect, found: Mapping[str, float] | None) -> float | None:
    """Of the size as a share of the true one, a lean as a vector; what is not found counts as zero. None: not in the
    model.
    """
    if found is None:
        return None
    first, *more = defect.figures
    names = [first, *more] if defect.physics == "gravity-direction" else [first]
    true = np.array([defect.figures[name] for name in names])
    return float(np.linalg.norm([found.get(name, 0.0) for name in names] - true) / np.linalg.norm(true))


def without_masses(rig: Rig) -> Rig:
    """All links and rotors free, as base parameters are."""
    bare = {"mass_kg": None, "com_m": None, "inertia_kg_m2": None, "rotor_inertia_kg_m2": None}
    joints = tuple(msgspec.structs.replace(joint, **bare) for joint in rig.arm.joints)
    tool = msgspec.structs.replace(rig.tool, mass_kg=None, com_m=None)
    return msgspec.structs.replace(rig, arm=msgspec.structs.replace(rig.arm, joints=joints), tool=tool)
