"""Bending link: the weight behind it bends a link about its own axes."""

import numpy as np

from calibrate.effects.drivers import Drivers
from calibrate.effects.form import Floats, Form
from calibrate.effects.gravity import moment_behind_nm, weight_behind_n
from calibrate.effects.kind import Kind
from calibrate.effects.link_thermal_growth import link_vectors
from calibrate.effects.ports import Place, Port
from calibrate.effects.term import Shape, Term
from calibrate.effects.time_laws import varies
from calibrate.rigid import cross

LIMIT_RAD_NM = 5e-4  # ten times the softest link of a small arm (mismatch catalogue: 1 to 50 urad per Nm)
PARALLEL = 0.1  # sine between link and axis
SHORTEST_M = 0.02


def _terms(drivers: Drivers) -> tuple[Term, ...]:
    return tuple(
        _term(link, ways)
        for link in range(1, drivers.n_joints)
        if np.linalg.norm(link_vectors(drivers, link)[0]) >= SHORTEST_M and varies(moment_behind_nm(drivers, link))
        for ways in (1, 2)
    )


def _term(link: int, ways: int) -> Term:
    """As stiff all round, or with a stiffness of its own about each of two axes across the link."""

    def function(drivers: Drivers, inner: Floats) -> Floats:
        r = link_vectors(drivers, link)
        end, by_weight = moment_behind_nm(drivers, link), cross(r, weight_behind_n(drivers, link))
        along = r / np.linalg.norm(r, axis=1, keepdims=True)
        slopes, sags = _ways(end + by_weight / 2.0, along, ways), _ways(end / 2.0 + by_weight / 3.0, along, ways)
        out = np.zeros((len(r), 6, ways))
        for k, (slope, sag) in enumerate(zip(slopes, sags, strict=True)):
            out[:, 3:, k] = slope
            out[:, :3, k] = cross(sag, r)
        return out

    return Form(
        Port(f"link{link}.tilt", Place.FRAME, link),
        (f"gravity_torque{link}", f"gravity_torque{link + 1}"),
        Shape.LINEAR,
        "link-bending",
        variant="" if ways == 1 else "each way its own",
        function=function,
        names=("compliance_rad_nm",) if ways == 1 else ("compliance_u_rad_nm", "compliance_v_rad_nm"),
        limit=LIMIT_RAD_NM,
        sentence=f"Link {link} bends by {{compliance_rad_nm}}: soft"
        if ways == 1
        else f"Link {link} bends by {{compliance_u_rad_nm}} one way, {{compliance_v_rad_nm}} the other: soft",
    )


def _ways(moment: Floats, along: Floats, ways: int) -> list[Floats]:
    """Of a moment (pose, 3) what bends: all of it across the link, or its parts about two axes across the link."""
    across = moment - np.einsum("ni,ni->n", moment, along)[:, None] * along
    if ways == 1:
        return [across]
    u = np.cross(along, np.array([0.0, 0.0, 1.0]))  # square to the next joint's axis
    if np.linalg.norm(u[0]) < PARALLEL:  # the link runs along that axis
        u = np.cross(along, np.array([1.0, 0.0, 0.0]))
    u /= np.linalg.norm(u, axis=1, keepdims=True)
    first = np.einsum("ni,ni->n", across, u)[:, None] * u
    return [first, across - first]


EFFECT = Kind(
    "link-bending",
    "A link is a beam: the moment of all it carries turns its end.",
    ("joint-compliance", "base-compliance"),
    "cantilever with end force P and end moment M: slope (M + PL/2) L/EI, sag (M/2 + PL/3) L^2/EI; Young, Budynas, "
    "Roark's Formulas for Stress and Strain, 7th ed., table 8.1, cases 1a and 3a",
    _terms,
)
