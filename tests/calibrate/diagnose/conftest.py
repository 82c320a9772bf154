"""A session that is exactly linear: plain matrices, so that what the statistics should say is known in closed form."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import cast

import numpy as np
import pytest
from numpy.typing import NDArray

from acquisition.recording.rig import Rig
from calibrate.diagnose import limits
from calibrate.diagnose.state.linearised import UnseenMisfits, WhitenedRows
from calibrate.model.effects.drivers import Drivers
from calibrate.model.effects.ports import Place, Port
from calibrate.model.effects.term import (
    Accepted,
    Inner,
    Shape,
    Size,
    Term,
)

Floats = NDArray[np.float64]

NU = 5.0
JOINTS = 4


@dataclass(frozen=True)
class Plain(Term):
    """Coefficients at one joint, columns by the word of its shape."""

    joint: int = 0
    limit: float = np.inf

    def basis(self, drivers, inner):
        out = np.zeros((len(drivers.t_s), drivers.n_joints, 0))
        columns = np.stack(self._columns(drivers, inner), axis=-1)
        out = np.zeros((*drivers.q_rad.shape, columns.shape[-1]))
        out[:, self.joint] = columns
        return out

    def _columns(self, drivers, inner):
        name = self.depends_on[0]
        t = drivers.t_s
        values = t if name == "t" else drivers.extra.get(name)
        if name.startswith("approach"):
            values = drivers.approach[:, int(name[8:]) - 1]
        elif name.startswith("q"):
            values = drivers.q_rad[:, int(name[1:]) - 1]
        match self.shape:
            case Shape.HARMONIC:
                return [np.cos(self.order * values), np.sin(self.order * values)]
            case Shape.EXPONENTIAL:
                return [1.0 - np.exp(-t / inner[0])]
            case Shape.STEP:
                return [(t > inner[0]).astype(float)]
            case Shape.SMOOTH:
                u = (values - values.min()) / np.ptp(values)
                return [np.cos(np.pi * k * u) for k in range(1, 7)]
            case _:
                return [values]

    def sizes(self, coefficients, covariance, inner, inner_sigma) -> Mapping[str, Size]:
        sigma = np.sqrt(np.diag(covariance))
        return {f"c{i}": Size(float(c), float(s)) for i, (c, s) in enumerate(zip(coefficients, sigma, strict=True))}

    def plausible(self, coefficients, inner, noise_rad):
        return bool(np.all(np.abs(coefficients) < self.limit))

    def says(self, sizes):
        return f"joint {self.joint + 1}: {self.physics}"


def catalogue(t_end: float) -> tuple[Term, ...]:
    out: list[Term] = []
    for i in range(JOINTS):
        port = Port(f"joint{i + 1}.angle", Place.JOINTS)
        own = (f"q{i + 1}",)
        out += [
            Plain(port, own, Shape.HARMONIC, "encoder-eccentricity", 1, joint=i),
            Plain(port, own, Shape.HARMONIC, "encoder-harmonic", 2, joint=i),
            Plain(port, (f"approach{i + 1}",), Shape.SIGN, "backlash", joint=i),
            Plain(port, own, Shape.SMOOTH, "unknown", joint=i, open=True),
        ]
        tau = Inner("time_constant_s", tuple(t_end * np.array([0.05, 0.15, 0.4, 1.0])), 0.02 * t_end, 3.0 * t_end)
        when = Inner("time_s", tuple(t_end * np.linspace(0.05, 0.95, 25)), 0.02 * t_end, 0.98 * t_end, discrete=True)
        out += [
            Plain(port, ("t",), Shape.EXPONENTIAL, "link-thermal-growth", inner=(tau,), slow=True, joint=i),
            Plain(port, ("t",), Shape.STEP, "encoder-slip", inner=(when,), slow=True, joint=i),
            Plain(port, ("fan",), Shape.LINEAR, "unknown", joint=i),
        ]
        for j in range(JOINTS):
            if j != i:
                out.append(Plain(port, (f"q{j + 1}",), Shape.LINEAR, "joint-coupling", joint=i))
                out.append(Plain(port, (f"q{j + 1}",), Shape.HARMONIC, "axis-wobble", 1, joint=i))
    return tuple(out)


@dataclass(frozen=True, eq=False)
class LinearSession:
    """Implements State: readings = geometry @ theta + lever x terms + noise."""

    drivers: Drivers
    lever: Floats  # (sample, k, joint)
    geometry: Floats  # (sample, k, param)
    readings: Floats  # (sample, k)
    terms: tuple[Term, ...]
    active: NDArray[np.intp]
    accepted: tuple[Accepted, ...] = ()
    weights: Floats | None = None
    theta: Floats | None = None
    sigma: float = 1.0

    @property
    def samples(self) -> int:
        return len(self.active)

    @property
    def most_search_rows(self) -> int:
        return limits.MOST_SEARCH_ROWS

    @property
    def distrusted(self) -> int:
        return int(np.sum(self.weights < 0.3))

    def trusting(self) -> "LinearSession":
        return replace(self, weights=np.ones(len(self.active)))

    def renewed(self) -> "LinearSession":
        return self  # its drivers follow nothing that is fitted

    def _design(self, accepted) -> Floats:
        parts = [self.geometry]
        for a in accepted:
            parts.append(self.lever @ a.term.basis(self.drivers, a.inner))
            for j, spec in enumerate(a.term.inner):
                if not spec.discrete:
                    parts.append(self.lever @ self._by_inner(a, j)[..., None])
        return np.concatenate(parts, axis=-1)

    def _by_inner(self, a: Accepted, j: int) -> Floats:
        step = np.zeros(len(a.inner))
        step[j] = 1e-4 * (a.term.inner[j].upper - a.term.inner[j].lower)
        up, down = a.term.basis(self.drivers, a.inner + step), a.term.basis(self.drivers, a.inner - step)
        return (up - down) @ a.coefficients / (2.0 * step[j])

    def fitted(self) -> "LinearSession":
        return self.refitted(())

    def refitted(self, accepted: Sequence[Accepted]) -> "LinearSession":
        w, sigma, theta = np.ones(len(self.active)), 1.0, np.zeros(0)
        y = self.readings[self.active]
        X = np.concatenate(
            [self.geometry, *(self.lever @ a.term.basis(self.drivers, a.inner) for a in accepted)], axis=-1
        )
        X = X[self.active]
        k, p = y.shape[1], X.shape[-1]
        for _ in range(15):
            A = (np.sqrt(w)[:, None, None] * X).reshape(-1, p) / sigma
            prior = np.concatenate([np.full(self.geometry.shape[-1], 1e-3), np.full(p - self.geometry.shape[-1], 1e-9)])
            theta = np.linalg.solve(A.T @ A + np.diag(prior), A.T @ ((np.sqrt(w)[:, None] * y).ravel() / sigma))
            square = np.sum((y - X @ theta) ** 2, axis=1)
            sigma = np.sqrt(np.sum(w * square) / (len(y) * k - p))
            w = (NU + k) / (NU + square / sigma**2)
        at, out = self.geometry.shape[-1], []
        for a in accepted:
            out.append(Accepted(a.term, theta[at : at + len(a.coefficients)], a.inner))
            at += len(a.coefficients)
        return replace(self, accepted=tuple(out), weights=w, theta=theta, sigma=float(sigma))

    @cached_property
    def _misfit(self) -> Floats:
        full = np.concatenate(
            [self.geometry, *(self.lever @ a.term.basis(self.drivers, a.inner) for a in self.accepted)], axis=-1
        )
        return self.readings - full @ self.theta

    @cached_property
    def rows(self) -> WhitenedRows:
        g = self.geometry.shape[-1]
        scale = np.sqrt(self.weights)[:, None] / self.sigma
        residual = (scale * self._misfit[self.active]).ravel()
        design = self._design(self.accepted)[self.active]
        k, p = design.shape[1:]
        slope = (scale[..., None] * design).reshape(-1, p)
        owner = np.full(p, -1)
        at = g
        for i, a in enumerate(self.accepted):
            m = len(a.coefficients) + sum(not s.discrete for s in a.term.inner)
            owner[at : at + m], at = i, at + m
        priors = np.zeros((g, p))
        priors[range(g), range(g)] = np.sqrt(1e-3)
        none = np.full(g, -1)
        return WhitenedRows(
            np.concatenate([residual, -np.sqrt(1e-3) * self.theta[:g]]),
            np.concatenate([slope, priors]),
            np.concatenate([np.repeat(self.active, k), none]),
            np.concatenate([np.repeat(np.arange(len(self.active)), k), none]),
            np.concatenate([np.zeros(len(self.active) * k, dtype=int), none]),
            owner,
        )

    @cached_property
    def minus_two_log_likelihood(self) -> float:
        square, k = np.sum(self._misfit[self.active] ** 2, axis=1), self.readings.shape[1]
        each = 2.0 * k * np.log(self.sigma) + (NU + k) * np.log1p(square / self.sigma**2 / NU)
        g = self.theta[: self.geometry.shape[-1]]
        return float(np.sum(each) + 1e-3 * g @ g)

    def columns(self, term: Term, inner: Floats) -> Floats:
        scale = np.sqrt(self.weights)[:, None, None] / self.sigma
        data = scale * (self.lever @ term.basis(self.drivers, inner))[self.active]
        return np.concatenate([data.reshape(-1, data.shape[-1]), np.zeros((self.geometry.shape[-1], data.shape[-1]))])

    def columns_at(self, term: Term, inner: Sequence[Floats]) -> Floats:
        return np.stack([self.columns(term, one).T for one in inner])

    def candidates(self) -> Sequence[Term]:
        return self.terms

    def select(self, samples) -> "LinearSession":
        chosen = np.sort(samples)
        return replace(self, active=chosen, weights=self.weights[np.searchsorted(self.active, chosen)])

    def held_out(self, samples) -> tuple[UnseenMisfits, ...]:
        misfit = self._misfit[np.sort(samples)]
        return (UnseenMisfits("linear", np.sort(samples), misfit, misfit / self.sigma),)


@dataclass(frozen=True)
class World:
    """Makes linear sessions with chosen physics and noise."""

    samples: int = 200
    channels: int = 4

    def session(self, rng, truth=(), noise="white", ranges=(3.0, 2.5, 2.0, 3.0), extra=None) -> LinearSession:
        n, k = self.samples, self.channels
        q = rng.uniform(-1.0, 1.0, (n, JOINTS)) * np.array(ranges)
        t = np.sort(rng.uniform(0.0, 30.0 * n, n))
        repeat = np.full(n, -1)
        for group in range(10):
            members = rng.choice(np.flatnonzero(repeat < 0), 4, replace=False)
            repeat[members] = group
            q[members] = q[members[0]]
        drivers = Drivers(
            rig=cast(Rig, None),
            q_rad=q,
            t_s=t,
            frames=np.zeros((n, JOINTS + 1, 4, 4)),
            readouts={},
            approach=rng.integers(0, 2, (n, JOINTS)) * 2.0 - 1.0,
            approach_derived=False,
            last_move_rad=np.zeros((n, JOINTS)),
            qd_rad_s=None,
            cmd_minus_q_rad=None,
            temperatures_degC={},
            payload_kg=None,
            payload_com_m=None,
            psd_sum_v=None,
            extra={"fan": rng.normal(size=n)} if extra is None else extra,
            repeat=repeat,
        )
        features = np.concatenate([np.ones((n, 1)), np.cos(q), np.sin(q), np.cos(q[:, :2] + q[:, 2:])], axis=1)
        lever = np.einsum("nf,fkj->nkj", features, rng.normal(size=(features.shape[1], k, JOINTS))) / 3.0
        # Geometry: zeros of every joint, and any smooth combination that a link could make.
        other = np.einsum("nf,fkp->nkp", features, rng.normal(size=(features.shape[1], k, 14)))
        geometry = np.concatenate([lever, other, np.broadcast_to(np.eye(k), (n, k, k))], axis=2)
        terms = catalogue(float(t[-1]))
        y = geometry @ rng.normal(size=geometry.shape[2]) + self.noise(rng, noise, n, k)
        blank = LinearSession(drivers, lever, geometry, y, terms, np.arange(n), weights=np.ones(n))
        for basis, enr in truth:
            y = y + enr * self.visible(blank, basis(drivers))
        return replace(blank, readings=y).fitted()

    @staticmethod
    def with_readings(session, readings) -> LinearSession:
        return replace(session, readings=readings).fitted()

    @staticmethod
    def noise(rng, kind, n, k):
        if kind == "heavy":
            z = rng.standard_t(3.0, (n, k))
            return np.where(rng.random((n, 1)) < 0.02, 15.0 * z, z)
        z = rng.standard_normal((n, k))
        if kind == "wander":
            slow = rng.standard_normal((n, k))
            for i in range(1, n):
                slow[i] = 0.95 * slow[i - 1] + np.sqrt(1 - 0.95**2) * slow[i]
            return z + 0.7 * slow
        return z

    @staticmethod
    def visible(session, at_joints):
        """(sample, k) effect of (sample, joint), scaled so that what geometry cannot absorb has rms 1."""
        effect = np.einsum("nkj,nj->nk", session.lever, at_joints)
        G = session.geometry.reshape(-1, session.geometry.shape[-1])
        left = effect.ravel() - G @ np.linalg.lstsq(G, effect.ravel(), rcond=None)[0]
        return effect / np.sqrt(np.mean(left**2))

    @staticmethod
    def at_joint(joint, function):
        """Basis of a truth: function(drivers) (sample,) at one joint, counted from 1."""

        def basis(drivers):
            out = np.zeros(drivers.q_rad.shape)
            out[:, joint - 1] = function(drivers)
            return out

        return basis


@pytest.fixture(scope="session")
def world() -> World:
    return World()
