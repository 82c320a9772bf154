"""What a defect may know of the rig and session that it is drawn for."""

import numpy as np

from simulators.arm.kinematics import forward
from simulators.arm.statics import weigh
from simulators.conceal.rig import Artefacts, DualPsd
from simulators.conceal.rigs import DrawnRig
from simulators.conceal.schedule import Timetable
from simulators.conceal.wanted import INSTRUMENT, Wanted
from simulators.defects.scene import Site

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
