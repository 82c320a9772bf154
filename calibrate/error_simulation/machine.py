"""The arm whose errors are simulated: fixed parts with turns between them, and the probe behind the last one.

Any serial arm is one (calibrate/arms/serial.py), so that a robot's D-H table and the local product of exponentials of
an arm CMM are perturbed in the same way: six errors behind every fixed part, one at every joint angle. Source: Huang
Kui et al., error simulation of a flexible arm coordinate measuring machine, eq. 1 to 3.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from acquisition.recording.rig import parse_rig
from acquisition.recording.rig_schema import ArmModel, Rig
from calibrate.arms.compiled import PER_PART
from calibrate.arms.rig_arm import RigArm
from calibrate.converted_rig import rig_in_model
from calibrate.errors import DataError
from calibrate.model_file import ModelFile
from calibrate.rigid import cross

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False, kw_only=True)
class Machine(RigArm):
    """Nominal or as identified; the probe is its tool's point."""

    name: str

    def by_slot(self, q_rad: Floats) -> Floats:
        """(pose, 3, slot) derivative of the probe by every slot (calibrate/arms/compiled.py), at no error.

        Shift c of part i moves it by the axis c of B_i, turn c by that axis x (p - o); an angle is a turn about z.
        """
        B = self.frames(q_rad)
        lever = (B[:, -1, :3, :3] @ self.point_m + B[:, -1, :3, 3])[:, None] - B[..., :3, 3]  # (pose, part, 3)
        axes = np.swapaxes(B[..., :3, :3], -1, -2)  # (pose, part, axis, 3)
        turns = cross(axes, np.broadcast_to(lever[:, :, None], axes.shape))
        by = np.concatenate([axes, turns, turns[:, :, 2:]], axis=2)  # (pose, part, 7, 3)
        return np.swapaxes(by.reshape(len(q_rad), -1, 3), 1, 2)

    def drawn_poses(self, count: int, rng: Generator) -> Floats:
        """(pose, joint) readings, evenly between the limits."""
        return rng.uniform(self.lower_rad, self.upper_rad, (count, self.n_joints))


def slot(part: int, component: int) -> int:
    """Number of a slot: components 0 to 5 of a fixed part, 6 for the angle of the joint behind it."""
    return PER_PART * part + component


def machine_of(
    rig: Rig, values: Mapping[str, float] | None = None, about_tool_m: tuple[float, ...] | None = None
) -> Machine:
    """The rig's arm, with `values` of its parameters by name.

    The probe is at `about_tool_m`, else at tool.point_m, else at the flange's origin; `values` of the tool correct it.
    """
    arm = RigArm.of_rig(rig, values)
    shift = [(values or {}).get(f"tool.{axis}", 0.0) for axis in ("x", "y", "z")]
    point = np.array((about_tool_m or rig.tool.point_m or (0.0, 0.0, 0.0))[:3]) + shift
    return Machine(**{**vars(arm), "point_m": point}, name=rig.name)


def identified_machine(model: ModelFile) -> tuple[Machine, Rig]:
    """The arm of a model file as identified, and its rig. DataError for a file without its rig."""
    if model.rig.text is None:
        raise DataError(f"model of rig {model.rig.name}: the rig's text is not in the file; identify again")
    rig = parse_rig(model.rig.text, f"rig.toml in the model of {model.rig.name}")
    rig = rig_in_model(rig, ArmModel(model.arm_model))
    return machine_of(rig, model.chain, model.about.get("tool")), rig
