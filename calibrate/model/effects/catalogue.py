"""All effects, one line each, and those of installed packages; tests/model/effects checks every one by law."""

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from calibrate import plug_ins
from calibrate.model.effects import (
    arm_thermal_growth,
    axis_wobble,
    backlash,
    base_compliance,
    base_moved,
    device_drift,
    device_periodic,
    device_scale,
    encoder_eccentricity,
    encoder_harmonic,
    encoder_slip,
    fixture_moved,
    gear_ratio_error,
    gear_transmission_error,
    hand_force,
    joint_compliance,
    joint_coupling,
    laser_moved,
    laser_thermal_drift,
    laser_warm_up,
    latency,
    link_bending,
    link_thermal_growth,
    not_settled,
    open_at_frames,
    open_at_joints,
    open_at_readouts,
    open_by_columns,
    payload_compliance,
    psd_ambient_light,
    psd_cover_glass,
    psd_gain,
    psd_nonlinearity,
    reading_lag,
    seat_moved,
    tool_moved,
    tool_sag,
)
from calibrate.model.effects.drivers import Drivers
from calibrate.model.effects.kind import Kind
from calibrate.model.effects.second_encoders import at_second_encoders
from calibrate.model.effects.term import (
    Effect,
    Form,
    Functions,
    Holds,
    Missing,
    Term,
)
from calibrate.plug_ins import loaded

Floats = NDArray[np.float64]

EFFECTS: tuple[Effect, ...] = (
    encoder_eccentricity.EFFECT,
    encoder_harmonic.EFFECT,
    gear_transmission_error.EFFECT,
    gear_ratio_error.EFFECT,
    joint_coupling.EFFECT,
    joint_compliance.EFFECT,
    hand_force.EFFECT,
    payload_compliance.EFFECT,
    backlash.EFFECT,
    reading_lag.EFFECT,
    not_settled.EFFECT,
    latency.EFFECT,
    encoder_slip.EFFECT,
    axis_wobble.EFFECT,
    link_bending.EFFECT,
    link_thermal_growth.EFFECT,
    arm_thermal_growth.EFFECT,
    base_compliance.EFFECT,
    device_drift.EFFECT,  # before base-moved: alike to every reading, and a tripod gives way before a bolted base,
    fixture_moved.EFFECT,  # as does what is carried about
    base_moved.EFFECT,
    tool_sag.EFFECT,
    tool_moved.EFFECT,
    laser_moved.EFFECT,
    laser_warm_up.EFFECT,
    laser_thermal_drift.EFFECT,
    psd_gain.EFFECT,
    psd_nonlinearity.EFFECT,
    psd_ambient_light.EFFECT,
    psd_cover_glass.EFFECT,
    seat_moved.EFFECT,
    device_scale.EFFECT,
    device_periodic.EFFECT,
    open_at_joints.EFFECT,
    open_at_frames.EFFECT,
    open_at_readouts.EFFECT,
    open_by_columns.EFFECT,
    *loaded(plug_ins.EFFECTS, Kind),
)


def terms_of(drivers: Drivers) -> tuple[Term, ...]:
    """Every place and form that the catalogue knows and this session allows."""
    listed = tuple(term for effect in EFFECTS for term in effect.terms(drivers))
    return (*listed, *at_second_encoders(listed, drivers))


@dataclass(frozen=True, eq=False)
class Listed:
    """The catalogue at one set of drivers: states of a search share it as long as their drivers are the same."""

    drivers: Drivers
    values: dict[tuple[Functions, bytes], Floats] = field(default_factory=dict[tuple[Functions, bytes], Floats])

    @cached_property
    def terms(self) -> tuple[Term, ...]:
        """All that the session allows."""
        return terms_of(self.drivers)

    def function(self, term: Form, inner: Floats) -> Floats:
        """(sample, m) along each direction of a term; kept where a menu asks for it and it is dear."""
        if not all(value in spec.grid for value, spec in zip(inner, term.inner, strict=False)):
            return term.function(self.drivers, inner)
        key = (term.function, inner.tobytes())
        if key not in self.values:
            self.values[key] = term.function(self.drivers, inner)
        return self.values[key]


def missing_of(drivers: Drivers) -> tuple[Missing, ...]:
    """What was not recorded and would let an effect be found."""
    return tuple(m for effect in EFFECTS for m in effect.missing(drivers))


def holds_of(term: Term) -> Holds:
    """Whether a term is true of the machine, or of the session that it was found in: all that follows the clock is."""
    by_clock = term.slow or "t" in term.depends_on
    of_session = any(e.physics == term.physics and e.holds is Holds.SESSION for e in EFFECTS)
    return Holds.SESSION if by_clock or of_session else Holds.ALWAYS
