"""Geometry and effects as one least-squares problem under given weights, for any solver of calibrate/fit/solvers."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from calibrate.diagnose.state.assumed import Assumed
from calibrate.diagnose.state.session import Session
from calibrate.fit.noise import SharedScatter
from calibrate.model.effects.drivers import Drivers
from calibrate.model.effects.ports import Perturbation
from calibrate.model.effects.term import Accepted
from calibrate.model.parameters import Parameter
from calibrate.model.with_effects.chain import ActiveRows, Chain, ChainAt, Evaluations, columns_of
from calibrate.model.with_effects.ported_chain import look

Floats = NDArray[np.float64]
Ints = NDArray[np.intp]

LOOSE = 1e3  # times the size that would be plain to see: prior about a coefficient, so that none is ever singular


@dataclass(frozen=True, eq=False)
class EffectProblem:
    """LeastSquares over the values of a chain with effects. Rows of each instrument are those of `rows`."""

    session: Session
    chain: Chain
    rows: tuple[Ints, ...]  # of each instrument, the active ones
    whiteners: tuple[Floats, ...]  # (active row, k, k) robust weights included
    sizes: tuple[Floats, ...] = ()  # of each term (coefficient,) plain to see; inf where it does nothing
    given: int = 0  # terms, the first ones, that a model brought along: to a search they are geometry
    assumed: Assumed | None = None  # what that model states of the values
    shared: SharedScatter | None = None  # scatter that instruments have in common; a weight, too
    known: Evaluations = field(default_factory=Evaluations)

    @property
    def terms(self) -> tuple[Accepted, ...]:
        return self.chain.terms

    @property
    def drivers(self) -> Drivers | None:
        return self.chain.drivers

    def under(self, whiteners: tuple[Floats, ...], shared: SharedScatter | None = None) -> "EffectProblem":
        """The same with other weights: what was computed last without weights is kept."""
        return replace(self, whiteners=whiteners, shared=shared)

    def refreshed(self, drivers: Drivers) -> "EffectProblem":
        """The same with other drivers."""
        if drivers is self.drivers:
            return self
        return replace(self, chain=replace(self.chain, drivers=drivers), known=self.known.of_other_drivers())

    def of_session(self, session: Session) -> "EffectProblem":
        """The same effects and weights in a session of other readings or priors."""
        chain = session.chain(self.terms, self.drivers)
        return replace(self, session=session, chain=chain, known=Evaluations())

    def with_rows(self, rows: tuple[Ints, ...], whiteners: tuple[Floats, ...]) -> "EffectProblem":
        return replace(self, rows=rows, whiteners=whiteners, known=Evaluations())

    def forgetting(self) -> "EffectProblem":
        """The same; derivatives are computed where they are asked for next."""
        return replace(self, known=self.known.anew())

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return self._parameters

    @cached_property
    def _parameters(self) -> tuple[Parameter, ...]:
        out = list(self.session.parameters)
        for i, accepted in enumerate(self.terms):
            out += [
                Parameter(f"term{i}.c{j}", "1", s, start=0.0, prior=LOOSE * s, free=bool(np.isfinite(s)))
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
        """(parameter,) index of the term that it belongs to, those given not counted, -1: geometry or given."""
        out = [np.full(len(self.session.parameters), -1, dtype=np.intp)]
        for i, accepted in enumerate(self.terms):
            out.append(np.full(len(accepted.values), max(i - self.given, -1), dtype=np.intp))
        return np.concatenate(out)

    def from_geometry(self, geometry: Floats) -> Floats:
        """(value,) these of geometry, and those that the terms came with."""
        return np.concatenate([geometry, self.chain.of_effects])

    def split(self, values: Floats) -> tuple[Floats, tuple[Accepted, ...]]:
        """Geometry (param,), and the terms with these values."""
        return self.chain.split(values)

    def around(self, values: Floats) -> ChainAt:
        """Frames and readings at these values."""
        return self.chain.at(values, self.known)

    def residual(self, theta: Floats) -> Floats:
        at, geometry = self.around(theta), theta[: len(self.session.parameters)]
        misfits = [e - m.problem.observed for m, e in zip(self.session.measured, at.expected, strict=True)]
        each = zip(self.apart(misfits), self.rows, self.whiteners, strict=True)
        parts = [np.einsum("nij,nj->ni", W, misfit[rows]).ravel() for misfit, rows, W in each]
        joint, first = self.session.weighting.unweighted, len(self.session.measured)
        parts += [
            block.residual(joint.of_block(first + i, geometry)) for i, block in enumerate(self.session.weighting.known)
        ]
        parts += [] if self.assumed is None else [self.assumed.residual(theta)]
        return np.concatenate(parts)

    def jacobian(self, theta: Floats) -> Floats:
        """By derivatives that were kept, where these values are near them."""
        slopes = self.slopes(theta)
        each = (
            self.whitened(slopes)
            if self._active.few is None
            else [W @ c for W, c in zip(self.whiteners, slopes, strict=True)]
        )
        parts = [whitened.reshape(-1, whitened.shape[-1]) for whitened in each]
        joint, geometry = self.session.weighting.unweighted, theta[: len(self.session.parameters)]
        extra = len(theta) - len(geometry)
        for i, block in enumerate(self.session.weighting.known, start=len(self.session.measured)):
            known = joint.spread(i, block.jacobian(joint.of_block(i, geometry)))
            parts.append(np.concatenate([known, np.zeros((len(known), extra))], axis=1))
        parts += [] if self.assumed is None else [self.assumed.jacobian(len(theta))]
        return np.concatenate(parts)

    def slopes(self, theta: Floats) -> list[Floats]:
        """Of each instrument (row, k, value) without weights, of its active rows alone where samples are few."""
        return self.chain.slopes(theta, self._active, self.known)

    @cached_property
    def _active(self) -> ActiveRows:
        return ActiveRows(self.session.measured, self.rows, len(self.session.samples))

    def apart(self, parts: Sequence[Floats]) -> list[Floats]:
        """Rows (row, k, ...) of every instrument less what they share with those of the second encoders."""
        return list(parts) if self.shared is None else self.shared.apart(parts)

    def whitened(self, columns: Sequence[Floats]) -> list[Floats]:
        """Of each instrument's active rows (active row, k, m), from columns (row, k, m) of all of them."""
        return [W @ c[rows] for W, c, rows in zip(self.whiteners, self.apart(columns), self.rows, strict=True)]


def plain_sizes(
    session: Session,
    terms: Sequence[Accepted],
    drivers: Drivers | None,
    whiteners: Sequence[Floats],
    rows: Sequence[Ints],
) -> tuple[Floats, ...]:
    """Of each term (coefficient,) size that would show as one sigma per observation; inf where it does nothing.

    At the session's drawing: good enough for a size.
    """
    if not terms or drivers is None:
        return ()
    frames, joint = drivers.frames, session.weighting.unweighted
    looks = tuple(look(m, joint.of_block(i, session.start), frames) for i, m in enumerate(session.measured))
    at = ChainAt(Perturbation.none(len(frames), session.arm.n_joints), frames, looks, ())
    out: list[Floats] = []
    for accepted in terms:
        basis = accepted.term.basis(drivers, accepted.inner)
        columns = columns_of(session.measured, accepted.term.port, basis, at)
        seen = [(W @ c[r]).reshape(-1, c.shape[-1]) for c, r, W in zip(columns, rows, whiteners, strict=True)]
        felt = np.sqrt(np.mean(np.concatenate(seen) ** 2, axis=0))
        with np.errstate(divide="ignore"):
            out.append(np.where((felt > 0.0) & np.any(basis != 0.0, axis=(0, 1)), 1.0 / felt, np.inf))
    return tuple(out)
