"""The rig of an emulated world in the words of this package: the same truth, as the fast path reads it."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import msgspec
import numpy as np
from numpy.typing import NDArray

from simulators.arm.drawing import Drawing, Row
from simulators.arm.rigid import moved
from simulators.conceal.rig import DualPsd, Spread, TrueRig
from simulators.world.errors import WorldError
from simulators.world.rig import Emulation, WorldRig
from simulators.world.truth import Truth, arm_of, draw_truth

Floats = NDArray[np.float64]


def rig_of_world(rig: WorldRig, truth: Truth, plain: Mapping[str, Any]) -> TrueRig:
    """Arm, laser and places as they truly are; `plain`: the rig file, which knows the limits of the joints.

    WorldError for a rig without a fixture: there is no light to work out.
    """
    if rig.fixture is None:
        raise WorldError("rig file: [fixture] is missing; readings of a light cannot be worked out without one")
    second, unit = rig.fixture.psd2_in_psd1, np.array(truth.laser_direction)
    joints = plain["arm"]["joint"]
    return TrueRig(
        arm=replace(
            arm_of(rig, truth),
            lower_rad=np.array([joint["lower_rad"] for joint in joints]),
            upper_rad=np.array([joint["upper_rad"] for joint in joints]),
        ),
        tool_point_m=np.zeros(3),
        instrument=DualPsd(
            laser_origin_m=np.array(truth.laser_origin_m),
            laser_direction=unit / np.linalg.norm(unit),
            half_size_m=rig.fixture.half_size_m,
            psd2_in_psd1=moved(second.origin_m, second.rotation_rad),
            places=np.stack([moved(p.psd1_in_base.origin_m, p.psd1_in_base.rotation_rad) for p in truth.placements]),
        ),
    )


def nominal_truth(rig: WorldRig) -> Truth:
    """What the rig file says, and nothing off."""
    return draw_truth(msgspec.structs.replace(rig, emulation=Emulation()), 0)


def drawing_of(plain: Mapping[str, Any], rng: np.random.Generator) -> Drawing:
    """The arm of a rig file; of one in seven nobody knows the masses."""
    joints, flange = plain["arm"]["joint"], plain["arm"].get("flange", {})
    weighed = rng.random() >= 0.15
    return Drawing(
        name=plain["name"],
        model="dh",
        rows=tuple(Row(j["a_m"], j["alpha_rad"], j["d_m"], j.get("theta_offset_rad", 0.0)) for j in joints),
        fixed=(),
        flange=(tuple(flange.get("origin_m", (0.0,) * 3)), tuple(flange.get("rotation_rad", (0.0,) * 3))),
        lower_rad=tuple(j["lower_rad"] for j in joints),
        upper_rad=tuple(j["upper_rad"] for j in joints),
        mass_kg=tuple(j["mass_kg"] for j in joints) if weighed else (),
        com_m=tuple((j["com_m"][0], j["com_m"][1], j["com_m"][2]) for j in joints) if weighed else (),
        gear_ratio=tuple(j["gear_ratio"] for j in joints),
        reach_m=sum(float(np.hypot(j["a_m"], j["d_m"])) for j in joints),
    )


def spread_of(rig: WorldRig) -> Spread:
    """What [emulation] draws; PSD 2 stands in PSD 1 as drawn, and masses are what they are."""
    of = rig.emulation
    return Spread(
        length_m=of.length_sigma_m,
        angle_rad=of.angle_sigma_rad,
        zero_rad=of.joint_zero_max_rad / np.sqrt(3.0),
        tool_m=of.laser_origin_sigma_m,
        laser_rad=of.laser_direction_sigma_rad,
        place_m=of.placement_origin_sigma_m,
        place_rad=of.placement_rotation_sigma_rad,
        psd2_m=1e-6,
        psd2_rad=1e-6,
        device_m=0.0,
        device_rad=0.0,
        mass=0.0,
    )
