"""Chooses mechanisms for a session, from what its rig has room for, and brings each to the wanted effect over noise."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from simulators.arm.kinematics import forward
from simulators.arm.statics import weigh
from simulators.conceal.effect_over_noise import INVISIBLE, Scale
from simulators.conceal.plan import Timetable
from simulators.conceal.rig import Artefacts, DualPsd
from simulators.conceal.rigs import DrawnRig
from simulators.conceal.wanted import INSTRUMENT, ConcealError, Wanted
from simulators.defects import MECHANISMS, Defect, Site, UnsuitedError

CARRIES = 0.02  # of the largest torque's spread: a joint below it feels no weight


def site_of(wanted: Wanted, drawn: DrawnRig, table: Timetable) -> Site:
    """Its joints, loads, ranges and times."""
    true, scene = drawn.true, table.scene
    arm = true.arm
    frames = forward(arm, scene.goal_rad + arm.zero_rad)
    foot = np.broadcast_to(np.eye(4), (len(scene), 4, 4))
    torque_nm = np.std(weigh(arm, frames, foot, scene.payload_kg, scene.payload_com_m).torque_nm, axis=0)
    places = (1,) if not isinstance(true.instrument, DualPsd) else tuple(range(1, len(true.instrument.places) + 1))
    seats = tuple(range(1, true.instrument.cones + 1)) if isinstance(true.instrument, Artefacts) else ()
    felt = np.flatnonzero(torque_nm > CARRIES * torque_nm.max()) if torque_nm.any() else []
    loaded = tuple(int(index) + 1 for index in felt)
    return Site(
        n_joints=arm.n_joints,
        instrument=INSTRUMENT[wanted.family],
        loaded=loaded,
        torque_nm=tuple(torque_nm.tolist()),
        gear_ratio=drawn.drawing.gear_ratio,
        link_length_m=tuple(np.linalg.norm(arm.fixed[:, :3, 3], axis=1).tolist()),
        sweep_rad=tuple(np.ptp(scene.goal_rad, axis=0).tolist()),
        usual_rad=tuple((float(low), float(high)) for low, high in np.quantile(scene.goal_rad, (0.1, 0.9), axis=0).T),
        places=places,
        stays_s=table.stays_s,
        seats=seats,
        half_size_m=true.instrument.half_size_m if isinstance(true.instrument, DualPsd) else 0.0,
        duration_s=float(scene.t_s[-1]),
        extras=tuple(scene.extra),
    )


TRIES = 12
CLOSE = 0.95  # of the wanted effect: less is drawn again, for another joint may show it better
OUTSIDE = "unknown"


@dataclass(frozen=True)
class Hidden:
    """One mechanism as it is in this session."""

    defect: Defect
    enr: float  # of this one alone, after geometry
    raw: float  # the same before geometry


def choose(wanted: Wanted, rng: np.random.Generator) -> tuple[type[Defect], ...]:
    """The mechanisms asked for. ConcealError for an unknown name or one that the family cannot show."""
    possible = [kind for kind in MECHANISMS if INSTRUMENT[wanted.family] in kind.INSTRUMENTS]
    chosen: list[type[Defect]] = []
    for name in wanted.defects:
        if name in ("any", "outside"):
            among = [k for k in possible if (k.PHYSICS == OUTSIDE) == (name == "outside")]
            fresh = [k for k in among if k not in chosen and _agree(k, chosen)] or among
            chosen.append(fresh[int(rng.integers(len(fresh)))])
        else:
            chosen.append(_named(name, possible))
    return tuple(chosen)


def _agree(kind: type[Defect], chosen: Sequence[type[Defect]]) -> bool:
    """Mechanisms that want different habits of the session are not drawn together."""
    habits = {other.HABIT for other in (*chosen, kind)} - {""}
    return len(habits) <= 1


def _named(name: str, possible: Sequence[type[Defect]]) -> type[Defect]:
    for kind in possible:
        if name == kind.KIND:
            return kind
    names = ", ".join(kind.KIND for kind in possible)
    raise ConcealError(f"defect '{name}' cannot be hidden in this family; there are {names}, any, outside")


def spares(wanted: Wanted, kinds: Sequence[type[Defect]], rng: np.random.Generator) -> tuple[type[Defect], ...]:
    """What may stand in for a drawn mechanism that does not fit: none where each was asked for by name."""
    if any(name not in ("any", "outside") for name in wanted.defects):
        return ()
    possible = [kind for kind in MECHANISMS if INSTRUMENT[wanted.family] in kind.INSTRUMENTS and kind not in kinds]
    outside = {kind.PHYSICS == OUTSIDE for kind in kinds}
    fitting = [k for k in possible if (k.PHYSICS == OUTSIDE) in outside and (_agree(k, kinds) or not k.HABIT)]
    return tuple(fitting[int(index)] for index in rng.permutation(len(fitting)))


def hide(
    wanted: Wanted,
    kinds: Sequence[type[Defect]],
    spare: Sequence[type[Defect]],
    site: Site,
    scale: Scale,
    rng: np.random.Generator,
) -> list[Hidden]:
    """As many defects as `kinds`, each with a port or a driver of its own.

    A kind that this rig cannot have, or that could not be seen, gives way to a spare one; without a spare it stays as
    it is, or ConcealError when it cannot be drawn at all.
    """
    hidden: list[Hidden] = []
    waiting = [*kinds, *spare]
    for number, kind in enumerate(waiting):
        if len(hidden) == len(kinds):
            break
        more = number + 1 < len(waiting) and bool(spare)
        try:
            found = _strongest(wanted, kind, hidden, site, scale, rng)
        except UnsuitedError as reason:
            if not more:
                raise ConcealError(f"{kind.KIND}: {reason}; take another arm, family or seed") from reason
            continue
        if found is not None and (found.enr > INVISIBLE or not more):
            hidden.append(found)
    return hidden


def _strongest(
    wanted: Wanted,
    kind: type[Defect],
    hidden: Sequence[Hidden],
    site: Site,
    scale: Scale,
    rng: np.random.Generator,
) -> Hidden | None:
    """One of this kind that comes close to the wanted effect, or the best of some tries; None: all ports are taken."""
    best: Hidden | None = None
    for _ in range(TRIES):
        drawn = kind.draw(rng, site)
        if wanted.withhold and not columns_of(drawn):
            raise UnsuitedError("no column names it, so none can be withheld")
        if any(_same(one.defect, drawn) for one in hidden):
            continue
        defect, found = scale.brought_to(drawn, wanted.enr)
        if best is None or found > best.enr:
            best = Hidden(defect, found, scale.raw([defect]))
        if found >= CLOSE * wanted.enr:
            break
    return best


def columns_of(defect: Defect) -> frozenset[str]:
    """Columns of samples.csv without which nobody could name it."""
    return frozenset(defect.needs) - {"gear_ratio"}


def _same(one: Defect, other: Defect) -> bool:
    return one.port == other.port and one.drivers == other.drivers
