"""How a session is run: its habits, its poses and their order."""

from collections.abc import Sequence

import numpy as np

from simulators.conceal.dual_poses import shots
from simulators.conceal.free_poses import free_poses
from simulators.conceal.rig import Artefacts, DualPsd, TrueRig
from simulators.conceal.schedule import COPIES, REPEATED, Habits, Timetable, timetable
from simulators.conceal.seated import seated_plan
from simulators.conceal.wanted import ConcealError, Wanted
from simulators.defects.defect import Defect

ENOUGH = 0.5  # of the wanted poses: fewer are no session
CENTRED = 0.2  # share of the shots that aim at both centres


def draw_habits(wanted: Wanted, kinds: Sequence[type[Defect]], rng: np.random.Generator) -> Habits:
    """Habits that let the defects be seen; the same habits also occur without them, so that they give nothing away."""
    asked = {kind.HABIT for kind in kinds} - {""}
    loads = (0.0, float(np.round(rng.uniform(1.0, 3.0), 1)))
    carries = "payload" in asked or rng.random() < 0.2
    always = (float(np.round(rng.uniform(0.5, 2.5), 1)),) if rng.random() < 0.25 else (0.0,)
    patterned = rng.random() < 0.6 or wanted.withhold
    driven = wanted.family != "cones"
    return Habits(
        patterned=patterned and "direct" not in asked,
        moving="moving" in asked or (driven and not asked and rng.random() < 0.1),
        payload_kg=(loads if carries else always) if driven else (0.0,),
        pause_s=float(rng.choice([0.0, 2400.0])),
    )


def draw_timetable(wanted: Wanted, true: TrueRig, habits: Habits, rng: np.random.Generator) -> Timetable:
    """Poses and their order. ConcealError when the places of this seed let too few poses reach."""
    poses = max(wanted.samples - COPIES * REPEATED, REPEATED)
    instrument = true.instrument
    none = np.zeros(poses, dtype=np.int64)
    if isinstance(instrument, Artefacts):
        reading_rad, seat, linked = seated_plan(true, instrument, poses, rng)
        _refuse_few(len(seat), poses)
        none = np.zeros_like(seat)
        return timetable(reading_rad, none, none, seat, habits, rng, linked)
    if not isinstance(instrument, DualPsd):
        return timetable(free_poses(true.arm, poses, rng), none, none, none, habits, rng)
    each = [poses // wanted.places + (k < poses % wanted.places) for k in range(wanted.places)]
    taken = [shots(true, instrument, k + 1, number, CENTRED, rng) for k, number in enumerate(each)]
    reading_rad = np.concatenate([one.reading_rad for one in taken])
    _refuse_few(len(reading_rad), poses)
    place = np.repeat(np.arange(1, wanted.places + 1), [len(one.reading_rad) for one in taken])
    first = np.concatenate([one.first_psd for one in taken])
    return timetable(reading_rad, place, first, np.zeros_like(place), habits, rng)


def _refuse_few(found: int, poses: int) -> None:
    if found < ENOUGH * poses:
        raise ConcealError(f"only {found} of {poses} poses can be reached with this seed; take another one")
