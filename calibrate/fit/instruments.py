"""From a session's samples and its rig to the instruments that the columns allow, all at once, with a start value.

A column group makes an instrument wherever its cells are filled (calibrate/model/sensors/catalogue.py); known distances
between placements come from the rig. Frames and points that nobody states are found in closed form from the arm as
drawn, so that no start has to be guessed.
"""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from acquisition.recording import Samples
from acquisition.recording.rig import Rig
from acquisition.recording.samples import POSITION, TARGET
from calibrate.errors import DataError
from calibrate.fit.weighting import Weighting
from calibrate.model.alignment import Alignment
from calibrate.model.arms.catalogue import arm_of
from calibrate.model.chain import KinematicModel
from calibrate.model.dual_psd_rig import assumed_noise
from calibrate.model.observations import Angles
from calibrate.model.parameters import start_values
from calibrate.model.problem import Measured
from calibrate.model.rigid import inverse
from calibrate.model.sample_table import SampleTable
from calibrate.model.sensors.catalogue import SENSORS, used_with
from calibrate.model.sensors.kind import SensorKind, Trait

Floats = NDArray[np.float64]
Indices = NDArray[np.intp]


@dataclass(frozen=True)
class Instruments:
    """What the samples allow. `weighting` makes problems of it."""

    weighting: Weighting
    start: Floats  # (param,) closed-form start values, in the order of weighting.parameters
    alignment: Alignment | None  # of the positions with the nominal arm; shows whether an axis is mirrored
    unused: Indices  # rows of the samples that hold no observation, or only one that could not be used


def instruments_of(
    samples: Samples,
    rig: Rig,
    *,
    arm: KinematicModel | None = None,
    angles: Angles = "reported",
    asked: Iterable[str] = (),
) -> Instruments:
    """All instruments of a session. `arm`: another model than the rig's own under its drawing tolerance.

    `asked`: names of sensors, of those that use the same readings in another way or are used only where asked for.

    DataError where no row holds an observation, or where columns and rig contradict each other.
    """
    kinds = used_with(asked)
    framed = any(Trait.IN_SPACE in kind.traits and kind.columns == POSITION for kind in kinds)
    points = tuple(kind.point_m for kind in SENSORS)
    table = SampleTable(samples, rig, arm_of(rig) if arm is None else arm, angles, framed, points)
    built = [(kind, kind.build(table)) for kind in kinds]
    measured = tuple(found for _, found in built if found is not None)
    _refuse_targets(samples, rig, tuple((kind, found) for kind, found in built if found is not None))
    if all(Trait.BETWEEN_ENCODERS in kind.traits for kind, found in built if found is not None):
        raise DataError(
            "samples: no row holds an observation; columns of one are psd1_x_m ... with placement and first_psd, "
            "x_m y_m z_m, camera_x_m ..., wire_m, seat, plane, or bar with bar_end"
        )
    known = tuple(block for kind, found in built if found is not None for block in kind.lengths(table))
    weighting = Weighting(measured, assumed_noise(rig).joint_rad, known)
    used = np.unique(np.concatenate([instrument.sample_rows.ravel() for instrument in measured]))
    unused = np.setdiff1d(np.arange(len(samples)), used)
    return Instruments(weighting, _start(table, weighting), table.alignment, unused)


def _refuse_targets(samples: Samples, rig: Rig, built: tuple[tuple[SensorKind, Measured], ...]) -> None:
    """DataError where rows name targets to an instrument that knows the tool's point only."""
    named = samples.integers(TARGET, 0)
    for kind, found in built:
        if Trait.TARGET in kind.traits and Trait.SEVERAL_TARGETS not in kind.traits:
            theirs = named[found.sample_rows]
            if not rig.targets and len(np.unique(theirs[theirs > 0])) < 2:
                continue
            for row in found.sample_rows[theirs.any(axis=1)][:1, 0].tolist():
                raise DataError(
                    f"samples row {row + 1}: target {named[row]}, but {kind.noun} are read at [tool] point_m only; "
                    "empty the cell, or give positions of the targets"
                )


def _start(table: SampleTable, weighting: Weighting) -> Floats:
    """Nominal, but a device that the rig places elsewhere than the data do starts where the data want it."""
    out = start_values(weighting.parameters)
    names = [p.name for p in weighting.parameters]
    if table.rig.device is None or table.alignment is None or "device.yaw" not in names:
        return out
    apart = inverse(table.device().T_base_device) @ table.alignment.T_a_b
    first = names.index("device.x")
    out[first : first + 3] = apart[:3, 3]
    out[first + 3 : first + 6] = Rotation.from_matrix(apart[:3, :3]).as_rotvec()
    return out
