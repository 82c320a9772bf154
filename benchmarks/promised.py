"""`python -m benchmarks.promised [SEEDS]`: the tool error that `correct` prints, against the arm's own.

Arms of three makes with errors of links and zeros, a soft joint and an eccentric encoder disc are measured by a tracker
and diagnosed; the model corrects poses for the measured point and for a torch that nobody measured. Both are looked up
in the world, after the rigid motion that no tracker of unknown place can show: the one that brings the point which was
measured best onto where the model has it. Ratio: true rms over predicted rms.
"""

import io
import sys
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import redirect_stdout
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from acquisition.recording.rig import parse_rig
from calibeam.cli import run
from calibeam.motion.motion_inverse import MotionInverse
from calibrate.apply.correct.corrected import (
    Corrected,
    Options,
    Wanted,
    as_samples,
    correct,
)
from calibrate.apply.predicting import placed
from calibrate.model.alignment import rigid_motion
from calibrate.model.arms.rig_arm import RigArm
from calibrate.model.model_file import ModelFile, read_model
from calibrate.model.predict import Predictor
from simulators.arm.kinematics import forward
from simulators.conceal import wanted as concealed
from simulators.conceal.case import Case, conceal
from simulators.conceal.case_files import at_start, write_case
from simulators.conceal.poses import free_poses
from simulators.conceal.readings import stand

Floats = NDArray[np.float64]

MAKES = {"irb120": "ABB IRB 120", "ur5": "UR5e", "kr6": "KUKA KR 6 R900"}
HIDDEN = ("soft-joint", "encoder-eccentricity")
SAMPLES, POSES = 150, 40
MEASURED_M = 2e-5  # of three targets whose places on the tool were measured, as on a coordinate measuring machine
SET_UPS = ((1, None), (3, None), (3, MEASURED_M))  # targets, and how well they sit where the drawing has them
TORCH_M = 0.148  # from the measured point
INSIDE = 1.61  # a length within it is one of 95 % of a normal error of three equal axes: root of 7.815 / 3
SEEDS = range(1, 15)


@dataclass(frozen=True)
class Promise:
    """Rms over the poses, m; `inside` of the poses within the printed interval."""

    arm: str
    seed: int
    targets: str
    tool: str
    before_m: float
    printed_m: float
    true_m: float
    inside: float

    @property
    def ratio(self) -> float:
        return self.true_m / self.printed_m


def promises(arm: str, seed: int, targets: int, placed_m: float | None) -> Iterator[Promise]:
    """One session, corrected for the measured point and for the torch."""
    wanted = concealed.Wanted("tracker", seed, HIDDEN, enr=3.0, samples=SAMPLES, arm=arm, targets=targets)
    case = conceal(replace(wanted, placed_m=placed_m))
    name_of = f"{targets}" if placed_m is None else f"{targets}, measured"
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        write_case(case, folder)
        path = folder / "model.json"
        asked = ["diagnose", str(folder / "recording"), "--out", str(folder / "diagnosis.json")]
        with redirect_stdout(io.StringIO()):
            ended = run([*asked, "--model-out", str(path)])
        if ended not in (0, 3):
            return
        model = read_model(path)
    nominal = case.drawn.nominal.arm
    q_rad = free_poses(nominal, POSES, np.random.default_rng(5))
    T = forward(nominal, q_rad + nominal.zero_rad).flange
    point_m = np.array(case.drawn.nominal.tool_point_m)
    across = np.cross(point_m, [0.3, 0.9, 0.1])
    torch = np.eye(4)
    torch[:3, 3] = point_m + TORCH_M * across / np.linalg.norm(across)
    solver = MotionInverse(RigArm.of_rig(parse_rig(model.rig.text or "", "rig")))
    measured = np.eye(4)
    measured[:3, 3] = point_m
    for tool, stated in (("torch", torch), ("measured", None)):
        if tool == "measured" and targets > 1:
            continue  # no one of several is the tool
        at = measured if stated is None else stated
        asked = Wanted(T @ at, np.full(q_rad.shape, np.nan), q_rad, {"payload_kg": np.zeros(POSES)})
        found = correct(model, asked, solver, Options(tool=stated))
        yield _judged(case, model, found, asked, at, Promise(arm, seed, name_of, tool, 0.0, 0.0, 0.0, 0.0))


def _judged(case: Case, model: ModelFile, found: Corrected, asked: Wanted, tool: Floats, of: Promise) -> Promise:
    """Against where the true arm has the tool, at the commands before and after."""
    good = np.isfinite(found.q_rad).all(axis=1)
    goal_m = asked.T_base_tool[good, :3, 3]
    # The measured point is where it truly sits; a stated tool is exact.
    at_m = np.atleast_2d(case.drawn.true.tool_point_m)[0] if of.tool == "measured" else tool[:3, 3]
    B = _motion(case, model, found.q_rad[good])
    before, after = (
        np.linalg.norm(true_tips_m(case, q[good], at_m) @ B[:3, :3].T + B[:3, 3] - goal_m, axis=1)
        for q in (found.nominal_rad, found.q_rad)
    )
    within = after <= INSIDE * np.hypot(found.after.error_m[good], found.after.s_error_m[good])
    rms = [float(np.sqrt(np.mean(off**2))) for off in (before, after)]
    return replace(of, before_m=rms[0], printed_m=found.after.rms_m, true_m=rms[1], inside=float(np.mean(within)))


def _motion(case: Case, model: ModelFile, q_rad: Floats) -> Floats:
    """(4, 4) that brings the measured point of the concealed arm best onto that of the model."""
    known = placed(model, as_samples(q_rad, {"payload_kg": np.zeros(len(q_rad))}))
    there_m = Predictor.of(model).measured_at(known.T_base_flange)
    points_m = np.atleast_2d(case.drawn.true.tool_point_m)  # of each row, where targets are several
    first = np.argmin(np.linalg.norm(points_m - np.array(case.drawn.nominal.tool_point_m), axis=1))
    return rigid_motion(there_m, true_tips_m(case, q_rad, points_m[first]))


def true_tips_m(case: Case, q_rad: Floats, point_m: Floats) -> Floats:
    """(pose, 3) in the base, where the concealed arm has a point (3,) of its flange at commands (pose, joint)."""
    scene = at_start(case.table.scene, q_rad, np.random.default_rng(1))
    if "payload_kg" not in case.recorded:  # a load that nobody recorded belongs to the arm, and stays
        scene = replace(scene, payload_kg=np.full(len(q_rad), case.table.scene.payload_kg[0]))
    T = stand(case.drawn.true, scene, [one.defect for one in case.hidden], q_rad).T_base_tool
    return np.asarray(T[:, :3, :3] @ point_m + T[:, :3, 3], dtype=np.float64)


def lines(found: Sequence[Promise]) -> Iterator[str]:
    """One a kind of session and tool; micrometres, medians over the seeds."""
    yield (
        "| arm | targets | tool | sessions | nominal | printed | true | true / printed: median, 10 to 90 % | of all "
        "together | inside |"
    )
    yield "|---|---|---|---|---|---|---|---|---|---|"
    for key in dict.fromkeys((p.arm, p.targets, p.tool) for p in found):
        some = [p for p in found if (p.arm, p.targets, p.tool) == key]
        nominal, printed, true = (
            1e6 * np.median([getattr(p, name) for p in some]) for name in ("before_m", "printed_m", "true_m")
        )
        ratio = np.quantile([p.ratio for p in some], (0.1, 0.5, 0.9))
        inside = np.mean([p.inside for p in some])
        together = np.sqrt(np.mean([p.true_m**2 for p in some]) / np.mean([p.printed_m**2 for p in some]))
        yield (
            f"| {MAKES[key[0]]} | {key[1]} | {key[2]} | {len(some)} | {nominal:.0f} | {printed:.1f} | {true:.1f} | "
            f"{ratio[1]:.2f}, {ratio[0]:.2f} to {ratio[2]:.2f} | {together:.2f} | {100 * inside:.0f} % |"
        )


def main(seeds: Sequence[int]) -> None:
    """Prints the table."""
    found: list[Promise] = []
    for arm in MAKES:
        for seed in seeds:
            for targets, placed_m in SET_UPS:
                try:
                    found += promises(arm, seed, targets, placed_m)
                except concealed.ConcealError as reason:
                    print(f"{arm}, seed {seed}: {reason}")
    print("\n".join(lines(found)))


if __name__ == "__main__":
    main(range(1, 1 + int(sys.argv[1])) if len(sys.argv) > 1 else SEEDS)
