"""Joint scale: a gear ratio entered wrong, or an encoder whose counts are not those stated."""

from calibrate.model.effects.drivers import Drivers
from calibrate.model.effects.kind import Kind
from calibrate.model.effects.term import Floats, Form, Shape, Term, at_joint

LIMIT_RAD_PER_RAD = 0.05


def _terms(drivers: Drivers) -> tuple[Term, ...]:
    """Only where there is a gear: without one a slope over a short sweep is part of an eccentricity."""
    return tuple(
        _term(drivers, joint)
        for joint, link in enumerate(drivers.rig.arm.joints, start=1)
        if link.gear_ratio is not None
    )


def _term(drivers: Drivers, joint: int) -> Term:
    port, direction = at_joint(joint, drivers.n_joints)

    def function(drivers: Drivers, inner: Floats) -> Floats:
        return drivers.q_rad[:, joint - 1 : joint]

    return Form(
        port,
        (f"q{joint}",),
        Shape.LINEAR,
        "gear-ratio-error",
        function=function,
        names=("scale_error_rad_per_rad",),
        limit=LIMIT_RAD_PER_RAD,
        sentence=(
            f"Joint {joint} turns {{scale_error_rad_per_rad}} more than its encoder reads: gear ratio or encoder scale"
        ),
        directions=direction,
    )


EFFECT = Kind(
    "gear-ratio-error",
    "The ratio between motor and joint is not the one the controller computes with.",
    ("encoder-eccentricity", "joint-compliance"),
    "mismatch catalogue: joint scale c q",
    _terms,
)
