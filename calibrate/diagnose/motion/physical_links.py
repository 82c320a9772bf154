"""Links that bodies can have, of links as they were fitted.

What a motion does not show of the ten numbers of a link is open, and a fit leaves it anywhere: masses below zero, too.
Of all bodies that take the same torques those near the stated ones are chosen; where none takes just the same, the
nearest by the noise of the torques. A body has a positive definite pseudo-inertia L L' with L lower triangular and a
positive diagonal. Source: Wensing, Kim, Slotine, Linear matrix inequalities for physically consistent inertial
parameter identification, IEEE RA-L 3(1), 2018; L by logarithms: Rucker, Wensing, Smooth parameterization of rigid-body
inertia, IEEE RA-L 7(2), 2022.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from calibrate.fit.solvers import solve
from calibrate.model.arms.inverse_dynamics import NUMBERS
from calibrate.model.parameters import Parameter

Floats = NDArray[np.float64]

NEAR = 0.3  # one sigma of each number of L and of each logarithm about the stated body: weak beside a thousand data
ANYWHERE = 10.0  # the same where nobody states one
TURNS = (1e-3, 1e-2, 0.1, 1.0)  # shares of what the torques know: bodies that are far off are found step by step
STEP = 1e-6
LEAST_KG, LEAST_M, LEAST_ROTOR = 1e-3, 1e-2, 1e-6
UNSTATED_KG, UNSTATED_M = 10.0, 0.1
ROWS, COLUMNS = np.tril_indices(4)
DIAGONAL = ROWS == COLUMNS


@dataclass(frozen=True, eq=False)
class BodyProblem:
    """LeastSquares over ten numbers of L for each link, and the logarithm of each rotor."""

    links: Floats  # (link number,) as fitted, rotors last
    triangle: Floats  # (row, link number) what the torques know of them, noise 1
    near: Floats  # (parameter,) the bodies to stay near
    sigma: Floats  # (parameter,) and how near

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return self._parameters

    @cached_property
    def _parameters(self) -> tuple[Parameter, ...]:
        return tuple(
            Parameter(f"body{i}", "1", float(sigma), start=float(at), prior=float(sigma))
            for i, (at, sigma) in enumerate(zip(self.near, self.sigma, strict=True))
        )

    def residual(self, theta: Floats) -> Floats:
        return self.triangle @ (numbers_of(theta, len(self.links) // (len(NUMBERS) + 1)) - self.links)

    def jacobian(self, theta: Floats) -> Floats:
        n = len(self.links) // (len(NUMBERS) + 1)
        ways = STEP * np.eye(len(theta))
        slope = [(numbers_of(theta + way, n) - numbers_of(theta - way, n)) / (2.0 * STEP) for way in ways]
        return self.triangle @ np.stack(slope, axis=1)


def physical(links: Floats, triangle: Floats, stated: Floats) -> tuple[Floats, float]:
    """(link number,) of bodies, and by how much their chi-square is above that of the links as fitted.

    `stated` (link number,) of bodies, or zeros where nobody states them.
    """
    n = len(links) // (len(NUMBERS) + 1)
    of_bodies = stated.copy()
    own = stated[n * len(NUMBERS) :] <= 0.0
    of_bodies[n * len(NUMBERS) :][own] = links[n * len(NUMBERS) :][own]
    unstated = np.concatenate([np.repeat(stated[: n * len(NUMBERS) : len(NUMBERS)] <= 0.0, len(NUMBERS)), own])
    problem = BodyProblem(links, triangle, _logarithms(of_bodies, n), np.where(unstated, ANYWHERE, NEAR))
    theta = problem.near
    for share in TURNS:
        part = replace(problem, triangle=share * triangle)
        theta = solve(part, start=theta, covariance=False, max_steps=100, tolerance=1e-3).theta
    misfit = problem.residual(theta)
    return numbers_of(theta, n), float(misfit @ misfit)


def is_physical(links: Floats) -> bool:
    """Whether bodies can have them."""
    n = len(links) // (len(NUMBERS) + 1)
    pseudo = _pseudo_inertia(links[: n * len(NUMBERS)].reshape(n, len(NUMBERS)))
    return bool(np.all(np.linalg.eigvalsh(pseudo) > 0.0) and np.all(links[n * len(NUMBERS) :] >= 0.0))


def numbers_of(theta: Floats, n: int) -> Floats:
    """(link number,) of `n` links and rotors."""
    L = np.zeros((n, 4, 4))
    values = theta[: 10 * n].reshape(n, 10)
    L[:, ROWS, COLUMNS] = np.where(DIAGONAL, np.exp(values), values)
    P = L @ np.swapaxes(L, 1, 2)
    spread = np.trace(P[:, :3, :3], axis1=1, axis2=2)[:, None, None] * np.eye(3) - P[:, :3, :3]
    tensor = spread[:, [0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
    links = np.concatenate([P[:, 3:, 3], P[:, :3, 3], tensor], axis=1)
    return np.concatenate([links.ravel(), np.exp(theta[10 * n :])])


def _pseudo_inertia(links: Floats) -> Floats:
    """(link, 4, 4) of (link, 10)."""
    tensor = links[:, [4, 7, 8, 7, 5, 9, 8, 9, 6]].reshape(-1, 3, 3)
    second = 0.5 * np.trace(tensor, axis1=1, axis2=2)[:, None, None] * np.eye(3) - tensor
    out = np.zeros((len(links), 4, 4))
    out[:, :3, :3], out[:, 3, 3] = second, links[:, 0]
    out[:, :3, 3] = out[:, 3, :3] = links[:, 1:4]
    return out


def _logarithms(stated: Floats, n: int) -> Floats:
    """(parameter,) of bodies at least as heavy and broad as any that matters."""
    links = stated[: n * len(NUMBERS)].reshape(n, len(NUMBERS)).copy()
    unstated = links[:, 0] <= 0.0
    links[unstated] = 0.0
    links[unstated, 0] = UNSTATED_KG
    mass = np.maximum(links[:, 0], LEAST_KG)
    radius = np.where(unstated, UNSTATED_M, LEAST_M)
    P = _pseudo_inertia(links)
    P[:, 3, 3] = mass
    centre = P[:, :3, 3] / mass[:, None]
    about = P[:, :3, :3] - mass[:, None, None] * centre[:, :, None] * centre[:, None, :]
    w, V = np.linalg.eigh(about)  # of a point, or of a tensor that no body has
    w = np.maximum(w, (mass * radius**2)[:, None])
    of_centre = mass[:, None, None] * centre[:, :, None] * centre[:, None]
    P[:, :3, :3] = (V * w[:, None, :]) @ np.swapaxes(V, 1, 2) + of_centre
    L = np.linalg.cholesky(P)[:, ROWS, COLUMNS]
    rotors = np.log(np.maximum(stated[n * len(NUMBERS) :], LEAST_ROTOR))
    return np.concatenate([np.where(DIAGONAL, np.log(np.where(DIAGONAL, L, 1.0)), L).ravel(), rotors])
