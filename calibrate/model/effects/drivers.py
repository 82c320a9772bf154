"""What an effect may depend on, one value a pose; and from where to where a link reaches.

Drivers come from the record or from the model, never from what was measured: a measured spot as driver leaks the answer
(a gain would explain any noise). Conditions come from the columns of the samples alone (conditions.py).

In a modified Denavit-Hartenberg table an offset d lies in front of its joint's turn, yet it is the length of the link
behind it: a column stands on its joint. Source: Craig, Introduction to Robotics, 3rd ed., section 3.4 (parameters of
link and joint are assigned by convention, the axis is one).
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from acquisition.recording.rig import ArmModel, Rig
from calibrate.model.sensors.kind import SensorKind, Trait

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Values = TypeVar("Values", Floats, NDArray[np.bool_])
SHORTEST_M = 0.02  # of a link that bends or grows to any purpose


@dataclass(frozen=True, eq=False, kw_only=True)
class Conditions:
    """In the order of the samples. None: not recorded."""

    q_rad: Floats  # (pose, joint) as reported; of a coupled joint from the link in front (uncoupled_samples)
    t_s: Floats  # (pose,)
    approach: Floats | None  # (pose, joint) -1, 0, 1
    approach_derived: bool  # from the order of the samples, not recorded
    last_move_rad: Floats  # (pose, joint) from the sample before
    qd_rad_s: Floats | None  # (pose, joint)
    cmd_minus_q_rad: Floats | None  # (pose, joint)
    temperatures_degC: Mapping[str, Floats]  # where -> (pose,), smoothed over time
    payload_kg: Floats | None  # (pose,)
    payload_com_m: Floats | None  # (pose, 3) in the flange frame
    psd_sum_v: Floats | None  # (pose, 2)
    extra: Mapping[str, Floats]  # every other numeric column, NaN filled
    repeat: Ints | None  # (pose,) group, -1: none

    @property
    def n_joints(self) -> int:
        return self.q_rad.shape[1]


@dataclass(frozen=True, eq=False)
class Readout:
    """One instrument as the model predicts it; rows (pose,) that it does not see are NaN."""

    kind: SensorKind
    predicted: Floats  # (pose, k)
    seen: NDArray[np.bool_]  # (pose,)
    incidence_rad: Floats | None = None  # (pose, 2) of the beam on PSD 1, 2
    lean: Floats | None = None  # (pose, 2, 2) x, y that the arriving beam travels along face 1, 2 per depth
    first_psd: Ints | None = None  # (pose,)
    place: Ints | None = None  # (pose,) placement or seat
    joints: tuple[int, ...] = ()  # (k,) of second encoders, from 1

    @property
    def name(self) -> str:
        return self.kind.name


@dataclass(frozen=True, eq=False, kw_only=True)
class Drivers(Conditions):
    """Of the whole session, in the order of its samples; rows to be predicted stand behind them."""

    rig: Rig
    frames: Floats  # (pose, joint + 1, 4, 4) B_0 ... B_n of the model with its terms
    readouts: Mapping[str, Readout]
    session_rows: int | None = None  # where others stand behind: their number must not change what a basis means

    @property
    def clock_is_a_cause(self) -> bool:
        """Whether a curve over time means anything: in one motion everything is some function of time."""
        return True

    def of_session(self, values: Values) -> Values:
        """Those of values (pose, ...) that means, largest values and ranges are taken of."""
        return values[: self.session_rows]

    @cached_property
    def about_middle(self) -> Floats:
        """(6, 6) shifts, and turns about the middle of what the flange reached, as motions about the base's origin."""
        out = np.eye(6)
        out[:3, 3:] = np.cross(self.of_session(self.frames)[:, -1, :3, 3].mean(axis=0), np.eye(3)).T
        return out

    def having(self, trait: Trait) -> tuple[str, ...]:
        """Names of the instruments of the session that have it, in their order."""
        return tuple(name for name, readout in self.readouts.items() if trait in readout.kind.traits)

    @property
    def light(self) -> Readout | None:
        """Of the spots on a dual PSD."""
        names = self.having(Trait.LIGHT)
        return self.readouts[names[0]] if names else None

    @property
    def gravity_m_s2(self) -> Floats:
        return np.array(self.rig.arm.gravity_m_s2)


def link_vectors(drivers: Drivers, link: int) -> Floats:
    """(pose, 3) from start to end of a link (from 1), in the axes of B_link: constant in a rigid link."""
    B = drivers.frames[:, link]
    start = drivers.frames[:, link - 1, :3, 3] - beyond_end_m(drivers, link - 1) * drivers.frames[:, link - 1, :3, 2]
    end = B[:, :3, 3] - beyond_end_m(drivers, link) * B[:, :3, 2]
    return np.einsum("nji,nj->ni", B[:, :3, :3], end - start)


def beyond_end_m(drivers: Drivers, link: int) -> float:
    """How far along its z the origin of B_link stands beyond the end of a link (0: the base)."""
    arm = drivers.rig.arm
    return (arm.joints[link].d_m or 0.0) if arm.model is ArmModel.MDH and link < drivers.n_joints else 0.0
