"""Rows of a table of calls, checks of what they give, and what the emulated arm is at HOME."""

import math
import tomllib
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest

from simulators.ur.controller_kinematics import IDENTITY, NominalArm, frame_of, pose_of
from simulators.world.model import build_mjcf
from simulators.world.rig import ARMATURE_KG_M2, read_rig
from simulators.world.truth import draw_truth

HOME = [0.0, -1.5, 1.5, -1.5, -1.5, 0.0]
ARRIVED_RAD, ARRIVED_M = 2e-5, 2e-5  # a move has ended within 1e-5 rad, and the encoders count in 1.2e-5 rad
TOOL = [0.0, 0.0, 0.1, 0.0, 0.0, 0.0]
TOOL_KG, TOOL_COM_M = 0.4, [0.0, 0.02, 0.04]  # of the rig: stated to the controller from its start
G_M_S2 = 9.81
STEP_S = 0.002
ZEROS = [0.0] * 6


@dataclass(frozen=True)
class Refused:
    """The call raises, and the message holds these words."""

    words: str


Check = Callable[[Any], bool]


@dataclass(frozen=True)
class Row:
    """One call; `gives` is a check, a value to compare with, or how it is refused.

    `again`: the value is on its way (the arm comes to rest first, ur_rtde returns before the answer has arrived), so
    the call is repeated for 0.2 s of the controller, and then until it gives what it has to, where that is a value.
    `until`: repeated until the result contains that text.
    """

    on: str
    call: str
    args: tuple[Any, ...] = ()
    gives: Any = None
    again: bool = False
    until: str | None = None

    @property
    def step(self) -> dict[str, Any]:
        step = {"on": self.on, "call": self.call, "args": list(self.args)}
        if self.until is not None:
            return step | {"until": self.until}
        if not self.again:
            return step
        wanted = self.gives if isinstance(self.gives, Near) else Near(self.gives, 0.0)
        reaches = {"reaches": [wanted.expected, wanted.tolerance]} if not callable(wanted.expected) else {}
        return step | {"again": True} | reaches

    def agrees(self, result: dict[str, Any]) -> bool:
        if isinstance(self.gives, Refused):
            return self.gives.words in result.get("error", "")
        if "value" not in result:
            return False
        value = result["value"]
        return bool(self.gives(value)) if callable(self.gives) else value == self.gives


def verb(verb_name: str, /, **arguments: Any) -> Row:
    """Something that a person does at the robot."""
    return Row("world", "do", (verb_name, arguments), gives=lambda answer: not str(answer).startswith("refused"))


@dataclass(frozen=True)
class Near:
    """A check: a number, or all numbers of a list."""

    expected: Any
    tolerance: float

    def __call__(self, value: Any) -> bool:
        return bool(value == pytest.approx(self.expected, abs=self.tolerance))


def near(expected: Any, tolerance: float) -> Near:
    return Near(expected, tolerance)


def arrives(on: str, call: str, expected: Sequence[float], tolerance: float, args: tuple[Any, ...] = ()) -> Row:
    """A position that the arm is on its way to."""
    return Row(on, call, args, gives=Near(list(expected), tolerance), again=True)


def between(low: float, high: float) -> Check:
    """A number or all numbers of a list."""
    return lambda value: all(low <= number <= high for number in (value if isinstance(value, list) else [value]))


def holds(words: str) -> Check:
    return lambda value: words in value


def numbers(count: int) -> Check:
    return lambda value: len(value) == count and all(math.isfinite(number) for number in value)


# --- what the world is


@dataclass(frozen=True)
class Standing:
    """At HOME: the poses that the controller calculates, and what the true arm weighs and where it is."""

    pose: list[float]
    tool_pose: list[float]
    jacobian: list[float]
    mass_matrix_kg_m2: list[float]
    gravity_nm: list[float]
    true_z_m: float


def at_home() -> Standing:
    rig = tomllib.loads((Path(__file__).parents[3] / "rigs/ur5e-dual-psd.toml").read_text())
    arm = NominalArm.from_rig(rig)
    checked = read_rig(rig)
    truth = draw_truth(checked, checked.emulation.seed)
    model: Any = mujoco.MjModel.from_xml_string(build_mjcf(checked, truth))
    state: Any = mujoco.MjData(model)
    state.qpos[:] = np.add(HOME, truth.joint_zero_rad)
    mujoco.mj_forward(model, state)
    full = np.empty((6, 6))
    mujoco.mj_fullM(model, state, full)
    rotors = ARMATURE_KG_M2 * np.eye(6)  # get_mass_matrix() leaves them out
    return Standing(
        list(pose_of(arm.forward(HOME)[0])),
        list(pose_of(arm.tool(HOME, frame_of(TOOL)))),
        arm.jacobian(HOME, IDENTITY)[0].T.ravel().tolist(),
        (full - rotors).T.ravel().tolist(),
        state.qfrc_bias.tolist(),
        float(state.site("flange").xpos[2]),
    )


NOW = at_home()
# the joints stand within repeatability and a count of HOME: 5e-5 rad times 40 N m, and 3 kg m^2
STANDS_NM, STANDS_KG_M2 = 2e-3, 2e-4


def shifted(pose: Sequence[float], dz_m: float) -> list[float]:
    return [*pose[:2], pose[2] + dz_m, *pose[3:]]
