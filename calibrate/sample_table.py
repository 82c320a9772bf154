"""A session's samples beside the arm as drawn: readings, filled rows, and frames and points found in closed form."""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from acquisition.recording.columns import POSITION
from acquisition.recording.rig_schema import Rig
from acquisition.recording.samples import Samples
from calibrate.alignment import Alignment, align, align_with_tool, pivot, trilaterate
from calibrate.arms.model import KinematicModel
from calibrate.errors import DataError
from calibrate.observation_model import ObservationModel
from calibrate.parameters import start_values
from calibrate.problem import Problem
from calibrate.read_samples import Angles
from calibrate.rigid import transform
from calibrate.sensors.device import Device
from calibrate.sensors.target import UNKNOWN_PLAUSIBLE_M, Target
from calibrate.weighting import Measured

Floats = NDArray[np.float64]
Indices = NDArray[np.intp]


class Positions(Enum):
    """How measured positions are used."""

    FRAME = "in the device's frame, which is found"
    DISTANCE = "as distances between consecutive poses, without a frame"


class Spots(Enum):
    """How spots on the dual PSD are used."""

    REFLECTION = "as spots of a beam that both faces reflect"
    POINT = "centred ones only, as lines through one point of each placement"


@dataclass(frozen=True)
class SampleTable:
    """Nothing here is iterated or guessed. DataError where samples and rig do not hold what a property needs."""

    samples: Samples
    rig: Rig
    arm: KinematicModel
    angles: Angles
    positions: Positions
    spots: Spots

    @cached_property
    def q_rad(self) -> Floats:
        q = self.samples.joints() if self.angles == "reported" else self.samples.encoders()
        if q is None:
            raise DataError("samples: no columns enc1_rad ...; fit the reported angles instead")
        if q.shape[1] != self.arm.n_joints:
            raise DataError(
                f"samples have {q.shape[1]} joints, the arm has {self.arm.n_joints}; use the session's own rig"
            )
        return q

    @cached_property
    def T_base_flange(self) -> Floats:
        return self.arm.flange(start_values(self.arm.parameters), self.q_rad)

    def filled(self, *names: str) -> Indices:
        """Rows in which all of these columns hold a value; none where a column is absent."""
        if not all(name in self.samples for name in names):
            return np.zeros(0, dtype=np.intp)
        rows = np.flatnonzero(np.all(np.isfinite(self.stacked(names)), axis=1))
        bad = rows[~np.all(np.isfinite(self.q_rad[rows]), axis=1)]
        if len(bad):
            raise DataError(
                f"samples row {bad[0] + 1}: {names[0]} but no joint angles; complete the row or empty the cell"
            )
        return rows

    def stacked(self, names: tuple[str, ...]) -> Floats:
        return np.stack([self.samples.column(name) for name in names], axis=1)

    @cached_property
    def _placed(self) -> tuple[Alignment | None, Target]:
        """Device frame and target: the target as the rig says, else found with the frame or with the seats."""
        rows = self.filled(*POSITION)
        framed = len(rows) > 0 and self.positions is Positions.FRAME
        point = self.rig.tool.point_m
        if point is not None:
            target = Target(np.array(point))
            tips = target.in_base(np.zeros(3), self.T_base_flange)
            return (align(tips[rows], self.position_m[rows]) if framed else None), target
        if len(rows) > 0:
            found, tool_m = align_with_tool(self.T_base_flange[rows], self.position_m[rows])
            return (found if framed else None), Target(tool_m, UNKNOWN_PLAUSIBLE_M)
        rows = self.filled("seat")
        if len(rows) > 0:
            tool_m, _ = pivot(self.T_base_flange[rows], self.samples.integers("seat", 0)[rows])
            return None, Target(tool_m, UNKNOWN_PLAUSIBLE_M)
        raise DataError(f"rig {self.rig.name}: wire and bar rows need tool.point_m, the target in the flange frame")

    @cached_property
    def position_m(self) -> Floats:
        return self.stacked(POSITION)

    @property
    def alignment(self) -> Alignment | None:
        return self._placed[0] if len(self.filled(*POSITION)) else None

    @property
    def target(self) -> Target:
        return self._placed[1]

    @cached_property
    def tips_m(self) -> Floats:
        return self.target.in_base(np.zeros(3), self.T_base_flange)

    @cached_property
    def device(self) -> Device:
        """As the rig says, else as found; of a drum alone only the origin is found, and its axes are the base's."""
        if (given := self.rig.device) is not None:
            tolerance = self.rig.tolerance
            prior = None
            if tolerance is not None and tolerance.device_m is not None and tolerance.device_rad is not None:
                prior = (tolerance.device_m, tolerance.device_rad)
            return Device(transform(given.origin_m, given.rotation_rad), prior)
        if self.alignment is not None:
            return Device(self.alignment.T_a_b)
        rows = self.filled("wire_m")
        T_base_device = np.eye(4)
        T_base_device[:3, 3] = trilaterate(self.tips_m[rows], self.samples.column("wire_m")[rows])
        return Device(T_base_device)

    def measured(
        self,
        name: str,
        chain: ObservationModel,
        rows: Indices,
        observed: Floats,
        own: Mapping[str, Floats],
        *,
        condition: bool = False,
    ) -> Measured:
        """`rows` (row,) of single poses or (row, 2) of pairs; unit weights until the noise is known.

        `condition`: as in Problem.
        """
        which = rows.reshape(len(rows), -1)
        k = observed.shape[1]
        q = self.q_rad[which].reshape(len(rows), -1)
        weight = np.broadcast_to(np.eye(k), (len(rows), k, k))
        problem = Problem(chain, chain.parameters, q, observed, weight, condition=condition)
        return Measured(name, problem, own, which)
