"""Speed on one core, in one run beside Pinocchio, scipy and plain numpy: CPU-time medians, ratios, aims.

Every rival is first checked to give the same numbers. Aims of poses and tracker fits are ratios of the same run: a
flange pose in a tenth of Pinocchio's time, a point with 24 derivatives in an eighth, a fit no slower than scipy's
dogbox with our Jacobian. A busy machine shows larger times, so look at the ratios.
"""

import subprocess
import sys
import time
import tracemalloc
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from unittest.mock import patch

import msgspec
import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from acquisition.recording import Samples
from acquisition.recording.rig import Placement, Pose, Rig, load_rig
from acquisition.recording.samples import SPOTS
from benchmarks import rival_pinocchio
from benchmarks.drawn_sessions import T_BASE_DEVICE, TARGET_M, Bench, frame
from calibrate.fit.identify.identify import identify
from calibrate.fit.identify.rounds import coarse_start, settled_fit
from calibrate.fit.identify.session import instruments_for_fit
from calibrate.fit.rank.identifiability import analyse
from calibrate.fit.rank.observability import reduced
from calibrate.fit.solvers import NEAR_START, Fit, solve
from calibrate.model.arms import compiled
from calibrate.model.arms.catalogue import arm_of
from calibrate.model.arms.serial import SerialArm
from calibrate.model.chain import SensorChain
from calibrate.model.observations import Observations
from calibrate.model.parameters import hold, plausible_sizes
from calibrate.model.placement import Device, Target
from calibrate.model.problem import Problem
from calibrate.model.rigid import cross_matrix
from calibrate.model.sensors.position import Position

Floats = NDArray[np.float64]

SIGMA_M = 20e-6
JOINT_SIGMA_RAD = 3e-6
UNITS = {"ns a pose": 1e9, "ms": 1e3, "s": 1.0}
IMPORTS = "calibrate.fit.identify.identify, calibrate.model.predict, calibrate.apply.export.export"


@dataclass(frozen=True)
class Row:
    """One line of the table; times in `unit`."""

    what: str
    unit: str
    ours: float
    aim: float | None
    others: Mapping[str, float] = field(default_factory=dict)

    def text(self) -> str:
        rivals = ", ".join(f"{name} {_short(t)} ({t / self.ours:.1f}x)" for name, t in self.others.items()) or "-"
        verdict = "" if self.aim is None else "reached" if self.ours <= self.aim else "NOT reached"
        aim = "-" if self.aim is None else f"<= {_short(self.aim)}"
        return f"{self.what:58s} {_short(self.ours):>8s} {self.unit:10s} {aim:>9s} {verdict:12s} {rivals}"


def lines(rig_file: Path) -> Iterator[str]:
    """The table, line by line as it is measured."""
    compiled.prepare()
    rig = load_rig(rig_file)
    arm = arm_of(rig)
    yield f"{'what':58s} {'ours':>8s} {'':10s} {'aim':>9s} {'':12s} others (times ours)"
    for rows in (_poses(arm), _tracker(rig_file, arm), _growth(rig_file, arm), _dual_psd(rig_file, rig), _starting()):
        for row in rows:
            yield row.text()


def _short(value: float) -> str:
    return f"{value:.3g}" if value < 1000.0 else f"{value:.0f}"


def cpu_s(work: Callable[[], object], samples: int = 31, warm_up: int = 3) -> float:
    """Median CPU time of one call."""
    for _ in range(warm_up):
        work()
    times: list[float] = []
    for _ in range(samples):
        begun = time.process_time()
        work()
        times.append(time.process_time() - begun)
    return float(np.median(times))


def _poses(arm: SerialArm) -> Iterator[Row]:
    rng = np.random.default_rng(0)
    theta = rng.normal(0, 1e-3, len(arm.parameters))
    everything = compiled.ArmConstants.of(arm, theta)
    four_a_link = everything.of_columns(np.flatnonzero(np.arange(len(theta)) % 5 != 4))
    few = rng.uniform(-2.5, 2.5, (1_000, arm.n_joints))
    flange_rivals, jacobian_rivals = _pose_rivals(arm, theta, everything, four_a_link, few)
    pinocchio = flange_rivals["Pinocchio"] / 10.0, jacobian_rivals["Pinocchio, its 6x36 regressor"] / 8.0
    for poses, flange_aim, jacobian_aim in ((1_000, *pinocchio), (100_000, None, None)):
        q = rng.uniform(-2.5, 2.5, (poses, arm.n_joints))
        each = 1e9 / poses
        ours = each * cpu_s(lambda q=q: compiled.flange(everything, q))
        yield Row(f"forward kinematics, {poses} poses", "ns a pose", ours, flange_aim, flange_rivals)
        ours = each * cpu_s(lambda q=q: compiled.point_and_jacobian(four_a_link, TARGET_M, q))
        yield Row(f"point, Jacobian by 24 parameters, {poses} poses", "ns a pose", ours, jacobian_aim, jacobian_rivals)


def _pose_rivals(
    arm: SerialArm, theta: Floats, everything: compiled.ArmConstants, four_a_link: compiled.ArmConstants, q_rad: Floats
) -> tuple[dict[str, float], dict[str, float]]:
    """Times (ns a pose) of the others for flange and Jacobian at these poses, after a look that all say the same."""
    rival, each = rival_pinocchio.Rival(everything), 1e9 / len(q_rad)
    np.testing.assert_allclose(compiled.flange(everything, q_rad), rival.flanges(q_rad), atol=1e-12)
    point, jacobian = compiled.point_and_jacobian(four_a_link, TARGET_M, q_rad)
    np.testing.assert_allclose(point, rival.points(TARGET_M, q_rad), atol=1e-12)
    np.testing.assert_allclose(jacobian, _numpy_jacobian(arm, theta, q_rad)[:, :, np.arange(30) % 5 != 4], atol=1e-12)
    flanges = {
        "numpy": each * cpu_s(lambda: arm.frames(theta, q_rad)[:, -1]),
        "Pinocchio": each * cpu_s(lambda: rival.flanges(q_rad), 5),
    }
    jacobians = {
        "numpy, 30 parameters": each * cpu_s(lambda: _numpy_jacobian(arm, theta, q_rad), 9),
        "Pinocchio, its 6x36 regressor": each * cpu_s(lambda: rival.regressors(TARGET_M, q_rad), 5),
    }
    return flanges, jacobians


def _numpy_jacobian(arm: SerialArm, theta: Floats, q_rad: Floats) -> Floats:
    with patch.object(compiled, "worth", return_value=False):
        T, twists = arm.flange(theta, q_rad), arm.twists(theta, q_rad)
    point = T[:, :3, :3] @ TARGET_M + T[:, :3, 3]
    return twists[:, :3] - cross_matrix(point) @ twists[:, 3:]


def tracker_problem(rig_file: Path, arm: SerialArm, poses: int) -> Problem:
    """30 unknowns without any belief: 21 of links 2 to 6, tool 3, device 6; 20 um an axis."""
    session = Bench(rig_file).tracker(np.random.default_rng(1), poses)
    chain = SensorChain(arm, Position(Target(TARGET_M), Device(frame(*T_BASE_DEVICE))))
    loose = tuple(replace(p, prior=np.inf, free=True) for p in chain.parameters)
    held = {p.name for p in loose if p.name.startswith(("joint1.", "link1."))}
    held |= {p.name for p in loose if p.name.endswith(".tilt") and p.name != "link2.tilt"}
    weights = np.tile(np.eye(3) / SIGMA_M, (poses, 1, 1))
    return Problem(chain, hold(loose, held), session.q_rad, session.observed, weights)


def identify_positions(problem: Problem) -> Fit:
    """Rank at the drawing, one of every unseen combination held, then the fit."""
    theta = np.zeros(len(problem.parameters))
    held = reduced(problem.parameters, analyse(problem.jacobian(theta), problem.parameters))
    return solve(problem.with_parameters(held), start=theta, damping=NEAR_START)


def _tracker(rig_file: Path, arm: SerialArm) -> Iterator[Row]:
    problem = tracker_problem(rig_file, arm, 1_000)
    fit = identify_positions(problem)
    held = problem.with_parameters(fit.parameters)
    others = {"fit alone, rank known": cpu_s(lambda: solve(held, damping=NEAR_START), 31)}
    for method in ("lm", "dogbox", "trf"):
        np.testing.assert_allclose(_by_scipy(held, method), fit.chi2, rtol=1e-6)
        others[f"scipy {method}, rank known"] = cpu_s(lambda method=method: _by_scipy(held, method), 9, 0)
    rank = sum(p.free for p in fit.parameters)
    what = f"identification, 1000 tracker poses, 30 unknowns (rank {rank})"
    in_ms = {name: 1e3 * t for name, t in others.items()}
    yield Row(
        what, "ms", 1e3 * cpu_s(lambda: identify_positions(problem), 31), in_ms["scipy dogbox, rank known"], in_ms
    )


def _by_scipy(problem: Problem, method: str) -> float:
    """Chi-square at scipy's end, from our rows and Jacobian in the same scaled columns."""
    free = np.flatnonzero([p.free for p in problem.parameters])
    scale, theta = plausible_sizes(problem.parameters)[free], np.zeros(len(problem.parameters))

    def at(x: Floats) -> Floats:
        out = theta.copy()
        out[free] = x * scale
        return out

    found = least_squares(
        lambda x: problem.residual(at(x)),
        np.zeros(len(free)),
        lambda x: problem.jacobian(at(x))[:, free] * scale,
        method=method,
    )
    return 2.0 * float(found.cost)


def _growth(rig_file: Path, arm: SerialArm) -> Iterator[Row]:
    whole = tracker_problem(rig_file, arm, 100_000)
    for poses in (10_000, 100_000):
        problem = whole.select(np.arange(poses))
        tracemalloc.start()
        identify_positions(problem)
        held_mb = tracemalloc.get_traced_memory()[1] / 1e6
        tracemalloc.stop()
        each = 1e9 * cpu_s(lambda problem=problem: identify_positions(problem), 3, 0) / poses
        yield Row(f"identification, {poses} tracker poses, {held_mb:.0f} MB held", "ns a pose", each, None)


def six_places(rig_file: Path, rig: Rig) -> tuple[Rig, Observations]:
    """300 samples, 150 poses twice, over six places: the rig's three, and each of them moved by some centimetres."""
    rng, bench = np.random.default_rng(2), Bench(rig_file, tuple(rig.placements))
    bench.places |= {k + 3: frame(rng.normal(0, 0.03, 3), [0, 0, 0]) @ T for k, T in bench.places.items()}
    one = bench.dual_psd(rng, 150)
    extra = tuple(
        Placement(id=k, psd1_in_base=Pose(tuple(T[:3, 3].tolist()), rig.placements[k - 3].psd1_in_base.rotation_rad))
        for k, T in bench.places.items()
        if k > 3
    )
    spots = np.concatenate([one.observed, one.observed + rng.normal(0, 2e-6, one.observed.shape)])
    q, first, place = (np.concatenate([a, a]) for a in (one.q_rad, one.first_psd, one.placement))
    q = q + rng.normal(0, JOINT_SIGMA_RAD, q.shape)
    return msgspec.structs.replace(rig, placement_list=rig.placement_list + extra), Observations(q, first, place, spots)


def _dual_psd(rig_file: Path, rig: Rig) -> Iterator[Row]:
    rig, data = six_places(rig_file, rig)
    samples = _spots_table(data)
    instruments = instruments_for_fit(rig, samples)
    weighting, start = instruments.weighting, instruments.start

    def fitted() -> object:
        return settled_fit(weighting, coarse_start(weighting, start))

    yield Row("fit, rank and noise, 300 dual-PSD samples, 6 places", "ms", 1e3 * cpu_s(fitted, 7, 1), None, {})
    whole = 1e3 * cpu_s(lambda: identify(rig, samples, rng=np.random.default_rng(0)), 3, 1)
    yield Row("the same with gross errors, proofs and report figures", "ms", whole, None, {})


def _spots_table(data: Observations) -> Samples:
    columns = dict(zip(SPOTS, data.spots_m.T, strict=True))
    columns |= {f"q{i}_rad": column for i, column in enumerate(data.q_rad.T, start=1)}
    columns |= {"placement": data.placement.astype(np.float64), "first_psd": data.first_psd.astype(np.float64)}
    return Samples({"t_s": np.arange(len(data), dtype=np.float64), **columns}, data.q_rad.shape[1])


def _starting() -> Iterator[Row]:
    """In fresh interpreters; CPU time too, which is what a person waits for on a machine with nothing else to do."""
    code = f"import time; t = time.process_time(); import {IMPORTS}; print(time.process_time() - t)"
    yield Row(
        "import of identification, prediction and export",
        "s",
        _fresh(code),
        0.5,
        {"numpy alone": _fresh("import time; t = time.process_time(); import numpy; print(time.process_time() - t)")},
    )
    code = (
        "import time, numpy as np; from calibrate.model.arms import compiled; "
        "arm = compiled.ArmConstants(np.tile(np.eye(4), (7, 1, 1)), np.zeros(6), np.zeros(1, int), np.zeros((1, 6))); "
        "t = time.process_time(); compiled.flange(arm, np.zeros((1000, 6))); "
        "compiled.point_and_jacobian(arm, np.zeros(3), np.zeros((1000, 6))); print(time.process_time() - t)"
    )
    yield Row("first call of the compiled loops, from the cache", "s", _fresh(code), 1.0)


def _fresh(code: str, times: int = 5) -> float:
    runs = (
        subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True) for _ in range(times)
    )
    return float(np.median([float(run.stdout) for run in runs]))
