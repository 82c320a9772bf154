"""The usual form of a term: functions of drivers, one column each, along fixed directions of the port."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from calibrate.model.effects.drivers import Drivers
from calibrate.model.effects.ports import Place, Port
from calibrate.model.effects.term import Size, Term, plain

Floats = NDArray[np.float64]
Functions = Callable[[Drivers, Floats], Floats]  # (pose, m) or (pose, width, m) for inner values (inner,)
# (pose, 1 or width) for coefficients (m,) and inner values (inner,)
Exact = Callable[[Drivers, Floats, Floats], Floats]

Believable = Callable[[Floats, Floats], bool]  # of coefficients (m,) and inner values (inner,)

NOISE_ALLOWS = 30.0  # times the data's own noise: a coarse machine may be worse than a limit for good ones


@dataclass(frozen=True)
class Form(Term):
    """`names` of the coefficients with units; `limit` of what they may add at the port, rad or m or relative."""

    function: Functions = field(kw_only=True)
    names: tuple[str, ...] = field(kw_only=True)
    limit: float = field(kw_only=True)
    sentence: str = field(kw_only=True)  # with {name} for sizes, in the units of `names`
    reversed_sentence: str = field(kw_only=True, default="")  # where the first size is below zero, of its opposite
    directions: Floats | None = field(kw_only=True, default=None)  # (width, d); None: the function has its own
    about: Callable[[Drivers], Floats] | None = field(kw_only=True, default=None)  # directions that follow the session
    polar: bool = field(kw_only=True, default=False)  # coefficients are (sine, cosine): reported as amplitude, phase
    exact: Exact | None = field(kw_only=True, default=None)  # where `function` is the first order only
    believable: Believable | None = field(kw_only=True, default=None)  # what is more than a limit of size

    def basis(self, drivers: Drivers, inner: Floats) -> Floats:
        values, directions = self.function(drivers, inner), self.along(drivers)
        if directions is None:
            return values
        product = np.einsum("nm,wd->nwmd", values, directions)
        return product.reshape(len(values), len(directions), -1)

    def along(self, drivers: Drivers) -> Floats | None:
        """(width, d) directions of the port; None where the function has its own at each pose."""
        return self.directions if self.about is None else self.about(drivers)

    def amount(self, drivers: Drivers, coefficients: Floats, inner: Floats) -> Floats:
        if self.exact is None:
            return self.basis(drivers, inner) @ coefficients
        values = self.exact(drivers, coefficients, inner)
        return values if self.directions is None else values @ self.directions.T

    def sizes(self, coefficients: Floats, covariance: Floats, inner: Floats, inner_sigma: Floats) -> Mapping[str, Size]:
        sigma = np.sqrt(np.maximum(np.diag(covariance), 0.0))
        out = _polar(self.names, coefficients, covariance) if self.polar else _plain(self.names, coefficients, sigma)
        for spec, value, doubt in zip(self.inner, inner, inner_sigma, strict=True):
            out[spec.name] = Size(float(value), float(doubt))
        return out

    def plausible(self, coefficients: Floats, inner: Floats, noise_rad: float) -> bool:
        if self.believable is not None and not self.believable(coefficients, inner):
            return False
        return bool(np.max(np.abs(coefficients), initial=0.0) <= max(self.limit, NOISE_ALLOWS * noise_rad))

    def of_a_difference(self) -> "Form":
        """The same where it may be of either sign: one of two recordings has more of it."""
        if (one := self.believable) is None:
            return self

        def either(values: Floats, inner: Floats) -> bool:
            return one(values, inner) or one(-values, inner)

        return replace(self, believable=either)

    def says(self, sizes: Mapping[str, Size]) -> str:
        sentence, (first, *_) = self.sentence, self.names
        if self.reversed_sentence and first in sizes and sizes[first].value < 0.0:
            sentence = self.reversed_sentence
            sizes = {**sizes, first: Size(-sizes[first].value, sizes[first].sigma)}
        return sentence.format(**{name: plain(name, size) for name, size in sizes.items()})


def at_joint(joint: int, n_joints: int) -> tuple[Port, Floats]:
    """Port and direction of an error of one joint's angle."""
    direction = np.zeros((n_joints, 1))
    direction[joint - 1] = 1.0
    return Port(f"joint{joint}.angle", Place.JOINTS), direction


def _plain(names: tuple[str, ...], values: Floats, sigma: Floats) -> dict[str, Size]:
    return {name: Size(float(v), float(s)) for name, v, s in zip(names, values, sigma, strict=True)}


def _polar(names: tuple[str, ...], values: Floats, covariance: Floats) -> dict[str, Size]:
    """Of a sin x + b cos x = A sin(x + phase): amplitude, phase, with first-order sigmas."""
    a, b = values
    amplitude = float(np.hypot(a, b))
    by = np.array([[a, b], [-b / max(amplitude, 1e-300), a / max(amplitude, 1e-300)]]) / max(amplitude, 1e-300)
    told = bool(np.isfinite(np.diag(covariance)).all())
    sigma = np.sqrt(np.maximum(np.diag(by @ covariance @ by.T), 0.0)) if told else np.full(2, np.inf)
    return {
        names[0]: Size(amplitude, float(sigma[0])),
        names[1]: Size(float(np.arctan2(b, a)), float(min(sigma[1], np.pi)) if told else np.inf),
    }
