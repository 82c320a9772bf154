"""Worst postures: where in the workspace the sources together put the probe off most, by linear propagation.

The worst of many drawn poses, each climbed from to the top of its hill within the joint limits, and hills that are
one posture told once: turns of a joint by a whole turn make no other one.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray
from scipy.optimize import minimize

from calibrate.error_simulation.linear import ROUNDING_M, propagate
from calibrate.error_simulation.machine import Machine
from calibrate.error_simulation.source import Source

Floats = NDArray[np.float64]

DRAWN = 4000
CLIMBED = 24
APART_RAD = 0.1  # postures that differ less in every joint are one
SAME = 1e-4  # of the error: joints that do not matter to it make a ridge, and its places are one
STEP_RAD = 1e-4  # of the climb's differences


@dataclass(frozen=True)
class Posture:
    """A top of the error's hill."""

    q_rad: Floats  # (joint,)
    probe_m: Floats  # (3,)
    rms_m: float  # of the probe's error there, three axes together


def worst_postures(
    machine: Machine, sources: Sequence[Source], rng: Generator, count: int = 5, drawn: int = DRAWN
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


def _climbed(machine: Machine, sources: Sequence[Source], start: Floats) -> tuple[float, Floats]:
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
