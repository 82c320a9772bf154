"""Torques of rigid links and of terms beside them as one least-squares problem, for the solvers of calibrate/fit."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from calibrate.diagnose.motion.link_prior import LinkPrior
from calibrate.model.effects.term import Accepted
from calibrate.model.effects.torque import MotionDrivers
from calibrate.model.parameters import Parameter

Floats = NDArray[np.float64]
Ints = NDArray[np.intp]

LOOSE = 1e3  # times the size that would be plain to see: prior about a coefficient, so that none is ever singular


@dataclass(frozen=True, eq=False)
class TorqueProblem:
    """LeastSquares. A datum is the torque of one joint at one moment."""

    links: LinkPrior
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
        out = list(self.links.parameters)
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
        return np.concatenate([np.full(self.links.size, -1, dtype=np.intp), *each])

    def split(self, theta: Floats) -> tuple[Floats, tuple[Accepted, ...]]:
        """Numbers of the links, and the terms with these values."""
        at, out = self.links.size, list[Accepted]()
        for a in self.terms:
            m, inner = len(a.coefficients), a.inner.copy()
            smooth = a.term.smooth
            inner[smooth] = theta[at + m : at + m + len(smooth)]
            out.append(Accepted(a.term, theta[at : at + m], inner))
            at += m + len(smooth)
        return self.links.numbers(theta[: self.links.size]), tuple(out)

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
        parts = [self.columns @ self.links.ways]
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
