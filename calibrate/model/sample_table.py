"""A session's samples beside the nominal arm: readings, filled rows, and frames and points found in closed form."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from acquisition.recording import Samples
from acquisition.recording.rig import Rig
from acquisition.recording.samples import POSITION, TARGET
from calibrate.errors import DataError
from calibrate.model.alignment import Alignment, align, align_with_tool
from calibrate.model.chain import KinematicModel, ObservationModel
from calibrate.model.observations import Angles
from calibrate.model.parameters import start_values
from calibrate.model.placement import (
    UNKNOWN_PLAUSIBLE_M,
    Device,
    SeveralTargets,
    Target,
    targets_of,
)
from calibrate.model.problem import Measured, Problem
from calibrate.model.rigid import transform

Floats = NDArray[np.float64]
Indices = NDArray[np.intp]


@dataclass(frozen=True)
class SampleTable:
    """Nothing here is iterated or guessed. DataError where samples and rig do not hold what a property needs."""

    samples: Samples
    rig: Rig
    arm: KinematicModel
    angles: Angles
    framed: bool  # whether positions are used in the device's frame, which is found
    points: tuple[Callable[["SampleTable"], Floats | None], ...] = ()  # ways to find the target where the rig has none

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
    def _aligned(self) -> tuple[Alignment | None, Floats | None]:
        """Device frame, and the target (3,) in the flange where it had to be found with the frame."""
        rows = self.filled(*POSITION)
        if len(rows) == 0:
            return None, None
        several = self.targets(rows)
        if several is not None:
            shifts = start_values(several.parameters)
            tips = several.in_base(shifts, self.T_base_flange[rows])
            return (align(tips, self.position_m[rows]) if self.framed else None), None
        point = self.rig.tool.point_m
        if point is not None:
            tips = Target(np.array(point)).in_base(np.zeros(3), self.T_base_flange)
            return (align(tips[rows], self.position_m[rows]) if self.framed else None), None
        found, tool_m = align_with_tool(self.T_base_flange[rows], self.position_m[rows])
        return (found if self.framed else None), tool_m

    @cached_property
    def position_m(self) -> Floats:
        return self.stacked(POSITION)

    @property
    def alignment(self) -> Alignment | None:
        """Of the positions with the nominal arm."""
        return self._aligned[0]

    @property
    def tool_seen_m(self) -> Floats | None:
        """(3,) the target as found with the device's frame; None where the rig states it, or without positions."""
        return self._aligned[1]

    @cached_property
    def target(self) -> Target:
        """As the rig states, else as the first of the sensors that can finds it."""
        point = self.rig.tool.point_m
        if point is not None:
            return Target(np.array(point))
        for find in self.points:
            found_m = find(self)
            if found_m is not None:
                return Target(found_m, UNKNOWN_PLAUSIBLE_M)
        raise DataError(
            f"rig {self.rig.name}: wire, bar and plane rows need tool.point_m, the target in the flange frame"
        )

    def targets(self, rows: Indices) -> SeveralTargets | None:
        """Those that the samples name at these rows; None where they name none, and the tool's point is meant.

        DataError for several that the rig does not have: one point for all of them would be their scatter.
        """
        named = self.samples.integers(TARGET, 0)[rows]
        if not self.rig.targets:
            if len(seen := sorted(set(named.tolist()) - {0})) > 1:
                numbers = ", ".join(map(str, seen))
                raise DataError(
                    f"samples: targets {numbers}, but rig {self.rig.name} has no [[target]]; add one for each"
                )
            return None
        return targets_of(self.rig, named) if named.any() else None

    @cached_property
    def tips_m(self) -> Floats:
        return self.target.in_base(np.zeros(3), self.T_base_flange)

    def device(self, origin_m: Callable[[], Floats] | None = None) -> Device:
        """As the rig states, else as the positions have it, else about an origin (3,) in the axes of the base."""
        if (given := self.rig.device) is not None:
            tolerance = self.rig.tolerance
            prior = None
            if tolerance is not None and tolerance.device_m is not None and tolerance.device_rad is not None:
                prior = (tolerance.device_m, tolerance.device_rad)
            return Device(transform(given.origin_m, given.rotation_rad), prior)
        if self.alignment is not None:
            return Device(self.alignment.T_a_b)
        T_base_device = np.eye(4)
        if origin_m is not None:
            T_base_device[:3, 3] = origin_m()
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
