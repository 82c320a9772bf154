"""truth.json: everything that was hidden, and what an exact instrument would have said."""

from dataclasses import asdict, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from simulators.arm.drawing import origin_and_rotation
from simulators.conceal.case import Case
from simulators.conceal.chain import stand
from simulators.conceal.hide import Hidden
from simulators.conceal.poses import free_poses
from simulators.conceal.readings import tip_m
from simulators.conceal.rig import ENCODER_RAD, Device, DualPsd, TrueRig
from simulators.conceal.second_encoders import at_the_flange
from simulators.defects import Scene

Floats = NDArray[np.float64]
FREE_POSES = 200
SEED_OF_GRID = 20260101  # the same unseen poses for every case of one arm


def truth_document(case: Case) -> dict[str, Any]:
    """Defects, geometry, noise, noise-free readings, and poses over the workspace that nobody measured."""
    return {
        "schema": 1,
        "wanted": asdict(case.wanted),
        "defects": [_defect(one) for one in case.hidden],
        "withheld": list(case.withheld),
        "noise": {
            "kind": case.wanted.noise,
            "sigma_m": case.sigma_m,
            "encoder_sigma_rad": ENCODER_RAD if case.wanted.family == "cones" else 0.0,
            "rms_m": float(np.sqrt(np.mean((case.values_m - case.exact.values_m) ** 2))),
        },
        "payload_kg": sorted(set(case.table.scene.payload_kg.tolist())),
        "payload_com_m": case.table.scene.payload_com_m.tolist(),
        "rig": _rig(case.drawn.true),
        "exact": {"readings_rad": case.exact.reading_rad.tolist(), "values_m": case.exact.values_m.tolist()},
        "free_space": _free_space(case),
    }


def _defect(one: Hidden) -> dict[str, Any]:
    defect = one.defect
    return {
        "mechanism": defect.KIND,
        "physics": defect.PHYSICS,
        "port": defect.port,
        "drivers": list(defect.drivers),
        "needs": list(defect.needs),
        "size_field": defect.SIZE,
        "fields": dict(vars(defect)),
        "figures": dict(defect.figures),
        "enr": one.enr,
        "enr_before_geometry": one.raw,
    }


def _rig(rig: TrueRig) -> dict[str, Any]:
    arm, instrument = rig.arm, rig.instrument
    document: dict[str, Any] = {
        "link": [_pose(part) for part in arm.fixed],
        "zero_rad": arm.zero_rad.tolist(),
        "mass_kg": arm.mass_kg.tolist(),
        "com_turning_m": arm.com_m.tolist(),
        "tool_kg": arm.tool_kg,
        "tool_com_m": arm.tool_com_m.tolist(),
        "tool_point_m": rig.tool_point_m.tolist(),
    }
    if isinstance(instrument, DualPsd):
        document |= {
            "laser_origin_m": instrument.laser_origin_m.tolist(),
            "laser_direction": instrument.laser_direction.tolist(),
            "psd2_in_psd1": _pose(instrument.psd2_in_psd1),
            "psd1_in_base": [_pose(place) for place in instrument.places],
        }
    elif isinstance(instrument, Device):
        document["device"] = _pose(instrument.pose)
    else:
        document["seat_m"] = instrument.seat_m.tolist()
    return document


def _pose(pose: Floats) -> dict[str, Any]:
    origin_m, rotation_rad = origin_and_rotation(pose)
    return {"origin_m": list(origin_m), "rotation_rad": list(rotation_rad)}


def _free_space(case: Case) -> dict[str, Any]:
    """Unseen poses at the start of the session: encoder readings, approach, and where the tool truly is."""
    rng = np.random.default_rng(SEED_OF_GRID)
    reading_rad = free_poses(case.drawn.believed.arm, FREE_POSES, rng)
    scene = at_start(case.table.scene, reading_rad, rng)
    true = case.drawn.true
    defects = [one.defect for one in case.hidden]
    felt = defects if case.wanted.encoders is None else at_the_flange(defects, case.wanted.encoders)
    stance = stand(true, scene, felt, reading_rad)
    found: dict[str, Any] = {
        "reading_rad": reading_rad.tolist(),
        "approach": np.sign(scene.last_move_rad).astype(int).tolist(),
    }
    instrument = true.instrument
    if isinstance(instrument, DualPsd):
        tool = stance.T_base_tool
        origin_m = tool[:, :3, :3] @ instrument.laser_origin_m + tool[:, :3, 3]
        return found | {
            "beam_origin_m": origin_m.tolist(),
            "beam_direction": (tool[:, :3, :3] @ instrument.laser_direction).tolist(),
        }
    return found | {"tip_m": tip_m(true, stance).tolist()}


def at_start(scene: Scene, reading_rad: Floats, rng: np.random.Generator) -> Scene:
    """Other poses under the conditions of the first sample: standing, unloaded, nothing warm."""
    rows = len(reading_rad)

    def held(values: Floats) -> Floats:
        return np.full(rows, values[0])

    return replace(
        scene,
        t_s=np.zeros(rows),
        via_rad=reading_rad - rng.choice([-1.0, 1.0], reading_rad.shape) * 0.05,
        goal_rad=reading_rad,
        qd_rad_s=np.zeros_like(reading_rad),
        wait_s=np.full(rows, 60.0),
        payload_kg=np.zeros(rows),
        placement=np.zeros(rows, dtype=np.int64),
        first_psd=np.zeros(rows, dtype=np.int64),
        seat=np.zeros(rows, dtype=np.int64),
        temperature_degC={where: held(values) for where, values in scene.temperature_degC.items()},
        laser_power=np.ones(rows),
        extra={name: held(values) for name, values in scene.extra.items()},
    )
