"""What is known of the links before a motion is looked at: from the rig file, or from a model or simulation beside it.

Numbers of links that no motion separates stay where their priors have them. Where the rig file states masses the
priors are those of a drawing, else they are wide; a fitted model knows what its own motion has shown.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from acquisition.recording.rig import Rig
from calibrate.errors import DataError
from calibrate.model.arms.inverse_dynamics import NUMBERS
from calibrate.model.parameters import Parameter
from calibrate.model.torque_records import TorquesOfModel

Floats = NDArray[np.float64]

MASS_SHARE, COM_M = 0.05, 5e-3  # of a stated mass and its centre, where the rig states no tolerance of them
INERTIA_SHARE = 0.1  # of a stated tensor
UNSTATED_SHARE = 1.0  # of a link's mass times its length squared, for a tensor that is not stated
ROTOR_SHARE = 0.02  # of a stated rotor: it is weighed and turned, and its ratio is exact
LEAST_LENGTH_M = 0.1
LEAST_KG, LEAST_KG_M2 = 1e-3, 1e-6  # of a body: sigmas stay above zero
WIDE = 1e3  # kg, kg m, kg m²: a link of a robot for heavy loads


@dataclass(frozen=True, eq=False)
class LinkPrior:
    """Numbers of links are `stated` and steps along `ways`; each step has a normal law of one sigma."""

    stated: Floats  # (link number,) ten for each link, link by link, then the rotors
    ways: Floats  # (link number, step)

    @property
    def size(self) -> int:
        """Of the steps."""
        return self.ways.shape[1]

    @cached_property
    def parameters(self) -> tuple[Parameter, ...]:
        """The steps."""
        return tuple(Parameter(f"links{i}", "1", 1.0, prior=1.0) for i in range(self.size))

    def numbers(self, steps: Floats) -> Floats:
        """(link number,) after steps (step,)."""
        return np.asarray(self.stated + self.ways @ steps)


def link_prior(rig: Rig, known: TorquesOfModel | None = None) -> LinkPrior:
    """About what the rig file states, or what is known beside it."""
    if known is not None and len(known.links) != rig.n_joints:
        raise DataError(f"{known.source}: torques of {len(known.links)} joints, the arm of the rig has {rig.n_joints}")
    stated, sigma = _stated(rig) if known is None else _about(rig, known)
    ways = np.diag(sigma)
    if known is not None and known.triangle:
        rows = np.concatenate([np.array(known.triangle) * sigma, np.eye(len(sigma))])
        _, s, Vt = np.linalg.svd(rows, full_matrices=False)
        ways = sigma[:, None] * Vt.T / s
    return LinkPrior(stated, ways)


def torques_of_rig(rig: Rig, source: str) -> TorquesOfModel | None:
    """What a rig file states of the torques; None where it states no masses."""
    if any(joint.mass_kg is None for joint in rig.arm.joints):
        return None
    numbers, n = _stated(rig)[0], rig.n_joints
    links = numbers[: n * len(NUMBERS)].reshape(n, -1).tolist()
    rotors = tuple(numbers[n * len(NUMBERS) :].tolist())
    return TorquesOfModel(source, tuple(map(tuple, links)), rotors, rig.arm.gravity_m_s2)


def _stated(rig: Rig) -> tuple[Floats, Floats]:
    """(link number,) each: value and one sigma."""
    values, sigmas = list[Floats](), list[Floats]()
    last = rig.n_joints - 1
    for i, joint in enumerate(rig.arm.joints):
        bodies = [(joint.mass_kg, joint.com_m, joint.inertia_kg_m2)]
        if i == last and rig.tool.mass_kg is not None:
            bodies.append((rig.tool.mass_kg, rig.tool.com_m, None))
        if joint.mass_kg is None:
            values.append(np.zeros(len(NUMBERS)))
            sigmas.append(np.full(len(NUMBERS), WIDE))
            continue
        length_m = max(LEAST_LENGTH_M, float(np.hypot(joint.a_m or 0.0, joint.d_m or 0.0)))
        values.append(np.sum([_body(mass or 0.0, *rest) for mass, *rest in bodies], axis=0))
        spread = UNSTATED_SHARE * max(values[-1][0], LEAST_KG) * length_m**2
        if joint.inertia_kg_m2 is not None:
            spread = INERTIA_SHARE * max(*joint.inertia_kg_m2[:3], LEAST_KG_M2)
        sigmas.append(_sigmas(rig, values[-1], spread))
    rotors = [_rotor(joint.rotor_inertia_kg_m2) for joint in rig.arm.joints]
    value, sigma = np.array(rotors).T
    return np.concatenate([*values, value]), np.concatenate([*sigmas, sigma])


def _about(rig: Rig, known: TorquesOfModel) -> tuple[Floats, Floats]:
    """The same of a model or simulation: every link of it is a body."""
    links, rotors = np.array(known.links), np.array(known.rotors_kg_m2)
    if known.triangle:  # what a motion has not shown is as open as before
        sigma = _stated(rig)[1]
    else:
        spreads = INERTIA_SHARE * np.maximum(links[:, 4:7].max(axis=1), LEAST_KG_M2)
        each = [_sigmas(rig, link, spread) for link, spread in zip(links, spreads.tolist(), strict=True)]
        sigma = np.concatenate([*each, [_rotor(one)[1] for one in rotors.tolist()]])
    return np.concatenate([links.ravel(), rotors]), sigma


def _sigmas(rig: Rig, link: Floats, spread: float) -> Floats:
    """(10,) of a stated body; `spread` of its tensor."""
    stated = rig.tolerance
    share = MASS_SHARE if stated is None or stated.mass_share is None else stated.mass_share
    centre_m = COM_M if stated is None or stated.com_m is None else stated.com_m
    mass_kg = max(float(link[0]), LEAST_KG)
    return np.array([share * mass_kg, *(mass_kg * centre_m + share * np.abs(link[1:4])), *(spread,) * 6])


def _rotor(stated_kg_m2: float | None) -> tuple[float, float]:
    """Value and one sigma."""
    return (0.0, WIDE) if stated_kg_m2 is None else (stated_kg_m2, ROTOR_SHARE * max(stated_kg_m2, LEAST_KG_M2))


def _body(mass_kg: float, com_m: Sequence[float] | None, inertia_kg_m2: Sequence[float] | None) -> Floats:
    """(10,) about the origin of its frame; without a tensor of its own that of a point."""
    c = np.zeros(3) if com_m is None else np.array(com_m)
    about = mass_kg * (c @ c * np.eye(3) - np.outer(c, c))
    own = np.zeros(6) if inertia_kg_m2 is None else np.array(inertia_kg_m2)
    return np.array([mass_kg, *(mass_kg * c), *(own + about[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]])])
