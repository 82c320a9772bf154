"""Do designed poses calibrate better than random ones? Sessions of both on the emulated rig, against its truth.

A session is that of `calibeam session --plan` in this process; random poses come from the same candidates: reachable,
clear and lit. Each is identified as any session is, and the beam of the arm found is compared with the true one in free
space, over poses drawn evenly between the joint limits, base frame at its best.
"""

import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from acquisition.recording import Recording, RecordingWriter, read
from acquisition.recording.pose_plan import PosePlan
from acquisition.recording.rig import Rig, load_rig, plain_rig, rig_sha256, rig_text
from acquisition.session.plan import PlanOptions
from acquisition.session.session import Session
from benchmarks.slices import Slices
from calibeam.devices.recorder import RecordingJournal
from calibeam.learner import FittedLearner
from calibeam.motion.reachable_poses import candidates_of
from calibeam.prove.record import FreeSpace
from calibeam.prove.scoring import errors_m
from calibeam.prove.unseen import LaserBeam
from calibeam.results.identification import Planned, identify_session
from calibrate.design.candidates import (
    Candidates,
    blocks_of,
    plan_of,
    taken,
)
from calibrate.design.design import DesignOptions, design
from calibrate.design.exchange import CRITERIA
from calibrate.design.information import Information, information_of
from calibrate.fit.fit_plan import FitPlan
from calibrate.model.assumed_rig import assumed_arm
from drivers.clock import SystemClock
from simulators.world.truth import Truth
from tests.support.direct_bench import direct_bench

Floats = NDArray[np.float64]

POSES = 60
LOOKED_AT = 500  # poses of the comparison


@dataclass(frozen=True)
class Compared:
    """One truth: rms error of the beam over the workspace, m, and samples that the session kept."""

    seed: int
    designed_m: float
    random_m: float
    designed_taken: int
    random_taken: int


def run(rig_file: Path, seeds: range, criterion: str = "free-space") -> Iterator[Compared]:
    """One design for all; truth and random poses are drawn again with every seed."""
    rig, rng = load_rig(rig_file), np.random.default_rng(1)
    candidates = candidates_of(rig, 120, rng)
    found = information_of(rig, candidates, rng)
    designed = design(rig, candidates, found, DesignOptions(poses=POSES, criterion=criterion)).plan
    for seed in seeds:
        random = _random(rig, candidates, seed)
        (a, taken_a), (b, taken_b) = (_error_m(rig_file, rig, plan, seed) for plan in (designed, random))
        yield Compared(seed, a, b, taken_a, taken_b)


def predicted(rig_file: Path) -> Iterator[str]:
    """What every criterion promises, beside random poses."""
    rig, rng = load_rig(rig_file), np.random.default_rng(1)
    candidates = candidates_of(rig, 120, rng)
    found = information_of(rig, candidates, rng)
    drawn = [_promised(found, rng.choice(len(candidates), POSES, replace=False)) for _ in range(20)]
    yield f"predicted error in free space, {POSES} poses: random {1e6 * float(np.median(drawn)):.1f} um (median of 20)"
    for name in CRITERIA:
        made = design(rig, candidates, found, DesignOptions(poses=POSES, criterion=name))
        yield f"  {name:10s} {1e6 * made.free_space_m:.1f} um"


def _promised(found: Information, poses: NDArray[np.intp]) -> float:
    return found.free_space_m(found.of(poses))


def _random(rig: Rig, candidates: Candidates, seed: int) -> PosePlan:
    rng = np.random.default_rng(1000 + seed)
    chosen = rng.choice(len(candidates), POSES, replace=False)
    in_time = np.concatenate(blocks_of(candidates, chosen))
    return plan_of(rig.name, candidates, taken(candidates, in_time, 0, rng), ("random poses",))


def _error_m(rig_file: Path, rig: Rig, plan: PosePlan, seed: int) -> tuple[float, int]:
    bench = direct_bench(rig, plain_rig(rig_text(rig_file), str(rig_file)), seed=seed)
    with tempfile.TemporaryDirectory() as folder:
        path, clock = Path(folder) / "r.mcap", SystemClock()
        with RecordingWriter(path, rig_text=rig_text(rig_file), software="benchmark", clock=clock) as writer:
            home_rad = np.array(rig.motion.home_rad)
            journal = RecordingJournal(writer, clock)
            session = Session(bench, FittedLearner(rig), journal, PlanOptions(seed=seed), home_rad)
            kept = len(session.take_planned(plan).samples)
        recording = read(path)
    joints = rig.arm.joints
    limits = [j.lower_rad for j in joints], [j.upper_rad for j in joints]
    q = np.random.default_rng(seed).uniform(*limits, (LOOKED_AT, len(joints)))
    error = errors_m(_found(recording, q), _true(bench.world.truth, q))
    if error is None:
        raise RuntimeError(f"seed {seed}: nothing to compare")
    return error, kept


def _found(recording: Recording, q_rad: Floats) -> LaserBeam:
    """The laser's beam on the identified arm."""
    result = identify_session(recording, plan_without_proofs())
    values = dict(zip((p.name for p in result.parameters), result.theta.tolist(), strict=True))
    arm = assumed_arm(recording.rig, values)
    beams = [arm.beam(q) for q in q_rad]
    return LaserBeam(np.array([origin for origin, _ in beams]), np.array([direction for _, direction in beams]))


def _true(truth: Truth, q_rad: Floats) -> FreeSpace:
    """The true beam; the true angle is the reading and the joint's zero (simulators/world/truth.py)."""
    frames = np.broadcast_to(np.eye(4), (len(q_rad), 4, 4))
    for link, q, zero in zip(truth.links, q_rad.T, truth.joint_zero_rad, strict=True):
        angle = (q + zero + link.theta_offset_rad)[:, None]
        turn = _frames(Rotation.from_euler("z", angle), [0.0, 0.0, 0.0])
        tail = Rotation.from_euler("XY", [link.alpha_rad, link.beta_rad])
        frames = frames @ turn @ _frames(tail, [link.a_m, 0.0, link.d_m])
    frames = frames @ _frames(Rotation.from_rotvec(truth.flange.rotation_rad), list(truth.flange.origin_m))
    origin = frames[:, :3, :3] @ np.array(truth.laser_origin_m) + frames[:, :3, 3]
    direction = frames[:, :3, :3] @ np.array(truth.laser_direction)
    return FreeSpace(beam_origin_m=origin.tolist(), beam_direction=direction.tolist())


def _frames(turn: Rotation, origin_m: list[float]) -> Floats:
    matrix = turn.as_matrix()
    out = np.zeros((*matrix.shape[:-2], 4, 4))
    out[..., :3, :3], out[..., :3, 3], out[..., 3, 3] = matrix, origin_m, 1.0
    return out


def plan_without_proofs() -> Planned:
    return Planned(FitPlan(schema=1, share=0.0))


def lines(rig_file: Path, seeds: range, *, anew: bool = True) -> Iterator[str]:
    """All seeds, then what the criteria promise; not `anew`: these seeds beside those of earlier slices."""
    kept = Slices("designed-poses", Compared, rig_sha256(rig_text(rig_file)))
    if anew:
        kept.forget()
    for one in run(rig_file, seeds):
        kept.keep(one.seed, one)
        yield (
            f"seed {one.seed:2d}: designed {1e6 * one.designed_m:6.1f} um ({one.designed_taken} poses), random "
            f"{1e6 * one.random_m:6.1f} um ({one.random_taken}), ratio {one.designed_m / one.random_m:.2f}"
        )
    yield summary_line(kept.rows())
    if anew:
        yield from predicted(rig_file)


def summary_line(results: Sequence[Compared]) -> str:
    """Medians, rms and ratios over the truths; an error is nearly one normal number times what the plan promises."""
    a, b = (np.array([getattr(r, name) for r in results]) for name in ("designed_m", "random_m"))
    return (
        f"median over {len(results)} truths: designed {1e6 * np.median(a):.1f} um, random {1e6 * np.median(b):.1f} um, "
        f"ratio of the medians {np.median(a) / np.median(b):.2f}, median ratio {np.median(a / b):.2f}, "
        f"designed better in {int(np.sum(a < b))}; rms {1e6 * _rms(a):.1f} um and {1e6 * _rms(b):.1f} um, ratio "
        f"{_rms(a) / _rms(b):.2f}; worst {1e6 * a.max():.1f} um and {1e6 * b.max():.1f} um"
    )


def _rms(values: Floats) -> float:
    return float(np.sqrt(np.mean(values**2)))
