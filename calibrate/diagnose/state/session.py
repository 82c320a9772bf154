"""A session as the diagnosis sees it: instruments with priors about all geometry, so that nothing is singular.

Drawings hold what data cannot see; where a rig states no tolerance, wide priors stand in. They are no opinion about
well-seen parameters, but keep cones, which hold no scale, from shrinking the arm.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import msgspec
import numpy as np
from numpy.typing import NDArray

from acquisition.recording import Samples
from acquisition.recording.rig import Rig, Tolerance
from calibrate.diagnose import limits
from calibrate.fit.instruments import instruments_of
from calibrate.fit.weighting import Weighting
from calibrate.model.arms.catalogue import arm_of
from calibrate.model.arms.link_tolerance import LinkTolerance
from calibrate.model.arms.serial import SerialArm
from calibrate.model.default_tolerance import PAIR, SCALELESS, WIDE
from calibrate.model.effects.conditions import conditions_of, temperatures_of, uncoupled_samples
from calibrate.model.effects.drivers import Conditions, Drivers, Readout
from calibrate.model.effects.term import Accepted
from calibrate.model.parameters import Parameter
from calibrate.model.problem import Measured
from calibrate.model.sensors.catalogue import SENSORS, names_with
from calibrate.model.sensors.kind import Trait
from calibrate.model.with_effects.chain import Chain
from calibrate.model.with_effects.driver_values import readout_at

Floats = NDArray[np.float64]
Ints = NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class Session:
    """All instruments of a session over all its samples."""

    rig: Rig
    samples: Samples
    arm: SerialArm
    weighting: Weighting
    start: Floats  # (param,)
    stated: frozenset[str] = frozenset()  # parameters of which a model has a covariance: no other prior

    @property
    def measured(self) -> tuple[Measured, ...]:
        return self.weighting.measured

    def chain(self, terms: Sequence[Accepted] = (), drivers: Drivers | None = None) -> Chain:
        """Of all its samples, with these effects at these drivers."""
        unknowns = self.weighting.unweighted.unknowns
        return Chain(self.arm, self.samples.joints(), self.measured, unknowns, tuple(terms), drivers)

    @cached_property
    def conditions(self) -> Conditions:
        """That its samples were taken under."""
        return conditions_of(uncoupled_samples(self.rig.arm, self.samples), temperatures_of(self.samples))

    @cached_property
    def parameters(self) -> tuple[Parameter, ...]:
        """Geometry, every free one with a prior."""
        each = (replace(p, prior=np.inf) if p.name in self.stated else _assumed(p) for p in self.weighting.parameters)
        return tuple(each)


def session_of(rig: Rig, samples: Samples) -> Session:
    """The session of a table of samples without gross errors. DataError where it holds no observation."""
    link_prior = _link_prior(rig, samples)
    arm = arm_of(rig, link_prior)
    found = instruments_of(samples, _with_priors(rig, link_prior), arm=arm, asked=names_with(Trait.BETWEEN_ENCODERS))
    return Session(rig, samples, arm, found.weighting, found.start)


def _link_prior(rig: Rig, samples: Samples) -> LinkTolerance | None:
    if rig.tolerance is not None:
        return None
    held = [k for k in SENSORS if Trait.TARGET in k.traits and k.columns[0] in samples]
    scaleless = held and all(Trait.SCALELESS in k.traits for k in held) and not _distances_of_points(rig)
    return SCALELESS if scaleless else WIDE


def _distances_of_points(rig: Rig) -> bool:
    return any(distance.of != "placement" for distance in rig.known_distances)


def _with_priors(rig: Rig, link_prior: LinkTolerance | None) -> Rig:
    """The rig with a prior about the detectors' bracket, where none is stated.

    Gains are held unless the rig leaves them open: they are then a cause to be named.
    """
    stated = rig.tolerance
    if stated is None:
        links = WIDE if link_prior is None else link_prior
        stated = Tolerance(length_m=links.length_sigma_m, angle_rad=links.angle_sigma_rad)
    if stated.psd2_m is None or stated.psd2_rad is None:
        stated = msgspec.structs.replace(stated, psd2_m=PAIR.length_sigma_m, psd2_rad=PAIR.angle_sigma_rad)
    return msgspec.structs.replace(rig, tolerance=stated)


def _assumed(p: Parameter) -> Parameter:
    return p if not p.free or np.isfinite(p.prior) else replace(p, prior=limits.GAUGE * p.plausible)


def drivers_of(session: Session, frames: Floats, expected: Mapping[str, Floats], own: Mapping[str, Floats]) -> Drivers:
    """At frames (sample, joint + 1, 4, 4) and expected readings (row, k) of each instrument, with the values of its own
    parameters.
    """
    readouts = {m.name: _readout(m, expected[m.name], own[m.name], frames) for m in session.measured}
    return Drivers(**vars(session.conditions), rig=session.rig, frames=frames, readouts=readouts)


def _readout(measured: Measured, expected: Floats, own: Floats, frames: Floats) -> Readout:
    chain = measured.problem.chain
    phi = own[len(chain.model.parameters) :]
    return readout_at(measured.name, chain.sensor, phi, expected, measured.sample_rows[:, -1], frames)
