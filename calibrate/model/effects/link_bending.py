"""Bending link: the weight behind it bends a link about its own axes."""

from collections.abc import Sequence

import numpy as np

from calibrate.model.effects.drivers import SHORTEST_M, Drivers, beyond_end_m, link_vectors
from calibrate.model.effects.gravity import bending_nm, weights_n
from calibrate.model.effects.kind import Kind
from calibrate.model.effects.loads import Load, carried, states_masses
from calibrate.model.effects.ports import Place, Port
from calibrate.model.effects.term import Floats, Shape, Term
from calibrate.model.effects.time_laws import varies
from calibrate.model.effects.weighed import (
    By,
    Weighed,
    by_corrected,
    by_stated,
    by_unknown,
    soft,
)
from calibrate.model.rigid import cross

LIMIT_RAD_NM = 5e-4  # ten times the softest link of a small arm (mismatch catalogue: 1 to 50 µrad per Nm)
LIMIT_RAD = 1e-2  # of the slope, where masses are not known
PARALLEL = 0.1  # sine between link and axis


def _terms(drivers: Drivers) -> tuple[Term, ...]:
    links = [
        link for link in range(1, drivers.n_joints) if np.linalg.norm(link_vectors(drivers, link)[0]) >= SHORTEST_M
    ]
    return tuple(term for link in links for term in _of_link(drivers, link))


def _of_link(drivers: Drivers, link: int) -> list[Term]:
    by = _bent(link)
    torques = f"gravity_torque{link}", f"gravity_torque{link + 1}"
    where = Port(f"link{link}.tilt", Place.FRAME, link), torques, Shape.LINEAR, "link-bending"
    if not states_masses(drivers.rig):
        unknown = by_unknown(drivers, by, link + 1)
        sentence = f"Link {link} bends under its load ({{combination1_rad}} rms): soft; masses are not known"
        return [] if unknown is None else [soft(where, unknown, LIMIT_RAD, sentence)]
    if not varies(bending_nm(drivers, link, carried(drivers)).sum(axis=2)):
        return []
    plain, corrected = by_stated(by), by_corrected(drivers, by)
    bends = f"Link {link} bends by {{compliance_rad_nm}}: soft"
    two = f"Link {link} bends by {{compliance_u_rad_nm}} one way, {{compliance_v_rad_nm}} the other: soft"
    terms: list[Term] = [soft(where, plain, LIMIT_RAD_NM, bends), soft(where, _each_way(link), LIMIT_RAD_NM, two)]
    return terms if corrected is None else [*terms, soft(where, corrected, LIMIT_RAD_NM, bends)]


def _bent(link: int, way: int | None = None) -> By:
    """Bending that is as stiff all round, or of the first or second of two axes across the link alone."""

    def by(drivers: Drivers, loads: Sequence[Load]) -> Floats:
        r = link_vectors(drivers, link)
        along = r / np.linalg.norm(r, axis=1, keepdims=True)
        weights, beyond = weights_n(drivers, link, loads), np.array([0.0, 0.0, beyond_end_m(drivers, link)])
        ends = bending_nm(drivers, link, loads) + np.cross(beyond, weights, axisb=1, axisc=1)
        out = np.zeros((len(r), 6, len(loads)))
        for k, load in enumerate(loads):
            if load.frame <= link:
                continue
            by_weight = cross(r, weights[:, :, k])
            out[:, 3:, k] = _across(ends[:, :, k] + by_weight / 2.0, along, way)
            sag = cross(_across(ends[:, :, k] / 2.0 + by_weight / 3.0, along, way), r)
            out[:, :3, k] = sag + cross(out[:, 3:, k], beyond[None])
        return out

    return by


def _across(moment: Floats, along: Floats, way: int | None) -> Floats:
    """Of a moment (pose, 3) what bends: all of it across the link, or its part about one of two axes there."""
    across = moment - np.einsum("ni,ni->n", moment, along)[:, None] * along
    if way is None:
        return across
    u = np.cross(along, np.array([0.0, 0.0, 1.0]))  # square to the next joint's axis
    if np.linalg.norm(u[0]) < PARALLEL:  # the link runs along that axis
        u = np.cross(along, np.array([1.0, 0.0, 0.0]))
    u /= np.linalg.norm(u, axis=1, keepdims=True)
    first = np.einsum("ni,ni->n", across, u)[:, None] * u
    return first if way == 0 else across - first


def _each_way(link: int) -> Weighed:
    ways = [by_stated(_bent(link, way)) for way in (0, 1)]
    return Weighed(
        lambda drivers: np.concatenate([way.at(drivers) for way in ways], axis=2),
        ("compliance_u_rad_nm", "compliance_v_rad_nm"),
        "each way its own",
    )


EFFECT = Kind(
    "link-bending",
    "A link is a beam: the moment of all it carries turns its end.",
    ("joint-compliance", "base-compliance"),
    "cantilever with end force P and end moment M: slope (M + PL/2) L/EI, sag (M/2 + PL/3) L^2/EI; Young, Budynas, "
    "Roark's Formulas for Stress and Strain, 7th ed., table 8.1, cases 1a and 3a",
    _terms,
)
