"""Torques of rigid links and of terms beside them as one least-squares problem, for the solvers of calibrate/fit.

Numbers of links that no motion separates stay where their priors have them; where the rig file states masses the
priors are those of a drawing, else they are wide.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from acquisition.recording.rig import Rig
from calibrate.model.arms.inverse_dynamics import NUMBERS, UNITS
from calibrate.model.effects.term import Accepted
from calibrate.model.effects.torque import MotionDrivers
from calibrate.model.parameters import Parameter
from calibrate.model.torque_records import TorquesOfModel

Floats = NDArray[np.float64]
Ints = NDArray[np.intp]

MASS_SHARE, COM_M = 0.05, 5e-3  # of a stated mass and its centre, where the rig states no tolerance of them
INERTIA_SHARE = 0.1  # of a stated tensor
UNSTATED_SHARE = 1.0  # of a link's mass times its length squared, for a tensor that is not stated
ROTOR_SHARE = 0.02  # of a stated rotor: it is weighed and turned, and its ratio is exact
LEAST_LENGTH_M = 0.1
WIDE = 1e3  # kg, kg m, kg m²: a link of a robot for heavy loads
LOOSE = 1e3  # times the size that would be plain to see: prior about a coefficient, so that none is ever singular


def link_parameters(rig: Rig, known: TorquesOfModel | None = None) -> tuple[Parameter, ...]:
    """Ten for each link, link by link, about what the rig file states, or a model or simulation beside it; then the
    rotor of each joint.
    """
    out: list[Parameter] = []
    stated = rig.tolerance
    share = MASS_SHARE if stated is None or stated.mass_share is None else stated.mass_share
    centre_m = COM_M if stated is None or stated.com_m is None else stated.com_m
    last = rig.n_joints - 1
    for i, joint in enumerate(rig.arm.joints):
        bodies = [(joint.mass_kg, joint.com_m, joint.inertia_kg_m2)]
        if i == last and rig.tool.mass_kg is not None:
            bodies.append((rig.tool.mass_kg, rig.tool.com_m, None))
        if joint.mass_kg is None and known is None:
            start, sigma = np.zeros(len(NUMBERS)), np.full(len(NUMBERS), WIDE)
        else:
            length_m = max(LEAST_LENGTH_M, float(np.hypot(joint.a_m or 0.0, joint.d_m or 0.0)))
            start = np.sum([_body(mass or 0.0, *rest) for mass, *rest in bodies], axis=0)
            start = start if known is None else np.array(known.links[i])
            mass_kg = max(float(start[0]), 1e-3)
            first = mass_kg * centre_m + share * np.abs(start[1:4])
            spread = UNSTATED_SHARE * mass_kg * length_m**2
            if known is not None:
                spread = INERTIA_SHARE * max(*start[4:7], 1e-6)
            elif joint.inertia_kg_m2 is not None:
                spread = INERTIA_SHARE * max(*joint.inertia_kg_m2[:3], 1e-6)
            sigma = np.array([share * mass_kg, *first, *(spread,) * 6])
        out += [
            Parameter(f"link{i + 1}.{name}", unit, float(s), start=float(at), prior=float(s))
            for name, unit, at, s in zip(NUMBERS, UNITS, start, sigma, strict=True)
        ]
    stated_rotors = [j.rotor_inertia_kg_m2 for j in rig.arm.joints] if known is None else known.rotors_kg_m2
    return (*out, *(_rotor(i, one) for i, one in enumerate(stated_rotors, start=1)))


def _rotor(joint: int, stated_kg_m2: float | None) -> Parameter:
    name, unit = f"joint{joint}.rotor", "kg m^2"
    if stated_kg_m2 is None:
        return Parameter(name, unit, WIDE, prior=WIDE)
    sigma = ROTOR_SHARE * stated_kg_m2
    return Parameter(name, unit, sigma, start=stated_kg_m2, prior=sigma)


def _body(mass_kg: float, com_m: Sequence[float] | None, inertia_kg_m2: Sequence[float] | None) -> Floats:
    """(10,) about the origin of its frame; without a tensor of its own that of a point."""
    c = np.zeros(3) if com_m is None else np.array(com_m)
    about = mass_kg * (c @ c * np.eye(3) - np.outer(c, c))
    own = np.zeros(6) if inertia_kg_m2 is None else np.array(inertia_kg_m2)
    return np.array([mass_kg, *(mass_kg * c), *(own + about[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]])])


@dataclass(frozen=True, eq=False)
class TorqueProblem:
    """LeastSquares. A datum is the torque of one joint at one moment."""

    links: tuple[Parameter, ...]
    columns: Floats  # (datum, link number)
    observed_nm: Floats  # (datum,)
    moment: Ints  # (datum,)
    joint: Ints  # (datum,) from 0
    sigma_nm: Floats  # (joint,) of the noise
    memory_s: Floats  # (joint,) in which the noise forgets itself to 1/e
    weights: Floats  # (datum,) robust, of what is new in it
    terms: tuple[Accepted, ...]
    sizes: tuple[Floats, ...]  # of each term (coefficient,) plain to see; inf where it does nothing
    drivers: MotionDrivers
    given: tuple[Accepted, ...] = ()  # known before: part of what is expected, not fitted

    @cached_property
    def before(self) -> Ints:
        """(datum,) the one before it at its joint; its own number where there is none."""
        own = np.arange(len(self.joint))
        return np.where(np.diff(self.joint, prepend=-1) == 0, own - 1, own)

    @cached_property
    def gap_s(self) -> Floats:
        """(datum,) since the one before it; inf where there is none."""
        t, own = self.drivers.t_s[self.moment], np.arange(len(self.joint))
        return np.where(self.before < own, t - t[self.before], np.inf)

    @cached_property
    def kept(self) -> Floats:
        """(datum,) share of the noise before that is still in it."""
        return np.exp(-self.gap_s / self.memory_s[self.joint])

    @cached_property
    def scale(self) -> Floats:
        """(datum,) what whitens what is new in it, robust weight included."""
        return np.sqrt(self.weights) / (self.sigma_nm[self.joint] * np.sqrt(1.0 - self.kept**2))

    def whitened(self, values: Floats) -> Floats:
        """(datum, ...) of values (datum, ...) in Nm: each less what the one before it predicts.

        Noise as a first-order autoregression: Brockwell, Davis, Time Series: Theory and Methods, 1991, section 3.1.
        """
        shape = (-1,) + (1,) * (values.ndim - 1)
        return self.scale.reshape(shape) * (values - self.kept.reshape(shape) * values[self.before])

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return self._parameters

    @cached_property
    def _parameters(self) -> tuple[Parameter, ...]:
        out = list(self.links)
        for i, accepted in enumerate(self.terms):
            out += [
                Parameter(f"term{i}.c{j}", "1", s, prior=LOOSE * s)
                if np.isfinite(s)
                else Parameter(f"term{i}.c{j}", "1", 1.0, free=False)
                for j, s in enumerate(self.sizes[i])
            ]
            for inner in (accepted.term.inner[j] for j in accepted.term.smooth):
                width = inner.upper - inner.lower
                out.append(Parameter(f"term{i}.{inner.name}", "1", 0.1 * width, lower=inner.lower, upper=inner.upper))
        return tuple(out)

    @cached_property
    def owner(self) -> Ints:
        """(parameter,) index of its term, -1: of a link."""
        each = [np.full(len(a.values), i, dtype=np.intp) for i, a in enumerate(self.terms)]
        return np.concatenate([np.full(len(self.links), -1, dtype=np.intp), *each])

    def split(self, theta: Floats) -> tuple[Floats, tuple[Accepted, ...]]:
        """Of the links, and the terms with these values."""
        at, out = len(self.links), list[Accepted]()
        for a in self.terms:
            m, inner = len(a.coefficients), a.inner.copy()
            smooth = a.term.smooth
            inner[smooth] = theta[at + m : at + m + len(smooth)]
            out.append(Accepted(a.term, theta[at : at + m], inner))
            at += m + len(smooth)
        return theta[: len(self.links)], tuple(out)

    def felt(self, amount: Floats) -> Floats:
        """(datum, ...) of an amount (moment, joint, ...)."""
        return amount[self.moment, self.joint]

    def misfit_nm(self, theta: Floats) -> Floats:
        """(datum,) expected less observed."""
        links, terms = self.split(theta)
        out = self.columns @ links - self.observed_nm
        for accepted in (*self.given, *terms):
            out = out + self.felt(accepted.at(self.drivers))
        return out

    def residual(self, theta: Floats) -> Floats:
        return self.whitened(self.misfit_nm(theta))

    def jacobian(self, theta: Floats) -> Floats:
        parts = [self.columns]
        for a in self.split(theta)[1]:
            parts.append(self.felt(a.term.basis(self.drivers, a.inner)))
            parts += [
                self.felt(by)
                for by in a.by_inner(lambda inner, a=a: a.term.amount(self.drivers, a.coefficients, inner))
            ]
        return self.whitened(np.concatenate(parts, axis=1))


def plain_sizes(problem: TorqueProblem, terms: Sequence[Accepted]) -> tuple[Floats, ...]:
    """Of each term (coefficient,) size that would show as one sigma a moment at the joints where it acts."""
    out: list[Floats] = []
    for a in terms:
        columns = problem.whitened(problem.felt(a.term.basis(problem.drivers, a.inner)))
        acts = np.maximum(np.count_nonzero(columns, axis=0), 1)
        felt = np.sqrt(np.sum(columns**2, axis=0) / acts)
        with np.errstate(divide="ignore"):
            out.append(np.where(felt > 0.0, 1.0 / felt, np.inf))
    return tuple(out)
