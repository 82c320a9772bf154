"""`python -m benchmarks.promised_test [SEEDS]`: the pose accuracy that `iso9283` prints as corrected, and the arm's.

The arms and models of `promised`. Each arm is sent to the five poses of its test cube, 30 cycles with the noise of the
tracker, and the test is evaluated with the model: AP as the model predicts it, and as corrected. Then it is sent to the
corrected commands, and AP is what it truly attains, by the same device, without its noise.
"""

import io
import sys
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import redirect_stdout
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from acquisition.recording import Samples
from acquisition.recording.pose_plan import PlannedBlock, PlannedPose, PosePlan
from acquisition.recording.rig import Rig, parse_rig
from benchmarks.promised import HIDDEN, MAKES, SAMPLES, true_tips_m
from calibeam.cli import run
from calibeam.motion.cube_in_reach import cube_in_reach
from calibeam.motion.motion_inverse import MotionInverse
from calibrate.apply.correct.corrected import Options, Wanted, correct
from calibrate.iso9283.attained import evaluate
from calibrate.iso9283.performance import PoseTest
from calibrate.model.arms.rig_arm import RigArm
from calibrate.model.model_file import read_model
from calibrate.model.rigid import inverse
from simulators.conceal import wanted as concealed
from simulators.conceal.case import Case, conceal
from simulators.conceal.case_files import write_case
from simulators.conceal.rig import Device

Floats = NDArray[np.float64]

CYCLES = 30
SEEDS = range(1, 9)


@dataclass(frozen=True)
class Tested:
    """AP of the worst pose in m: nominal as measured, as the model predicts it; corrected as printed, and in truth."""

    arm: str
    measured_m: float
    predicted_m: float
    printed_m: float
    true_m: float
    inside: float  # share of poses whose true corrected AP lies within three sigmas of what is printed beside it


def tested(arm: str, seed: int) -> Tested | None:
    """None where the diagnosis of the arm writes no model, or a pose of the cube has no command."""
    case = conceal(concealed.Wanted("tracker", seed, HIDDEN, enr=3.0, samples=SAMPLES, arm=arm))
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        write_case(case, folder)
        asked = ["diagnose", str(folder / "recording"), "--out", str(folder / "diagnosis.json")]
        with redirect_stdout(io.StringIO()):
            run([*asked, "--model-out", str(folder / "model.json")])
        if not (folder / "model.json").is_file():
            return None
        model = read_model(folder / "model.json")
    rig = parse_rig(model.rig.text or "", "rig")
    cube = cube_in_reach(rig, "x+", None, None, None)
    poses = tuple(PlannedPose(q_rad=tuple(map(float, q)), repeat=k) for k, q in enumerate(cube.q_rad, start=1))
    plan = PosePlan(schema=1, rig=rig.name, block=(PlannedBlock(pose=poses),), purpose=())
    nowhere = np.full(cube.q_rad.shape, np.nan)
    goal = Wanted(cube.T_base_tool, nowhere, cube.q_rad, {"payload_kg": np.zeros(len(nowhere))})
    sent = correct(model, goal, MotionInverse(RigArm.of_rig(rig)), Options())
    if not np.isfinite(sent.q_rad).all():
        return None
    rng = np.random.default_rng([seed, 9])
    test = evaluate(_seen(case, rig, cube.q_rad, CYCLES, rng), rig, model, plan)
    after = evaluate(_seen(case, rig, sent.q_rad, 2, None), rig, model, plan)
    if test.corrected is None:
        return None
    printed, true = _accuracies(test.corrected), _accuracies(after.measured)
    sigma = np.array([s for _, s in test.predicted_m.values()])
    return Tested(
        arm,
        float(_accuracies(test.measured).max()),
        max(value for value, _ in test.predicted_m.values()),
        float(printed.max()),
        float(true.max()),
        float(np.mean(np.abs(true - printed) <= 3.0 * sigma)),
    )


def _accuracies(test: PoseTest) -> Floats:
    return np.array([one.accuracy_m.value for one in test.poses])


def _seen(case: Case, rig: Rig, q_rad: Floats, cycles: int, rng: np.random.Generator | None) -> Samples:
    """`cycles` visits of each pose (pose, joint) by the concealed arm before its tracker; no noise without `rng`."""
    instrument = case.drawn.true.instrument
    if not isinstance(instrument, Device):
        raise TypeError("a pose test needs a device that measures positions")
    sent = np.tile(q_rad, (cycles, 1))
    back = inverse(instrument.pose)
    seen_m = true_tips_m(case, sent, np.atleast_2d(case.drawn.true.tool_point_m)[0]) @ back[:3, :3].T + back[:3, 3]
    if rng is not None:
        seen_m = seen_m + case.sigma_m * rng.standard_normal(seen_m.shape)
    columns = {"t_s": 20.0 * np.arange(len(sent)), "repeat": np.tile(np.arange(1.0, 1.0 + len(q_rad)), cycles)}
    columns |= {f"{name}{j + 1}_rad": sent[:, j] for name in ("q", "cmd") for j in range(rig.n_joints)}
    columns |= {"payload_kg": np.zeros(len(sent))}
    return Samples(columns | dict(zip(("x_m", "y_m", "z_m"), seen_m.T, strict=True)), rig.n_joints)


def lines(found: Sequence[Tested]) -> Iterator[str]:
    """One an arm; micrometres, medians over the sessions."""
    yield "| arm | tests | AP measured | predicted | corrected, printed | corrected, true | true / printed | inside |"
    yield "|---|---|---|---|---|---|---|---|"
    for arm in dict.fromkeys(one.arm for one in found):
        some = [one for one in found if one.arm == arm]
        names = ("measured_m", "predicted_m", "printed_m", "true_m")
        measured, predicted, printed, true = (1e6 * np.median([getattr(one, name) for one in some]) for name in names)
        ratio = np.median([one.true_m / one.printed_m for one in some])
        inside = np.mean([one.inside for one in some])
        yield (
            f"| {MAKES[arm]} | {len(some)} | {measured:.0f} | {predicted:.0f} | {printed:.1f} | {true:.1f} | "
            f"{ratio:.2f} | {100 * inside:.0f} % |"
        )


def main(seeds: Sequence[int]) -> None:
    """Prints the table."""
    found: list[Tested] = []
    for arm in MAKES:
        for seed in seeds:
            try:
                one = tested(arm, seed)
            except concealed.ConcealError as reason:
                print(f"{arm}, seed {seed}: {reason}")
                continue
            if one is not None:
                found.append(one)
    print("\n".join(lines(found)))


if __name__ == "__main__":
    main(range(1, 1 + int(sys.argv[1])) if len(sys.argv) > 1 else SEEDS)
