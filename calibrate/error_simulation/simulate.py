"""The whole error simulation of an arm: linear beside drawn, shares, budget, every source alone, worst postures.

Worst postures: where in the workspace the sources together put the probe off most, by linear propagation. The worst of
many drawn poses, each climbed from to the top of its hill within the joint limits; hills that are one posture are
reported once: whole turns of a joint make no other one.

errors.json is version 1: docs/error-simulation.md explains every key.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray
from scipy.optimize import minimize

from acquisition.recording.output import json_output, write_output
from calibrate.error_simulation.machine import Machine
from calibrate.error_simulation.monte_carlo import Drawn, draw_arms
from calibrate.error_simulation.sensitivity import (
    ROUNDING_M,
    Linear,
    Single,
    SobolIndices,
    each_alone,
    indices_of,
    propagate,
)
from calibrate.error_simulation.sources import ErrorSource
from calibrate.errors import DataError

Floats = NDArray[np.float64]
Progress = Callable[[str, int, int], None]

WIDE_POSES = 500  # of everything that needs no drawn arms: the rms over the workspace settles to about 2 %
SOBOL_POSES = 6  # of the wide ones, for the indices: some 200 evaluations a source each

DRAWN = 4000
CLIMBED = 24
APART_RAD = 0.1  # postures that differ less in every joint are one
SAME = 1e-4  # of the error: joints that do not matter to it make a ridge, and its places are one
STEP_RAD = 1e-4  # of the climb's differences


@dataclass(frozen=True)
class Asked:
    """How much to compute."""

    arms: int = 1_000_000
    poses: int = 10  # at which arms are drawn
    seed: int = 1
    workers: int = 1


@dataclass(frozen=True)
class ErrorLine:
    """One line of the budget."""

    group: str
    sources: int
    rms_m: float  # over the workspace, of this group alone
    share: float  # of the variance


@dataclass(frozen=True)
class Posture:
    """A top of the error's hill."""

    q_rad: Floats  # (joint,)
    probe_m: Floats  # (3,)
    rms_m: float  # of the probe's error there, three axes together


def worst_postures(
    machine: Machine, sources: Sequence[ErrorSource], rng: Generator, count: int = 5, drawn: int = DRAWN
) -> tuple[Posture, ...]:
    """The worst first; none where nothing moves the probe, for then all postures are alike."""
    q_rad = machine.drawn_poses(drawn, rng)
    rms = propagate(machine, sources, q_rad).rms_m
    if rms.max() <= ROUNDING_M:
        return ()
    tops: list[tuple[float, Floats]] = []
    for start in q_rad[np.argsort(-rms)[:CLIMBED]]:
        tops.append(_climbed(machine, sources, start))
    tops.sort(key=lambda top: -top[0])
    kept: list[tuple[float, Floats]] = []
    for error, q in tops:
        if not any(_same(error, q, other) for other in kept):
            kept.append((error, q))
    return tuple(Posture(q, machine.tip_m(q[None])[0], error) for error, q in kept[:count])


def _climbed(machine: Machine, sources: Sequence[ErrorSource], start: Floats) -> tuple[float, Floats]:
    scale = float(propagate(machine, sources, start[None]).rms_m[0])

    def falling(q: Floats) -> tuple[float, Floats]:
        steps = STEP_RAD * np.eye(len(q))
        rms = propagate(machine, sources, np.concatenate([q[None], q + steps, q - steps])).rms_m / scale
        n = len(q)
        return -float(rms[0]), -(rms[1 : n + 1] - rms[n + 1 :]) / (2.0 * STEP_RAD)

    bounds = list(zip(machine.lower_rad, machine.upper_rad, strict=True))
    found = minimize(falling, start, jac=True, bounds=bounds, method="L-BFGS-B", options={"maxiter": 40})
    return -float(found.fun) * scale, np.asarray(found.x, dtype=np.float64)


def _same(error: float, q: Floats, other: tuple[float, Floats]) -> bool:
    if abs(error - other[0]) < SAME * other[0]:
        return True
    away = (q - other[1] + np.pi) % (2.0 * np.pi) - np.pi
    return bool(np.max(np.abs(away)) < APART_RAD)


@dataclass(frozen=True)
class Simulation:
    """`wide_rad` are poses all over the workspace, `drawn_at_rad` those at which arms were drawn."""

    machine: Machine
    sources: tuple[ErrorSource, ...]
    asked: Asked
    wide_rad: Floats  # (pose, joint)
    wide: Linear
    drawn_at_rad: Floats  # (pose, joint)
    linear: Linear
    drawn: Drawn
    shares: SobolIndices
    singles: tuple[Single, ...]
    worst: tuple[Posture, ...]

    @property
    def moves(self) -> bool:
        """Whether the errors move the probe anywhere."""
        return bool(self.wide.rms_m.max() > ROUNDING_M)

    @property
    def budget(self) -> tuple[ErrorLine, ...]:
        """By group, the largest first."""
        out: list[ErrorLine] = []
        alone, shares = self.wide.alone_m, self.wide.shares
        for group in dict.fromkeys(source.group for source in self.sources):
            mine = np.array([source.group == group for source in self.sources])
            rms = float(np.sqrt(np.mean(_of(self.wide, mine).rms_m ** 2)))
            out.append(ErrorLine(group, int(mine.sum()), rms, float(shares[mine].sum())))
        return tuple(sorted(out, key=lambda line: -line.rms_m)) if len(alone) else ()

    @property
    def ranking(self) -> NDArray[np.intp]:
        """(source,) by total index, then by what each does alone."""
        return np.lexsort((-self.wide.alone_m, -np.round(self.shares.total, 6)))


def _of(linear: Linear, mine: NDArray[np.bool_]) -> Linear:
    return Linear(linear.mean_m[mine], linear.covariance_m2[mine])


def simulate(
    machine: Machine,
    sources: Sequence[ErrorSource],
    asked: Asked,
    progress: Progress = lambda what, done, total: None,
) -> Simulation:
    """The same answer from the same `asked`, but for `workers`, which change nothing."""
    rng_wide, rng_drawn, rng_worst = np.random.default_rng(asked.seed).spawn(3)
    wide_rad, at_rad = machine.drawn_poses(WIDE_POSES, rng_wide), machine.drawn_poses(asked.poses, rng_drawn)
    wide, linear = propagate(machine, sources, wide_rad), propagate(machine, sources, at_rad)
    drawn = draw_arms(
        machine,
        sources,
        at_rad,
        asked.arms,
        seed=asked.seed,
        rms_m=linear.rms_m,
        workers=asked.workers,
        progress=lambda done, total: progress("drawn arms", done, total),
    )
    shares = indices_of(
        machine,
        sources,
        wide_rad[:SOBOL_POSES],
        seed=asked.seed,
        progress=lambda done, total: progress("Sobol indices", done, total),
    )
    singles = each_alone(machine, sources, wide_rad[:100])
    worst = worst_postures(machine, sources, rng_worst)
    return Simulation(machine, tuple(sources), asked, wide_rad, wide, at_rad, linear, drawn, shares, singles, worst)


SHARE = 0.95


def record_of(simulation: Simulation, software: str) -> dict[str, Any]:
    """Plain numbers, SI; names end in their unit."""
    s = simulation
    return {
        "schema": 1,
        "kind": "calibeam-errors",
        "software": software,
        "arm": s.machine.name,
        "seed": s.asked.seed,
        "arms": s.drawn.arms,
        "workspace": {
            "poses": len(s.wide_rad),
            "rms_m": float(np.sqrt(np.mean(s.wide.rms_m**2))),
            "max_m": float(s.wide.rms_m.max()),
        },
        "poses": [_pose(s, i) for i in range(len(s.drawn_at_rad))],
        "sobol_poses": s.shares.poses,
        "budget": [
            {"group": line.group, "sources": line.sources, "rms_m": line.rms_m, "share": line.share}
            for line in s.budget
        ],
        "sources": [_source(s, int(i)) for i in s.ranking],
        "worst": [{"q_rad": p.q_rad.tolist(), "probe_m": p.probe_m.tolist(), "rms_m": p.rms_m} for p in s.worst],
    }


def write_record(path: Path, simulation: Simulation, software: str) -> None:
    """In place of an older one. OutputError; DataError where the disk refuses."""
    text = msgspec.json.format(msgspec.json.encode(record_of(simulation, software)), indent=1) + b"\n"
    try:
        write_output(path, text, json_output("calibeam-errors"))
    except OSError as error:
        raise DataError(f"{path}: cannot be written ({error.strerror}); choose another --out") from error


def _pose(s: Simulation, i: int) -> dict[str, Any]:
    return {
        "q_rad": s.drawn_at_rad[i].tolist(),
        "linear_rms_m": float(s.linear.rms_m[i]),
        "linear_sigma_m": s.linear.sigma_m[i].tolist(),
        "drawn_rms_m": float(s.drawn.rms_m[i]),
        "drawn_sigma_m": s.drawn.sigma_m[i].tolist(),
        "drawn_bias_m": s.drawn.mean_m[i].tolist(),
        "drawn_p95_m": float(s.drawn.quantile_m(SHARE)[i]),
        "drawn_max_m": float(s.drawn.worst_m[i]),
        "worst_arm": int(s.drawn.worst_arm[i]),
    }


def _source(s: Simulation, i: int) -> dict[str, Any]:
    source, single = s.sources[i], s.singles[i]
    return {
        "name": source.name,
        "group": source.group,
        "unit": source.unit,
        "law": source.law.name,
        "loc": source.law.loc,
        "scale": source.law.scale,
        "alone_rms_m": float(s.wide.alone_m[i]),
        "gain_m_per_unit": single.gain,
        "share_linear": float(s.wide.shares[i]),
        "share_first": float(s.shares.first[i]),
        "share_first_sigma": float(s.shares.first_sigma[i]),
        "share_total": float(s.shares.total[i]),
        "share_total_sigma": float(s.shares.total_sigma[i]),
    }
