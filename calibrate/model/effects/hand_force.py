"""A probe pressed by hand: the joints of an articulated arm yield to a force that is steady in the tool's axes."""

import numpy as np

from calibrate.model.effects.drivers import Drivers
from calibrate.model.effects.gravity import point_of
from calibrate.model.effects.kind import Kind
from calibrate.model.effects.term import Floats, Form, Shape, Term, at_joint
from calibrate.model.rigid import cross
from calibrate.model.sensors.kind import Trait

FORCE_N = 10.0  # columns are for the hand's usual push; ISO 10360-12:2016 lets the maker state it
LIMIT_RAD_NM = 1e-3  # as joint_compliance


def _terms(drivers: Drivers) -> tuple[Term, ...]:
    if not drivers.having(Trait.TOUCHED):
        return ()
    return tuple(_term(drivers, joint) for joint in range(1, drivers.n_joints))


def _term(drivers: Drivers, joint: int) -> Term:
    port, direction = at_joint(joint, drivers.n_joints)
    point = drivers.rig.tool.point_m or (0.0, 0.0, 0.0)

    def function(drivers: Drivers, inner: Floats) -> Floats:
        before, flange = drivers.frames[:, joint - 1], drivers.frames[:, -1]
        lever = point_of(drivers, drivers.n_joints, point) - before[:, :3, 3]
        pushes = [cross(lever, flange[:, :3, k]) for k in range(3)]
        return FORCE_N * np.stack([np.einsum("nj,nj->n", before[:, :3, 2], m) for m in pushes], axis=1)

    return Form(
        port,
        (",".join(f"q{k}" for k in range(joint + 1, drivers.n_joints + 1)),),
        Shape.LINEAR,
        "joint-compliance",
        variant="hand force",
        function=function,
        names=("push_x_compliance_rad_nm", "push_y_compliance_rad_nm", "push_z_compliance_rad_nm"),
        limit=LIMIT_RAD_NM,
        sentence=f"Joint {joint} yields to the hand that presses the probe: {{push_x_compliance_rad_nm}}, "
        "{push_y_compliance_rad_nm}, {push_z_compliance_rad_nm} for 10 N along x, y, z of the tool",
        directions=direction,
    )


EFFECT = Kind(
    "joint-compliance",
    "A hand presses the probe into its seat; bearings and tubes give way, by force times lever.",
    ("encoder-eccentricity", "tool-sag"),
    "mismatch catalogue: arm CMM, elastic under hand force; torque = axis . (lever x force)",
    _terms,
)
